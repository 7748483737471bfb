/* rank: see rank.h. */
#include "rt/measure/rank.h"

#include <math.h>
#include <stdlib.h>

static int compare(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

void fv_rank_sort(double *value, int n)
{
    qsort(value, (size_t)n, sizeof *value, compare);
}

double fv_rank_percentile(const double *sorted, int n, double percent)
{
    int rank = (int)ceil(percent / 100 * n);
    return sorted[rank < 1 ? 0 : rank - 1];
}
