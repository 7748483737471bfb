/* report_time: frame time against the budget, and right below it on the same time axis what was done to
 * hold it: cut tiles, level, radius and density. What stayed the same all the while is one sentence. */
#include "cli/columns.h"
#include "cli/markup.h"
#include "cli/page.h"
#include "cli/plot.h"
#include "cli/report_sections.h"

#include <math.h>
#include <stdio.h>

static struct fv_series series;

/* The range of each bin of neighbours. */
static void draw_ranges(struct fv_plot *plot, double scale)
{
    if (!series.binned) return;
    fv_path_open(plot, "band");
    for (int i = 0; i < series.count; i++) {
        double from = i ? (series.t_s[i - 1] + series.t_s[i]) / 2 : plot->x.low;
        double to = i + 1 < series.count ? (series.t_s[i] + series.t_s[i + 1]) / 2 : plot->x.high;
        fv_path_box(plot, from, to, scale * series.min[i], scale * series.max[i]);
    }
    fv_path_close(plot);
}

static void draw_line(struct fv_plot *plot, double scale)
{
    draw_ranges(plot, scale);
    fv_path_open(plot, "line");
    for (int i = 0; i < series.count; i++) fv_path_point(plot, series.t_s[i], scale * series.y[i]);
    if (series.count == 1) fv_path_point(plot, plot->x.high, scale * series.y[0]);
    fv_path_close(plot);
}

/* The point behind the last one of the same value as point i, and the time at which it begins. */
static int run_end(const struct fv_plot *plot, int i, double *t_s)
{
    int end = i + 1;
    while (end < series.count &&
           (series.y[end] == series.y[i] || (isnan(series.y[end]) && isnan(series.y[i]))))
        end++;
    *t_s = end < series.count ? series.t_s[end] : plot->x.high;
    return end;
}

static void draw_step_line(struct fv_plot *plot, double scale, const char *class)
{
    double to;
    fv_path_open(plot, class);
    for (int i = 0, end; i < series.count; i = end) {
        end = run_end(plot, i, &to);
        fv_path_point(plot, series.t_s[i], scale * series.y[i]);
        fv_path_point(plot, isnan(series.y[i]) ? (double)NAN : to, scale * series.y[i]);
    }
    fv_path_close(plot);
}

/* A value that holds until the next one, and the area below it. */
static void draw_steps(struct fv_plot *plot, double scale)
{
    double to;
    fv_path_open(plot, "area");
    for (int i = 0, end; i < series.count; i = end) {
        end = run_end(plot, i, &to);
        fv_path_box(plot, series.t_s[i], to, plot->y.low, scale * series.y[i]);
    }
    fv_path_close(plot);
    draw_ranges(plot, scale);
    draw_step_line(plot, scale, "line");
}

/* The largest of each bin. */
static void draw_bars(struct fv_plot *plot, double scale)
{
    fv_path_open(plot, "cuts");
    for (int i = 0; i < series.count; i++) {
        double to = i + 1 < series.count ? series.t_s[i + 1] : plot->x.high;
        if (series.max[i] > 0) fv_path_box(plot, series.t_s[i], to, 0, scale * series.max[i]);
    }
    fv_path_close(plot);
}

/* What is shown below the frame time. */
struct panel {
    enum fv_column_name column;
    const char *caption, *name, *unit;
    double scale;
    int decimals, height_px;
    void (*draw)(struct fv_plot *plot, double scale);
};
static const struct panel panels[] = {
    {FV_COLUMN_CUT_TILES, "Tiles cut at the deadline", "cut tiles", "", 1, 0, 56, draw_bars},
    {FV_COLUMN_LEVEL, "Quality level: sharper is up", "quality level", "", 1, 0, 124, draw_steps},
    {FV_COLUMN_PERIODS, "Display periods a frame", "display periods a frame", "", 1, 0, 56, draw_steps},
    {FV_COLUMN_R0, "Foveal radius r0 (degrees)", "r0", "°", 1, 1, 72, draw_steps},
    {FV_COLUMN_P_MIN, "Peripheral sampling probability p_min", "p_min", "", 1, 3, 72, draw_steps},
    {FV_COLUMN_SAMPLED, "Pixels sampled (%)", "pixels sampled", " %", 100, 1, 72, draw_line},
};
enum { PANELS = sizeof panels / sizeof panels[0] };

