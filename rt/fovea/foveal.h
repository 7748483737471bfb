/* foveal: which pixels to sample: the foveal function and its blue-noise thresholds.
 *
 * Eccentricity is the angle in degrees between a pixel's view ray and the gaze ray. */
#ifndef FV_FOVEA_FOVEAL_H
#define FV_FOVEA_FOVEAL_H

#include "rt/fovea/view.h"

#include <stdint.h>

enum { FV_NOISE_SIZE = 64 };

/* Radius of the fovea, degrees (Wandell 1995). */
#define FV_FOVEA_DEG 2.6f

/* Foveal region configuration (Weier et al. 2016, section 3.1). */
struct fv_foveal {
    float r0_deg, r1_deg, p_min;
};

/* Sampling probability: 1 up to r0, linear to p_min at r1, p_min beyond. r1 <= r0: a step at r0.
 * NaN eccentricity counts as 0 (sampled). */
float fv_foveal_probability(const struct fv_foveal *foveal, float eccentricity_deg);

/* Eccentricity of the pixel coordinates (x, y); exact to 1e-3 degrees from 0 to 180. */
float fv_eccentricity_deg(const struct fv_view *view, float x, float y);

/* The blue-noise mask: every value (k + 0.5) / 4096 once, void-and-cluster (Ulichney 1993).
 * Made on the first call, which is start-up's, on one thread; the same on every machine. */
const float *fv_noise(void);

/* Threshold of cell (x, y) in a frame: the mask `noise` shifted by the golden ratio each frame, so that
 * over time each cell's thresholds are spread evenly too. In [0, 1). */
float fv_noise_threshold(const float *noise, int x, int y, int64_t frame);

#endif
