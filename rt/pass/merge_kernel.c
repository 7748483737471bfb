/* merge_kernel: running means of pixels, and rasters of half and double density. */
#include "rt/pass/cache.h"
#include "rt/pass/merge.h"
#include "rt/trace/pixel.h"

#define merge FV_ISA_NAME(fv_merge)
#define bounds FV_ISA_NAME(fv_bounds)
#define halve FV_ISA_NAME(fv_halve)
#define double_row FV_ISA_NAME(fv_double_row)
void merge(const struct fv_merge *m);
void bounds(const uint32_t *cache, int64_t stride, int side, uint32_t rows, float *nearest, float *farthest);
void halve(const uint32_t *upper, const uint32_t *lower, uint32_t *out, int n);
void double_row(const uint32_t *near, const uint32_t *far, uint32_t *out, int n);

/* Numbers in [0, 1) by lane. */
static inline vf dither(int i, uint32_t seed)
{
    vu n = (vu)(vi_lanes() + i) * 0x9e3779b1u + seed;
    n ^= n >> 15;
    n *= 0x2c1b3c6du;
    n ^= n >> 12;
    return vf_from((vi)((n >> 8) & 0xffff)) * 0x1p-16f;
}

static inline vi pack_dithered(vf3 code, vf noise)
{
    vi r = vi_from(vf_clamp(code.x + noise, 0, 1023)), g = vi_from(vf_clamp(code.y + noise, 0, 1023)),
       b = vi_from(vf_clamp(code.z + noise, 0, 1023));
    return r | (g << 10) | (b << 20);
}

/* The history's code moved towards the sample by alpha of the way in linear light. Decoding and encoding again
 * shifts a code by less than a five-hundredth, and means by no more than that over the least alpha. */
static inline vf blend(vf history, vf linear, vf alpha)
{
    vf h = pixel_decode_channel(history * (1 / 1023.0f));
    return 1023.0f * pixel_encode_channel(h + alpha * (linear - h));
}

/* Of a vector of samples, what they count as in linear light, and colours; these at least in the lanes of mask. */
static inline vf3 take_samples(const struct fv_merge *m, int i, vi mask, vi *colour)
{
    if (m->sample) {
        vf3 code = pixel_unpack(*colour = vi_load(m->sample + i));
        return pixel_decode(code);
    }
    vf3 linear = {vf_load(m->red + i), vf_load(m->green + i), vf_load(m->blue + i)};
    *colour = vi_any(mask) ? pixel_encode(linear, m->exposure) : vi_of(0);
    linear = vf3_scale(linear, vf_of(m->exposure));
    return (vf3){vf_clamp(linear.x, 0, PIXEL_BRIGHTEST), vf_clamp(linear.y, 0, PIXEL_BRIGHTEST),
                 vf_clamp(linear.z, 0, PIXEL_BRIGHTEST)};
}

/* The same of codes of albedo and of light (trace/pixel.h). */
static inline vf blend_albedo(vf history, vf sample, vf alpha)
{
    vf h = history * history;
    return vf_root(h + alpha * (sample * sample - h));
}

static inline vf blend_light(vf history, vf sample, vf alpha)
{
    vf h = pixel_decode_light(history * (1 / 1023.0f)), s = pixel_decode_light(sample * (1 / 1023.0f));
    return history + 1023.0f * (pixel_encode_light(h + alpha * (s - h)) - pixel_encode_light(h));
}

/* What becomes of a vector's colours. */
struct weight {
    vf alpha, rho;
    vi fresh, leave, age; /* masks: replaced by the sample; left as they are */
};

/* Albedo like the colours. Light keeps its own count of samples (enum fv_plane), to 16; from there on rho is it,
 * which grows with it, but to less where alpha has a higher least. */
