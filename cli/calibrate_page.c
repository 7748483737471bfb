/* calibrate_page: report.html of a calibration: where the targets were, and where the fitted gaze fell. */
#include "cli/calibrate.h"
#include "cli/markup.h"
#include "cli/page.h"
#include "cli/plot.h"

#include <math.h>
#include <stdio.h>

static const char *const eye_name[2] = {"Left eye", "Right eye"};
/* Slots of the plot. */
enum { TARGET, FITTED, LEFT_OUT };
static const char *const slot_name[] = {"target", "gaze by the fit", "gaze by a fit without that target"};

/* The median as a number, mean and worst beside it. */
static void write_off(struct fv_writer *out, const char *name, const struct fv_off *off)
{
    char more[128];
    snprintf(more, sizeof more, "median; mean %s°, worst %s°", fv_shown_fixed(off->mean, 2).text,
             fv_shown_fixed(off->worst, 2).text);
    fv_fact(out, name, fv_shown_fixed(off->median, 2), "°", more);
}

static void write_facts(struct fv_writer *out, const struct fv_calibrated_eye *e)
{
    char more[96];
    fv_writer_print(out, "<dl class=\"facts\">\n");
    snprintf(more, sizeof more, "of %d targets", e->targets);
    fv_fact(out, "Seen", fv_shown_fixed(e->seen, 0), "", more);
    write_off(out, "Off the targets", &e->fit);
    write_off(out, "Left out in turn", &e->left_out);
    snprintf(more, sizeof more, "condition number %.1f", e->map.pupil.condition);
    fv_fact(out, "Terms", fv_shown_fixed(e->map.pupil.terms, 0), "", more);
    fv_writer_print(out, "</dl>\n");
}

/* Lines from the targets to where the gaze fell. */
static void draw_ways(struct fv_plot *plot, const struct fv_calibrated_eye *e)
{
    fv_path_open(plot, "given");
    for (int i = 0; i < e->targets; i++) {
        const struct fv_calibrated_target *t = &e->target[i];
        const double *at[] = {t->gaze_deg, t->at_deg, t->left_out_deg};
        for (int k = 0; k < 3; k++) fv_path_point(plot, at[k][0], at[k][1]);
        fv_path_point(plot, NAN, NAN);
    }
    fv_path_close(plot);
}

/* What the markers are. */
static void write_legend(struct fv_writer *out)
{
    fv_writer_print(out, "<div><ul class=\"legend\">");
    for (int k = 0; k < 3; k++) {
        fv_writer_print(out,
                        "<li><svg class=\"key\" width=\"14\" height=\"14\" aria-hidden=\"true\">"
                        "<use class=\"c%d\" href=\"#mark%d\" x=\"7\" y=\"7\"/></svg>",
                        k, k);
        fv_html_text(out, slot_name[k]);
        fv_writer_print(out, "</li>");
    }
    fv_writer_print(out, "</ul></div>\n");
}

static void draw_eye(struct fv_writer *out, const struct fv_calibrated_eye *e, const char *name)
{
    struct fv_plot plot = {.out = out, .x = fv_axis_empty(false), .y = fv_axis_empty(false)};
    char what[96], label[64];
    for (int i = 0; i < e->targets; i++) {
        const struct fv_calibrated_target *t = &e->target[i];
        const double *at[3] = {t->at_deg, t->gaze_deg, t->left_out_deg};
        for (int k = 0; k < 3; k++) {
            fv_axis_hold(&plot.x, at[k][0]);
            fv_axis_hold(&plot.y, at[k][1]);
        }
    }
    fv_axis_settle(&plot.x, 2, (struct fv_axis){-20, 20, false});
    fv_axis_settle(&plot.y, 2, (struct fv_axis){-15, 15, false});
    snprintf(label, sizeof label, "%s: targets and gaze", name);
    fv_plot_open(&plot,
                 &(struct fv_plot_text){
                     .caption = "degrees up", .label = label, .x_name = "degrees right", .height_px = 380});
    draw_ways(&plot, e);
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < e->targets; i++) {
            const struct fv_calibrated_target *t = &e->target[i];
            const double *at = k == TARGET ? t->at_deg : k == FITTED ? t->gaze_deg : t->left_out_deg;
            snprintf(what, sizeof what, "%s: %.2f° right, %.2f° up%s", slot_name[k], at[0], at[1],
                     t->frames ? "" : " (missed)");
            fv_plot_point(&plot, at[0], at[1],
                          &(struct fv_mark){.slot = k, .ring = k == TARGET, .what = what});
        }
    fv_plot_close(&plot);
    write_legend(out);
}

static void write_table(struct fv_writer *out, const struct fv_calibrated_eye *e)
{
    char name[64];
    fv_table_open(out, "targets",
                  "<th scope=\"col\">target: right, up</th><th scope=\"col\" class=\"n\">shown</th>"
                  "<th scope=\"col\" class=\"n\">frames</th><th scope=\"col\" class=\"n\">spread, px</th>"
                  "<th scope=\"col\" class=\"n\">off, °</th><th scope=\"col\" class=\"n\">left out, °</th>");
    for (int i = 0; i < e->targets; i++) {
        const struct fv_calibrated_target *t = &e->target[i];
        snprintf(name, sizeof name, "%.1f°, %.1f°%s", t->at_deg[0], t->at_deg[1], t->frames ? "" : " missed");
        fv_writer_print(out, "<tr>");
        fv_name_cell(out, name);
        fv_number_cell(out, fv_shown_fixed(t->shown, 0));
        fv_number_cell(out, fv_shown_fixed(t->frames, 0));
        fv_number_cell(out, fv_shown_fixed(t->frames ? t->spread_px : (double)NAN, 2));
        fv_number_cell(out, fv_shown_fixed(t->off_deg, 2));
        fv_number_cell(out, fv_shown_fixed(t->left_out_off_deg, 2));
        fv_writer_print(out, "</tr>\n");
    }
    fv_table_close(out);
}

int fv_calibrated_page(const struct fv_calibrated *d, const char *about, const char *path,
                       struct fv_error *error)
{
    static struct fv_writer out;
    if (fv_writer_open(&out, path, error)) return -1;
    fv_page_open(&out, "Foveola: calibration");
    fv_writer_print(&out, "<header><h1>Calibration</h1><p class=\"soft\">");
    fv_html_text(&out, about);
    fv_writer_print(&out, "</p></header>\n");
    for (int eye = 0; eye < d->eyes; eye++) {
        fv_section_open(
            &out, eye_name[eye],
            "The fit is judged too kindly by the targets that it was made from, and too strictly by "
            "targets at the border that it was made without.");
        write_facts(&out, &d->eye[eye]);
        draw_eye(&out, &d->eye[eye], eye_name[eye]);
        write_table(&out, &d->eye[eye]);
        fv_section_close(&out);
    }
    fv_page_close(&out);
    return fv_writer_close(&out, error);
}
