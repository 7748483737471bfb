/* atrous_kernel: light filtered over its neighbours; see atrous.h.
 *
 * Pixels are decoded once into strips of floats that stay in the cache, and what a pair of pixels weighs is worked out once
 * for both. Of a pixel with the normal n, inverse depth w and the ray r = corner + x dx + y dy a strip holds c = n r and
 * g = w n dx: then (n + n') (P' - P) w w' = (c + c') (w - w') + step (g + g'), where P = r / w and the other pixel lies `step`
 * to the right. Down the picture the same holds with dy. */
#include "rt/pass/atrous_light.h"

#define atrous FV_ISA_NAME(fv_atrous)
#define pack_light FV_ISA_NAME(fv_pack_light)
#define unpack_light FV_ISA_NAME(fv_unpack_light)

void atrous(const struct fv_atrous *a);
void pack_light(const float *red, const float *green, const float *blue, float scale, uint32_t *light, int n);
void unpack_light(const uint32_t *light, float *red, float *green, float *blue, int n);

/* A strip's planes. Light is 0 where there is none; HAS 0 where surfaces have none, else 1; SPREAD is HAS / s. */
enum { RED, GREEN, BLUE, LUMA, HAS, NORMAL_X, NORMAL_Y, NORMAL_Z, INVERSE, COSINE, ACROSS, DOWN, SPREAD, VARIANCE, PLANES };

/* Pixels that are filtered at a time; strips of rows hold 2 steps more at either side. */
enum { ROW = 256, COLUMN = 96, RING = 5 };

/* Inverse depths between which positions are told apart, and the least variance. */
#define NEAREST 1e6f
#define FARTHEST 1e-6f
#define LEAST_VARIANCE 0x1p-20f

/* Pixels that show no surface have a normal of this, which weighs nothing to any other, not even by the least factor. */
#define NO_NORMAL 1e18f
#define LEAST_FACTOR 1e-20f

/* 1 as bits of a float; differences e of those are 2^(-e / 2^23), and between powers of 2 a little more. */
#define ONE (127.0f * 0x1p23f)
#define HALVING 0x1p23f

struct filter {
    struct fv_atrous a; /* copies, so that what is stored is known not to change them */
    float corner[3], dx[3], dy[3];
    float light, normal, position; /* factors on squares, so that a sum of them is taken from ONE */
};

/* What the compiler knows of a strip: elements from a plane to the next; whether there are variances; and whether all surfaces
 * that are looked at have light. */
struct known {
    int pitch;
    bool varies, whole;
};

/* Of squares of differences in units of 1 / unit. */
static float factor_of(float sigma, double unit)
{
    double s = sigma;
    if (!(s <= 1e30)) return 0;
    double factor = (double)HALVING * 1.4426950408889634 / (s * s * unit * unit + 1e-300);
    return factor < 1e30 ? (float)factor : 1e30f;
}

static FV_INLINE struct filter filter_of(const struct fv_atrous *a)
{
    const struct fv_view *v = a->view;
    struct filter f = {.a = *a,
                       .light = a->taps == FV_ATROUS_FILL ? 0 : factor_of(a->sigma_light, 1),
                       .normal = factor_of(a->sigma_normal, 511) + LEAST_FACTOR,
                       .position = factor_of(a->sigma_position, 2 * 511 * (double)v->pixel_size * a->step)};
    for (int i = 0; i < 3; i++) f.corner[i] = v->corner[i], f.dx[i] = v->dx[i], f.dy[i] = v->dy[i];
    return f;
}

/* A row's words from x on; `beyond` the row: that. */
static __attribute__((noinline)) vi load_edge(const void *row, int x, int width, int32_t beyond)
{
    vi v = vi_of(beyond);
    for (int i = 0; i < FV_WIDTH; i++)
        if (x + i >= 0 && x + i < width) {
            int32_t word;
            memcpy(&word, (const int32_t *)row + x + i, 4);
            v[i] = word;
        }
    return v;
}

static inline vi load(const void *row, int x, int width, int32_t beyond)
{
    return x >= 0 && x + FV_WIDTH <= width ? vi_load((const int32_t *)row + x) : load_edge(row, x, width, beyond);
}

