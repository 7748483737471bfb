/* lens: radial distortion and its inverse, in double; see lens.h. */
#include "rt/fovea/lens.h"

#include <math.h>

enum { STEPS = 4096, TRIES = 80 };

static double scale_of(const double k[FV_LENS_TERMS], double square)
{
    return 1 + square * (k[0] + square * (k[1] + square * k[2]));
}

/* dt / dr. */
static double slope_of(const double k[FV_LENS_TERMS], double square)
{
    return 1 + square * (3 * k[0] + square * (5 * k[1] + square * 7 * k[2]));
}

static bool holds(const double k[FV_LENS_TERMS], double r)
{
    double scale = scale_of(k, r * r);
    return slope_of(k, r * r) >= FV_LENS_SLOPE && scale >= FV_LENS_SLOPE && r * scale <= FV_LENS_TANGENT_MAX;
}

/* How far out t grows, up to r = end. */
static double limit_of(const double k[FV_LENS_TERMS], double end)
{
    int i = 1;
    while (i <= STEPS && holds(k, end * i / STEPS)) i++;
    if (i > STEPS) return end;
    double low = end * (i - 1) / STEPS, high = end * i / STEPS;
    for (int n = 0; n < TRIES; n++) {
        double middle = 0.5 * (low + high);
        if (holds(k, middle)) low = middle;
        else high = middle;
    }
    return low;
}

/* r of t(r) = t within [0, end], where t grows: Newton's steps, and halves where one would leave the bracket. */
static double inverse(const double k[FV_LENS_TERMS], double t, double end)
{
    double low = 0, high = end, r = fmin(t, end);
    for (int n = 0; n < TRIES; n++) {
        double off = r * scale_of(k, r * r) - t;
        if (off > 0) high = r;
        else low = r;
        double next = r - off / slope_of(k, r * r);
        if (!(next >= low && next <= high)) next = 0.5 * (low + high);
        if (fabs(next - r) <= 1e-16 * end) return next;
        r = next;
    }
    return r;
}

static void terms_of(const struct fv_bend *b, double k[FV_LENS_TERMS])
{
    for (int i = 0; i < FV_LENS_TERMS; i++) k[i] = (double)b->k[i];
}

double fv_bend_radius(const struct fv_bend *b, double t)
{
    double k[FV_LENS_TERMS], most = (double)b->most;
    terms_of(b, k);
    double scale = scale_of(k, most * most);
    return t >= most * scale ? t / scale : inverse(k, t, most);
}

void fv_bend_bent(const struct fv_bend *b, const double from[2], double to[2])
{
    double x = from[0] - (double)b->centre[0], y = from[1] - (double)b->centre[1];
    double t = hypot(x * (double)b->step[0], y * (double)b->step[1]);
    double ratio = t > 1e-12 ? fv_bend_radius(b, t) / t : 1;
    to[0] = (double)b->centre[0] + x * ratio;
    to[1] = (double)b->centre[1] + y * ratio;
}

void fv_bend_tangent(const struct fv_bend *b, double x, double y, double a[2][3])
{
    double k[FV_LENS_TERMS], d[2] = {x - (double)b->centre[0], y - (double)b->centre[1]};
    double step[2] = {(double)b->step[0], (double)b->step[1]}, most = (double)b->most, growth = 0;
    double square = d[0] * d[0] * step[0] * step[0] + d[1] * d[1] * step[1] * step[1];
    terms_of(b, k);
    if (square < most * most) growth = 2 * (k[0] + square * (2 * k[1] + square * 3 * k[2]));
    double scale = scale_of(k, fmin(square, most * most));
    for (int i = 0; i < 2; i++) {
        for (int j = 0; j < 2; j++) a[i][j] = (i == j ? scale : 0) + d[i] * d[j] * step[j] * step[j] * growth;
        a[i][2] = (double)b->centre[i] + d[i] * scale - a[i][0] * x - a[i][1] * y;
    }
}

