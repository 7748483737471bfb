/* accumulate_kernel: a tile's light mixed with the last frame's; see accumulate.h.
 *
 * First history is fetched for all of the tile, and what light differs from it by is summed by blocks; then 5 x 5 pixels' sums
 * of light are made by rows; at last pixels are mixed. */
#include "rt/pass/accumulate.h"
#include "rt/pass/atrous_light.h"
#include "rt/pass/backproject_history.h"

#define accumulate FV_ISA_NAME(fv_accumulate)

void accumulate(struct fv_accumulate *a);

enum { SIDE = FV_TILE, REACH = 2, ROWS = SIDE + 2 * REACH, PADDED = 48 };
enum { COUNT, SUM, SQUARE, SUMS };

/* Of the place so much must be known; standard deviations of a window's mean, and of a block's; pixels that make one. */
#define LEAST_FOUND (1 / 16.0f)
#define WINDOW_SIGMAS 3.0f
#define BLOCK_SIGMAS 6.0f
#define WINDOW_LEAST 8

/* Where a window leaves so few frames, light has changed. */
#define SURELY 8.0f

/* Squared distance of unit normals 20 degrees apart, in units of 1 / 511; the least cosine (times 511) that tells a plane. */
#define NORMALS_APART (0.12f * 511 * 511)
#define LEAST_COSINE 8.0f

/* Relative standard deviation that light's format alone makes. */
#define ROUNDING (1 / 256.0f)

#define NEVER 1e9f

struct tile {
    _Alignas(64) float history[3][SIDE * SIDE], frames[SIDE * SIDE];
    _Alignas(64) float differ[SUMS][FV_BLOCKS][SIDE]; /* of the columns of a row of blocks */
    _Alignas(64) float around[SUMS][ROWS][SIDE];      /* of 5 pixels of a row */
    _Alignas(64) float most[FV_BLOCKS][SIDE];         /* frames that count, by windows */
    bool doubt[FV_BLOCKS];                            /* of a row of blocks: in some light has changed */
    bool any;                                         /* there is history */
};

static inline vf luma(vf3 light)
{
    return 0.25f * (light.x + light.z) + 0.5f * light.y;
}

static inline vf normal_component(vi facing, int shift)
{
    return vf_from((facing >> shift) & 1023) - 511.0f;
}

static inline vf3 normal_of(vi facing)
{
    return (vf3){normal_component(facing, 0), normal_component(facing, 10), normal_component(facing, 20)};
}

static inline vf track_depth(vi track)
{
    return (vf)(vi)(((vu)track & ~0x1fffu) >> 1);
}

/* Of inverse depths above 0; rounded to nearest. */
static inline vi track_of(vf w, vi object, vi frames)
{
    return (vi)(((((vu)(vi)w << 1) + 0x1000u) & ~0x1fffu) | (vu)(object << FV_TRACK_OBJECT_SHIFT) | (vu)frames);
}

static inline vi object_of(const struct fv_accumulate *a, int64_t at)
{
    return a->moves ? (vi_load(a->track + at) >> 16) & FV_SURFACE_OBJECT : vi_of(0);
}

/* ---- history ---- */

/* By how much inverse depth grows with each pixel to the right and down, of the surface through the place, relative to its own. */
static inline void slope(const struct fv_view *v, const struct where *at, vf3 n, vf *across, vf *down)
{
    vf3 dx = vf3_of(v->dx), dy = vf3_of(v->dy);
    vf3 ray = vf3_add(vf3_of(v->corner), vf3_add(vf3_scale(dx, at->x), vf3_scale(dy, at->y)));
    vf cosine = vf_dot(n, ray), unit = vf_reciprocal(vf_clamp(vf_abs(cosine), LEAST_COSINE, 1e6f));
    unit = vf_select(cosine < 0.0f, -unit, unit);
    *across = vf_clamp(vf_dot(n, dx) * unit, -0.5f, 0.5f);
    *down = vf_clamp(vf_dot(n, dy) * unit, -0.5f, 0.5f);
}

