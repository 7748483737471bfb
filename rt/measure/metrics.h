/* metrics: how far a picture is from its reference: PSNR, RMSE, SSIM and FLIP, over the whole
 * picture and by eccentricity. Pictures are 8-bit, sRGB-encoded.
 *
 * PSNR, RMSE  over r, g, b together, of the encoded values; RMSE with full scale 1; PSNR infinite
 *             where there is no error
 * SSIM        Wang, Bovik, Sheikh and Simoncelli 2004: on luma (BT.601), Gaussian window 11 x 11, sigma
 *             1.5, mean over the pixels whose window lies inside the picture; along a side that is
 *             shorter than the window, over its middle one or two, the picture mirrored at its edges
 * FLIP        Andersson et al. 2020, the LDR one, for the given pixels per degree; beyond the picture's
 *             edges lie its outermost pixels
 *
 * A zone's value is that of the whole picture's map, taken over the zone's pixels; NaN where the zone
 * has none. */
#ifndef FV_MEASURE_METRICS_H
#define FV_MEASURE_METRICS_H

#include "platform/threads.h"
#include "rt/fovea/view.h"

#include <stdbool.h>
#include <stdint.h>

/* Zones of eccentricity; each reaches to its row's upper_deg from where the one before ends. */
enum fv_zone { FV_ZONE_FOVEA, FV_ZONE_PARA, FV_ZONE_PERI, FV_ZONE_NEAR, FV_ZONE_FAR, FV_ZONE_ALL, FV_ZONES };
struct fv_zone_row {
    const char *name; /* "fovea", ... "all": the endings of measure.csv's columns */
    double upper_deg; /* included */
};
extern const struct fv_zone_row fv_zones[FV_ZONES];

/* r, g, b at pixel + y * stride_bytes + x * step. */
struct fv_metrics_picture {
    int width, height, step;
    int64_t stride_bytes;
    const uint8_t *pixel;
};

struct fv_errors {
    int64_t pixels[FV_ZONES];
    double psnr[FV_ZONES]; /* dB */
    double rmse[FV_ZONES], ssim[FV_ZONES], flip[FV_ZONES];
};

struct fv_metrics; /* opaque: the scratch of one picture size, in the arena */

/* All memory is taken here, for as many threads as there are cores, at most 16. ppd: pixels per degree of
 * FLIP's viewer; outside of [1, 1000] it counts as the nearer end. */
struct fv_metrics *fv_metrics_open(int width, int height, double ppd);

/* zone[y * width + x]: FV_ZONE_FOVEA to FV_ZONE_FAR of each pixel's centre. By a view's own gaze, or for
 * a picture that is known only by its gaze (pixels) and its focal length (pixels, > 0). */
void fv_zones_of_view(const struct fv_view *view, uint8_t *zone);
void fv_zones_of_picture(int width, int height, double gaze_x, double gaze_y, double focal_px, uint8_t *zone);

/* Other zones: zone[y * width + x] is how many of the limits (degrees, growing, at most FV_ZONE_FAR of them) the
 * pixel's centre lies beyond. fv_metrics_compare takes these as well: its errors are in the same order. */
void fv_zones_beyond(const struct fv_view *view, const double *limit_deg, int limits, uint8_t *zone);

/* Both pictures have the size that `metrics` was opened for. `workers` may be NULL: this thread only;
 * the values do not depend on it. */
void fv_metrics_compare(struct fv_metrics *metrics, struct fv_workers *workers,
                        const struct fv_metrics_picture *reference, const struct fv_metrics_picture *test,
                        const uint8_t *zone, struct fv_errors *errors);

/* FLIP of each pixel in the last comparison, 0 to 1, width * height. */
const float *fv_metrics_flip_map(const struct fv_metrics *metrics);

#endif
