/* flicker: how much a sequence changes from frame to frame where it should not: the mean absolute
 * difference between a frame and the one before, looked up where exact depth says that each pixel's
 * surface was. What the reference changes by itself (light, resampling) is for the caller to take off. */
#ifndef FV_MEASURE_FLICKER_H
#define FV_MEASURE_FLICKER_H

#include "rt/measure/metrics.h"

/* Full scale 1, mean of r, g, b over the pixels whose surface is seen in both frames; NaN where none is.
 * `map`: from this frame's pixels to those before (view.h). `inverse_depth`, `inverse_depth_before`: at
 * pixel centres, 1/m along the optical axis, 0 where nothing was hit; `stride` elements a row. The frame
 * before is looked up bilinearly; a pixel whose depth there differs by more than 1 % is left out. */
double fv_flicker(const struct fv_metrics_picture *now, const struct fv_metrics_picture *before,
                  const struct fv_map *map, const float *inverse_depth, const float *inverse_depth_before,
                  int64_t stride);

#endif
