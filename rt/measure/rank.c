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

struct fv_measured fv_rank_quartiles(double *value, int n)
{
    if (n < 1) return (struct fv_measured){(double)NAN, (double)NAN, (double)NAN};
    fv_rank_sort(value, n);
    double median = n % 2 ? value[n / 2] : (value[n / 2 - 1] + value[n / 2]) / 2;
    return (struct fv_measured){median, fv_rank_percentile(value, n, 25), fv_rank_percentile(value, n, 75)};
}
