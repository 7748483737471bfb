/* lens_ray: rays straight through the lens: pixels of the display to those of the pinhole (fovea/lens.h), a vector of
 * samples at a time. For kernels only. */
#ifndef FV_TRACE_LENS_RAY_H
#define FV_TRACE_LENS_RAY_H

#include "rt/fovea/lens.h"
#include "rt/trace/simd.h"

/* Returns how much a pixel there is stretched, along and across together: the root of the area. */
static inline vf lens_straighten(const struct fv_bend *b, vf *x, vf *y)
{
    vf dx = *x - b->centre[0], dy = *y - b->centre[1], u = dx * b->step[0], v = dy * b->step[1];
    vf q = vf_min(u * u + v * v, vf_of(b->most * b->most));
    vf scale = 1.0f + q * (b->k[0] + q * (b->k[1] + q * b->k[2]));
    vf slope = 1.0f + q * (3 * b->k[0] + q * (5 * b->k[1] + q * (7 * b->k[2])));
    *x = b->centre[0] + dx * scale;
    *y = b->centre[1] + dy * scale;
    return vf_sqrt(vf_max(scale * slope, vf_of(0)));
}

#endif
