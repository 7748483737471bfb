/* doubled: rows of lower densities, and the kernel that interpolates them; see doubled.h. */
#include "rt/pass/doubled.h"

enum { HALF = FV_TILE / 2 };

/* With all light. */
static void take_row(const struct fv_frame *f, const struct fv_raster *r, int x0, int y, int n, uint32_t row[FV_TILE])
{
    fv_raster_row(r, FV_PLANE_BASE, x0, y, n, row);
    if (!fv_light_apart(f)) return;
    _Alignas(64) uint32_t albedo[FV_TILE] = {0}, light[FV_TILE] = {0};
    fv_raster_row(r, FV_PLANE_ALBEDO, x0, y, n, albedo);
    fv_raster_row(r, FV_PLANE_LIGHT, x0, y, n, light);
    f->kernels->compose(row, albedo, light, row, FV_TILE);
}

void fv_doubled_take(const struct fv_frame *f, const struct fv_tile *tile, struct fv_doubled *doubled)
{
    const struct fv_raster *r = fv_tile_raster(f, tile);
    int x0 = tile->x0 >> tile->density, y0 = tile->y0 >> tile->density;
    if (tile->density == FV_COARSE) {
        doubled->first = 0;
        for (int y = 0; y < HALF + 2; y++) take_row(f, r, x0 - 1, y0 + y - 1, HALF + 2, doubled->pixel[y]);
        return;
    }
    /* From two pixels before the tile's first. */
    _Alignas(64) uint32_t coarsest[HALF / 2 + 2][FV_TILE] = {{0}};
    doubled->first = 1;
    for (int y = 0; y < HALF / 2 + 2; y++) take_row(f, r, x0 - 2, y0 + y - 1, HALF / 2 + 4, coarsest[y]);
    for (int y = 0; y < HALF + 2; y++) {
        int near = (y + 1) / 2;
        f->kernels->double_row(coarsest[near], coarsest[y & 1 ? near - 1 : near + 1], doubled->pixel[y], HALF);
    }
}

void fv_doubled_row(const struct fv_frame *f, const struct fv_doubled *doubled, int y, uint32_t *colour)
{
    const uint32_t *near = doubled->pixel[1 + y / 2], *far = doubled->pixel[y & 1 ? 2 + y / 2 : y / 2];
    f->kernels->double_row(near + doubled->first, far + doubled->first, colour, HALF);
}