static inline void store(void *to, vi v, int n)
{
    if (n >= FV_WIDTH) {
        vi_store(to, v);
        return;
    }
    int32_t lanes[FV_WIDTH];
    vi_store(lanes, v);
    memcpy(to, lanes, (size_t)n * 4);
}

static inline vf component(vi facing, int shift)
{
    return vf_from((facing >> shift) & 1023) - 511.0f;
}

/* Into the strip at `to`: light, and where it lies. */
static FV_INLINE void decode_light(vi word, vi has, float *to, int k)
{
    vf3 light = light_unpack(word);
    light = vf3_select(has, light, (vf3){vf_of(0), vf_of(0), vf_of(0)});
    vf_store(to + RED * k, light.x);
    vf_store(to + GREEN * k, light.y);
    vf_store(to + BLUE * k, light.z);
    vf_store(to + LUMA * k, 0.25f * (light.x + light.z) + 0.5f * light.y);
}

static FV_INLINE void decode_place(const struct filter *f, vf3 ray, vf w, vi facing, float *to, int k, bool across, bool down)
{
    vi seen = w > 0.0f;
    vf3 n = {component(facing, 0), component(facing, 10), component(facing, 20)};
    w = vf_clamp(w, FARTHEST, NEAREST);
    vf_store(to + NORMAL_X * k, vf_select(seen, n.x, vf_of(NO_NORMAL)));
    vf_store(to + NORMAL_Y * k, n.y);
    vf_store(to + NORMAL_Z * k, n.z);
    vf_store(to + INVERSE * k, w);
    vf_store(to + COSINE * k, vf_dot(n, ray));
    if (across) vf_store(to + ACROSS * k, w * vf_dot(n, vf3_of(f->dx)));
    if (down) vf_store(to + DOWN * k, w * vf_dot(n, vf3_of(f->dy)));
}

/* Brings on its way what lies `ahead` elements on; beyond the planes that does nothing. */
static FV_INLINE void fetch(const void *at, int64_t ahead, bool to_write)
{
    const char *line = (const char *)((uintptr_t)at + (uintptr_t)(ahead * 4));
    if (to_write) __builtin_prefetch(line, 1);
    else __builtin_prefetch(line);
}

/* What there is among pixels: surfaces without light; and what is no surface. */
enum { HOLES = 1, NOTHING = 2 };

static FV_INLINE int decode_nothing(int n, float *strip, int k)
{
    for (int p = 0; p < PLANES; p++)
        for (int i = 0; i < n; i += FV_WIDTH) vf_store(strip + p * k + i, vf_of(p == NORMAL_X ? NO_NORMAL : p == HAS || p == INVERSE));
    return NOTHING;
}

/* The picture's pixels (x, y) to (x + n - 1, y), n rounded up to the width. Beyond it is nothing. `ones`: HAS is 1 of that
 * many pixels of the strip. */
