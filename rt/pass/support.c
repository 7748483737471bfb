/* support: the support image and G-buffer: one sample every few pixels of the whole picture, so
 * that every part of it is known a little in every frame (Weier et al. 2016, section 3). */
#include "rt/pass/pass.h"

static void run(struct fv_frame *f, const struct fv_tile *tile)
{
    struct fv_worker_scratch *s = &f->scratch[tile->worker];
    struct fv_samples *samples = &s->samples;
    uint32_t *colour = f->buffer[FV_SUPPORT_COLOUR][tile->eye];
    float *depth = f->buffer[FV_SUPPORT_DEPTH][tile->eye];
    int side = FV_TILE / f->spacing;
    int64_t stride = f->stride / f->spacing;
    samples->count = side * side;
    for (int i = 0; i < samples->count; i++) {
        /* 4 x 4 nodes a packet. */
        int block = i / 16, x = block % (side / 4) * 4 + i % 4, y = block / (side / 4) * 4 + i % 16 / 4;
        samples->x[i] = (float)tile->x0 + ((float)x + 0.5f) * (float)f->spacing;
        samples->y[i] = (float)tile->y0 + ((float)y + 0.5f) * (float)f->spacing;
    }
    f->kernels->trace(f->tracer, &f->view[tile->eye], samples, (uint32_t)f->number, s->rays);
    f->kernels->encode(samples->red, samples->green, samples->blue, f->tracer->data->exposure, s->pixel,
                       samples->count);
    for (int i = 0; i < samples->count; i++) {
        int block = i / 16, x = block % (side / 4) * 4 + i % 4, y = block / (side / 4) * 4 + i % 16 / 4;
        int64_t node = (tile->y0 / f->spacing + y) * stride + tile->x0 / f->spacing + x;
        colour[node] = s->pixel[i];
        depth[node] = samples->inverse_depth[i];
    }
}

const struct fv_pass fv_pass_support = {"support", 0, FV_BIT(FV_SUPPORT_COLOUR) | FV_BIT(FV_SUPPORT_DEPTH), 0, run};
