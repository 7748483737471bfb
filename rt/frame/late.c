/* late: see late.h. */
#include "rt/frame/late.h"

#include "platform/log.h"
#include "rt/pass/turn.h"

int64_t fv_late_shown_ns(const struct fv_late *late, const struct fv_pace *pace, int64_t now_ns)
{
    struct fv_pace shown = *pace;
    int64_t flips = fv_pace_late(pace, now_ns);
    if (flips == 0 || fv_pace_late(pace, now_ns + (int64_t)late->turn_ns.held) > flips) return 0;
    shown.flip += flips;
    return fv_pace_shown_ns(&shown);
}

bool fv_late_turn(struct fv_late *late, struct fv_schedule *schedule, struct fv_frame *f, const struct fv_pose *head,
                  struct fv_stage_result *stage)
{
    const struct fv_stage_limit unlimited = {.done = -1};
    if (!fv_turn_set(f, head)) return false;
    fv_schedule_run(schedule, f, &fv_pass_turn, &unlimited, stage);
    fv_peak_learn(&late->turn_ns, (double)(stage->end_ns - stage->start_ns));
    for (int e = 0; e < f->eyes && !f->fringe; e++) {
        void *turned = f->buffer[FV_TURNED][e];
        f->buffer[FV_TURNED][e] = f->buffer[FV_PICTURE][e];
        f->buffer[FV_PICTURE][e] = turned;
    }
    return true;
}

void fv_late_tell(struct fv_late *late, bool missed, bool turned)
{
    late->timely = missed ? 0 : late->timely + (late->timely < FV_LATE_TIMELY);
    if (turned && !late->said) {
        fv_log("frames miss their flips: their pictures are turned to the newest head (display.late)");
        late->said = true;
    } else if (late->said && late->timely == FV_LATE_TIMELY) {
        fv_log("frames are in time again");
        late->said = false;
    }
}
