/* smooth: pictures smoothed over time (Kim, Ko and Ihm 2021, section 4.7): what is shown of a pixel is the mean of its
 * colour and of those that up to selective.smooth frames before showed of the same place, the i-th before by the weight
 * (1 - alpha)^i, alpha by eccentricity (fv_smoothing_at). What is kept for the frames to come is not smoothed.
 *
 * A place is looked up between four pixels, bilinearly: the nearest one would jump by up to half a pixel from frame to
 * frame. Of the four those count that were sampled in their frame and whose depths lie between those of the 3 x 3 pixels
 * around the place now, which keeps silhouettes smooth; but of these only such as moved together since, to a pixel, or
 * what is uncovered would show what covered it. Where they weigh less than all four, so does their frame. Means are
 * taken in linear light, as refine's are.
 *
 * Where only a share of the periphery is sampled, pixels of the central region alone are smoothed, less and less towards
 * its border: beyond, history is blended otherwise. */
#ifndef FV_PASS_SMOOTH_H
#define FV_PASS_SMOOTH_H

#include "rt/pass/backproject.h"

/* A row of pixels. */
struct fv_smooth {
    struct fv_row row;
    int pasts;
    struct fv_backproject past[FV_PAST_MAX];
    const float *rest, *share; /* by pixel: 1 - alpha, and a factor on the weights of frames before */
    uint32_t *smoothed;        /* out; flags as in the row's colours */
};

#endif
