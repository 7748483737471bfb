/* measure_plots: error against run time as plots: the fovea, the whole picture, and every zone and
 * measure as small multiples. */
#include "cli/measure_sections.h"

#include <math.h>
#include <stdio.h>

static const char ms_name[] = "frame time (ms)";

/* What is plotted over frame time. */
struct quantity {
    const char *caption, *unit;
    const struct fv_measured *(*of)(const struct fv_measure_row *row, enum fv_zone zone);
    enum fv_zone zone;
    double least; /* length of the axis: see fv_axis_settle */
    struct fv_axis empty;
    bool from_zero;
};

static const struct fv_measured *psnr_of(const struct fv_measure_row *row, enum fv_zone zone)
{
    return &row->psnr[zone];
}
static const struct fv_measured *rmse_of(const struct fv_measure_row *row, enum fv_zone zone)
{
    return &row->rmse[zone];
}
static const struct fv_measured *ssim_of(const struct fv_measure_row *row, enum fv_zone zone)
{
    return &row->ssim[zone];
}
static const struct fv_measured *flip_of(const struct fv_measure_row *row, enum fv_zone zone)
{
    return &row->flip[zone];
}
static const struct fv_measured *flicker_of(const struct fv_measure_row *row, enum fv_zone zone)
{
    (void)zone;
    return &row->flicker;
}

/* Holds every row's value and its error bar; on a logarithmic axis bars that reach far are cut. */
static void hold_rows(const struct fv_measure_page *page, const struct quantity *q, struct fv_axis *axis)
{
    for (int i = 0; i < page->rows; i++) {
        const struct fv_measured *m = q->of(&page->row[i], q->zone);
        fv_axis_hold(axis, m->value);
        if (!isfinite(m->value)) continue;
        fv_axis_hold(axis, axis->log ? fmax(m->low, m->value / 3) : m->low);
        fv_axis_hold(axis, axis->log ? fmin(m->high, m->value * 3) : m->high);
    }
    if (q->from_zero) fv_axis_hold(axis, 0);
}

static void draw_curve(struct fv_plot *plot, const struct fv_measure_page *page, const struct quantity *q,
                       const struct fv_measure_method *method)
{
    char class[32];
    snprintf(class, sizeof class, "curve c%d", method->slot % FV_PLOT_SLOTS);
    fv_path_open(plot, class);
    for (int i = method->first; i < method->end; i++)
        fv_path_point(plot, page->row[i].frame_ms.value, q->of(&page->row[i], q->zone)->value);
    fv_path_close(plot);
}

/* Which rows' points have their level beside them: the ends of curves first, then those that have room. */
static void choose_labels(const struct fv_plot *plot, const struct fv_measure_page *page,
                          const struct quantity *q, bool labelled[FV_ROWS_MAX])
{
    double x[FV_ROWS_MAX], y[FV_ROWS_MAX];
    int count = 0;
    for (int ends = 1; ends >= 0; ends--) {
        for (int k = 0; k < page->methods; k++) {
            const struct fv_measure_method *method = &page->method[k];
            for (int i = method->first; i < method->end; i++) {
                if ((i == method->first || i + 1 == method->end) != ends) continue;
                x[count] = fv_plot_part_x(plot, page->row[i].frame_ms.value);
                y[count] = fv_plot_part_y(plot, q->of(&page->row[i], q->zone)->value);
                labelled[i] = true;
                for (int n = 0; n < count && labelled[i]; n++)
                    labelled[i] = fabs(x[n] - x[count]) > 0.03 || fabs(y[n] - y[count]) > 0.05;
                count += labelled[i];
            }
        }
    }
}

