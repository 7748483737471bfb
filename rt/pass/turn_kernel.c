/* turn_kernel: a square of a turned picture; see turn.h. */
#include "rt/pass/taps.h"
#include "rt/pass/turn.h"

#include <math.h>

#define turn FV_ISA_NAME(fv_turn)
void turn(const struct fv_turn_square *square);

/* What lies nearly abeam of the rendered view, or behind it, counts as this far ahead: far beyond its picture's edge.
 * Squares of places that lie as far off anywhere, or as much beside what squares of u and v say, are not interpolated. */
static const float least_ahead = 1 / 64.0f, farthest_px = 65536, beside_px = 1 / 64.0f;

static const float unit = 2.0f / FV_TURN_SIDE; /* a pixel, in halves of a side */
static const float aside_px = 1 / 8.0f;        /* what rows looked up by a vector are allowed beside what its first and last say */

static FV_INLINE vf square_at(const struct fv_bend *b, vf x, vf y)
{
    vf u = (x - b->centre[0]) * b->step[0], v = (y - b->centre[1]) * b->step[1];
    return u * u + v * v;
}

/* What the rendered picture shows in the direction of places of the turned one; `channel`: 0 red, 1 blue, -1 green. Not
 * sure: there, or where it is looked up, the lens goes on otherwise than where pixels are traced. */
static FV_INLINE void look_up(const struct fv_turn_square *s, int channel, vf x, vf y, vf *to_x, vf *to_y, vi *sure)
{
    const struct fv_bend *b = s->bend;
    const float(*m)[3] = s->m;
    vf dx = x - b->centre[0], dy = y - b->centre[1], r2 = square_at(b, x, y), ratio = vf_of(1), most = vf_of(b->most * b->most);
    *sure = vi_of(-1);
    if (channel >= 0) ratio = fv_table_at(s->fringe->ratio[channel], vf_clamp(r2 * s->fringe->per_square, 0, (float)FV_LENS_STEPS));
    if (b->on) {
        vf beside = r2 * ratio * ratio, q = vf_min(beside, most);
        *sure = (vi)(r2 < most) & (vi)(beside < most);
        ratio *= 1.0f + q * (b->k[0] + q * (b->k[1] + q * b->k[2]));
        x = b->centre[0] + dx * ratio;
        y = b->centre[1] + dy * ratio;
    }
    vf over = vf_reciprocal(vf_max(m[2][0] * x + m[2][1] * y + m[2][2], vf_of(least_ahead)));
    *to_x = (m[0][0] * x + m[0][1] * y + m[0][2]) * over;
    *to_y = (m[1][0] * x + m[1][1] * y + m[1][2]) * over;
    if (b->on) {
        dx = *to_x - b->centre[0], dy = *to_y - b->centre[1];
        ratio = fv_table_at(s->unbend->ratio, vf_clamp((1.0f - vf_rsqrt(1.0f + square_at(b, *to_x, *to_y))) * s->unbend->per_unit, 0, (float)FV_UNBEND_STEPS));
        *to_x = b->centre[0] + dx * ratio;
        *to_y = b->centre[1] + dy * ratio;
        *sure &= (vi)(square_at(b, *to_x, *to_y) < most);
    }
    *sure &= (vi)(vf_abs(*to_x) < farthest_px) & (vi)(vf_abs(*to_y) < farthest_px);
}

/* Places that a square's pixels look up: at (u, v) from its middle, in halves of a side,
 * p[0] + p[1] u + p[2] u^2, each of these likewise over v. */
struct places {
    float x[3][3], y[3][3];
};

/* Of values at -1, 0 and 1. */
static void fit(const float at[3], float p[3])
{
    p[0] = at[1];
    p[1] = 0.5f * (at[2] - at[0]);
    p[2] = 0.5f * (at[2] + at[0]) - at[1];
}

static FV_INLINE float along(const float p[3], float u)
{
    return p[0] + u * (p[1] + u * p[2]);
}

/* The coefficients over u in the row at v. */
static void place_row(const struct places *p, float v, float x[3], float y[3])
{
    for (int i = 0; i < 3; i++) {
        x[i] = p->x[i][0] + v * (p->x[i][1] + v * p->x[i][2]);
        y[i] = p->y[i][0] + v * (p->y[i][1] + v * p->y[i][2]);
    }
}

