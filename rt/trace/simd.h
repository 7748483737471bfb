/* simd: vectors of the width that this file's instruction set has: 16, 8 or 4 lanes.
 *
 * Kernels (*_kernel.c) are compiled once for each instruction set. The compiler's own vector
 * types carry the arithmetic; here is the little that they lack. A mask is a vi with -1 in the
 * lanes that count and 0 elsewhere. */
#ifndef FV_TRACE_SIMD_H
#define FV_TRACE_SIMD_H

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#if defined(__AVX512F__)
#define FV_WIDTH 16
#elif defined(__AVX2__)
#define FV_WIDTH 8
#else
#define FV_WIDTH 4
#endif
#if defined(__SSE2__)
#include <immintrin.h>
#elif defined(__ARM_NEON)
#include <arm_neon.h>
#endif

/* name_base, name_avx2, name_avx512: what a kernel file exports. FV_ISA comes from the build. */
#define FV_ISA_PASTE(name, isa) name##_##isa
#define FV_ISA_EXPAND(name, isa) FV_ISA_PASTE(name, isa)
#define FV_ISA_NAME(name) FV_ISA_EXPAND(name, FV_ISA)

/* Where a call would put a register file of vectors into memory and back. */
#define FV_INLINE inline __attribute__((always_inline))

typedef float vf __attribute__((vector_size(4 * FV_WIDTH)));
typedef int32_t vi __attribute__((vector_size(4 * FV_WIDTH)));
typedef uint32_t vu __attribute__((vector_size(4 * FV_WIDTH)));
typedef struct {
    vf x, y, z;
} vf3;

static inline vf vf_of(float s)
{
    return s - (vf){0};
}

static inline vi vi_of(int32_t s)
{
    return s - (vi){0};
}

static inline vf vf_load(const float *p)
{
    vf v;
    memcpy(&v, p, sizeof v);
    return v;
}

static inline vi vi_load(const void *p)
{
    vi v;
    memcpy(&v, p, sizeof v);
    return v;
}

static inline void vf_store(float *p, vf v)
{
    memcpy(p, &v, sizeof v);
}

static inline void vi_store(void *p, vi v)
{
    memcpy(p, &v, sizeof v);
}

static inline vf vf_select(vi mask, vf yes, vf no)
{
    return (vf)((mask & (vi)yes) | (~mask & (vi)no));
}

static inline vi vi_select(vi mask, vi yes, vi no)
{
    return (mask & yes) | (~mask & no);
}

/* As the hardware's: the second operand where the comparison is false or unordered, so that a
 * NaN in `a` gives `b`. */
static inline vf vf_min(vf a, vf b)
{
#if FV_WIDTH == 16
    return (vf)_mm512_min_ps((__m512)a, (__m512)b);
#elif FV_WIDTH == 8
    return (vf)_mm256_min_ps((__m256)a, (__m256)b);
#elif defined(__SSE2__)
    return (vf)_mm_min_ps((__m128)a, (__m128)b);
#else
    return vf_select(a < b, a, b);
#endif
}

static inline vf vf_max(vf a, vf b)
{
#if FV_WIDTH == 16
    return (vf)_mm512_max_ps((__m512)a, (__m512)b);
#elif FV_WIDTH == 8
    return (vf)_mm256_max_ps((__m256)a, (__m256)b);
#elif defined(__SSE2__)
    return (vf)_mm_max_ps((__m128)a, (__m128)b);
#else
    return vf_select(a > b, a, b);
#endif
}

/* a clamped to [low, high]; NaN gives low. */
static inline vf vf_clamp(vf a, float low, float high)
{
    return vf_min(vf_max(a, vf_of(low)), vf_of(high));
}

static inline vf vf_abs(vf a)
{
    return (vf)((vi)a & vi_of(0x7fffffff));
}

static inline vf vf_from(vi a)
{
    return __builtin_convertvector(a, vf);
}

/* Truncates; the argument must fit. */
static inline vi vi_from(vf a)
{
    return __builtin_convertvector(a, vi);
}