/* Mean light of those of the four pixels around each place that show it, and the frames that it is of, 0: none. */
static inline vf3 history_at(const struct fv_accumulate *a, const struct where *at, vi object, vi facing, vi mask, vf *frames)
{
    const struct source s = {.stride = (int32_t)a->stride, .last_row = a->height - 1};
    vf x = vf_clamp(at->x - 0.5f, 0, (float)a->width - 1.0f), y = vf_clamp(at->y - 0.5f, 0, (float)a->height - 1.0f);
    vf x0 = vf_floor(x), y0 = vf_floor(y), fx = x - x0, fy = y - y0, found = vf_of(0), across, down, sum_frames = vf_of(0);
    vi ix = vi_from(x0), iy = vi_from(y0), light[4], track[4], normal[4];
    vi upper = iy * s.stride + ix, lower = upper + ((iy < s.last_row) & s.stride);
    vf3 n = normal_of(facing), sum = {vf_of(0), vf_of(0), vf_of(0)};
    struct window w = window_of(&s, a->mean_before, ix, iy, 2, mask);
    int64_t from = w.holds ? w.from - a->mean_before : 0;
    take_four(&w, a->mean_before + from, &s, upper, lower, light);
    take_four(&w, a->track_before + from, &s, upper, lower, track);
    take_four(&w, a->facing_before + from, &s, upper, lower, normal);
    slope(a->before, at, n, &across, &down);
    for (int k = 0; k < 4; k++) {
        vf weight = (k & 1 ? fx : 1.0f - fx) * (k & 2 ? fy : 1.0f - fy), w_tap = track_depth(track[k]);
        vf plane = across * (x0 + (0.5f + (float)(k & 1)) - at->x) + down * (y0 + (0.5f + (float)(k >> 1)) - at->y);
        vf off = w_tap - at->nearest, off_plane = off - at->nearest * plane, limit = a->epsilon * at->nearest;
        vf3 turn = vf3_sub(normal_of(normal[k]), n);
        vi same = (vf_min(vf_abs(off), vf_abs(off_plane)) <= limit) & (vf_dot(turn, turn) <= NORMALS_APART);
        same &= ((track[k] & FV_TRACK_FRAMES) > 0) & (((track[k] >> FV_TRACK_OBJECT_SHIFT) & FV_SURFACE_OBJECT) == object) & ~light_is_none(light[k]);
        weight = vf_select(same & mask, weight, vf_of(0));
        sum = vf3_add(sum, vf3_scale(light_unpack(light[k]), weight));
        sum_frames += weight * vf_from(track[k] & FV_TRACK_FRAMES);
        found += weight;
    }
    vf unit = vf_reciprocal(vf_max(found, vf_of(1e-6f)));
    *frames = vf_select(found >= LEAST_FOUND, sum_frames * unit, vf_of(0));
    return vf3_scale(sum, unit);
}

/* Into the tile: of the pixels from (x, y) of it on. */
static inline void fetch(const struct fv_accumulate *a, struct tile *t, int x, int y)
{
    int64_t at = (int64_t)(a->y + y) * a->stride + a->x + x;
    vi word = vi_load(a->light + at), inside = vi_lanes() + x < a->columns;
    vf w = (vf)vi_load(a->inverse_depth + at), frames;
    vi seen = inside & (w > 0.0f), object = object_of(a, at);
    struct pixels p = {.x = vf_from(vi_lanes() + (a->x + x)) + 0.5f, .y = vf_of((float)(a->y + y) + 0.5f), .object = object};
    const struct fv_backproject b = {.width = a->width, .height = a->height, .map = a->map};
    p.w = p.nearest = p.farthest = vf_select(seen, vf_min(w, vf_of(1e6f)), vf_of(1));
    struct where place = project(&b, &p, a->moves && vi_any(object != 0)); /* nearest: its inverse depth there */
    seen &= place.inside;
    vf3 mean = {vf_of(0), vf_of(0), vf_of(0)};
    frames = vf_of(0);
    if (vi_any(seen)) mean = history_at(a, &place, object, vi_load(a->facing + at), seen, &frames);
    int i = y * SIDE + x;
    vf_store(t->history[0] + i, mean.x);
    vf_store(t->history[1] + i, mean.y);
    vf_store(t->history[2] + i, mean.z);
    vf_store(t->frames + i, frames);
    vi both = (frames > 0.0f) & ~light_is_none(word);
    vf d = vf_select(both, luma(light_unpack(word)) - luma(mean), vf_of(0)), rounding = luma(mean) * ROUNDING;
    float *sums[SUMS];
    for (int k = 0; k < SUMS; k++) sums[k] = t->differ[k][y / FV_BLOCK] + x;
    vf_store(sums[COUNT], vf_load(sums[COUNT]) + vf_select(both, vf_of(1), vf_of(0)));
    vf_store(sums[SUM], vf_load(sums[SUM]) + d);
    vf_store(sums[SQUARE], vf_load(sums[SQUARE]) + vf_select(both, d * d + rounding * rounding, vf_of(0)));
    t->any |= vi_any(frames > 0.0f);
}

