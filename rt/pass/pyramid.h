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
 *   sharpen  beyond the paper: where four pixels of a lower level that lie around a point differ in colour by more than
 *            method.contrast, what lies between their middles is traced at the highest level: outlines, checks, the
 *            edges of shadows. The rest of such tiles is interpolated. Where only checks differ, no ray is needed: light
 *            is interpolated, and each pixel has checks of its own; this is done from a quarter of that difference on.
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

#include <string.h>

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

/* Whether a cone of that radius at distance 1 stopped so long before the hit that it was hardly at the same surface,
 * seen at a slant or told of by a bound that is far from the distance. */
static inline bool fv_stopped_before(float start, float hit, float radius)
{
    const float gap = 16, share = 0.1f;
    return start < hit * (1 - share) && hit - start > gap * radius * start;
}

/* The probability that an edge is masked. */
float fv_edge_probability(float eccentricity_deg);

/* Rows of a lower level's tile and of the pixels around it, first to last: of each four that lie around a point, whether
 * some channel differs by more than `step` of 1024 times the brightest channel and a quarter, and by more than `faint`.
 * Errors show in the dark: a step of full scale alone would pass them over. n points a row, a bit each from bit 0 on;
 * n at most 17 and as many rows of them. */
enum { FV_CONTRAST_POINTS = FV_TILE / 2 + 1 };
struct fv_contrast {
    int n, step, faint;
    _Alignas(64) uint32_t pixel[FV_CONTRAST_POINTS + 1][FV_TILE + FV_TILE / 2]; /* padded for the kernel */
    uint32_t out[FV_CONTRAST_POINTS], faintly[FV_CONTRAST_POINTS];
};

/* A lower level's pixel that shows a field's checks: the part, and its inverse depth, which is near enough; 0: it shows
 * something else, or is not known to have been traced in this frame. */
enum { FV_SEEN_PART = 511 };
static inline uint32_t fv_seen(int part, float inverse_depth)
{
    uint32_t bits;
    memcpy(&bits, &inverse_depth, sizeof bits);
    return ((bits + FV_SEEN_PART / 2) & ~(uint32_t)FV_SEEN_PART) | (uint32_t)(part + 1);
}

/* Cells between four neighbouring pixels of a lower level, each of the size x size pixels of the picture that lie between
 * their middles. Where the four show the same part's checks, lie on a plane and are lit alike, the cell's pixels have
 * their colour with checks of their own in place of theirs. */
enum { FV_CELLS_MAX = FV_CONTRAST_POINTS * FV_CONTRAST_POINTS, FV_CELLS_PADDED = (FV_CELLS_MAX + 15) / 16 * 16 };
enum { FV_CELL_PIXELS = 96 * 16 }; /* of 9 x 9 of 4 x 4; of 17 x 17 of 2 x 2 they are fewer; padded */
struct fv_repaint {
    const struct fv_scene *scene;
    const struct fv_view *view;
    int count;
    const int32_t *column, *row; /* of the cells: their first pixel, in rows of pixels; padded, as what follows */
    float x0, y0, size;          /* the lower level's: the first's middle, and how far apart they are: 2 or 4 */
    const uint32_t *pixel, *seen; /* rows of them */
    int stride;                  /* of both */
    int32_t *painted;            /* out: mask of each cell */
    uint32_t *colour;            /* out: of painted ones, cell by cell, row by row */
};

/* A tile of a level, as the kernel takes it. */
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

/* Colours of the worker's samples, which were placed in the tile, from its blocks' starts; spp of each, whose rays share
 * a cone of their own first where they are many. Returns rays. */
int fv_pyramid_shade(struct fv_frame *frame, const struct fv_tile *tile, int spp);

/* Whether the tile stays as it was at the highest level, but for what is masked. */
static inline bool fv_pyramid_stays(const struct fv_frame *frame, const struct fv_tile *tile)
{
    const struct fv_tile_state *state = &frame->state[tile->index];
    return state->waits && !frame->pyramid.carry && state->holds[0] & 1;
}

/* What a tile of a lower level shows, interpolated, into the highest level's blocks. */
void fv_pyramid_fill(struct fv_frame *frame, const struct fv_tile *tile, uint64_t blocks);

/* Blocks of the tile, in its raster, from the last frame; returns those that are to be traced. */
uint64_t fv_pyramid_carry(struct fv_frame *frame, const struct fv_tile *tile, uint64_t blocks);

#endif
