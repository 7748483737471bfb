/* gaze_map: calibration of the gaze by a regularised polynomial; see the header. */
#include "sensors/eye/gaze_map.h"

#include <math.h>
#include <string.h>

/* Least spreads (standard deviations): of targets in degrees, of features in pixels; and across, as a share
 * of that along: less is a line. */
static const double target_least_deg = 0.5, feature_least_px = 0.5, line_share = 0.1;
/* Places closer than this are one. */
static const double place_deg = 0.5;
/* Weight of the ridge on terms above the linear ones, as a share of a sample's mean weight times their
 * number. */
static const double ridge = 1e-4;
/* A fit whose error is more than this share of the targets' spread says nothing. */
static const double unrelated_share = 0.4;
/* The glint must be seen in this share of the samples. */
static const double glint_share = 0.8;
enum { PLACES_MAX = 32 };

const char *const fv_gaze_refusal_text[FV_GAZE_REFUSALS] = {
    [FV_GAZE_CALIBRATED] = "calibrated",
    [FV_GAZE_FEW] = "fewer than 5 targets were looked at with the pupil seen",
    [FV_GAZE_MANY] = "more samples than can be taken",
    [FV_GAZE_TARGETS_EQUAL] = "all targets are at the same place",
    [FV_GAZE_TARGETS_COLLINEAR] = "all targets lie on one line",
    [FV_GAZE_PUPIL_STILL] = "the pupil did not move between the targets",
    [FV_GAZE_PUPIL_COLLINEAR] = "the pupil moved along one line only",
    [FV_GAZE_UNRELATED] = "the pupil's movement does not follow the targets",
};

/* Whether a sample takes part in the fit to the difference, or in that to the pupil alone. */
static bool takes_part(const struct fv_gaze_target *t, bool difference)
{
    double all =
        t->feature.pupil[0] + t->feature.pupil[1] + t->direction_deg[0] + t->direction_deg[1] + t->weight;
    if (!isfinite(all) || !(t->weight > 0)) return false;
    return !difference || (t->feature.glint_seen && isfinite(t->feature.glint[0] + t->feature.glint[1]));
}

static void feature_of(const struct fv_gaze_feature *f, bool difference, double out[2])
{
    for (int i = 0; i < 2; i++) out[i] = f->pupil[i] - (difference ? f->glint[i] : 0);
}

/* Mean, and standard deviations along and across the direction of the largest. */
struct spread {
    double mean[2], along, across;
};

static struct spread spread_of(const struct fv_gaze_target *target, int n, bool difference, bool of_targets)
{
    struct spread s = {0};
    double at[2], xx = 0, xy = 0, yy = 0;
    int used = 0;
    for (int pass = 0; pass < 2; pass++) {
        for (int i = 0; i < n; i++) {
            if (!takes_part(&target[i], difference)) continue;
            feature_of(&target[i].feature, difference, at);
            if (of_targets) memcpy(at, target[i].direction_deg, sizeof at);
            double x = at[0] - s.mean[0], y = at[1] - s.mean[1];
            if (pass == 0) {
                /* a mean that does not overflow */
                used++;
                s.mean[0] += x / used;
                s.mean[1] += y / used;
            } else {
                xx += x * x / used;
                xy += x * y / used;
                yy += y * y / used;
            }
        }
    }
    double half = 0.5 * (xx + yy), apart = hypot(0.5 * (xx - yy), xy);
    s.along = sqrt(half + apart);
    s.across = sqrt(fmax(half - apart, 0));
    return s;
}

/* How many places were looked at; PLACES_MAX stands for more. */
static int places_of(const struct fv_gaze_target *target, int n, bool difference)
{
    double place[PLACES_MAX][2];
    int places = 0;
    for (int i = 0; i < n && places < PLACES_MAX; i++) {
        if (!takes_part(&target[i], difference)) continue;
        int j = 0;
        while (j < places && hypot(place[j][0] - target[i].direction_deg[0],
                                   place[j][1] - target[i].direction_deg[1]) >= place_deg)
            j++;
        if (j == places) memcpy(place[places++], target[i].direction_deg, sizeof place[0]);
    }
    return places;
}

