/* control: which quality level the next frame is rendered at, from what frames have cost so far.
 *
 * Pure bookkeeping: no clock, no input or output, the same answers for the same numbers. The loop says how
 * much work each level would be at this gaze (rays, nodes, pixels), and afterwards what the frame's work
 * took; control learns prices and chooses.
 *
 * Predicted time of a level = sum over costs of price x units x correction, over the workers, x stretch, x
 * the level's factors:
 * - price: thread CPU ns a unit, so that a preempted thread teaches no wrong price. Where a frame has next to
 *   none of a stage's sparse or dense units, their price goes with the other's;
 * - correction: units that came over those that were expected, 1/2 to 2;
 * - stretch: wall time x workers over CPU time, at least 1: other programs' load, idle workers;
 * - factors: by how much each of these three was dearer at this level than elsewhere, found in the first
 *   frames after a raise to it; the level's samples are divided by them, so that they hold for the others.
 * Price and stretch are peaks that are held (struct fv_peak); the correction is a mean, lest margins pile up.
 */
#ifndef FV_FRAME_CONTROL_H
#define FV_FRAME_CONTROL_H

#include <stdbool.h>

enum {
    FV_COST_STAGES = 16,           /* at most, of a frame */
    FV_COSTS = 2 * FV_COST_STAGES, /* each for sparse tiles and, at + 1, for those worked at whole */
    FV_LEVELS_MAX = 16
};

/* An upper estimate of something measured once a frame. Rises to the second largest of the last three, so
 * that one spike teaches nothing and a change is believed on its second frame; falls to the largest of the
 * three once all lie below 0.8 of it; else decays by 1/128 of its difference to the second largest. The
 * first three samples set it to their second largest, the very first to itself. Samples that are not
 * finite, or not above 0, are passed over. */
struct fv_peak {
    double held;      /* 0: nothing is known */
    double recent[3]; /* newest first */
    int count;        /* of recent, 0 to 3 */
};
void fv_peak_learn(struct fv_peak *peak, double value);

/* Work of a frame, or of a part of one: units by cost, 2 x stage + (1 where the tile was worked at whole). */
struct fv_work {
    double units[FV_COSTS];
};

/* What one frame cost. May come late: all that is needed to learn from it is in it. */
struct fv_cost_sample {
    int level;
    struct fv_work expected;      /* all that the level was expected to be */
    struct fv_work done;          /* what was done: less where the frame was cut */
    double cpu_ns[FV_COSTS];      /* thread CPU time of all workers, by cost */
    double wall_ns, total_cpu_ns; /* of all stages together */
    bool cut;
    bool hurried; /* it was given less time than its level's budget: that it was cut is not the level's fault
                   */
};

enum fv_measure { FV_PRICE, FV_UNITS, FV_STRETCH, FV_MEASURES };

/* What a level has taught about itself. Forgotten, while it is not in use, when its work would cost 25 % more
 * or less than at the raise to it, or after 10000 frames: what taught it may be gone. */
struct fv_level_memory {
    double factor[FV_MEASURES]; /* 1 to 16 */
    double caution;             /* 1 to 16: on top before a raise, so that one that failed is not tried again
                                   and again */
    double raised_ns;           /* predicted on the newest raise to it; 0: it was come down to */
    double dearer[FV_MEASURES]; /* smallest ratio, measured over known, since then */
    int samples;                /* since then, up to 2: then the factors are set */
    struct fv_work work;        /* at the newest raise */
    double known_ns;            /* what that took without factors, by the median of three frames */
    int moved;                  /* frames in a row in which that was something else */
    int frames;                 /* since it was raised to or left */
};

struct fv_control {
    int first, last; /* levels: the best and the smallest safe one */
    int workers;
    double headroom; /* share of the budget that is left free */
    int level;       /* the newest choice; `last` before the first */
    int periods;     /* display periods that a frame takes, 1 unless even the least does not fit */
    int quiet;       /* frames in a row that would have had room for one level up */
    int easy;        /* frames in a row whose least had room in fewer periods */
    int cuts;        /* frames cut at this level, 2 each, less 1 for each one that was not; >= 0 */
    struct fv_peak price[FV_COSTS], stretch;
    /* Held is not a peak but the mean: by 1/16 of the difference a frame, all the way where two of the last
     * three are above 1.2 of it or all below 0.8. */
    struct fv_peak correction[FV_COSTS];
    struct fv_level_memory memory[FV_LEVELS_MAX];
};

/* Levels first..last, 0 <= first <= last < FV_LEVELS_MAX, quality falling; workers >= 1; headroom in [0, 1).
 */
void fv_control_open(struct fv_control *control, int first, int last, int workers, double headroom);

/* Wall time in ns that `work` at `level` is predicted to take; 0 while no price is known. Finite, >= 0.
 * Where one price of a stage is not known, the other stands for it (a sparse unit is taken as 1.6 dense
 * ones); where neither is, the mean of the others in this work. */
double fv_control_predict_ns(const struct fv_control *control, int level, const struct fv_work *work);

/* The same for reserves: by the dearer of what is held and what the newest frame says, so that it is right
 * from the second frame of a change on. */
double fv_control_need_ns(const struct fv_control *control, int level, const struct fv_work *work);

/* Wall time in ns that one more unit of a cost takes when all workers share the work, 0 while it is not
 * known. For reserves too. */
double fv_control_price_ns(const struct fv_control *control, int cost);

/* Wall time x workers over CPU time, as it is held; >= 1. */
double fv_control_stretch(const struct fv_control *control);

/* The level of the next frame: expected[level] for first..last; `least`: what no frame can do without;
 * `period_ns`: of the display; `other_ns`: what a frame takes besides its stages, which no level changes;
 * periods_max >= 1. Sets control->level and control->periods.
 *
 * Periods: the fewest in which `least` fits; more at once, fewer after three frames in a row that had room
 * in them. A frame that misses its flip costs whole periods, so they are used whole. Budget: periods x period
 * x (1 - headroom) - other. Down at once to the best level that is predicted to fit, or by one where frames
 * are cut again and again although they were; up one level a frame, once three frames in a row, each by its
 * own measurements, had room for it (predicted <= 0.9 of the budget) and the level raised to last was
 * measured and no dearer than predicted, or measured twice; a drop starts the wait again. */
int fv_control_choose(struct fv_control *control, const struct fv_work *expected, const struct fv_work *least,
                      double period_ns, double other_ns, int periods_max);

/* The level of this frame alone, now that its gaze is known and `budget_ns` is left for its stages: the one
 * that was chosen or, where that does not fit, the best one that does. */
int fv_control_fit(const struct fv_control *control, const struct fv_work *expected, double budget_ns);

void fv_control_learn(struct fv_control *control, const struct fv_cost_sample *sample);

#endif
