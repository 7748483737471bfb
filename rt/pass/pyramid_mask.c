/* mask: edges of the starts, and what of the picture is traced at the highest level; see pyramid.h. */
#include "rt/pass/pyramid.h"

#include <math.h>

float fv_edge_probability(float e)
{
    return 0.90964f * expf(-e / 2.9661f) + 0.00792f;
}

/* Sobel's operator on the distances, against the nearest of them: of a slope it is no larger near than far. What
 * has something on one side and nothing on the other is an edge. */
static bool edge(const struct fv_frame *f, int eye, int x, int y)
{
    int columns = fv_blocks_along(f->width), rows = fv_blocks_along(f->height);
    float v[3][3], nearest = INFINITY, farthest = 0;
    for (int j = 0; j < 3; j++)
        for (int i = 0; i < 3; i++) {
            v[j][i] = fv_start_at(f, eye, fv_clamp(x + i - 1, columns), fv_clamp(y + j - 1, rows));
            nearest = fminf(nearest, v[j][i]);
            farthest = fmaxf(farthest, v[j][i]);
        }
    if (!(farthest < INFINITY)) return nearest < INFINITY;
    float across = v[0][2] + 2 * v[1][2] + v[2][2] - v[0][0] - 2 * v[1][0] - v[2][0];
    float along = v[2][0] + 2 * v[2][1] + v[2][2] - v[0][0] - 2 * v[0][1] - v[0][2];
    return across * across + along * along > f->pyramid.edge * f->pyramid.edge * nearest * nearest;
}

static uint64_t masked(const struct fv_frame *f, const struct fv_tile *tile, uint64_t inside)
{
    const struct fv_foveal *foveal = &f->parameters.foveal;
    float nearest = fv_tile_eccentricity_deg(f, tile, 27) - fv_tile_reach_deg(&f->view[tile->eye]);
    uint64_t mask = 0;
    if (nearest > fmaxf(foveal->r0_deg, foveal->r1_deg)) return 0;
    for (; inside; inside &= inside - 1) {
        int block = __builtin_ctzll(inside);
        float e = fv_tile_eccentricity_deg(f, tile, block);
        bool is = fv_tile_nearest_deg(f, tile, block) <= foveal->r0_deg;
        if (!is && e <= foveal->r1_deg) {
            int x = tile->x0 / FV_BLOCK + block % FV_BLOCKS, y = tile->y0 / FV_BLOCK + block / FV_BLOCKS;
            /* The same in all frames: what came and went would flicker. */
            is = fv_noise_threshold(f->noise, x + 29 * tile->eye, y + 37 * tile->eye, 0) <
                     f->parameters.p_scale * fv_edge_probability(e) &&
                 edge(f, tile->eye, x, y);
        }
        mask |= (uint64_t)is << block;
    }
    return mask;
}

static int run(struct fv_frame *f, const struct fv_tile *at)
{
    struct fv_tile tile = *at;
    struct fv_tile_state *state = &f->state[tile.index];
    uint64_t *selected = (uint64_t *)f->buffer[FV_MASKED][0] + tile.index;
    tile.density = FV_FINE;
    *selected = fv_tile_inside(f, &tile);
    if (f->pyramid.foveated) *selected = masked(f, &tile, *selected);
    float middle = fv_tile_eccentricity_deg(f, &tile, 27) - fv_tile_reach_deg(&f->view[tile.eye]);
    state->density = *selected ? FV_FINE : middle > f->pyramid.lowest_deg ? FV_COARSEST : FV_COARSE;
    return 1;
}

static void expect(const struct fv_frame *f, const struct fv_parameters *p, const struct fv_rings *rings,
                   double units[2])
{
    (void)p, (void)rings;
    units[0] = f->tiles;
}

const struct fv_pass fv_pass_mask = {.name = "mask",
                                     .reads = FV_BIT(FV_STARTS),
                                     .writes = FV_BIT(FV_MASKED),
                                     .needs = FV_NEEDS_GAZE | FV_NEEDS_NOISE | FV_NEEDS_DENSITIES,
                                     .run = run,
                                     .expect = expect};