static __attribute__((noinline)) void merge_apart(const struct fv_merge *m, int i, const struct weight *w)
{
    vi albedo = vi_load(m->albedo + i), light = vi_load(m->light + i), new_light = vi_load(m->sample_light + i);
    vi count = ((albedo >> 30) & 3) | ((light >> 28) & 12);
    vf beta = vf_max(1.0f / (vf_max(vf_from(count) + 1.0f, w->rho) + 1.0f), vf_gather(m->light_k, w->age));
    vf3 a = pixel_unpack(albedo), as = pixel_unpack(vi_load(m->sample_albedo + i));
    vf3 l = pixel_unpack(light), ls = pixel_unpack(new_light);
    vf noise = dither(i, m->seed ^ 0x5bd1e995u);
    vf3 mean_a = {blend_albedo(a.x, as.x, w->alpha), blend_albedo(a.y, as.y, w->alpha), blend_albedo(a.z, as.z, w->alpha)};
    vf3 mean_l = {blend_light(l.x, ls.x, beta), blend_light(l.y, ls.y, beta), blend_light(l.z, ls.z, beta)};
    vi counted = ~w->fresh & (count + ((count < 15) & 1));
    vi packed_a = vi_select(w->fresh, vi_load(m->sample_albedo + i), pack_dithered(mean_a, noise)) | (counted << 30);
    vi packed_l = vi_select(w->fresh, new_light, pack_dithered(mean_l, noise)) | ((counted & 12) << 28);
    vi_store(m->albedo + i, vi_select(w->leave, albedo, packed_a));
    vi_store(m->light + i, vi_select(w->leave, light, packed_l));
}

/* By the weight alpha of the new sample: 1 / (rho + 1), so that all count alike, but at least k of the
 * history's age. (The paper prints the least of the two, and says the greatest.) Rounded by chance: to the
 * nearest, small steps would never arrive. */
void merge(const struct fv_merge *m)
{
    for (int i = 0; i < m->count; i += FV_WIDTH) {
        vi sample, colour = vi_load(m->colour + i), cache = vi_load(m->cache + i);
        vf w = vf_load(m->inverse_depth + i);
        vf rho = vf_from(cache_rho(cache));
        vi known = (w >= 0.0f) & (w <= FV_INVERSE_DEPTH_MAX);
        vi moving = ((vi_load(m->surface + i) & FV_SURFACE_OBJECT) != 0) & FV_CACHE_MOVING;
        vi same = vi_of(-(int32_t)m->still);
        same |= (w <= vf_load(m->nearest + i) * (1 + m->epsilon)) & (w >= vf_load(m->farthest + i) * (1 - m->epsilon)) &
                ((cache & FV_CACHE_MOVING) == moving);
        vi fresh = vi_load(m->replaced + i) | ~same | (rho < 1.0f) | ((colour & (int32_t)FV_PIXEL_FILLED) != 0);
        vf alpha = vf_max(1.0f / (rho + 1.0f), vf_gather(m->k, cache_age(cache)));
        alpha = vf_select(fresh, vf_of(1), alpha);
        vf rest = 1.0f - alpha;
        vf3 h = pixel_unpack(colour), s = take_samples(m, i, fresh, &sample);
        vf noise = dither(i, m->seed);
        vf3 moved = {blend(h.x, s.x, alpha), blend(h.y, s.y, alpha), blend(h.z, s.z, alpha)};
        vi mean = vi_select(fresh, sample, pack_dithered(moved, noise)) | (int32_t)FV_PIXEL_SAMPLED;
        vf worth = 1.0f / (alpha * alpha + rest * rest / vf_max(rho, vf_of(1)));
        vi now = cache_of_depth(w) | (vi_from(vf_min(worth, vf_of(255)) + 0.5f) << 8) | moving;
        /* A sample of unknown depth leaves what was reprojected, where that is anything. */
        vi leave = ~known & ~vi_load(m->replaced + i) & ((colour & (int32_t)FV_PIXEL_FILLED) == 0);
        now = vi_select(known, now, vi_of((int32_t)(FV_CACHE_NONE | FV_CACHE_OLDEST)));
        if (m->apart) {
            struct weight weight = {alpha, rho, fresh, leave, cache_age(cache)};
            merge_apart(m, i, &weight);
        }
        vi_store(m->colour + i, vi_select(leave, colour, mean));
        vi_store(m->cache + i, vi_select(leave, cache, now));
    }
}

/* The inverse depths of a tile's pixels, of the rows asked for, and of the eight around each, as far as they lie
 * in the tile: others are being written. Where none is known, one that none is within. */