/* ---- what light says of history ---- */

/* Frames that count where history is off by d and pixels by s, squared, of so many of them. */
static float window_most(float d, float s2, float n, float sigmas)
{
    float excess = d * d - sigmas * sigmas * s2 / n;
    return excess > 0 && s2 < NEVER * excess ? s2 > 0 ? s2 / excess : 0 : NEVER;
}

/* Sums by blocks, and of all of them. */
static void sum_blocks(const struct tile *t, float of[SUMS][FV_BLOCKS][FV_BLOCKS], float all[SUMS])
{
    for (int k = 0; k < SUMS; k++) {
        all[k] = 0;
        for (int y = 0; y < FV_BLOCKS; y++)
            for (int x = 0; x < FV_BLOCKS; x++) {
                const float *c = t->differ[k][y] + FV_BLOCK * x;
                of[k][y][x] = (c[0] + c[1]) + (c[2] + c[3]);
                all[k] += of[k][y][x];
            }
    }
}

/* Frames that count in a block; `least`: of squared deviations. */
static float judge_window(const float of[SUMS][FV_BLOCKS][FV_BLOCKS], int x, int y, float least)
{
    float sum[SUMS] = {0}, own = of[COUNT][y][x];
    for (int v = y > 0 ? y - 1 : 0; v <= y + 1 && v < FV_BLOCKS; v++)
        for (int u = x > 0 ? x - 1 : 0; u <= x + 1 && u < FV_BLOCKS; u++)
            for (int k = 0; k < SUMS; k++) sum[k] += of[k][v][u];
    if (sum[COUNT] < WINDOW_LEAST) return NEVER;
    float d = sum[SUM] / sum[COUNT], s2 = sum[SQUARE] / sum[COUNT] - d * d;
    s2 = s2 > least ? s2 : least;
    float most = window_most(d, s2, sum[COUNT], WINDOW_SIGMAS);
    float by_block = own < WINDOW_LEAST ? NEVER : window_most(of[SUM][y][x] / own, s2, own, BLOCK_SIGMAS);
    return by_block < most ? by_block : most;
}

static void judge_windows(struct tile *t)
{
    float of[SUMS][FV_BLOCKS][FV_BLOCKS], all[SUMS];
    sum_blocks(t, of, all);
    float unit = 1 / (all[COUNT] > 1 ? all[COUNT] : 1), d = all[SUM] * unit, least = all[SQUARE] * unit - d * d;
    memset(t->doubt, 0, sizeof t->doubt);
    for (int y = 0; y < FV_BLOCKS; y++)
        for (int x = 0; x < FV_BLOCKS; x++) {
            float most = judge_window((const float(*)[FV_BLOCKS][FV_BLOCKS])of, x, y, least);
            t->doubt[y] |= most < SURELY;
            for (int i = 0; i < FV_BLOCK; i++) t->most[y][FV_BLOCK * x + i] = most;
        }
}

