/* sample: traces the selected blocks and merges them over what was reprojected. Where history is not kept
 * (as in Weier et al. 2016, section 3.4) it is replaced in the fovea and in resampled blocks. */
#include "rt/pass/merge.h"
#include "rt/pass/reproject.h"
#include "rt/pass/selective.h"

/* Blocks that touch r0. */
static uint64_t foveal(const struct fv_frame *f, const struct fv_tile *tile, uint64_t blocks)
{
    uint64_t mask = 0;
    for (; blocks; blocks &= blocks - 1) {
        int block = __builtin_ctzll(blocks);
        mask |= (uint64_t)(fv_tile_nearest_deg(f, tile, block) <= f->parameters.foveal.r0_deg) << block;
    }
    return mask;
}

/* A raster's rows of the tile that have bits in `rows`. One of each is read, since a prefetch of a page whose
 * translation is not at hand is dropped. */
static void fetch_rows(const struct fv_raster *r, int64_t first, int side, uint32_t rows)
{
    (void)*(const volatile uint32_t *)(r->colour + first);
    (void)*(const volatile uint32_t *)(r->cache + first);
    for (; rows; rows &= rows - 1) {
        int64_t row = first + __builtin_ctz(rows) * r->stride;
        fv_fetch(r->cache + row, side * (int)sizeof *r->cache);
        fv_fetch(r->colour + row, side * (int)sizeof *r->colour);
    }
}

/* What the blocks are merged into, and what that is halved into, on its way while rays are traced. */
static void fetch(const struct fv_frame *f, const struct fv_tile *tile, uint64_t blocks)
{
    fetch_rows(fv_tile_raster(f, tile), fv_tile_row(f, tile, 0), fv_tile_side(tile), fv_block_rows(blocks));
    for (int d = tile->density + 1; d < FV_DENSITIES; d++) {
        const struct fv_raster *r = &f->raster[d][tile->eye];
        fetch_rows(r, (tile->y0 >> d) * r->stride + (tile->x0 >> d), FV_TILE >> d, ~0u >> (32 - (FV_TILE >> d)));
    }
}

static int run(struct fv_frame *f, const struct fv_tile *tile)
{
    struct fv_worker_scratch *s = &f->scratch[tile->worker];
    uint64_t blocks = ((uint64_t *)f->buffer[FV_SELECTED][0])[tile->index], replaced = 0;
    if (!blocks) return 0;
    fetch(f, tile, blocks);
    fv_attributes_ask(f, tile);
    fv_tile_trace(f, tile, blocks);
    if (fv_light_apart(f) || s->samples.identified) fv_samples_encode(f, tile);
    fv_attributes_keep(f, tile, blocks);
    if (!f->state[tile->index].reprojected) replaced = blocks;
    else if (!f->keep)
        replaced = foveal(f, tile, blocks) | ((uint64_t *)f->buffer[FV_RESAMPLED][0])[tile->index];
    fv_merge_blocks(f, tile, blocks, replaced);
    if (fv_light_apart(f)) fv_merge_filter(f, tile, blocks);
    fv_merge_coarse(f, tile);
    return s->samples.count;
}

/* A tile that was to be sampled whole may not have been reprojected; others stay as they are. */
static void stand_in(struct fv_frame *f, const struct fv_tile *tile)
{
    if (!f->state[tile->index].reprojected) fv_reproject(f, tile);
    fv_attributes_forget(f, tile);
    fv_merge_coarse(f, tile);
}

static void expect(const struct fv_frame *f, const struct fv_parameters *p, const struct fv_rings *rings,
                   double units[2])
{
    double all = 0, whole = 0, sparse = 0;
    float radius_deg = fv_radius_deg(&f->view[0], FV_TILE);
    for (int d = 0; d < FV_DEGREES; d++) {
        float e = (float)d + 0.5f;
        int density = fv_ring_density(f, p, e);
        double pixels = (double)rings->pixels[d] / fv_density_pixels(density);
        float share = fv_block_probability(f, fv_foveal_probability(&p->foveal, e), density, p->spacing);
        all += pixels;
        if (e <= p->foveal.r0_deg - radius_deg) whole += (double)rings->tiles[d] * FV_TILE * FV_TILE;
        sparse += pixels * fv_reproject_share(f, share, fv_resample_probability(f, p, density));
    }
    if (!f->has_history || p->foveal.p_min >= 1) whole = all;
    whole = whole < all ? whole : all;
    units[0] = sparse > whole ? sparse - whole : 0;
    if (!f->has_history) units[0] = 0;
    units[1] = whole;
}

const struct fv_pass fv_pass_sample = {
    .name = "sample",
    .reads = FV_RASTERS << FV_HISTORY_COLOUR | FV_RASTERS << FV_COLOUR | FV_BIT(FV_SUPPORT_COLOUR) |
             FV_BIT(FV_SUPPORT_DEPTH) | FV_BIT(FV_SUPPORT_SURFACE) | FV_BIT(FV_SELECTED) | FV_BIT(FV_RESAMPLED),
    .writes = FV_RASTERS << FV_COLOUR,
    .offers = FV_BIT(FV_BASE) | FV_BIT(FV_IDENTITY) | FV_BIT(FV_FACING) | FV_BIT(FV_SECOND_IDENTITY) | FV_BIT(FV_SECOND_FACING),
    .needs = FV_NEEDS_GAZE,
    .order = FV_ORDER_NEED,
    .whole = FV_TILE * FV_TILE,
    .run = run,
    .stand_in = stand_in,
    .expect = expect};
