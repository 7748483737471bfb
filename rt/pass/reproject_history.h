/* reproject_history: what the history holds at a place, and its colour there, interpolated: linearly, by cubics,
 * over a footprint, and along the outlines of what moves. For kernels only. */
#ifndef FV_PASS_REPROJECT_HISTORY_H
#define FV_PASS_REPROJECT_HISTORY_H

#include "rt/pass/cache.h"
#include "rt/pass/reproject.h"
#include "rt/trace/pixel.h"

/* Where pixels are looked up. */
struct source {
    const struct fv_map *map;
    const uint32_t *colour, *cache;
    float width, height, scale; /* scale: its pixels a pixel of the raster */
    int32_t stride, last_row;
    int32_t moving;             /* FV_CACHE_MOVING or 0: of the pixels that count */
    float epsilon;              /* relative depth difference that still is the same surface */
    bool still;                 /* nothing moves: what is known holds */
};

/* Where a guess leads. */
struct place {
    vi good;      /* mask: the history there has the depth that the guess predicts */
    vf w;         /* the guess */
    vf x, y;      /* in the history */
    vf history_w; /* what the history holds there */
    vi index;     /* of the pixel there */
    vi cache;
};

/* Of what stands still. */
static inline struct source source_of(const struct fv_raster *r, const struct fv_map *map, float scale, float epsilon,
                                      bool still)
{
    return (struct source){.map = map,
                           .colour = r->history_colour,
                           .cache = r->history_cache,
                           .width = (float)r->width,
                           .height = (float)r->height,
                           .scale = scale,
                           .stride = (int32_t)r->stride,
                           .last_row = r->height - 1,
                           .epsilon = epsilon,
                           .still = still};
}

/* A pixel's channels where they stand in it, green 2^10 times its code and blue 2^20: shifting sums of them down
 * afterwards, exactly, is cheaper than shifting each. */
static inline vf3 channels(vi pixel)
{
    return (vf3){vf_from(pixel & 1023), vf_from(pixel & 1023 << 10), vf_from(pixel & 1023 << 20)};
}

static inline vf3 lower_channels(vf3 sum)
{
    return (vf3){sum.x, sum.y * 0x1p-10f, sum.z * 0x1p-20f};
}

/* The history's colour at a place: bilinear over the four pixels around it, across edges too. Taking only
 * those that show the same surface keeps edges hard, but where the motion is a fraction of a pixel a hard
 * edge does not move at all, frame after frame (measured: 2 dB worse beyond the fovea). */
static inline vf3 bilinear(const struct source *s, vf px, vf py)
{
    vf x = vf_clamp(px - 0.5f, 0, s->width - 1.0f), y = vf_clamp(py - 0.5f, 0, s->height - 1.0f);
    vf x0 = vf_floor(x), y0 = vf_floor(y), fx = x - x0, fy = y - y0;
    vi iy = vi_from(y0), upper = iy * s->stride + vi_from(x0);
    vi lower = upper + ((iy < s->last_row) & s->stride);
    vi a, b, c, d;
    /* The right-hand pixel of the last column is padding, with weight 0. */
    vi_gather_pairs(s->colour, upper, &a, &b);
    vi_gather_pairs(s->colour, lower, &c, &d);
    vf w11 = fx * fy, w10 = fx - w11, w01 = fy - w11, w00 = 1.0f - fx - w01;
    vf3 sum = vf3_add(vf3_scale(channels(a), w00), vf3_scale(channels(b), w10));
    return lower_channels(vf3_add(sum, vf3_add(vf3_scale(channels(c), w01), vf3_scale(channels(d), w11))));
}

/* The weights of four pixels in a row of which the second and third lie round the place, f from the second:
 * Catmull-Rom, which keeps what bilinear interpolation blurs a little more each frame. */
