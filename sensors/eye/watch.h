/* watch: one or two eye cameras, watched by a thread of their own, which turns their frames into gaze
 * samples.
 *
 * The thread waits for frames of all cameras, takes the newest of each, tracks, combines (binocular.h) and
 * puts the newest samples into a mailbox; the frame loop reads it and never waits. A camera that is lost is
 * said once and looked for in between; the other goes on alone. */
#ifndef FV_SENSORS_WATCH_H
#define FV_SENSORS_WATCH_H

#include "platform/mailbox.h"
#include "sensors/eye/binocular.h"
#include "sensors/eye/eye_tape.h"
#include "sensors/eye/frame_recorder.h"
#include "sensors/eye/v4l2.h"

#include <pthread.h>
#include <stdatomic.h>

enum { FV_WATCH_CAMERAS = 2, FV_WATCH_HISTORY = 8 };

/* camera[0] sees the left eye, or the only one that is seen. */
struct fv_watch_settings {
    int cameras; /* 1 or 2 */
    struct fv_camera_settings camera[FV_WATCH_CAMERAS];
    struct fv_eye_settings eye[FV_WATCH_CAMERAS];
    double settle_s;
};

/* What the loop reads. */
struct fv_watch_news {
    int samples; /* in the list, the newest last; CLOCK_MONOTONIC */
    struct fv_gaze_sample sample[FV_WATCH_HISTORY];
};

/* From a frame taken to its sample in the mailbox. */
struct fv_watch_latency {
    int64_t frames, sum_ns, most_ns;
};

/* Frames, of all cameras together, that told no gaze, and how often the eyes were lost to sight. */
struct fv_watch_unseen {
    int64_t no_pupil; /* nothing in them is a pupil: lids closed, headset off */
    int64_t unsure;   /* a pupil that is less certain than the settings ask, or much narrower than it was */
    int64_t blinks;   /* of the eyes together, also those that last */
};

/* What the cameras have done so far. */
struct fv_watch_tally {
    struct fv_camera_counts camera[FV_WATCH_CAMERAS];
    struct fv_watch_latency latency;
    struct fv_watch_unseen unseen;
};

struct fv_watch {
    const struct fv_camera_io *io;
    int cameras;
    int width[FV_WATCH_CAMERAS], height[FV_WATCH_CAMERAS];
    struct fv_camera camera[FV_WATCH_CAMERAS];
    struct fv_eye_tracker tracker[FV_WATCH_CAMERAS];
    struct fv_binocular binocular;
    struct fv_watch_news news;
    struct fv_watch_latency latency;
    struct fv_watch_unseen unseen;
    struct fv_frame_recorder *_Atomic recorder; /* NULL: frames are not recorded */
    struct fv_eye_recorder *_Atomic looks;      /* NULL: nor is what they tell */
    struct fv_mailbox mailbox, tally;
    void (*say)(const char *line); /* changes of state */
    /* Each look before it is combined, for calibrations; NULL: nobody asks. Set before the first round. */
    void (*looked)(void *context, int camera, const struct fv_eye_look *look);
    void *looked_context;
    atomic_bool stop, done;
    bool running;
    pthread_t thread;
};

/* Opens the cameras; memory is taken from the arena ("sensors"). 0, or -1 with the error set and all closed.
 * Says what was got by say(), which the thread calls too. Nothing runs yet. */
int fv_watch_open(struct fv_watch **watch, const struct fv_watch_settings *settings,
                  const struct fv_camera_io *io, void (*say)(const char *line), struct fv_error *error);

/* One round: waits for frames, at most until timeout_ns have passed. The thread does nothing else. */
void fv_watch_round(struct fv_watch *watch, int64_t timeout_ns);

/* Starts the thread. 0, or -1 with the error set. */
int fv_watch_start(struct fv_watch *watch, struct fv_error *error);

/* Ends it and closes the cameras, without a call to the heap. False: the thread is held up by a camera, for more
 * than a second; nothing is closed. */
bool fv_watch_stop(struct fv_watch *watch);

/* The newest samples; false: none yet, `news` as it was. From any thread. */
bool fv_watch_read(struct fv_watch *watch, struct fv_watch_news *news);

/* Size of a camera's frames, as they were at the start: those that it may have again. */
void fv_watch_size(const struct fv_watch *watch, int camera, int *width, int *height);

/* What has been counted up to the newest round that brought anything; false: none has yet. From any thread.
 */
bool fv_watch_count(struct fv_watch *watch, struct fv_watch_tally *tally);

#endif