/* Whether the row is next to pixels in doubt. */
static bool doubtful(const struct tile *t, int y)
{
    int first = y - REACH > 0 ? (y - REACH) / FV_BLOCK : 0, last = y + REACH < SIDE ? (y + REACH) / FV_BLOCK : FV_BLOCKS - 1;
    bool some = false;
    for (int k = first; k <= last; k++) some |= t->doubt[k];
    return some;
}

/* Of the row y, from -REACH on, sums over 5 pixels. */
static void sum_row(const struct fv_accumulate *a, struct tile *t, int y)
{
    _Alignas(64) uint32_t word[PADDED];
    _Alignas(64) float of[PADDED], has[PADDED];
    int row = a->y + y, first = a->x >= REACH ? -REACH : 0;
    int last = a->x + SIDE + REACH <= a->width ? SIDE + REACH : a->width - a->x;
    memset(word, 0xff, sizeof word);
    if (row >= 0 && row < a->height)
        memcpy(word + REACH + first, a->light + row * a->stride + a->x + first, (size_t)(last - first) * sizeof *word);
    for (int i = 0; i < PADDED; i += FV_WIDTH) {
        vi light = vi_load(word + i);
        vf_store(of + i, luma(light_unpack(light)));
        vf_store(has + i, vf_select(light_is_none(light), vf_of(0), vf_of(1)));
    }
    for (int i = 0; i < SIDE; i += FV_WIDTH) {
        vf sum[SUMS] = {vf_of(0), vf_of(0), vf_of(0)};
        for (int k = 0; k <= 2 * REACH; k++) {
            vf l = vf_load(of + i + k);
            sum[COUNT] += vf_load(has + i + k);
            sum[SUM] += l;
            sum[SQUARE] += l * l;
        }
        for (int k = 0; k < SUMS; k++) vf_store(t->around[k][y + REACH] + i, sum[k]);
    }
}

/* Frames of history that count beside light around it. */
static inline vf pixel_most(const struct tile *t, int x, int y, vf own)
{
    vf sum[SUMS] = {vf_of(0), vf_of(0), vf_of(0)};
    for (int k = 0; k < SUMS; k++)
        for (int v = 0; v <= 2 * REACH; v++) sum[k] += vf_load(t->around[k][y + v] + x);
    vf unit = vf_reciprocal(vf_max(sum[COUNT], vf_of(1))), mean = sum[SUM] * unit;
    vf floor = mean * ROUNDING, square = vf_max(sum[SQUARE] * unit - mean * mean, vf_of(0)) + floor * floor + 1e-12f;
    vf excess = vf_abs(own - mean) - FV_ACCUMULATE_SIGMAS * vf_root(square);
    vf most = square * vf_reciprocal(vf_clamp(excess * excess, 1e-20f, 1e20f));
    return vf_select((excess > 0.0f) & (sum[COUNT] >= (float)WINDOW_LEAST), vf_min(most, vf_of(NEVER)), vf_of(NEVER));
}

/* ---- mixing ---- */

/* As fv_light_pack, but each channel is rounded up by as much chance as it lies above the unit below: its mean is exact. */
static inline vi pack_by_chance(vf3 c, vu random)
{
    c = (vf3){vf_clamp(c.x, 0, FV_LIGHT_MAX), vf_clamp(c.y, 0, FV_LIGHT_MAX), vf_clamp(c.z, 0, FV_LIGHT_MAX)};
    vf most = vf_max(vf_max(c.x, c.y), vf_max(c.z, vf_of(0x1p-16f)));
    /* Of what could be rounded to 512 the next exponent. */
    vi field = ((vi)most + 0x7fff) & 0x7f800000;
    vf scale = (vf)(vi)((262u << 23) - (vu)field), unit = vf_of(1 / 1024.0f);
    vi r = vi_from(c.x * scale + (vf_from((vi)(random & 1023)) + 0.5f) * unit);
    vi g = vi_from(c.y * scale + (vf_from((vi)(random >> 10 & 1023)) + 0.5f) * unit);
    vi b = vi_from(c.z * scale + (vf_from((vi)(random >> 20 & 1023)) + 0.5f) * unit);
    vi brightest = vi_of(511); /* only where the exponent is the greatest */
    r = vi_select(r > brightest, brightest, r), g = vi_select(g > brightest, brightest, g), b = vi_select(b > brightest, brightest, b);
    return r | (g << 9) | (b << 18) | (vi)((vu)(field - (111 << 23)) << 4);
}