void bounds(const uint32_t *cache, int64_t stride, int side, uint32_t rows, float *nearest, float *farthest)
{
    _Alignas(64) float high[FV_TILE + 2 * FV_WIDTH], low[FV_TILE + 2 * FV_WIDTH];
    for (; rows; rows &= rows - 1) {
        int y = __builtin_ctz(rows);
        const uint32_t *row[3] = {cache + (y > 0 ? y - 1 : 0) * stride, cache + y * stride,
                                  cache + (y + 1 < side ? y + 1 : y) * stride};
        for (int x = 0; x < side; x += FV_WIDTH) {
            vf most = vf_of(-1), least = vf_of(2 * FV_INVERSE_DEPTH_MAX);
            for (int i = 0; i < 3; i++) {
                vf w = cache_depth(vi_load(row[i] + x)); /* no number where there is none: the other one stays */
                most = vf_max(w, most);
                least = vf_min(w, least);
            }
            vf_store(high + FV_WIDTH + x, most);
            vf_store(low + FV_WIDTH + x, least);
        }
        high[FV_WIDTH - 1] = high[FV_WIDTH], low[FV_WIDTH - 1] = low[FV_WIDTH];
        high[FV_WIDTH + side] = high[FV_WIDTH + side - 1], low[FV_WIDTH + side] = low[FV_WIDTH + side - 1];
        for (int x = 0; x < side; x += FV_WIDTH) {
            const float *h = high + FV_WIDTH + x, *l = low + FV_WIDTH + x;
            vf_store(nearest + y * FV_TILE + x, vf_max(vf_load(h), vf_max(vf_load(h - 1), vf_load(h + 1))));
            vf_store(farthest + y * FV_TILE + x, vf_min(vf_load(l), vf_min(vf_load(l - 1), vf_load(l + 1))));
        }
    }
}

/* Means of 2 x 2 pixels: n of them. */
void halve(const uint32_t *upper, const uint32_t *lower, uint32_t *out, int n)
{
    const uint32_t odd = 0x3ff003ff, even = 0x000ffc00;
    for (int i = 0; i < n; i++) {
        uint32_t a = upper[2 * i], b = upper[2 * i + 1], c = lower[2 * i], d = lower[2 * i + 1];
        uint32_t flags = (a | b | c | d) & FV_PIXEL_SAMPLED;
        uint32_t green = ((a & even) >> 2) + ((b & even) >> 2) + ((c & even) >> 2) + ((d & even) >> 2);
        uint64_t others = (uint64_t)(a & odd) + (b & odd) + (c & odd) + (d & odd) + 0x00200002;
        out[i] = (uint32_t)(others >> 2 & odd) | ((green + (1 << 9)) & even) | flags;
    }
}

/* Red and blue of pixels in the halves of words, where sums of sixteen still fit, and green in words. */
struct split {
    vi red_blue, green;
};

/* Three of the near row's and one of the far one's. */
static inline struct split mix(const uint32_t *near, const uint32_t *far)
{
    vi n = vi_load(near), f = vi_load(far);
    vi n2 = (n & 1023) | ((n >> 4) & 0x03ff0000), f2 = (f & 1023) | ((f >> 4) & 0x03ff0000);
    return (struct split){3 * n2 + f2, 3 * ((n >> 10) & 1023) + ((f >> 10) & 1023)};
}

/* A sixteenth of `side` + 3 `middle`, rounded. */
static inline vi mean_of(const struct split *side, const struct split *middle)
{
    vi two = side->red_blue + 3 * middle->red_blue + 0x00080008, one = side->green + 3 * middle->green + 8;
    return ((two >> 4) & 1023) | (two & 0x3ff00000) | ((one >> 4) << 10);
}

/* Pixels of twice the density from rows of n + 2, the first and the last being the neighbours': bilinear, a
 * quarter of a pixel from `near` towards `far`. n a multiple of 16, `out` of 2n. */
void double_row(const uint32_t *near, const uint32_t *far, uint32_t *out, int n)
{
    for (int i = 0; i < n; i += FV_WIDTH) {
        struct split left = mix(near + i, far + i), middle = mix(near + i + 1, far + i + 1);
        struct split right = mix(near + i + 2, far + i + 2);
        vi flags = vi_load(near + i + 1) & (int32_t)FV_PIXEL_SAMPLED;
        vi even = mean_of(&left, &middle) | flags, odd = mean_of(&right, &middle) | flags;
        vi_store(out + 2 * i, vi_zip_first(even, odd));
        vi_store(out + 2 * i + FV_WIDTH, vi_zip_second(even, odd));
    }
}