static FV_INLINE int decode(const struct filter *f, int x, int y, int n, float *strip, bool *ones, struct known c, bool across, bool down)
{
    const struct fv_atrous *a = &f->a;
    if (y < 0 || y >= a->height) return decode_nothing(n, strip, c.pitch);
    const uint32_t *light = a->light + y * a->stride, *facings = a->facing + y * a->stride;
    const float *inverse = a->inverse_depth + y * a->stride, *variances = c.varies ? a->variance + y * a->stride : NULL;
    int64_t ahead = across ? 2 * ROW : a->step * a->stride;
    int width = a->width;
    float at[3];
    for (int i = 0; i < 3; i++) at[i] = f->corner[i] + ((float)y + 0.5f) * f->dy[i];
    vi holes = vi_of(0), surfaces = vi_of(-1);
    for (int i = 0; i < n; i += FV_WIDTH) {
        float *to = strip + i;
        fetch(light + x + i, ahead, false);
        fetch(facings + x + i, ahead, false);
        fetch(inverse + x + i, ahead, false);
        fetch(a->filtered + y * a->stride + x + i, across ? ROW : -a->step * a->stride, true);
        vi word = load(light, x + i, width, -1), facing = load(facings, x + i, width, 0);
        vf w = (vf)load(inverse, x + i, width, 0), column = vf_from(vi_lanes() + (x + i)) + 0.5f;
        vi seen = w > 0.0f, has = seen & ~light_is_none(word);
        vf3 ray = {at[0] + column * f->dx[0], at[1] + column * f->dx[1], at[2] + column * f->dx[2]};
        holes |= seen & ~has, surfaces &= seen;
        decode_light(word, has, to, c.pitch);
        decode_place(f, ray, w, facing, to, c.pitch, across, down);
        if (!c.varies) continue;
        vf one = vf_select(has, vf_of(1), vf_of(0)), variance = vf_clamp((vf)load(variances, x + i, width, 0), 0, 1e30f) * one;
        vf_store(to + VARIANCE * c.pitch, variance);
        vf_store(to + SPREAD * c.pitch, one * vf_rsqrt(vf_max(variance, vf_of(LEAST_VARIANCE))));
    }
    bool some = vi_any(holes);
    if (some || !*ones)
        for (int i = 0; i < n; i += FV_WIDTH) {
            vi hole = light_is_none(load(light, x + i, width, -1)) & ((vf)load(inverse, x + i, width, 0) > 0.0f);
            vf_store(strip + HAS * c.pitch + i, vf_select(hole, vf_of(0), vf_of(1)));
        }
    *ones = !some;
    return (some ? HOLES : 0) | (vi_any(~surfaces) ? NOTHING : 0);
}

/* What the pixels at p and at q weigh to each other, times 2^((most - ONE) / 2^23); q lies to the right of p or below it. `lean`:
 * g + g' times the step between them; `depth`: of q. */
static FV_INLINE vf weight(const struct filter *f, const float *p, const float *q, vf lean, vf depth, float most, struct known c)
{
    int k = c.pitch, spread = c.varies ? SPREAD : HAS;
#define P(plane) vf_load(p + (plane) * k)
#define Q(plane) vf_load(q + (plane) * k)
    vf luma = P(LUMA) - Q(LUMA), x = P(NORMAL_X) - Q(NORMAL_X), y = P(NORMAL_Y) - Q(NORMAL_Y), z = P(NORMAL_Z) - Q(NORMAL_Z);
    vf apart = ((P(COSINE) + Q(COSINE)) * (P(INVERSE) - Q(INVERSE)) + lean) * depth, square = luma * luma;
    if (c.varies || !c.whole) square *= P(spread) * Q(spread);
    vf bits = most - f->normal * (x * x + y * y + z * z);
    bits -= f->position * (apart * apart);
    bits -= f->light * square;
#undef P
#undef Q
    return (vf)vi_from(vf_max(bits, vf_of(0)));
}

/* Weights of n pairs, q with p, one step before it, and q with o, two before; g: ACROSS or DOWN. */
static FV_INLINE void weigh(const struct filter *f, const float *o, const float *p, const float *q, int n, int g, float *one, float *two, struct known c)
{
    float step = (float)f->a.step;
    const float *go = o + g * c.pitch, *gp = p + g * c.pitch, *gq = q + g * c.pitch;
    for (int i = 0; i < n; i += FV_WIDTH) {
        vf lean = vf_load(gq + i), depth = vf_reciprocal(vf_load(q + INVERSE * c.pitch + i));
        vf_store(one + i, weight(f, p + i, q + i, step * (vf_load(gp + i) + lean), depth, ONE - 2 * HALVING, c));
        vf_store(two + i, weight(f, o + i, q + i, 2 * step * (vf_load(go + i) + lean), depth, ONE - 4 * HALVING, c));
    }
}

struct sum {
    vf3 light;
    vf weight, variance;
};

static FV_INLINE void add(struct sum *s, const float *q, vf w, struct known c)
{
    int k = c.pitch;
    s->light.x += w * vf_load(q + RED * k);
    s->light.y += w * vf_load(q + GREEN * k);
    s->light.z += w * vf_load(q + BLUE * k);
    s->weight += c.whole ? w : w * vf_load(q + HAS * k);
    if (c.varies) s->variance += w * w * vf_load(q + VARIANCE * k);
}

