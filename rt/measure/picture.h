/* picture: pictures of a sweep: a frame's, and those in files: PNG for what is compared again, JPEG for what
 * is looked at. */
#ifndef FV_MEASURE_PICTURE_H
#define FV_MEASURE_PICTURE_H

#include "platform/files.h"
#include "rt/measure/metrics.h"
#include "rt/pass/pass.h"

/* FLIP that difference pictures show white: differences of good pictures are small. */
static const float fv_difference_white = 0.25f;

/* Runs the present pass on a frame whose colours are there; the left eye's picture, in the frame's buffer. */
struct fv_metrics_picture fv_picture_present(struct fv_frame *frame, struct fv_workers *workers);

/* Returns 0, or -1 with the error set: no half-written file is left. */
int fv_picture_png(const struct fv_metrics_picture *picture, const char *path, struct fv_error *error);
int fv_picture_jpeg(const struct fv_metrics_picture *picture, const char *path, struct fv_error *error);

/* Its pixels row by row, three bytes each, into `rgb`. */
void fv_picture_pack(const struct fv_metrics_picture *picture, uint8_t *rgb);

/* A map of values from 0 (black) to `white` and above (white), width * height. */
int fv_picture_map_jpeg(const float *map, int width, int height, float white, const char *path,
                        struct fv_error *error);

/* Reads into `pixel`, three bytes a pixel, which has room for width * height of them; -1 where the file has
 * another size or is no picture. */
int fv_picture_read(const char *path, int width, int height, uint8_t *pixel, struct fv_error *error);

#endif