static inline void cubic_weights(vf f, vf w[4])
{
    w[0] = f * (-0.5f + f * (1.0f - 0.5f * f));
    w[1] = 1.0f + f * f * (-2.5f + 1.5f * f);
    w[2] = f * (0.5f + f * (2.0f - 1.5f * f));
    w[3] = f * f * (-0.5f + 0.5f * f);
}

/* Neighbouring pixels mostly come from neighbouring ones: then all that a vector of them needs of the history
 * stands in two vectors of each of four rows, or of five, and is picked from there. */
struct window {
    bool holds, slanted;  /* slanted: lanes of `lower` need the rows one further down */
    const uint32_t *from; /* the first row's first pixel */
    vi column, lower;
};

/* Of `taps` pixels in a row and in a column, from (ix, iy), in the lanes of mask; `pixels`: s->colour or cache. */
static inline struct window window_of(const struct source *s, const uint32_t *pixels, vi ix, vi iy, int taps, vi mask)
{
    struct window w = {.holds = false};
#if FV_WIDTH > 4
    int left = ix[0], first = iy[0], last = iy[FV_WIDTH - 1], top = first < last ? first : last;
    vi column = ix - left, row = iy - top;
    vi within = (column >= 0) & (column <= 2 * FV_WIDTH - taps) & (row >= 0) & (row <= 1);
    w.holds = left >= 0 && left + 2 * FV_WIDTH <= s->stride && top >= 0 && top + taps <= s->last_row && !vi_any(mask & ~within);
    w.lower = mask & (row > 0);
    w.slanted = vi_any(w.lower);
    w.from = pixels + (int64_t)top * s->stride + left;
    w.column = column;
#else
    (void)s, (void)pixels, (void)ix, (void)iy, (void)taps, (void)mask;
#endif
    return w;
}

/* The pixels of the cache at (ix, iy), in the lanes of mask; anything elsewhere. */
static inline vi cache_at(const struct source *s, vi ix, vi iy, vi index, vi mask)
{
#if FV_WIDTH > 4
    struct window w = window_of(s, s->cache, ix, iy, 1, mask);
    if (w.holds) {
        vi upper = vi_pick(vi_load(w.from), vi_load(w.from + FV_WIDTH), w.column);
        if (!w.slanted) return upper;
        const uint32_t *below = w.from + s->stride;
        return vi_select(w.lower, vi_pick(vi_load(below), vi_load(below + FV_WIDTH), w.column), upper);
    }
#else
    (void)ix, (void)iy, (void)mask;
#endif
    return vi_gather(s->cache, index);
}

/* What a guess finds: `along` is what the map makes of a pixel at infinity, w its inverse depth. */
static inline struct place look_up(const struct source *s, vf3 along, vf w)
{
    const float *m = s->map->t;
    struct place p = {.w = w};
    vf depth = along.z + m[2] * w;
    vi ahead = depth > 1e-4f;
    vf inverse = vf_reciprocal(vf_max(depth, vf_of(1e-4f))), scale = inverse * s->scale;
    p.x = vf_clamp((along.x + m[0] * w) * scale, -8, 16384);
    p.y = vf_clamp((along.y + m[1] * w) * scale, -8, 16384);
    vi inside = ahead & (p.x >= 0.0f) & (p.x < s->width) & (p.y >= 0.0f) & (p.y < s->height);
    vi ix = vi_from(p.x), iy = vi_from(p.y);
    p.index = (iy * s->stride + ix) & inside;
    p.cache = vi_select(inside, cache_at(s, ix, iy, p.index, inside), vi_of((int32_t)FV_CACHE_NONE));
    p.history_w = cache_depth(p.cache);
    vf expected = w * inverse;
    vf nearer = vf_min(vf_max(p.history_w, expected), vf_of(FV_INVERSE_DEPTH_MAX));
    /* Nor where there is none: nothing holds of what is no number. */
    p.good = inside & (vf_abs(p.history_w - expected) <= s->epsilon * nearer) &
             ((p.cache & FV_CACHE_MOVING) == s->moving);
    p.good |= inside & (vi_of(-(int32_t)s->still) & (p.history_w >= 0.0f));
    return p;
}