/* Lanes of the pixels from (x, y) on that stay as they are whatever lies around them. */
static FV_INLINE vi stays_at(const struct fv_atrous *a, int x, int y)
{
    vf dx = vf_from(vi_lanes()) + ((float)x + 0.5f - a->centre[0]), dy = vf_of((float)y + 0.5f - a->centre[1]);
    return a->from_px > 0 ? dx * dx + dy * dy < a->from_px * a->from_px : vi_of(0);
}

/* Means of the pixels from (x, y) on, n of them at most, where they are filtered. `seen`: what there is among them. */
static FV_INLINE void finish(const struct fv_atrous *a, const struct sum *s, int x, int y, int n, int seen, struct known c)
{
    int64_t row = y * a->stride;
    vf unit = vf_reciprocal(vf_max(s->weight, vf_of(1e-20f)));
    vi mean = light_pack_sound(vf3_scale(s->light, unit)), stays = stays_at(a, x, y);
    if (seen || a->from_px > 0) {
        vi own = load(a->light + row, x, a->width, -1);
        stays |= ~((s->weight > 1e-20f) & ((vf)load(a->inverse_depth + row, x, a->width, 0) > 0.0f));
        if (a->taps == FV_ATROUS_FILL) stays |= ~light_is_none(own);
        mean = vi_select(stays, own, mean);
    }
    store(a->filtered + row + x, mean, n);
    if (c.varies) {
        vf before = vf_clamp((vf)load(a->variance + row, x, a->width, 0), 0, 1e30f);
        store(a->filtered_variance + row + x, (vi)vf_select(stays, before, (s->variance * unit) * unit), n);
    }
}

/* Whether the pixels from (x, y) on are all nearer to the centre than those that are filtered. */
static FV_INLINE bool within(const struct fv_atrous *a, int x, int y, int n)
{
    float left = (float)x + 0.5f - a->centre[0], right = left + (float)(n - 1), dy = (float)y + 0.5f - a->centre[1];
    float dx = left * left > right * right ? left : right;
    return a->from_px > 0 && dx * dx + dy * dy < 0.999f * a->from_px * a->from_px;
}

static FV_INLINE void keep(const struct fv_atrous *a, int x, int y, int n)
{
    int64_t from = y * a->stride + x;
    memcpy(a->filtered + from, a->light + from, (size_t)n * 4);
    for (int i = 0; i < n && a->variance; i++) {
        float v = a->variance[from + i];
        a->filtered_variance[from + i] = v > 0 ? v < 1e30f ? v : 1e30f : 0;
    }
}

/* Means by weights that are known: q[i] is a neighbour and w[i] its weight. */
static FV_INLINE void gather(const struct filter *f, const float *p, const float *const q[4], const float *const w[4], int x, int y, int n, int seen, struct known c)
{
    for (int i = 0; i < n; i += FV_WIDTH) {
        struct sum s = {0};
        add(&s, p + i, vf_of(0.375f), c);
        for (int k = 0; k < 4; k++) add(&s, q[k] + i, vf_load(w[k] + i), c);
        finish(&f->a, &s, x + i, y, n - i, seen, c);
    }
}

