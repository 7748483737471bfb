/* field_bound: see field_bound.h. */
#include "rt/scene/field_bound.h"

#include <math.h>
#include <stddef.h>

bool fv_bound_finite(const struct fv_bound *b, int axis)
{
    return isfinite(b->low[axis]) && isfinite(b->high[axis]);
}

/* The ball becomes the box's where that is smaller. */
static void tighten(struct fv_bound *b)
{
    double r2 = 0, middle[3];
    for (int i = 0; i < 3; i++) {
        if (!fv_bound_finite(b, i)) return;
        middle[i] = 0.5 * (b->low[i] + b->high[i]);
        r2 += (b->high[i] - middle[i]) * (b->high[i] - middle[i]);
    }
    if (!(sqrt(r2) < b->radius)) return;
    b->radius = sqrt(r2);
    for (int i = 0; i < 3; i++) b->centre[i] = middle[i];
}

struct fv_bound fv_bound_box(const double low[3], const double high[3])
{
    struct fv_bound b = {.radius = INFINITY, .spread = 1, .lipschitz = 1};
    for (int i = 0; i < 3; i++) b.low[i] = low[i], b.high[i] = high[i];
    tighten(&b);
    return b;
}

struct fv_bound fv_bound_turn(const struct fv_bound *b, const double turn[3][3], const double move[3])
{
    struct fv_bound out = *b;
    for (int r = 0; r < 3; r++) {
        out.low[r] = out.high[r] = out.centre[r] = move[r];
        for (int c = 0; c < 3; c++) {
            double m = turn[r][c];
            if (fabs(m) < 1e-12) continue; /* rounding must not multiply infinity */
            out.low[r] += m * (m > 0 ? b->low[c] : b->high[c]);
            out.high[r] += m * (m > 0 ? b->high[c] : b->low[c]);
            out.centre[r] += m * b->centre[c];
        }
    }
    tighten(&out);
    return out;
}

struct fv_bound fv_bound_join(const struct fv_bound *a, const struct fv_bound *b)
{
    struct fv_bound out = {.spread = fmax(a->spread, b->spread), .lipschitz = fmax(a->lipschitz, b->lipschitz)};
    double way[3], d2 = 0;
    for (int i = 0; i < 3; i++) {
        out.low[i] = fmin(a->low[i], b->low[i]);
        out.high[i] = fmax(a->high[i], b->high[i]);
        way[i] = b->centre[i] - a->centre[i];
        d2 += way[i] * way[i];
    }
    double d = sqrt(d2);
    out.radius = INFINITY;
    if (isfinite(a->radius) && isfinite(b->radius)) {
        const struct fv_bound *inner = a->radius + d <= b->radius ? b : b->radius + d <= a->radius ? a : NULL;
        out.radius = inner ? inner->radius : 0.5 * (a->radius + b->radius + d);
        for (int i = 0; i < 3; i++)
            out.centre[i] = inner ? inner->centre[i] : a->centre[i] + way[i] * ((out.radius - a->radius) / d);
    }
    tighten(&out);
    return out;
}

void fv_bound_grow(struct fv_bound *b, double e)
{
    for (int i = 0; i < 3; i++) {
        b->low[i] -= e * b->spread;
        b->high[i] += e * b->spread;
    }
    b->radius += e * b->spread;
}

void fv_bound_halves(const struct fv_bound *b, float centre[3], float half[3])
{
    for (int i = 0; i < 3; i++) {
        bool finite = fv_bound_finite(b, i);
        centre[i] = finite ? (float)(0.5 * (b->low[i] + b->high[i])) : 0;
        half[i] = finite ? (float)(0.5 * (b->high[i] - b->low[i])) : INFINITY;
    }
}
