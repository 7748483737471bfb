/* sample: traces the selected blocks and merges them over what was reprojected: replaced in the
 * fovea, where no history arrived and where the depth differs; blended elsewhere (Weier et al.
 * 2016, section 3.4, with a fixed weight). */
#include "rt/pass/reproject.h"

/* history + alpha * (sample - history) in each 10-bit channel, to the nearest. */
static inline uint32_t blend(uint32_t history, uint32_t sample, int alpha_256)
{
    uint32_t out = 0;
    for (int shift = 0; shift < 30; shift += 10) {
        int h = history >> shift & 1023, s = sample >> shift & 1023;
        out |= (uint32_t)(h + (((s - h) * alpha_256 + 128) >> 8)) << shift; /* >> rounds both ways alike */
    }
    return out;
}

static bool foveal(const struct fv_frame *f, const struct fv_tile *tile, int block)
{
    /* Half a block more than r0: blocks that r0 only touches are in the fovea too. */
    float margin_deg = 2.9f * f->view[tile->eye].pixel_deg;
    return fv_tile_eccentricity_deg(f, tile, block) <= f->parameters.foveal.r0_deg + margin_deg;
}

/* `whole`: what stands there is no history. A sample of unknown depth leaves what was reprojected. */
static void merge_block(struct fv_frame *f, const struct fv_tile *tile, int block, const uint32_t *pixel,
                        const float *depth, bool whole)
{
    bool replace = whole || foveal(f, tile, block);
    int alpha = (int)(f->alpha * 256.0f + 0.5f);
    for (int y = 0; y < FV_BLOCK; y++) {
        int64_t at = fv_tile_row(f, tile, block / FV_BLOCKS * FV_BLOCK + y) + block % FV_BLOCKS * FV_BLOCK;
        uint32_t *out = (uint32_t *)f->buffer[FV_COLOUR][tile->eye] + at;
        float *out_depth = (float *)f->buffer[FV_DEPTH][tile->eye] + at;
        for (int x = 0; x < FV_BLOCK; x++, pixel++, depth++) {
            if (*depth < 0 && !whole && !(out[x] & FV_PIXEL_FILLED)) continue;
            float larger = *depth > out_depth[x] ? *depth : out_depth[x];
            float difference = *depth > out_depth[x] ? *depth - out_depth[x] : out_depth[x] - *depth;
            bool fresh = replace || (out[x] & FV_PIXEL_FILLED) || difference > f->epsilon_depth * larger;
            out[x] = FV_PIXEL_SAMPLED | (fresh ? *pixel : blend(out[x], *pixel, alpha));
            out_depth[x] = *depth;
        }
    }
}

static int run(struct fv_frame *f, const struct fv_tile *tile)
{
    struct fv_worker_scratch *s = &f->scratch[tile->worker];
    uint64_t blocks = ((uint64_t *)f->buffer[FV_SELECTED][0])[tile->index];
    /* A tile that is sampled whole was not reprojected: what stands there is no history. */
    bool whole = blocks == fv_tile_inside(f, tile);
    if (!blocks) return 0;
    fv_tile_trace(f, tile, blocks);
    int traced = s->samples.count;
    for (int n = 0; blocks; blocks &= blocks - 1, n += FV_BLOCK * FV_BLOCK) {
        int block = __builtin_ctzll(blocks);
        merge_block(f, tile, block, s->pixel + n, s->samples.inverse_depth + n, whole);
    }
    return traced;
}

/* A tile that was to be sampled whole was not reprojected; others stay as they are. */
static void stand_in(struct fv_frame *f, const struct fv_tile *tile)
{
    uint64_t blocks = ((uint64_t *)f->buffer[FV_SELECTED][0])[tile->index], edges, failed;
    if (blocks == fv_tile_inside(f, tile)) fv_reproject(f, tile, &edges, &failed);
}

static void expect(const struct fv_frame *f, const struct fv_parameters *p, const struct fv_rings *rings,
                   double units[2])
{
    double all = 0, whole = 0, sparse = 0;
    float whole_deg = p->foveal.r0_deg - fv_radius_deg(&f->view[0], FV_TILE);
    for (int d = 0; d < FV_DEGREES; d++) {
        float e = (float)d + 0.5f;
        all += (double)rings->pixels[d];
        if (e <= whole_deg) whole += (double)rings->tiles[d] * FV_TILE * FV_TILE;
        sparse += (double)rings->pixels[d] * fv_reproject_share(f, &p->foveal, fv_foveal_probability(&p->foveal, e));
    }
    if (!f->has_history || p->foveal.p_min >= 1) whole = all;
    whole = whole < all ? whole : all;
    units[0] = sparse > whole ? sparse - whole : 0;
    if (!f->has_history) units[0] = 0;
    units[1] = whole;
}

const struct fv_pass fv_pass_sample = {.name = "sample",
                                       .reads = FV_BIT(FV_SELECTED) | FV_BIT(FV_COLOUR) | FV_BIT(FV_DEPTH),
                                       .writes = FV_BIT(FV_COLOUR) | FV_BIT(FV_DEPTH),
                                       .needs = FV_NEEDS_GAZE,
                                       .order = FV_ORDER_NEED,
                                       .whole = FV_TILE * FV_TILE,
                                       .run = run,
                                       .stand_in = stand_in,
                                       .expect = expect};
