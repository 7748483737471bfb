/* fringe_kernel: a row of pixels whose red and blue come from beside it; see fringe.h. */
#include "rt/pass/fringe.h"
#include "rt/trace/simd.h"

#define fringe FV_ISA_NAME(fv_fringe)
void fringe(const struct fv_fringe_row *row);

/* The channel at `shift` bits, bilinear, rounded: of squares, as light adds up, so that edges stay in their place. */
static inline vi channel_at(const struct fv_fringe_row *r, vf px, vf py, int shift)
{
    vf x = vf_clamp(px - 0.5f, 0, (float)(r->width - 1)), y = vf_clamp(py - 0.5f, 0, (float)(r->height - 1));
    vf x0 = vf_floor(x), y0 = vf_floor(y), fx = x - x0, fy = y - y0, tap[4];
    vi ix = vi_from(x0), iy = vi_from(y0), right = (ix < r->width - 1) & 1, down = (iy < r->height - 1) & r->stride;
    vi at = iy * r->stride + ix;
    for (int k = 0; k < 4; k++) {
        vi from = at + (k & 1 ? right : vi_of(0)) + (k & 2 ? down : vi_of(0));
        tap[k] = vf_from((vi_gather(r->green, from) >> shift) & 255);
        tap[k] *= tap[k];
    }
    vf upper = tap[0] + (tap[1] - tap[0]) * fx, lower = tap[2] + (tap[3] - tap[2]) * fx;
    return vi_from(vf_sqrt(vf_max(upper + (lower - upper) * fy, vf_of(0))) + 0.5f);
}

static inline vf ratio_at(const float *ratio, vf step)
{
    vf whole = vf_floor(step), rest = step - whole;
    vi i = vi_from(whole);
    vf low = vf_gather(ratio, i), high = vf_gather(ratio, i + 1);
    return low + (high - low) * rest;
}

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
            vf ratio = ratio_at(r->table->ratio[c], step);
            colour |= channel_at(r, b->centre[0] + dx * ratio, b->centre[1] + dy * ratio, 16 * c) << (16 * c);
        }
        vi_store(r->to + i, colour);
    }
}
