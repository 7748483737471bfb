/* plan_features: which features of the methods' own a scene and its settings need: levels that are carried over, attributes,
 * checks painted anew, frames before the last, light kept apart, lights' maps. For plan.c only. */
#ifndef FV_FRAME_PLAN_FEATURES_H
#define FV_FRAME_PLAN_FEATURES_H

#include "rt/frame/plan.h"

/* Decides on them, a row each, and drops buffers that serve none that is kept. The passes have been chosen. */
void fv_plan_choose_features(struct fv_plan *plan, const struct fv_scene *scene, const struct fv_config *config,
                             const struct fv_frame *frame);

#endif
