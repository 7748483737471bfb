/* measure_tables: the tables of measure's report: time to error, all rows, the other numerics, and what
 * the words mean. */
#include "cli/measure_sections.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static void write_reached(struct fv_measure_page *page, int which, int plain)
{
    if (which < 0) {
        fv_writer_print(page->out, "<td class=\"n out\">not reached</td>");
        return;
    }
    const struct fv_measure_row *r = &page->row[which];
    double ratio = plain < 0 ? (double)NAN : r->speedup.value / page->row[plain].speedup.value;
    bool compared = which != plain && isfinite(ratio);
    fv_writer_print(page->out, "<td class=\"n\"><b>%s ms</b><br><small><span>level %d%s</span>",
                    fv_shown_fixed(r->frame_ms.value, 2).text, r->level, compared ? "," : "");
    if (compared) fv_writer_print(page->out, " <span>%s ×</span>", fv_shown_fixed(ratio, 2).text);
    fv_writer_print(page->out, "</small></td>");
}

void fv_measure_time_to_error(struct fv_measure_page *page)
{
    enum { TARGETS = 3 };
    static const double targets_db[TARGETS] = {30, 35, 40};
    int plain[TARGETS];
    fv_section_open(
        page->out, "Time to error",
        "How long a frame takes at the fastest level whose fovea reaches a PSNR, and how many times as "
        "fast as plain supersampling (full) that is. The factors are of frames timed in turns, so they "
        "hold although the machine's speed drifts.");
    fv_table_open(page->out, "reach",
                  "<th scope=\"col\">method</th><th scope=\"col\" class=\"n\">30 dB</th>"
                  "<th scope=\"col\" class=\"n\">35 dB</th><th scope=\"col\" class=\"n\">40 dB</th>");
    for (int t = 0; t < TARGETS; t++)
        plain[t] = fv_rows_reach(page->row, page->rows, "full", FV_ZONE_FOVEA, targets_db[t]);
    for (int k = 0; k < page->methods; k++) {
        const struct fv_measure_method *method = &page->method[k];
        fv_writer_print(page->out, "<tr><th scope=\"row\">");
        fv_measure_name(page, method);
        fv_writer_print(page->out, "</th>");
        for (int t = 0; t < TARGETS; t++)
            write_reached(page,
                          fv_rows_reach(page->row, page->rows, method->name, FV_ZONE_FOVEA, targets_db[t]),
                          plain[t]);
        fv_writer_print(page->out, "</tr>\n");
    }
    fv_table_close(page->out);
    fv_section_close(page->out);
}

static void write_row(struct fv_measure_page *page, const struct fv_measure_method *method, int which)
{
    const struct fv_measure_row *r = &page->row[which];
    bool pareto = fv_row_is_pareto(page->row, page->rows, which, FV_ZONE_FOVEA);
    fv_writer_print(page->out, "<tr%s><th scope=\"row\">", pareto ? " class=\"front\"" : "");
    fv_measure_name(page, method);
    fv_writer_print(page->out, " %d</th><td class=\"tag\">%s</td><td class=\"wide\">", r->level,
                    pareto ? "\xE2\x97\x8F" : "");
    fv_html_text(page->out, r->parameters);
    fv_writer_print(page->out, "</td>");
    fv_number_cell(page->out, fv_shown_fixed(r->frame_ms.value, 2));
    fv_number_cell(page->out, fv_shown_fixed(r->frame_ms_p99, 2));
    int decimals = r->speedup.value < 0.1 ? 3 : 2;
    fv_writer_print(page->out, "<td class=\"n\">%s <small>%s–%s</small></td>",
                    fv_shown_fixed(r->speedup.value, decimals).text,
                    fv_shown_fixed(r->speedup.low, decimals).text,
                    fv_shown_fixed(r->speedup.high, decimals).text);
    fv_number_cell(page->out, fv_shown_count(r->rays));
    fv_number_cell(page->out, fv_shown_percent(r->sampled_fraction));
    for (int z = 0; z < FV_ZONES; z++) fv_number_cell(page->out, fv_shown_infinite(r->psnr[z].value, 1));
    fv_number_cell(page->out, fv_shown_infinite(r->ssim[FV_ZONE_ALL].value, 4));
    fv_number_cell(page->out, fv_shown_infinite(r->flip[FV_ZONE_ALL].value, 4));
    fv_number_cell(page->out, fv_shown_infinite(r->flicker.value, 4));
    fv_writer_print(page->out, "</tr>\n");
}

void fv_measure_rows(struct fv_measure_page *page)
{
    fv_section_open(
        page->out, "All rows",
        "Times in ms. Speed-up: median over the path of full's time by this row's at the same pose, and "
        "its quartiles. PSNR in dB. A dot: on the Pareto front of the fovea.");
    fv_table_open(
        page->out, "rows",
        "<th scope=\"col\">method, level</th><th scope=\"col\"><span class=\"hidden\">Pareto</span></th>"
        "<th scope=\"col\">parameters</th><th scope=\"col\" class=\"n\">p50</th>"
        "<th scope=\"col\" class=\"n\">p99</th><th scope=\"col\" class=\"n\">speed-up</th>"
        "<th scope=\"col\" class=\"n\">rays</th><th scope=\"col\" class=\"n\">sampled</th>"
        "<th scope=\"col\" class=\"n\">fovea</th><th scope=\"col\" class=\"n\">para</th>"
        "<th scope=\"col\" class=\"n\">peri</th><th scope=\"col\" class=\"n\">near</th>"
        "<th scope=\"col\" class=\"n\">far</th><th scope=\"col\" class=\"n\">all</th>"
        "<th scope=\"col\" class=\"n\">SSIM</th><th scope=\"col\" class=\"n\">FLIP</th>"
        "<th scope=\"col\" class=\"n\">flicker</th>");
    for (int k = 0; k < page->methods; k++)
        for (int i = page->method[k].first; i < page->method[k].end; i++)
            write_row(page, &page->method[k], i);
    fv_table_close(page->out);
    fv_section_close(page->out);
}

