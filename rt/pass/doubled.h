/* doubled: tiles of lower densities as the picture shows them, interpolated bilinearly: the middle density once, the
 * coarsest one twice. */
#ifndef FV_PASS_DOUBLED_H
#define FV_PASS_DOUBLED_H

#include "rt/pass/pass.h"

enum { FV_DOUBLED_ROWS = FV_TILE / 2 + 2 };

/* A tile at half the picture's density and the pixels around it, in rows as long as a tile's, for the kernels: what is
 * behind does not matter. Of rows, pixel `first` is the one before the tile's first. */
struct fv_doubled {
    _Alignas(64) uint32_t pixel[FV_DOUBLED_ROWS][FV_TILE];
    int first;
};

/* A tile of the densities FV_COARSE and FV_COARSEST, and what its raster holds around it; with all light where some is
 * kept apart. */
void fv_doubled_take(const struct fv_frame *frame, const struct fv_tile *tile, struct fv_doubled *doubled);

/* The FV_TILE pixels of the picture's row y of the tile. */
void fv_doubled_row(const struct fv_frame *frame, const struct fv_doubled *doubled, int y, uint32_t *colour);

#endif
