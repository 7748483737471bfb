/* predict: where head and gaze will be some milliseconds after their newest samples: pure functions of
 * a short history, each a row of a const table; `foveola measure` shows their error against the horizon.
 *
 * A history is in the order of arrival; only its last 64 samples are looked at, from the last one back.
 * Those that are not good (tape.h) are passed over; the last good one is the newest, and of those before it
 * each counts that is earlier than all that have counted. A time before the newest sample counts as its own,
 * one more than FV_PREDICT_MAX_NS after it as just that. Where the samples give no velocity (one alone,
 * gaps, faster than a head or an eye) the newest sample is held. The result is always good.
 *
 * A head pose that comes again, the same to the bit, is the same reading logged again (logs whose rows
 * are the eye tracker's): it counts once, at the time when it came first, at most 50 ms before it came
 * last; where the newest has come for that long, the head rests. */
#ifndef FV_SENSORS_PREDICT_H
#define FV_SENSORS_PREDICT_H

#include "sensors/sensors.h"

#define FV_PREDICT_MAX_NS INT64_C(100000000)

/* No samples: the identity. */
struct fv_head_predictor {
    const char *name, *what; /* as in imu.predict; as in reports */
    void (*predict)(const struct fv_head_sample *history, int count, int64_t t_ns, struct fv_pose *head);
};

enum fv_head_predictor_kind {
    FV_PREDICT_HEAD_HOLD,  /* the newest sample */
    FV_PREDICT_HEAD_TWO,   /* goes on as between the last two samples */
    FV_PREDICT_HEAD_SLOPE, /* goes on at the least-squares slope of the last 20 ms */
    FV_PREDICT_HEAD_DECAY, /* the same, at a velocity that decays */
    FV_HEAD_PREDICTORS
};
extern const struct fv_head_predictor fv_head_predictors[FV_HEAD_PREDICTORS];

/* direction[eye]: unit, head space, in front of the face. No samples: straight ahead. */
struct fv_gaze_predictor {
    const char *name;
    void (*predict)(const struct fv_gaze_sample *history, int count, int64_t t_ns, double direction[2][3]);
};

enum fv_gaze_predictor_kind {
    FV_PREDICT_GAZE_HOLD,     /* the newest sample */
    FV_PREDICT_GAZE_VELOCITY, /* each eye goes on as between the last two samples */
    FV_GAZE_PREDICTORS
};
extern const struct fv_gaze_predictor fv_gaze_predictors[FV_GAZE_PREDICTORS];

/* Degrees a second that the eyes moved over the last 20 ms (the faster one; between the last two good samples
 * where no more lie within): what their noise explains, noise_deg >= 0, is no motion. At least 0; INFINITY
 * where no two samples lie within 50 ms. */
double fv_gaze_speed_deg_s(const struct fv_gaze_sample *history, int count, double noise_deg);

#endif