/* In this view, the inverse depth of what the history shows at a place. */
static inline vf history_surface(const struct source *s, vf3 along, const struct place *p)
{
    vf scale = vf_max(1.0f - s->map->t[2] * p->history_w, vf_of(1e-3f));
    return vf_clamp(p->history_w * along.z / scale, 0, FV_INVERSE_DEPTH_MAX);
}

/* Takes the guess where it holds and is nearer than what is there, or nothing good is. */
static inline void prefer(struct place *best, const struct place *p)
{
    vi better = p->good & (~best->good | (p->w > best->w));
    best->w = vf_select(better, p->w, best->w);
    best->x = vf_select(better, p->x, best->x);
    best->y = vf_select(better, p->y, best->y);
    best->history_w = vf_select(better, p->history_w, best->history_w);
    best->index = vi_select(better, p->index, best->index);
    best->cache = vi_select(better, p->cache, best->cache);
    best->good |= p->good;
}

static inline void pick_row(const struct window *w, const uint32_t *row, vi tap[4])
{
#if FV_WIDTH > 4
    vi low = vi_load(row), high = vi_load(row + FV_WIDTH);
    for (int i = 0; i < 4; i++) tap[i] = vi_pick(low, high, w->column + i);
#else
    (void)w, (void)row, (void)tap;
#endif
}

static inline void gather_row(const struct source *s, vi ix, vi row, vi tap[4])
{
    vi left = ix - ((ix > 0) & 1), right = ix + ((ix < (int32_t)s->width - 2) & 1); /* of pairs */
    row = vi_select(row > 0, row, vi_of(0));
    row = vi_select(row < s->last_row, row, vi_of(s->last_row)) * s->stride;
    vi_gather_pairs(s->colour, row + left, &tap[0], &tap[1]);
    vi_gather_pairs(s->colour, row + right, &tap[2], &tap[3]);
}

static FV_INLINE vf3 cubic(const struct source *s, vf px, vf py)
{
    vf x = vf_clamp(px - 0.5f, 0, s->width - 1.0f), y = vf_clamp(py - 0.5f, 0, s->height - 1.0f);
    vf x0 = vf_floor(x), y0 = vf_floor(y), wx[4], wy[4];
    vi ix = vi_from(x0), iy = vi_from(y0), tap[4], below[4];
    vi first = ix > 0, last = ix < (int32_t)s->width - 2;
    vf3 sum = {vf_of(0), vf_of(0), vf_of(0)};
    struct window window = window_of(s, s->colour, ix - 1, iy - 1, 4, vi_of(-1));
    window.holds &= !vi_any(~last);
    cubic_weights(x - x0, wx);
    cubic_weights(y - y0, wy);
    /* At the left and right borders a pair begins or ends a pixel later or sooner: the border's pixel is both. */
    wx[0] = vf_select(first, wx[0], wx[0] + wx[1]), wx[1] = vf_select(first, wx[1], vf_of(0));
    wx[3] = vf_select(last, wx[3], wx[2] + wx[3]), wx[2] = vf_select(last, wx[2], vf_of(0));
    for (int k = 0; k < 4; k++) {
        if (window.holds) {
            pick_row(&window, window.from + k * s->stride, tap);
            if (window.slanted) pick_row(&window, window.from + (k + 1) * s->stride, below);
            for (int i = 0; i < 4 && window.slanted; i++) tap[i] = vi_select(window.lower, below[i], tap[i]);
        } else {
            gather_row(s, ix, iy + (k - 1), tap);
        }
        vf3 line = vf3_add(vf3_add(vf3_scale(channels(tap[0]), wx[0]), vf3_scale(channels(tap[1]), wx[1])),
                           vf3_add(vf3_scale(channels(tap[2]), wx[2]), vf3_scale(channels(tap[3]), wx[3])));
        sum = vf3_add(sum, vf3_scale(line, wy[k]));
    }
    sum = lower_channels(sum);
    return (vf3){vf_clamp(sum.x, 0, 1023), vf_clamp(sum.y, 0, 1023), vf_clamp(sum.z, 0, 1023)};
}

