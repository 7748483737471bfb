/* calibrator: a calibration under way: which target is shown, which looks belong to it, and whether it has to
 * be shown again. What comes of it: calibrated.h.
 *
 *   fv_calibrator_step  ->  a target to show   ->  the user looks
 *   fv_calibrator_look  <-  looks of both eyes <-  look_feed.h
 *
 * A target appears; the eye gets `settle_ns` to go there (a saccade begins some 200 ms after its target
 * appears and lasts some 100 at most: Carpenter 1988); what is seen in the `collect_ns` after that belongs to
 * it, chosen by fixation.h. Where an eye gave too little, the target is shown again, twice at most, then it
 * is missed. Looks count by their own times alone, never by when they came, so that the log of targets and
 * the recorded frames give the same calibration again. */
#ifndef FV_SENSORS_CALIBRATOR_H
#define FV_SENSORS_CALIBRATOR_H

#include "sensors/eye/fixation.h"
#include "sensors/eye/targets.h"
#include "sensors/eye/tracker.h"

/* Times that a target is shown at most. */
enum { FV_CALIBRATOR_TRIES = 3 };

struct fv_calibrator_settings {
    int eyes; /* 1: the left one alone; 2 */
    int points;
    struct fv_target_reach reach;
    int64_t lead_ns; /* more time for the first target */
    double near_px;  /* a fixation stays within this: see fv_calibrator_near_px */
};

struct fv_calibrator {
    struct fv_calibrator_settings settings;
    double place_deg[FV_TARGETS_MAX][2];
    int shown; /* rows below */
    struct fv_target_shown show[FV_SHOWN_MAX];
    struct {
        int looks;
        struct fv_fixation_look *look; /* FV_FIXATION_LOOKS_MAX; later ones are left out */
        bool judged;
        struct fv_fixation fixation;
        bool chosen[FV_FIXATION_LOOKS_MAX];
    } of[FV_SHOWN_MAX][2];
    int target, tries;    /* that is shown now; how often it has been */
    int64_t newest_ns[2]; /* time of the newest look, seen or not */
    int64_t frames[2], seen[2];
};

/* What a fixation's middle may be off: a degree, for a pupil that moves as the model of the tracker says. */
double fv_calibrator_near_px(const struct fv_eye_model *model, int width);

/* Takes memory from the arena ("sensors"). 0, or -1 with the error set: no such number of points. */
int fv_calibrator_begin(struct fv_calibrator *calibrator, const struct fv_calibrator_settings *settings,
                        struct fv_error *error);

/* Targets that were shown, from a log, in place of stepping. */
void fv_calibrator_replay(struct fv_calibrator *calibrator, const struct fv_target_shown *shown, int rows);

/* At the time now_ns, which grows: begins, goes on to the next target, or shows one again. Returns the number
 * of the row of `show` that is shown now; -1: all is done. */
int fv_calibrator_step(struct fv_calibrator *calibrator, int64_t now_ns);

/* A frame of an eye was looked at. Times of an eye grow. */
void fv_calibrator_look(struct fv_calibrator *calibrator, int eye, const struct fv_eye_look *look);

/* Whether a row of `show` gave an eye enough, by what has come so far; chooses from it. */
bool fv_calibrator_good(struct fv_calibrator *calibrator, int row, int eye);

#endif
