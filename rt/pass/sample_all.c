/* sample_all: every pixel, n stratified samples each: the method `full`. One sample goes through
 * the pixel's centre; more are spread over sqrt(n) x sqrt(n) strata (n that is no square: a
 * rank-1 lattice), the same for every pixel, so that packets stay coherent. */
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

/* The mean radiance of spp samples of every pixel of the masked blocks. */
static void trace_mean(struct fv_frame *f, const struct fv_tile *tile, uint64_t blocks, int spp)
{
    struct fv_worker_scratch *s = &f->scratch[tile->worker];
    struct fv_samples *samples = &s->samples;
    float *channel[3] = {samples->red, samples->green, samples->blue};
    fv_tile_place(f, tile, blocks);
    int n = samples->count;
    float before[2] = {0, 0}, offset[2], sum[3][FV_SAMPLES_MAX] = {0};
    for (int k = 0; k < spp; k++) {
        stratum(k, spp, offset);
        for (int i = 0; i < n; i++) {
            samples->x[i] += offset[0] - before[0];
            samples->y[i] += offset[1] - before[1];
        }
        memcpy(before, offset, sizeof before);
        uint32_t seed = (uint32_t)f->number * (uint32_t)spp + (uint32_t)k; /* wraps */
        f->kernels->trace(f->tracer, &f->view[tile->eye], samples, seed, s->rays);
        for (int c = 0; c < 3; c++)
            for (int i = 0; i < n; i++) sum[c][i] += channel[c][i];
    }
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < n; i++) channel[c][i] = sum[c][i] / (float)spp;
    f->kernels->encode(samples->red, samples->green, samples->blue, f->tracer->data->exposure,
                       s->pixel[FV_PLANE_BASE], n);
}

static int run(struct fv_frame *f, const struct fv_tile *tile)
{
    struct fv_worker_scratch *s = &f->scratch[tile->worker];
    uint32_t *colour = f->buffer[FV_COLOUR][tile->eye];
    uint64_t blocks = fv_tile_inside(f, tile);
    if (f->parameters.spp > 1) trace_mean(f, tile, blocks, f->parameters.spp);
    else fv_tile_trace(f, tile, blocks);
    const uint32_t *pixel = s->pixel[FV_PLANE_BASE];
    int traced = s->samples.count * f->parameters.spp;
    for (; blocks; blocks &= blocks - 1, pixel += FV_BLOCK * FV_BLOCK) {
        int block = __builtin_ctzll(blocks);
        for (int y = 0; y < FV_BLOCK; y++)
            memcpy(colour + fv_block_row(f, tile, block, y),
                   pixel + y * FV_BLOCK, FV_BLOCK * sizeof *pixel);
    }
    return traced;
}

static void expect(const struct fv_frame *f, const struct fv_parameters *p, const struct fv_rings *rings,
                   double units[2])
{
    (void)rings;
    units[0] = (double)f->eyes * f->width * f->height * p->spp;
}

const struct fv_pass fv_pass_sample_all = {
    .name = "sample_all", .writes = FV_BIT(FV_COLOUR), .order = FV_ORDER_NEED, .run = run, .expect = expect};
