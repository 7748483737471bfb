/* loop: frames one after another: latch, passes, present, record. Sensors and display are two
 * functions handed in, so that rt knows neither.
 *
 * budget.pace free: frames follow one another at once, in session time a period apart, so that a run can be
 * repeated on any machine. vsync: frame by frame the loop waits until there is just time enough left, latches,
 * and aims at a flip (pace.h): of a display, where there is one that tells when it refreshes, else by the clock. */
#ifndef FV_FRAME_LOOP_H
#define FV_FRAME_LOOP_H

#include "rt/frame/budget.h"
#include "rt/frame/late.h"

/* What the loop asks for and hands out. */
struct fv_loop_io {
    void *context;
    /* Head pose in the world and each eye's gaze (unit, head space) for showing at the session time show_ns,
     * from what sensors know at now_ns <= show_ns. */
    void (*latch)(void *context, int64_t now_ns, int64_t show_ns, struct fv_pose *head, double gaze[2][3],
                  double *uncertainty_deg);
    /* True when the picture of this frame is wanted. */
    bool (*wants)(void *context, int64_t frame, bool last);
    /* The finished picture: `frame`'s FV_PICTURE buffers. */
    void (*present)(void *context, const struct fv_frame *frame);
    /* What was decided for this frame when it was recorded: it is done again. False: there is none. NULL:
     * nothing is replayed. */
    bool (*decided)(void *context, int64_t frame, struct fv_decision *decision);
    /* Called after each frame, its record whole; returns false to stop. */
    bool (*after)(void *context, const struct fv_session *session, const struct fv_frame_record *record);
    /* When the display refreshes, as of now; false: not known. NULL: nothing is followed. */
    bool (*beat)(void *context, struct fv_beat *beat);
    /* As latch, of the head alone: for a picture that missed its flip, and is now shown at show_ns. Between the
     * latch of its frame and the next one's. NULL: what is late is shown as it is. */
    void (*newest)(void *context, int64_t now_ns, int64_t show_ns, struct fv_pose *head);
};

struct fv_loop {
    const struct fv_config *config;
    const struct fv_plan *plan;
    const struct fv_clock *clock;
    struct fv_workers *workers;
    struct fv_trace *trace;
    struct fv_session *session;
    struct fv_frame frame;
    struct fv_lens lens[2];
    struct fv_bend bend[2];
    struct fv_pose head; /* of the newest frame; kept where the next one's is none */
    struct fv_budget budget;
    struct fv_pace pace;
    struct fv_late late;
    int64_t period_ns;
    bool vsync;
    int level; /* quality level that the next frame is rendered at (method.h) where it does not adapt */
};

/* Takes everything that frames need: buffers, session records, trace rings. `frames` > 0: how many are
 * recorded at most. `tracer` stays the caller's. */
void fv_loop_open(struct fv_loop *loop, const struct fv_config *config, const struct fv_plan *plan,
                  const struct fv_tracer *tracer, struct fv_workers *workers, struct fv_session *session,
                  int64_t frames);

/* Frames have this period, not that of budget.hz: the display's own. Before frames. */
void fv_loop_period(struct fv_loop *loop, int64_t period_ns);

/* Runs `frames` frames (-1: until `after` says stop). Free, frame n is shown at n periods. */
void fv_loop_run(struct fv_loop *loop, const struct fv_loop_io *io, int64_t frames);

/* One frame at the given pose, gaze and time, without presenting, waiting or recording: for measurements
 * and tests. A pose that is none (fv_pose_sound) is taken as the frame before's, a gaze that is none as straight
 * ahead (fv_view_set). */
void fv_loop_frame(struct fv_loop *loop, const struct fv_pose *head, const double gaze[2][3],
                   double uncertainty_deg, int64_t t_ns, struct fv_frame_record *record);

/* Takes the settings' lenses, which is all that fv_loop_view wants; fv_loop_open does so, too. */
void fv_loop_look(struct fv_loop *loop, const struct fv_config *config);

/* Eye e's view (0 left, 1 right): the head's pose moved half the distance between the eyes sideways. */
void fv_loop_view(const struct fv_loop *loop, int e, const struct fv_pose *head, const double gaze[3],
                  struct fv_view *view);

/* Takes over what has changed in the configuration's settings of the method, as far as they need no other passes,
 * buffers or levels than those that it was opened with. For measurements, before a restart. */
void fv_loop_settings(struct fv_loop *loop);

/* Forgets the frames before and their heads: the next one is the first, at the same blue noise as any first
 * one. */
void fv_loop_restart(struct fv_loop *loop);

#endif