static inline vu random_of(const struct fv_accumulate *a, int x, int y)
{
    vu h = (vu)(vi_lanes() + x) * 0x9e3779b1u + (vu)vi_of(y) * 0x85ebca77u + a->seed * 0xc2b2ae3du;
    h ^= h >> 16;
    h *= 0x7feb352du;
    h ^= h >> 15;
    h *= 0x846ca68bu;
    return h ^ h >> 16;
}

static inline void mix(struct fv_accumulate *a, const struct tile *t, int x, int y)
{
    int64_t at = (int64_t)(a->y + y) * a->stride + a->x + x;
    int i = y * SIDE + x;
    vi word = vi_load(a->light + at), seen = (vi_lanes() + x < a->columns) & ((vf)vi_load(a->inverse_depth + at) > 0.0f);
    vf w = vf_min((vf)vi_load(a->inverse_depth + at), vf_of(1e6f)), frames = vf_load(t->frames + i);
    vi has = seen & ~light_is_none(word), object = object_of(a, at);
    vf3 light = light_unpack(word), mean = {vf_load(t->history[0] + i), vf_load(t->history[1] + i), vf_load(t->history[2] + i)};
    if (t->any) {
        vf most = vf_load(t->most[y / FV_BLOCK] + x);
        frames = vf_min(frames, most);
        if (t->doubt[y / FV_BLOCK]) frames = vf_select(most < SURELY, vf_min(frames, pixel_most(t, x, y, luma(mean))), frames);
    }
    vi kept = frames >= 0.5f; /* else it counts for nothing */
    vf weight = 1.0f / (frames + 1.0f);
    vf3 mixed = vf3_add(mean, vf3_scale(vf3_sub(light, mean), vf_select(has, weight, vf_of(0))));
    vi out = vi_select(has, word, vi_of(-1)), count = vi_select(has, vi_of(1), vi_of(0));
    if (vi_any(kept)) {
        vi grown = vi_from(frames + vf_select(has, vf_of(1.5f), vf_of(0.5f)));
        out = vi_select(kept, pack_by_chance(mixed, random_of(a, a->x + x, a->y + y)), out);
        count = vi_select(kept, vi_select(grown < a->most, grown, vi_of(a->most)), count);
    }
    vi lit = seen & (has | kept);
    out = vi_select(lit, out, vi_of(-1));
    vi_store(a->mean + at, out);
    vi_store(a->filtered + at, out);
    vi_store(a->track + at, vi_select(lit, track_of(w, object, count), vi_of(0)));
    if (a->variance) vf_store(a->variance + at, vf_load(a->variance + at) / vf_max(vf_from(count), vf_of(1)));
    a->empty |= vi_any(seen & ~lit);
}

void accumulate(struct fv_accumulate *a)
{
    struct tile t;
    t.any = a->empty = false;
    if (a->mean_before) {
        memset(t.differ, 0, sizeof t.differ);
        for (int y = 0; y < a->rows; y++)
            for (int x = 0; x < SIDE; x += FV_WIDTH) fetch(a, &t, x, y);
    } else {
        memset(t.frames, 0, sizeof t.frames);
        memset(t.history, 0, sizeof t.history);
    }
    if (t.any) {
        judge_windows(&t);
        for (int y = -REACH; y < a->rows + REACH; y++)
            if (doubtful(&t, y)) sum_row(a, &t, y);
    }
    for (int y = 0; y < a->rows; y++)
        for (int x = 0; x < SIDE; x += FV_WIDTH) mix(a, &t, x, y);
}
