/* v4l2_format: frames as cameras give them, from bytes to eight bits of grey. No input or output: a decoder
 * sees the bytes of one frame and reads none past their end. v4l2.h says where frames come from. */
#ifndef FV_SENSORS_V4L2_FORMAT_H
#define FV_SENSORS_V4L2_FORMAT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* A row for each pixel format that is read, those that cost least first. */
struct fv_camera_format {
    const char *name; /* GREY, as in eye.format */
    uint32_t fourcc;  /* V4L2_PIX_FMT_* */
    int step;         /* bytes from one pixel's luma to the next */
    int bits;         /* of luma: 8, or 10 to 16 in two bytes, the low one first */
    bool halves;      /* a plane of colours at half the rows follows that of luma */
};
enum { FV_CAMERA_FORMATS = 6 };
extern const struct fv_camera_format fv_camera_formats[FV_CAMERA_FORMATS];

/* The row of a fourcc, or of a name; NULL where there is none. */
const struct fv_camera_format *fv_camera_format_of(uint32_t fourcc);
const struct fv_camera_format *fv_camera_format_named(const char *name);

/* Frames of one camera: all alike. */
struct fv_camera_layout {
    const struct fv_camera_format *format;
    int width, height; /* 1 to FV_CAMERA_SIDE_MAX; width even in YUYV and NV12 */
    size_t stride;     /* bytes from row to row, at least width * step; at most FV_CAMERA_STRIDE_MAX */
};
enum { FV_CAMERA_SIDE_MAX = 8192, FV_CAMERA_STRIDE_MAX = 1 << 16 };

/* The least stride of a width; 0 where the width cannot be. */
size_t fv_camera_row_bytes(const struct fv_camera_format *format, int width);

/* Bytes that a whole frame has at least (the last row need not be padded); 0 where the layout cannot be. */
size_t fv_camera_frame_bytes(const struct fv_camera_layout *layout);

/* Writes height rows of width pixels, `grey_stride` >= width apart. False, and nothing written, where the
 * layout cannot be or the frame is short. Values above those of its bits are white. */
bool fv_camera_decode(const struct fv_camera_layout *layout, const uint8_t *bytes, size_t size, uint8_t *grey,
                      size_t grey_stride);

#endif
