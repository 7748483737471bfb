/* filter: see filter.h. A step's sums stay in registers over all weights. */
#include "rt/measure/filter.h"

#include <string.h>

void fv_filter_across(float *restrict out, const float *restrict in, const float *weight, int radius, int n)
{
    for (int x = 0; x < n; x += FV_FILTER_STEP) {
        float sum[FV_FILTER_STEP] = {0};
        for (int k = -radius; k <= radius; k++)
            for (int i = 0; i < FV_FILTER_STEP; i++) sum[i] += weight[k] * in[x + k + i];
        memcpy(out + x, sum, sizeof sum);
    }
}

void fv_filter_down(float *restrict out, const float *const *row, ptrdiff_t offset, const float *weight, int radius,
                    int n)
{
    for (int x = 0; x < n; x += FV_FILTER_STEP) {
        float sum[FV_FILTER_STEP] = {0};
        for (int k = -radius; k <= radius; k++) {
            const float *in = row[k] + offset + x;
            for (int i = 0; i < FV_FILTER_STEP; i++) sum[i] += weight[k] * in[i];
        }
        memcpy(out + x, sum, sizeof sum);
    }
}

int fv_border_nearest(int i, int n)
{
    return i < 0 ? 0 : i < n ? i : n - 1;
}

int fv_border_mirrored(int i, int n)
{
    int period = 2 * n, at = (i % period + period) % period;
    return at < n ? at : period - 1 - at;
}

void fv_border_extend(float *row, int n, int radius, int (*border)(int i, int n))
{
    for (int k = 1; k <= radius; k++) {
        row[-k] = row[border(-k, n)];
        row[n - 1 + k] = row[border(n - 1 + k, n)];
    }
}