static inline vf vf_sqrt(vf a)
{
#if FV_WIDTH == 16
    return (vf)_mm512_sqrt_ps((__m512)a);
#elif FV_WIDTH == 8
    return (vf)_mm256_sqrt_ps((__m256)a);
#elif defined(__SSE2__)
    return (vf)_mm_sqrt_ps((__m128)a);
#else
    return (vf)vsqrtq_f32((float32x4_t)a);
#endif
}

/* 1 / sqrt(a) of a positive normal number, to 1e-6 relative: the hardware's estimate and one step of
 * Newton's. */
static inline vf vf_rsqrt(vf a)
{
#if FV_WIDTH == 16
    vf e = (vf)_mm512_rsqrt14_ps((__m512)a);
#elif FV_WIDTH == 8
    vf e = (vf)_mm256_rsqrt_ps((__m256)a);
#elif defined(__SSE2__)
    vf e = (vf)_mm_rsqrt_ps((__m128)a);
#else
    vf e = (vf)vrsqrteq_f32((float32x4_t)a);
    e = e * (1.5f - 0.5f * a * e * e);
#endif
    return e * (1.5f - 0.5f * a * e * e);
}

/* Of [0, inf), to 1e-6 relative and 1e-15: three times as fast as vf_sqrt. */
static inline vf vf_root(vf a)
{
    return a * vf_rsqrt(vf_max(a, vf_of(1e-30f)));
}

/* 1 / a of a positive number in [1e-30, 1e30], to 1e-6 relative. */
static inline vf vf_reciprocal(vf a)
{
#if FV_WIDTH == 16
    vf e = (vf)_mm512_rcp14_ps((__m512)a);
#elif FV_WIDTH == 8
    vf e = (vf)_mm256_rcp_ps((__m256)a);
#elif defined(__SSE2__)
    vf e = (vf)_mm_rcp_ps((__m128)a);
#else
    vf e = (vf)vrecpeq_f32((float32x4_t)a);
    e = e * (2.0f - a * e);
#endif
    return e * (2.0f - a * e);
}

static inline vf vf_floor(vf a)
{
#if FV_WIDTH == 16
    return (vf)_mm512_roundscale_ps((__m512)a, _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC);
#elif FV_WIDTH == 8
    return (vf)_mm256_floor_ps((__m256)a);
#elif defined(__SSE2__)
    return (vf)_mm_floor_ps((__m128)a);
#else
    return (vf)vrndmq_f32((float32x4_t)a);
#endif
}

/* One bit a lane, lane 0 lowest. */
static inline unsigned vi_bits(vi mask)
{
#if FV_WIDTH == 16
    return (unsigned)_mm512_movepi32_mask((__m512i)mask);
#elif FV_WIDTH == 8
    return (unsigned)_mm256_movemask_ps((__m256)mask);
#elif defined(__SSE2__)
    return (unsigned)_mm_movemask_ps((__m128)mask);
#else
    return (unsigned)(mask[0] & 1) | (unsigned)(mask[1] & 2) | (unsigned)(mask[2] & 4) | (unsigned)(mask[3] & 8);
#endif
}

static inline bool vi_any(vi mask)
{
    return vi_bits(mask) != 0;
}

/* base[index] in every lane. */
static inline vi vi_gather(const void *base, vi index)
{
#if FV_WIDTH == 16
    return (vi)_mm512_i32gather_epi32((__m512i)index, base, 4);
#elif FV_WIDTH == 8
    return (vi)_mm256_i32gather_epi32(base, (__m256i)index, 4);
#else
    const int32_t *p = base;
    return (vi){p[index[0]], p[index[1]], p[index[2]], p[index[3]]};
#endif
}

static inline vf vf_gather(const float *base, vi index)
{
    return (vf)vi_gather(base, index);
}

/* The lanes' indices as an array: cheaper to address by than to take out of the vector one by one. */
#define VI_INDICES(name, vector)                    \
    _Alignas(64) int32_t name[FV_WIDTH];            \
    vi_store(name, vector);                         \
    __asm__("" : : "r"(name) : "memory")

