/* calibrate_tell: what came of a calibration, on standard error. */
#include "cli/calibrate.h"

#include "platform/log.h"

#include <math.h>
#include <stdio.h>

static const char *const eye_name[2] = {"left", "right"};

/* A number, a dash where there is none. */
struct cell {
    char text[24];
};
static struct cell cell(double value)
{
    struct cell out = {"-"};
    if (isfinite(value)) snprintf(out.text, sizeof out.text, "%.2f", value);
    return out;
}

static void tell_eye(const struct fv_calibrated_eye *e, const char *name)
{
    const struct fv_gaze_polynomial *p = &e->map.pupil, *d = &e->map.difference;
    char glint[64] = "no glints";
    if (d->terms > 0) snprintf(glint, sizeof glint, "with glints %d, %.1f", d->terms, d->condition);
    fv_log(
        "%s eye: %d of %d targets, %d frames; terms, condition number: %d, %.1f (%s); degrees off: mean %s, "
        "median %s, worst %s; left out in turn: %s, %s, %s",
        name, e->seen, e->targets, e->rows, p->terms, p->condition, glint, cell(e->fit.mean).text,
        cell(e->fit.median).text, cell(e->fit.worst).text, cell(e->left_out.mean).text,
        cell(e->left_out.median).text, cell(e->left_out.worst).text);
}

void fv_calibrated_tell(const struct fv_calibrated *d)
{
    for (int eye = 0; eye < d->eyes; eye++) tell_eye(&d->eye[eye], eye_name[eye]);
    fv_log_line("%-6s %9s %9s %6s %7s %7s %9s", "eye", "right deg", "up deg", "shown", "frames", "off deg",
                "left out");
    for (int eye = 0; eye < d->eyes; eye++)
        for (int i = 0; i < d->eye[eye].targets; i++) {
            const struct fv_calibrated_target *t = &d->eye[eye].target[i];
            fv_log_line("%-6s %9.1f %9.1f %6d %7d %7s %9s%s", eye_name[eye], t->at_deg[0], t->at_deg[1],
                        t->shown, t->frames, cell(t->off_deg).text, cell(t->left_out_off_deg).text,
                        t->frames ? "" : "  missed");
        }
}