/* `labelled`: NULL where no point has a label or a ring. */
static void draw_points(struct fv_plot *plot, const struct fv_measure_page *page, const struct quantity *q,
                        const struct fv_measure_method *method, const bool *labelled)
{
    for (int i = method->first; i < method->end; i++) {
        const struct fv_measure_row *r = &page->row[i];
        double x = r->frame_ms.value, y = q->of(r, q->zone)->value;
        bool ring = labelled && fv_row_is_pareto(page->row, page->rows, i, q->zone);
        char what[192], label[16];
        snprintf(label, sizeof label, "%d", r->level);
        snprintf(what, sizeof what, "%s level %d: %s ms, %s %s", r->method, r->level,
                 fv_shown_fixed(x, 2).text, fv_shown_infinite(y, q->unit[0] == 'd' ? 1 : 4).text, q->unit);
        const struct fv_mark mark = {method->slot, ring, labelled && labelled[i] ? label : NULL, what};
        fv_plot_point(plot, x, y, &mark);
    }
}

/* Error bars below curves below points, so that no method hides another's points. `labelled`: see
 * draw_points. */
static void draw_methods(struct fv_plot *plot, const struct fv_measure_page *page, const struct quantity *q,
                         const bool *labelled)
{
    for (int k = 0; k < page->methods; k++)
        for (int i = page->method[k].first; i < page->method[k].end; i++) {
            const struct fv_measure_row *r = &page->row[i];
            const struct fv_measured *m = q->of(r, q->zone);
            if (isnan(r->frame_ms.value) || isnan(m->value)) continue;
            const struct fv_bars bars = {r->frame_ms.low, r->frame_ms.high, m->low, m->high};
            fv_plot_bars(plot, r->frame_ms.value, m->value, &bars, page->method[k].slot);
        }
    for (int k = 0; k < page->methods; k++) draw_curve(plot, page, q, &page->method[k]);
    for (int k = 0; k < page->methods; k++) draw_points(plot, page, q, &page->method[k], labelled);
}

static void draw_period(struct fv_plot *plot, const struct fv_measure_page *page)
{
    double period = page->report->period_ms;
    char label[64];
    if (!(period >= page->ms.low && period <= page->ms.high)) return;
    snprintf(label, sizeof label, "display's period %.4g ms", period);
    fv_plot_upright(plot, period, label);
}

static void write_legend(const struct fv_measure_page *page, bool rings)
{
    fv_writer_print(page->out, "<ul class=\"legend\">");
    for (int k = 0; k < page->methods; k++) {
        fv_writer_print(page->out, "<li>");
        fv_plot_key(page->out, page->method[k].slot);
        fv_html_text(page->out, page->method[k].name);
        fv_writer_print(page->out, "</li>");
    }
    if (rings)
        fv_writer_print(page->out,
                        "<li><svg class=\"key\" width=\"20\" height=\"14\" aria-hidden=\"true\">"
                        "<circle class=\"ring\" cx=\"10\" cy=\"7\" r=\"7.5\"/></svg>Pareto front</li>");
    fv_writer_print(page->out, "</ul>\n");
}

static void draw_main(struct fv_measure_page *page, const struct quantity *q, int height_px)
{
    bool labelled[FV_ROWS_MAX] = {false};
    char label[256];
    struct fv_plot plot = {.out = page->out, .x = page->ms, .y = fv_axis_empty(true)};
    hold_rows(page, q, &plot.y);
    fv_axis_settle(&plot.y, q->least, q->empty);
    snprintf(label, sizeof label, "%s against frame time, one curve for each of %d methods", q->caption,
             page->methods);
    fv_plot_open(&plot,
                 &(struct fv_plot_text){
                     .caption = q->caption, .label = label, .x_name = ms_name, .height_px = height_px});
    draw_period(&plot, page);
    choose_labels(&plot, page, q, labelled);
    draw_methods(&plot, page, q, labelled);
    fv_plot_close(&plot);
}

void fv_measure_main_plots(struct fv_measure_page *page)
{
    static const struct quantity quantities[] = {
        {"Error in the fovea (RMSE, full scale 1)",
         "RMSE",
         rmse_of,
         FV_ZONE_FOVEA,
         3,
         {0.001, 0.1, true},
         false},
        {"Error in the whole picture (RMSE, full scale 1)",
         "RMSE",
         rmse_of,
         FV_ZONE_ALL,
         3,
         {0.001, 0.1, true},
         false},
    };
    fv_section_open(
        page->out, "Error against run time",
        "Each point is a method at one of its quality levels: the further left, the faster; the further "
        "down, the closer to the reference. Both axes are logarithmic: equal steps are equal factors. "
        "Numbers are levels; bars span the middle half of the frame times and the best to the worst "
        "picture. Ringed points are on the Pareto front: nothing else is both faster and better.");
    write_legend(page, true);
    for (int i = 0; i < 2; i++) draw_main(page, &quantities[i], i ? 280 : 400);
    fv_section_close(page->out);
}

