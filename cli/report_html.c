/* report_html: report.html, the session as a page for people: the headline, the last picture, and
 * the order of the other sections (report_time.c, report_histogram.c,
 * report_rings.c, report_tables.c). */
#include "cli/columns.h"
#include "cli/markup.h"
#include "cli/page.h"
#include "cli/report_sections.h"

#include <math.h>
#include <stdio.h>

#ifndef FV_VERSION
#define FV_VERSION "unknown"
#endif

enum { PICTURE_LEVEL = 6 };

static void write_verdict(struct fv_report_page *page, double p99)
{
    const struct fv_session *s = page->session;
    if (s->frames < 1) {
        fv_writer_print(page->out, "<p class=\"verdict\">No frame was run.</p>\n");
        return;
    }
    if (s->missed == 0)
        fv_writer_print(page->out, "<p class=\"verdict good\"><b>None of %lld frames was late.</b> ",
                        (long long)s->frames);
    else
        fv_writer_print(page->out, "<p class=\"verdict bad\"><b>%lld of %lld frames were late.</b> ",
                        (long long)s->missed, (long long)s->frames);
    fv_writer_print(page->out, "99 %% of them took at most %s ms; the display wants one every %s ms.</p>\n",
                    fv_shown_fixed(p99, 2).text, fv_shown_fixed(page->period_ms, 2).text);
}

static void write_title(struct fv_report_page *page, double p99)
{
    const struct fv_session *s = page->session;
    const struct fv_config *c = page->config;
    fv_writer_print(page->out, "<header>\n<h1>");
    fv_html_text(page->out, s->scene);
    fv_writer_print(page->out, ", ");
    fv_html_text(page->out, s->method);
    fv_writer_print(page->out, "</h1>\n<p class=\"soft\">");
    fv_html_text(page->out, c->display_headset);
    fv_writer_print(page->out, ", %lld × %lld px %s at %.4g Hz · ", (long long)c->display_width,
                    (long long)c->display_height, c->display_eyes == 2 ? "an eye" : "(left eye only)",
                    c->budget_hz);
    fv_html_text(page->out, s->cpu);
    fv_writer_print(page->out, ", ");
    fv_html_text(page->out, s->isa);
    fv_writer_print(page->out, ", %d thread%s · %s triangles", s->threads, s->threads == 1 ? "" : "s",
                    fv_shown_count((double)s->triangles).text);
    if (s->fields) fv_writer_print(page->out, ", %lld fields", (long long)s->fields);
    fv_writer_print(page->out, "</p>\n");
    write_verdict(page, p99);
    fv_writer_print(page->out, "</header>\n");
}

static void write_facts(struct fv_report_page *page, double p50, double p99)
{
    const struct fv_session *s = page->session;
    char more[160];
    double rays[FV_RAY_KINDS], sum = 0;
    for (int i = 0; i < FV_RAY_KINDS; i++) {
        rays[i] = fv_column_summary(s, &fv_columns[FV_COLUMN_PRIMARY + i]).mean;
        if (i < FV_RAY_MARCH_STEPS) sum += rays[i];
    }
    fv_writer_print(page->out, "<dl class=\"facts\">\n");
    snprintf(more, sizeof more, "%s of the period", fv_shown_percent(p50 / page->period_ms).text);
    fv_fact(page->out, "Frame time, median", fv_shown_fixed(p50, 2), " ms", more);
    snprintf(more, sizeof more, "%s of the period", fv_shown_percent(p99 / page->period_ms).text);
    fv_fact(page->out, "Frame time, p99", fv_shown_fixed(p99, 2), " ms", more);
    snprintf(more, sizeof more, "%lld cut short at the deadline", (long long)s->cut_frames);
    fv_fact(page->out, "Frames", fv_shown_fixed((double)s->frames, 0), "", more);
    int used = snprintf(more, sizeof more, "%lld of %lld", (long long)s->missed, (long long)s->frames);
    if (s->skipped)
        snprintf(more + used, sizeof more - (size_t)used, "; %lld period%s without a new frame",
                 (long long)s->skipped, s->skipped == 1 ? "" : "s");
    fv_fact(page->out, "Missed",
            fv_shown_percent(s->frames > 0 ? (double)s->missed / (double)s->frames : (double)NAN), "", more);
    fv_fact(page->out, "Pixels sampled",
            fv_shown_percent(fv_column_summary(s, &fv_columns[FV_COLUMN_SAMPLED]).mean), "",
            "mean of all frames");
    int n = snprintf(more, sizeof more, "%s primary, %s shadow, %s secondary",
                     fv_shown_count(rays[FV_RAY_PRIMARY]).text, fv_shown_count(rays[FV_RAY_SHADOW]).text,
                     fv_shown_count(rays[FV_RAY_SECONDARY]).text);
    if (rays[FV_RAY_MARCH_STEPS] > 0)
        snprintf(more + n, sizeof more - (size_t)n, "; %s march steps",
                 fv_shown_count(rays[FV_RAY_MARCH_STEPS]).text);
    fv_fact(page->out, "Rays a frame", fv_shown_count(sum), "", more);
    fv_writer_print(page->out, "</dl>\n");
    if (fv_recorded(s) < s->frames)
        fv_writer_print(
            page->out,
            "<p class=\"note\">Times and rays are those of the first %lld frames; totals are of all "
            "%lld.</p>\n",
            (long long)fv_recorded(s), (long long)s->frames);
}