/* In halves of a side: 3 x 3 places, four that show whether squares do, and the last again, for whole vectors. */
enum { CHECKED = 9, TRIED = 13, TRIED_PADDED = 16 };
static const float tried_u[TRIED_PADDED] = {-1, 0, 1, -1, 0, 1, -1, 0, 1, -0.5f, 0.5f, -0.5f, 0.5f, 0.5f, 0.5f, 0.5f};
static const float tried_v[TRIED_PADDED] = {-1, -1, -1, 0, 0, 0, 1, 1, 1, -0.5f, -0.5f, 0.5f, 0.5f, 0.5f, 0.5f, 0.5f};

/* False: they are to be looked up pixel by pixel. */
static FV_INLINE bool place_all(const struct fv_turn_square *s, int channel, struct places *p)
{
    const float half = FV_TURN_SIDE / 2;
    float x[TRIED_PADDED], y[TRIED_PADDED], px[3], py[3];
    for (int i = 0; i < TRIED_PADDED; i += FV_WIDTH) {
        vf to_x, to_y;
        vi sure;
        look_up(s, channel, ((float)s->x + half) + half * vf_load(tried_u + i), ((float)s->y + half) + half * vf_load(tried_v + i), &to_x, &to_y, &sure);
        if (vi_any(~sure)) return false;
        vf_store(x + i, to_x);
        vf_store(y + i, to_y);
    }
    float across[3][3], down[3][3];
    for (int j = 0; j < 3; j++) {
        fit(x + 3 * j, across[j]);
        fit(y + 3 * j, down[j]);
    }
    for (int i = 0; i < 3; i++) {
        fit((const float[3]){across[0][i], across[1][i], across[2][i]}, p->x[i]);
        fit((const float[3]){down[0][i], down[1][i], down[2][i]}, p->y[i]);
    }
    for (int k = CHECKED; k < TRIED; k++) {
        place_row(p, tried_v[k], px, py);
        if (!(fabsf(along(px, tried_u[k]) - x[k]) < beside_px && fabsf(along(py, tried_u[k]) - y[k]) < beside_px)) return false;
    }
    return true;
}

/* No farther out than the edge of what is seen. */
static FV_INLINE void stay_within(const struct fv_bend *b, float edge, vf *x, vf *y)
{
    vf dx = *x - b->centre[0], dy = *y - b->centre[1], u = dx * b->step[0], v = dy * b->step[1];
    vf ratio = vf_min(edge * vf_rsqrt(vf_max(u * u + v * v, vf_of(1e-12f))), vf_of(1));
    *x = b->centre[0] + dx * ratio;
    *y = b->centre[1] + dy * ratio;
}

static FV_INLINE struct fv_taps taps_at(const struct fv_turn_square *s, bool masks, vf x, vf y)
{
    if (masks) stay_within(s->bend, s->unbend->edge, &x, &y);
    return fv_taps_at(s->from, s->stride, s->width, s->height, x, y);
}

/* Of a channel alone, in its place. */
static FV_INLINE vi channel_at(const struct fv_turn_square *s, bool masks, int shift, vf x, vf y)
{
    struct fv_taps taps = taps_at(s, masks, x, y);
    return fv_taps_swift(&taps, fv_taps_weights(&taps), shift) << shift;
}

/* Where colours part, channel k (0 green, 1 red, 2 blue) is looked up at x[k], y[k]; else all are at the first. */
static FV_INLINE vi colour_at(const struct fv_turn_square *s, bool fringes, bool masks, const vf x[3], const vf y[3])
{
    const int32_t opaque = (int32_t)0xff000000;
    if (fringes) return channel_at(s, masks, 8, x[0], y[0]) | channel_at(s, masks, 0, x[1], y[1]) | channel_at(s, masks, 16, x[2], y[2]) | opaque;
    struct fv_taps taps = taps_at(s, masks, x[0], y[0]);
    vi weights = fv_taps_weights(&taps);
    return fv_taps_swift(&taps, weights, 0) | (fv_taps_swift(&taps, weights, 8) << 8) | (fv_taps_swift(&taps, weights, 16) << 16) | opaque;
}

