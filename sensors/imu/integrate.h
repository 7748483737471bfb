/* integrate: orientation from the samples of a gyroscope. Three methods, from the cheapest to the one
 * that is exact where the rate is constant; `foveola measure` shows what each costs and errs.
 *
 * q' = q w / 2, with q turning device coordinates into world ones and w the angular rate in device axes.
 * Euler and the midpoint rule: Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I,
 * section II.1; rotation by the mean rate: Sola 2017, Quaternion kinematics, section 4.6. */
#ifndef FV_SENSORS_IMU_INTEGRATE_H
#define FV_SENSORS_IMU_INTEGRATE_H

#include <stdint.h>

/* Faster is no reading of a headset's gyroscope (whose full scale is 35 to 70 rad/s). */
#define FV_RATE_MAX_RAD_S 100.0

/* Over a longer time without a good sample nothing is known of the motion. */
#define FV_RATE_GAP_S 1.0

/* The caller's: begun by fv_attitude_begin, advanced by fv_attitude_add. */
struct fv_attitude {
    double rotation[4]; /* w x y z, unit: device to world */
    double rate[3];     /* of the last good sample, rad/s, device axes */
    double missing_s;   /* time since that sample, covered by rejected ones */
    int64_t samples, rejected, gaps;
};

/* Advances a unit quaternion by dt_s in [0, FV_RATE_GAP_S], over which the rate went from `before` to
 * `now` (rad/s, finite); the result is of unit length. */
struct fv_integrator {
    const char *name;
    void (*step)(double rotation[4], const double before[3], const double now[3], double dt_s);
};

enum fv_integrator_kind {
    FV_INTEGRATE_EULER,    /* one step by the newest rate, renormalised: first order */
    FV_INTEGRATE_MIDPOINT, /* two-stage Runge-Kutta on the quaternion, renormalised: second order */
    FV_INTEGRATE_EXACT,    /* rotation by the mean of the two rates: second order, exact about a fixed axis
                              where the rate is linear in time */
    FV_INTEGRATORS
};
extern const struct fv_integrator fv_integrators[FV_INTEGRATORS];

/* Begins at a rotation (NULL or of no length: the identity), with the rate at that moment (NULL or not
 * good: at rest). */
void fv_attitude_begin(struct fv_attitude *attitude, const double rotation[4], const double rate_rad_s[3]);

/* Takes a sample: the rate at its time, and the time since the sample before, good or bad. Never fails:
 *   rate not finite, or above FV_RATE_MAX_RAD_S   rejected: the rotation is held; its time is added to
 *                                                 the next good sample's, so that no angle is lost
 *   dt_s not finite or <= 0                       rejected, as a repeated or mistimed sample; no time passes
 *   more than FV_RATE_GAP_S since the last good   a gap: the rotation is held, the motion begins anew with
 *                                                 this rate */
void fv_attitude_add(const struct fv_integrator *integrator, struct fv_attitude *attitude,
                     const double rate_rad_s[3], double dt_s);

#endif
