/* accumulate: light of paths over the frames (method denoise; after SVGF, Schied et al. 2017, section 4.1): what a pixel's paths
 * bring is mixed, before the filter, with the mean that the last frame had where it showed the same place:
 *
 *   mean' = mean + (light - mean) / (n + 1), n: the frames that `mean` is of, at most denoise.history
 *
 * Where that was: by the pixel's own depth and the motion of what it shows (objects take their light along), bilinear over those
 * of the four pixels around that show the same object, near the pixel's tangent plane or at its depth (both to
 * method.epsilon_depth), with a normal less than 20 degrees off. Where these are less than a sixteenth of the place, light
 * starts anew. Pixels without light of their own take the mean as it is.
 *
 * What is ours: where light moves, frames count for less, by two tests.
 *
 *   window  a block, and 3 x 3 of them (within the tile): d, the mean of light - mean (luma), s its pixels' standard deviation,
 *           in the window or in the tile, whichever is more, so that windows without a rare bright path do not
 *           pass for sure; N their number. Means of noise lie within 3 s / sqrt(N) of 0, of a single block 6. Beyond, what exceeds
 *           it is taken for how far history is off, and n is at most s^2 / (d^2 - 9 s^2 / N): the weight that leaves the least
 *           error of both. The lesser counts.
 *   pixel   where that leaves less than 8 frames: what of the mean lies more than FV_ACCUMULATE_SIGMAS standard deviations beyond light's mean over
 *           5 x 5 pixels counts the same way. Everywhere that would darken what rare bright paths light: between two of them
 *           their mean lies beyond all that there is around.
 *
 * Light is kept as the filter has it (atrous.h), 9 bits a channel. It is rounded up or down by chance, so that its mean over
 * frames is exact: else steps below half a unit would be lost, and those of rare bright paths would not. */
#ifndef FV_PASS_ACCUMULATE_H
#define FV_PASS_ACCUMULATE_H

#include "rt/pass/pass.h"

/* What a pixel showed (FV_TRACK): bits 13 to 31 its inverse depth, to 1/4096 (a float's exponent and upper mantissa), 8 to 12 the
 * moving object, 0 to 7 the frames that its light is of. 0: nothing. Before the pass, where objects move: as `identity` of struct
 * fv_samples. */
enum { FV_TRACK_OBJECT_SHIFT = 8, FV_TRACK_FRAMES = 255 };

#define FV_ACCUMULATE_SIGMAS 3.0f

/* Frames at most where lights of the scene move: light and shadows are nowhere the same for long. */
enum { FV_ACCUMULATE_MOVED = 3 };

/* A tile's part of the picture. Planes are the picture's, from its pixel (0, 0) on, 64 bytes beyond them readable; those of the
 * last frame NULL where there is none. */
struct fv_accumulate {
    int x, y, columns, rows;
    int width, height;
    int64_t stride;
    int most;                       /* frames, 1 to 255 */
    uint32_t seed;                  /* of rounding: another in every frame */
    bool moves;                     /* `track` holds identities */
    float epsilon;                  /* relative difference of depths */
    const struct fv_view *before;   /* the last frame's */
    const struct fv_map *map;       /* to it, of what is fixed to each object; [0]: to none */
    const uint32_t *light;          /* of this frame's paths */
    const float *inverse_depth;
    const uint32_t *facing;
    const uint32_t *mean_before, *track_before, *facing_before;
    uint32_t *track, *mean, *filtered; /* out: the last two the same */
    float *variance;                /* of light, in: this frame's; out: of the mean. NULL: not known */
    bool empty;                     /* out: surfaces are left without light */
};

/* Whether this frame's light is accumulated, and so kept for the next. */
static inline bool fv_accumulates(const struct fv_frame *f)
{
    return f->buffer[FV_HISTORY_MEAN][0] && f->denoise.history > 0;
}

/* Whether pixels of this layer take paths in this frame (denoise.rate): of the outer one, where there is history, those of every
 * second block, like a chequerboard, the eyes in turn, so that packets of rays are whole. */
static inline bool fv_layer_due(const struct fv_frame *f, int eye, int layer, int x, int y)
{
    if (f->denoise.rate < 2 || layer < FV_LAYERS - 1 || !f->has_mean || !fv_accumulates(f)) return true;
    return ((x / FV_BLOCK + y / FV_BLOCK + eye + (int)(f->number & 1)) & 1) == 0;
}

#endif
