/* selective: Whitted's ray tracing with extra samples where pixels differ and the eye looks (Kim, Ko, Ihm 2021).
 *
 * Every pixel of the central region (within selective.near_deg of the gaze) is sampled once, at its centre, and with
 * its colour are kept the attributes of what it shows: FV_BASE, FV_IDENTITY and FV_FACING, and of what the first hit mirrors or
 * lets through in scenes that have such. Around each corner of four pixels lie four quarters of a pixel, the paper's
 * subpixels, all of which are tested against the same four pixels: so corners are tested, once each.
 *
 * Step 1: tau_sel is the least threshold of the attributes in which the four disagree, tau_col where they agree. Step
 * 2: the corner fails where in a channel the contrast (max - min) / (max + min) of the four colours is above
 * tau_fov(e) tau_sel (1.36, 1.02, 2.04). Colours are codes of 10 bits as displays take them; a step of one code is no
 * contrast, and neither is black beside black. Normals disagree by more than selective.facing_deg.
 *
 * Most corners that fail do so by texture alone. Where the four pixels agree in all attributes, are lit by the same lights, show
 * opaque triangles that stand still, and lie in one plane, to 1 % of the distance, what lies between them is taken for known:
 * samples there are shaded on the planes of the pixels' triangles, and no ray is traced (selective.texture = fetch, which is
 * ours; trace: rays, as in the paper).
 *
 * A subpixel at a corner that failed takes the mean of n extra samples, stratified and jittered, n by the region that
 * the corner lies in; others the four colours interpolated, 9 : 3 : 3 : 1. Pixels along the picture's border have
 * corners that are none: they keep what they have; so do those beyond the central region. */
#ifndef FV_PASS_SELECTIVE_H
#define FV_PASS_SELECTIVE_H

#include "rt/pass/pass.h"

/* Corners of a tile a side, and rows of 32-bit words that hold its pixels and those around it, padded for loads. */
enum { FV_CORNERS = FV_TILE + 1, FV_AROUND = FV_TILE + 2, FV_AROUND_ROW = FV_TILE + 32 };

/* A row of corners, as the kernel takes it: pixels i and i + 1 of the rows above and below lie around corner i. Rows are
 * read up to 16 beyond the last pixel. */
struct fv_corners {
    int count;
    const uint32_t *base[2], *identity[2], *facing[2];
    const uint32_t *second_identity[2], *second_facing[2]; /* NULL: none are kept */
    int stamp;              /* of identities of this frame: others are not known */
    const uint32_t *triangle[2], *lit[2], *cache[2]; /* NULL: nothing is known of what lies between pixels */
    const struct fv_view *view;
    float x, y;             /* of the first corner, in the picture */
    const float *tolerance; /* tau_fov of each; negative: it is not tested */
    const struct fv_selective *settings;
    uint64_t tested, failed; /* out: a bit a corner, the first in bit 0 */
    uint64_t known;          /* of those that failed: that lie on one surface, evenly lit */
};

/* A row of pixels. Around pixel i lie the pixels i to i + 2 of three rows of linear colours. */
struct fv_resolve {
    int count;
    const float *around[3][3];       /* of channel and row */
    const float *extra[3];           /* of channel: sums of the extra samples' radiances, each divided by 4 n */
    uint32_t reused;                 /* pixels that stay as they are */
    uint64_t tested[2], failed[2];   /* corners above and below: i is left of pixel i, i + 1 right of it */
    float exposure;
    uint32_t *colour;                /* in and out; 0 to 15 behind the last are written, too, as they were */
};

/* FV_IDENTITY says from its bit 27 on in which frame it was kept: attributes of tiles that were left out are not taken for
 * this frame's. */
enum { FV_IDENTITY_STAMP_SHIFT = 27 };

static inline int fv_identity_stamp(const struct fv_frame *frame)
{
    return 1 + (int)(frame->number % 31);
}

/* Asks the tracer for attributes where the tile has pixels of the central region; and keeps them, of the blocks that
 * were traced. Like what follows they do nothing where the method keeps none. */
void fv_attributes_ask(struct fv_frame *frame, const struct fv_tile *tile);
void fv_attributes_keep(struct fv_frame *frame, const struct fv_tile *tile, uint64_t blocks);

/* Extra samples that each of the tile's pixels took in the frame that the loop rendered last, row by row, FV_TILE a row:
 * its corners are tested once more, by what the buffers still hold. For measurements; no frame needs it. */
void fv_refine_counts(const struct fv_frame *frame, const struct fv_tile *tile, uint16_t *samples);

/* Of a tile that is left out: stamps come around. */
void fv_attributes_forget(struct fv_frame *frame, const struct fv_tile *tile);

#endif
