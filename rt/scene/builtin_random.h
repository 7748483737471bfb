/* builtin_random: the numbers that built-in scenes are varied by: the same on every machine.
 *
 * One draw a statement: which argument of a call comes first is the compiler's choice, and the
 * scene must not be. */
#ifndef FV_SCENE_BUILTIN_RANDOM_H
#define FV_SCENE_BUILTIN_RANDOM_H

#include <stdint.h>

/* xorshift (Marsaglia 2003). A state is any number but 0; it gives 32 bits. */
static inline uint32_t fv_random_bits(uint32_t *state)
{
    *state ^= *state << 13;
    *state ^= *state >> 17;
    *state ^= *state << 5;
    return *state;
}

static inline float fv_random_between(uint32_t *state, float low, float high)
{
    return low + (high - low) * (float)(fv_random_bits(state) >> 8) * 0x1p-24f;
}

/* 0 to count - 1; count > 0. */
static inline int fv_random_below(uint32_t *state, int count)
{
    return (int)((uint64_t)fv_random_bits(state) * (uint32_t)count >> 32);
}

/* A stream of its own for the n-th of things that look alike. */
static inline uint32_t fv_random_stream(int n)
{
    uint32_t state = 2654435769u * (uint32_t)(n + 1) | 1;
    fv_random_bits(&state);
    fv_random_bits(&state);
    return state;
}

#endif
