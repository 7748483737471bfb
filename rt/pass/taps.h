/* taps: bilinear lookups in an 8-bit picture (r, g, b, unused) by kernels; and tables over steps. */
#ifndef FV_PASS_TAPS_H
#define FV_PASS_TAPS_H

#include "rt/trace/simd16.h"

/* The four pixels around places in a picture, two above two, and the place between them, 0 to 1. */
struct fv_taps {
    vi pixel[4];
    vf right, down;
};

/* The pixels at `at` and to their right, and those a row below. */
static FV_INLINE void fv_taps_gather(const uint32_t *picture, int stride, vi x, vi y, vi pixel[4])
{
    vi at = y * stride + x;
    vi_gather_pairs(picture, at, &pixel[0], &pixel[1]);
    vi_gather_pairs(picture + stride, at, &pixel[2], &pixel[3]);
}

#if FV_WIDTH > 4
/* The words at `index` of a window, and those to their right. */
static FV_INLINE void fv_taps_pick(const uint32_t *window, vi index, vi *first, vi *second)
{
    vi low = vi_load(window), high = vi_load(window + FV_WIDTH);
    *first = vi_pick(low, high, index);
    *second = vi_pick(low, high, index + 1);
}

/* The same from a window of 2 FV_WIDTH x 2 pixels, or x 3, where they all lie within one: neighbours nearly always do.
 * A tenth of a gather's loads. False: they do not. */
static FV_INLINE bool fv_taps_near(const uint32_t *picture, int stride, int width, vi x, vi y, vi pixel[4])
{
    int last = FV_WIDTH - 1, left = x[0] < x[last] ? x[0] : x[last], top = y[0] < y[last] ? y[0] : y[last];
    left = left < width - 2 * FV_WIDTH ? left : width - 2 * FV_WIDTH;
    if (left < 0) return false;
    vi right = x - left, down = y - top;
    if (vi_any((vi)(((vu)right > 2 * FV_WIDTH - 2) | ((vu)down > 1)))) return false; /* less than 0: many */
    const uint32_t *window = picture + (int64_t)top * stride + left;
    fv_taps_pick(window, right, &pixel[0], &pixel[1]);
    fv_taps_pick(window + stride, right, &pixel[2], &pixel[3]);
    vi lower = down > 0;
    if (!vi_any(lower)) return true;
    vi third[2];
    fv_taps_pick(window + 2 * (int64_t)stride, right, &third[0], &third[1]);
    for (int k = 0; k < 2; k++) {
        pixel[k] = vi_select(lower, pixel[2 + k], pixel[k]);
        pixel[2 + k] = vi_select(lower, third[k], pixel[2 + k]);
    }
    return true;
}
#else
static FV_INLINE bool fv_taps_near(const uint32_t *picture, int stride, int width, vi x, vi y, vi pixel[4])
{
    (void)picture, (void)stride, (void)width, (void)x, (void)y, (void)pixel;
    return false;
}
#endif

/* Beyond the picture's border, the pixels there. At least 2 x 2 pixels; no NaN. */
static FV_INLINE struct fv_taps fv_taps_at(const uint32_t *picture, int stride, int width, int height, vf px, vf py)
{
    struct fv_taps taps;
    vf x = vf_clamp(px - 0.5f, 0, (float)(width - 1)), y = vf_clamp(py - 0.5f, 0, (float)(height - 1));
    vf x0 = vf_min(vf_floor(x), vf_of((float)(width - 2))), y0 = vf_min(vf_floor(y), vf_of((float)(height - 2)));
    vi ix = vi_from(x0), iy = vi_from(y0);
    if (!fv_taps_near(picture, stride, width, ix, iy, taps.pixel)) fv_taps_gather(picture, stride, ix, iy, taps.pixel);
    taps.right = x - x0;
    taps.down = y - y0;
    return taps;
}

