/* shown: a frame's pixels as the picture shows them, whatever raster its tiles are kept in: 10-bit colours and
 * flags; a coarse pixel stands for four. For tests only. */
#ifndef FV_TESTS_SHOWN_H
#define FV_TESTS_SHOWN_H

#include "rt/pass/pass.h"

static inline uint32_t shown_pixel(const struct fv_frame *f, int eye, int x, int y)
{
    int tile = (eye * f->tiles_y + y / FV_TILE) * f->tiles_x + x / FV_TILE;
    int d = f->state ? f->state[tile].density : FV_FINE;
    return ((const uint32_t *)f->buffer[d ? FV_COARSE_COLOUR : FV_COLOUR][eye])[(y >> d) * (f->stride >> d) + (x >> d)];
}

#endif
