/* look_feed: where the looks of a calibration come from: cameras (eye.source=v4l2), simulated ones, whose
 * eyes look at the targets, or recorded frames with the log of targets beside them. Each frame goes through
 * the tracker, by its model: an older calibration (eye.calibration) plays no part.
 *
 * Frames and log can be recorded as they come; played from the tape they give the same looks again. */
#ifndef FV_SENSORS_LOOK_FEED_H
#define FV_SENSORS_LOOK_FEED_H

#include "config/config.h"
#include "sensors/eye/calibrator.h"
#include "sensors/eye/frame_tape.h"
#include "sensors/eye/image_sim.h"
#include "sensors/eye/watch.h"

struct fv_look_feed {
    int eyes, width, height; /* of the frames */
    struct fv_eye_settings eye[2];
    struct fv_calibrator *calibrator; /* to whom looks go */
    struct fv_watch *watch;           /* cameras; NULL: others */
    struct fv_frame_recorder *recorder;
    struct fv_eye_tracker tracker[2]; /* of the others */
    uint8_t *grey;
    /* Simulated eyes. */
    bool simulated;
    uint64_t seed;
    struct fv_eye_camera camera[2];
    int64_t period_ns, next, now_ns; /* next: number of the frame that comes next */
    int64_t since_ns;                /* when the target that they look at appeared */
    double from_deg[2], to_deg[2];
    struct fv_writer *tape_out; /* [2]; NULL: not recorded */
    /* Recorded ones. */
    bool recorded;
    struct fv_frame_tape tape[2];
    int rows;
    struct fv_target_shown shown[FV_SHOWN_MAX];
};

/* Opens what eye.source says. Memory from the arena ("sensors"). 0, or -1 with the error set. */
int fv_look_feed_open(struct fv_look_feed *feed, const struct fv_config *config, struct fv_error *error);

/* The same for cameras with given settings, behind `io`. */
int fv_look_feed_watch(struct fv_look_feed *feed, const struct fv_watch_settings *settings,
                       const struct fv_camera_io *io, struct fv_error *error);

/* Records frames into folder/left.frames and, of two eyes, right.frames, before any is taken. 0, or -1 with
 * the error set. */
int fv_look_feed_record(struct fv_look_feed *feed, const char *folder, struct fv_error *error);

/* What the frames' clock says. */
int64_t fv_look_feed_now_ns(const struct fv_look_feed *feed);

/* A target has appeared: simulated eyes will look at it. */
void fv_look_feed_target(struct fv_look_feed *feed, const struct fv_target_shown *shown);

/* Takes the frames that come until then; cameras are waited for. */
void fv_look_feed_until(struct fv_look_feed *feed, int64_t t_ns);

/* Takes all recorded frames, after the log of targets was given to the calibrator. */
void fv_look_feed_play(struct fv_look_feed *feed);

/* Ends. 0, or -1 with why the recording is not whole. */
int fv_look_feed_close(struct fv_look_feed *feed, struct fv_error *error);

#endif
