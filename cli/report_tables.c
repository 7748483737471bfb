/* report_tables: the parts of report.html that are tables. */
#include "cli/markup.h"
#include "cli/page.h"
#include "cli/profile.h"
#include "cli/report_sections.h"
#include "platform/arena.h"

#include <math.h>
#include <stdio.h>

void fv_report_stages(struct fv_report_page *page)
{
    static const char head[] = "<th scope=\"col\">stage</th><th scope=\"col\" class=\"n\">rate</th>"
                               "<th scope=\"col\" class=\"n\">p50</th><th scope=\"col\" class=\"n\">p99</th>"
                               "<th scope=\"col\" class=\"n\">max</th><th scope=\"col\" class=\"n\">late</th>"
                               "<th scope=\"col\" class=\"n\">share</th><td class=\"bar\"></td>";
    struct fv_stage_row rows[FV_STAGE_ROWS_MAX];
    int count = fv_stage_rows(page->session, rows);
    fv_section_open(
        page->out, "Stages",
        "Wall time of each stage in ms, how often a second it ran, in how many frames it ended after "
        "the deadline, and its share of the mean frame time.");
    fv_table_open(page->out, "stages", head);
    for (int i = 0; i < count; i++) {
        const struct fv_stage_row *r = &rows[i];
        fv_writer_print(page->out, "<tr class=\"%s\">", r->late < 0 ? "out" : r->late > 0 ? "bad" : "");
        fv_name_cell(page->out, r->name);
        fv_number_cell(page->out, fv_shown_fixed(r->rate_hz, 1));
        fv_number_cell(page->out, fv_shown_fixed(r->p50_ms, 2));
        fv_number_cell(page->out, fv_shown_fixed(r->p99_ms, 2));
        fv_number_cell(page->out, fv_shown_fixed(r->max_ms, 2));
        fv_writer_print(page->out, "<td class=\"n\"><%s>%s</%s></td>", r->late > 0 ? "b" : "span",
                        fv_shown_fixed(r->late < 0 ? (double)NAN : (double)r->late, 0).text,
                        r->late > 0 ? "b" : "span");
        fv_number_cell(page->out, fv_shown_percent(r->share));
        fv_bar_cell(page->out, r->share);
        fv_writer_print(page->out, "</tr>\n");
    }
    fv_table_close(page->out);
    if (fv_idle_share(page->session) > 0)
        fv_writer_print(page->out,
                        "<p class=\"note\">idle: workers waiting for each other, a worker's mean. The "
                        "stages' times hold it, too.</p>\n");
    fv_section_close(page->out);
}

void fv_report_plan(struct fv_report_page *page)
{
    const struct fv_session *s = page->session;
    int most = sizeof s->plan / sizeof s->plan[0], rows = s->plan_rows < most ? s->plan_rows : most;
    if (rows < 1) return;
    fv_section_open(page->out, "Plan",
                    "What this scene and method need, and what was left out, with the memory that saved.");
    fv_table_open(page->out, "plan",
                  "<th scope=\"col\">what</th><th scope=\"col\">kind</th><th scope=\"col\">plan</th>"
                  "<th scope=\"col\">reason</th><th scope=\"col\" class=\"n\">memory</th>");
    for (int left_out = 0; left_out < 2; left_out++) {
        for (int i = 0; i < rows; i++) {
            const struct fv_plan_row *row = &s->plan[i];
            if (row->kept == left_out) continue;
            fv_writer_print(page->out, "<tr class=\"%s\">", row->kept ? "kept" : "out");
            fv_name_cell(page->out, row->what);
            fv_writer_print(page->out, "<td>");
            fv_html_text(page->out, row->kind);
            fv_writer_print(page->out, "</td><td class=\"tag\">%s</td><td>", row->kept ? "kept" : "left out");
            fv_html_text(page->out, row->reason);
            fv_writer_print(page->out, "</td>");
            fv_number_cell(page->out,
                           row->bytes ? fv_shown_bytes((double)row->bytes) : (struct fv_shown){""});
            fv_writer_print(page->out, "</tr>\n");
        }
    }
    fv_table_close(page->out);
    fv_section_close(page->out);
}