static void write_headline(struct fv_report_page *page)
{
    int64_t n = fv_recorded(page->session);
    const struct fv_column *column = &fv_columns[FV_COLUMN_FRAME_MS];
    double p50 = fv_column_percentile(page->session, column, 0, n, 50);
    double p99 = fv_column_percentile(page->session, column, 0, n, 99);
    write_title(page, p99);
    write_facts(page, p50, p99);
}

static void write_picture(struct fv_report_page *page)
{
    static const char *const names[2] = {"left", "right"};
    if (!page->picture || !page->png) return;
    fv_section_open(page->out, "Last frame", NULL);
    fv_writer_print(page->out, "<div class=\"eyes\">\n");
    for (int eye = 0; eye < page->picture->eyes && !page->failed; eye++) {
        fv_writer_print(
            page->out,
            "<figure><img width=\"%d\" height=\"%d\" alt=\"Last frame, %s eye\" src=\"data:image/png;base64,",
            page->picture->width, page->picture->height, names[eye]);
        page->failed = fv_png_base64(page->png, page->out, page->picture, eye, PICTURE_LEVEL, page->error);
        fv_writer_print(page->out, "\"><figcaption>%s eye</figcaption></figure>\n", names[eye]);
    }
    fv_writer_print(page->out, "</div>\n");
    fv_section_close(page->out);
}

static void open_pair(struct fv_report_page *page)
{
    fv_writer_print(page->out, "<div class=\"pair\">\n");
}

static void close_pair(struct fv_report_page *page)
{
    fv_writer_print(page->out, "</div>\n");
}

static void write_footer(struct fv_report_page *page)
{
    fv_writer_print(page->out,
                    "<footer>Foveola %s. The same numbers: report.json; each frame: frames.csv.</footer>\n",
                    FV_VERSION);
}

static void (*const sections[])(struct fv_report_page *page) = {
    write_headline,      write_picture,          fv_report_time,   fv_report_stages, open_pair,
    fv_report_histogram, fv_report_eccentricity, close_pair,       fv_report_cuts,   fv_report_plan,
    open_pair,           fv_report_memory,       fv_report_sealed, close_pair,       fv_report_settings,
    write_footer,
};

/* Where plots of the frame time end: a few wild frames must not flatten all others. */
static double frame_top_ms(const struct fv_session *s, double period_ms)
{
    const struct fv_column *column = &fv_columns[FV_COLUMN_FRAME_MS];
    double p99 = fv_column_percentile(s, column, 0, fv_recorded(s), 99);
    double top = fmin(fv_column_summary(s, column).max * 1.05, fmax(2 * period_ms, 1.3 * p99));
    top = fmax(top, 1.15 * period_ms);
    return fmax(top, 1e-3);
}

int fv_report_html(const struct fv_session *session, const struct fv_config *config,
                   const struct fv_picture *picture, struct fv_png *png, const char *path,
                   struct fv_error *error)
{
    static struct fv_writer out;
    struct fv_report_page page = {&out, session, config, picture, png, .error = error};
    struct fv_error closing;
    char title[160];
    page.period_ms =
        isfinite(session->period_ms) && session->period_ms > 0 ? session->period_ms : (double)NAN;
    page.frame_top_ms = frame_top_ms(session, page.period_ms);
    if (fv_writer_open(&out, path, error)) return -1;
    snprintf(title, sizeof title, "Foveola: %s, %s", session->scene ? session->scene : "",
             session->method ? session->method : "");
    fv_page_open(&out, title);
    for (size_t i = 0; i < sizeof sections / sizeof sections[0]; i++) sections[i](&page);
    fv_page_close(&out);
    if (fv_writer_close(&out, &closing) == 0) return page.failed;
    *error = closing; /* a disk that is full fails the picture, too: this says why */
    return -1;
}
