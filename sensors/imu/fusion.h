/* fusion: the head's orientation from gyroscope and accelerometer, in the class of VQF: D. Laidig and T. Seel,
 * VQF: Highly accurate IMU orientation estimation with bias estimation and magnetic disturbance rejection,
 * Information Fusion 91 (2023), 187-204; the sections below are its.
 *
 *   section 3.2  rates, less their bias, are integrated exactly (integrate.h), which gives a frame that hardly
 *                turns; in that frame the accelerometer is low-passed, so that what the head does cancels and
 *                gravity stays; a second rotation tilts that frame so that gravity points down
 *   section 3.4  the speed at which the tilt must be corrected shows the bias: a Kalman filter of three
 *                states learns it while the head moves, and from the gyroscope itself while it rests
 *
 * There is no magnetometer: the heading is the integrated one, and only resting tells its drift. All times are
 * measured ones. Nothing is allocated, nothing fails: insane samples are decided here, and counted. */
#ifndef FV_SENSORS_IMU_FUSION_H
#define FV_SENSORS_IMU_FUSION_H

#include "sensors/imu/lowpass.h"

#include <stdbool.h>
#include <stdint.h>

/* Times, rates and uncertainties, all > 0. The usual ones are those of the publication (section 4.2) but for the
 * first two. A gyroscope errs by a part that stays, its bias, and by one that grows with the rate: its scale and
 * its axes are not exact. The faster the head has turned, the sooner must the accelerometer be believed: so the
 * time of the low-pass is tilt_s at rest and half as long at a mean speed of turn_rate (over the last tilt_s).
 * The published constant 3 s is what that gives at 130 degrees a second. */
struct fv_fusion_settings {
    double tilt_s;          /* of the accelerometer's low-pass */
    double turn_rate;       /* rad/s; INFINITY: the low-pass does not depend on it */
    double bias_start;      /* what a bias may be at first, standard deviation, rad/s */
    double bias_forget_s;   /* in which an exact bias becomes uncertain by 0.1 deg/s */
    double bias_max;        /* rad/s, each axis: more is motion */
    double bias_motion;     /* uncertainty that motion leads to, rad/s */
    double bias_vertical;   /* weight of the assumption that the vertical bias is 0, so that it stays bounded */
    double bias_rest;       /* uncertainty that rest leads to, rad/s */
    double rest_s;          /* quiet for so long is rest */
    double rest_filter_s;   /* of the low-passes that tell what is quiet */
    double rest_rate, rest_acc; /* deviations from them that are quiet, rad/s and m/s^2 */
    double rate_full, acc_full; /* full scales, rad/s and m/s^2: at them a reading is saturated; INFINITY: none */
};
extern const struct fv_fusion_settings fv_fusion_usual;

/* Samples, and those of them that were insane, each counted once, by the first that holds:
 *   mistimed   dt not finite or <= 0: a repeated or late sample; dropped, no time passes
 *   bad        rate not finite or above FV_RATE_MAX_RAD_S; dropped, its time is added to the next good one's
 *   stuck      rate and acceleration the same to the bit for FV_FUSION_STUCK_S and 16 samples: no sensor is so
 *              quiet; dropped, the rotation is held until one differs
 *   gaps       more than FV_RATE_GAP_S since the last good one: the rotation is held, the accelerometer's mean
 *              begins anew, with what it held as a quarter of a second of it
 *   saturated  a rate at full scale: integrated, for nothing better is known, but no bias is learnt from it
 *   no_down    acceleration not finite, at full scale, or in free fall (under FV_FUSION_FALL): it says nothing of
 *              where down is; the rate is integrated */
struct fv_fusion_counts {
    int64_t samples, mistimed, bad, stuck, gaps, saturated, no_down;
};

#define FV_FUSION_STUCK_S 0.1
#define FV_FUSION_FALL 1.0 /* m/s^2, a tenth of gravity */

/* The caller's: begun by fv_fusion_begin. */
struct fv_fusion {
    struct fv_fusion_settings settings;
    struct fv_fusion_counts counts;
    double turned[4], tilt[4];    /* device to the frame that hardly turns; that to the world */
    double rotation[4];           /* device to world, unit: tilt turned */
    double rate[3];               /* newest good one less bias, rad/s, device axes; 0 while stuck */
    double bias[3], spread[3][3]; /* of the bias, (rad/s)^2 */
    double speed;                 /* mean of the last tilt_s, rad/s */
    bool resting, begun;
    double last_rate[3], last_acc[3]; /* as given */
    double missing_s, quiet_s, same_s;
    int same;
    struct fv_lowpass_clock down_clock, rest_clock;
    struct fv_lowpass down[3], axes[3][3], level[2]; /* acceleration; the rows of the device's axes; the bias along x, z */
    struct fv_lowpass rest_rate[3], rest_acc[3];
};

/* Begins at the identity; the first acceleration tilts it. settings NULL: the usual ones. */
void fv_fusion_begin(struct fv_fusion *fusion, const struct fv_fusion_settings *settings);

/* Takes a sample: angular rate rad/s and specific force m/s^2 (at rest g upwards), device axes, and the
 * time since the sample before, good or bad. World: y up; heading free. */
void fv_fusion_add(struct fv_fusion *fusion, const double rate_rad_s[3], const double acc_m_s2[3], double dt_s);

/* The rotation `ahead_s` after the newest sample at a constant rate: at most FV_FUSION_AHEAD_S, and not at all where the
 * rate is not known. Unit length. */
#define FV_FUSION_AHEAD_S 0.1
void fv_fusion_predict(const struct fv_fusion *fusion, double ahead_s, double rotation[4]);

/* The same from what was copied of a fusion: its rotation and its rate, `ahead_s` after the sample that they are of. */
void fv_fusion_turn(const double rotation[4], const double rate[3], double ahead_s, double turned[4]);

#endif
