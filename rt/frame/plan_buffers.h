/* plan_buffers: what a frame's buffers are called and how large they are. For the plan's files only. */
#ifndef FV_FRAME_PLAN_BUFFERS_H
#define FV_FRAME_PLAN_BUFFERS_H

#include "rt/pass/pass.h"

/* Buffers of colours: of each plane one image. */
#define FV_PLAN_COLOURS \
    (FV_BIT(FV_COLOUR) | FV_BIT(FV_COARSE_COLOUR) | FV_BIT(FV_COARSEST_COLOUR) | FV_BIT(FV_HISTORY_COLOUR) | \
     FV_BIT(FV_COARSE_HISTORY_COLOUR) | FV_BIT(FV_COARSEST_HISTORY_COLOUR) | FV_BIT(FV_SUPPORT_COLOUR))

/* Buffers of as many images as frames before the last are kept. */
#define FV_PLAN_EARLIER (FV_BIT(FV_EARLIER_COLOUR) | FV_BIT(FV_EARLIER_CACHE))

/* "history colour". */
const char *fv_plan_buffer_name(enum fv_buffer buffer);

/* Of one image of one eye. `frame` must have its sizes set (fv_frame_size). */
int64_t fv_plan_buffer_bytes(const struct fv_frame *frame, enum fv_buffer buffer);

#endif