static FV_INLINE void turn_exactly(const struct fv_turn_square *s, bool fringes, bool masks)
{
    for (int j = 0; j < FV_TURN_SIDE; j++)
        for (int i = 0; i < FV_TURN_SIDE; i += FV_WIDTH) {
            vf x = vf_from(vi_lanes() + (s->x + i)) + 0.5f, y = vf_of((float)(s->y + j) + 0.5f), to_x[3], to_y[3];
            vi sure;
            for (int k = 0; k < 3 && (fringes || k == 0); k++) look_up(s, k - 1, x, y, &to_x[k], &to_y[k], &sure);
            vi_store(s->to + (int64_t)(s->y + j) * s->stride + s->x + i, colour_at(s, fringes, masks, to_x, to_y));
        }
}

/* Far apart in memory, rows of pictures would be waited for one by one. Of a row some rows on, what this square wants is
 * fetched, in case that no square before it was its neighbour; of this row, what the square to its right will want more. */
enum { ROWS_AHEAD = 8, LINE = 16, FETCHED = FV_TURN_SIDE + FV_WIDTH };

static FV_INLINE void fetch_row(const struct fv_turn_square *s, const struct places *p, int j, int begin, int end)
{
    int x = (int)p->x[0][0] - FV_TURN_SIDE / 2, y = (int)p->y[0][0] - FV_TURN_SIDE / 2 + j;
    if (x < 0 || x > s->width - 1 || y < 0 || y > s->height - 1) return;
    for (int i = begin; i < end; i += LINE) __builtin_prefetch(s->from + (int64_t)y * s->stride + x + i);
}

/* Rows of a square's places: their coefficients over u, of each channel that has its own. */
struct row {
    float x[3][3], y[3][3];
};

static FV_INLINE void begin_row(const struct fv_turn_square *s, bool fringes, const struct places of[3], int j, struct row *row)
{
    if (j + ROWS_AHEAD < FV_TURN_SIDE) fetch_row(s, &of[0], j + ROWS_AHEAD, 0, FETCHED);
    fetch_row(s, &of[0], j, FETCHED + LINE - 1, FETCHED + FV_TURN_SIDE);
    for (int i = 0; i < FV_TURN_SIDE; i += LINE) __builtin_prefetch(s->to + (int64_t)(s->y + j) * s->stride + s->x + FV_TURN_SIDE + i, 1);
    for (int k = 0; k < 3 && (fringes || k == 0); k++) place_row(&of[k], ((float)j + 0.5f) * unit - 1, row->x[k], row->y[k]);
}

static FV_INLINE void turn_rows(const struct fv_turn_square *square, bool fringes, bool masks, const struct places of[3])
{
    const struct fv_turn_square own = *square, *s = &own; /* that pixels' stores surely leave alone */
    struct row row;
    for (int j = 0; j < ROWS_AHEAD; j++) fetch_row(s, &of[0], j, 0, FETCHED);
    for (int j = 0; j < FV_TURN_SIDE; j++) {
        begin_row(s, fringes, of, j, &row);
        for (int i = 0; i < FV_TURN_SIDE; i += FV_WIDTH) {
            vf u = (vf_from(vi_lanes() + i) + 0.5f) * unit - 1.0f, to_x[3], to_y[3];
            for (int k = 0; k < 3 && (fringes || k == 0); k++) {
                to_x[k] = row.x[k][0] + u * (row.x[k][1] + u * row.x[k][2]);
                to_y[k] = row.y[k][0] + u * (row.y[k][1] + u * row.y[k][2]);
            }
            vi_store(s->to + (int64_t)(s->y + j) * s->stride + s->x + i, colour_at(s, fringes, masks, to_x, to_y));
        }
    }
}

/* Taps of places that are calm, of a vector whose first pixel lies at u. */
static FV_INLINE struct fv_taps calm_taps(const struct fv_turn_square *s, const float x[3], const float y[3], float first, vi *weights)
{
    const float last = first + (FV_WIDTH - 1) * unit;
    float x0 = along(x, first), x1 = along(x, last), y0 = along(y, first), y1 = along(y, last);
    float left = (x0 < x1 ? x0 : x1) - 0.5f, high = (y0 < y1 ? y0 : y1) - (0.5f + aside_px), low = (y0 < y1 ? y1 : y0) - (0.5f - aside_px);
    int top = (int)high;
    vf u = vf_from(vi_lanes()) * unit + first;
    vi at = vi_from((x[0] - 0.5f) * 32768 + u * (x[1] * 32768 + u * (x[2] * 32768)));
    return fv_taps_calm(s->from, s->stride, (int)left - 1, top, (int)low > top, at, (y[0] - 0.5f) + u * (y[1] + u * y[2]), weights);
}

