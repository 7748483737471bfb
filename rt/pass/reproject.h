/* reproject: last frame's pixels carried into the new view by the support G-buffer's coarse mesh,
 * looked up backwards (Weier et al. 2016, section 3.2; METHODS: whichever way is faster). */
#ifndef FV_PASS_REPROJECT_H
#define FV_PASS_REPROJECT_H

#include "rt/pass/pass.h"

/* One tile of one eye, as the kernel takes it. */
struct fv_reproject_tile {
    struct fv_map map;
    int x0, y0, width, height; /* first pixel; the picture's size */
    int64_t stride;            /* elements a row of the pixel buffers */
    const uint32_t *history_colour;
    const float *history_depth;
    int spacing, nodes_x, nodes_y; /* support nodes that the picture covers */
    int64_t support_stride;
    const uint32_t *support_colour;
    const float *support_depth;
    float epsilon;   /* relative depth difference that still is the same surface */
    uint32_t *colour; /* out */
    float *depth;     /* out */
    uint64_t edges;   /* out: blocks that lie between nodes of different depth */
    uint64_t failed;  /* out: blocks in which a quarter of the pixels found no history */
};

/* One tile, whatever was selected of it; from the support image alone where there is no history. `edges`
 * and `failed` as above. */
void fv_reproject(struct fv_frame *frame, const struct fv_tile *tile, uint64_t *edges, uint64_t *failed);

/* The share of reprojected blocks that is sampled in the end, where the foveal function gives p, going by
 * the edges and failures of the frame before. */
double fv_reproject_share(const struct fv_frame *frame, const struct fv_foveal *foveal, float p);

#endif
