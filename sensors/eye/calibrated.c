/* calibrated: see the header. */
#include "sensors/eye/calibrated.h"

#include "sensors/eye/calibration.h"

#include <math.h>
#include <string.h>

/* As far off as a gaze without a calibration is: then it is worth nothing. A single target that is further
 * off than twice that was not looked at. */
static const double useless_deg = FV_EYE_MODEL_ERROR_DEG, elsewhere_deg = 2 * FV_EYE_MODEL_ERROR_DEG;
static const char *const eye_name[2] = {"left", "right"};

/* The chosen frames of a row, or so many of them, evenly spread. */
static void take_row(const struct fv_calibrator *c, int row, int eye, struct fv_calibrated_eye *e,
                     struct fv_calibrated_target *t)
{
    int chosen = c->of[row][eye].fixation.looks, kept = 0, at = 0;
    t->first = e->rows;
    t->spread_px = c->of[row][eye].fixation.spread_px;
    for (int i = 0; i < c->of[row][eye].looks; i++) {
        if (!c->of[row][eye].chosen[i]) continue;
        const struct fv_fixation_look *l = &c->of[row][eye].look[i];
        int want = chosen < FV_CALIBRATED_FRAMES ? chosen : FV_CALIBRATED_FRAMES;
        /* The at-th of `chosen` is kept where the count of those wanted up to it grows. */
        if ((int64_t)(at + 1) * want / chosen > kept) {
            e->row[e->rows++] =
                (struct fv_gaze_target){l->feature, {t->at_deg[0], t->at_deg[1]}, fmin(l->weight, 1)};
            kept++;
        }
        at++;
    }
    t->frames = kept;
}

/* The targets, each of the last row that was good. */
static void take_targets(struct fv_calibrator *c, int eye, struct fv_calibrated_eye *e)
{
    for (int first = 0; first < c->shown; first++) {
        int good = -1, before = 0, shown = 0;
        while (before < first && !fv_targets_same(c->show[before].at_deg, c->show[first].at_deg)) before++;
        if (before < first) continue;
        for (int row = first; row < c->shown; row++) {
            if (!fv_targets_same(c->show[row].at_deg, c->show[first].at_deg)) continue;
            shown++;
            if (fv_calibrator_good(c, row, eye)) good = row;
        }
        struct fv_calibrated_target *t = &e->target[e->targets++];
        *t = (struct fv_calibrated_target){.shown = shown};
        memcpy(t->at_deg, c->show[good < 0 ? first : good].at_deg, sizeof t->at_deg);
        if (good >= 0) take_row(c, good, eye, e, t);
        e->seen += t->frames > 0;
    }
}

/* The mean of what a map makes of a target's frames, and how far off it is. */
static double mean_gaze(const struct fv_calibrated_eye *e, const struct fv_calibrated_target *t,
                        const struct fv_gaze_map *map, double gaze_deg[2])
{
    double at[2], error_deg, sum[2] = {0, 0};
    int count = 0;
    for (int i = t->first; i < t->first + t->frames; i++) {
        if (!fv_gaze_map_at(map, &e->row[i].feature, at, &error_deg)) continue;
        for (int k = 0; k < 2; k++) sum[k] += at[k];
        count++;
    }
    for (int k = 0; k < 2; k++) gaze_deg[k] = count > 0 ? sum[k] / count : (double)NAN;
    return hypot(gaze_deg[0] - t->at_deg[0], gaze_deg[1] - t->at_deg[1]);
}

static struct fv_off sum_up(const struct fv_calibrated_eye *e, bool left_out)
{
    double value[FV_SHOWN_MAX];
    struct fv_off off = {(double)NAN, (double)NAN, (double)NAN};
    int n = 0;
    for (int i = 0; i < e->targets; i++) {
        double v = left_out ? e->target[i].left_out_off_deg : e->target[i].off_deg;
        if (isfinite(v)) value[n++] = v;
    }
    if (n == 0) return off;
    off.mean = 0;
    off.worst = 0;
    for (int i = 0; i < n; i++) {
        off.mean += value[i] / n;
        off.worst = fmax(off.worst, value[i]);
    }
    off.median = fv_fixation_median(value, n);
    return off;
}

