/* trace: masked blocks at the highest level of the pyramid, the others at the middle or the lowest one; see
 * pyramid.h. */
#include "rt/pass/pyramid.h"

#include "rt/pass/bent.h"
#include "rt/pass/merge.h"

#include <math.h>
#include <string.h>

/* The least start of a pixel's block and those around it. */
static float least_of(const struct fv_frame *f, int eye, float px, float py)
{
    int x = (int)px / FV_BLOCK, y = (int)py / FV_BLOCK;
    int columns = fv_blocks_along(f->width), rows = fv_blocks_along(f->height);
    float least = INFINITY;
    for (int j = y > 0 ? y - 1 : 0; j <= y + 1 && j < rows; j++)
        for (int i = x > 0 ? x - 1 : 0; i <= x + 1 && i < columns; i++) least = fminf(least, fv_start_at(f, eye, i, j));
    return least;
}

int fv_pyramid_shade(struct fv_frame *f, const struct fv_tile *tile, int spp)
{
    struct fv_worker_scratch *w = &f->scratch[tile->worker];
    struct fv_samples *s = &w->samples;
    if (f->pyramid.minimum)
        for (int i = 0; i < s->count; i++) s->start[i] = least_of(f, tile->eye, s->x[i], s->y[i]);
    else
        for (int i = 0; i < s->count; i++)
            s->start[i] = fv_start_at(f, tile->eye, (int)s->x[i] / FV_BLOCK, (int)s->y[i] / FV_BLOCK);
    s->started = true;
    bool cones = spp >= 4 && !f->pyramid.minimum;
    if (cones) f->kernels->starts(f->tracer, &f->view[tile->eye], s, fv_reach_px(1 << tile->density), w->rays);
    fv_samples_trace_mean(f, tile, spp, cones && f->pyramid.ssaa_contrast > 0 && f->tracer->data->triangles == 0);
    s->started = false;
    return s->count * spp;
}

/* Pixels of lower levels in which something lies that the ray through the middle passed by. */
struct passed {
    int count;
    float x[FV_SAMPLES_MAX], y[FV_SAMPLES_MAX], start[FV_SAMPLES_MAX], hit[FV_SAMPLES_MAX];
    int at[FV_SAMPLES_MAX]; /* of the samples */
};

static void put_samples(struct fv_samples *s, const struct passed *p)
{
    s->count = p->count;
    memcpy(s->x, p->x, (size_t)p->count * sizeof *p->x);
    memcpy(s->y, p->y, (size_t)p->count * sizeof *p->y);
    memcpy(s->start, p->start, (size_t)p->count * sizeof *p->start);
    s->started = true;
}

static inline float greatest(float a, float b, float c)
{
    float ab = a > b ? a : b;
    return ab > c ? ab : c;
}

/* Of the samples just traced, the greatest inverse depth of each and of those next to it in the tile. */
static void take_nearest(const struct fv_samples *s, const struct fv_tile *tile, float nearest[FV_SAMPLES_MAX])
{
    enum { SIDE = FV_TILE / 2, ROW = SIDE + 2 };
    float tiled[ROW][ROW] = {{0}}, across[ROW][SIDE], around[SIDE][SIDE], scale = 1 / (float)(1 << tile->density);
    uint8_t at[FV_SAMPLES_MAX][2];
    for (int i = 0; i < s->count; i++) {
        at[i][0] = (uint8_t)((s->x[i] - (float)tile->x0) * scale);
        at[i][1] = (uint8_t)((s->y[i] - (float)tile->y0) * scale);
        tiled[1 + at[i][1]][1 + at[i][0]] = s->inverse_depth[i];
    }
    for (int y = 0; y < ROW; y++)
        for (int x = 0; x < SIDE; x++) across[y][x] = greatest(tiled[y][x], tiled[y][x + 1], tiled[y][x + 2]);
    for (int y = 0; y < SIDE; y++)
        for (int x = 0; x < SIDE; x++) around[y][x] = greatest(across[y][x], across[y + 1][x], across[y + 2][x]);
    for (int i = 0; i < s->count; i++) {
        float there = around[at[i][1]][at[i][0]];
        nearest[i] = there > 0 ? there : 0;
    }
}

/* Of the samples just traced, by their blocks' starts and then by cones of the pixels' own: those that stopped before
 * whatever was hit here or next to it. */
static void find_passed(struct fv_frame *f, const struct fv_tile *tile, struct passed *p)
{
    struct fv_worker_scratch *w = &f->scratch[tile->worker];
    struct fv_samples *s = &w->samples;
    float reach = fv_reach_px(1 << tile->density), size = fv_largest_pixel(&f->view[tile->eye]), nearest[FV_SAMPLES_MAX];
    int n = 0;
    take_nearest(s, tile, nearest);
    for (int i = 0; i < s->count; i++) {
        float hit = nearest[i] > 0 ? 1 / nearest[i] : INFINITY;
        if (!fv_stopped_before(s->start[i], hit, fv_reach_px(FV_BLOCK) * size)) continue;
        p->x[n] = s->x[i], p->y[n] = s->y[i], p->start[n] = s->start[i], p->hit[n] = hit;
        p->at[n++] = i;
    }
    p->count = n;
    if (n == 0) return;
    put_samples(s, p);
    f->kernels->starts(f->tracer, &f->view[tile->eye], s, reach, w->rays);
    p->count = 0;
    for (int i = 0; i < n; i++) {
        if (!fv_stopped_before(s->start[i], p->hit[i], reach * size)) continue;
        int k = p->count++;
        p->x[k] = p->x[i], p->y[k] = p->y[i], p->start[k] = s->start[i], p->at[k] = p->at[i];
    }
}