/* The channel at `shift` bits, rounded: of squares, as light adds up, so that edges stay in their place. */
static FV_INLINE vi fv_taps_channel(const struct fv_taps *taps, int shift)
{
    vf tap[4];
    for (int k = 0; k < 4; k++) {
        tap[k] = vf_from((taps->pixel[k] >> shift) & 255);
        tap[k] *= tap[k];
    }
    vf upper = tap[0] + (tap[1] - tap[0]) * taps->right, lower = tap[2] + (tap[3] - tap[2]) * taps->right;
    return vi_from(vf_sqrt(vf_max(upper + (lower - upper) * taps->down, vf_of(0))) + 0.5f);
}

/* Weights of a tap and the one to its right, 16 bits each, FV_TAPS_WHOLE together. */
enum { FV_TAPS_WHOLE = 32767 };

static FV_INLINE vi fv_taps_weights(const struct fv_taps *taps)
{
    vi right = vi_from(taps->right * (float)FV_TAPS_WHOLE + 0.5f);
    return (right << 16) | (FV_TAPS_WHOLE - right);
}

/* The same to a code, and exact where the four are alike, at half of what it takes: a tap and the one to its right go
 * in one lane. Squares are less 2^15, so that they fit signed 16 bits, and what is added up is less 2^15 times the
 * weights; a hundredth of a code's square keeps what floats round away from below 0. */
static FV_INLINE vi fv_taps_swift(const struct fv_taps *taps, vi weights, int shift)
{
    const int32_t bias = 32768 * FV_TAPS_WHOLE + FV_TAPS_WHOLE / 100;
    vi row[2];
    for (int k = 0; k < 2; k++) {
        vi left = taps->pixel[2 * k] >> shift, right = (vi)((vu)taps->pixel[2 * k + 1] << (16 - shift));
        row[k] = vi_dot_pairs(vi_squares((left & 0xff) | (right & 0xff0000)) ^ (int32_t)0x80008000, weights);
    }
    vf square = vf_from(row[0] + bias) + vf_from(row[1] - row[0]) * taps->down;
    return vi_from(vf_root_about(square) * 0.0055243559f + 0.5f); /* 1 / sqrt(FV_TAPS_WHOLE) */
}

/* Places of a vector that are known to lie close together, by whoever made them: columns from `left` to left + 2 FV_WIDTH - 2,
 * in units of 1 / 32768, and rows from `top` on, less than one down, or less than two where they are `tall`. */
static FV_INLINE struct fv_taps fv_taps_calm(const uint32_t *picture, int stride, int left, int top, bool tall, vi x, vf y, vi *weights)
{
    struct fv_taps taps;
    const uint32_t *window = picture + (int64_t)top * stride + left;
    vi at = (x >> 15) - left, right = x & 32767;
    *weights = (right << 16) - right + FV_TAPS_WHOLE;
    taps.down = y - (float)top;
#if FV_WIDTH > 4
    fv_taps_pick(window, at, &taps.pixel[0], &taps.pixel[1]);
    fv_taps_pick(window + stride, at, &taps.pixel[2], &taps.pixel[3]);
    if (!tall) return taps;
    vi lower = taps.down >= 1.0f, third[2];
    fv_taps_pick(window + 2 * (int64_t)stride, at, &third[0], &third[1]);
    for (int k = 0; k < 2; k++) {
        taps.pixel[k] = vi_select(lower, taps.pixel[2 + k], taps.pixel[k]);
        taps.pixel[2 + k] = vi_select(lower, third[k], taps.pixel[2 + k]);
    }
    taps.down = vf_select(lower, taps.down - 1.0f, taps.down);
#else
    vi lower = tall ? taps.down >= 1.0f : vi_of(0);
    at += lower & stride;
    vi_gather_pairs(window, at, &taps.pixel[0], &taps.pixel[1]);
    vi_gather_pairs(window + stride, at, &taps.pixel[2], &taps.pixel[3]);
    taps.down += vf_from(lower);
#endif
    return taps;
}

/* Linear between table[i] and table[i + 1], at step i and a part. */
static FV_INLINE vf fv_table_at(const float *table, vf step)
{
    vf whole = vf_floor(step), rest = step - whole;
    vi i = vi_from(whole);
    vf low = vf_gather(table, i), high = vf_gather(table, i + 1);
    return low + (high - low) * rest;
}

#endif
