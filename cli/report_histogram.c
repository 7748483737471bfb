/* report_histogram: how frame times are spread: histogram with the budget, and percentiles. */
#include "cli/columns.h"
#include "cli/markup.h"
#include "cli/page.h"
#include "cli/plot.h"
#include "cli/report_sections.h"

#include <math.h>
#include <stdio.h>

enum { HISTOGRAM_BINS = 96 };

struct histogram {
    double low, width;
    int bins;
    bool cut; /* the last bin holds all that is longer, too */
    int64_t count[HISTOGRAM_BINS];
};

/* Between 46 and 93 bins up to the budget or the longest frame, the budget an edge of one: they are its
 * width halved or doubled. */
static void fill_histogram(struct histogram *h, const struct fv_report_page *page)
{
    const struct fv_column *column = &fv_columns[FV_COLUMN_FRAME_MS];
    struct fv_summary summary = fv_column_summary(page->session, column);
    double p99 = fv_column_percentile(page->session, column, 0, fv_recorded(page->session), 99);
    double low = summary.min, high = fmin(summary.max, fmax(1.4 * page->period_ms, 1.1 * p99));
    double range = fmax(fmax(high, page->period_ms) - fmax(low, 0), 1e-3 * page->frame_top_ms);
    h->width = isnan(page->period_ms) ? page->frame_top_ms : page->period_ms;
    while (h->width * (HISTOGRAM_BINS - 3) < range) h->width *= 2;
    while (h->width * (HISTOGRAM_BINS - 3) > 2 * range) h->width /= 2;
    h->cut = high < summary.max;
    h->low = fmax(floor(low / h->width) - 1, 0) * h->width;
    h->bins = (int)fmin(fmax(ceil((high - h->low) / h->width), 0) + 1, HISTOGRAM_BINS);
    for (int64_t i = 0; i < fv_recorded(page->session); i++) {
        double value = fv_column_value(page->session, column, i);
        if (isnan(value)) continue;
        h->count[(int)fmin(fmax((value - h->low) / h->width, 0), h->bins - 1)]++;
    }
}

static void write_percentiles(struct fv_report_page *page)
{
    static const struct {
        const char *name;
        double percent;
    } rows[] = {{"p50", 50}, {"p90", 90}, {"p95", 95}, {"p99", 99}, {"p99.9", 99.9}, {"max", 100}};
    const struct fv_column *column = &fv_columns[FV_COLUMN_FRAME_MS];
    fv_table_open(page->out, "percentiles",
                  "<th scope=\"col\">percentile</th><th scope=\"col\" class=\"n\">ms</th>"
                  "<th scope=\"col\" class=\"n\">of a period</th>");
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        double ms =
            fv_column_percentile(page->session, column, 0, fv_recorded(page->session), rows[i].percent);
        fv_writer_print(page->out, "<tr>");
        fv_name_cell(page->out, rows[i].name);
        fv_number_cell(page->out, fv_shown_fixed(ms, 2));
        fv_number_cell(page->out, fv_shown_percent(ms / page->period_ms));
        fv_writer_print(page->out, "</tr>\n");
    }
    fv_table_close(page->out);
}

void fv_report_histogram(struct fv_report_page *page)
{
    struct histogram h = {.low = 0};
    int64_t most = 1;
    char limit[64];
    static const char heading[] = "How frame times are spread";
    if (isnan(fv_column_summary(page->session, &fv_columns[FV_COLUMN_FRAME_MS]).min)) {
        fv_section_open(page->out, heading, "No frame was timed.");
        fv_section_close(page->out);
        return;
    }
    fill_histogram(&h, page);
    fv_section_open(page->out, heading, h.cut ? "The last bar holds every longer frame, too." : NULL);
    for (int i = 0; i < h.bins; i++) most = h.count[i] > most ? h.count[i] : most;
    double x_high = fmax(h.low + h.bins * h.width, isnan(page->period_ms) ? 0 : page->period_ms * 1.05);
    struct fv_plot plot = {
        .out = page->out, .x = {h.low, x_high, false}, .y = {0, fmax(1.12 * (double)most, 5), false}};
    fv_plot_open(&plot, &(struct fv_plot_text){.caption = "Frames",
                                               .label = "Histogram of frame times",
                                               .x_name = "frame time (ms)",
                                               .height_px = 220});
    for (int late = 0; late < 2; late++) {
        fv_path_open(&plot, late ? "late" : "bars");
        for (int i = 0; i < h.bins; i++) {
            double from = h.low + i * h.width;
            if (h.count[i] == 0 || (from + h.width / 2 > page->period_ms) != late) continue;
            fv_path_box(&plot, from + 0.08 * h.width, from + 0.92 * h.width, 0, (double)h.count[i]);
        }
        fv_path_close(&plot);
    }
    snprintf(limit, sizeof limit, "budget %.2f ms", page->period_ms);
    if (!isnan(page->period_ms)) fv_plot_upright(&plot, page->period_ms, limit);
    fv_plot_close(&plot);
    write_percentiles(page);
    fv_section_close(page->out);
}
