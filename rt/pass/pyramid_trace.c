/* trace: masked blocks at the highest level of the pyramid, the others at the middle or the lowest one; see
 * pyramid.h. */
#include "rt/pass/pyramid.h"

#include "rt/pass/merge.h"

#include <math.h>
#include <string.h>

enum { BLOCK_PIXELS = FV_BLOCK * FV_BLOCK };

/* Where a pixel's rays begin: its block's start, or, of distances, the least of it and those around it. */
static float start_of(const struct fv_frame *f, int eye, float px, float py)
{
    int x = (int)px / FV_BLOCK, y = (int)py / FV_BLOCK;
    if (!f->pyramid.minimum) return fv_start_at(f, eye, x, y);
    int columns = (f->width + FV_BLOCK - 1) / FV_BLOCK, rows = (f->height + FV_BLOCK - 1) / FV_BLOCK;
    float least = INFINITY;
    for (int j = y > 0 ? y - 1 : 0; j <= y + 1 && j < rows; j++)
        for (int i = x > 0 ? x - 1 : 0; i <= x + 1 && i < columns; i++) least = fminf(least, fv_start_at(f, eye, i, j));
    return least;
}

/* The placed samples' colours. Where there are many a pixel, its rays share a cone of their own first. */
static int shade(struct fv_frame *f, const struct fv_tile *tile, int spp)
{
    struct fv_worker_scratch *w = &f->scratch[tile->worker];
    struct fv_samples *s = &w->samples;
    for (int i = 0; i < s->count; i++) s->start[i] = start_of(f, tile->eye, s->x[i], s->y[i]);
    s->started = true;
    if (spp >= 4 && !f->pyramid.minimum)
        f->kernels->starts(f->tracer, &f->view[tile->eye], s, 0.70711f * (float)(1 << tile->density), w->rays);
    fv_samples_trace_mean(f, tile, spp);
    s->started = false;
    return s->count * spp;
}

/* Blocks of the tile's raster: traced, and put there. */
static int trace_blocks(struct fv_frame *f, const struct fv_tile *tile, uint64_t blocks, int spp)
{
    if (!blocks) return 0;
    fv_tile_place(f, tile, blocks);
    int rays = shade(f, tile, spp);
    const uint32_t *pixel = f->scratch[tile->worker].pixel[FV_PLANE_BASE];
    uint32_t *colour = fv_tile_raster(f, tile)->colour;
    for (; blocks; blocks &= blocks - 1)
        for (int y = 0; y < FV_BLOCK; y++, pixel += FV_BLOCK) {
            uint32_t *row = colour + fv_block_row(f, tile, __builtin_ctzll(blocks), y);
            for (int x = 0; x < FV_BLOCK; x++) row[x] = pixel[x] | FV_PIXEL_SAMPLED;
        }
    return rays;
}

/* The middle level's blocks in which some block of 4 x 4 pixels is not masked. */
static uint64_t middle_blocks(uint64_t masked)
{
    uint64_t blocks = 0;
    for (int y = 0; y < FV_BLOCKS / 2; y++)
        for (int x = 0; x < FV_BLOCKS / 2; x++) {
            uint64_t four = 0x303ull << (16 * y + 2 * x);
            if ((masked & four) != four) blocks |= 1ull << (FV_BLOCKS * y + x);
        }
    return blocks;
}

/* Masked blocks into the middle level, as means. */
static void halve_masked(struct fv_frame *f, const struct fv_tile *tile, uint64_t masked)
{
    const struct fv_raster *fine = &f->raster[FV_FINE][tile->eye], *middle = &f->raster[FV_COARSE][tile->eye];
    for (; masked; masked &= masked - 1)
        for (int y = 0; y < FV_BLOCK; y += 2) {
            int64_t from = fv_block_row(f, tile, __builtin_ctzll(masked), y), row = from / fine->stride;
            const uint32_t *upper = fine->colour + from;
            f->kernels->halve(upper, upper + fine->stride,
                              middle->colour + row / 2 * middle->stride + from % fine->stride / 2, FV_BLOCK / 2);
        }
}

/* Whether this is the frame in which the tile's lower levels are traced again. */
static bool due(const struct fv_frame *f, const struct fv_tile *tile, int level)
{
    int refresh = f->parameters.refresh;
    int64_t turn = f->number + tile->x0 / FV_TILE + 2 * (tile->y0 / FV_TILE);
    return refresh <= 1 || turn % refresh == 0 || !(f->state[tile->index].holds[0] >> level & 1);
}

static int run(struct fv_frame *f, const struct fv_tile *tile)
{
    struct fv_tile lower = *tile;
    uint64_t masked = ((uint64_t *)f->buffer[FV_MASKED][0])[tile->index];
    bool fine = tile->density == FV_FINE;
    if (fine) lower.density = FV_COARSE;
    bool again = due(f, tile, lower.density);
    int rays = fine ? trace_blocks(f, tile, masked, f->parameters.spp) : 0;
    if (again) {
        uint64_t blocks = fv_tile_inside(f, &lower);
        rays += trace_blocks(f, &lower, fine ? blocks & middle_blocks(masked) : blocks, f->parameters.spp_middle);
    }
    if (fine) halve_masked(f, tile, masked);
    if (f->pyramid.foveated) {
        fv_merge_borders(f, tile);
        fv_merge_halve(f, tile, lower.density);
    }
    f->state[tile->index].holds[0] = (uint8_t)(FV_HELD_ALL << lower.density);
    return rays;
}

/* What stood there, where anything did; else the lowest level. */
static void stand_in(struct fv_frame *f, const struct fv_tile *tile)
{
    struct fv_tile_state *state = &f->state[tile->index];
    struct fv_tile lowest = *tile;
    ((uint64_t *)f->buffer[FV_MASKED][0])[tile->index] = 0;
    if (!(state->holds[0] >> FV_COARSEST & 1)) {
        lowest.density = FV_COARSEST;
        trace_blocks(f, &lowest, fv_tile_inside(f, &lowest), 1);
        state->holds[0] = 1 << FV_COARSEST;
    }
    state->density = state->holds[0] >> FV_COARSE & 1 ? FV_COARSE : FV_COARSEST;
}

static void expect(const struct fv_frame *f, const struct fv_parameters *p, const struct fv_rings *rings,
                   double units[2])
{
    const float edges = 0.3f; /* of blocks, from above */
    for (int d = 0; d < FV_DEGREES; d++) {
        float e = (float)d + 0.5f;
        double share = !f->pyramid.foveated || e <= p->foveal.r0_deg ? 1
                       : e <= p->foveal.r1_deg ? (double)(edges * p->p_scale * fv_edge_probability(e))
                                               : 0;
        double lower = 1.0 / fv_density_pixels(e > f->pyramid.lowest_deg ? FV_COARSEST : FV_COARSE) / p->refresh;
        share = fmin(share, 1);
        units[0] += (double)rings->pixels[d] * (share * p->spp + (1 - share) * lower * p->spp_middle);
    }
}

const struct fv_pass fv_pass_trace = {.name = "trace",
                                      .reads = FV_BIT(FV_STARTS) | FV_BIT(FV_MASKED),
                                      .writes = FV_BIT(FV_COLOUR) | FV_BIT(FV_COARSE_COLOUR) | FV_BIT(FV_COARSEST_COLOUR),
                                      .needs = FV_NEEDS_GAZE,
                                      .order = FV_ORDER_NEED,
                                      .run = run,
                                      .stand_in = stand_in,
                                      .expect = expect};
