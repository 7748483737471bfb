/* control: which quality level the next frame is rendered at, from what frames have cost so far.
 *
 * Pure bookkeeping: no clock, no input or output, the same answers for the same numbers. The loop says how
 * much work each level would be at this gaze (rays, nodes, pixels), and afterwards what the frame's work
 * took; control learns prices and chooses.
 *
 * Predicted time of a level = sum over costs of price x units x correction, over the workers, x stretch:
 * - price: thread CPU ns a unit, so that a preempted thread teaches no wrong price;
 * - correction: units that came over those that were expected, 1/2 to 2;
 * - stretch: wall time x workers over CPU time, at least 1: other programs' load, idle workers;
 * - a level's own factor: where a raise turned out dearer than predicted, so that it is not tried again
 *   and again; forgotten when conditions change.
 * Each is a peak that is held (struct fv_peak). */
#ifndef FV_FRAME_CONTROL_H
#define FV_FRAME_CONTROL_H

#include <stdbool.h>

enum {
    FV_COST_STAGES = 8,               /* at most, of a frame */
    FV_COSTS = 2 * FV_COST_STAGES,    /* each for sparse tiles and, at + 1, for those worked at whole */
    FV_LEVELS_MAX = 16
};

/* An upper estimate of something measured once a frame. Rises when two of the last three say so, so that one
 * spike teaches nothing; falls to the largest of the last three when all three lie below 0.8 of it; else
 * decays by 1/128 of the difference a frame. Not known until the first sample. Samples that are not
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
};

struct fv_control {
    int first, last; /* levels: the best and the smallest safe one */
    int workers;
    double headroom; /* share of the budget that is left free */
    int level;       /* the newest choice; `last` before the first */
    int periods;     /* display periods that a frame takes, 1 unless even the least does not fit */
    int quiet;       /* frames in a row that would have had room for one level up */
    struct fv_peak price[FV_COSTS], correction[FV_COSTS], stretch;
    double factor[FV_LEVELS_MAX];     /* >= 1 */
    double raised_ns;                 /* predicted for the newest raise; 0: it is settled */
    int raised_frames;                /* since the newest raise */
    double known_ns[FV_LEVELS_MAX];   /* predicted for the last level when factor[] was learned */
};

/* Levels first..last, first <= last < FV_LEVELS_MAX, quality falling; workers >= 1; headroom in [0, 1). */
void fv_control_open(struct fv_control *control, int first, int last, int workers, double headroom);

/* Wall time in ns that `work` at `level` is predicted to take; 0 while no price is known. Finite, >= 0. */
double fv_control_predict_ns(const struct fv_control *control, int level, const struct fv_work *work);

/* Wall time in ns of one unit of a cost, 0 while it is not known. */
double fv_control_price_ns(const struct fv_control *control, int cost);

/* The level of the next frame: expected[level] for first..last; `least`: what no frame can do without;
 * `period_ns`: of the display; `other_ns`: what a frame takes besides its stages, which no level changes;
 * periods_max >= 1. Sets control->level and control->periods.
 *
 * Periods: the fewest in which `least` fits; more at once, fewer only after three frames. A frame that
 * misses its flip costs whole periods, so they are used whole. Budget: periods x period x (1 - headroom) -
 * other. Down at once to the best level that is predicted to fit; up one level a frame, once three frames
 * in a row had room for it (predicted <= 0.85 of the budget); a drop starts the wait again. */
int fv_control_choose(struct fv_control *control, const struct fv_work *expected, const struct fv_work *least,
                      double period_ns, double other_ns, int periods_max);

void fv_control_learn(struct fv_control *control, const struct fv_cost_sample *sample);

#endif
