/* simd16: what kernels on 8- and 16-bit values want beyond simd.h: two 16-bit values in each 32-bit lane. */
#ifndef FV_TRACE_SIMD16_H
#define FV_TRACE_SIMD16_H

#include "rt/trace/simd.h"

typedef uint16_t vw __attribute__((vector_size(4 * FV_WIDTH)));

/* Squares of both, of 0 to 255 each. */
static inline vi vi_squares(vi a)
{
    return (vi)((vw)a * (vw)a);
}

/* The products of both, signed, added up in each lane; wraps only where all four are -32768. */
static inline vi vi_dot_pairs(vi a, vi b)
{
#if FV_WIDTH == 16
    return (vi)_mm512_madd_epi16((__m512i)a, (__m512i)b);
#elif FV_WIDTH == 8
    return (vi)_mm256_madd_epi16((__m256i)a, (__m256i)b);
#elif defined(__SSE2__)
    return (vi)_mm_madd_epi16((__m128i)a, (__m128i)b);
#else
    return ((vi)((vu)a << 16) >> 16) * ((vi)((vu)b << 16) >> 16) + (a >> 16) * (b >> 16);
#endif
}

/* sqrt(a) of a positive normal number, to 4e-4 relative: the hardware's estimate, and where that is a poorer one, one
 * step of Newton's. */
static inline vf vf_root_about(vf a)
{
#if FV_WIDTH == 16
    return a * (vf)_mm512_rsqrt14_ps((__m512)a);
#elif FV_WIDTH == 8
    return a * (vf)_mm256_rsqrt_ps((__m256)a);
#elif defined(__SSE2__)
    return a * (vf)_mm_rsqrt_ps((__m128)a);
#else
    vf e = (vf)vrsqrteq_f32((float32x4_t)a);
    return a * e * (1.5f - 0.5f * a * e * e);
#endif
}

#endif
