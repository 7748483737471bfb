/* filter: separable filters over rows of floats, the part of the metrics that takes the time.
 *
 * Rows are read and written in whole steps of FV_FILTER_STEP elements: they have room for n rounded up
 * to that, and what lies beyond n is of no meaning. */
#ifndef FV_MEASURE_FILTER_H
#define FV_MEASURE_FILTER_H

#include <stddef.h>

enum { FV_FILTER_STEP = 16 };

/* out[x] = sum of weight[k] in[x + k], k from -radius to radius; weight points at the middle one. */
void fv_filter_across(float *restrict out, const float *restrict in, const float *weight, int radius, int n);

/* out[x] = sum of weight[k] row[k][offset + x], k from -radius to radius; both point at the middle one. */
void fv_filter_down(float *restrict out, const float *const *row, ptrdiff_t offset, const float *weight,
                    int radius, int n);

/* What stands in for index i outside of [0, n): the nearest inside; or the mirror image, the edge between
 * the first and its image, as often as it takes. */
int fv_border_nearest(int i, int n);
int fv_border_mirrored(int i, int n);

/* Sets the `radius` elements on both sides of row[0 .. n - 1]. */
void fv_border_extend(float *row, int n, int radius, int (*border)(int i, int n));

#endif
