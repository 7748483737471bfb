/* gather: one sample a pixel, with attributes in the central region: what the method selective starts from where every
 * pixel of the periphery is sampled, too. */
#include "rt/pass/cache.h"
#include "rt/pass/selective.h"

#include <string.h>

/* As many samples of the tile to their pixels as were traced. */
static void put(struct fv_frame *f, const struct fv_tile *tile, uint64_t blocks)
{
    struct fv_worker_scratch *s = &f->scratch[tile->worker];
    uint32_t *colour = f->buffer[FV_COLOUR][tile->eye], *cache = f->buffer[FV_CACHE][tile->eye];
    const uint32_t *pixel = s->pixel[FV_PLANE_BASE];
    const float *w = s->samples.inverse_depth;
    const int32_t *surface = s->samples.surface;
    for (; blocks; blocks &= blocks - 1)
        for (int y = 0; y < FV_BLOCK; y++, pixel += FV_BLOCK, w += FV_BLOCK, surface += FV_BLOCK) {
            int64_t at = fv_block_row(f, tile, __builtin_ctzll(blocks), y);
            memcpy(colour + at, pixel, FV_BLOCK * sizeof *pixel);
            for (int x = 0; cache && x < FV_BLOCK; x++) cache[at + x] = cache_of_sample(w[x], surface[x]);
        }
}

static int run(struct fv_frame *f, const struct fv_tile *tile)
{
    uint64_t blocks = fv_tile_inside(f, tile);
    fv_tile_place(f, tile, blocks);
    fv_attributes_ask(f, tile);
    fv_samples_trace(f, tile, 1);
    fv_samples_encode(f, tile);
    fv_attributes_keep(f, tile, blocks);
    put(f, tile, blocks);
    return f->scratch[tile->worker].samples.count;
}

static void expect(const struct fv_frame *f, const struct fv_parameters *p, const struct fv_rings *rings,
                   double units[2])
{
    (void)p, (void)rings;
    units[0] = (double)f->eyes * f->width * f->height;
}

const struct fv_pass fv_pass_gather = {
    .name = "gather",
    .writes = FV_BIT(FV_COLOUR) | FV_BIT(FV_BASE) | FV_BIT(FV_IDENTITY) | FV_BIT(FV_FACING) | FV_BIT(FV_SECOND_IDENTITY) |
              FV_BIT(FV_SECOND_FACING) | FV_BIT(FV_TRIANGLE) | FV_BIT(FV_LIT),
    .offers = FV_BIT(FV_CACHE),
    .needs = FV_NEEDS_GAZE,
    .order = FV_ORDER_NEED,
    .run = run,
    .expect = expect};
