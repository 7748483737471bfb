/* reproject: the pass around the kernel: skips tiles that are sampled whole, and asks for a sample
 * of every block where too little history arrived (disocclusions, parts new to the view), and of more of
 * those at depth edges. */
#include "rt/pass/reproject.h"

#include <math.h>

/* Blocks at depth edges, where reprojection goes wrong first, are sampled this many times as often:
 * half a decibel beyond the fovea for 5 % more rays. */
static const float edge_factor = 4;

void fv_reproject(struct fv_frame *f, const struct fv_tile *tile, uint64_t *edges, uint64_t *failed)
{
    int e = tile->eye, side = f->spacing;
    struct fv_reproject_tile t = {
        .map = f->map[e],
        .x0 = tile->x0,
        .y0 = tile->y0,
        .width = f->width,
        .height = f->height,
        .stride = f->stride,
        .history_colour = f->buffer[FV_HISTORY_COLOUR][e],
        .history_depth = f->buffer[FV_HISTORY_DEPTH][e],
        .spacing = side,
        .nodes_x = (f->width + side - 1) / side,
        .nodes_y = (f->height + side - 1) / side,
        .support_stride = f->stride / side,
        .support_colour = f->buffer[FV_SUPPORT_COLOUR][e],
        .support_depth = f->buffer[FV_SUPPORT_DEPTH][e],
        .epsilon = f->epsilon_depth,
        .colour = f->buffer[FV_COLOUR][e],
        .depth = f->buffer[FV_DEPTH][e],
    };
    if (!f->has_history) t.map = (struct fv_map){0}; /* leads nowhere: all is filled from the support image */
    f->kernels->reproject(&t);
    *edges = t.edges;
    *failed = t.failed;
}

static int run(struct fv_frame *f, const struct fv_tile *tile)
{
    uint64_t *selected = (uint64_t *)f->buffer[FV_SELECTED][0] + tile->index, edges, failed;
    uint64_t inside = fv_tile_inside(f, tile), more;
    struct fv_worker_scratch *s = &f->scratch[tile->worker];
    if (f->failed_blocks) f->failed_blocks[tile->index] = 0;
    if (*selected == inside || !f->has_history) return 0;
    fv_reproject(f, tile, &edges, &failed);
    failed &= inside;
    edges &= inside & ~failed;
    s->reprojected += __builtin_popcountll(inside);
    s->edges += __builtin_popcountll(edges);
    s->failed += __builtin_popcountll(failed);
    if (f->failed_blocks) f->failed_blocks[tile->index] = (uint8_t)__builtin_popcountll(failed);
    float p = edge_factor * f->parameters.foveal.p_min;
    more = failed;
    for (; edges; edges &= edges - 1) {
        int block = __builtin_ctzll(edges);
        if (fv_tile_threshold(f, tile, block) < p) more |= 1ull << block;
    }
    *selected |= more;
    return FV_TILE * FV_TILE;
}

/* The history's pixels, all of the tile moved by as much as the surface in its middle. */
static void stand_in(struct fv_frame *f, const struct fv_tile *tile)
{
    const uint64_t *selected = (const uint64_t *)f->buffer[FV_SELECTED][0] + tile->index;
    int e = tile->eye, middle = FV_TILE / 2;
    if (f->failed_blocks) f->failed_blocks[tile->index] = 0;
    if (*selected == fv_tile_inside(f, tile)) return;
    int64_t node =
        (tile->y0 + middle) / f->spacing * (f->stride / f->spacing) + (tile->x0 + middle) / f->spacing;
    float w = ((const float *)f->buffer[FV_SUPPORT_DEPTH][e])[node], to[3];
    const struct fv_map *map = &f->map[e];
    float x = (float)(tile->x0 + middle), y = (float)(tile->y0 + middle);
    if (!(w >= 0 && w <= FV_INVERSE_DEPTH_MAX)) w = 0;
    for (int i = 0; i < 3; i++) to[i] = map->m[i][0] * x + map->m[i][1] * y + map->m[i][2] + map->t[i] * w;
    float dx = to[2] > 1e-4f ? to[0] / to[2] - x : 0, dy = to[2] > 1e-4f ? to[1] / to[2] - y : 0;
    int moved_x = fabsf(dx) < 16384 ? (int)lroundf(dx) : 0,
        moved_y = fabsf(dy) < 16384 ? (int)lroundf(dy) : 0;
    for (int row = 0; row < FV_TILE; row++) {
        int from_y = tile->y0 + row + moved_y;
        from_y = from_y < 0 ? 0 : from_y >= f->height ? f->height - 1 : from_y;
        const uint32_t *colour = (const uint32_t *)f->buffer[FV_HISTORY_COLOUR][e] + from_y * f->stride;
        const float *depth = (const float *)f->buffer[FV_HISTORY_DEPTH][e] + from_y * f->stride;
        int64_t at = fv_tile_row(f, tile, row);
        uint32_t *out_colour = (uint32_t *)f->buffer[FV_COLOUR][e] + at;
        float *out_depth = (float *)f->buffer[FV_DEPTH][e] + at;
        for (int column = 0; column < FV_TILE; column++) {
            int from_x = tile->x0 + column + moved_x;
            from_x = from_x < 0 ? 0 : from_x >= f->width ? f->width - 1 : from_x;
            out_colour[column] = colour[from_x] & FV_PIXEL_COLOUR;
            out_depth[column] = depth[from_x];
        }
    }
}

static void expect(const struct fv_frame *f, const struct fv_parameters *p, const struct fv_rings *rings,
                   double units[2])
{
    double tiles = 0;
    float whole_deg = p->foveal.r0_deg - fv_radius_deg(&f->view[0], FV_TILE);
    if (!f->has_history || p->foveal.p_min >= 1) return;
    for (int d = 0; d < FV_DEGREES; d++)
        if ((float)d + 0.5f > whole_deg) tiles += (double)rings->tiles[d];
    units[0] = tiles * FV_TILE * FV_TILE;
}

double fv_reproject_share(const struct fv_frame *f, const struct fv_foveal *foveal, float p)
{
    float at_edges = fminf(1, edge_factor * foveal->p_min);
    p += f->edge_share * fmaxf(0, at_edges - p);
    return (double)(p + f->failed_share * (1 - p));
}

const struct fv_pass fv_pass_reproject = {
    .name = "reproject",
    .reads = FV_BIT(FV_HISTORY_COLOUR) | FV_BIT(FV_HISTORY_DEPTH) | FV_BIT(FV_SUPPORT_COLOUR) |
             FV_BIT(FV_SUPPORT_DEPTH) | FV_BIT(FV_SELECTED),
    .writes = FV_BIT(FV_COLOUR) | FV_BIT(FV_DEPTH) | FV_BIT(FV_SELECTED),
    .needs = FV_NEEDS_NOISE | FV_NEEDS_HISTORY,
    .run = run,
    .stand_in = stand_in,
    .expect = expect};
