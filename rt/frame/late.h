/* late: frames that missed their flips, as far as pictures can still make up for it: they are turned to where the head
 * will be at the flip that they are shown at (pass/turn.h). In a loop that latches, renders and presents one frame
 * after another, such a frame is the one that is ready too late: its pose was predicted for a flip that has passed. */
#ifndef FV_FRAME_LATE_H
#define FV_FRAME_LATE_H

#include "rt/frame/control.h"
#include "rt/frame/pace.h"
#include "rt/frame/schedule.h"

struct fv_late {
    struct fv_peak turn_ns; /* what it takes */
    int timely;             /* frames in a row that were not late, since one was */
    bool said;              /* that frames are late */
};

/* The session time that a picture is shown for which is ready at `now_ns` but for being turned. 0: it is in time; or
 * turning it would make it miss one more flip, which costs more than it gives. */
int64_t fv_late_shown_ns(const struct fv_late *late, const struct fv_pace *pace, int64_t now_ns);

/* Turns the frame's finished picture to `head`. False: it stays as it is (fv_turn_set), and nothing was run. */
bool fv_late_turn(struct fv_late *late, struct fv_schedule *schedule, struct fv_frame *frame, const struct fv_pose *head,
                  struct fv_stage_result *stage);

/* Once a frame: says when frames begin to be late, and when none has been for FV_LATE_TIMELY in a row. */
enum { FV_LATE_TIMELY = 100 };
void fv_late_tell(struct fv_late *late, bool missed, bool turned);

#endif
