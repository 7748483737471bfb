/* fringe: the pass that gives a finished picture its lens's colours; see fringe.h. Run only for frames that the display
 * wants, after present, where red or blue differ from green. */
#include "rt/pass/fringe.h"

#include "rt/pass/pass.h"
#include "rt/pass/unseen.h"

#include <math.h>

void fv_fringe_set(struct fv_fringe *fringe, const struct fv_bend *b)
{
    double square = (double)b->most * (double)b->most;
    fringe->per_square = square > 0 ? (float)(FV_LENS_STEPS / square) : 0;
    for (int c = 0; c < 2; c++)
        for (int i = 0; i < FV_LENS_STEPS + 2; i++) {
            int step = i < FV_LENS_STEPS ? i : FV_LENS_STEPS;
            fringe->ratio[c][i] = (float)fv_bend_fringe(b, c, (double)b->most * sqrt((double)step / FV_LENS_STEPS));
        }
}

static int run(struct fv_frame *f, const struct fv_tile *tile)
{
    const struct fv_bend *b = &f->view[tile->eye].bend;
    struct fv_fringe_row row = {.bend = b, .table = f->fringe, .green = f->buffer[FV_GREEN][tile->eye], .stride = (int)f->stride,
                                .width = f->width, .height = f->height, .x = tile->x0, .count = FV_TILE};
    for (int y = tile->y0; y < tile->y0 + FV_TILE; y++) {
        row.y = y;
        row.to = (uint32_t *)f->buffer[FV_PICTURE][tile->eye] + (int64_t)y * f->stride + tile->x0;
        f->kernels->fringe(&row);
        if (b->masks) fv_darken_unseen(b, tile->x0, y, FV_TILE, row.to);
    }
    return 1;
}

const struct fv_pass fv_pass_fringe = {
    .name = "fringe", .reads = FV_BIT(FV_GREEN), .writes = FV_BIT(FV_PICTURE), .run = run};
