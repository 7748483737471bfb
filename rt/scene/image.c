/* image: PNG through libpng, JPEG through TurboJPEG, told apart by their first bytes. Colour space
 * and gamma notes in the files are ignored, as glTF 2.0 (3.8.2) asks: bytes are taken as they are. */
#include "platform/log.h"
#include "rt/scene/build.h"
#include "rt/scene/texture.h"

#include <png.h>
#include <setjmp.h>
#include <stdlib.h>
#include <string.h>
#include <turbojpeg.h>

struct picture {
    const uint8_t *bytes, *end;
    const char *where;
    uint8_t *pixels;
    png_bytep *rows;
    int width, height, channels;
    struct fv_error *error;
};

static int check_size(const struct picture *p, long width, long height)
{
    if (width >= 1 && height >= 1 && width <= FV_TEXTURE_SIZE_MAX && height <= FV_TEXTURE_SIZE_MAX) return 0;
    return fv_error_set(p->error, "%s: a picture of %ld x %ld pixels, must be from 1 x 1 to %d x %d",
                        p->where, width, height, FV_TEXTURE_SIZE_MAX, FV_TEXTURE_SIZE_MAX);
}

static void *claim(size_t bytes, const char *where)
{
    void *memory = malloc(bytes);
    if (!memory) fv_die(2, "memory: %s does not fit: it needs %zu bytes", where, bytes);
    return memory;
}

static void png_failed(png_structp png, png_const_charp message)
{
    const struct picture *p = png_get_error_ptr(png);
    fv_error_set(p->error, "%s: damaged PNG: %s", p->where, message);
    png_longjmp(png, 1);
}

static void png_warned(png_structp png, png_const_charp message)
{
    (void)png, (void)message;
}

static void png_take(png_structp png, png_bytep out, size_t size)
{
    struct picture *p = png_get_io_ptr(png);
    if ((size_t)(p->end - p->bytes) < size) png_error(png, "it ends too early");
    memcpy(out, p->bytes, size);
    p->bytes += size;
}

/* Runs under the caller's setjmp; everything that it takes hangs on `p`. */
static int png_decode(png_structp png, png_infop info, struct picture *p)
{
    png_set_read_fn(png, p, png_take);
    png_set_user_limits(png, 0x7fffffff, 0x7fffffff);
    png_read_info(png, info);
    if (check_size(p, (long)png_get_image_width(png, info), (long)png_get_image_height(png, info))) return -1;
    png_set_expand(png);
    png_set_scale_16(png);
    png_set_interlace_handling(png);
    png_read_update_info(png, info);
    p->width = (int)png_get_image_width(png, info);
    p->height = (int)png_get_image_height(png, info);
    p->channels = png_get_channels(png, info);
    size_t row = png_get_rowbytes(png, info);
    p->pixels = claim(row * (size_t)p->height, p->where);
    p->rows = claim(sizeof *p->rows * (size_t)p->height, p->where);
    for (int y = 0; y < p->height; y++) p->rows[y] = p->pixels + row * (size_t)y;
    png_read_image(png, p->rows);
    png_read_end(png, NULL);
    return 0;
}

static int read_png(struct picture *p)
{
    png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, p, png_failed, png_warned);
    png_infop info = png ? png_create_info_struct(png) : NULL;
    if (!info) fv_die(2, "memory: no room to decode %s", p->where);
    volatile int result = -1;
    if (setjmp(png_jmpbuf(png)) == 0) result = png_decode(png, info, p);
    png_destroy_read_struct(&png, &info, NULL);
    free(p->rows);
    return result;
}

static int jpeg_decode(tjhandle jpeg, struct picture *p)
{
    int subsampling, space;
    unsigned long size = (unsigned long)(p->end - p->bytes);
    if (tjDecompressHeader3(jpeg, p->bytes, size, &p->width, &p->height, &subsampling, &space))
        return fv_error_set(p->error, "%s: damaged JPEG: %s", p->where, tjGetErrorStr2(jpeg));
    if (check_size(p, p->width, p->height)) return -1;
    p->channels = space == TJCS_GRAY ? 1 : 3;
    p->pixels = claim((size_t)p->width * (size_t)p->height * (size_t)p->channels, p->where);
    /* Warnings too mean that a part of the picture is missing. */
    if (tjDecompress2(jpeg, p->bytes, size, p->pixels, p->width, 0, p->height,
                      p->channels == 1 ? TJPF_GRAY : TJPF_RGB, TJFLAG_LIMITSCANS))
        return fv_error_set(p->error, "%s: damaged JPEG: %s", p->where, tjGetErrorStr2(jpeg));
    return 0;
}

static int read_jpeg(struct picture *p)
{
    tjhandle jpeg = tjInitDecompress();
    if (!jpeg) fv_die(2, "memory: no room to decode %s", p->where);
    int result = jpeg_decode(jpeg, p);
    tjDestroy(jpeg);
    return result;
}

int fv_image_decode(const uint8_t *bytes, size_t size, const char *where, uint8_t **pixels, int *width,
                    int *height, int *channels, struct fv_error *error)
{
    struct picture p = {.bytes = bytes, .end = bytes + size, .where = where, .error = error};
    int result;
    if (size >= 8 && png_sig_cmp(bytes, 0, 8) == 0) result = read_png(&p);
    else if (size >= 3 && memcmp(bytes, "\xff\xd8\xff", 3) == 0) result = read_jpeg(&p);
    else result = fv_error_set(error, "%s: neither PNG nor JPEG", where);
    if (result) {
        free(p.pixels);
        return -1;
    }
    *pixels = p.pixels;
    *width = p.width;
    *height = p.height;
    *channels = p.channels;
    return 0;
}
