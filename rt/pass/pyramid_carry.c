/* carry: what the lower levels of the pyramid show of a tile, from the last frame; see pyramid.h. */
#include "rt/pass/bent.h"
#include "rt/pass/pyramid.h"

#include <math.h>

/* Whether the last frame showed a point of the picture, at inverse depth w, in a tile that the level was not held of. */
static bool held_coarser(const struct fv_frame *f, const struct fv_tile *tile, const struct fv_map *map, float x, float y,
                         float w)
{
    float to[3];
    fv_map_point(map, x, y, w, to);
    float column = to[0] / to[2], row = to[1] / to[2];
    if (!(to[2] > 0 && column >= 0 && column < (float)f->width && row >= 0 && row < (float)f->height)) return false;
    int from = (tile->eye * f->tiles_y + (int)row / FV_TILE) * f->tiles_x + (int)column / FV_TILE;
    return !(f->state[from].holds[1] >> tile->density & 1);
}

/* Of lower levels a tile knows its neighbours' colours, too, and a block's middle tells; of the highest, what lies
 * beyond it may be of any frame: all that the block's pixels are interpolated from must be held. */
static uint64_t blocks_held_coarser(const struct fv_frame *f, const struct fv_tile *tile, const struct fv_map *map,
                                    uint64_t blocks)
{
    int size = FV_BLOCK << tile->density;
    float reach = fv_map_still(&f->map[tile->eye], &f->view[tile->eye]) ? 1.5f : 2.4f;
    uint64_t coarser = 0;
    for (; blocks; blocks &= blocks - 1) {
        int block = __builtin_ctzll(blocks);
        int x = tile->x0 + block % FV_BLOCKS * size + size / 2, y = tile->y0 + block / FV_BLOCKS * size + size / 2;
        float w = 1 / fv_start_at(f, tile->eye, x / FV_BLOCK, y / FV_BLOCK);
        bool is = false;
        if (tile->density != FV_FINE) is = held_coarser(f, tile, map, (float)x, (float)y, w);
        for (int k = 0; k < 4 && tile->density == FV_FINE; k++)
            is |= held_coarser(f, tile, map, (float)x + (k & 1 ? reach : -reach), (float)y + (k & 2 ? reach : -reach), w);
        coarser |= (uint64_t)is << block;
    }
    return coarser;
}

/* Inverse depths that differ by less moved apart by less than a quarter of the tile's pixels since the last frame: next
 * to nothing was covered or uncovered. Infinite where the head only turned. */
static float moved_together(const struct fv_map *map, const struct fv_tile *tile)
{
    float middle = 0.5f * FV_TILE;
    float pixels = fv_map_apart(map, (float)tile->x0 + middle, (float)tile->y0 + middle, middle);
    return 0.25f * (float)(1 << tile->density) / pixels;
}

uint64_t fv_pyramid_carry(struct fv_frame *f, const struct fv_tile *tile, uint64_t blocks)
{
    int middle_x = tile->x0 + FV_TILE / 2, middle_y = tile->y0 + FV_TILE / 2;
    float start = fv_start_at(f, tile->eye, middle_x / FV_BLOCK, middle_y / FV_BLOCK);
    const struct fv_map map = fv_bent_map(f, tile->eye, 0, (float)middle_x, (float)middle_y, start > 0 ? 1 / start : 0);
    struct fv_carry c = {
        .map = map,
        .raster = fv_tile_raster(f, tile),
        .shift = FV_COARSEST - tile->density,
        .x0 = tile->x0 >> tile->density,
        .y0 = tile->y0 >> tile->density,
        .side = fv_tile_side(tile),
        .blocks = blocks,
        .starts = f->buffer[FV_STARTS][tile->eye],
        .last_starts = f->buffer[FV_HISTORY_STARTS][tile->eye],
        .stride = fv_starts_stride(f),
        .columns = fv_blocks_along(f->width),
        .rows = fv_blocks_along(f->height),
        .block_x = tile->x0 / FV_BLOCK,
        .block_y = tile->y0 / FV_BLOCK,
        .cone = 8 * fv_largest_pixel(&f->view[tile->eye]),
        .together = moved_together(&map, tile),
    };
    if (!blocks) return 0;
    f->kernels->carry[tile->density](&c);
    if (tile->density != FV_COARSEST) c.failed |= blocks_held_coarser(f, tile, &map, blocks & ~c.failed);
    return c.failed;
}