static void draw_small(struct fv_measure_page *page, const struct quantity *q, const struct fv_axis *y)
{
    char label[160];
    struct fv_plot plot = {.out = page->out, .x = page->ms, .y = *y};
    snprintf(label, sizeof label, "%s against frame time", q->caption);
    fv_plot_open(
        &plot,
        &(struct fv_plot_text){
            .caption = q->caption, .label = label, .x_name = ms_name, .height_px = 170, .narrow = true});
    draw_methods(&plot, page, q, NULL);
    fv_plot_close(&plot);
}

void fv_measure_zones(struct fv_measure_page *page)
{
    static const struct quantity zones[] = {
        {"Fovea, to 3.3\xC2\xB0: PSNR (dB)", "dB", psnr_of, FV_ZONE_FOVEA, 6, {30, 50, false}, false},
        {"Parafovea, to 5.5\xC2\xB0: PSNR (dB)", "dB", psnr_of, FV_ZONE_PARA, 6, {30, 50, false}, false},
        {"Perifovea, to 12.1\xC2\xB0: PSNR (dB)", "dB", psnr_of, FV_ZONE_PERI, 6, {30, 50, false}, false},
        {"Near periphery, to 30\xC2\xB0: PSNR (dB)", "dB", psnr_of, FV_ZONE_NEAR, 6, {30, 50, false}, false},
        {"Far periphery: PSNR (dB)", "dB", psnr_of, FV_ZONE_FAR, 6, {30, 50, false}, false},
    };
    static const struct quantity others[] = {
        {"SSIM (1 is identical)", "SSIM", ssim_of, FV_ZONE_ALL, 0.02, {0.9, 1, false}, false},
        {"FLIP (0 is identical)", "FLIP", flip_of, FV_ZONE_ALL, 0.02, {0, 0.1, false}, true},
        {"Flicker above the reference's (full scale 1)",
         "flicker",
         flicker_of,
         FV_ZONE_ALL,
         0.002,
         {0, 0.01, false},
         true},
    };
    enum { ZONES = sizeof zones / sizeof zones[0], OTHERS = sizeof others / sizeof others[0] };
    struct fv_axis decibel = fv_axis_empty(false);
    bool infinite = false;
    for (int z = 0; z < ZONES; z++) hold_rows(page, &zones[z], &decibel);
    for (int i = 0; i < page->rows; i++)
        for (int z = 0; z < ZONES; z++) infinite |= isinf(page->row[i].psnr[z].value);
    fv_axis_settle(&decibel, zones[0].least, zones[0].empty);
    fv_section_open(
        page->out, "Zone by zone",
        infinite ? "Where the eye looks and around it: the further up, the better. All five share their "
                   "axes. Points at the upper edge have no error at all."
                 : "Where the eye looks and around it: the further up, the better. All five share their "
                   "axes.");
    fv_writer_print(page->out, "<div class=\"many\">\n");
    for (int z = 0; z < ZONES; z++) draw_small(page, &zones[z], &decibel);
    write_legend(page, false);
    fv_writer_print(page->out, "</div>\n");
    fv_section_close(page->out);
    fv_section_open(
        page->out, "As a viewer would judge",
        "Of the whole picture: structure (SSIM, up is better), visible difference when flipping between "
        "two pictures (FLIP, down is better), and unrest from frame to frame (down is better).");
    fv_writer_print(page->out, "<div class=\"many\">\n");
    for (int k = 0; k < OTHERS; k++) {
        struct fv_axis axis = fv_axis_empty(false);
        hold_rows(page, &others[k], &axis);
        fv_axis_settle(&axis, others[k].least, others[k].empty);
        draw_small(page, &others[k], &axis);
    }
    fv_writer_print(page->out, "</div>\n");
    fv_section_close(page->out);
}