/* Lanes whose place is less than some `reach` pixels from where the history goes over from what moves to what
 * does not. */
static inline vi at_outline(const struct source *s, const struct place *p, float reach)
{
    vf left = vf_clamp(p->x - reach, 0, s->width - 1.0f), right = vf_clamp(p->x + reach, 0, s->width - 1.0f);
    vf above = vf_clamp(p->y - reach, 0, s->height - 1.0f), below = vf_clamp(p->y + reach, 0, s->height - 1.0f);
    vi upper = vi_from(above) * s->stride, lower = vi_from(below) * s->stride, differ = vi_of(0);
    differ |= vi_gather(s->cache, upper + vi_from(left)) ^ p->cache;
    differ |= vi_gather(s->cache, upper + vi_from(right)) ^ p->cache;
    differ |= vi_gather(s->cache, lower + vi_from(left)) ^ p->cache;
    differ |= vi_gather(s->cache, lower + vi_from(right)) ^ p->cache;
    return p->good & ((differ & FV_CACHE_MOVING) != 0);
}

/* Bilinear over those of the four pixels that are of the place's own kind, as the one that it lies in is. */
static inline vf3 bilinear_own(const struct source *s, const struct place *p, vi moving)
{
    vf x = vf_clamp(p->x - 0.5f, 0, s->width - 1.0f), y = vf_clamp(p->y - 0.5f, 0, s->height - 1.0f);
    vf x0 = vf_floor(x), y0 = vf_floor(y), fx = x - x0, fy = y - y0, sum = vf_of(1e-6f);
    vi ix = vi_from(x0), iy = vi_from(y0);
    vf3 out = {vf_of(0), vf_of(0), vf_of(0)};
    for (int k = 0; k < 4; k++) {
        vi at = (iy + (k & 2 ? (iy < s->last_row) & 1 : vi_of(0))) * s->stride + ix +
                (k & 1 ? (ix < (int32_t)s->width - 1) & 1 : vi_of(0));
        vf weight = (k & 1 ? fx : 1.0f - fx) * (k & 2 ? fy : 1.0f - fy);
        weight = vf_select((vi_gather(s->cache, at) & FV_CACHE_MOVING) == moving, weight, vf_of(0));
        out = vf3_add(out, vf3_scale(pixel_unpack(vi_gather(s->colour, at)), weight));
        sum += weight;
    }
    return vf3_scale(out, 1.0f / sum);
}

/* A footprint of more than a pixel is covered by four taps, a quarter of it from its middle. */
static FV_INLINE vf3 smooth_colour(const struct fv_reproject_tile *t, const struct source *s, const struct place *p)
{
    if (!(t->footprint * s->scale > 1.25f)) return t->sharp ? cubic(s, p->x, p->y) : bilinear(s, p->x, p->y);
    vf3 sum = {vf_of(0), vf_of(0), vf_of(0)};
    float step = 0.25f * t->footprint * s->scale;
    for (int i = 0; i < 4; i++)
        sum = vf3_add(sum, bilinear(s, p->x + (i & 1 ? step : -step), p->y + (i & 2 ? step : -step)));
    return vf3_scale(sum, vf_of(0.25f));
}

/* Of a place that is good. Along outlines colours must not mix, or each frame's would stay behind on what it
 * uncovers. */
static FV_INLINE vf3 history_colour(const struct fv_reproject_tile *t, const struct source *s, const struct place *p)
{
    vf3 colour = smooth_colour(t, s, p);
    if (!t->moves) return colour;
    vi outline = at_outline(s, p, 2);
    return vi_any(outline) ? vf3_select(outline, bilinear_own(s, p, p->cache & FV_CACHE_MOVING), colour) : colour;
}

#endif
