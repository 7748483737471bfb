/* rank: order statistics of measured numbers. */
#ifndef FV_MEASURE_RANK_H
#define FV_MEASURE_RANK_H

#include "rt/measure/row.h"

/* Sorts the n numbers, the smallest first; none of them NaN. */
void fv_rank_sort(double *value, int n);

/* The percentile of n >= 1 sorted numbers by nearest rank: the one at ceil(percent n / 100), counted from 1;
 * the first for a percent of 0. `percent` in [0, 100]. */
double fv_rank_percentile(const double *sorted, int n, double percent);

/* Median and quartiles, by sorting the n numbers; NaN where there are none. */
struct fv_measured fv_rank_quartiles(double *value, int n);

#endif
