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

/* How far from each pixel of a tile, about, is what it looks up: of the one in its middle. */
static int64_t offset_of(const struct fv_frame *f, const struct fv_tile *tile)
{
    const struct fv_bend *b = &f->view[tile->eye].bend;
    const float(*m)[3] = f->turn->m[tile->eye];
    int x = tile->x0 + FV_TILE / 2, y = tile->y0 + FV_TILE / 2;
    float at[2] = {(float)x, (float)y};
    if (b->on) fv_bend_straight(b, at[0], at[1], at);
    double ahead = fmax((double)(m[2][0] * at[0] + m[2][1] * at[1] + m[2][2]), 1.0 / 64);
    double to[2] = {(double)(m[0][0] * at[0] + m[0][1] * at[1] + m[0][2]) / ahead, (double)(m[1][0] * at[0] + m[1][1] * at[1] + m[1][2]) / ahead};
    if (b->on) fv_bend_bent(b, to, to);
    int column = (int)fmax(FV_TILE / 2, fmin(f->width - FV_TILE / 2, to[0])), row = (int)fmax(0, fmin(f->height - 1, to[1]));
    return (row - y) * f->stride + column - x;
}

/* Far apart in memory, rows of pictures would be waited for one by one. */
enum { ROWS_AHEAD = 8 };

static void fetch_row(const struct fv_frame *f, const uint32_t *from, int64_t offset, uint32_t *to, int x0, int y)
{
    int64_t at = (int64_t)y * f->stride + x0;
    __builtin_prefetch(to + at, 1);
    __builtin_prefetch(to + at + FV_TILE / 2, 1);
    for (int i = 0; i < 3; i++) __builtin_prefetch(from + at + offset + i * FV_TILE / 2);
}

static int run(struct fv_frame *f, const struct fv_tile *tile)
{
    const struct fv_bend *b = &f->view[tile->eye].bend;
    struct fv_turn_row row = {.bend = b, .unbend = &f->turn->unbend, .fringe = f->fringe, .m = f->turn->m[tile->eye],
                              .from = f->buffer[f->fringe ? FV_GREEN : FV_PICTURE][tile->eye], .stride = (int)f->stride,
                              .width = f->width, .height = f->height, .x = tile->x0, .count = FV_TILE};
    uint32_t *to = f->buffer[f->fringe ? FV_PICTURE : FV_TURNED][tile->eye];
    int64_t offset = offset_of(f, tile);
    for (int y = 0; y < ROWS_AHEAD; y++) fetch_row(f, row.from, offset, to, tile->x0, tile->y0 + y);
    for (int y = tile->y0; y < tile->y0 + FV_TILE; y++) {
        if (y + ROWS_AHEAD < tile->y0 + FV_TILE) fetch_row(f, row.from, offset, to, tile->x0, y + ROWS_AHEAD);
        row.y = y;
        row.to = to + (int64_t)y * f->stride + tile->x0;
        f->kernels->turn(&row);
        if (b->masks) fv_darken_unseen(b, tile->x0, y, FV_TILE, row.to);
    }
    return 1;
}

const struct fv_pass fv_pass_turn = {.name = "turn",
                                     .reads = FV_BIT(FV_PICTURE) | FV_BIT(FV_GREEN),
                                     .writes = FV_BIT(FV_TURNED),
                                     .run = run};
