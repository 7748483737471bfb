/* png: pictures through libpng, and the sink that writes them.
 *
 * libpng and zlib allocate from one block that is taken at open and starts empty for each picture,
 * so that writing one is bounded and leaves nothing behind. */
#include "display/sink.h"
#include "platform/arena.h"

#include <png.h>
#include <setjmp.h>
#include <stdio.h>
#include <string.h>
#include <zlib.h>

enum {
    /* zlib's deflate takes 256 KB and its state, libpng its structures and an 8 KB buffer. */
    ENCODER_BYTES = 384 << 10,
    ROW_COPIES = 4, /* libpng's row buffers, of 4 bytes a pixel */
    SINK_LEVEL = 1
};

struct fv_png {
    int width, height;
    size_t size, used;
    char *block;
    struct fv_writer *out; /* of the picture under way */
    struct fv_base64 base64;
    char message[160]; /* libpng's error */
    struct fv_writer file;
};

struct fv_png *fv_png_open(int width, int height)
{
    struct fv_png *p = fv_arena_take(fv_arena(), "png", sizeof *p, 64);
    p->width = width;
    p->height = height;
    p->size = ENCODER_BYTES + (size_t)width * 4 * ROW_COPIES;
    p->block = fv_arena_take(fv_arena(), "png", p->size, 64);
    return p;
}

static png_voidp block_take(png_structp png, png_alloc_size_t size)
{
    struct fv_png *p = png_get_mem_ptr(png);
    size_t rounded = (size + 15) & ~(size_t)15;
    if (rounded < size || rounded > p->size - p->used) return NULL;
    void *taken = p->block + p->used;
    p->used += rounded;
    return taken;
}

static void block_free(png_structp png, png_voidp taken)
{
    (void)png, (void)taken;
}

static void on_error(png_structp png, png_const_charp message)
{
    struct fv_png *p = png_get_error_ptr(png);
    snprintf(p->message, sizeof p->message, "%s", message);
    longjmp(png_jmpbuf(png), 1);
}

static void on_warning(png_structp png, png_const_charp message)
{
    (void)png, (void)message;
}

static void write_file(png_structp png, png_bytep bytes, size_t size)
{
    struct fv_png *p = png_get_io_ptr(png);
    fv_writer_bytes(p->out, bytes, size);
    if (p->out->failed) png_error(png, "not written");
}

static void write_base64(png_structp png, png_bytep bytes, size_t size)
{
    struct fv_png *p = png_get_io_ptr(png);
    fv_writer_base64(p->out, &p->base64, bytes, size);
    if (p->out->failed) png_error(png, "not written");
}

static void flush_nothing(png_structp png)
{
    (void)png;
}

/* Everything between setjmp and its longjmp: no local variable lives across. */
static int write_picture(png_structp png, png_infop info, const struct fv_picture *picture, int eye)
{
    if (setjmp(png_jmpbuf(png))) return -1;
    png_set_IHDR(png, info, (png_uint_32)picture->width, (png_uint_32)picture->height, 8, PNG_COLOR_TYPE_RGB,
                 PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_sRGB(png, info, PNG_sRGB_INTENT_PERCEPTUAL);
    png_write_info(png, info);
    png_set_filler(png, 0, PNG_FILLER_AFTER);
    for (int y = 0; y < picture->height; y++)
        png_write_row(png, picture->pixels[eye] + y * picture->stride_bytes);
    png_write_end(png, NULL);
    return 0;
}

static int encode(struct fv_png *p, struct fv_writer *out, png_rw_ptr write, const struct fv_picture *picture,
                  int eye, int level, struct fv_error *error)
{
    if (picture->width < 1 || picture->width > p->width || picture->height < 1 || picture->height > p->height)
        return fv_error_set(error, "png: a picture of %d x %d, but opened for up to %d x %d", picture->width,
                            picture->height, p->width, p->height);
    p->used = 0;
    p->base64 = (struct fv_base64){.carried = 0};
    p->out = out;
    snprintf(p->message, sizeof p->message, "out of its memory");
    png_structp png =
        png_create_write_struct_2(PNG_LIBPNG_VER_STRING, p, on_error, on_warning, p, block_take, block_free);
    png_infop info = png ? png_create_info_struct(png) : NULL;
    if (!info) return fv_error_set(error, "png: %s", p->message);
    png_set_write_fn(png, p, write, flush_nothing);
    png_set_compression_level(png, level);
    png_set_compression_strategy(png, level > 1 ? Z_FILTERED : Z_DEFAULT_STRATEGY);
    png_set_filter(png, PNG_FILTER_TYPE_BASE, level > 1 ? PNG_FILTER_UP | PNG_FILTER_SUB : PNG_FILTER_SUB);
    int failed = write_picture(png, info, picture, eye);
    png_destroy_write_struct(&png, &info);
    return failed ? fv_error_set(error, "png: %s", p->message) : 0;
}

int fv_png_write(struct fv_png *p, const char *path, const struct fv_picture *picture, int eye, int level,
                 struct fv_error *error)
{
    struct fv_error discarded;
    if (fv_writer_open(&p->file, path, error)) return -1;
    int failed = encode(p, &p->file, write_file, picture, eye, level, error);
    if (!failed || p->file.failed) return fv_writer_close(&p->file, error);
    p->file.failed = 1; /* so that close removes the file; the error is encode's */
    fv_writer_close(&p->file, &discarded);
    return -1;
}

int fv_png_base64(struct fv_png *p, struct fv_writer *out, const struct fv_picture *picture, int eye,
                  int level, struct fv_error *error)
{
    if (encode(p, out, write_base64, picture, eye, level, error)) return -1;
    fv_writer_base64_end(out, &p->base64);
    return 0;
}

/* The sink. */
struct png_sink {
    char folder[FV_PATH_MAX];
    int64_t every;
    struct fv_png *png;
};

static void *sink_open(const struct fv_config *config, const char *folder, struct fv_error *error)
{
    char longest[FV_PATH_MAX];
    if (fv_path_join(longest, folder, "right-0000000000000000000.png.part")) {
        fv_error_set(error, "%.60s...: the name of the folder is too long", folder);
        return NULL;
    }
    struct png_sink *s = fv_arena_take(fv_arena(), "display", sizeof *s, 64);
    snprintf(s->folder, sizeof s->folder, "%s", folder);
    s->every = config->output_every;
    s->png = fv_png_open((int)config->display_width, (int)config->display_height);
    return s;
}

static bool sink_wants(const void *state, int64_t frame, bool last)
{
    const struct png_sink *s = state;
    return last || frame % s->every == 0;
}

static int sink_present(void *state, const struct fv_picture *picture, int64_t frame, struct fv_error *error)
{
    static const char *const names[2] = {"left", "right"};
    struct png_sink *s = state;
    for (int eye = 0; eye < picture->eyes; eye++) {
        char name[64], path[FV_PATH_MAX];
        snprintf(name, sizeof name, "%s-%05lld.png", names[eye], (long long)frame);
        fv_path_join(path, s->folder, name);
        if (fv_png_write(s->png, path, picture, eye, SINK_LEVEL, error)) return -1;
    }
    return 0;
}

static int sink_close(void *state, struct fv_error *error)
{
    (void)state, (void)error;
    return 0;
}

const struct fv_sink fv_sink_png = {"png", sink_open, sink_wants, sink_present, sink_close, NULL, NULL};