static FV_INLINE void filter_across(const struct fv_atrous *outer, bool varies)
{
    enum { PITCH = ROW + 4 * FV_ATROUS_STEP_MAX + 16 };
    _Alignas(64) float strip[PLANES * PITCH], one[PITCH], two[PITCH];
    struct filter f = filter_of(outer);
    const struct fv_atrous *a = &f.a;
    int s = a->step;
    bool ones = false;
    const float *q[4] = {strip, strip + s, strip + 3 * s, strip + 4 * s}, *w[4] = {two, one, one + s, two + 2 * s};
    for (int y = a->y; y < a->y + a->rows; y++)
        for (int x = a->x; x < a->x + a->columns; x += ROW) {
            int left = a->x + a->columns - x, n = left < ROW ? left : ROW;
            if (within(a, x, y, n)) {
                keep(a, x, y, n);
                continue;
            }
            int seen = decode(&f, x - 2 * s, y, n + 4 * s, strip, &ones, (struct known){PITCH, varies, false}, true, false);
            if (seen & HOLES) {
                weigh(&f, strip, strip + s, strip + 2 * s, n + 2 * s, ACROSS, one, two, (struct known){PITCH, varies, false});
                gather(&f, strip + 2 * s, q, w, x, y, n, seen, (struct known){PITCH, varies, false});
            } else {
                weigh(&f, strip, strip + s, strip + 2 * s, n + 2 * s, ACROSS, one, two, (struct known){PITCH, varies, true});
                gather(&f, strip + 2 * s, q, w, x, y, n, seen, (struct known){PITCH, varies, true});
            }
        }
}

struct column {
    _Alignas(64) float strip[RING][PLANES * COLUMN], one[RING][COLUMN], two[RING][COLUMN];
    bool ones[RING];
};

/* What follows from the ring's newest row j: weights to the two before, and the means of the row two before. */
static FV_INLINE void column_row(const struct filter *f, struct column *r, const int at[RING], int x, int y, int n, bool means, int seen, struct known c)
{
    weigh(f, r->strip[at[2]], r->strip[at[3]], r->strip[at[4]], n, DOWN, r->one[at[4]], r->two[at[4]], c);
    if (!means) return;
    const float *q[4] = {r->strip[at[0]], r->strip[at[1]], r->strip[at[3]], r->strip[at[4]]};
    const float *w[4] = {r->two[at[2]], r->one[at[2]], r->one[at[3]], r->two[at[4]]};
    gather(f, r->strip[at[2]], q, w, x, y, n, seen, c);
}

/* Rows `step` apart from y on: the rows j of the ring are y + j step. */
static FV_INLINE void filter_column(const struct filter *f, struct column *r, int x, int y, int n, bool varies)
{
    const struct fv_atrous *a = &f->a;
    int s = a->step, last = (a->y + a->rows - 1 - y) / s;
    int seen = 0; /* in the rows j - 4 to j, the oldest in the lowest two bits */
    for (int j = -2; j <= last + 2; j++) {
        int at[RING], row = y + (j - 2) * s; /* of the rows j - 4 to j */
        for (int i = 0; i < RING; i++) at[i] = (j + i + 2 * RING - 4) % RING;
        seen = seen >> 2 | decode(f, x, y + j * s, n, r->strip[at[4]], &r->ones[at[4]], (struct known){COLUMN, varies, false}, false, true) << 8;
        if (j < 0) continue;
        bool kept = j >= 2 && within(a, x, row, n), means = j >= 2 && !kept;
        if (kept) keep(a, x, row, n);
        if (seen & 0x155) column_row(f, r, at, x, row, n, means, seen >> 4 & 3, (struct known){COLUMN, varies, false});
        else column_row(f, r, at, x, row, n, means, seen >> 4 & 3, (struct known){COLUMN, varies, true});
    }
}

static FV_INLINE void filter_down(const struct fv_atrous *outer, bool varies)
{
    struct filter f = filter_of(outer);
    const struct fv_atrous *a = &f.a;
    struct column ring;
    for (int i = 0; i < RING; i++) ring.ones[i] = false;
    for (int x = a->x; x < a->x + a->columns; x += COLUMN) {
        int left = a->x + a->columns - x, n = left < COLUMN ? left : COLUMN;
        for (int y = a->y; y < a->y + a->step && y < a->y + a->rows; y++) filter_column(&f, &ring, x, y, n, varies);
    }
}

