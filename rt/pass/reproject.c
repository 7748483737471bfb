/* reproject: the pass around the kernel: carries history into all tiles that have any use for it, merges the
 * support image's samples into it, and asks for a sample of every block where too little history arrived
 * (disocclusions, parts new to the view), and of more of those that are marked (resampling info). */
#include "rt/pass/reproject.h"

#include "rt/pass/bent.h"
#include "rt/pass/cache.h"
#include "rt/pass/merge.h"

#include <math.h>
#include <string.h>

/* The map between pictures, for rasters whose pixels are `scale` times as large. */
static struct fv_map scaled(const struct fv_map *map, float scale)
{
    struct fv_map out = *map;
    for (int i = 0; i < 3; i++) out.m[i][0] *= scale, out.m[i][1] *= scale;
    for (int k = 0; k < 2; k++) {
        for (int i = 0; i < 3; i++) out.m[k][i] /= scale;
        out.t[k] /= scale;
    }
    return out;
}

/* Where what stands in the tile's middle was, in homogeneous pixels of the picture; returns its inverse depth. */
static float carry_middle(const struct fv_frame *f, const struct fv_tile *tile, float to[3])
{
    int e = tile->eye, x = tile->x0 + FV_TILE / 2, y = tile->y0 + FV_TILE / 2;
    int64_t node = y / f->spacing * (f->stride / f->spacing) + x / f->spacing;
    int object = ((const uint8_t *)f->buffer[FV_SUPPORT_SURFACE][e])[node] & FV_SURFACE_OBJECT;
    float w = ((const float *)f->buffer[FV_SUPPORT_DEPTH][e])[node];
    if (!(w >= 0 && w <= FV_INVERSE_DEPTH_MAX)) w = 0;
    struct fv_map map = fv_bent_map(f, e, object, (float)x, (float)y, w);
    fv_map_point(&map, (float)x, (float)y, w, to);
    return w;
}

static struct fv_map tile_map(const struct fv_frame *f, const struct fv_tile *tile, int object, float w)
{
    return fv_bent_map(f, tile->eye, object, (float)(tile->x0 + FV_TILE / 2), (float)(tile->y0 + FV_TILE / 2), w);
}

/* The moving objects that nodes show in the tile and two cells around it, as far as the kernel goes. */
static void take_objects(const struct fv_frame *f, const struct fv_tile *tile, struct fv_reproject_tile *t)
{
    int x0 = tile->x0 / f->spacing - 2, y0 = tile->y0 / f->spacing - 2, along = FV_TILE / f->spacing + 4;
    uint32_t seen = 0;
    for (int y = 0; y < along; y++)
        for (int x = 0; x < along; x++) {
            int64_t at = fv_clamp(y0 + y, t->nodes_y) * t->support_stride + fv_clamp(x0 + x, t->nodes_x);
            seen |= 1u << (t->support_surface[at] & FV_SURFACE_OBJECT);
        }
    for (seen &= ~1u; seen && t->objects < FV_TILE_OBJECTS; seen &= seen - 1, t->objects++) {
        t->object[t->objects] = (uint8_t)__builtin_ctz(seen);
        int o = t->object[t->objects] - 1;
        t->stirs |= memcmp(&f->object[o], &f->object_before[o], sizeof f->object[o]) != 0;
        struct fv_map map = tile_map(f, tile, t->object[t->objects], t->middle);
        t->object_map[t->objects] = scaled(&map, t->raster->scale);
    }
}

