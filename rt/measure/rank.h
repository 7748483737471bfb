/* rank: order statistics of measured numbers. */
#ifndef FV_MEASURE_RANK_H
#define FV_MEASURE_RANK_H

/* Sorts the n numbers, the smallest first; none of them NaN. */
void fv_rank_sort(double *value, int n);

/* The percentile of n >= 1 sorted numbers by nearest rank: the one at ceil(percent n / 100), counted from 1;
 * the first for a percent of 0. `percent` in [0, 100]. */
double fv_rank_percentile(const double *sorted, int n, double percent);

#endif
