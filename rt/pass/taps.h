/* taps: bilinear lookups in an 8-bit picture (r, g, b, unused) by kernels; and tables over steps. */
#ifndef FV_PASS_TAPS_H
#define FV_PASS_TAPS_H

#include "rt/trace/simd.h"

/* The four pixels around places in a picture, two above two, and the place between them, 0 to 1. */
struct fv_taps {
    vi pixel[4];
    vf right, down;
};

/* Beyond the picture's border, the pixels there. At least 2 x 2 pixels; no NaN. */
static FV_INLINE struct fv_taps fv_taps_at(const uint32_t *picture, int stride, int width, int height, vf px, vf py)
{
    struct fv_taps taps;
    vf x = vf_clamp(px - 0.5f, 0, (float)(width - 1)), y = vf_clamp(py - 0.5f, 0, (float)(height - 1));
    vf x0 = vf_min(vf_floor(x), vf_of((float)(width - 2))), y0 = vf_min(vf_floor(y), vf_of((float)(height - 2)));
    vi at = vi_from(y0) * stride + vi_from(x0);
    vi_gather_pairs(picture, at, &taps.pixel[0], &taps.pixel[1]);
    vi_gather_pairs(picture + stride, at, &taps.pixel[2], &taps.pixel[3]);
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

/* Linear between table[i] and table[i + 1], at step i and a part. */
static FV_INLINE vf fv_table_at(const float *table, vf step)
{
    vf whole = vf_floor(step), rest = step - whole;
    vi i = vi_from(whole);
    vf low = vf_gather(table, i), high = vf_gather(table, i + 1);
    return low + (high - low) * rest;
}

#endif
