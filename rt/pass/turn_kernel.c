/* turn_kernel: a row of a turned picture; see turn.h. */
#include "rt/pass/taps.h"
#include "rt/pass/turn.h"

#define turn FV_ISA_NAME(fv_turn)
void turn(const struct fv_turn_row *row);

/* What lies nearly abeam of the rendered view, or behind it, counts as this far ahead: far beyond its picture's edge. */
static const float least_ahead = 1 / 64.0f;

/* Display's pixels to straight coordinates. */
static FV_INLINE void straighten(const struct fv_bend *b, vf *x, vf *y)
{
    vf dx = *x - b->centre[0], dy = *y - b->centre[1], u = dx * b->step[0], v = dy * b->step[1];
    vf q = vf_min(u * u + v * v, vf_of(b->most * b->most));
    vf scale = 1.0f + q * (b->k[0] + q * (b->k[1] + q * b->k[2]));
    *x = b->centre[0] + dx * scale;
    *y = b->centre[1] + dy * scale;
}

/* And back, no farther out than the edge. */
static FV_INLINE void unbend(const struct fv_bend *b, const struct fv_unbend *table, vf *x, vf *y)
{
    vf dx = *x - b->centre[0], dy = *y - b->centre[1], u = dx * b->step[0], v = dy * b->step[1], square = u * u + v * v;
    vf step = vf_clamp((1.0f - vf_rsqrt(1.0f + square)) * table->per_unit, 0, (float)FV_UNBEND_STEPS);
    vf ratio = vf_min(fv_table_at(table->ratio, step), table->edge * vf_rsqrt(vf_max(square, vf_of(1e-12f))));
    *x = b->centre[0] + dx * ratio;
    *y = b->centre[1] + dy * ratio;
}

/* What the rendered picture shows in the direction of places of the turned one. */
static FV_INLINE struct fv_taps look_up(const struct fv_turn_row *r, bool bent, vf x, vf y)
{
    const float(*m)[3] = r->m;
    if (bent) straighten(r->bend, &x, &y);
    vf over = vf_reciprocal(vf_max(m[2][0] * x + m[2][1] * y + m[2][2], vf_of(least_ahead)));
    vf across = (m[0][0] * x + m[0][1] * y + m[0][2]) * over, down = (m[1][0] * x + m[1][1] * y + m[1][2]) * over;
    if (bent) unbend(r->bend, r->unbend, &across, &down);
    return fv_taps_at(r->from, r->stride, r->width, r->height, across, down);
}

static FV_INLINE void turn_row(const struct fv_turn_row *r, bool bent)
{
    vf y = vf_of((float)r->y + 0.5f);
    for (int i = 0; i < r->count; i += FV_WIDTH) {
        struct fv_taps taps = look_up(r, bent, vf_from(vi_lanes() + (r->x + i)) + 0.5f, y);
        vi colour = vi_of((int32_t)0xff000000);
        for (int c = 0; c < 3; c++) colour |= fv_taps_channel(&taps, 8 * c) << (8 * c);
        vi_store(r->to + i, colour);
    }
}

/* Each channel from where the lens shows it. */
static void turn_fringed_row(const struct fv_turn_row *r)
{
    const struct fv_bend *b = r->bend;
    vf dy = vf_of((float)r->y + 0.5f - b->centre[1]), v = dy * b->step[1];
    for (int i = 0; i < r->count; i += FV_WIDTH) {
        vf dx = vf_from(vi_lanes() + (r->x + i)) + (0.5f - b->centre[0]), u = dx * b->step[0];
        vf step = vf_clamp((u * u + v * v) * r->fringe->per_square, 0, (float)FV_LENS_STEPS);
        struct fv_taps green = look_up(r, true, b->centre[0] + dx, b->centre[1] + dy);
        vi colour = vi_of((int32_t)0xff000000) | fv_taps_channel(&green, 8) << 8;
        for (int c = 0; c < 2; c++) {
            vf ratio = fv_table_at(r->fringe->ratio[c], step);
            struct fv_taps taps = look_up(r, true, b->centre[0] + dx * ratio, b->centre[1] + dy * ratio);
            colour |= fv_taps_channel(&taps, 16 * c) << (16 * c);
        }
        vi_store(r->to + i, colour);
    }
}

void turn(const struct fv_turn_row *r)
{
    if (r->fringe) turn_fringed_row(r);
    else if (r->bend->on) turn_row(r, true);
    else turn_row(r, false);
}
