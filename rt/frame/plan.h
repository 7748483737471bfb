/* plan: from the scene, the method and the settings, once: which passes, buffers and features are
 * needed. The rest is dropped before the first frame. `foveola plan` prints it. */
#ifndef FV_FRAME_PLAN_H
#define FV_FRAME_PLAN_H

#include "rt/frame/session.h"
#include "rt/method/method.h"

struct fv_plan {
    const struct fv_method *method;
    const struct fv_pass *pass[FV_METHOD_PASSES_MAX + 1];
    int passes;
    uint32_t buffers;               /* bits of fv_buffer that are taken */
    int64_t bytes[FV_BUFFERS];      /* of all eyes */
    bool present;                   /* a sink takes pictures */
    bool history;                   /* colour and depth are swapped after each frame */
    int rows;
    struct fv_plan_row row[64];
};

/* Decides; takes no memory. `frame` must have its sizes set (fv_frame_size). */
void fv_plan_make(struct fv_plan *plan, const struct fv_method *method, const struct fv_scene *scene,
                  const struct fv_config *config, const struct fv_frame *frame);

/* Picture and tile sizes of the settings. */
void fv_frame_size(struct fv_frame *frame, const struct fv_config *config);

/* Takes the buffers that the plan keeps, and the workers' scratch. */
void fv_plan_take(const struct fv_plan *plan, struct fv_frame *frame, int workers);

#endif
