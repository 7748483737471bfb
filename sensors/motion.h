/* motion: what simulated heads and eyes are made of. Pure functions of a seed and a time, each
 * evaluated in bounded time wherever it is asked: hashed numbers take the place of a generator's
 * state. Used by eye/sim.c and imu/sim.c; minimum-jerk moves also by sensors.c. */
#ifndef FV_SENSORS_MOTION_H
#define FV_SENSORS_MOTION_H

#include <stdint.h>

/* Times are taken as at most this far from 0 (146 years), so that nothing below overflows. */
#define FV_MOTION_LIMIT_NS (INT64_C(1) << 62)

/* Streams of hashed numbers; each sensor's own, so that one seed gives independent motions. */
enum fv_motion_stream {
    FV_MOTION_YAW,
    FV_MOTION_PITCH,
    FV_MOTION_ROLL,
    FV_MOTION_SWAY = 10,
    FV_MOTION_GAZE = 20,
    FV_MOTION_DRIFT = 40,
    FV_MOTION_BLINK = 50
};

/* A number in [0, 1) for the index-th event of a stream (splitmix64: Steele, Lea and Flood 2014). */
double fv_motion_uniform(uint64_t seed, int stream, int64_t index);

/* Which period of `length_ns` > 0 the time lies in, rounded down, and how far into it. */
int64_t fv_motion_epoch(int64_t t_ns, int64_t length_ns, int64_t *into_ns);

/* Fraction of the way at fraction s of the time, rest to rest: 10 s^3 - 15 s^4 + 6 s^5 (Flash and
 * Hogan 1985). 0 below 0 and 1 above 1. Its greatest slope is 1.875, at 1/2. */
double fv_motion_minimum_jerk(double s);

/* Band-limited noise of root mean square 1: sines from low_hz to high_hz (> 0) whose amplitude falls
 * with 1/f, as a random walk's does. Absolute value below 4. */
double fv_motion_noise(uint64_t seed, int stream, int64_t t_ns, double low_hz, double high_hz);

#endif
