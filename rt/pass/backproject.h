/* backproject: rows of pixels and frames before, in which they are looked up by their own depths: what the passes smooth and
 * reuse hand to their kernels. */
#ifndef FV_PASS_BACKPROJECT_H
#define FV_PASS_BACKPROJECT_H

#include "rt/pass/pass.h"

/* A row of this frame's pixels of one eye, from (x, y) on, `count` of them: a multiple of 16. */
struct fv_row {
    int count, x, y;
    int width, height, stride;      /* of the picture */
    const uint32_t *colour, *cache;
    const uint32_t *identity;       /* which object moves them; NULL: nothing moves */
    int stamp;                      /* of identities of this frame (pass/selective.h) */
};

/* A frame before. */
struct fv_backproject {
    int width, height, stride;
    float epsilon;                  /* relative depth difference that still is the same surface */
    float together;                 /* inverse depths here that differ by less moved apart by less than a pixel since */
    const uint32_t *colour, *cache; /* the frame's, from its first pixel on */
    const struct fv_map *map;       /* of what is fixed to each object, [0]: to none */
};

/* The tile's row y. */
struct fv_row fv_row_of(const struct fv_frame *frame, const struct fv_tile *tile, int y);

/* For the tile's pixels, `place` frames before the last; `before`: its lens. */
struct fv_backproject fv_backproject_to(const struct fv_frame *frame, const struct fv_tile *tile, const uint32_t *colour,
                                        const uint32_t *cache, const struct fv_map *map, const struct fv_bend *before, int place);

#endif