static void terms_of(double x, double y, double out[FV_GAZE_TERMS])
{
    const double all[FV_GAZE_TERMS] = {1, x, y, x * y, x * x, y * y, x * x * y, x * y * y};
    memcpy(out, all, sizeof all);
}

/* One step of Householder's: rows from `step` on are mirrored so that the step-th column is 0 below its
 * first. */
static bool mirror(double (*row)[FV_GAZE_TERMS + 2], int n, int terms, int step, double scale)
{
    double square = 0;
    for (int i = step; i < n; i++) square += row[i][step] * row[i][step];
    double length = sqrt(square);
    if (!(length > 1e-12 * scale) || !isfinite(length)) return false;
    double first = row[step][step], head = first + copysign(length, first);
    /* v = (head, rest of the column); H = 1 - 2 v v' / v'v */
    double norm = square - first * first + head * head;
    for (int j = step + 1; j < terms + 2; j++) {
        double along = head * row[step][j];
        for (int i = step + 1; i < n; i++) along += row[i][step] * row[i][j];
        double factor = 2 * along / norm;
        row[step][j] -= factor * head;
        for (int i = step + 1; i < n; i++) row[i][j] -= factor * row[i][step];
    }
    row[step][step] = -copysign(length, first);
    return true;
}

bool fv_gaze_solve(double (*row)[FV_GAZE_TERMS + 2], int n, int terms, double x[2][FV_GAZE_TERMS])
{
    double scale = 0;
    if (terms < 1 || n < terms) return false;
    for (int i = 0; i < n; i++)
        for (int j = 0; j < terms; j++) scale = fmax(scale, fabs(row[i][j]));
    for (int step = 0; step < terms; step++)
        if (!mirror(row, n, terms, step, scale)) return false;
    for (int side = 0; side < 2; side++)
        for (int i = terms - 1; i >= 0; i--) {
            double value = row[i][terms + side];
            for (int j = i + 1; j < terms; j++) value -= row[i][j] * x[side][j];
            x[side][i] = value / row[i][i];
        }
    return true;
}

double fv_gaze_condition(double (*row)[FV_GAZE_TERMS + 2], int terms)
{
    double column[FV_GAZE_TERMS][FV_GAZE_TERMS], least = INFINITY, most = 0;
    for (int j = 0; j < terms; j++)
        for (int i = 0; i < terms; i++) column[j][i] = i <= j ? row[i][j] : 0;
    /* Columns are turned about each other until all are at right angles: their lengths are what is asked. */
    enum { SWEEPS = 30 };
    bool turned = true;
    for (int sweep = 0; sweep < SWEEPS && turned; sweep++) {
        turned = false;
        for (int a = 0; a < terms - 1; a++)
            for (int b = a + 1; b < terms; b++) {
                double aa = 0, bb = 0, ab = 0;
                for (int i = 0; i < terms; i++) {
                    aa += column[a][i] * column[a][i];
                    bb += column[b][i] * column[b][i];
                    ab += column[a][i] * column[b][i];
                }
                if (!(fabs(ab) > 1e-14 * sqrt(aa * bb))) continue;
                double zeta = (bb - aa) / (2 * ab), t = copysign(1, zeta) / (fabs(zeta) + hypot(1, zeta)),
                       cosine = 1 / hypot(1, t), sine = cosine * t;
                for (int i = 0; i < terms; i++) {
                    double x = column[a][i], y = column[b][i];
                    column[a][i] = cosine * x - sine * y;
                    column[b][i] = sine * x + cosine * y;
                }
                turned = true;
            }
    }
    for (int j = 0; j < terms; j++) {
        double square = 0;
        for (int i = 0; i < terms; i++) square += column[j][i] * column[j][i];
        least = fmin(least, sqrt(square));
        most = fmax(most, sqrt(square));
    }
    return least > 0 ? most / least : INFINITY;
}

/* Rows of the triangle that is kept while samples are added, those added at once, and those of the ridge. */
enum { CHUNK = 64, ROWS = FV_GAZE_TERMS + CHUNK };

