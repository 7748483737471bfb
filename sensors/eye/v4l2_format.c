/* v4l2_format: the table of pixel formats and the one decoder that it drives; see the header. */
#include "sensors/eye/v4l2_format.h"

#include <linux/videodev2.h>
#include <string.h>

const struct fv_camera_format fv_camera_formats[FV_CAMERA_FORMATS] = {
    {"GREY", V4L2_PIX_FMT_GREY, 1, 8, false}, {"NV12", V4L2_PIX_FMT_NV12, 1, 8, true},
    {"YUYV", V4L2_PIX_FMT_YUYV, 2, 8, false}, {"Y10", V4L2_PIX_FMT_Y10, 2, 10, false},
    {"Y12", V4L2_PIX_FMT_Y12, 2, 12, false},  {"Y16", V4L2_PIX_FMT_Y16, 2, 16, false},
};

const struct fv_camera_format *fv_camera_format_of(uint32_t fourcc)
{
    for (int i = 0; i < FV_CAMERA_FORMATS; i++)
        if (fv_camera_formats[i].fourcc == fourcc) return &fv_camera_formats[i];
    return NULL;
}

const struct fv_camera_format *fv_camera_format_named(const char *name)
{
    for (int i = 0; i < FV_CAMERA_FORMATS; i++)
        if (strcmp(fv_camera_formats[i].name, name) == 0) return &fv_camera_formats[i];
    return NULL;
}

/* Colours are shared by two pixels beside each other. */
static bool in_pairs(const struct fv_camera_format *format)
{
    return format->halves || (format->step == 2 && format->bits == 8);
}

size_t fv_camera_row_bytes(const struct fv_camera_format *format, int width)
{
    if (width < 1 || width > FV_CAMERA_SIDE_MAX || (in_pairs(format) && width % 2)) return 0;
    return (size_t)width * (size_t)format->step;
}

size_t fv_camera_frame_bytes(const struct fv_camera_layout *l)
{
    if (!l->format || l->height < 1 || l->height > FV_CAMERA_SIDE_MAX) return 0;
    size_t row = fv_camera_row_bytes(l->format, l->width);
    if (row == 0 || l->stride < row || l->stride > FV_CAMERA_STRIDE_MAX) return 0;
    size_t rows = (size_t)l->height + (l->format->halves ? ((size_t)l->height + 1) / 2 : 0);
    return (rows - 1) * l->stride + row;
}

static void take_bytes(const uint8_t *restrict row, int width, int step, uint8_t *restrict grey)
{
    for (int x = 0; x < width; x++) grey[x] = row[x * step];
}

static void take_words(const uint8_t *restrict row, int width, int bits, uint8_t *restrict grey)
{
    for (int x = 0; x < width; x++) {
        unsigned value = (row[2 * x] | (unsigned)row[2 * x + 1] << 8) >> (bits - 8);
        grey[x] = (uint8_t)(value < 255 ? value : 255);
    }
}

bool fv_camera_decode(const struct fv_camera_layout *l, const uint8_t *bytes, size_t size, uint8_t *grey,
                      size_t grey_stride)
{
    size_t whole = fv_camera_frame_bytes(l);
    if (whole == 0 || size < whole || grey_stride < (size_t)l->width) return false;
    for (int y = 0; y < l->height; y++) {
        const uint8_t *row = bytes + (size_t)y * l->stride;
        uint8_t *out = grey + (size_t)y * grey_stride;
        if (l->format->bits > 8) take_words(row, l->width, l->format->bits, out);
        else if (l->format->step == 1) memcpy(out, row, (size_t)l->width);
        else take_bytes(row, l->width, l->format->step, out);
    }
    return true;
}
