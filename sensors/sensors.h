/* sensors: what the frame loop latches: a head pose and a gaze, each for the time at which it is shown.
 *
 * A source is a row of a const table: {name, open, sample, history}. The loop cannot tell simulated,
 * taped and real ones apart. Simulated sources are pure functions of time and seed. */
#ifndef FV_SENSORS_SENSORS_H
#define FV_SENSORS_SENSORS_H

#include "config/config.h"
#include "platform/pose.h"
#include "platform/spool.h"

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
    double uncertainty_deg; /* as the source knows it; 0: it does not say, eye.noise_deg holds */
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
 * read count as lost or rejected too, and so do a device's samples and reports that were refused. Sources "none" give
 * no samples. Of a device: samples that by its clock must have been there and never came, and how often it came again. */
struct fv_sensors_counts {
    int64_t gaze_samples, gaze_lost, imu_samples, imu_rejected;
    int64_t imu_readings, imu_lost, imu_reconnects; /* of a device */
    struct fv_imu_insane {      /* of its samples; fusion.h and devices.h say more */
        int64_t repeated;       /* not later than the one before, by its clock */
        int64_t clock_restarts; /* its clock began anew, or jumped */
        int64_t mistimed, bad, stuck, saturated;
    } imu;
    struct fv_eye_camera_counts {
        int cameras; /* real ones; 0: all else is 0 */
        int64_t frames, skipped, gaps, rejected, untimed, errors, lost, restarts; /* of all together; v4l2.h */
        int64_t no_pupil, unsure, blinks;        /* watch.h */
        double latency_ms_mean, latency_ms_most; /* from a frame in memory to its gaze */
    } camera;
};

/* Opens the sources that the settings name: eye.source and imu.source; tapes are read whole, into
 * the arena; devices are opened, and read by a thread each from then on. Returns 0, or -1 with the error set
 * (file:line). */
int fv_sensors_open(struct fv_sensors **sensors, const struct fv_config *config, struct fv_error *error);

/* Pose and gaze for showing at the session time show_ns, from what is known at now_ns (taken as show_ns
 * where it is later); both grow from call to call.
 *
 * now_ns < show_ns: no sample later than now_ns is used. Simulated sources are read at a device's rate,
 * tapes at their own rows, raw tapes of an inertial sensor as the device was; before the first there is none. The head is predicted from there to show_ns
 * (imu.predict), at most FV_PREDICT_MAX_NS. The gaze is the newest one; its uncertainty grows by
 * what it may have moved between its sample and show_ns: its speed (fv_gaze_speed_deg_s), at most that of
 * the fastest pursuit, 100 degrees a second (Meyer, Lasker and Robinson 1985), for anything faster is a
 * saccade, during which little is seen.
 *
 * now_ns = show_ns: simulated sources are sampled at that time, head poses of a tape interpolated between
 * its rows (slerp).
 *
 * A device (imu.source usb) gives what it knows when it is asked, moved on by what now_ns is before show_ns and by its
 * samples' age. While it is lost the last pose is held, each latch counted as rejected.
 *
 * Past a tape's end the tape starts again. A lost gaze is held up to eye.hold_ms, then goes to the centre
 * in a smooth move, its uncertainty growing meanwhile. Never NaN: samples that are not finite or not unit
 * length (to 1e-3), or a gaze that is not in front of the face, are rejected and counted. */
void fv_sensors_latch(struct fv_sensors *sensors, int64_t now_ns, int64_t show_ns, struct fv_pose *head,
                      struct fv_gaze *gaze);

struct fv_sensors_counts fv_sensors_counts(const struct fv_sensors *sensors);

/* Records what devices give into the folder, until the end, which comes when they are closed and `spooler` is stopped; it
 * is not started yet. raw: every raw sample, of the inertial sensor (sensors/imu/imu_tape.h) and of the eyes
 * (sensors/eye/eye_tape.h). frames: the eye cameras' frames. Nothing where there are no devices. 0, or -1 with the error
 * set; at the end, with why a recording is not whole. */
int fv_sensors_record(struct fv_sensors *sensors, const char *folder, bool raw, bool frames, struct fv_spooler *spooler,
                      struct fv_error *error);
int fv_sensors_record_end(struct fv_sensors *sensors, struct fv_error *error);

/* Gives devices back to the system; nothing is latched any more. */
void fv_sensors_close(struct fv_sensors *sensors);

/* The tapes that the sources read (tape.h); NULL where the source is no tape. */
struct fv_tape;
const struct fv_tape *fv_sensors_eye_tape(const struct fv_sensors *sensors);
const struct fv_tape *fv_sensors_imu_tape(const struct fv_sensors *sensors);

/* The simulated sources, for tests and for making tapes: pure functions of seed and time. */
void fv_sim_head(uint64_t seed, int64_t t_ns, struct fv_pose *head);
void fv_sim_gaze(uint64_t seed, int64_t t_ns, struct fv_gaze_sample *gaze);

#endif