/* The gaze at a target by a map that was made without it. */
static void leave_out(struct fv_calibrated_eye *e, struct fv_calibrated_target *t)
{
    struct fv_gaze_map map;
    double weight[FV_CALIBRATED_FRAMES];
    for (int i = 0; i < t->frames; i++) {
        weight[i] = e->row[t->first + i].weight;
        e->row[t->first + i].weight = 0;
    }
    enum fv_gaze_refusal refusal = fv_gaze_calibrate_rest(e->row, e->rows, &map);
    for (int i = 0; i < t->frames; i++) e->row[t->first + i].weight = weight[i];
    if (refusal != FV_GAZE_CALIBRATED) return;
    t->left_out_off_deg = mean_gaze(e, t, &map, t->left_out_deg);
    t->rest_error_deg = map.difference.terms > 0 ? map.difference.error_deg : map.pupil.error_deg;
}

/* The target without which the others agree best. Where each fit without one goes through all others
 * exactly, none can be told. */
static const struct fv_calibrated_target *odd_one(const struct fv_calibrated_eye *e)
{
    const struct fv_calibrated_target *odd = NULL;
    if (e->seen <= e->map.pupil.terms + 1) return NULL;
    for (int i = 0; i < e->targets; i++)
        if (isfinite(e->target[i].rest_error_deg) &&
            (!odd || e->target[i].rest_error_deg < odd->rest_error_deg))
            odd = &e->target[i];
    return odd;
}

/* Whether what was left out in turn lies where the others would have it. */
static int judge(const struct fv_calibrated_eye *e, const char *name, struct fv_error *error)
{
    const struct fv_calibrated_target *odd = odd_one(e);
    if (odd && odd->left_out_off_deg > elsewhere_deg)
        return fv_error_set(
            error,
            "%s eye: at the target %.1f degrees right, %.1f up the gaze is %.1f off where the "
            "others would have it: it was not looked at; calibrate again",
            name, odd->at_deg[0], odd->at_deg[1], odd->left_out_off_deg);
    if (e->left_out.worst > elsewhere_deg)
        return fv_error_set(
            error,
            "%s eye: left out in turn, targets are up to %.1f degrees off where the others would "
            "have them: not all were looked at; calibrate again",
            name, e->left_out.worst);
    if (e->left_out.median > useless_deg)
        return fv_error_set(error,
                            "%s eye: left out in turn, targets are %.1f degrees off (median), no better than "
                            "without a calibration; calibrate again",
                            name, e->left_out.median);
    return 0;
}

static int make_eye(struct fv_calibrated_eye *e, struct fv_calibrator *c, int eye, struct fv_error *error)
{
    memset(e, 0, sizeof *e);
    take_targets(c, eye, e);
    for (int i = 0; i < e->targets; i++) {
        struct fv_calibrated_target *t = &e->target[i];
        t->gaze_deg[0] = t->gaze_deg[1] = t->left_out_deg[0] = t->left_out_deg[1] = (double)NAN;
        t->off_deg = t->left_out_off_deg = t->rest_error_deg = (double)NAN;
    }
    enum fv_gaze_refusal refusal = fv_gaze_calibrate(e->row, e->rows, &e->map);
    if (refusal == FV_GAZE_FEW)
        return fv_error_set(error, "%s eye: %s (%d of %d; the pupil was found in %lld of %lld frames)",
                            eye_name[eye], fv_gaze_refusal_text[refusal], e->seen, e->targets,
                            (long long)c->seen[eye], (long long)c->frames[eye]);
    if (refusal != FV_GAZE_CALIBRATED)
        return fv_error_set(error, "%s eye: %s; calibrate again", eye_name[eye],
                            fv_gaze_refusal_text[refusal]);
    for (int i = 0; i < e->targets; i++) {
        struct fv_calibrated_target *t = &e->target[i];
        if (t->frames == 0) continue;
        t->off_deg = mean_gaze(e, t, &e->map, t->gaze_deg);
        leave_out(e, t);
    }
    e->fit = sum_up(e, false);
    e->left_out = sum_up(e, true);
    return judge(e, eye_name[eye], error);
}

int fv_calibrated_make(struct fv_calibrated *d, struct fv_calibrator *c, struct fv_error *error)
{
    int failed = 0;
    d->eyes = c->settings.eyes;
    for (int eye = 0; eye < d->eyes; eye++) {
        struct fv_error why;
        if (make_eye(&d->eye[eye], c, eye, &why) && !failed) failed = fv_error_set(error, "%s", why.text);
    }
    return failed;
}

int fv_calibrated_write(const struct fv_calibrated *d, int width, int height, const char *path,
                        struct fv_writer *writer, struct fv_error *error)
{
    if (fv_writer_open(writer, path, error)) return -1;
    fv_calibration_begin(writer, width, height);
    for (int eye = 0; eye < d->eyes; eye++)
        for (int i = 0; i < d->eye[eye].rows; i++) fv_calibration_row(writer, eye, &d->eye[eye].row[i]);
    return fv_writer_close(writer, error);
}