void fv_report_memory(struct fv_report_page *page)
{
    const struct fv_arena *arena = fv_arena();
    unsigned char order[FV_ARENA_NAMES_MAX];
    for (int i = 0; i < arena->rows; i++) { /* by insertion, largest first */
        int k = i;
        for (; k > 0 && arena->row[order[k - 1]].bytes < arena->row[i].bytes; k--) order[k] = order[k - 1];
        order[k] = (unsigned char)i;
    }
    fv_section_open(page->out, "Memory", NULL);
    fv_writer_print(page->out,
                    "<p class=\"note\">%s of the %s that the program may use, taken at start-up.</p>\n",
                    fv_shown_bytes((double)arena->used).text, fv_shown_bytes((double)arena->capacity).text);
    fv_table_open(page->out, "memory",
                  "<th scope=\"col\">name</th><th scope=\"col\" class=\"n\">taken</th><th scope=\"col\" "
                  "class=\"n\">share</th>"
                  "<td class=\"bar\"></td>");
    for (int i = 0; i < arena->rows; i++) {
        const struct fv_arena_row *row = &arena->row[order[i]];
        double share = arena->used ? (double)row->bytes / (double)arena->used : 0;
        fv_writer_print(page->out, "<tr>");
        fv_name_cell(page->out, row->name);
        fv_number_cell(page->out, fv_shown_bytes((double)row->bytes));
        fv_number_cell(page->out, fv_shown_percent(share));
        fv_bar_cell(page->out, share);
        fv_writer_print(page->out, "</tr>\n");
    }
    fv_table_close(page->out);
    fv_section_close(page->out);
}

/* A row of counters: `bad` marks what ought not to be. */
struct counter {
    const char *what;
    int64_t count;
    bool bad;
};

static void add_counters(struct fv_writer *out, const struct counter *row, size_t rows)
{
    for (size_t i = 0; i < rows; i++) {
        const char *tag = row[i].bad && row[i].count ? "b" : "span";
        fv_writer_print(out, "<tr class=\"%s\"><th scope=\"row\">%s</th><td class=\"n\"><%s>%lld</%s></td></tr>\n",
                        tag[0] == 'b' ? "bad" : "", row[i].what, tag, (long long)row[i].count, tag);
    }
}

/* A row that is no count: text, or a number with its unit. */
static void add_fact(struct fv_writer *out, const char *what, const char *text, const char *unit)
{
    fv_writer_print(out, "<tr><th scope=\"row\">%s</th><td class=\"n\">", what);
    fv_html_text(out, text);
    fv_writer_print(out, "%s</td></tr>\n", unit);
}

static void add_display(struct fv_writer *out, const struct fv_session_display *d)
{
    const struct counter rows[] = {{"pictures shown", d->flips, false},
                                   {"refreshes that showed the older picture again", d->skipped, false},
                                   {"pictures never shown", d->dropped, true},
                                   {"flips refused as the last was not over", d->busy, false},
                                   {"display events that cannot be", d->odd, true},
                                   {"times the display was lost", d->lost, true},
                                   {"times it came back", d->back, false}};
    if (!d->mode[0]) return;
    add_fact(out, "display", d->mode, d->atomic ? "; atomic" : "; legacy");
    if (d->measured_hz > 0) add_fact(out, "its refresh, measured", fv_shown_fixed(d->measured_hz, 2).text, " Hz");
    else add_fact(out, "its refresh", d->vblank ? "not measured" : "no vertical blank: paced by the clock", "");
    add_counters(out, rows, sizeof rows / sizeof rows[0]);
    add_fact(out, "bytes of pictures copied to it", fv_shown_bytes((double)d->bytes).text, "");
    add_fact(out, "copy of a picture, mean", fv_shown_fixed(d->copy_ms_mean, 2).text, " ms");
    add_fact(out, "copy of a picture, longest", fv_shown_fixed(d->copy_ms_most, 2).text, " ms");
}

