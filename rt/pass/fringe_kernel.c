/* fringe_kernel: a row of pixels whose red and blue come from beside it; see fringe.h. */
#include "rt/pass/fringe.h"
#include "rt/pass/taps.h"

#define fringe FV_ISA_NAME(fv_fringe)
void fringe(const struct fv_fringe_row *row);

void fringe(const struct fv_fringe_row *r)
{
    const struct fv_bend *b = r->bend;
    const uint32_t *own = r->green + (int64_t)r->y * r->stride + r->x;
    vf dy = vf_of((float)r->y + 0.5f - b->centre[1]), v = dy * b->step[1];
    for (int i = 0; i < r->count; i += FV_WIDTH) {
        vf dx = vf_from(vi_lanes() + (r->x + i)) + (0.5f - b->centre[0]), u = dx * b->step[0];
        vf step = vf_clamp((u * u + v * v) * r->table->per_square, 0, (float)FV_LENS_STEPS);
        vi colour = vi_load(own + i) & (int32_t)0xff00ff00;
        for (int c = 0; c < 2; c++) {
            vf ratio = fv_table_at(r->table->ratio[c], step);
            struct fv_taps taps = fv_taps_at(r->green, r->stride, r->width, r->height, b->centre[0] + dx * ratio, b->centre[1] + dy * ratio);
            colour |= fv_taps_channel(&taps, 16 * c) << (16 * c);
        }
        vi_store(r->to + i, colour);
    }
}
