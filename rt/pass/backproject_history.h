/* backproject_history: where a frame before showed what pixels show now, by each pixel's own depth and the motion of what
 * it shows. For kernels only. */
#ifndef FV_PASS_BACKPROJECT_HISTORY_H
#define FV_PASS_BACKPROJECT_HISTORY_H

#include "rt/pass/backproject.h"
#include "rt/pass/reproject_history.h"
#include "rt/pass/selective.h"

/* A vector of pixels. */
struct pixels {
    vf x, y, w;
    vf nearest, farthest; /* inverse depths of them and those around them */
    vi moving, object;    /* FV_CACHE_MOVING or 0, and which object it is */
    vi mixed;             /* mask: something of the other kind is next to it */
};

/* Places in an earlier frame; outside it is none. */
struct where {
    vi inside;
    vf x, y, nearest, farthest;
};

/* Coefficient k of the map of each pixel's object. */
static inline vf coefficient(const struct fv_map *map, vi object, int k)
{
    _Static_assert(sizeof(struct fv_map) == 12 * sizeof(float), "maps are gathered from");
    return vf_gather((const float *)map, object * 12 + k);
}

static inline struct where project(const struct fv_backproject *b, const struct pixels *p, bool moves)
{
    const struct fv_map *map = b->map;
    vf to[3];
    for (int i = 0; i < 3; i++) {
        const float *m = map->m[i];
        if (moves)
            to[i] = coefficient(map, p->object, 3 * i) * p->x + coefficient(map, p->object, 3 * i + 1) * p->y +
                    coefficient(map, p->object, 3 * i + 2) + coefficient(map, p->object, 9 + i) * p->w;
        else to[i] = m[0] * p->x + (m[1] * p->y + m[2]) + map->t[i] * p->w;
    }
    vf inverse = vf_reciprocal(vf_max(to[2], vf_of(1e-4f)));
    struct where at = {.x = vf_clamp(to[0] * inverse, -8, 16384), .y = vf_clamp(to[1] * inverse, -8, 16384)};
    at.inside = (to[2] > 1e-4f) & (at.x >= 0.0f) & (at.x < (float)b->width) & (at.y >= 0.0f) & (at.y < (float)b->height);
    at.nearest = vf_min(p->nearest, p->w + b->together) * inverse * (1 + b->epsilon);
    at.farthest = vf_max(p->farthest, p->w - b->together) * inverse * (1 - b->epsilon);
    return at;
}

/* Two pixels of a row side by side, and the two below them. */
static inline void take_four(const struct window *w, const uint32_t *from, const struct source *s, vi upper, vi lower, vi tap[4])
{
#if FV_WIDTH > 4
    if (w->holds) {
        for (int k = 0; k < 2; k++) {
            const uint32_t *row = from + k * s->stride, *below = row + s->stride;
            vi low = vi_load(row), high = vi_load(row + FV_WIDTH);
            tap[2 * k] = vi_pick(low, high, w->column), tap[2 * k + 1] = vi_pick(low, high, w->column + 1);
            if (!w->slanted) continue;
            low = vi_load(below), high = vi_load(below + FV_WIDTH);
            tap[2 * k] = vi_select(w->lower, vi_pick(low, high, w->column), tap[2 * k]);
            tap[2 * k + 1] = vi_select(w->lower, vi_pick(low, high, w->column + 1), tap[2 * k + 1]);
        }
        return;
    }
#else
    (void)w, (void)s;
#endif
    vi_gather_pairs(from, upper, &tap[0], &tap[1]);
    vi_gather_pairs(from, lower, &tap[2], &tap[3]);
}

