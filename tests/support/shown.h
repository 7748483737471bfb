/* shown: a frame's pixels as the picture shows them, whatever raster its tiles are kept in: 10-bit colours and
 * flags; a coarse pixel stands for four, or sixteen. For tests only. */
#ifndef FV_TESTS_SHOWN_H
#define FV_TESTS_SHOWN_H

#include "rt/pass/pass.h"

static inline uint32_t shown_pixel(const struct fv_frame *f, int eye, int x, int y)
{
    int tile = (eye * f->tiles_y + y / FV_TILE) * f->tiles_x + x / FV_TILE;
    int d = f->state ? f->state[tile].density : FV_FINE;
    const struct fv_raster *r = &f->raster[d][eye];
    const uint32_t *colour = r->colour + (y >> d) * r->stride + (x >> d);
    if (!fv_light_apart(f)) return *colour;
    _Alignas(64) uint32_t plane[FV_PLANES][16] = {{0}};
    for (int p = 0; p < FV_PLANES; p++) plane[p][0] = colour[p * r->plane];
    f->kernels->compose(plane[FV_PLANE_BASE], plane[FV_PLANE_ALBEDO], plane[FV_PLANE_LIGHT], plane[FV_PLANE_BASE], 16);
    return plane[FV_PLANE_BASE][0];
}

#endif
