/* select: which blocks of a tile are sampled: those whose blue-noise threshold lies below the
 * foveal function at their centre. Most tiles lie wholly inside r0 or beyond r1, where the
 * function is constant; only between is it evaluated block by block. */
#include "rt/pass/pass.h"

static int run(struct fv_frame *f, const struct fv_tile *tile)
{
    const struct fv_view *view = &f->view[tile->eye];
    const struct fv_foveal *foveal = &f->parameters.foveal;
    uint64_t *selected = (uint64_t *)f->buffer[FV_SELECTED][0] + tile->index, mask = 0;
    float half = 0.5f * FV_TILE, radius = fv_radius_deg(view, FV_TILE) + fv_radius_deg(view, FV_BLOCK);
    float centre = fv_eccentricity_deg(view, (float)tile->x0 + half, (float)tile->y0 + half);
    float outer_deg = foveal->r1_deg > foveal->r0_deg ? foveal->r1_deg : foveal->r0_deg;
    bool constant = centre + radius <= foveal->r0_deg || centre - radius >= outer_deg;
    float p = fv_foveal_probability(foveal, centre);
    uint64_t inside = fv_tile_inside(f, tile);
    if (!f->has_history || (constant && p >= 1)) {
        *selected = inside;
        return 1;
    }
    for (int block = 0; block < FV_BLOCKS * FV_BLOCKS; block++) {
        /* At the block's nearest point: a block that r0 touches is sampled whole. */
        if (!constant)
            p = fv_foveal_probability(foveal, fv_tile_eccentricity_deg(f, tile, block) - fv_radius_deg(view, FV_BLOCK));
        mask |= (uint64_t)(fv_tile_threshold(f, tile, block) < p) << block;
    }
    *selected = mask & inside;
    return 1;
}

static void expect(const struct fv_frame *f, const struct fv_parameters *p, const struct fv_rings *rings,
                   double units[2])
{
    (void)p, (void)rings;
    units[0] = f->tiles;
}

const struct fv_pass fv_pass_select = {
    .name = "select", .writes = FV_BIT(FV_SELECTED), .needs = FV_NEEDS_GAZE | FV_NEEDS_NOISE, .run = run, .expect = expect};
