/* pass: from tile numbers to tiles, and the tracing of a tile's blocks that passes share. */
#include "rt/pass/pass.h"

struct run {
    const struct fv_pass *pass;
    struct fv_frame *frame;
};

struct fv_tile fv_tile_at(const struct fv_frame *f, int index, int worker)
{
    int per_eye = f->tiles_x * f->tiles_y, in_eye = index % per_eye;
    return (struct fv_tile){.index = index, .eye = index / per_eye, .worker = worker,
                            .x0 = in_eye % f->tiles_x * FV_TILE, .y0 = in_eye / f->tiles_x * FV_TILE};
}

static void run_tile(void *context, int index, int worker)
{
    const struct run *run = context;
    struct fv_tile tile = fv_tile_at(run->frame, index, worker);
    run->pass->run(run->frame, &tile);
}

void fv_pass_run(const struct fv_pass *pass, struct fv_frame *frame, struct fv_workers *workers)
{
    struct run run = {pass, frame};
    fv_workers_run(workers, frame->tiles, run_tile, &run);
}

uint64_t fv_tile_inside(const struct fv_frame *f, const struct fv_tile *tile)
{
    int columns = (f->width - tile->x0 + FV_BLOCK - 1) / FV_BLOCK;
    int rows = (f->height - tile->y0 + FV_BLOCK - 1) / FV_BLOCK;
    uint64_t row = columns >= FV_BLOCKS ? 0xff : (1u << columns) - 1, mask = 0;
    for (int y = 0; y < rows && y < FV_BLOCKS; y++) mask |= row << (8 * y);
    return mask;
}

float fv_tile_threshold(const struct fv_frame *f, const struct fv_tile *tile, int block)
{
    int x = tile->x0 / FV_BLOCK + block % FV_BLOCKS, y = tile->y0 / FV_BLOCK + block / FV_BLOCKS;
    return fv_noise_threshold(f->noise, x + 29 * tile->eye, y + 37 * tile->eye, f->number);
}

float fv_tile_eccentricity_deg(const struct fv_frame *f, const struct fv_tile *tile, int block)
{
    float x = (float)(tile->x0 + block % FV_BLOCKS * FV_BLOCK) + 0.5f * FV_BLOCK;
    float y = (float)(tile->y0 + block / FV_BLOCKS * FV_BLOCK) + 0.5f * FV_BLOCK;
    return fv_eccentricity_deg(&f->view[tile->eye], x, y);
}

void fv_tile_place(struct fv_frame *f, const struct fv_tile *tile, uint64_t blocks)
{
    struct fv_samples *samples = &f->scratch[tile->worker].samples;
    int n = 0;
    for (uint64_t left = blocks; left; left &= left - 1) {
        int block = __builtin_ctzll(left);
        float x = (float)(tile->x0 + block % FV_BLOCKS * FV_BLOCK) + 0.5f;
        float y = (float)(tile->y0 + block / FV_BLOCKS * FV_BLOCK) + 0.5f;
        for (int i = 0; i < FV_BLOCK * FV_BLOCK; i++) {
            samples->x[n + i] = x + (float)(i % FV_BLOCK);
            samples->y[n + i] = y + (float)(i / FV_BLOCK);
        }
        n += FV_BLOCK * FV_BLOCK;
    }
    samples->count = n;
}

void fv_tile_trace(struct fv_frame *f, const struct fv_tile *tile, uint64_t blocks)
{
    struct fv_worker_scratch *s = &f->scratch[tile->worker];
    struct fv_samples *samples = &s->samples;
    fv_tile_place(f, tile, blocks);
    if (samples->count == 0) return;
    f->kernels->trace(f->tracer, &f->view[tile->eye], samples, (uint32_t)f->number, s->rays);
    f->kernels->encode(samples->red, samples->green, samples->blue, f->tracer->data->exposure, s->pixel,
                       samples->count);
}