/* About three significant digits, whatever the size, and the unit. */
static void write_quantity(struct fv_measure_page *page, double value, const char *unit)
{
    double size = fabs(value);
    struct fv_shown shown = fv_shown_infinite(value, size >= 100 ? 0 : size >= 10 ? 1 : 2);
    if (isfinite(value) && (size >= 1e6 || (size > 0 && size < 1e-4)))
        snprintf(shown.text, sizeof shown.text, "%.2e", value);
    else if (size > 0 && size < 1) snprintf(shown.text, sizeof shown.text, "%.3g", value);
    fv_writer_print(page->out, "<td class=\"n\">%s", shown.text);
    if (!isnan(value) && unit[0]) {
        fv_writer_print(page->out, " <small>");
        fv_html_text(page->out, unit);
        fv_writer_print(page->out, "</small>");
    }
    fv_writer_print(page->out, "</td>");
}

static void write_numeric(struct fv_measure_page *page, const struct fv_numeric_row *r)
{
    fv_writer_print(page->out, "<tr>");
    fv_name_cell(page->out, r->method);
    fv_writer_print(page->out, "<td>");
    fv_html_text(page->out, r->condition);
    fv_writer_print(page->out, "</td>");
    write_quantity(page, r->error_p50, r->error_unit);
    write_quantity(page, r->error_p95, r->error_unit);
    write_quantity(page, r->cost, r->cost_unit);
    fv_writer_print(page->out, "</tr>\n");
}

void fv_measure_numerics(struct fv_measure_page *page)
{
    const struct fv_measure_report *report = page->report;
    bool done[FV_NUMERICS_MAX] = {false};
    int rows = report->numerics < FV_NUMERICS_MAX ? report->numerics : FV_NUMERICS_MAX;
    if (rows < 1) return;
    fv_section_open(
        page->out, "Other numerics",
        "What is computed between the pictures: the error of each way to do it, and what that costs.");
    fv_table_open(
        page->out, "numerics",
        "<th scope=\"col\">method</th><th scope=\"col\">condition</th><th scope=\"col\" class=\"n\">"
        "error, median</th><th scope=\"col\" class=\"n\">95 % below</th><th scope=\"col\" class=\"n\">"
        "cost</th>");
    for (int i = 0; i < rows; i++) {
        if (done[i]) continue;
        fv_writer_print(page->out, "<tr class=\"group\"><th colspan=\"5\" scope=\"rowgroup\">");
        fv_html_text(page->out, report->numeric[i].quantity);
        fv_writer_print(page->out, "</th></tr>\n");
        for (int k = i; k < rows; k++) {
            if (strcmp(report->numeric[k].quantity, report->numeric[i].quantity) != 0) continue;
            write_numeric(page, &report->numeric[k]);
            done[k] = true;
        }
    }
    fv_table_close(page->out);
    fv_section_close(page->out);
}

void fv_measure_definitions(struct fv_measure_page *page)
{
    static const char *const rows[][2] = {
        {"Reference", "The same view at many samples a pixel; how well half of them agree with all says how "
                      "far it is settled. Every picture is compared with the reference of "
                      "its own pose."},
        {"Frame time",
         "Wall time from latching pose and gaze to the finished pixels, without presenting them, along the "
         "scene's path: its "
         "median, with the middle half of the frames between the bars; p99: 99 % of frames took no longer."},
        {"Speed-up",
         "Frames of the method and of plain rendering at one sample a pixel are timed in turns at the same "
         "poses. The speed-up is the median of the ratios, so that a machine that slows down slows both."},
        {"Zones", "By eccentricity, the angle from where the eye looks: fovea to 3.3°, parafovea to 5.5°, "
                  "perifovea to "
                  "12.1°, near periphery to 30°, far periphery beyond."},
        {"RMSE, PSNR",
         "Root mean squared difference of the red, green and blue values as displayed, full scale 1; PSNR "
         "is the same in decibels, -20 log10(RMSE), infinite (∞) where there is no difference."},
        {"SSIM", "Structural similarity of brightness, Gaussian window 11 × 11 (Wang, Bovik, Sheikh and "
                 "Simoncelli 2004): "
                 "1 is identical."},
        {"FLIP",
         "The difference that is seen when flipping between two pictures at this display's pixels per degree "
         "(Andersson et al. 2020): 0 is identical, 1 the largest."},
        {"Flicker", "Mean change of a surface's colour from one frame to the next, followed with exact "
                    "depth, above that "
                    "of the reference: 0 is as calm as the reference."},
        {"Pareto front",
         "The rows that no other row of the scene beats in both speed-up and PSNR: the choice is among "
         "these."},
    };
    fv_terms(page->out, "How it was measured", rows, sizeof rows / sizeof rows[0]);
}
