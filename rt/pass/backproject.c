/* backproject: see backproject.h. */
#include "rt/pass/backproject.h"

#include "rt/pass/bent.h"
#include "rt/pass/selective.h"

struct fv_row fv_row_of(const struct fv_frame *f, const struct fv_tile *tile, int y)
{
    int64_t at = fv_tile_row(f, tile, y);
    const uint32_t *identity = f->buffer[FV_IDENTITY][tile->eye];
    return (struct fv_row){.count = FV_TILE, .x = tile->x0, .y = tile->y0 + y, .width = f->width, .height = f->height,
                           .stride = (int)f->stride,
                           .colour = (const uint32_t *)f->buffer[FV_COLOUR][tile->eye] + at,
                           .cache = (const uint32_t *)f->buffer[FV_CACHE][tile->eye] + at,
                           .identity = f->tracer->instances > 0 ? identity + at : NULL, .stamp = fv_identity_stamp(f)};
}

struct fv_backproject fv_backproject_to(const struct fv_frame *f, const struct fv_tile *tile, const uint32_t *colour,
                                        const uint32_t *cache, const struct fv_map *map, const struct fv_bend *before, int place)
{
    map = fv_bent_maps(f, tile, map, before, place);
    float middle = 0.5f * FV_TILE;
    float apart = fv_map_apart(map, (float)tile->x0 + middle, (float)tile->y0 + middle, middle);
    return (struct fv_backproject){.width = f->width, .height = f->height, .stride = (int)f->stride,
                                   .epsilon = f->epsilon_depth, .together = 1 / apart, .colour = colour, .cache = cache, .map = map};
}
