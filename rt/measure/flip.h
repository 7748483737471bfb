/* flip: the LDR FLIP of Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild, "FLIP: A
 * Difference Evaluator for Alternating Images", HPCG 2020, in steps of one row, so that the caller may
 * go down a picture with a ring of rows. Its filters are Gaussians or sums of two, and so separable.
 *
 * A picture's row enters as luminance and two opponent channels (fv_flip_opponent), is filtered across
 * into FV_FLIP_PLANES planes, these down into FV_FLIP_ROWS rows, and two pictures' rows are judged. */
#ifndef FV_MEASURE_FLIP_H
#define FV_MEASURE_FLIP_H

#include <stddef.h>

enum { FV_FLIP_RADIUS_MAX = 136, FV_FLIP_PLANES = 7, FV_FLIP_ROWS = 8 };

struct fv_flip_filter {
    int radius;
    float weight[2 * FV_FLIP_RADIUS_MAX + 1];
};

struct fv_flip {
    /* Contrast sensitivity: luminance, red to green, and two terms of blue to yellow. */
    struct fv_flip_filter sensitivity[4], sensitivity_down[4];
    /* Gaussian, its first derivative (edges) and its second (points). */
    struct fv_flip_filter feature[3];
    int radius;       /* the largest */
    float colour_max; /* the largest colour difference, to the power of q_c */
};

/* ppd: pixels per degree; outside of [1, 1000] the nearer end. */
void fv_flip_set(struct fv_flip *flip, double ppd);

/* channel[0..2][x] = Y, X - Y, Y - Z of linear r, g, b in [0, 1]; white is (1, 0, 0). */
void fv_flip_opponent(const float *restrict red, const float *restrict green, const float *restrict blue,
                      float *const channel[3], int n);

/* plane[i * stride + x]; the channels reach `flip->radius` elements beyond both ends. */
void fv_flip_across(const struct fv_flip *flip, float *const channel[3], float *plane, ptrdiff_t stride,
                    int n);

/* row[k] + offset: the planes of the row k below, k from -radius to radius. out: FV_FLIP_ROWS rows of
 * `stride`: lightness and the two opponent colours, edges, points, and scratch. */
void fv_flip_down(const struct fv_flip *flip, const float *const *row, ptrdiff_t offset, float *out,
                  ptrdiff_t stride, int n);

/* FLIP of a row, 0 to 1, from the two pictures' rows of fv_flip_down. */
void fv_flip_judge(const struct fv_flip *flip, const float *reference, const float *test, ptrdiff_t stride,
                   float *out, int n);

#endif
