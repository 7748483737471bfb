/* sample_all: every pixel, n samples each: the method `full`. */
#include "rt/pass/pass.h"

#include <string.h>

static int run(struct fv_frame *f, const struct fv_tile *tile)
{
    struct fv_worker_scratch *s = &f->scratch[tile->worker];
    uint32_t *colour = f->buffer[FV_COLOUR][tile->eye];
    uint64_t blocks = fv_tile_inside(f, tile);
    fv_tile_place(f, tile, blocks);
    fv_samples_trace_mean(f, tile, f->parameters.spp, false);
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
