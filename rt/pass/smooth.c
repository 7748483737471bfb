/* smooth: tiles smoothed over the frames before; see smooth.h. */
#include "rt/pass/smooth.h"

#include "config/config.h"
#include "rt/pass/lattice.h"

#include <math.h>

/* Within so many degrees of the central region's border frames before count less and less. */
#define FADE_DEG 2.0f

/* Eccentricity up to which pixels are smoothed. */
static float reach_deg(const struct fv_frame *f, const struct fv_parameters *p)
{
    return f->selective.every ? 180 : p->near_deg;
}

struct weights {
    fv_lattice rest, share;
};

static void take_weights(const struct fv_frame *f, const struct fv_tile *tile, struct weights *w)
{
    const struct fv_selective *s = &f->selective;
    float end = reach_deg(f, &f->parameters), fade = fminf(FADE_DEG, 0.25f * end);
    fv_lattice e;
    fv_lattice_eccentricity(f, tile, e);
    for (int y = 0; y < FV_LATTICE; y++)
        for (int x = 0; x < FV_LATTICE; x++) {
            w->rest[y][x] = 1 - fv_smoothing_at(&s->regions, s->alpha, e[y][x]);
            w->share[y][x] = s->every ? 1 : (end - e[y][x]) / fmaxf(fade, 1e-3f);
        }
}

static void smooth_tile(struct fv_frame *f, const struct fv_tile *tile, const struct weights *w)
{
    _Alignas(64) float rest[FV_TILE], share[FV_TILE];
    int e = tile->eye;
    struct fv_smooth s = {.pasts = f->pasts, .rest = rest, .share = share};
    for (int k = 0; k < f->pasts; k++)
        s.past[k] = fv_backproject_to(f, tile, f->past[k].colour[e], f->past[k].cache[e], f->past[k].map[e],
                                      &f->past[k].view[e].bend, k);
    for (int y = 0; y < FV_TILE && tile->y0 + y < f->height; y++) {
        s.row = fv_row_of(f, tile, y);
        s.smoothed = (uint32_t *)f->buffer[FV_SMOOTHED][e] + fv_tile_row(f, tile, y);
        fv_lattice_row(w->rest, 0.5f, (float)y + 0.5f, FV_TILE, rest);
        fv_lattice_row(w->share, 0.5f, (float)y + 0.5f, FV_TILE, share);
        for (int x = 0; x < FV_TILE; x++) share[x] = share[x] < 0 ? 0 : share[x] > 1 ? 1 : share[x];
        f->kernels->smooth(&s);
    }
}

/* As it is. */
static void stand_in(struct fv_frame *f, const struct fv_tile *tile)
{
    f->state[tile->index].smoothed = 0;
}

static int run(struct fv_frame *f, const struct fv_tile *tile)
{
    struct weights w;
    bool within = fv_tile_within(f, tile, reach_deg(f, &f->parameters));
    f->state[tile->index].smoothed = f->pasts > 0 && tile->density == FV_FINE && within;
    if (!f->state[tile->index].smoothed) return 0;
    take_weights(f, tile, &w);
    smooth_tile(f, tile, &w);
    return FV_TILE * FV_TILE;
}

static void expect(const struct fv_frame *f, const struct fv_parameters *p, const struct fv_rings *rings, double units[2])
{
    for (int d = 0; d < FV_DEGREES && (float)d < reach_deg(f, p); d++) units[0] += (double)rings->pixels[d];
}

static const char *idle(const struct fv_config *config)
{
    return config->selective_smooth == 0 ? "selective.smooth is 0" : NULL;
}

const struct fv_pass fv_pass_smooth = {
    .name = "smooth",
    .reads = FV_BIT(FV_COLOUR) | FV_BIT(FV_CACHE) | FV_BIT(FV_IDENTITY) | FV_BIT(FV_HISTORY_COLOUR) | FV_BIT(FV_HISTORY_CACHE) |
             FV_BIT(FV_EARLIER_COLOUR) | FV_BIT(FV_EARLIER_CACHE),
    .writes = FV_BIT(FV_SMOOTHED),
    .needs = FV_NEEDS_GAZE,
    .order = FV_ORDER_GAZE,
    .idle = idle,
    .run = run,
    .stand_in = stand_in,
    .expect = expect};
