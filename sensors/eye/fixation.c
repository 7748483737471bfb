/* fixation: see the header. */
#include "sensors/eye/fixation.h"

#include <math.h>
#include <string.h>

/* Of a normal distribution: standard deviations in a median absolute deviation. */
static const double deviation = 1.4826;
static const double outlier = 3;
/* Deviations are taken as at least this: half a pixel's tenth is what a perfect image leaves. */
static const double least_px = 0.05;

/* The k-th smallest (from 0): Hoare's selection. Three-way, so that equal numbers cost nothing. */
static double select_kth(double *value, int n, int k)
{
    int low = 0, high = n - 1;
    while (low < high) {
        double pivot = value[low + (high - low) / 2];
        int i = low, less = low, more = high;
        while (i <= more) {
            double x = value[i];
            if (x < pivot) {
                value[i++] = value[less];
                value[less++] = x;
            } else if (x > pivot) {
                value[i] = value[more];
                value[more--] = x;
            } else i++;
        }
        if (k < less) high = less - 1;
        else if (k > more) low = more + 1;
        else return pivot;
    }
    return value[low];
}

double fv_fixation_median(double *value, int n)
{
    double upper = select_kth(value, n, n / 2);
    return n % 2 ? upper : 0.5 * upper + 0.5 * select_kth(value, n, n / 2 - 1);
}

static bool is_finite(const struct fv_fixation_look *l)
{
    return isfinite(l->feature.pupil[0]) && isfinite(l->feature.pupil[1]) && l->weight > 0;
}

/* The look with most others within near_px, the earliest of several; -1: none is finite. */
static int densest(const struct fv_fixation_look *look, int n, double near_px)
{
    int best = -1, most = 0;
    for (int i = 0; i < n; i++) {
        int count = 0;
        if (!is_finite(&look[i])) continue;
        for (int j = 0; j < n; j++)
            count +=
                is_finite(&look[j]) && hypot(look[j].feature.pupil[0] - look[i].feature.pupil[0],
                                             look[j].feature.pupil[1] - look[i].feature.pupil[1]) <= near_px;
        if (count > most) best = i, most = count;
    }
    return best;
}

/* A point of a look; false: it is not there. */
static bool point_of(const struct fv_fixation_look *l, bool glint, double at[2])
{
    const struct fv_gaze_feature *f = &l->feature;
    if (glint && !(f->glint_seen && isfinite(f->glint[0]) && isfinite(f->glint[1]))) return false;
    for (int i = 0; i < 2; i++) at[i] = f->pupil[i] - (glint ? f->glint[i] : 0);
    return true;
}

/* Median and deviation, an axis each, of the chosen looks' pupils, or of pupil minus glint; returns how many
 * there are. */
static int centre_of(const struct fv_fixation_look *look, const bool *chosen, int n, bool glint,
                     double middle[2], double spread[2])
{
    double value[FV_FIXATION_LOOKS_MAX], at[2];
    int count = 0;
    for (int axis = 0; axis < 2; axis++)
        for (int away = 0; away < 2; away++) {
            count = 0;
            for (int i = 0; i < n; i++)
                if (chosen[i] && point_of(&look[i], glint, at))
                    value[count++] = away ? fabs(at[axis] - middle[axis]) : at[axis];
            if (count == 0) return 0;
            if (away) spread[axis] = deviation * fv_fixation_median(value, count);
            else middle[axis] = fv_fixation_median(value, count);
        }
    return count;
}

static bool is_outlier(const double at[2], const double middle[2], const double spread[2])
{
    for (int i = 0; i < 2; i++)
        if (!(fabs(at[i] - middle[i]) <= outlier * fmax(spread[i], least_px))) return true;
    return false;
}

void fv_fixation_choose(struct fv_fixation_look *look, int n, double near_px, bool *chosen,
                        struct fv_fixation *f)
{
    double middle[2], spread[2] = {0, 0}, at[2];
    int start = densest(look, n, near_px);
    memset(f, 0, sizeof *f);
    for (int i = 0; i < n; i++) chosen[i] = false;
    if (start < 0) return;
    memcpy(middle, look[start].feature.pupil, sizeof middle);
    /* Around the densest place, then around the middle of what is there, then without outliers. */
    for (int round = 0; round < 3; round++) {
        for (int i = 0; i < n; i++) {
            const double *p = look[i].feature.pupil;
            chosen[i] = is_finite(&look[i]) && hypot(p[0] - middle[0], p[1] - middle[1]) <= near_px &&
                        (round < 2 || !is_outlier(p, middle, spread));
        }
        centre_of(look, chosen, n, false, middle, spread);
    }
    if (centre_of(look, chosen, n, true, at, spread) > 0)
        for (int i = 0; i < n; i++) {
            double difference[2];
            if (!chosen[i]) continue;
            if (!point_of(&look[i], true, difference) || is_outlier(difference, at, spread))
                look[i].feature.glint_seen = false;
        }
    centre_of(look, chosen, n, false, f->pupil, spread);
    f->spread_px = fmax(spread[0], spread[1]);
    int first = -1, last = -1;
    for (int i = 0; i < n; i++) {
        if (!chosen[i]) continue;
        if (first < 0) first = i;
        last = i;
        f->looks++;
    }
    if (first >= 0) f->length_ns = look[last].t_ns - look[first].t_ns;
}