static FV_INLINE void turn_calm_rows(const struct fv_turn_square *square, bool fringes, const struct places of[3])
{
    const struct fv_turn_square own = *square, *s = &own;
    struct row row;
    for (int j = 0; j < ROWS_AHEAD; j++) fetch_row(s, &of[0], j, 0, FETCHED);
    for (int j = 0; j < FV_TURN_SIDE; j++) {
        begin_row(s, fringes, of, j, &row);
        for (int i = 0; i < FV_TURN_SIDE; i += FV_WIDTH) {
            float u = ((float)i + 0.5f) * unit - 1;
            vi weights, colour = vi_of((int32_t)0xff000000);
            struct fv_taps taps = calm_taps(s, row.x[0], row.y[0], u, &weights);
            colour |= fv_taps_swift(&taps, weights, 8) << 8;
            if (fringes) taps = calm_taps(s, row.x[1], row.y[1], u, &weights);
            colour |= fv_taps_swift(&taps, weights, 0);
            if (fringes) taps = calm_taps(s, row.x[2], row.y[2], u, &weights);
            colour |= fv_taps_swift(&taps, weights, 16) << 16;
            vi_store(s->to + (int64_t)(s->y + j) * s->stride + s->x + i, colour);
        }
    }
}

static float sum(const float p[3])
{
    return fabsf(p[0]) + fabsf(p[1]) + fabsf(p[2]);
}

/* Neighbours are looked up next to each other (fv_taps_calm), none at the border: a vector's columns bow by less than one
 * and span no more than its window, its rows bow by less than half of aside_px and span less than one and that. */
static bool calm(const struct fv_turn_square *s, const struct places *p)
{
    const float part = (float)FV_WIDTH * 2 / FV_TURN_SIDE;
    float across = sum(p->x[1]) + 2 * sum(p->x[2]), down = sum(p->y[1]) + 2 * sum(p->y[2]);
    float x = p->x[0][0], y = p->y[0][0], beside = sum(p->x[0]) - fabsf(x) + across, above = sum(p->y[0]) - fabsf(y) + down;
    if (!(x - beside > 3 && x + beside < (float)(s->width - 3) && y - above > 2 && y + above < (float)(s->height - 4))) return false;
    return sum(p->x[2]) < 0.5f && sum(p->y[2]) < 0.5f * aside_px && across * part < 2 * FV_WIDTH - 5 && down * part < 1 - 2 * aside_px;
}

/* No farther from `centre` than this: what the coefficients' sizes add up to. */
static float farthest(const float p[3][3], float centre)
{
    float sum = fabsf(p[0][0] - centre) - fabsf(p[0][0]);
    for (int i = 0; i < 9; i++) sum += fabsf(p[i / 3][i % 3]);
    return sum;
}

/* All places are within the edge of what is seen. */
static bool seen(const struct fv_turn_square *s, const struct places *p)
{
    const struct fv_bend *b = s->bend;
    float u = farthest(p->x, b->centre[0]) * b->step[0], v = farthest(p->y, b->centre[1]) * b->step[1];
    return u * u + v * v < s->unbend->edge * s->unbend->edge;
}

static FV_INLINE void turn_square(const struct fv_turn_square *s, bool fringes, bool masks)
{
    struct places of[3];
    bool smooth = true, inside = true, gentle = true;
    for (int k = 0; k < 3 && smooth && (fringes || k == 0); k++) {
        smooth = place_all(s, k - 1, &of[k]);
        inside = inside && smooth && (!masks || seen(s, &of[k]));
        gentle = gentle && smooth && calm(s, &of[k]);
    }
    if (!smooth) turn_exactly(s, fringes, masks);
    else if (inside && gentle) turn_calm_rows(s, fringes, of);
    else if (masks && !inside) turn_rows(s, fringes, true, of);
    else turn_rows(s, fringes, false, of);
}

/* Each channel from where the lens shows it, where its colours part; else all from green's. */
void turn(const struct fv_turn_square *s)
{
    bool masks = s->bend->on && s->bend->masks;
    if (s->fringe) turn_square(s, true, masks);
    else if (masks) turn_square(s, false, true);
    else turn_square(s, false, false);
}
