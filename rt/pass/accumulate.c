/* accumulate: tiles of light that is mixed with the last frame's; see accumulate.h. */
#include "rt/pass/accumulate.h"

#include "config/config.h"
#include "rt/pass/bent.h"
#include "rt/pass/denoise.h"

/* The last frame's, around where the tile was; where the lens bends, by the place that it has now: near enough to tell
 * how depths lean. */
static const struct fv_view *view_before(const struct fv_frame *f, const struct fv_tile *tile)
{
    const struct fv_view *before = &f->before[tile->eye];
    struct fv_view *near = &f->scratch[tile->worker].near;
    if (!before->bend.on) return before;
    fv_view_at(before, (float)(tile->x0 + FV_TILE / 2), (float)(tile->y0 + FV_TILE / 2), near);
    return near;
}

static int run(struct fv_frame *f, const struct fv_tile *tile)
{
    int e = tile->eye;
    bool moved = f->tracer->moved && f->denoise.history > FV_ACCUMULATE_MOVED;
    if (!fv_accumulates(f)) return 0;
    struct fv_accumulate a = {.x = tile->x0,
                              .y = tile->y0,
                              .columns = fv_tile_rest(f->width, tile->x0),
                              .rows = fv_tile_rest(f->height, tile->y0),
                              .width = f->width,
                              .height = f->height,
                              .stride = f->stride,
                              .most = moved ? FV_ACCUMULATE_MOVED : f->denoise.history,
                              .seed = 2 * (uint32_t)f->number + (uint32_t)e,
                              .moves = f->tracer->instances > 0,
                              .epsilon = f->epsilon_depth,
                              .before = view_before(f, tile),
                              .map = fv_bent_maps(f, tile, f->object_map[e], &f->before[e].bend, 0),
                              .light = f->buffer[FV_FILTERED][e],
                              .inverse_depth = f->buffer[FV_DEPTH][e],
                              .facing = f->buffer[FV_FACING][e],
                              .track = f->buffer[FV_TRACK][e],
                              .mean = f->buffer[FV_MEAN][e],
                              .filtered = f->buffer[FV_LIGHT][e],
                              .variance = f->buffer[FV_VARIANCE][e]};
    if (f->has_mean) {
        a.mean_before = f->buffer[FV_HISTORY_MEAN][e];
        a.track_before = f->buffer[FV_HISTORY_TRACK][e];
        a.facing_before = f->buffer[FV_HISTORY_FACING][e];
    }
    f->kernels->accumulate(&a);
    uint8_t *layers = (uint8_t *)f->buffer[FV_TILE_LAYERS][0] + tile->index;
    *layers = (uint8_t)((*layers & ~FV_LAYER_EMPTY) | (a.empty ? FV_LAYER_EMPTY : 0));
    return 1;
}

static const char *idle(const struct fv_config *c)
{
    return c->denoise_history > 0 ? NULL : "denoise.history is 0: frames stand alone";
}

static void expect(const struct fv_frame *f, const struct fv_parameters *p, const struct fv_rings *rings, double units[2])
{
    (void)p;
    (void)rings;
    units[0] = (double)f->tiles;
}

const struct fv_pass fv_pass_accumulate = {
    .name = "accumulate",
    .reads = FV_BIT(FV_FILTERED) | FV_BIT(FV_DEPTH) | FV_BIT(FV_FACING) | FV_BIT(FV_TRACK) | FV_BIT(FV_HISTORY_MEAN) |
             FV_BIT(FV_HISTORY_TRACK) | FV_BIT(FV_HISTORY_FACING) | FV_BIT(FV_VARIANCE),
    .writes = FV_BIT(FV_LIGHT) | FV_BIT(FV_MEAN) | FV_BIT(FV_TRACK) | FV_BIT(FV_TILE_LAYERS) | FV_BIT(FV_VARIANCE),
    .idle = idle,
    .run = run,
    .expect = expect};
