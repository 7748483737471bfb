/* select: how dense a tile is, and which of its blocks are sampled: those whose blue-noise threshold lies
 * below the foveal function at their centre, and all that r0 touches. Most tiles lie wholly inside r0 or beyond
 * r1, where the function is constant; only between is it evaluated block by block. */
#include "rt/pass/cache.h"
#include "rt/pass/pass.h"

/* What is coarser now has no history in the denser rasters. */
static void choose_density(struct fv_frame *f, struct fv_tile *tile, float middle_deg)
{
    struct fv_tile_state *state = &f->state[tile->index];
    state->density = (uint8_t)fv_ring_density(f, &f->parameters, middle_deg);
    state->reprojected = 0;
    tile->density = state->density;
    for (int d = 0; d < tile->density; d++) {
        const struct fv_raster *denser = &f->raster[d][tile->eye];
        for (int y = 0; y < FV_TILE >> d && (state->holds[0] >> d & 1); y++)
            for (int x = 0; x < FV_TILE >> d; x++)
                denser->cache[((tile->y0 >> d) + y) * denser->stride + (tile->x0 >> d) + x] = FV_CACHE_NONE;
    }
    state->holds[0] = (uint8_t)(FV_HELD_ALL << tile->density);
}

static int run(struct fv_frame *f, const struct fv_tile *at)
{
    const struct fv_view *view = &f->view[at->eye];
    const struct fv_foveal *foveal = &f->parameters.foveal;
    struct fv_tile tile = *at;
    uint64_t *selected = (uint64_t *)f->buffer[FV_SELECTED][0] + tile.index, mask = 0;
    float half = 0.5f * FV_TILE, radius = fv_tile_reach_deg(view);
    float centre = fv_eccentricity_deg(view, (float)tile.x0 + half, (float)tile.y0 + half);
    float outer_deg = foveal->r1_deg > foveal->r0_deg ? foveal->r1_deg : foveal->r0_deg;
    bool constant = centre + radius <= foveal->r0_deg || centre - radius >= outer_deg;
    if (f->state) choose_density(f, &tile, centre);
    float p = fv_block_probability(f, fv_foveal_probability(foveal, centre), tile.density, f->spacing);
    uint64_t inside = fv_tile_inside(f, &tile);
    if (!f->has_history || (constant && p >= 1)) {
        *selected = inside;
        return 1;
    }
    if (constant && FV_BLOCK << fv_cluster_shift(f, tile.density) >= fv_tile_side(&tile)) {
        *selected = fv_tile_threshold(f, &tile, 0) < p ? inside : 0;
        return 1;
    }
    for (uint64_t left = inside; left; left &= left - 1) {
        int block = __builtin_ctzll(left);
        if (!constant) {
            float e = fv_tile_eccentricity_deg(f, &tile, block);
            bool touched = e - fv_radius_deg(view, (float)(FV_BLOCK << tile.density)) <= foveal->r0_deg;
            p = touched ? 1 : fv_block_probability(f, fv_foveal_probability(foveal, e), tile.density, f->spacing);
        }
        mask |= (uint64_t)(fv_tile_threshold(f, &tile, block) < p) << block;
    }
    *selected = mask;
    return 1;
}

static void expect(const struct fv_frame *f, const struct fv_parameters *p, const struct fv_rings *rings,
                   double units[2])
{
    (void)p, (void)rings;
    units[0] = f->tiles;
}

const struct fv_pass fv_pass_select = {
    .name = "select", .writes = FV_BIT(FV_SELECTED) | FV_BIT(FV_CACHE) | FV_BIT(FV_COARSE_CACHE), .needs = FV_NEEDS_GAZE | FV_NEEDS_NOISE, .run = run, .expect = expect};
