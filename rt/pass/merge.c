/* merge: pixels collected for the kernel, and put back; see merge.h. */
#include "rt/pass/merge.h"

#include "rt/pass/cache.h"

enum {
    BLOCK_PIXELS = FV_BLOCK * FV_BLOCK,
    REACH = 3 /* of the filters that interpolate history, in pixels beyond a tile */
};

/* `sample`: encoded, of f->planes; NULL: the worker's samples are merged as they are. */
static void merge(struct fv_frame *f, const struct fv_tile *tile, int count,
                  const uint32_t (*sample)[FV_SAMPLES_MAX], const float *inverse_depth, const int32_t *surface)
{
    struct fv_worker_scratch *s = &f->scratch[tile->worker];
    struct fv_merge m = {.count = count,
                         .seed = (uint32_t)f->number * 0x85ebca6bu + (uint32_t)tile->index * 0xc2b2ae35u,
                         .epsilon = f->epsilon_depth,
                         .still = f->still,
                         .k = f->k[f->still],
                         .red = s->samples.red,
                         .green = s->samples.green,
                         .blue = s->samples.blue,
                         .exposure = f->tracer->data->exposure,
                         .inverse_depth = inverse_depth,
                         .surface = surface,
                         .nearest = s->nearest,
                         .farthest = s->farthest,
                         .replaced = s->replaced,
                         .colour = s->merged_colour[FV_PLANE_BASE],
                         .cache = s->merged_cache,
                         .apart = fv_light_apart(f),
                         .light_k = f->light_k[f->still],
                         .albedo = s->merged_colour[FV_PLANE_ALBEDO],
                         .light = s->merged_colour[FV_PLANE_LIGHT]};
    if (sample) {
        m.sample = sample[FV_PLANE_BASE];
        m.sample_albedo = sample[FV_PLANE_ALBEDO];
        m.sample_light = sample[FV_PLANE_LIGHT];
    }
    f->kernels->merge(&m);
}

static void take_bounds(const struct fv_frame *f, const struct fv_tile *tile, uint32_t rows)
{
    struct fv_worker_scratch *s = &f->scratch[tile->worker];
    const struct fv_raster *raster = fv_tile_raster(f, tile);
    f->kernels->bounds[tile->density](raster->cache + fv_tile_row(f, tile, 0), raster->stride, fv_tile_side(tile), rows,
                       s->tile_nearest, s->tile_farthest);
}

/* Of the blocks' pixels, albedo and light: to the worker, or back. */
static void move_apart(struct fv_frame *f, const struct fv_tile *tile, uint64_t blocks, bool back)
{
    const struct fv_raster *raster = fv_tile_raster(f, tile);
    for (int p = FV_PLANE_ALBEDO; p < FV_PLANES; p++) {
        uint32_t *merged = f->scratch[tile->worker].merged_colour[p];
        for (uint64_t left = blocks; left; left &= left - 1)
            for (int y = 0; y < FV_BLOCK; y++, merged += FV_BLOCK) {
                uint32_t *row = raster->colour + p * raster->plane + fv_block_row(f, tile, __builtin_ctzll(left), y);
                memcpy(back ? row : merged, back ? merged : row, FV_BLOCK * sizeof *row);
            }
    }
}

void fv_merge_blocks(struct fv_frame *f, const struct fv_tile *tile, uint64_t blocks, uint64_t replaced)
{
    struct fv_worker_scratch *s = &f->scratch[tile->worker];
    const struct fv_raster *raster = fv_tile_raster(f, tile);
    uint32_t *colour = s->merged_colour[FV_PLANE_BASE];
    int n = 0;
    take_bounds(f, tile, fv_block_rows(blocks));
    for (uint64_t left = blocks; left; left &= left - 1) {
        int block = __builtin_ctzll(left);
        int first = block / FV_BLOCKS * FV_BLOCK * FV_TILE + block % FV_BLOCKS * FV_BLOCK;
        int32_t dropped = -(int32_t)(replaced >> block & 1);
        for (int i = 0; i < BLOCK_PIXELS; i++) s->replaced[n + i] = dropped;
        for (int y = 0; y < FV_BLOCK; y++, n += FV_BLOCK) {
            int64_t at = fv_block_row(f, tile, block, y);
            memcpy(colour + n, raster->colour + at, FV_BLOCK * sizeof(uint32_t));
            memcpy(s->merged_cache + n, raster->cache + at, FV_BLOCK * sizeof(uint32_t));
            memcpy(s->nearest + n, s->tile_nearest + first + y * FV_TILE, FV_BLOCK * sizeof(float));
            memcpy(s->farthest + n, s->tile_farthest + first + y * FV_TILE, FV_BLOCK * sizeof(float));
        }
    }
    if (fv_light_apart(f)) move_apart(f, tile, blocks, false);
    merge(f, tile, n, fv_light_apart(f) ? s->pixel : NULL, s->samples.inverse_depth, s->samples.surface);
    n = 0;
    for (uint64_t left = blocks; left; left &= left - 1)
        for (int y = 0; y < FV_BLOCK; y++, n += FV_BLOCK) {
            int64_t at = fv_block_row(f, tile, __builtin_ctzll(left), y);
            memcpy(raster->colour + at, colour + n, FV_BLOCK * sizeof(uint32_t));
            memcpy(raster->cache + at, s->merged_cache + n, FV_BLOCK * sizeof(uint32_t));
        }
    if (fv_light_apart(f)) move_apart(f, tile, blocks, true);
}

