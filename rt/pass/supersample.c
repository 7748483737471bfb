/* supersample: means of several samples a pixel, for the passes that take more than one. */
#include "rt/pass/pass.h"

#include <math.h>
#include <string.h>

/* Offset of sample i of n from the pixel's centre, each in [-0.5, 0.5). */
static void stratum(int i, int n, float offset[2])
{
    int side = (int)lroundf(sqrtf((float)n));
    if (side * side == n) {
        offset[0] = ((float)(i % side) + 0.5f) / (float)side - 0.5f;
        offset[1] = ((float)(i / side) + 0.5f) / (float)side - 0.5f;
        return;
    }
    offset[0] = ((float)i + 0.5f) / (float)n - 0.5f;
    float v = 0.5f + (float)i * 0.61803399f;
    offset[1] = v - floorf(v) - 0.5f;
}

void fv_samples_trace_mean(struct fv_frame *f, const struct fv_tile *tile, int spp)
{
    struct fv_worker_scratch *s = &f->scratch[tile->worker];
    struct fv_samples *samples = &s->samples;
    float *channel[3] = {samples->red, samples->green, samples->blue};
    int n = samples->count;
    float size = (float)(1 << tile->density), before[2] = {0, 0}, offset[2], sum[3][FV_SAMPLES_MAX] = {0};
    for (int k = 0; k < spp; k++) {
        stratum(k, spp, offset);
        for (int i = 0; i < n; i++) {
            samples->x[i] += size * (offset[0] - before[0]);
            samples->y[i] += size * (offset[1] - before[1]);
        }
        memcpy(before, offset, sizeof before);
        uint32_t seed = (uint32_t)f->number * (uint32_t)spp + (uint32_t)k; /* wraps */
        f->kernels->trace(f->tracer, &f->view[tile->eye], samples, seed, s->rays);
        for (int c = 0; c < 3; c++)
            for (int i = 0; i < n; i++) sum[c][i] += channel[c][i];
    }
    for (int i = 0; i < n; i++) samples->x[i] -= size * before[0], samples->y[i] -= size * before[1];
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < n; i++) channel[c][i] = sum[c][i] / (float)spp;
    f->kernels->encode(samples->red, samples->green, samples->blue, f->tracer->data->exposure,
                       s->pixel[FV_PLANE_BASE], n);
}