static void add_lines(struct fv_writer *out, const struct fv_session_gpio *g)
{
    const struct counter rows[] = {{"GPIO lines used", g->lines, false},
                                   {"vertical syncs on their line", g->vsyncs, false},
                                   {"vertical syncs out of time", g->odd, true},
                                   {"changes of the strobe", g->strobes, false},
                                   {"presses of the button", g->presses, false},
                                   {"GPIO calls that failed", g->errors, true}};
    if (g->lines < 1) return;
    add_counters(out, rows, sizeof rows / sizeof rows[0]);
    if (g->vsync_hz > 0) add_fact(out, "vertical syncs a second", fv_shown_fixed(g->vsync_hz, 2).text, " Hz");
}

/* Cameras of the eyes, where they are the source. */
static void add_cameras(struct fv_writer *out, const struct fv_session *s)
{
    const struct counter rows[] = {{"frames of the eye cameras", s->camera_frames, false},
                                   {"frames that they lost or spoiled", s->camera_gaps + s->camera_rejected, true},
                                   {"times a camera was lost", s->camera_lost, true},
                                   {"times it came back", s->camera_restarts, false},
                                   {"frames without a pupil", s->eye_no_pupil, false},
                                   {"frames with a doubtful one", s->eye_unsure, false},
                                   {"times the eyes were lost to sight", s->eye_blinks, false}};
    if (s->cameras > 0) add_counters(out, rows, sizeof rows / sizeof rows[0]);
}

void fv_report_sealed(struct fv_report_page *page)
{
    const struct fv_session *s = page->session;
    const struct counter rows[] = {{"heap calls after start-up", s->heap_calls, true},
                                   {"memory system calls after start-up", s->memory_syscalls, true},
                                   {"gaze samples", s->gaze_samples, false},
                                   {"gaze samples lost", s->gaze_lost, false},
                                   {"head samples", s->imu_samples, false},
                                   {"head samples rejected", s->imu_rejected, true},
                                   {"head samples lost by the device", s->imu_lost, true},
                                   {"times the device came again", s->imu_reconnects, true},
                                   {"its readings that cannot be", s->imu_bad + s->imu_stuck + s->imu_mistimed, true},
                                   {"its readings at full scale", s->imu_saturated, true},
                                   {"rows that were not recorded", s->tape_dropped, true},
                                   {"recordings that are not whole", s->tape_cut, true},
                                   {"pictures that could not be written", s->pictures_failed, true}};
    fv_section_open(page->out, "Counters", NULL);
    fv_table_open(page->out, "counters",
                  "<th scope=\"col\">of the session</th><th scope=\"col\" class=\"n\">count</th>");
    add_counters(page->out, rows, sizeof rows / sizeof rows[0]);
    add_fact(page->out, "gaze latency, median", fv_shown_fixed(s->gaze_latency_ms_p50, 2).text, " ms");
    add_cameras(page->out, s);
    add_display(page->out, &s->display);
    add_lines(page->out, &s->gpio);
    fv_table_close(page->out);
    fv_section_close(page->out);
}

void fv_report_settings(struct fv_report_page *page)
{
    enum { LONGEST = FV_LIST_MAX * 26 };
    static char text[LONGEST];
    fv_writer_print(page->out, "<section>\n<details><summary>All settings</summary>\n");
    fv_table_open(page->out, "settings",
                  "<th scope=\"col\">key</th><th scope=\"col\">value</th><th scope=\"col\">set by</th>");
    for (int i = 0; i < fv_keys_count; i++) {
        const struct fv_key *k = &fv_keys[i];
        char dotted[96];
        int n = snprintf(dotted, sizeof dotted, "%s.%s", k->section, k->name);
        if (n >= (int)sizeof dotted) continue;
        fv_writer_print(page->out, "<tr>");
        fv_name_cell(page->out, dotted);
        fv_writer_print(page->out, "<td>");
        fv_html_text(page->out, fv_config_text(page->config, k, text, sizeof text));
        if (k->kind == FV_KEY_INT || k->kind == FV_KEY_REAL) fv_writer_print(page->out, " %s", k->unit);
        fv_writer_print(page->out, "</td><td>");
        fv_html_text(page->out, fv_config_origin(dotted));
        fv_writer_print(page->out, "</td></tr>\n");
    }
    fv_table_close(page->out);
    fv_writer_print(page->out, "</details>\n</section>\n");
}