/* These again, of several samples each, so that what is thin shows by its share; returns rays. */
static int trace_passed(struct fv_frame *f, const struct fv_tile *tile, uint32_t *pixel, uint32_t *seen)
{
    struct passed p;
    struct fv_worker_scratch *w = &f->scratch[tile->worker];
    find_passed(f, tile, &p);
    if (p.count > 0) {
        put_samples(&w->samples, &p);
        fv_samples_trace_mean(f, tile, f->pyramid.spp_passed, false);
        for (int i = 0; i < p.count; i++) pixel[p.at[i]] = w->pixel[FV_PLANE_BASE][i], seen[p.at[i]] = 0;
    }
    w->samples.started = false;
    return p.count * f->pyramid.spp_passed;
}

static uint32_t *seen_of(const struct fv_frame *f, const struct fv_tile *tile)
{
    static const enum fv_buffer of[FV_DENSITIES] = {[FV_COARSE] = FV_COARSE_SEEN, [FV_COARSEST] = FV_COARSEST_SEEN};
    return tile->density == FV_FINE ? NULL : f->buffer[of[tile->density]][tile->eye];
}

/* What is carried over has moved, and with it where its pixels lie on what they show. */
static bool moved(const struct fv_frame *f, const struct fv_tile *tile)
{
    return f->pyramid.carry && !fv_map_still(&f->map[tile->eye], &f->view[tile->eye]);
}

/* That the tile's pixels show checks, at either level. */
static void forget_seen(const struct fv_frame *f, const struct fv_tile *at)
{
    struct fv_tile tile = *at;
    for (tile.density = FV_COARSE; tile.density < FV_DENSITIES; tile.density++) {
        uint32_t *seen = seen_of(f, &tile);
        for (int y = 0; seen && y < fv_tile_side(&tile); y++)
            memset(seen + fv_tile_row(f, &tile, y), 0, (size_t)fv_tile_side(&tile) * sizeof *seen);
    }
}

/* Of the samples just traced, what checks they show. */
static void take_seen(const struct fv_frame *f, const struct fv_samples *s, uint32_t *seen)
{
    const struct fv_field_part *part = f->tracer->data->fields.part;
    for (int i = 0; i < s->count; i++) {
        int id = s->part[i];
        bool checks = id >= 0 && id < FV_SEEN_PART && part[id].checker_size > 0 && s->inverse_depth[i] > 0;
        seen[i] = checks ? fv_seen(id, s->inverse_depth[i]) : 0;
    }
}

