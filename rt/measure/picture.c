/* picture: see picture.h. The heap is not sealed while a sweep runs, so libpng and libjpeg-turbo may use it.
 */
#include "rt/measure/picture.h"

#include "rt/scene/build.h"

#include <png.h>
#include <turbojpeg.h>

#include <stdlib.h>
#include <string.h>

enum { QUALITY = 88 };

struct fv_metrics_picture fv_picture_present(struct fv_frame *f, struct fv_workers *workers)
{
    fv_pass_run(&fv_pass_present, f, workers);
    return (struct fv_metrics_picture){f->width, f->height, 4, 4 * f->stride, f->buffer[FV_PICTURE][0]};
}

void fv_picture_pack(const struct fv_metrics_picture *p, uint8_t *rgb)
{
    for (int y = 0; y < p->height; y++)
        for (int x = 0; x < p->width; x++, rgb += 3)
            memcpy(rgb, p->pixel + y * p->stride_bytes + x * p->step, 3);
}

/* The caller frees it. */
static uint8_t *packed(const struct fv_metrics_picture *p)
{
    uint8_t *rgb = malloc((size_t)p->width * (size_t)p->height * 3);
    if (rgb) fv_picture_pack(p, rgb);
    return rgb;
}

static int store(const char *path, const void *bytes, size_t size, struct fv_error *error)
{
    static struct fv_writer out;
    if (fv_writer_open(&out, path, error)) return -1;
    fv_writer_bytes(&out, bytes, size);
    return fv_writer_close(&out, error);
}

int fv_picture_png(const struct fv_metrics_picture *p, const char *path, struct fv_error *error)
{
    png_image image = {.version = PNG_IMAGE_VERSION,
                       .width = (png_uint_32)p->width,
                       .height = (png_uint_32)p->height,
                       .format = PNG_FORMAT_RGB,
                       .flags = PNG_IMAGE_FLAG_FAST};
    png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
    uint8_t *rgb = packed(p), *bytes = malloc(size);
    int failed = !rgb || !bytes || !png_image_write_to_memory(&image, bytes, &size, 0, rgb, 0, NULL);
    if (failed) fv_error_set(error, "%s: could not be encoded", path);
    else failed = store(path, bytes, size, error) != 0;
    free(rgb);
    free(bytes);
    return failed ? -1 : 0;
}

static int jpeg(const uint8_t *pixels, int width, int height, int format, int sampling, const char *path,
                struct fv_error *error)
{
    unsigned char *bytes = NULL;
    unsigned long size = 0;
    tjhandle handle = tjInitCompress();
    int failed = !handle || !pixels ||
                 tjCompress2(handle, pixels, width, 0, height, format, &bytes, &size, sampling, QUALITY, 0);
    if (failed) fv_error_set(error, "%s: could not be encoded", path);
    else failed = store(path, bytes, size, error) != 0;
    tjFree(bytes);
    if (handle) tjDestroy(handle);
    return failed ? -1 : 0;
}

int fv_picture_jpeg(const struct fv_metrics_picture *p, const char *path, struct fv_error *error)
{
    uint8_t *rgb = packed(p);
    int result = jpeg(rgb, p->width, p->height, TJPF_RGB, TJSAMP_420, path, error);
    free(rgb);
    return result;
}

int fv_picture_map_jpeg(const float *map, int width, int height, float white, const char *path,
                        struct fv_error *error)
{
    size_t n = (size_t)width * (size_t)height;
    uint8_t *grey = malloc(n);
    for (size_t i = 0; grey && i < n; i++) {
        float v = map[i] / white;
        grey[i] = (uint8_t)(255 * (v > 0 ? v < 1 ? v : 1 : 0) + 0.5f);
    }
    int result = jpeg(grey, width, height, TJPF_GRAY, TJSAMP_GRAY, path, error);
    free(grey);
    return result;
}

int fv_picture_read(const char *path, int width, int height, uint8_t *pixel, struct fv_error *error)
{
    char *bytes;
    size_t size;
    uint8_t *decoded = NULL;
    int w, h, channels;
    if (fv_file_read(path, 1 << 30, &bytes, &size, error)) return -1;
    int failed = fv_image_decode((const uint8_t *)bytes, size, path, &decoded, &w, &h, &channels, error);
    free(bytes);
    if (failed) return -1;
    if (w == width && h == height && channels == 3) memcpy(pixel, decoded, (size_t)w * (size_t)h * 3);
    else
        failed = fv_error_set(error, "%s: is %d x %d with %d channels, not %d x %d with 3", path, w, h,
                              channels, width, height);
    free(decoded);
    return failed;
}