void fv_merge_nodes(struct fv_frame *f, const struct fv_tile *tile)
{
    struct fv_worker_scratch *s = &f->scratch[tile->worker];
    const struct fv_raster *raster = fv_tile_raster(f, tile);
    const uint32_t *colour = f->buffer[FV_SUPPORT_COLOUR][tile->eye];
    const float *depth = f->buffer[FV_SUPPORT_DEPTH][tile->eye];
    const uint8_t *seen = f->buffer[FV_SUPPORT_SURFACE][tile->eye];
    _Alignas(64) float inverse_depth[FV_TILE / 4 * FV_TILE / 4];
    _Alignas(64) int32_t surface[FV_TILE / 4 * FV_TILE / 4];
    int64_t at[FV_TILE / 4 * FV_TILE / 4];
    /* In a cell; exact, spacing being a power of two, and so below it. */
    int node_x = (int)(f->node[0] * (float)f->spacing), node_y = (int)(f->node[1] * (float)f->spacing);
    int side = FV_TILE / f->spacing, n = 0;
    uint32_t rows = 0;
    int64_t first = tile->y0 / f->spacing * (f->stride / f->spacing) + tile->x0 / f->spacing;
    for (int y = 0; y < side; y++)
        for (int x = 0; x < side; x++)
            if (!(seen[first + y * (f->stride / f->spacing) + x] & FV_SURFACE_OLD))
                rows |= 1u << ((y * f->spacing + node_y) >> tile->density);
    if (!rows) return;
    take_bounds(f, tile, rows);
    for (int y = 0; y < side; y++)
        for (int x = 0; x < side; x++) {
            int64_t node = first + y * (f->stride / f->spacing) + x;
            if (seen[node] & FV_SURFACE_OLD) continue;
            int column = (x * f->spacing + node_x) >> tile->density, row = (y * f->spacing + node_y) >> tile->density;
            at[n] = fv_tile_row(f, tile, row) + column;
            for (int p = 0; p < f->planes; p++) {
                s->pixel[p][n] = colour[p * f->support_plane + node];
                s->merged_colour[p][n] = raster->colour[p * raster->plane + at[n]];
            }
            inverse_depth[n] = depth[node];
            surface[n] = seen[node];
            s->merged_cache[n] = raster->cache[at[n]];
            s->replaced[n] = 0;
            s->nearest[n] = s->tile_nearest[row * FV_TILE + column];
            s->farthest[n++] = s->tile_farthest[row * FV_TILE + column];
        }
    for (int i = n; i < BLOCK_PIXELS; i++) inverse_depth[i] = FV_DEPTH_UNKNOWN, surface[i] = 0;
    merge(f, tile, n, s->pixel, inverse_depth, surface);
    for (int i = 0; i < n; i++) {
        for (int p = 0; p < f->planes; p++) raster->colour[p * raster->plane + at[i]] = s->merged_colour[p][i];
        raster->cache[at[i]] = s->merged_cache[i];
    }
}

/* Of four pixels, one's; no history where one has none or what moves is mixed with what does not. */
static uint32_t coarse_cache(const uint32_t *upper, const uint32_t *lower)
{
    uint32_t differ = (upper[0] ^ upper[1]) | (upper[0] ^ lower[0]) | (upper[0] ^ lower[1]);
    bool none = upper[0] >= FV_CACHE_NONE || upper[1] >= FV_CACHE_NONE || lower[0] >= FV_CACHE_NONE || lower[1] >= FV_CACHE_NONE;
    return none || (differ & FV_CACHE_MOVING) ? FV_CACHE_NONE | (upper[0] & 0xffff) : upper[0];
}

