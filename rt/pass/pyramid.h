/* pyramid: foveated sphere tracing of fields by an inverted pyramid (Polychronakis et al. 2023).
 *
 * Three levels: lowest, one value in 4 x 4 pixels; middle, one in 2 x 2; highest, the picture's own. They are the
 * engine's rasters FV_COARSEST, FV_COARSE and FV_FINE.
 *
 *   march    pass 1: of each 4 x 4 pixels, where rays in it may begin: FV_STARTS, by the ray parameter, infinite
 *            where there is nothing. By cones, of 8 x 8 and then 4 x 4 pixels, so that no start lies behind a
 *            surface; or, as in the paper, the distance of the ray through the middle (method.starts), of which
 *            rays take the least of 3 x 3.
 *   mask     passes 2 and 3: Sobel's operator on the starts tells edges; blocks of 4 x 4 pixels are masked, to be
 *            traced at the highest level: all within fovea.inner_deg of the gaze, none beyond fovea.outer_deg, edges
 *            between with the probability p = 0.90964 exp(-e / 2.9661) + 0.00792, e in degrees. (The paper prints
 *            the exponent without its minus.) Tiles without any are kept at the middle level, or, beyond
 *            method.lowest_deg, at the lowest one.
 *   trace    pass 4: masked blocks at the highest level, method.ssaa samples each; of the others the middle or the
 *            lowest level, in one of `refresh` frames; in between it is carried over.
 *   compose  pass 4 and 5: in tiles with masked blocks, the others from the middle level, interpolated; a Gaussian
 *            blur of pixels along the mask's edge where method.blur is on.
 *
 * Without foveation (method.foveation = off; IPR) every block is masked.
 *
 * Carried over (method.carry): tiles whose turn it is not are shown as the last frame showed them, each pixel from
 * where its block's start was then: that is where the surface is, but for a percent. Bilinear, of those pixels whose
 * start of then agrees, within the slope of the starts and what cones leave open, or moved along with it, within a
 * quarter of a pixel: others showed something else.
 * Blocks in which a pixel finds nothing (new to the view, uncovered, kept coarser then) are traced at once. No pixel is
 * interpolated more than refresh - 1 times before it is traced again, but where time runs out and carried tiles stand
 * in. Starts know of fields only: where the scene has triangles, too, all tiles are traced in every frame. Light that
 * moves is seen late by refresh - 1 frames at most, as in the paper, whose tiles stay as they are (method.carry = off),
 * which is right where nothing moves. */
#ifndef FV_PASS_PYRAMID_H
#define FV_PASS_PYRAMID_H

#include "rt/pass/pass.h"

/* Elements of FV_STARTS in a row. */
static inline int64_t fv_starts_stride(const struct fv_frame *frame)
{
    return frame->stride / FV_BLOCK;
}

/* Where rays of the block begin; x, y: blocks of the picture. */
static inline float fv_start_at(const struct fv_frame *frame, int eye, int64_t x, int64_t y)
{
    return ((const float *)frame->buffer[FV_STARTS][eye])[y * fv_starts_stride(frame) + x];
}

/* Half the diagonal of a square of `side` pixels, from above. */
static inline float fv_reach_px(int side)
{
    return 0.70711f * (float)side;
}

/* The probability that an edge is masked. */
float fv_edge_probability(float eccentricity_deg);

/* A tile of a lower level, as the kernel takes it. */
struct fv_carry {
    struct fv_map map;               /* from the picture to the last one */
    const struct fv_raster *raster;
    int shift;                       /* the raster's pixels x are in block x >> shift of the starts */
    int x0, y0, side;                /* first pixel and pixels a side, in the raster */
    uint64_t blocks;                 /* that are wanted; pixels of others may be written, too */
    const float *starts, *last_starts;
    int64_t stride;                  /* of the starts; how many of them a row and a column have, and the tile's first: */
    int columns, rows, block_x, block_y;
    float cone;                      /* by which share inverse starts of the same surface may differ */
    float together;                  /* inverse starts that differ by less may be interpolated, whatever they show */
    uint64_t failed;                 /* out: wanted blocks in which some pixel was not found */
};

/* Blocks of the tile, in its raster, from the last frame; returns those that are to be traced. */
uint64_t fv_pyramid_carry(struct fv_frame *frame, const struct fv_tile *tile, uint64_t blocks);

#endif
