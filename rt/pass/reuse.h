/* reuse: pixels of the central region that take the last frame's colours instead of extra samples (Kim, Ko and Ihm 2021,
 * sections 4.4 and 4.5): where both frames hit something there, at distances that agree, the two-step disparity test
 * (selective.h) passes between this pixel's own sample and the last frame's at tau_reuse tau_fov(e) tau_sel, and the colour
 * has not been reused in selective.reuse_max frames in a row. FV_CHAIN counts these, FV_CHAIN_NONE: nothing to reuse.
 *
 * What is ours: colours of the last frame are interpolated (the nearest pixel's is up to half a pixel off, and by that much
 * texture differs): own samples linearly, as the test wants them, final colours by Catmull-Rom. Pixels around which what
 * is near and what is far moved apart by more than an eighth of a pixel, or objects meet, are sampled. So is what mirrors or
 * refracts, but where all attributes of the second hits agree; highlights show in the own samples. Blocks take turns to
 * be sampled: else all would reach reuse_max in the same frame, which would take as long as without reuse. */
#ifndef FV_PASS_REUSE_H
#define FV_PASS_REUSE_H

#include "rt/pass/backproject.h"

enum { FV_CHAIN_NONE = 255 };

/* What is known of pixels besides their colours; NULL where it is not kept. */
struct fv_known {
    const uint32_t *base, *identity, *facing, *second_identity, *second_facing;
};

/* A row of pixels. */
struct fv_reuse {
    struct fv_row row;
    struct fv_backproject last;
    struct fv_known now, before;   /* of the row; of the last frame, from its first pixel on */
    int stamp_before;              /* of its identities */
    const uint8_t *chain_before;   /* from its first pixel on */
    const float *tolerance;        /* tau_reuse tau_fov of each pixel; negative: it is not central */
    const struct fv_selective *settings;
    uint32_t due;                  /* pixels to be sampled, a bit each */
    uint32_t central, reused;      /* out: pixels that might be reused; that are */
    uint32_t *colour;              /* out: of those that are */
    int32_t *chain;                /* out, of all */
};

#endif
