/* motion: see motion.h. */
#include "sensors/motion.h"

#include <math.h>

enum { SINES = 6 };

static const uint64_t golden = 0x9e3779b97f4a7c15u;

static uint64_t mix(uint64_t z)
{
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

double fv_motion_uniform(uint64_t seed, int stream, int64_t index)
{
    uint64_t state = mix(seed + golden * (uint64_t)(stream + 1));
    return (double)(mix(state + golden * (uint64_t)index) >> 11) * 0x1p-53;
}

int64_t fv_motion_epoch(int64_t t_ns, int64_t length_ns, int64_t *into_ns)
{
    if (t_ns > FV_MOTION_LIMIT_NS) t_ns = FV_MOTION_LIMIT_NS;
    if (t_ns < -FV_MOTION_LIMIT_NS) t_ns = -FV_MOTION_LIMIT_NS;
    int64_t epoch = t_ns / length_ns;
    if (t_ns % length_ns < 0) epoch--;
    *into_ns = t_ns - epoch * length_ns;
    return epoch;
}

double fv_motion_minimum_jerk(double s)
{
    if (!(s > 0)) return 0;
    if (s >= 1) return 1;
    return s * s * s * (10 + s * (6 * s - 15));
}

double fv_motion_noise(uint64_t seed, int stream, int64_t t_ns, double low_hz, double high_hz)
{
    double sum = 0, power = 0, octaves = log2(high_hz / low_hz);
    for (int i = 0; i < SINES; i++) {
        double place = (i + fv_motion_uniform(seed, stream, 2 * i)) / SINES;
        double hz = low_hz * exp2(octaves * place), amplitude = low_hz / hz;
        double turns = hz * ((double)t_ns * 1e-9) + fv_motion_uniform(seed, stream, 2 * i + 1);
        sum += amplitude * sin(2 * M_PI * (turns - floor(turns)));
        power += 0.5 * amplitude * amplitude;
    }
    return sum / sqrt(power);
}
