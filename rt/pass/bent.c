/* bent: see bent.h. */
#include "rt/pass/bent.h"

#include "rt/pass/cache.h"

/* Of what the tile's middle shows, where that is known. */
static float middle_depth(const struct fv_frame *f, const struct fv_tile *tile)
{
    const uint32_t *cache = f->buffer[FV_CACHE][tile->eye];
    int x = tile->x0 + FV_TILE / 2, y = tile->y0 + FV_TILE / 2;
    if (!cache || tile->density != FV_FINE) return 0;
    float w = cache_depth_of(cache[(int64_t)y * f->stride + x]);
    return w > 0 && w <= FV_INVERSE_DEPTH_MAX ? w : 0;
}

const struct fv_map *fv_bent_maps(const struct fv_frame *f, const struct fv_tile *tile, const struct fv_map *maps,
                                  const struct fv_bend *before, int place)
{
    const struct fv_bend *now = &f->view[tile->eye].bend;
    struct fv_map *bent = f->scratch[tile->worker].bent[place];
    if (!now->on) return maps;
    float w = middle_depth(f, tile);
    for (int i = 0; i <= f->tracer->instances; i++) {
        bent[i] = maps[i];
        fv_map_bend(&bent[i], now, before, (float)(tile->x0 + FV_TILE / 2), (float)(tile->y0 + FV_TILE / 2), w);
    }
    return bent;
}

const struct fv_view *fv_bent_view(const struct fv_frame *f, const struct fv_tile *tile)
{
    const struct fv_view *view = &f->view[tile->eye];
    struct fv_view *near = &f->scratch[tile->worker].near;
    if (!view->bend.on) return view;
    fv_view_at(view, (float)(tile->x0 + FV_TILE / 2), (float)(tile->y0 + FV_TILE / 2), near);
    return near;
}
