/* attributes: what the method selective keeps of each sample of the central region; see selective.h. */
#include "rt/pass/selective.h"

#include <string.h>

/* In the periphery lights' maps will do. */
void fv_attributes_ask(struct fv_frame *f, const struct fv_tile *tile)
{
    /* What moves is smoothed by its own motion. */
    bool moves = f->pasts_kept > 0 && f->selective.every && f->tracer->instances > 0;
    bool central = fv_tile_within(f, tile, f->parameters.near_deg), kept = f->buffer[FV_IDENTITY][tile->eye];
    f->scratch[tile->worker].samples.identified = (central || moves) && tile->density == FV_FINE && kept;
    f->scratch[tile->worker].samples.mapped = !central && kept;
}

/* Words of the samples into the blocks that they are of. */
static void keep(const struct fv_frame *f, const struct fv_tile *tile, uint64_t blocks, enum fv_buffer buffer, const void *of)
{
    uint32_t *to = f->buffer[buffer][tile->eye];
    const uint32_t *from = of;
    for (; blocks && to; blocks &= blocks - 1)
        for (int y = 0; y < FV_BLOCK; y++, from += FV_BLOCK)
            memcpy(to + fv_block_row(f, tile, __builtin_ctzll(blocks), y), from, FV_BLOCK * sizeof *from);
}

void fv_attributes_keep(struct fv_frame *f, const struct fv_tile *tile, uint64_t blocks)
{
    struct fv_worker_scratch *w = &f->scratch[tile->worker];
    struct fv_samples *s = &w->samples;
    s->mapped = false;
    if (!s->identified) return;
    s->identified = false;
    int32_t stamp = (int32_t)((uint32_t)fv_identity_stamp(f) << FV_IDENTITY_STAMP_SHIFT);
    for (int i = 0; i < s->count; i++) s->identity[i] |= stamp;
    keep(f, tile, blocks, FV_BASE, w->pixel[FV_PLANE_BASE]);
    keep(f, tile, blocks, FV_IDENTITY, s->identity);
    keep(f, tile, blocks, FV_FACING, s->facing);
    keep(f, tile, blocks, FV_SECOND_IDENTITY, s->second_identity);
    keep(f, tile, blocks, FV_SECOND_FACING, s->second_facing);
    keep(f, tile, blocks, FV_TRIANGLE, s->triangle);
    keep(f, tile, blocks, FV_LIT, s->lit);
}

void fv_attributes_forget(struct fv_frame *f, const struct fv_tile *tile)
{
    uint32_t *identity = f->buffer[FV_IDENTITY][tile->eye];
    if (!identity || tile->density != FV_FINE) return;
    for (int y = 0; y < FV_TILE; y++) memset(identity + fv_tile_row(f, tile, y), 0, FV_TILE * sizeof *identity);
}
