/* merge: new samples over what was reprojected (Weier et al. 2016, section 3.4), pixel by pixel, and the
 * coarse raster's share of what became of it. */
#ifndef FV_PASS_MERGE_H
#define FV_PASS_MERGE_H

#include "rt/pass/pass.h"

/* What the kernel takes: new samples and the pixels that they go into. Arrays padded to the width. */
struct fv_merge {
    int count;
    uint32_t seed;              /* of the rounding's dither */
    float epsilon;              /* relative depth difference beyond which history is dropped */
    bool still;                 /* nothing moves: history is the pixel's own, and edges become a mean of both sides */
    const float *k;             /* FV_CACHE_OLDEST + 1: least weight of a new sample, by age */
    const uint32_t *sample;     /* colours; NULL: merged is what they are of, encoded only where it replaces history: */
    const float *red, *green, *blue; /* radiance */
    float exposure;
    const float *inverse_depth; /* of the samples; FV_DEPTH_UNKNOWN: the sample says nothing */
    const float *nearest, *farthest; /* of the inverse depths at and around the pixels: silhouettes are a mean of both sides */
    const int32_t *surface;     /* of the samples, enum fv_surface */
    const int32_t *replaced;    /* masks: what stands there is dropped */
    uint32_t *colour, *cache;   /* in: reprojected; out: merged, with FV_PIXEL_SAMPLED */
    bool apart;                 /* sampled light is kept apart (enum fv_plane); so are these, else unused: */
    const float *light_k;       /* as k */
    const uint32_t *sample_albedo, *sample_light;
    uint32_t *albedo, *light;
};

/* The worker's samples (scratch), which are traced, and encoded where light is kept apart, into the tile's blocks that
 * they were placed in. `replaced`: blocks whose history is dropped. */
void fv_merge_blocks(struct fv_frame *frame, const struct fv_tile *tile, uint64_t blocks, uint64_t replaced);

/* The support image's nodes that lie in the tile, each into its pixel. */
void fv_merge_nodes(struct fv_frame *frame, const struct fv_tile *tile);

/* Light of the tile's blocks that is worth one sample is smoothed where better light is near: the post filter of
 * Weier et al. 2016, section 3.5. Only where light is kept apart. */
void fv_merge_filter(struct fv_frame *frame, const struct fv_tile *tile, uint64_t blocks);

/* A tile into the coarser rasters, and the borders that it has with denser tiles into their rasters: colours that
 * these tiles' history is interpolated with. */
void fv_merge_coarse(struct fv_frame *frame, const struct fv_tile *tile);

/* Colours of a tile of the coarsest density into the coarse raster: whatever lies next to it finds them there. */
void fv_merge_double(struct fv_frame *frame, const struct fv_tile *tile);

/* What the raster of that density shows of the tile, into the coarser ones. */
void fv_merge_halve(struct fv_frame *frame, const struct fv_tile *tile, int density);

#endif
