/* turn: the pass that turns a late picture to the newest head; see turn.h. Run only for pictures that are late. */
#include "rt/pass/turn.h"

#include "rt/pass/pass.h"
#include "rt/pass/unseen.h"

#include <math.h>

static const double degree = 0.017453292519943295;

void fv_unbend_set(struct fv_unbend *unbend, const struct fv_bend *b)
{
    double most = (double)b->most, end = most * (double)fv_bend_scale(b, b->most * b->most);
    double far = 1 - 1 / sqrt(1 + end * end), beside = 1.5 * (double)b->step[0];
    *unbend = (struct fv_unbend){.per_unit = (float)(FV_UNBEND_STEPS / far), .edge = 1e6f};
    /* Neighbours that a lookup there mixes in are seen, too. */
    if (b->masks) unbend->edge = (float)fmax(0, (double)b->shown - beside);
    for (int i = 0; i < FV_UNBEND_STEPS + 2; i++) {
        double x = far * (i < FV_UNBEND_STEPS ? i : FV_UNBEND_STEPS) / FV_UNBEND_STEPS, t = sqrt(x * (2 - x)) / (1 - x);
        unbend->ratio[i] = (float)(t > 1e-9 ? fv_bend_radius(b, t) / t : 1);
    }
}

bool fv_turn_set(struct fv_frame *f, const struct fv_pose *head)
{
    bool still = true;
    if (!fv_pose_sound(head) || !(fv_quat_angle(f->view[0].pose.rotation, head->rotation) <= FV_TURN_MOST_DEG * degree)) return false;
    for (int e = 0; e < f->eyes; e++) {
        struct fv_view now = f->view[e];
        struct fv_map map;
        for (int i = 0; i < 4; i++) now.pose.rotation[i] = head->rotation[i];
        fv_map_set(&map, &now, &f->view[e]);
        for (int i = 0; i < 3; i++)
            for (int k = 0; k < 3; k++) f->turn->m[e][i][k] = map.m[i][k];
        still = still && fv_map_still(&map, &now);
    }
    return !still;
}

_Static_assert((int)FV_TURN_SIDE == (int)FV_TILE, "a tile is what a kernel turns");

/* Whether some pixel of the square of FV_TILE at (x, y) may be unseen. */
static bool at_edge(const struct fv_bend *b, float x, float y)
{
    float most = 0;
    for (int k = 0; k < 4; k++) most = fmaxf(most, fv_bend_square(b, x + (float)(k & 1) * FV_TILE, y + (float)(k >> 1) * FV_TILE));
    return b->masks && !(most < b->shown * b->shown);
}

static int run(struct fv_frame *f, const struct fv_tile *tile)
{
    const struct fv_bend *b = &f->view[tile->eye].bend;
    struct fv_turn_square square = {.bend = b, .unbend = &f->turn->unbend, .fringe = f->fringe, .m = f->turn->m[tile->eye],
                                    .from = f->buffer[f->fringe ? FV_GREEN : FV_PICTURE][tile->eye],
                                    .to = f->buffer[f->fringe ? FV_PICTURE : FV_TURNED][tile->eye],
                                    .stride = (int)f->stride, .width = f->width, .height = f->height, .x = tile->x0, .y = tile->y0};
    float x = (float)tile->x0, y = (float)tile->y0;
    bool unseen = b->masks && fv_bend_beyond(b, x, y, x + FV_TILE, y + FV_TILE, 0);
    if (!unseen) f->kernels->turn(&square);
    bool darkens = at_edge(b, x, y);
    for (int row = tile->y0; row < tile->y0 + FV_TILE && darkens; row++)
        fv_darken_unseen(b, tile->x0, row, FV_TILE, square.to + (int64_t)row * f->stride + tile->x0);
    return 1;
}

const struct fv_pass fv_pass_turn = {.name = "turn",
                                     .reads = FV_BIT(FV_PICTURE) | FV_BIT(FV_GREEN),
                                     .writes = FV_BIT(FV_TURNED),
                                     .run = run};
