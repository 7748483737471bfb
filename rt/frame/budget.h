/* budget: keeps a frame inside its time: chooses its level, gives each stage its limit, learns what it cost.
 *
 * Joins control.h (prices and levels) and schedule.h (tiles and clock). The loop asks: fv_budget_begin once
 * the views are set, fv_budget_stage for each pass, fv_budget_end. Where budget.adapt is off, nothing is
 * chosen and nothing cut: the same code runs without limits. */
#ifndef FV_FRAME_BUDGET_H
#define FV_FRAME_BUDGET_H

#include "rt/frame/plan.h"
#include "rt/frame/schedule.h"

enum { FV_OVERS = 32 };

struct fv_budget {
    const struct fv_config *config;
    const struct fv_plan *plan;
    bool adapt;
    int periods_max;
    double period_ns;
    struct fv_control control;
    struct fv_schedule schedule;
    struct fv_work expected[FV_LEVELS_MAX], least; /* of this frame */
    struct fv_peak stand_in_ns[FV_COST_STAGES][2]; /* wall time of one, of all workers together; 1: where the
                                                      whole frame is sampled, so that none is reprojected */
    struct fv_peak present_ns;
    double straggle_ns; /* how long the last tiles run on after a stage is closed: falls by 1/128 a frame */
    double over_ns[FV_OVERS]; /* that of the newest frames, 0 where they were not cut */
    unsigned overs;
    double lead; /* >= 1: by how much longer than predicted a frame is given, begun late as it is; grows
                    where it was cut all the same, falls by 1/64 a frame */
    /* The frame under way. */
    int64_t deadline_ns;
    double expected_ns, expected_cpu_ns; /* of its stages so far */
    bool cut;
    struct fv_cost_sample sample;
};

/* Takes what scheduling needs. */
void fv_budget_open(struct fv_budget *budget, const struct fv_config *config, const struct fv_plan *plan,
                    struct fv_frame *frame, struct fv_workers *workers, const struct fv_clock *clock,
                    struct fv_trace *trace);

/* The level of the next frame by what the last one saw, before it is latched: sets control.level and
 * control.periods. Returns the time that such a frame needs from its latch to its flip, 0 where that is not
 * known. */
double fv_budget_foresee(struct fv_budget *budget);

/* Sets the frame's parameters: of its level where `decided` says one or the level does not adapt (`level`),
 * else of the best that fits. uncertainty_deg: of the gaze, which widens r0. deadline_ns: when the frame has
 * to be done; 0: as many periods after begun_ns as it is given. Returns the level. */
int fv_budget_begin(struct fv_budget *budget, struct fv_frame *frame, int level,
                    const struct fv_decision *decided, double uncertainty_deg, int64_t begun_ns,
                    int64_t deadline_ns);

/* Runs pass i of the plan; `done`: tiles that were worked at when it was recorded, -1: as many as there is
 * time for. */
void fv_budget_stage(struct fv_budget *budget, struct fv_frame *frame, int i, int done,
                     struct fv_stage_result *result);

/* All stages have run. */
void fv_budget_end(struct fv_budget *budget, struct fv_frame *frame);

/* What presenting took, where the frame was presented. */
void fv_budget_presented(struct fv_budget *budget, double ns);

#endif
