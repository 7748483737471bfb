/* carry: what the lower levels of the pyramid show of a tile, from the last frame; see pyramid.h. */
#include "rt/pass/pyramid.h"

#include <math.h>

/* The blocks whose middle the last frame showed in a tile that the level was not held of. */
static uint64_t held_coarser(const struct fv_frame *f, const struct fv_tile *tile, uint64_t blocks)
{
    int size = FV_BLOCK << tile->density, first = tile->eye * f->tiles_x * f->tiles_y;
    uint64_t coarser = 0;
    for (; blocks; blocks &= blocks - 1) {
        int block = __builtin_ctzll(blocks);
        int x = tile->x0 + block % FV_BLOCKS * size + size / 2, y = tile->y0 + block / FV_BLOCKS * size + size / 2;
        float to[3], w = 1 / fv_start_at(f, tile->eye, x / FV_BLOCK, y / FV_BLOCK);
        fv_map_point(&f->map[tile->eye], (float)x, (float)y, w, to);
        float column = to[0] / to[2], row = to[1] / to[2];
        if (!(to[2] > 0 && column >= 0 && column < (float)f->width && row >= 0 && row < (float)f->height)) continue;
        int from = first + (int)row / FV_TILE * f->tiles_x + (int)column / FV_TILE;
        if (!(f->state[from].holds[1] >> tile->density & 1)) coarser |= 1ull << block;
    }
    return coarser;
}

/* Inverse depths that differ by less moved apart by less than a quarter of the tile's pixels since the last frame: next
 * to nothing was covered or uncovered. Infinite where the head only turned. */
static float moved_together(const struct fv_frame *f, const struct fv_tile *tile)
{
    const struct fv_map *map = &f->map[tile->eye];
    float to[3], middle = 0.5f * FV_TILE;
    fv_map_point(map, (float)tile->x0 + middle, (float)tile->y0 + middle, 0, to);
    if (!(to[2] > 0)) return 0;
    float across = map->t[0] - map->t[2] * to[0] / to[2], along = map->t[1] - map->t[2] * to[1] / to[2];
    float pixels = (hypotf(across, along) + FV_TILE * fabsf(map->t[2])) / to[2];
    return 0.25f * (float)(1 << tile->density) / pixels;
}

uint64_t fv_pyramid_carry(struct fv_frame *f, const struct fv_tile *tile, uint64_t blocks)
{
    struct fv_carry c = {
        .map = f->map[tile->eye],
        .raster = fv_tile_raster(f, tile),
        .shift = FV_COARSEST - tile->density,
        .x0 = tile->x0 >> tile->density,
        .y0 = tile->y0 >> tile->density,
        .side = fv_tile_side(tile),
        .blocks = blocks,
        .starts = f->buffer[FV_STARTS][tile->eye],
        .last_starts = f->buffer[FV_HISTORY_STARTS][tile->eye],
        .stride = fv_starts_stride(f),
        .columns = (f->width + FV_BLOCK - 1) / FV_BLOCK,
        .rows = (f->height + FV_BLOCK - 1) / FV_BLOCK,
        .block_x = tile->x0 / FV_BLOCK,
        .block_y = tile->y0 / FV_BLOCK,
        .cone = 8 * f->view[tile->eye].pixel_size,
        .together = moved_together(f, tile),
    };
    if (!blocks) return 0;
    f->kernels->carry[tile->density](&c);
    if (tile->density != FV_COARSEST) c.failed |= held_coarser(f, tile, blocks & ~c.failed);
    return c.failed;
}
