/* gaze_smooth: less noise in a gaze that rests, and none of the delay that smoothing costs where it moves.
 *
 * What is given out lies always between what was given out before and the newest measurement: it cannot pass
 * beyond either, so there is no overshoot where a saccade lands. A measurement further off than noise
 * explains, or one that moves faster than eyes do between saccades, is given out as it is: saccades are not
 * smoothed, from their first sample beyond the noise to their last. What follows is the mean of all since
 * then (each weighs as much as the others: a Kalman filter of a constant), until `settle_s` are in it, from
 * there on an exponential mean. In between the share of the newest grows with the square of its distance, so
 * that pursuit lags little. */
#ifndef FV_SENSORS_GAZE_SMOOTH_H
#define FV_SENSORS_GAZE_SMOOTH_H

#include <stdbool.h>
#include <stdint.h>

/* The caller's; all 0 at the start but for settle_s >= 0 (0: nothing is smoothed). */
struct fv_gaze_smooth {
    double settle_s;
    int samples; /* since the start or a gap, up to 3 */
    int64_t t_ns;
    double raw[2][2]; /* the newest measurement and the one before */
    double at[2];     /* given out */
    double share;     /* variance of that, as a share of a measurement's */
    double noise;     /* standard deviation of a measurement, an axis; learnt between movements */
    bool moving;      /* the newest sample was given out as it is */
};

/* Takes a measurement and writes what is given out, both any unit of which degrees are. Returns how far that
 * may be off the eye's true place by noise and lag. Times that do not grow change nothing; a gap of more than
 * 100 ms begins anew; numbers that are not finite give what was given before. */
double fv_gaze_smooth_add(struct fv_gaze_smooth *smooth, int64_t t_ns, const double raw[2], double out[2]);

/* The eye was lost: the next measurement begins anew. The noise stays known. */
void fv_gaze_smooth_lost(struct fv_gaze_smooth *smooth);

#endif