/* Of a tile, into the raster of a higher density: what lies next to the tile of it that is dx to the right and dy
 * below; all of it where both are 0. */
static void border(struct fv_frame *f, const struct fv_tile *tile, int density, int dx, int dy)
{
    const struct fv_raster *own = fv_tile_raster(f, tile), *denser = &f->raster[density][tile->eye];
    int side = FV_TILE >> density, shift = tile->density - density, x0 = tile->x0 >> density, y0 = tile->y0 >> density;
    int left = dx > 0 ? side - REACH : 0, right = dx < 0 ? REACH : side;
    int top = dy > 0 ? side - REACH : 0, bottom = dy < 0 ? REACH : side;
    for (int p = 0; p < f->planes; p++) {
        uint32_t *to = denser->colour + p * denser->plane;
        const uint32_t *from = own->colour + p * own->plane;
        for (int y = y0 + top; y < y0 + bottom; y++)
            for (int x = x0 + left; x < x0 + right; x++)
                to[y * denser->stride + x] = from[(y >> shift) * own->stride + (x >> shift)] & FV_PIXEL_COLOUR;
    }
}

static void borders(struct fv_frame *f, const struct fv_tile *tile)
{
    int column = tile->x0 / FV_TILE, row = tile->y0 / FV_TILE;
    for (int dy = -1; dy <= 1; dy++)
        for (int dx = -1; dx <= 1; dx++) {
            bool there = column + dx >= 0 && column + dx < f->tiles_x && row + dy >= 0 && row + dy < f->tiles_y;
            int of = there ? f->state[tile->index + dy * f->tiles_x + dx].density : tile->density;
            for (int d = of; d < tile->density; d++) border(f, tile, d, dx, dy);
        }
}

/* Rows of albedo and light at half the density; what the light is worth is one pixel's. */
static void halve_apart(struct fv_frame *f, const struct fv_raster *dense, int64_t from, const struct fv_raster *coarse,
                        int64_t to, int n)
{
    for (int p = FV_PLANE_ALBEDO; p < FV_PLANES; p++) {
        const uint32_t *row = dense->colour + p * dense->plane + from;
        uint32_t *out = coarse->colour + p * coarse->plane + to;
        f->kernels->halve(row, row + dense->stride, out, n);
        for (int x = 0; x < n; x++) out[x] = (out[x] & FV_PIXEL_COLOUR) | (row[2 * x] & ~FV_PIXEL_COLOUR);
    }
}

/* A tile from one raster into the next coarser one. */
static void halve(struct fv_frame *f, const struct fv_tile *tile, int density)
{
    const struct fv_raster *dense = &f->raster[density][tile->eye], *coarse = &f->raster[density + 1][tile->eye];
    int half = FV_TILE >> (density + 1), x0 = tile->x0 >> (density + 1), y0 = tile->y0 >> (density + 1);
    for (int y = 0; y < half; y++) {
        int64_t to = (int64_t)(y0 + y) * coarse->stride + x0, from = (int64_t)(y0 + y) * 2 * dense->stride + 2 * x0;
        f->kernels->halve(dense->colour + from, dense->colour + from + dense->stride, coarse->colour + to, half);
        if (fv_light_apart(f)) halve_apart(f, dense, from, coarse, to, half);
        if (!dense->cache) continue;
        const uint32_t *cache = dense->cache + from;
        if (f->tracer->instances > 0)
            for (int x = 0; x < half; x++) coarse->cache[to + x] = coarse_cache(cache + 2 * x, cache + dense->stride + 2 * x);
        else
            for (int x = 0; x < half; x++) coarse->cache[to + x] = cache[2 * x];
    }
}

void fv_merge_coarse(struct fv_frame *f, const struct fv_tile *tile)
{
    if (!f->raster[FV_COARSEST][tile->eye].colour) return;
    borders(f, tile);
    fv_merge_halve(f, tile, tile->density);
}

void fv_merge_double(struct fv_frame *f, const struct fv_tile *tile)
{
    for (int d = tile->density - 1; d >= FV_COARSE; d--) border(f, tile, d, 0, 0);
}

void fv_merge_halve(struct fv_frame *f, const struct fv_tile *tile, int density)
{
    for (int d = density; d + 1 < FV_DENSITIES; d++) halve(f, tile, d);
}