/* Turns the rows into a triangle of `terms` rows that gives the same solution (a column may still be empty).
 */
static int fold(double (*row)[FV_GAZE_TERMS + 2], int rows, int terms)
{
    if (rows <= terms) return rows;
    for (int step = 0; step < terms; step++) mirror(row, rows, terms, step, 0);
    for (int i = 0; i < terms; i++)
        for (int j = 0; j < i; j++) row[i][j] = 0;
    return terms;
}

/* Solves from samples in any number: the triangle of those before takes part as rows. */
static bool fit(const struct fv_gaze_target *target, int n, bool difference, struct fv_gaze_polynomial *p)
{
    double row[ROWS + FV_GAZE_TERMS][FV_GAZE_TERMS + 2], at[2], all[FV_GAZE_TERMS], most = 0;
    int terms = p->terms, rows = 0, used = 0;
    for (int i = 0; i < n; i++)
        if (takes_part(&target[i], difference)) most = fmax(most, target[i].weight);
    for (int i = 0; i < n; i++) {
        if (!takes_part(&target[i], difference)) continue;
        double weight = sqrt(target[i].weight / most);
        feature_of(&target[i].feature, difference, at);
        terms_of((at[0] - p->middle[0]) / p->scale, (at[1] - p->middle[1]) / p->scale, all);
        for (int j = 0; j < terms; j++) row[rows][j] = weight * all[j];
        for (int j = 0; j < 2; j++) row[rows][terms + j] = weight * target[i].direction_deg[j];
        used++;
        if (++rows == ROWS) rows = fold(row, rows, terms);
    }
    for (int j = 3; j < terms; j++) {
        memset(row[rows], 0, sizeof row[rows]);
        row[rows++][j] = sqrt(ridge * used);
    }
    if (!fv_gaze_solve(row, rows, terms, p->coefficient)) return false;
    p->condition = fv_gaze_condition(row, terms);
    return true;
}

static void value_at(const struct fv_gaze_polynomial *p, double x, double y, double out[2])
{
    double all[FV_GAZE_TERMS];
    terms_of(x, y, all);
    for (int i = 0; i < 2; i++) {
        out[i] = 0;
        for (int j = 0; j < p->terms; j++) out[i] += p->coefficient[i][j] * all[j];
    }
}

/* Root mean square of the errors, weighted; and the region in which features were. */
static void judge(const struct fv_gaze_target *target, int n, bool difference, struct fv_gaze_polynomial *p)
{
    double sum = 0, weights = 0;
    for (int j = 0; j < 2; j++) {
        p->reach[j][0] = INFINITY;
        p->reach[j][1] = -INFINITY;
    }
    for (int i = 0; i < n; i++) {
        double at[2], value[2];
        if (!takes_part(&target[i], difference)) continue;
        feature_of(&target[i].feature, difference, at);
        for (int j = 0; j < 2; j++) {
            at[j] = (at[j] - p->middle[j]) / p->scale;
            p->reach[j][0] = fmin(p->reach[j][0], at[j]);
            p->reach[j][1] = fmax(p->reach[j][1], at[j]);
        }
        value_at(p, at[0], at[1], value);
        double dx = value[0] - target[i].direction_deg[0], dy = value[1] - target[i].direction_deg[1];
        sum += target[i].weight * (dx * dx + dy * dy);
        weights += target[i].weight;
    }
    p->error_deg = sqrt(sum / weights);
}

