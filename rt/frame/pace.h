/* pace: which flip of the display a frame is for, and when to begin it. Pure functions of times: the loop
 * waits.
 *
 * Flip n is at n periods from the session's beginning or, where a display is followed, as far from the newest
 * refresh that is known of. A frame is begun as late as lets it be done by its flip, so that pose and gaze are as
 * new as can be. One that is late is shown at the next flip after it is done; those passed meanwhile are skipped,
 * never made up for. */
#ifndef FV_FRAME_PACE_H
#define FV_FRAME_PACE_H

#include "platform/vsync.h"

struct fv_pace {
    int64_t epoch_ns;  /* of the clock: session time 0 */
    int64_t period_ns; /* > 0 */
    int64_t flip; /* that the newest frame was for, then the one that it was shown at; 0 before the first */
    /* A display that is followed, else 0: flip `anchor` is at anchor_ns in session time, and a frame has to be done
     * lead_ns before its flip. */
    int64_t anchor, anchor_ns, lead_ns;
};

/* Takes a display's beat: flips are where it has them from here on, numbered on, so that none moves by more than
 * half a period. */
void fv_pace_follow(struct fv_pace *pace, const struct fv_beat *beat);

/* Aims the next frame, which needs `need_ns` and is given `periods` >= 1, at a flip: the first that is
 * `periods` or more after the last and that can still be reached at `now_ns`. Returns when it is to be begun,
 * not before now_ns. */
int64_t fv_pace_aim(struct fv_pace *pace, int64_t now_ns, int64_t need_ns, int periods);

/* When the frame under way has to be done. */
static inline int64_t fv_pace_deadline_ns(const struct fv_pace *pace)
{
    return pace->epoch_ns + pace->anchor_ns + (pace->flip - pace->anchor) * pace->period_ns - pace->lead_ns;
}

/* The middle of its scan-out, in session time. */
static inline int64_t fv_pace_shown_ns(const struct fv_pace *pace)
{
    return pace->anchor_ns + (pace->flip - pace->anchor) * pace->period_ns + pace->period_ns / 2;
}

/* Flips that a frame comes too late for which is done at `now_ns`. */
int64_t fv_pace_late(const struct fv_pace *pace, int64_t now_ns);

/* The frame is done. Returns the flips that it came too late for, 0 where it was in time. */
int64_t fv_pace_done(struct fv_pace *pace, int64_t now_ns);

#endif
