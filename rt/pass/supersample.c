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

/* Pixels that stand in the list, and what their samples came to. */
struct pixels {
    int count;
    float x[FV_SAMPLES_MAX], y[FV_SAMPLES_MAX], start[FV_SAMPLES_MAX];
    float sum[3][FV_SAMPLES_MAX], nearest[FV_SAMPLES_MAX];
};

/* `each` samples of each of the pixels from `from` up to `to`, a pixel's side by side. */
static void trace_some(struct fv_frame *f, const struct fv_tile *tile, struct pixels *p, int from, int to,
                       const float offset[][2], int each, uint32_t seed)
{
    struct fv_worker_scratch *w = &f->scratch[tile->worker];
    struct fv_samples *s = &w->samples;
    s->count = (to - from) * each;
    for (int i = from, at = 0; i < to; i++)
        for (int k = 0; k < each; k++, at++) {
            s->x[at] = p->x[i] + offset[k][0];
            s->y[at] = p->y[i] + offset[k][1];
            s->start[at] = p->start[i];
        }
    f->kernels->trace(f->tracer, &f->view[tile->eye], s, seed, w->rays);
    const float *channel[3] = {s->red, s->green, s->blue};
    for (int i = from, at = 0; i < to; i++)
        for (int k = 0; k < each; k++, at++) {
            for (int c = 0; c < 3; c++) p->sum[c][i] += channel[c][at];
            p->nearest[i] = fmaxf(p->nearest[i], s->inverse_depth[at]);
        }
}

static void put_means(struct fv_samples *s, const struct pixels *p, int spp)
{
    size_t bytes = (size_t)p->count * sizeof(float);
    float *channel[3] = {s->red, s->green, s->blue};
    s->count = p->count;
    memcpy(s->x, p->x, bytes);
    memcpy(s->y, p->y, bytes);
    memcpy(s->start, p->start, bytes);
    memcpy(s->inverse_depth, p->nearest, bytes);
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < p->count; i++) channel[c][i] = p->sum[c][i] / (float)spp;
}

/* What is sampled at random differs by sample only from one list to the next. */
void fv_samples_trace_mean(struct fv_frame *f, const struct fv_tile *tile, int spp)
{
    enum { EACH_MAX = 16 };
    struct fv_worker_scratch *w = &f->scratch[tile->worker];
    struct fv_samples *s = &w->samples;
    struct pixels p = {.count = s->count};
    size_t bytes = (size_t)s->count * sizeof(float);
    float size = (float)(1 << tile->density), offset[EACH_MAX][2];
    int most = f->tracer->data->features & FV_SCENE_STOCHASTIC ? 1 : EACH_MAX;
    memcpy(p.x, s->x, bytes);
    memcpy(p.y, s->y, bytes);
    memcpy(p.start, s->start, bytes);
    for (int k = 0; k < spp; k += most) {
        int each = spp - k < most ? spp - k : most, pixels = FV_SAMPLES_MAX / each;
        for (int i = 0; i < each; i++) {
            stratum(k + i, spp, offset[i]);
            offset[i][0] *= size, offset[i][1] *= size;
        }
        uint32_t seed = (uint32_t)f->number * (uint32_t)spp + (uint32_t)k; /* wraps */
        for (int i = 0; i < p.count; i += pixels)
            trace_some(f, tile, &p, i, i + pixels < p.count ? i + pixels : p.count, (const float(*)[2])offset, each, seed);
    }
    put_means(s, &p, spp);
    f->kernels->encode(s->red, s->green, s->blue, f->tracer->data->exposure, w->pixel[FV_PLANE_BASE], s->count);
}
