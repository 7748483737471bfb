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
    uint64_t buffers;               /* bits of fv_buffer that are taken */
    int64_t bytes[FV_BUFFERS];      /* of all eyes */
    bool present;                   /* a sink takes pictures */
    bool fringes;                   /* of which red and blue are shifted (pass/fringe.h) */
    bool turns;                     /* those that are late are turned to the newest head (pass/turn.h) */
    bool history;                   /* colour and depth are swapped after each frame */
    bool accumulates;               /* light is (pass/accumulate.h), and swapped */
    bool carry;                     /* the pyramid's lower levels and starts are */
    uint32_t needs;                 /* enum fv_needs of the passes together */
    bool noise;                     /* a pass needs the blue-noise mask */
    bool gaze;                      /* something uses where the eye looks: else its source is not opened */
    int map_side;                   /* texels of lights' maps (trace/visibility.h), 0: there are none */
    int pasts;                      /* frames before a frame that are kept, with their images (struct fv_past) */
    int planes;                     /* images of a buffer of colours (rt/pass/pass.h) */
    enum fv_variant variant;        /* of the tracing kernel */
    int workers;                    /* to be started */
    int rows;
    struct fv_plan_row row[FV_PLAN_ROWS_MAX];
};

/* What a frame shows depends on the ones before: those need to have been rendered, from a restart on. */
static inline bool fv_plan_remembers(const struct fv_plan *plan)
{
    return plan->history || plan->accumulates || (plan->needs & FV_NEEDS_DENSITIES);
}

/* Decides; takes no memory. `frame` must have its sizes set (fv_frame_size). */
void fv_plan_make(struct fv_plan *plan, const struct fv_method *method, const struct fv_scene *scene,
                  const struct fv_config *config, const struct fv_frame *frame);

/* Picture and tile sizes of the settings. */
void fv_frame_size(struct fv_frame *frame, const struct fv_config *config);

/* One more row, for what rt does not know: what the caller keeps or leaves out. At most FV_PLAN_ROWS_MAX. */
void fv_plan_add(struct fv_plan *plan, const char *kind, const char *what, bool kept, int64_t bytes,
                 const char *reason, ...) __attribute__((format(printf, 6, 7)));

/* The rows into the session's report. */
void fv_plan_report(const struct fv_plan *plan, struct fv_session *session);

/* Takes the buffers that the plan keeps, and the scratch of as many workers as were started. */
void fv_plan_take(const struct fv_plan *plan, struct fv_frame *frame, int workers);

#endif