static struct fv_axis axis_of(const struct panel *p, const struct fv_session *s, struct fv_summary range)
{
    struct fv_axis axis = {fmin(range.min * p->scale, 0), fmax(range.max * p->scale * 1.15, 1e-6), false};
    if (p->column == FV_COLUMN_PERIODS) axis = (struct fv_axis){0, fmax(range.max + 0.5, 2.5), false};
    if (p->column != FV_COLUMN_LEVEL) return axis;
    double worst = fmax(range.max, s->levels), best = fmin(range.min, worst - 2);
    return (struct fv_axis){worst + 0.5, fmin(best, s->levels > 0 ? 1 : best) - 0.5, false};
}

static void draw_panel(struct fv_report_page *page, const struct panel *p, double t_high, bool last)
{
    const struct fv_session *s = page->session;
    char label[160];
    struct fv_summary range = fv_column_summary(s, &fv_columns[p->column]);
    snprintf(label, sizeof label, "Over time: %s, from %s to %s%s", p->name,
             fv_shown_fixed(range.min * p->scale, p->decimals).text,
             fv_shown_fixed(range.max * p->scale, p->decimals).text, p->unit);
    struct fv_plot plot = {.out = page->out, .x = {0, t_high, false}, .y = axis_of(p, s, range)};
    fv_plot_open(&plot, &(struct fv_plot_text){.caption = p->caption,
                                               .label = label,
                                               .x_name = last ? "time (s)" : NULL,
                                               .height_px = p->height_px});
    fv_column_series(s, &fv_columns[p->column], &series);
    p->draw(&plot, p->scale);
    fv_plot_close(&plot);
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

static void draw_frame_times(struct fv_report_page *page, double t_high, bool last)
{
    const struct fv_session *s = page->session;
    char label[240], limit[64];
    struct fv_summary range = fv_column_summary(s, &fv_columns[FV_COLUMN_FRAME_MS]);
    int n = snprintf(label, sizeof label, "Frame time over time, from %s to %s ms",
                     fv_shown_fixed(range.min, 2).text, fv_shown_fixed(range.max, 2).text);
    struct fv_plot plot = {.out = page->out, .x = {0, t_high, false}, .y = {0, page->frame_top_ms, false}};
    if (!isnan(page->period_ms))
        snprintf(label + n, sizeof label - (size_t)n, "; the budget is %.2f ms", page->period_ms);
    fv_plot_open(&plot, &(struct fv_plot_text){.caption = "Frame time (ms)",
                                               .label = label,
                                               .x_name = last ? "time (s)" : NULL,
                                               .height_px = 240});
    fv_column_series(s, &fv_columns[FV_COLUMN_FRAME_MS], &series);
    draw_line(&plot, 1);
    if (fv_column_summary(s, &fv_columns[FV_COLUMN_PERIODS]).max > 1) { /* what such a frame may take */
        fv_column_series(s, &fv_columns[FV_COLUMN_PERIODS], &series);
        draw_step_line(&plot, page->period_ms, "given");
    }
    draw_missed(&plot, s);
    snprintf(limit, sizeof limit, "budget %.2f ms", page->period_ms);
    if (!isnan(page->period_ms)) fv_plot_across(&plot, page->period_ms, limit);
    fv_plot_close(&plot);
}

/* How often the level changed, in a sentence that is empty where it did not. */
static void adaptation_text(const struct fv_session *s, char *text, size_t size)
{
    struct fv_summary range = fv_column_summary(s, &fv_columns[FV_COLUMN_LEVEL]);
    int64_t changes = 0, best = 0, n = fv_recorded(s);
    for (int64_t i = 0; i < n; i++) {
        best += s->record[i].level == range.min;
        changes += i > 0 && s->record[i].level != s->record[i - 1].level;
    }
    text[0] = 0;
    if (changes == 0) return;
    snprintf(text, size, " The quality level changed %lld time%s, between %.0f (%s of the frames) and %.0f.",
             (long long)changes, changes == 1 ? "" : "s", range.min,
             fv_shown_percent((double)best / (double)n).text, range.max);
}

static void open_section(struct fv_report_page *page)
{
    const struct fv_session *s = page->session;
    int64_t n = fv_recorded(s);
    double top = fv_column_summary(s, &fv_columns[FV_COLUMN_FRAME_MS]).max;
    char binned[128] = "", given[96] = "", late[64] = "", skipped[96] = "", above[112] = "", adapted[128],
         note[640];
    if (n > FV_POINTS_MAX)
        snprintf(binned, sizeof binned, " Lines are medians of %lld neighbouring frames, bands their ranges.",
                 (long long)(n / FV_BINS));
    if (s->missed) snprintf(late, sizeof late, " Red strokes at the top are missed frames.");
    if (fv_column_summary(s, &fv_columns[FV_COLUMN_PERIODS]).max > 1)
        snprintf(given, sizeof given, " The stepped line is the display periods that a frame was given.");
    if (s->skipped)
        snprintf(skipped, sizeof skipped, " No new frame was ready for %lld display period%s.",
                 (long long)s->skipped, s->skipped == 1 ? "" : "s");
    if (top > page->frame_top_ms)
        snprintf(above, sizeof above, " The plot is cut at %.1f ms, the longest frame took %s ms.",
                 page->frame_top_ms, fv_shown_fixed(top, 1).text);
    adaptation_text(s, adapted, sizeof adapted);
    snprintf(note, sizeof note, "From latching pose and gaze to the picture being ready.%s%s%s%s%s%s", late,
             given, skipped, binned, above, adapted);
    fv_section_open(page->out, "Over time", note);
}

/* What has no panel because it never changed. */
static void write_constants(struct fv_report_page *page, const bool *shown)
{
    const char *before = "<p class=\"note\">The same in every frame: ";
    for (int i = 0; i < PANELS; i++) {
        const struct panel *p = &panels[i];
        double value = fv_column_summary(page->session, &fv_columns[p->column]).min * p->scale;
        bool none = p->column == FV_COLUMN_CUT_TILES || (p->column == FV_COLUMN_PERIODS && value <= 1);
        if (shown[i] || none || isnan(value)) continue;
        fv_writer_print(page->out, "%s%s %s%s", before, p->name, fv_shown_fixed(value, p->decimals).text,
                        p->unit);
        before = ", ";
    }
    if (before[0] == ',') fv_writer_print(page->out, ".</p>\n");
}

void fv_report_time(struct fv_report_page *page)
{
    const struct fv_session *s = page->session;
    int64_t n = fv_recorded(s);
    double t_high = n > 1 ? fv_record_seconds(s, n - 1) : 1;
    bool shown[PANELS];
    int last = -1;
    for (int i = 0; i < PANELS; i++) {
        struct fv_summary range = fv_column_summary(s, &fv_columns[panels[i].column]);
        shown[i] = range.min < range.max || (panels[i].column == FV_COLUMN_CUT_TILES && range.max > 0);
        if (shown[i]) last = i;
    }
    open_section(page);
    draw_frame_times(page, t_high, last < 0);
    for (int i = 0; i < PANELS; i++)
        if (shown[i]) draw_panel(page, &panels[i], t_high, i == last);
    write_constants(page, shown);
    fv_section_close(page->out);
}