double fv_bend_fringe(const struct fv_bend *b, int channel, double r)
{
    double k[FV_LENS_TERMS];
    if (!(r > 1e-9)) return b->channel[channel].c0; /* t(r) / r is 1 there */
    terms_of(b, k);
    double t = r * scale_of(k, fmin(r, (double)b->most) * fmin(r, (double)b->most));
    return fv_bend_radius(b, fmax(0, t * (b->channel[channel].c0 + b->channel[channel].c1 * r * r))) / r;
}

/* The extremes of how it stretches, and of pixels' angles, from the axis to `most`. (Not as fmax(most, fmax(a, b)), on
 * which GCC 12 for arm64 breaks.) */
static void set_extremes(struct fv_bend *b, const double k[FV_LENS_TERMS])
{
    double least = 1, widest = 1, angle = 1;
    for (int i = 0; i <= STEPS; i++) {
        double r = (double)b->most * i / STEPS, scale = scale_of(k, r * r), slope = slope_of(k, r * r), t = r * scale;
        least = fmin(fmin(least, scale), slope);
        widest = fmax(fmax(widest, scale), slope);
        angle = fmax(fmax(angle, slope / (1 + t * t)), scale / sqrt(1 + t * t));
    }
    b->least = (float)least;
    b->widest = (float)(widest * 1.0001);
    b->widest_angle = (float)(angle * 1.0001);
}

void fv_bend_set(struct fv_bend *b, const struct fv_lens_settings *s)
{
    double step = 1 / s->unit_px, k[FV_LENS_TERMS];
    double x = fmax(s->centre_px[0], s->width - s->centre_px[0]), y = fmax(s->centre_px[1], s->height - s->centre_px[1]);
    double corner = hypot(x, y) * step, beside = step;
    *b = (struct fv_bend){.on = true, .centre = {(float)s->centre_px[0], (float)s->centre_px[1]}, .step = {(float)step, (float)step},
                          .channel = {s->channel[0], s->channel[1]}};
    for (int i = 0; i < FV_LENS_TERMS; i++) b->k[i] = (float)s->k[i];
    for (int c = 0; c < 2; c++) b->fringes |= s->channel[c].c0 != 1 || s->channel[c].c1 != 0;
    terms_of(b, k);
    double limit = limit_of(k, corner + 16 * step), shown = limit;
    b->most = (float)limit;
    double tangent = s->visible_deg < 88 ? tan(s->visible_deg * 0.017453292519943295) : FV_LENS_TANGENT_MAX;
    if (tangent < limit * scale_of(k, limit * limit)) shown = inverse(k, tangent, limit);
    double reach = shown + beside;
    for (int c = 0; c < 2 && b->fringes; c++) reach = fmax(reach, shown * fv_bend_fringe(b, c, shown) + beside);
    b->shown = (float)shown;
    b->most = (float)fmin(limit, reach);
    b->masks = shown < corner;
    set_extremes(b, k);
}

void fv_bend_row(const struct fv_bend *b, int y, int width, int *from, int *to)
{
    double v = (y + 0.5 - (double)b->centre[1]) * (double)b->step[1], rest = (double)b->shown * (double)b->shown - v * v;
    *from = *to = 0;
    if (!(rest > 0)) return;
    double half = sqrt(rest) / (double)b->step[0], first = ceil((double)b->centre[0] - half - 0.5), end = floor((double)b->centre[0] + half + 0.5);
    *from = first > 0 ? first < width ? (int)first : width : 0;
    *to = end < width ? end > *from ? (int)end : *from : width;
}

bool fv_bend_beyond(const struct fv_bend *b, float x0, float y0, float x1, float y1, float margin)
{
    float u = fmaxf(fmaxf(x0 - b->centre[0], b->centre[0] - x1) - margin, 0) * b->step[0];
    float v = fmaxf(fmaxf(y0 - b->centre[1], b->centre[1] - y1) - margin, 0) * b->step[1];
    return u * u + v * v > b->most * b->most;
}