/* The pixels at p, whose rows above and below are row[0] to row[4]. */
static FV_INLINE struct sum sum_around(const struct filter *f, const float *const row[5], int i, struct known c)
{
    static const float spline[5] = {1 / 16.0f, 0.25f, 0.375f, 0.25f, 1 / 16.0f};
    int s = f->a.step;
    struct sum sum = {0};
    for (int v = -2; v <= 2; v++)
        for (int u = -2; u <= 2; u++) {
            const float *p = row[2] + i, *q = row[v + 2] + i + u * s;
            bool after = v > 0 || (v == 0 && u > 0);
            const float *first = after ? p : q, *second = after ? q : p;
            float across = (float)(after ? u * s : -u * s), down = (float)(after ? v * s : -v * s);
            vf lean = across * (vf_load(p + ACROSS * c.pitch) + vf_load(q + ACROSS * c.pitch)) +
                      down * (vf_load(p + DOWN * c.pitch) + vf_load(q + DOWN * c.pitch));
            add(&sum, q, spline[u + 2] * spline[v + 2] * weight(f, first, second, lean, vf_reciprocal(vf_load(second + INVERSE * c.pitch)), ONE, c), c);
        }
    return sum;
}

static FV_INLINE void full_row(const struct filter *f, const float *const row[5], int x, int y, int n, struct known c)
{
    const struct fv_atrous *a = &f->a;
    bool filling = a->taps == FV_ATROUS_FILL;
    if (within(a, x, y, n)) {
        keep(a, x, y, n);
        return;
    }
    for (int i = 0; i < n; i += FV_WIDTH) {
        if (filling && !vi_any(light_is_none(load(a->light + y * a->stride, x + i, a->width, 0)))) {
            keep(a, x + i, y, n - i < FV_WIDTH ? n - i : FV_WIDTH);
            continue;
        }
        struct sum sum = sum_around(f, row, i, c);
        finish(a, &sum, x + i, y, n - i, HOLES | NOTHING, c);
    }
}

static FV_INLINE void filter_full(const struct fv_atrous *outer, bool varies)
{
    enum { PITCH = COLUMN + 4 * FV_ATROUS_STEP_MAX + 16 };
    _Alignas(64) float strip[RING][PLANES * PITCH];
    struct filter f = filter_of(outer);
    const struct fv_atrous *a = &f.a;
    struct known c = {PITCH, varies, false};
    bool ones[RING] = {false};
    int s = a->step;
    for (int x = a->x; x < a->x + a->columns; x += COLUMN) {
        int left = a->x + a->columns - x, n = left < COLUMN ? left : COLUMN;
        for (int first = a->y; first < a->y + s && first < a->y + a->rows; first++)
            for (int j = -2; j <= (a->y + a->rows - 1 - first) / s + 2; j++) {
                decode(&f, x - 2 * s, first + j * s, n + 4 * s, strip[(j + RING) % RING], &ones[(j + RING) % RING], c, true, true);
                if (j < 2) continue;
                const float *row[5];
                for (int i = 0; i < 5; i++) row[i] = strip[(j + i + 1) % RING] + 2 * s;
                full_row(&f, row, x, first + (j - 2) * s, n, c);
            }
    }
}

static __attribute__((noinline)) void across(const struct fv_atrous *a)
{
    if (a->variance) filter_across(a, true);
    else filter_across(a, false);
}

static __attribute__((noinline)) void down(const struct fv_atrous *a)
{
    if (a->variance) filter_down(a, true);
    else filter_down(a, false);
}

static __attribute__((noinline)) void full(const struct fv_atrous *a)
{
    if (a->variance) filter_full(a, true);
    else filter_full(a, false);
}

void atrous(const struct fv_atrous *a)
{
    if (a->taps == FV_ATROUS_ACROSS) across(a);
    else if (a->taps == FV_ATROUS_DOWN) down(a);
    else full(a);
}

void pack_light(const float *red, const float *green, const float *blue, float scale, uint32_t *light, int n)
{
    for (int i = 0; i < n; i += FV_WIDTH)
        vi_store(light + i, light_pack((vf3){vf_load(red + i) * scale, vf_load(green + i) * scale, vf_load(blue + i) * scale}));
}

void unpack_light(const uint32_t *light, float *red, float *green, float *blue, int n)
{
    for (int i = 0; i < n; i += FV_WIDTH) {
        vf3 c = light_unpack(vi_load(light + i));
        vf_store(red + i, c.x), vf_store(green + i, c.y), vf_store(blue + i, c.z);
    }
}