struct fv_reprojected fv_reproject(struct fv_frame *f, const struct fv_tile *tile)
{
    int e = tile->eye, side = f->spacing;
    const struct fv_raster *raster = fv_tile_raster(f, tile);
    float spacing = (float)side / raster->scale, to[3], middle = carry_middle(f, tile, to);
    struct fv_map map = tile_map(f, tile, 0, middle);
    struct fv_reproject_tile t = {
        .map = scaled(&map, raster->scale),
        .middle = middle,
        .moves = f->tracer->instances > 0,
        .raster = raster,
        .x0 = tile->x0 >> tile->density,
        .y0 = tile->y0 >> tile->density,
        .side = fv_tile_side(tile),
        .sharp = f->sharp,
        .spacing = spacing,
        .node = {f->node[0] * spacing, f->node[1] * spacing},
        .nodes_x = (f->width + side - 1) / side,
        .nodes_y = (f->height + side - 1) / side,
        .planes = f->planes,
        .support_stride = f->stride / side,
        .support_plane = f->support_plane,
        .support_colour = f->buffer[FV_SUPPORT_COLOUR][e],
        .support_depth = f->buffer[FV_SUPPORT_DEPTH][e],
        .support_surface = f->buffer[FV_SUPPORT_SURFACE][e],
        .epsilon = f->epsilon_depth,
        .still = f->still,
        .epsilon_luminance = f->epsilon_luminance,
    };
    if (!f->has_history) t.map = (struct fv_map){0}; /* leads nowhere: all is filled from the support image */
    else if (t.moves) take_objects(f, tile, &t);
    /* What was nearer by a factor was larger by the same. */
    t.footprint = to[2] > 0.125f ? 1 / to[2] : 8;
    for (int d = tile->density + 1; d < FV_DENSITIES; d++) t.coarser[t.coarsers++] = &f->raster[d][e];
    f->kernels->reproject[tile->density](&t);
    f->state[tile->index].reprojected = 1;
    fv_merge_nodes(f, tile);
    return (struct fv_reprojected){.marked = t.marked, .failed = t.failed};
}

static int run(struct fv_frame *f, const struct fv_tile *tile)
{
    uint64_t *selected = (uint64_t *)f->buffer[FV_SELECTED][0] + tile->index;
    uint64_t *resampled = (uint64_t *)f->buffer[FV_RESAMPLED][0] + tile->index, inside = fv_tile_inside(f, tile);
    struct fv_worker_scratch *s = &f->scratch[tile->worker];
    if (f->failed_blocks) f->failed_blocks[tile->index] = 0;
    *resampled = 0;
    if ((*selected == inside && !f->keep) || !f->has_history) return 0;
    struct fv_reprojected r = fv_reproject(f, tile);
    r.failed &= inside;
    r.marked &= inside & ~r.failed;
    s->reprojected += __builtin_popcountll(inside);
    s->marked += __builtin_popcountll(r.marked);
    s->failed += __builtin_popcountll(r.failed);
    if (f->failed_blocks) f->failed_blocks[tile->index] = (uint8_t)__builtin_popcountll(r.failed);
    float p = fv_resample_probability(f, &f->parameters, tile->density);
    *resampled = r.failed;
    /* Where they are sampled no more often than others, what is to be is chosen already. */
    if (f->resample <= 1 && f->keep) r.marked = 0;
    for (; r.marked; r.marked &= r.marked - 1) {
        int block = __builtin_ctzll(r.marked);
        if (fv_tile_threshold(f, tile, block) < p) *resampled |= 1ull << block;
    }
    *selected |= *resampled;
    if (!*selected) fv_merge_coarse(f, tile); /* else once it is sampled */
    return fv_tile_side(tile) * fv_tile_side(tile);
}

/* n pixels of a row of history from `from` on, as they are, a frame older; false, and nothing done, where some hold no
 * history. */
static bool copy_row(const struct fv_frame *f, const struct fv_raster *r, int64_t from, int64_t to, int n)
{
    const uint32_t *colour = r->history_colour + from, *cache = r->history_cache + from;
    uint32_t *new_colour = r->colour + to, *new_cache = r->cache + to, greatest = 0;
    for (int x = 0; x < n; x++) greatest = cache[x] > greatest ? cache[x] : greatest;
    if (greatest >= FV_CACHE_NONE) return false;
    for (int x = 0; x < n; x++) new_colour[x] = colour[x] & FV_PIXEL_COLOUR;
    for (int x = 0; x < n; x++) new_cache[x] = cache[x] + ((cache[x] & FV_CACHE_OLDEST) < FV_CACHE_OLDEST);
    for (int p = FV_PLANE_ALBEDO; p < f->planes; p++)
        memcpy(new_colour + p * r->plane, colour + p * r->plane, (size_t)n * sizeof *colour);
    return true;
}

