/* flicker: see flicker.h. */
#include "rt/measure/flicker.h"

#include <assert.h>
#include <math.h>

/* The four pixels around a point, and their weights. */
struct corners {
    int64_t column[2], row[2];
    double across[2], down[2];
};

static void set_axis(double at, int n, int64_t index[2], double weight[2])
{
    index[0] = (int64_t)at;
    index[1] = index[0] + 1 < n ? index[0] + 1 : index[0];
    weight[1] = at - (double)index[0];
    weight[0] = 1 - weight[1];
}

/* False where pixel centres do not surround (x, y), as for NaN. */
static bool set_corners(struct corners *c, double x, double y, int width, int height)
{
    double u = x - 0.5, v = y - 0.5;
    if (!(u >= 0 && u <= width - 1 && v >= 0 && v <= height - 1)) return false;
    set_axis(u, width, c->column, c->across);
    set_axis(v, height, c->row, c->down);
    return true;
}

static double depth_at(const struct corners *c, const float *inverse_depth, int64_t stride)
{
    double sum = 0;
    for (int j = 0; j < 2; j++)
        for (int i = 0; i < 2; i++) {
            double weight = c->across[i] * c->down[j]; /* 0 hides even NaN */
            if (weight > 0) sum += weight * (double)inverse_depth[c->row[j] * stride + c->column[i]];
        }
    return sum;
}

/* Sum of the channels' absolute differences between a pixel and the picture there. */
static double difference_at(const struct corners *c, const uint8_t *now,
                            const struct fv_metrics_picture *before)
{
    double sum = 0;
    for (int k = 0; k < 3; k++) {
        double value = 0;
        for (int j = 0; j < 2; j++)
            for (int i = 0; i < 2; i++)
                value += c->across[i] * c->down[j] *
                         before->pixel[c->row[j] * before->stride_bytes + c->column[i] * before->step + k];
        sum += fabs(now[k] - value);
    }
    return sum;
}

double fv_flicker(const struct fv_metrics_picture *now, const struct fv_metrics_picture *before,
                  const struct fv_map *map, const float *inverse_depth, const float *inverse_depth_before,
                  int64_t stride)
{
    assert(now->width == before->width && now->height == before->height);
    double sum = 0;
    int64_t pixels = 0;
    for (int y = 0; y < now->height; y++)
        for (int x = 0; x < now->width; x++) {
            double w = (double)inverse_depth[y * stride + x], seen[3];
            struct corners corners;
            for (int i = 0; i < 3; i++)
                seen[i] = (double)map->m[i][0] * (x + 0.5) + (double)map->m[i][1] * (y + 0.5) +
                          (double)map->m[i][2] + (double)map->t[i] * w;
            if (!(w >= 0 && seen[2] > 0)) continue;
            if (!set_corners(&corners, seen[0] / seen[2], seen[1] / seen[2], now->width, now->height))
                continue;
            double expected = w / seen[2], found = depth_at(&corners, inverse_depth_before, stride);
            if (!(fabs(found - expected) <= 0.01 * expected)) continue;
            sum += difference_at(&corners, now->pixel + y * now->stride_bytes + x * now->step, before);
            pixels++;
        }
    return pixels ? sum / (3 * 255 * (double)pixels) : NAN;
}