typedef int64_t texel_pair __attribute__((aligned(4), may_alias));

/* base[index] and base[index + 1] in every lane, each pair by one 8-byte load: a gather fetches one
 * word at a time whatever it costs, and twice as many of them. */
static inline void vi_gather_pairs(const uint32_t *base, vi index, vi *first, vi *second)
{
    VI_INDICES(at, index);
#define PAIR(lane) (*(const texel_pair *)(base + at[lane]))
    typedef int64_t pairs __attribute__((vector_size(4 * FV_WIDTH)));
#if FV_WIDTH == 16
    vi low = (vi)(pairs){PAIR(0), PAIR(1), PAIR(2), PAIR(3), PAIR(4), PAIR(5), PAIR(6), PAIR(7)};
    vi high = (vi)(pairs){PAIR(8), PAIR(9), PAIR(10), PAIR(11), PAIR(12), PAIR(13), PAIR(14), PAIR(15)};
    *first = __builtin_shufflevector(low, high, 0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
    *second = __builtin_shufflevector(low, high, 1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29, 31);
#elif FV_WIDTH == 8
    vi low = (vi)(pairs){PAIR(0), PAIR(1), PAIR(2), PAIR(3)}, high = (vi)(pairs){PAIR(4), PAIR(5), PAIR(6), PAIR(7)};
    *first = __builtin_shufflevector(low, high, 0, 2, 4, 6, 8, 10, 12, 14);
    *second = __builtin_shufflevector(low, high, 1, 3, 5, 7, 9, 11, 13, 15);
#else
    vi low = (vi)(pairs){PAIR(0), PAIR(1)}, high = (vi)(pairs){PAIR(2), PAIR(3)};
    *first = __builtin_shufflevector(low, high, 0, 2, 4, 6);
    *second = __builtin_shufflevector(low, high, 1, 3, 5, 7);
#endif
#undef PAIR
}

/* table[index], index in [0, 16): from registers where the instruction set can. */
static inline vi vi_table16(const uint32_t table[16], vi index)
{
#if FV_WIDTH == 16
    return (vi)_mm512_permutexvar_epi32((__m512i)index, _mm512_loadu_si512(table));
#elif FV_WIDTH == 8
    vi low = (vi)_mm256_permutevar8x32_epi32((__m256i)vi_load(table), (__m256i)index);
    vi high = (vi)_mm256_permutevar8x32_epi32((__m256i)vi_load(table + 8), (__m256i)index);
    return vi_select(index > 7, high, low);
#else
    return vi_gather(table, index);
#endif
}

#if FV_WIDTH > 4
/* The words that lie `index`, in [0, 2 FV_WIDTH), from the first of `low`; `high` goes on where it ends. */
static inline vi vi_pick(vi low, vi high, vi index)
{
#if FV_WIDTH == 16
    return (vi)_mm512_permutex2var_epi32((__m512i)low, (__m512i)index, (__m512i)high);
#else
    return vi_select(index > 7, (vi)_mm256_permutevar8x32_epi32((__m256i)high, (__m256i)index),
                     (vi)_mm256_permutevar8x32_epi32((__m256i)low, (__m256i)index));
#endif
}
#endif

/* Lanes of a and b in turn: of their first halves, and of their second ones. */
static inline vi vi_zip_first(vi a, vi b)
{
#if FV_WIDTH == 16
    return __builtin_shufflevector(a, b, 0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
#elif FV_WIDTH == 8
    return __builtin_shufflevector(a, b, 0, 8, 1, 9, 2, 10, 3, 11);
#else
    return __builtin_shufflevector(a, b, 0, 4, 1, 5);
#endif
}

static inline vi vi_zip_second(vi a, vi b)
{
#if FV_WIDTH == 16
    return __builtin_shufflevector(a, b, 8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31);
#elif FV_WIDTH == 8
    return __builtin_shufflevector(a, b, 4, 12, 5, 13, 6, 14, 7, 15);
#else
    return __builtin_shufflevector(a, b, 2, 6, 3, 7);
#endif
}

static inline vi vi_lanes(void)
{
#if FV_WIDTH == 16
    return (vi){0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
#elif FV_WIDTH == 8
    return (vi){0, 1, 2, 3, 4, 5, 6, 7};
#else
    return (vi){0, 1, 2, 3};
#endif
}

static inline vf vf_dot(vf3 a, vf3 b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static inline vf3 vf3_cross(vf3 a, vf3 b)
{
    return (vf3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

static inline vf3 vf3_scale(vf3 a, vf s)
{
    return (vf3){a.x * s, a.y * s, a.z * s};
}

static inline vf3 vf3_add(vf3 a, vf3 b)
{
    return (vf3){a.x + b.x, a.y + b.y, a.z + b.z};
}

static inline vf3 vf3_sub(vf3 a, vf3 b)
{
    return (vf3){a.x - b.x, a.y - b.y, a.z - b.z};
}

static inline vf3 vf3_select(vi mask, vf3 yes, vf3 no)
{
    return (vf3){vf_select(mask, yes.x, no.x), vf_select(mask, yes.y, no.y), vf_select(mask, yes.z, no.z)};
}

static inline vf3 vf3_of(const float s[3])
{
    return (vf3){vf_of(s[0]), vf_of(s[1]), vf_of(s[2])};
}

/* Unit length; a vector shorter than 1e-18 gives `otherwise`. */
static inline vf3 vf3_normalise(vf3 a, vf3 otherwise)
{
    vf n = vf_dot(a, a);
    vi good = (n > 1e-36f) & (n < 1e36f);
    return vf3_select(good, vf3_scale(a, vf_rsqrt(vf_max(n, vf_of(1e-36f)))), otherwise);
}

/* log2 of a positive normal number, to 1e-5 relative also where it is near 0, so that it can be multiplied
 * by a large exponent: minimax polynomial on the mantissa in [sqrt(1/2), sqrt(2)). */
static inline vf vf_log2(vf a)
{
    vi bits = (vi)a, e = (bits - 0x3f3504f3) >> 23;
    vf m = (vf)(bits - (e << 23)) - 1.0f;
    vf series = 0.479811855f + m * (-0.366491702f + m * (0.318199916f - m * 0.20619108f));
    return vf_from(e) + m * (1.44270162f + m * (-0.72120639f + m * series));
}

/* 2^a for a in [-126, 126], to 2e-4 relative. */
static inline vf vf_exp2(vf a)
{
    a = vf_clamp(a, -126, 126);
    vf whole = vf_floor(a);
    vf f = a - whole;
    vf m = 1.0f + f * (0.6951936f + f * (0.2276400f + f * 0.0771664f));
    return (vf)((vi)m + (vi_from(whole) << 23));
}

/* Sine and cosine of 2 pi a, a in [-1/2, 1/2], to 1e-6: an odd polynomial on a quarter turn, both ways. */
static inline vf vf_quarter_sine(vf a)
{
    vf q = a * a;
    return a * (6.28316757f + q * (-41.3375176f + q * (81.3516778f - q * 71.0873582f)));
}

static inline void vf_turn(vf a, vf *sine, vf *cosine)
{
    vf size = vf_abs(a), folded = vf_min(size, 0.5f - size);
    *sine = vf_quarter_sine(vf_select(a < 0.0f, -folded, folded));
    *cosine = vf_quarter_sine(0.25f - size);
}

/* The greatest, and the least, of the lanes; no NaN. */
static inline float vf_most(vf a)
{
#if FV_WIDTH == 16
    return _mm512_reduce_max_ps((__m512)a);
#else
    float most = a[0];
    for (int i = 1; i < FV_WIDTH; i++) most = a[i] > most ? a[i] : most;
    return most;
#endif
}

static inline float vf_least(vf a)
{
    return -vf_most(-a);
}

#endif
