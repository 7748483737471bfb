/* reuse: tiles whose pixels may take the last frame's colours; see reuse.h. */
#include "rt/pass/reuse.h"

#include "config/config.h"
#include "rt/pass/lattice.h"
#include "rt/pass/selective.h"

#include <string.h>

static struct fv_known known_of(const struct fv_frame *f, int eye, enum fv_buffer base, int64_t at)
{
    const uint32_t *of[FV_SECOND_FACING - FV_BASE + 1];
    for (int k = 0; k <= FV_SECOND_FACING - FV_BASE; k++) {
        of[k] = f->buffer[(int)base + k][eye];
        if (of[k]) of[k] += at;
    }
    return (struct fv_known){of[0], of[FV_IDENTITY - FV_BASE], of[FV_FACING - FV_BASE], of[FV_SECOND_IDENTITY - FV_BASE],
                             of[FV_SECOND_FACING - FV_BASE]};
}

/* Blocks whose turn it is to be sampled, by rows of pixels. */
static void take_turns(const struct fv_frame *f, const struct fv_tile *tile, uint32_t due[FV_TILE])
{
    float share = 1 / (float)(f->selective.reuse_max + 1);
    memset(due, 0, FV_TILE * sizeof *due);
    for (int block = 0; block < FV_BLOCKS * FV_BLOCKS; block++) {
        if (fv_tile_threshold(f, tile, block) >= share) continue;
        for (int y = 0; y < FV_BLOCK; y++) due[block / FV_BLOCKS * FV_BLOCK + y] |= 15u << block % FV_BLOCKS * FV_BLOCK;
    }
}

/* Nothing is reused of the tile, nor may be in the next frame. */
static void stand_in(struct fv_frame *f, const struct fv_tile *tile)
{
    uint8_t *chain = (uint8_t *)f->buffer[FV_CHAIN][tile->eye] + fv_tile_row(f, tile, 0);
    memset((uint32_t *)f->buffer[FV_REUSED][0] + tile->index * FV_TILE, 0, FV_TILE * sizeof(uint32_t));
    if (tile->density != FV_FINE) return;
    for (int y = 0; y < FV_TILE; y++) memset(chain + y * f->stride, FV_CHAIN_NONE, FV_TILE);
}

static void reuse_row(struct fv_frame *f, const struct fv_tile *tile, int y, struct fv_reuse *r)
{
    struct fv_worker_scratch *s = &f->scratch[tile->worker];
    int64_t at = fv_tile_row(f, tile, y);
    uint8_t *chain = (uint8_t *)f->buffer[FV_CHAIN][tile->eye] + at;
    r->row = fv_row_of(f, tile, y);
    r->now = known_of(f, tile->eye, FV_BASE, at);
    r->colour = (uint32_t *)f->buffer[FV_COLOUR][tile->eye] + at;
    f->kernels->reuse(r);
    for (int x = 0; x < FV_TILE; x++) chain[x] = (uint8_t)r->chain[x];
    ((uint32_t *)f->buffer[FV_REUSED][0])[tile->index * FV_TILE + y] = r->reused;
    s->central += __builtin_popcount(r->central);
    s->reused += __builtin_popcount(r->reused);
}

static int run(struct fv_frame *f, const struct fv_tile *tile)
{
    _Alignas(64) float tolerance[FV_TILE], e[FV_TILE];
    _Alignas(64) int32_t chain[FV_TILE];
    fv_lattice around, tolerances;
    uint32_t due[FV_TILE];
    stand_in(f, tile);
    if (tile->density != FV_FINE || !fv_tile_within(f, tile, f->parameters.near_deg)) return 0;
    int stamp = fv_identity_stamp(f);
    struct fv_reuse r = {.last = fv_backproject_to(f, tile, f->buffer[FV_HISTORY_COLOUR][tile->eye],
                                                   f->buffer[FV_HISTORY_CACHE][tile->eye], f->object_map[tile->eye],
                                                   &f->before[tile->eye].bend, 0),
                         .before = known_of(f, tile->eye, FV_HISTORY_BASE, 0),
                         .stamp_before = stamp > 1 ? stamp - 1 : 31,
                         .chain_before = f->buffer[FV_HISTORY_CHAIN][tile->eye],
                         .tolerance = tolerance, .settings = &f->selective, .chain = chain};
    fv_lattice_eccentricity(f, tile, around);
    fv_lattice_tolerance(f, around, f->selective.reuse, tolerances);
    take_turns(f, tile, due);
    for (int y = 0; y < FV_TILE && tile->y0 + y < f->height; y++) {
        fv_lattice_row(around, 0.5f, (float)y + 0.5f, FV_TILE, e);
        fv_lattice_row(tolerances, 0.5f, (float)y + 0.5f, FV_TILE, tolerance);
        for (int x = 0; x < FV_TILE; x++) tolerance[x] = e[x] <= f->parameters.near_deg ? tolerance[x] : -1;
        r.due = f->has_history ? due[y] : ~0u;
        reuse_row(f, tile, y, &r);
    }
    return FV_TILE * FV_TILE;
}

static void expect(const struct fv_frame *f, const struct fv_parameters *p, const struct fv_rings *rings, double units[2])
{
    (void)f;
    for (int d = 0; d < FV_DEGREES && (float)d < p->near_deg; d++) units[0] += (double)rings->pixels[d];
}

static const char *idle(const struct fv_config *config)
{
    return config->selective_reuse > 0 ? NULL : "selective.reuse is 0";
}

const struct fv_pass fv_pass_reuse = {
    .name = "reuse",
    .reads = FV_BIT(FV_BASE) | FV_BIT(FV_IDENTITY) | FV_BIT(FV_FACING) | FV_BIT(FV_SECOND_IDENTITY) | FV_BIT(FV_SECOND_FACING) |
             FV_BIT(FV_CACHE) | FV_BIT(FV_HISTORY_COLOUR) | FV_BIT(FV_HISTORY_CACHE) | FV_BIT(FV_HISTORY_BASE) |
             FV_BIT(FV_HISTORY_IDENTITY) | FV_BIT(FV_HISTORY_FACING) | FV_BIT(FV_HISTORY_SECOND_IDENTITY) |
             FV_BIT(FV_HISTORY_SECOND_FACING) | FV_BIT(FV_HISTORY_CHAIN),
    .writes = FV_BIT(FV_COLOUR) | FV_BIT(FV_CHAIN) | FV_BIT(FV_REUSED),
    .needs = FV_NEEDS_GAZE | FV_NEEDS_NOISE,
    .order = FV_ORDER_GAZE,
    .idle = idle,
    .run = run,
    .stand_in = stand_in,
    .expect = expect};
