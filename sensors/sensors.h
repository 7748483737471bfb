/* sensors: what the frame loop latches: a head pose and a gaze, each for a given time.
 *
 * A source is a row of a const table: {name, open, sample}. The loop cannot tell simulated,
 * taped and real ones apart. Simulated sources are pure functions of time and seed. */
#ifndef FV_SENSORS_SENSORS_H
#define FV_SENSORS_SENSORS_H

#include "config/config.h"
#include "platform/pose.h"

#include <stdbool.h>
#include <stdint.h>

/* Head: pose of the point between the eyes, relative to where the viewer stands and looks
 * straight ahead (the identity). Session time, 0 at the first frame. */
struct fv_head_sample {
    int64_t t_ns;
    struct fv_pose pose;
};

/* Eyes: where each looks, as unit vectors in head space (x right, y up, -z ahead), left then
 * right. Not valid: the eye was lost (blink, no pupil), directions are meaningless. */
struct fv_gaze_sample {
    int64_t t_ns;
    double direction[2][3];
    bool valid;
};

/* What the loop gets: gaze after holding, with its uncertainty. */
struct fv_gaze {
    int64_t t_ns;
    double direction[2][3];
    double uncertainty_deg;
    bool held; /* the newest sample was lost: this is an older one, or the centre */
};

struct fv_sensors; /* opaque, in the arena */

/* Samples latched; of these, gazes lost and poses rejected. Rows that were rejected when a tape was
 * read count as lost or rejected too. Sources "none" give no samples. */
struct fv_sensors_counts {
    int64_t gaze_samples, gaze_lost, imu_samples, imu_rejected;
};

/* Opens the sources that the settings name: eye.source and imu.source; tapes are read whole, into
 * the arena. Returns 0, or -1 with the error set (file:line). */
int fv_sensors_open(struct fv_sensors **sensors, const struct fv_config *config, struct fv_error *error);

/* Pose and gaze for a session time, t_ns growing from call to call. Head samples between two
 * readings are interpolated (slerp); past a tape's end the tape starts again. A lost gaze is
 * held up to eye.hold_ms, then goes to the centre in a smooth move, its uncertainty growing
 * meanwhile. Never NaN: samples that are not finite or not unit length (to 1e-3), or a gaze that is
 * not in front of the face, are rejected and counted. */
void fv_sensors_latch(struct fv_sensors *sensors, int64_t t_ns, struct fv_pose *head, struct fv_gaze *gaze);

struct fv_sensors_counts fv_sensors_counts(const struct fv_sensors *sensors);

/* The tapes that the sources read (tape.h); NULL where the source is no tape. */
struct fv_tape;
const struct fv_tape *fv_sensors_eye_tape(const struct fv_sensors *sensors);
const struct fv_tape *fv_sensors_imu_tape(const struct fv_sensors *sensors);

/* The simulated sources, for tests and for making tapes: pure functions of seed and time. */
void fv_sim_head(uint64_t seed, int64_t t_ns, struct fv_pose *head);
void fv_sim_gaze(uint64_t seed, int64_t t_ns, struct fv_gaze_sample *gaze);

#endif