/* One of the two polynomials, of at least so many places. */
static enum fv_gaze_refusal calibrate(const struct fv_gaze_target *target, int n, bool difference, int least,
                                      struct fv_gaze_polynomial *p)
{
    memset(p, 0, sizeof *p);
    int places = places_of(target, n, difference);
    struct spread targets = spread_of(target, n, difference, true),
                  features = spread_of(target, n, difference, false);
    if (places == 0) return FV_GAZE_FEW;
    if (!(targets.along >= target_least_deg)) return FV_GAZE_TARGETS_EQUAL;
    if (!(targets.across >= line_share * targets.along)) return FV_GAZE_TARGETS_COLLINEAR;
    if (places < least) return FV_GAZE_FEW;
    if (!(features.along >= feature_least_px)) return FV_GAZE_PUPIL_STILL;
    if (!(features.across >= line_share * features.along)) return FV_GAZE_PUPIL_COLLINEAR;
    p->terms = places < 6 ? 4 : places < 12 ? 6 : FV_GAZE_TERMS;
    p->scale = features.along;
    memcpy(p->middle, features.mean, sizeof p->middle);
    if (!isfinite(p->scale) || !fit(target, n, difference, p)) {
        memset(p, 0, sizeof *p);
        return FV_GAZE_PUPIL_COLLINEAR;
    }
    judge(target, n, difference, p);
    if (p->error_deg <= unrelated_share * hypot(targets.along, targets.across)) return FV_GAZE_CALIBRATED;
    memset(p, 0, sizeof *p);
    return FV_GAZE_UNRELATED;
}

static enum fv_gaze_refusal calibrate_both(const struct fv_gaze_target *target, int n, int least,
                                           struct fv_gaze_map *map)
{
    int used = 0, with_glint = 0;
    memset(map, 0, sizeof *map);
    if (n > FV_GAZE_TARGETS_MAX) return FV_GAZE_MANY;
    for (int i = 0; i < n; i++) {
        used += takes_part(&target[i], false);
        with_glint += takes_part(&target[i], true);
    }
    if (used < least) return FV_GAZE_FEW;
    enum fv_gaze_refusal refusal = calibrate(target, n, false, least, &map->pupil);
    if (refusal != FV_GAZE_CALIBRATED) return refusal;
    /* Where the difference says nothing, the pupil alone has to do. */
    if (with_glint >= glint_share * used) calibrate(target, n, true, least, &map->difference);
    return FV_GAZE_CALIBRATED;
}

enum fv_gaze_refusal fv_gaze_calibrate(const struct fv_gaze_target *target, int n, struct fv_gaze_map *map)
{
    return calibrate_both(target, n, 5, map);
}

enum fv_gaze_refusal fv_gaze_calibrate_rest(const struct fv_gaze_target *target, int n,
                                            struct fv_gaze_map *map)
{
    return calibrate_both(target, n, 4, map);
}

bool fv_gaze_map_at(const struct fv_gaze_map *map, const struct fv_gaze_feature *feature,
                    double direction_deg[2], double *error_deg)
{
    bool difference =
        feature->glint_seen && map->difference.terms > 0 && isfinite(feature->glint[0] + feature->glint[1]);
    const struct fv_gaze_polynomial *p = difference ? &map->difference : &map->pupil;
    double at[2], inside[2], value[2], beyond = 0;
    if (p->terms == 0 || !isfinite(feature->pupil[0] + feature->pupil[1])) return false;
    feature_of(feature, difference, at);
    for (int i = 0; i < 2; i++) {
        at[i] = (at[i] - p->middle[i]) / p->scale;
        inside[i] = fmin(fmax(at[i], p->reach[i][0]), p->reach[i][1]);
    }
    value_at(p, inside[0], inside[1], direction_deg);
    for (int i = 0; i < 2; i++) {
        /* Goes on with the slope at the border. Quadratic in each: this difference is exact. */
        double before[2], after[2], h = 0.5, off = fmin(fmax(at[i] - inside[i], -10), 10);
        if (off == 0) continue;
        beyond = hypot(beyond, off);
        memcpy(before, inside, sizeof before);
        memcpy(after, inside, sizeof after);
        before[i] -= h;
        after[i] += h;
        value_at(p, before[0], before[1], value);
        for (int j = 0; j < 2; j++) direction_deg[j] -= off * value[j] / (2 * h);
        value_at(p, after[0], after[1], value);
        for (int j = 0; j < 2; j++) direction_deg[j] += off * value[j] / (2 * h);
    }
    /* A calibration's error doubles half a calibration's width outside it. */
    *error_deg = p->error_deg * (1 + beyond);
    return true;
}
