/* reproject: last frame's pixels carried into the new view by the support G-buffer's coarse mesh,
 * looked up backwards (Weier et al. 2016, section 3.2; METHODS: whichever way is faster), and what of it has
 * to be sampled again (section 3.3). */
#ifndef FV_PASS_REPROJECT_H
#define FV_PASS_REPROJECT_H

#include "rt/pass/pass.h"

/* Moving objects in one tile; what more there are is taken from the support image. */
enum { FV_TILE_OBJECTS = 8 };

/* One tile of one eye, as the kernel takes it. */
struct fv_reproject_tile {
    struct fv_map map;               /* from the raster's pixels to those of its history */
    bool moves, stirs;               /* something in the scene moves; something of the tile is elsewhere now */
    int objects;                     /* that nodes in and around the tile show */
    uint8_t object[FV_TILE_OBJECTS]; /* their numbers, and maps of what is fixed to them */
    struct fv_map object_map[FV_TILE_OBJECTS];
    const struct fv_raster *raster;
    int coarsers;                    /* rasters whose history is looked up where the raster's own fails, in turn */
    const struct fv_raster *coarser[FV_DENSITIES - 1];
    int x0, y0, side;                /* first pixel and pixels a side, in the raster */
    float middle;                    /* inverse depth of the tile's middle */
    float footprint;                 /* pixels of the history that one pixel spans; above 1.25 it is filtered */
    bool sharp;                      /* history is interpolated by cubics, not linearly */
    float spacing, node[2];          /* raster pixels between support nodes; the first one's place */
    int nodes_x, nodes_y;            /* nodes that the picture covers */
    int planes;                      /* images of colours: FV_PLANES where sampled light is kept apart */
    int64_t support_stride, support_plane;
    const uint32_t *support_colour;
    const float *support_depth;
    const uint8_t *support_surface;
    float epsilon;                   /* relative depth difference that still is the same surface */
    bool still;                      /* nothing moves: history is the pixel's own, whatever a node's depth says */
    float epsilon_luminance;         /* step between nodes that marks the pixels between them, of full scale 1 */
    uint64_t marked; /* out: blocks that lie between nodes of different depth or luminance, or at grazing ones */
    uint64_t failed; /* out: blocks in which a quarter of the pixels found no history that was ever sampled, or which
                      * show what moves otherwise than its surface */
};

/* What became of a tile. */
struct fv_reprojected {
    uint64_t marked, failed; /* blocks, as above */
};

/* One tile, whatever was selected of it; from the support image alone where there is no history. */
struct fv_reprojected fv_reproject(struct fv_frame *frame, const struct fv_tile *tile);

/* The probability of marked blocks beyond r1, with these parameters: that of method.resample times p_min. Nearer
 * to the gaze others are sampled as often. */
float fv_resample_probability(const struct fv_frame *frame, const struct fv_parameters *parameters, int density);

/* The share of reprojected blocks that is sampled in the end, where p of them are chosen and p_marked of those
 * that are marked, going by the marks and failures of the frame before. */
double fv_reproject_share(const struct fv_frame *frame, float p, float p_marked);

#endif
