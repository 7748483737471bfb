/* post_filter: light that was sampled once is noisy; where light near it has been sampled more often, that is mixed
 * in (Weier et al. 2016, section 3.5): the nearest such pixels of the same depth to the left, to the right, above
 * and below span a window, in which the nearest of a few random candidates is chosen. Within the tile: others are
 * being written. See merge.h. */
#include "rt/pass/cache.h"
#include "rt/pass/merge.h"

#include <math.h>

enum {
    REACH = 8,     /* of the window, pixels */
    WORTH_MOST = 4 /* samples that the chosen light counts for at most */
};

struct window {
    const struct fv_raster *raster;
    int64_t first; /* element of the tile's first pixel */
    int width, height; /* what of the tile lies in the picture */
    float epsilon;
    uint32_t own;               /* cache of the pixel that is looked at */
    uint32_t sampled[FV_TILE];  /* by row, a bit for each pixel whose light is worth more than one sample */
};

static inline int64_t at(const struct window *w, int x, int y)
{
    return w->first + y * w->raster->stride + x;
}

/* Samples that a pixel's light is worth. */
static inline uint32_t worth(const struct window *w, int64_t i)
{
    const uint32_t *albedo = w->raster->colour + FV_PLANE_ALBEDO * w->raster->plane;
    const uint32_t *light = w->raster->colour + FV_PLANE_LIGHT * w->raster->plane;
    return (albedo[i] >> 30 | (light[i] >> 30) << 2) + 1;
}

/* Returns whether there are any. */
static bool find_sampled(struct window *w)
{
    uint32_t any = 0;
    for (int y = 0; y < w->height; y++) {
        w->sampled[y] = 0;
        for (int x = 0; x < w->width; x++) w->sampled[y] |= (uint32_t)(worth(w, at(w, x, y)) > 1) << x;
        any |= w->sampled[y];
    }
    return any != 0;
}

/* Whether the pixel's light has been sampled more than once, on the same surface by depth and motion. */
static inline bool better(const struct window *w, int x, int y)
{
    if (x < 0 || y < 0 || x >= w->width || y >= w->height || !(w->sampled[y] >> x & 1)) return false;
    uint32_t cache = w->raster->cache[at(w, x, y)];
    float own = cache_depth_of(w->own), other = cache_depth_of(cache);
    return fabsf(other - own) <= w->epsilon * fmaxf(other, own) && ((cache ^ w->own) & FV_CACHE_MOVING) == 0;
}

/* Steps from (x, y) to the nearest better pixel that way; 0: none within reach. */
static inline int steps(const struct window *w, int x, int y, int dx, int dy)
{
    for (int n = 1; n <= REACH; n++)
        if (better(w, x + n * dx, y + n * dy)) return n;
    return 0;
}

static inline uint32_t hash(uint32_t n)
{
    n = (n ^ n >> 16) * 0x7feb352du;
    n = (n ^ n >> 15) * 0x846ca68bu;
    return n ^ n >> 16;
}

/* The element whose light is taken; -1: none. */
static int64_t choose(const struct window *w, int x, int y, int candidates, uint32_t seed)
{
    int left = steps(w, x, y, -1, 0), right = steps(w, x, y, 1, 0);
    int up = steps(w, x, y, 0, -1), down = steps(w, x, y, 0, 1);
    int columns = left + right + 1, rows = up + down + 1, nearest = 2 * REACH * REACH + 1;
    int64_t chosen = -1;
    for (int n = 0; n < candidates && columns * rows > 1; n++) {
        uint32_t r = hash(seed + (uint32_t)n * 0x9e3779b9u);
        int dx = (int)((r & 0xffff) * (uint32_t)columns >> 16) - left;
        int dy = (int)((r >> 16) * (uint32_t)rows >> 16) - up;
        if (dx * dx + dy * dy >= nearest || !better(w, x + dx, y + dy)) continue;
        nearest = dx * dx + dy * dy;
        chosen = at(w, x + dx, y + dy);
    }
    return chosen;
}

/* Codes of light, `weight` parts of the other to one of its own. */
static uint32_t mixed(uint32_t own, uint32_t other, uint32_t weight)
{
    uint32_t out = own & ~FV_PIXEL_COLOUR;
    for (int shift = 0; shift < 30; shift += 10) {
        uint32_t a = own >> shift & 1023, b = other >> shift & 1023;
        out |= (a + b * weight + (weight + 1) / 2) / (weight + 1) << shift;
    }
    return out;
}

void fv_merge_filter(struct fv_frame *f, const struct fv_tile *tile, uint64_t blocks)
{
    const struct fv_raster *raster = fv_tile_raster(f, tile);
    int side = fv_tile_side(tile), right = raster->width - (tile->x0 >> tile->density);
    int below = raster->height - (tile->y0 >> tile->density);
    struct window w = {.raster = raster,
                       .first = fv_tile_row(f, tile, 0),
                       .width = right < side ? right : side,
                       .height = below < side ? below : side,
                       .epsilon = f->epsilon_depth};
    uint32_t *light = raster->colour + FV_PLANE_LIGHT * raster->plane;
    uint32_t seed = hash((uint32_t)f->number * 0x85ebca6bu + (uint32_t)tile->index);
    if (f->post_filter == 0 || !find_sampled(&w)) return;
    for (; blocks; blocks &= blocks - 1) {
        int block = __builtin_ctzll(blocks);
        for (int k = 0; k < FV_BLOCK * FV_BLOCK; k++) {
            int x = block % FV_BLOCKS * FV_BLOCK + k % FV_BLOCK, y = block / FV_BLOCKS * FV_BLOCK + k / FV_BLOCK;
            if (x >= w.width || y >= w.height) continue;
            int64_t i = at(&w, x, y);
            w.own = raster->cache[i];
            if (w.sampled[y] >> x & 1 || !(cache_depth_of(w.own) > 0)) continue;
            int64_t from = choose(&w, x, y, f->post_filter, seed + (uint32_t)(y * FV_TILE + x) * 977u);
            if (from < 0) continue;
            uint32_t weight = worth(&w, from);
            light[i] = mixed(light[i], light[from], weight < WORTH_MOST ? weight : WORTH_MOST);
        }
    }
}
