/* random: reproducible random inputs, for C and C++. For tests only. */
#ifndef FV_TESTS_RANDOM_H
#define FV_TESTS_RANDOM_H

#include <math.h>
#include <stdint.h>

/* Splitmix64 (Steele, Lea and Flood 2014). Any start value will do. */
static inline uint64_t random_bits(uint64_t *state)
{
    uint64_t z = *state += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

/* In [low, high). */
static inline double random_between(uint64_t *state, double low, double high)
{
    return low + (high - low) * ((double)(random_bits(state) >> 11) * 0x1p-53);
}

/* As likely in each decade from low to high; both > 0. */
static inline double random_decade(uint64_t *state, double low, double high)
{
    return exp(random_between(state, log(low), log(high)));
}

/* Evenly over the unit sphere: z and longitude are even (Archimedes). */
static inline void random_direction(uint64_t *state, double out[3])
{
    double z = random_between(state, -1, 1), longitude = random_between(state, 0, 6.283185307179586);
    double across = sqrt(1 - z * z);
    out[0] = across * cos(longitude);
    out[1] = across * sin(longitude);
    out[2] = z;
}

/* A unit quaternion, evenly over all rotations (Shoemake 1992). */
static inline void random_rotation(uint64_t *state, double out[4])
{
    double u = random_between(state, 0, 1), a = random_between(state, 0, 6.283185307179586);
    double b = random_between(state, 0, 6.283185307179586);
    out[0] = sqrt(1 - u) * cos(a);
    out[1] = sqrt(1 - u) * sin(a);
    out[2] = sqrt(u) * cos(b);
    out[3] = sqrt(u) * sin(b);
}

#endif
