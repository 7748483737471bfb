/* filter: see filter.h. A step's sums stay in registers over all weights. Vectors are written out here:
 * over the weights, which compilers may choose otherwise, they would cost more than they save. */
#include "rt/measure/filter.h"

#include "rt/trace/simd.h"

enum { VECTORS = FV_FILTER_STEP / FV_WIDTH };

static inline void add_weighted(vf sum[VECTORS], const float *in, float weight)
{
    for (int i = 0; i < VECTORS; i++) sum[i] += vf_of(weight) * vf_load(in + i * FV_WIDTH);
}

static inline void store(float *out, const vf sum[VECTORS])
{
    for (int i = 0; i < VECTORS; i++) vf_store(out + i * FV_WIDTH, sum[i]);
}

void fv_filter_across(float *restrict out, const float *restrict in, const float *weight, int radius, int n)
{
    for (int x = 0; x < n; x += FV_FILTER_STEP) {
        vf sum[VECTORS] = {{0}};
        for (int k = -radius; k <= radius; k++) add_weighted(sum, in + x + k, weight[k]);
        store(out + x, sum);
    }
}

void fv_filter_down(float *restrict out, const float *const *row, ptrdiff_t offset, const float *weight,
                    int radius, int n)
{
    for (int x = 0; x < n; x += FV_FILTER_STEP) {
        vf sum[VECTORS] = {{0}};
        for (int k = -radius; k <= radius; k++) add_weighted(sum, row[k] + offset + x, weight[k]);
        store(out + x, sum);
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
