/* calibration: see the header. */
#include "sensors/eye/calibration.h"

#include "platform/lines.h"
#include "sensors/eye/pupil.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { FILE_MAX_BYTES = 8 << 20 };
static const char columns[] = "eye,pupil_x_px,pupil_y_px,glint_x_px,glint_y_px,right_deg,up_deg,weight";
static const double most_deg = 80;

static int read_head(struct fv_lines *r, struct fv_calibration *c, struct fv_error *error)
{
    int version = 0, end = 0;
    if (!fv_lines_next(r) ||
        sscanf(r->text, "# foveola calibration %9d, %5dx%5d%n", &version, &c->width, &c->height, &end) != 3 ||
        r->text[end] || version != 1)
        return fv_error_set(error, "%s:1: no calibration; must begin with '# foveola calibration 1, 640x400'",
                            r->name);
    if (c->width < 1 || c->height < 1 || c->width > FV_PUPIL_SIDE_MAX || c->height > FV_PUPIL_SIDE_MAX)
        return fv_error_set(error, "%s:1: frames of %dx%d pixels; must be 1 to %d a side", r->name, c->width,
                            c->height, FV_PUPIL_SIDE_MAX);
    if (!fv_lines_next(r) || strcmp(r->text, columns) != 0)
        return fv_error_set(error, "%s:2: must be '%s'", r->name, columns);
    return 0;
}

/* A row; returns its eye, or -1 with the error set. */
static int read_row(const struct fv_lines *r, struct fv_gaze_target *t, struct fv_error *error)
{
    char eye[8];
    int end = 0;
    struct fv_gaze_feature *f = &t->feature;
    if (sscanf(r->text, "%7[^,],%lf,%lf,%lf,%lf,%lf,%lf,%lf%n", eye, &f->pupil[0], &f->pupil[1], &f->glint[0],
               &f->glint[1], &t->direction_deg[0], &t->direction_deg[1], &t->weight, &end) != 8 ||
        r->text[end])
        return fv_error_set(error, "%s:%d: must be %s", r->name, r->line, columns);
    bool left = strcmp(eye, "left") == 0;
    if (!left && strcmp(eye, "right") != 0)
        return fv_error_set(error, "%s:%d: eye '%s'; must be left or right", r->name, r->line, eye);
    if (!isfinite(f->pupil[0]) || !isfinite(f->pupil[1]) ||
        !(hypot(t->direction_deg[0], t->direction_deg[1]) <= most_deg) || !(t->weight >= 0 && t->weight <= 1))
        return fv_error_set(
            error,
            "%s:%d: must be a pupil in pixels, a target at most %g degrees off straight ahead and a "
            "weight from 0 to 1",
            r->name, r->line, most_deg);
    f->glint_seen = isfinite(f->glint[0]) && isfinite(f->glint[1]);
    return left ? 0 : 1;
}

void fv_calibration_begin(struct fv_writer *writer, int width, int height)
{
    fv_writer_print(writer, "# foveola calibration 1, %dx%d\n%s\n", width, height, columns);
}

void fv_calibration_row(struct fv_writer *writer, int eye, const struct fv_gaze_target *t)
{
    const struct fv_gaze_feature *f = &t->feature;
    fv_writer_print(writer, "%s,%.17g,%.17g,", eye ? "right" : "left", f->pupil[0], f->pupil[1]);
    if (f->glint_seen) fv_writer_print(writer, "%.17g,%.17g,", f->glint[0], f->glint[1]);
    else fv_writer_print(writer, "nan,nan,");
    fv_writer_print(writer, "%.17g,%.17g,%.17g\n", t->direction_deg[0], t->direction_deg[1], t->weight);
}

static int fit(struct fv_calibration *c, const char *name, struct fv_gaze_target *target[2],
               struct fv_error *error)
{
    static const char *const eye_name[2] = {"left", "right"};
    if (c->rows[0] + c->rows[1] == 0) return fv_error_set(error, "%s: holds no row", name);
    for (int eye = 0; eye < 2; eye++) {
        if (c->rows[eye] == 0) continue;
        enum fv_gaze_refusal refusal = fv_gaze_calibrate(target[eye], c->rows[eye], &c->map[eye]);
        if (refusal != FV_GAZE_CALIBRATED)
            return fv_error_set(error, "%s: %s eye: %s; calibrate again", name, eye_name[eye],
                                fv_gaze_refusal_text[refusal]);
    }
    return 0;
}

int fv_calibration_parse(struct fv_calibration *c, const char *name, const char *text, size_t size,
                         struct fv_error *error)
{
    struct fv_lines r = {.name = name, .at = text, .end = text + size};
    struct fv_gaze_target *target[2] = {malloc(sizeof **target * FV_GAZE_TARGETS_MAX),
                                        malloc(sizeof **target * FV_GAZE_TARGETS_MAX)};
    memset(c, 0, sizeof *c);
    int failed =
        !target[0] || !target[1] ? fv_error_set(error, "%s: no memory", name) : read_head(&r, c, error);
    while (!failed && fv_lines_next(&r)) {
        struct fv_gaze_target t;
        if (!r.text[0] || r.text[0] == '#') continue;
        int eye = read_row(&r, &t, error);
        if (eye < 0) failed = -1;
        else if (c->rows[eye] == FV_GAZE_TARGETS_MAX)
            failed =
                fv_error_set(error, "%s:%d: more than %d rows of an eye", name, r.line, FV_GAZE_TARGETS_MAX);
        else target[eye][c->rows[eye]++] = t;
    }
    if (!failed) failed = fit(c, name, target, error);
    free(target[0]);
    free(target[1]);
    return failed;
}

int fv_calibration_read(struct fv_calibration *c, const char *path, struct fv_error *error)
{
    char *text;
    size_t size;
    if (fv_file_read(path, FILE_MAX_BYTES, &text, &size, error)) return -1;
    int failed = fv_calibration_parse(c, path, text, size, error);
    free(text);
    return failed;
}
