/* progress: a session in lines of text; see progress.h. The table's numbers: profile.h. */
#include "cli/progress.h"

#include "cli/columns.h"
#include "cli/profile.h"
#include "platform/log.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

void fv_progress_line(const struct fv_session *s, const struct fv_frame_record *r, int64_t frames)
{
    char of[32] = "";
    if (frames > 0) snprintf(of, sizeof of, "/%lld", (long long)frames);
    fv_log_progress(
        "frame %lld%s  %.1f of %.1f ms  level %d  r0 %.1f  p_min %.3f  %.1f %% sampled  cut %lld  "
        "missed %lld",
        (long long)s->frames, of, (double)r->frame_ms, r->budget_ms > 0 ? (double)r->budget_ms : s->period_ms,
        r->level, (double)r->r0_deg, (double)r->p_min, 100.0 * (double)r->sampled_fraction,
        (long long)s->cut_frames, (long long)s->missed);
}

/* A right-aligned number, a dash where there is none. */
struct cell {
    char text[24];
};
static struct cell cell(double value, int decimals)
{
    struct cell out = {"-"};
    if (isfinite(value)) snprintf(out.text, sizeof out.text, "%.*f", decimals, value);
    return out;
}

static void print_stages(const struct fv_session *s)
{
    struct fv_stage_row rows[FV_STAGE_ROWS_MAX];
    int count = fv_stage_rows(s, rows), width = 11;
    for (int i = 0; i < count; i++) width = (int)fmax(width, (double)strlen(rows[i].name));
    if (width > 32) width = 32;
    fv_log_line("%-*s %8s %9s %9s %9s %8s %7s", width, "stage", "rate Hz", "p50 ms", "p99 ms", "max ms",
                "share %", "late");
    for (int i = 0; i < count; i++) {
        const struct fv_stage_row *r = &rows[i];
        fv_log_line("%-*.*s %8s %9s %9s %9s %8s %7s", width, width, r->name, cell(r->rate_hz, 1).text,
                    cell(r->p50_ms, 3).text, cell(r->p99_ms, 3).text, cell(r->max_ms, 3).text,
                    cell(100 * r->share, 1).text, cell(r->late < 0 ? (double)NAN : (double)r->late, 0).text);
    }
}

/* Where more than one frame of a hundred was late: which setting would help. */
static void print_hint(const struct fv_session *s, const struct fv_config *c, const struct fv_hints *hints,
                       double p99_ms)
{
    char rate[80] = "";
    double hz = floor(1000 / p99_ms);
    if (100 * s->missed <= s->frames || hints->replayed) return;
    if (hz >= 1 && hz < c->budget_hz)
        snprintf(rate, sizeof rate, "; as it is, 99 %% of the frames would hold budget.hz=%.0f", hz);
    bool adapted = strcmp(c->budget_adapt, "on") == 0;
    if (!hints->adapts)
        fv_log("late frames: --set method.name=reproject --set budget.adapt=on fits the work to the budget%s",
               rate);
    else if (!adapted)
        fv_log("late frames: --set budget.adapt=on fits radius and density to the budget%s", rate);
    else if (2 * s->missed > s->frames) fv_log("late frames: the smallest level is too dear, too%s", rate);
}

void fv_progress_close(const struct fv_session *s, const struct fv_config *config,
                       const struct fv_hints *hints, const char *out)
{
    const struct fv_column *frame_ms = &fv_columns[FV_COLUMN_FRAME_MS];
    double p50 = fv_column_percentile(s, frame_ms, 0, fv_recorded(s), 50);
    double p99 = fv_column_percentile(s, frame_ms, 0, fv_recorded(s), 99);
    print_stages(s);
    fv_log("%lld frames of %s with %s: p50 %.1f ms, p99 %.1f ms, %.1f ms allowed, %lld missed, %lld cut; "
           "report in "
           "%s/report.html",
           (long long)s->frames, s->scene, s->method, p50, p99, s->period_ms, (long long)s->missed,
           (long long)s->cut_frames, out);
    if (s->frames > s->capacity)
        fv_log("times in the reports and the plots are of the first %lld frames", (long long)s->capacity);
    print_hint(s, config, hints, p99);
}
