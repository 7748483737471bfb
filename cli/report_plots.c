/* report_plots: frame time, what the controller did, and how frame times are spread. */
#include "cli/columns.h"
#include "cli/markup.h"
#include "cli/page.h"
#include "cli/plot.h"
#include "cli/report_sections.h"

#include <math.h>
#include <stdio.h>

static struct fv_series series;

static void draw_series(struct fv_plot *plot)
{
    if (series.binned) {
        fv_path_open(plot, "band");
        for (int i = 0; i < series.count; i++) {
            double from = i ? (series.t_s[i - 1] + series.t_s[i]) / 2 : plot->x.low;
            double to = i + 1 < series.count ? (series.t_s[i] + series.t_s[i + 1]) / 2 : plot->x.high;
            fv_path_box(plot, from, to, series.min[i], series.max[i]);
        }
        fv_path_close(plot);
    }
    fv_path_open(plot, "line");
    for (int i = 0; i < series.count; i++) fv_path_point(plot, series.t_s[i], series.y[i]);
    if (series.count == 1) fv_path_point(plot, plot->x.high, series.y[0]);
    fv_path_close(plot);
}

/* A short stroke at the top for each missed frame; those that would touch are drawn once. */
static void draw_missed(struct fv_plot *plot, const struct fv_session *s)
{
    enum { PLACES = 800 };
    int drawn = -1;
    double tall = 0.05 * (plot->y.high - plot->y.low);
    fv_path_open(plot, "marks");
    for (int64_t i = 0; i < fv_recorded(s); i++) {
        double t = fv_record_seconds(s, i);
        int place = (int)(PLACES * t / plot->x.high);
        if (!s->record[i].missed || place == drawn) continue;
        drawn = place;
        fv_path_point(plot, t, plot->y.high);
        fv_path_point(plot, t, plot->y.high - tall);
        fv_path_point(plot, (double)NAN, 0);
    }
    fv_path_close(plot);
}

static void draw_frame_times(struct fv_report_page *page, double t_high)
{
    const struct fv_session *s = page->session;
    char label[240], limit[64];
    struct fv_summary range = fv_column_summary(s, &fv_columns[FV_COLUMN_FRAME_MS]);
    int n = snprintf(label, sizeof label, "Frame time over time, from %s to %s ms",
                     fv_shown_fixed(range.min, 2).text, fv_shown_fixed(range.max, 2).text);
    struct fv_plot plot = {.out = page->out, .x = {0, t_high, false}, .y = {0, page->frame_top_ms, false}};
    if (!isnan(page->period_ms))
        snprintf(label + n, sizeof label - (size_t)n, "; the budget is %.2f ms", page->period_ms);
    fv_plot_open(&plot,
                 &(struct fv_plot_text){.caption = "Frame time (ms)", .label = label, .height_px = 240});
    fv_column_series(s, &fv_columns[FV_COLUMN_FRAME_MS], &series);
    draw_series(&plot);
    draw_missed(&plot, s);
    snprintf(limit, sizeof limit, "budget %.2f ms", page->period_ms);
    if (!isnan(page->period_ms)) fv_plot_across(&plot, page->period_ms, limit);
    fv_plot_close(&plot);
}

void fv_report_time(struct fv_report_page *page)
{
    static const struct {
        int column;
        const char *caption, *name;
    } rows[] = {{FV_COLUMN_LEVEL, "Quality level", "Quality level"},
                {FV_COLUMN_R0, "Foveal radius r0 (degrees)", "Foveal radius r0"},
                {FV_COLUMN_P_MIN, "Peripheral sampling probability p_min", "Sampling probability p_min"}};
    enum { ROWS = sizeof rows / sizeof rows[0] };
    const struct fv_session *s = page->session;
    int64_t n = fv_recorded(s);
    double t_high = n > 1 ? fv_record_seconds(s, n - 1) : 1;
    double top = fv_column_summary(s, &fv_columns[FV_COLUMN_FRAME_MS]).max;
    char note[320];
    int used = snprintf(note, sizeof note, "From latching pose and gaze to the picture being ready.");
    if (n > FV_POINTS_MAX)
        used += snprintf(note + used, sizeof note - (size_t)used,
                         " The line is the median of %lld neighbouring frames, the band their range.",
                         (long long)(n / FV_BINS));
    if (s->missed)
        used +=
            snprintf(note + used, sizeof note - (size_t)used, " Red strokes at the top are missed frames.");
    if (top > page->frame_top_ms)
        snprintf(note + used, sizeof note - (size_t)used,
                 " The plot is cut at %.1f ms, the longest frame took %.1f ms.", page->frame_top_ms, top);
    fv_section_open(page->out, "Over time", note);
    draw_frame_times(page, t_high);
    for (int i = 0; i < ROWS; i++) {
        char label[160];
        struct fv_summary range = fv_column_summary(s, &fv_columns[rows[i].column]);
        snprintf(label, sizeof label, "%s over time, from %s to %s", rows[i].name,
                 fv_shown_fixed(range.min, 2).text, fv_shown_fixed(range.max, 2).text);
        struct fv_plot plot = {
            .out = page->out,
            .x = {0, t_high, false},
            .y = {fmin(range.min, 0), range.max > 0 ? fmax(range.max * 1.15, 1e-6) : 1, false}};
        fv_plot_open(&plot, &(struct fv_plot_text){.caption = rows[i].caption,
                                                   .label = label,
                                                   .x_name = i + 1 == ROWS ? "time (s)" : NULL,
                                                   .height_px = 72});
        fv_column_series(s, &fv_columns[rows[i].column], &series);
        draw_series(&plot);
        fv_plot_close(&plot);
    }
    fv_section_close(page->out);
}

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
    fv_section_close(page->out);
}
