/* reproject: the pass around the kernel: skips tiles that are sampled whole, and asks for a sample
 * of every block where too little history arrived (disocclusions, parts new to the view), and of more of
 * those at depth edges. */
#include "rt/pass/reproject.h"

/* Blocks at depth edges, where reprojection goes wrong first, are sampled this many times as often:
 * half a decibel beyond the fovea for 5 % more rays. */
static const float edge_factor = 4;

static void run(struct fv_frame *f, const struct fv_tile *tile)
{
    uint64_t *selected = (uint64_t *)f->buffer[FV_SELECTED][0] + tile->index;
    uint64_t inside = fv_tile_inside(f, tile);
    if (*selected == inside || !f->has_history) return;
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
    f->kernels->reproject(&t);
    float p = edge_factor * f->parameters.foveal.p_min;
    for (uint64_t left = t.edges; left; left &= left - 1) {
        int block = __builtin_ctzll(left);
        if (fv_tile_threshold(f, tile, block) < p) t.failed |= 1ull << block;
    }
    *selected |= t.failed & inside;
}

const struct fv_pass fv_pass_reproject = {
    "reproject",
    FV_BIT(FV_HISTORY_COLOUR) | FV_BIT(FV_HISTORY_DEPTH) | FV_BIT(FV_SUPPORT_COLOUR) | FV_BIT(FV_SUPPORT_DEPTH) |
        FV_BIT(FV_SELECTED),
    FV_BIT(FV_COLOUR) | FV_BIT(FV_DEPTH) | FV_BIT(FV_SELECTED), FV_NEEDS_NOISE, run};
