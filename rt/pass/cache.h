/* cache: what a pixel keeps beside its colour, in 32 bits: its inverse depth, how many samples its colour is
 * worth, and the frames since the last of them (the cache info of Weier et al. 2016, section 3.4; Yang et al.
 * 2009). alpha is not kept: it follows from the other two.
 *
 * Bits 16-31: inverse depth, 1/m, [0, FV_INVERSE_DEPTH_MAX]: a float's bits 15 to 30, rounded, so good to
 *             1/512. FV_CACHE_NONE >> 16, which is no number: not known, and no history either.
 * Bits 8-15:  rho, 0 to 255; 0: filled from the support image.
 * Bit 7:      the pixel shows what moves: it is no history for what stands still, and the other way round.
 * Bits 0-6:   age: frames since the pixel was sampled, at most FV_CACHE_OLDEST. */
#ifndef FV_PASS_CACHE_H
#define FV_PASS_CACHE_H

#include "rt/trace/simd.h"
#include "rt/trace/tracer.h"

#define FV_CACHE_NONE 0xffff0000u
enum { FV_CACHE_OLDEST = 127, FV_CACHE_MOVING = 128 };

/* NaN where there is none. */
static inline vf cache_depth(vi cache)
{
    return (vf)((cache >> 1) & 0x7fff8000);
}

/* Mask: there is none. */
static inline vi cache_none(vi cache)
{
    return (cache >> 16) == -1;
}

/* Of one word; FV_DEPTH_UNKNOWN where there is none. */
static inline float cache_depth_of(uint32_t cache)
{
    uint32_t bits = cache >> 1 & 0x7fff8000;
    float w;
    memcpy(&w, &bits, sizeof w);
    return cache < FV_CACHE_NONE ? w : FV_DEPTH_UNKNOWN;
}

/* Of inverse depths in range or FV_DEPTH_UNKNOWN. */
static inline vi cache_of_depth(vf w)
{
    vi known = w >= 0.0f;
    return vi_select(known, (((vi)w + 0x4000) << 1) & (int32_t)0xffff0000, vi_of((int32_t)FV_CACHE_NONE));
}

/* Of a sample alone (struct fv_samples). */
static inline uint32_t cache_of_sample(float w, int32_t surface)
{
    uint32_t bits;
    memcpy(&bits, &w, sizeof bits);
    uint32_t depth = w >= 0 ? (bits + 0x4000) << 1 & 0xffff0000u : FV_CACHE_NONE;
    return depth | 1 << 8 | (surface & FV_SURFACE_OBJECT ? FV_CACHE_MOVING : 0);
}

static inline vi cache_rho(vi cache)
{
    return (cache >> 8) & 255;
}

static inline vi cache_age(vi cache)
{
    return cache & FV_CACHE_OLDEST;
}

/* rho, age and whether it moves, of the same pixel a frame later. */
static inline vi cache_older(vi cache)
{
    return (cache & 0xffff) + ((cache_age(cache) < FV_CACHE_OLDEST) & 1);
}

#endif