/* One pixel of history, where there is none of a coarser raster. */
static void copy_pixel(const struct fv_frame *f, const struct fv_tile *tile, int from_x, int from_y, int64_t to)
{
    const struct fv_raster *raster = fv_tile_raster(f, tile), *source = raster;
    int64_t from = from_y * raster->stride + from_x;
    uint32_t cache = raster->history_cache[from];
    for (int d = tile->density + 1; d < FV_DENSITIES && cache >= FV_CACHE_NONE; d++) {
        source = &f->raster[d][tile->eye];
        from = (from_y >> (d - tile->density)) * source->stride + (from_x >> (d - tile->density));
        cache = source->history_cache[from];
    }
    raster->colour[to] = source->history_colour[from] & FV_PIXEL_COLOUR;
    for (int p = FV_PLANE_ALBEDO; p < f->planes; p++)
        raster->colour[p * raster->plane + to] = source->history_colour[p * source->plane + from];
    /* What is blurred counts as one old sample at most. */
    if (source != raster) cache = (cache & ~0xff7fu) | FV_CACHE_OLDEST | (cache >> 8 & 255 ? 1 << 8 : 0);
    raster->cache[to] = cache + ((cache & FV_CACHE_OLDEST) < FV_CACHE_OLDEST);
}

/* The history's pixels, all of the tile moved by as much as the surface in its middle. */
static void stand_in(struct fv_frame *f, const struct fv_tile *tile)
{
    const struct fv_raster *raster = fv_tile_raster(f, tile);
    float x = (float)(tile->x0 + FV_TILE / 2), y = (float)(tile->y0 + FV_TILE / 2), to[3];
    int side = fv_tile_side(tile), x0 = tile->x0 >> tile->density, y0 = tile->y0 >> tile->density;
    if (f->failed_blocks) f->failed_blocks[tile->index] = 0;
    ((uint64_t *)f->buffer[FV_RESAMPLED][0])[tile->index] = 0;
    if (((const uint64_t *)f->buffer[FV_SELECTED][0])[tile->index] == fv_tile_inside(f, tile) && !f->keep) return;
    carry_middle(f, tile, to);
    float dx = to[2] > 1e-4f ? to[0] / to[2] - x : 0, dy = to[2] > 1e-4f ? to[1] / to[2] - y : 0;
    int moved_x = fabsf(dx) < 16384 ? (int)lroundf(dx / raster->scale) : 0;
    int moved_y = fabsf(dy) < 16384 ? (int)lroundf(dy / raster->scale) : 0;
    bool within = x0 + moved_x >= 0 && x0 + moved_x + side <= raster->width;
    for (int row = 0; row < side; row++) {
        int from_y = fv_clamp(y0 + row + moved_y, raster->height);
        int64_t at = fv_tile_row(f, tile, row);
        if (within && copy_row(f, raster, from_y * raster->stride + x0 + moved_x, at, side)) continue;
        for (int column = 0; column < side; column++)
            copy_pixel(f, tile, fv_clamp(x0 + column + moved_x, raster->width), from_y, at + column);
    }
    f->state[tile->index].reprojected = 1;
    fv_merge_coarse(f, tile);
}

static void expect(const struct fv_frame *f, const struct fv_parameters *p, const struct fv_rings *rings,
                   double units[2])
{
    float radius_deg = fv_radius_deg(&f->view[0], FV_TILE);
    if (!f->has_history || (p->foveal.p_min >= 1 && !f->keep)) return;
    for (int d = 0; d < FV_DEGREES; d++) {
        float e = (float)d + 0.5f;
        if (f->keep || e > p->foveal.r0_deg - radius_deg)
            units[0] += (double)rings->tiles[d] * FV_TILE * FV_TILE / fv_density_pixels(fv_ring_density(f, p, e));
    }
}

float fv_resample_probability(const struct fv_frame *f, const struct fv_parameters *p, int density)
{
    return fv_block_probability(f, fminf(1, f->resample * p->foveal.p_min), density, p->spacing);
}

double fv_reproject_share(const struct fv_frame *f, float p, float p_marked)
{
    p += f->marked_share * fmaxf(0, p_marked - p);
    return (double)(p + f->failed_share * (1 - p));
}

const struct fv_pass fv_pass_reproject = {
    .name = "reproject",
    .reads = FV_RASTERS << FV_HISTORY_COLOUR | FV_BIT(FV_SUPPORT_COLOUR) | FV_BIT(FV_SUPPORT_DEPTH) |
             FV_BIT(FV_SUPPORT_SURFACE) | FV_BIT(FV_SELECTED),
    .writes = FV_RASTERS << FV_COLOUR | FV_BIT(FV_SELECTED) | FV_BIT(FV_RESAMPLED),
    .needs = FV_NEEDS_NOISE | FV_NEEDS_HISTORY,
    .run = run,
    .stand_in = stand_in,
    .expect = expect};