/* Blocks of the tile's raster: traced, and put there. `passed`: what rays passed by is looked for. */
static int trace_blocks(struct fv_frame *f, const struct fv_tile *tile, uint64_t blocks, int spp, bool passed)
{
    if (!blocks) return 0;
    fv_tile_place(f, tile, blocks);
    int rays = fv_pyramid_shade(f, tile, spp), n = f->scratch[tile->worker].samples.count;
    uint32_t copy[FV_SAMPLES_MAX], seen[FV_SAMPLES_MAX], *colour = fv_tile_raster(f, tile)->colour;
    uint32_t *seen_to = seen_of(f, tile);
    const uint32_t *pixel = copy, *seen_from = seen;
    if (seen_to) take_seen(f, &f->scratch[tile->worker].samples, seen);
    memcpy(copy, f->scratch[tile->worker].pixel[FV_PLANE_BASE], (size_t)n * sizeof *copy);
    if (passed && !f->pyramid.minimum && f->pyramid.spp_passed > spp) rays += trace_passed(f, tile, copy, seen);
    for (; blocks; blocks &= blocks - 1)
        for (int y = 0; y < FV_BLOCK; y++, pixel += FV_BLOCK, seen_from += FV_BLOCK) {
            int64_t at = fv_block_row(f, tile, __builtin_ctzll(blocks), y);
            for (int x = 0; x < FV_BLOCK; x++) colour[at + x] = pixel[x] | FV_PIXEL_SAMPLED;
            if (seen_to) memcpy(seen_to + at, seen_from, FV_BLOCK * sizeof *seen);
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

/* Whether the level of the tile is there without being traced. */
static bool held(const struct fv_frame *f, const struct fv_tile *tile, int level)
{
    const uint8_t *holds = f->state[tile->index].holds;
    return f->pyramid.carry ? f->pyramid.has_last && (holds[1] >> level & 1) : holds[0] >> level & 1;
}

/* Whether this is the frame in which the tile's lower levels are traced again. */
static bool due(const struct fv_frame *f, const struct fv_tile *tile, int level)
{
    int refresh = f->parameters.refresh;
    int64_t turn = f->number + tile->x0 / FV_TILE + 2 * (tile->y0 / FV_TILE);
    return refresh <= 1 || turn % refresh == 0 || !held(f, tile, level);
}

/* Of blocks of a level that is not traced again, those that must be. */
static uint64_t carry_over(struct fv_frame *f, const struct fv_tile *lower, uint64_t blocks)
{
    struct fv_worker_scratch *w = &f->scratch[lower->worker];
    if (!f->pyramid.carry) return 0;
    uint64_t failed = fv_pyramid_carry(f, lower, blocks);
    w->reprojected += __builtin_popcountll(blocks);
    w->failed += __builtin_popcountll(failed);
    return failed;
}

static int run(struct fv_frame *f, const struct fv_tile *tile)
{
    struct fv_tile lower = *tile;
    uint64_t masked = ((uint64_t *)f->buffer[FV_MASKED][0])[tile->index];
    bool fine = tile->density == FV_FINE;
    if (fine) lower.density = FV_COARSE;
    uint64_t blocks = fv_tile_inside(f, &lower);
    bool again = due(f, tile, lower.density);
    f->state[tile->index].waits = !again;
    if (again || moved(f, tile)) forget_seen(f, tile);
    if (fine) blocks &= middle_blocks(masked | ~fv_tile_inside(f, tile));
    if (!again) blocks = carry_over(f, &lower, blocks);
    int rays = fine ? trace_blocks(f, tile, masked, f->parameters.spp, false) : 0;
    rays += trace_blocks(f, &lower, blocks, f->parameters.spp_middle, true);
    if (fine && (f->pyramid.foveated || f->pyramid.cut)) halve_masked(f, tile, masked);
    if (f->pyramid.foveated || f->pyramid.cut) {
        fv_merge_double(f, tile);
        fv_merge_halve(f, tile, lower.density);
    }
    uint8_t *holds = &f->state[tile->index].holds[0], refined = again || f->pyramid.carry ? 0 : *holds & 1;
    *holds = (uint8_t)(FV_HELD_ALL << lower.density | refined);
    return rays;
}

/* What the last frame showed there, carried over or as it stands, where it showed anything; else the lowest level, once
 * a pixel. Neighbours may be looking at what stands there when they are composed and shown: nothing is left that is of
 * another frame. */
static void stand_in(struct fv_frame *f, const struct fv_tile *tile)
{
    struct fv_tile_state *state = &f->state[tile->index];
    struct fv_tile lower = *tile;
    ((uint64_t *)f->buffer[FV_MASKED][0])[tile->index] = 0;
    lower.density = held(f, tile, FV_COARSE) ? FV_COARSE : FV_COARSEST;
    bool there = held(f, tile, lower.density);
    state->waits = there;
    if (!there || moved(f, tile)) forget_seen(f, tile);
    if (!there) trace_blocks(f, &lower, fv_tile_inside(f, &lower), 1, false);
    else if (f->pyramid.carry) fv_pyramid_carry(f, &lower, fv_tile_inside(f, &lower));
    if (!there || f->pyramid.carry) {
        fv_merge_double(f, &lower);
        fv_merge_halve(f, &lower, lower.density);
        state->holds[0] = (uint8_t)(FV_HELD_ALL << lower.density);
    }
    state->density = (uint8_t)lower.density;
}

static void expect(const struct fv_frame *f, const struct fv_parameters *p, const struct fv_rings *rings,
                   double units[2])
{
    const float edges = 0.3f; /* of blocks, from above */
    float again = f->pyramid.carry && !f->pyramid.has_last ? 1 : 1 / (float)p->refresh;
    if (f->pyramid.carry) again += (1 - again) * f->failed_share;
    for (int d = 0; d < FV_DEGREES; d++) {
        float e = (float)d + 0.5f;
        double share = !f->pyramid.foveated || e <= p->foveal.r0_deg ? 1
                       : e <= p->foveal.r1_deg ? (double)(edges * p->p_scale * fv_edge_probability(e))
                                               : 0;
        double lower = (double)again / fv_density_pixels(e > f->pyramid.lowest_deg ? FV_COARSEST : FV_COARSE);
        share = fmin(share, 1);
        units[0] += (double)rings->pixels[d] * (share * p->spp + (1 - share) * lower * p->spp_middle);
    }
}

const struct fv_pass fv_pass_trace = {.name = "trace",
                                      .reads = FV_BIT(FV_STARTS) | FV_BIT(FV_MASKED) | FV_CARRIED,
                                      .writes = FV_BIT(FV_COLOUR) | FV_BIT(FV_COARSE_COLOUR) | FV_BIT(FV_COARSEST_COLOUR) | FV_SEEN,
                                      .needs = FV_NEEDS_GAZE,
                                      .order = FV_ORDER_NEED,
                                      .run = run,
                                      .stand_in = stand_in,
                                      .expect = expect};