/* Of the four pixels around each place the mean of those that show it, and how much of the place they are, in [0, 1]. */
static inline vf mean_around(const struct source *s, const struct where *at, vi moving, vf3 *colour)
{
    vf x = vf_clamp(at->x - 0.5f, 0, s->width - 1.0f), y = vf_clamp(at->y - 0.5f, 0, s->height - 1.0f);
    vf x0 = vf_floor(x), y0 = vf_floor(y), fx = x - x0, fy = y - y0, found = vf_of(0);
    vi ix = vi_from(x0), iy = vi_from(y0), pixel[4], cache[4];
    vi upper = iy * s->stride + ix, lower = upper + ((iy < s->last_row) & s->stride);
    struct window w = window_of(s, s->colour, ix, iy, 2, vi_of(-1));
    const uint32_t *colours = w.holds ? w.from : s->colour, *caches = s->cache + (colours - s->colour);
    take_four(&w, colours, s, upper, lower, pixel);
    take_four(&w, caches, s, upper, lower, cache);
    vf3 sum = {vf_of(0), vf_of(0), vf_of(0)};
    for (int k = 0; k < 4; k++) {
        vf weight = (k & 1 ? fx : 1.0f - fx) * (k & 2 ? fy : 1.0f - fy), depth = cache_depth(cache[k]);
        vi sampled = (((cache[k] ^ moving) & (FV_CACHE_MOVING | FV_CACHE_OLDEST)) == 0) & (cache_rho(cache[k]) > 0);
        vi same = (depth <= at->nearest) & (depth >= at->farthest);
        weight = vf_select(same & sampled, weight, vf_of(0));
        sum = vf3_add(sum, vf3_scale(channels(pixel[k]), weight));
        found += weight;
    }
    found = vf_select(at->inside, found, vf_of(0));
    *colour = vf3_scale(lower_channels(sum), vf_reciprocal(vf_max(found, vf_of(1e-6f))));
    return found;
}

/* Of the row of caches, from the row's i-th on, those dx to the right; where rows end, the one at their border. */
static inline vi beside(const struct fv_row *r, const uint32_t *row, int i, int dx)
{
    int x = r->x + i;
    if (x > 0 && x + FV_WIDTH < r->width) return vi_load(row + i + dx);
    vi column = vi_lanes() + (x + dx);
    column = vi_select(column > 0, column, vi_of(0));
    return vi_gather(row + i, vi_select(column < r->width, column, vi_of(r->width - 1)) - x);
}

/* Of the pixels around each: their depths, and whether they move. */
static inline void take_bounds(const struct fv_row *r, int i, struct pixels *p)
{
    const uint32_t *above = r->cache - (r->y > 0 ? r->stride : 0), *below = r->cache + (r->y + 1 < r->height ? r->stride : 0);
    const uint32_t *const row[3] = {above, r->cache, below};
    vi differ = vi_of(0);
    p->nearest = p->farthest = p->w;
    for (int y = 0; y < 3; y++)
        for (int dx = -1; dx <= 1; dx++) {
            vi cache = beside(r, row[y], i, dx);
            vf w = cache_depth(cache); /* no number where there is none: the other one stays */
            p->nearest = vf_max(w, p->nearest);
            p->farthest = vf_min(w, p->farthest);
            differ |= cache ^ p->moving;
        }
    p->mixed = (differ & FV_CACHE_MOVING) != 0;
}

/* The row's pixels from the i-th on. Returns the mask of those whose depth and motion are known; `moves`: some move. */
static inline vi take_pixels(const struct fv_row *r, int i, struct pixels *p, bool *moves)
{
    vi cache = vi_load(r->cache + i), known = ~cache_none(cache);
    *p = (struct pixels){.x = vf_from(vi_lanes() + (r->x + i)) + 0.5f, .y = vf_of((float)r->y + 0.5f),
                         .w = cache_depth(cache), .moving = cache & FV_CACHE_MOVING, .object = vi_of(0)};
    take_bounds(r, i, p);
    *moves = r->identity && vi_any(p->moving != 0);
    if (!*moves) return known;
    vi identity = vi_load(r->identity + i), now = (vi)((vu)identity >> FV_IDENTITY_STAMP_SHIFT) == r->stamp;
    p->object = now & (p->moving != 0) & ((identity >> 16) & FV_SURFACE_OBJECT);
    return known & ((p->moving == 0) | (p->object != 0));
}

static inline struct source source_before(const struct fv_backproject *b, const uint32_t *colour)
{
    return (struct source){.colour = colour, .cache = b->cache, .width = (float)b->width, .height = (float)b->height,
                           .stride = b->stride, .last_row = b->height - 1};
}

#endif
