/* measure_verdict: the head of measure's report: what was measured, and what came of it in two sentences
 * and four numbers, worked out from the rows. */
#include "cli/measure_sections.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* As good as: the fovea no more than this below plain rendering at one sample a pixel. */
static const double margin_db = 0.5;

/* Of each machine, display and reference that rows come from, once. */
static void write_abouts(struct fv_measure_page *page)
{
    const struct fv_measure_row *row = page->report->row;
    for (int i = 0; i < page->report->rows; i++) {
        bool said = false;
        for (int k = 0; k < i; k++) said |= strcmp(row[k].about, row[i].about) == 0;
        if (said) continue;
        if (i) fv_writer_print(page->out, "<br>");
        fv_html_text(page->out, row[i].about);
    }
}

void fv_measure_header(struct fv_measure_page *page, const char *title)
{
    const struct fv_measure_report *report = page->report;
    fv_writer_print(page->out, "<header>\n<h1>");
    fv_html_text(page->out, title);
    fv_writer_print(page->out, "</h1>\n<p class=\"soft\">");
    write_abouts(page);
    fv_writer_print(page->out, "</p>\n");
    if (report->missing > 0)
        fv_writer_print(
            page->out,
            "<p class=\"verdict\"><b>%d row%s of the whole sweep %s not here:</b> of other methods, "
            "levels or shares, or not measured yet.</p>\n",
            report->missing, report->missing == 1 ? "" : "s", report->missing == 1 ? "is" : "are");
    fv_writer_print(page->out, "</header>\n");
}

/* The fastest row of a method other than full whose fovea is no worse than `least_db`; NULL: none. */
static const struct fv_measure_row *fastest(const struct fv_measure_page *page, double least_db)
{
    const struct fv_measure_row *best = NULL;
    for (int i = 0; i < page->rows; i++) {
        const struct fv_measure_row *r = &page->row[i];
        if (strcmp(r->method, "full") == 0 || !isfinite(r->speedup.value)) continue;
        if (!(r->psnr[FV_ZONE_FOVEA].value >= least_db)) continue;
        if (!best || r->speedup.value > best->speedup.value) best = r;
    }
    return best;
}

static void write_row(struct fv_measure_page *page, const struct fv_measure_row *row)
{
    fv_html_text(page->out, row->method);
    fv_writer_print(page->out, " level %d", row->level);
}

static void write_sentences(struct fv_measure_page *page, const struct fv_measure_row *full,
                            const struct fv_measure_row *equal, const struct fv_measure_row *quick)
{
    struct fv_writer *out = page->out;
    double full_db = full ? full->psnr[FV_ZONE_FOVEA].value : (double)NAN;
    fv_writer_print(out, "<p class=\"verdict%s\">", equal && equal->speedup.value > 1 ? " good" : "");
    if (equal) {
        fv_writer_print(out, "<b>");
        write_row(page, equal);
        fv_writer_print(out,
                        " is %s times as fast as plain rendering of every pixel,</b> with %s dB in the fovea "
                        "against %s dB. ",
                        fv_shown_fixed(equal->speedup.value, 2).text,
                        fv_shown_infinite(equal->psnr[FV_ZONE_FOVEA].value, 1).text,
                        fv_shown_infinite(full_db, 1).text);
    } else if (isnan(full_db)) {
        fv_writer_print(
            out,
            "Plain rendering (full at level 0) is not among the rows, so no method is judged against it. ");
    } else if (quick) {
        fv_writer_print(out, "No level of another method comes within %.1f dB of full in the fovea (%s dB). ",
                        margin_db, fv_shown_infinite(full_db, 1).text);
    } else {
        fv_writer_print(out,
                        "Only plain rendering (full) was measured: %s dB in the fovea at its first level. ",
                        fv_shown_infinite(full_db, 1).text);
    }
    if (quick && quick != equal) {
        fv_writer_print(out, "The fastest, ");
        write_row(page, quick);
        fv_writer_print(out, ", is %s times as fast, with %s dB.",
                        fv_shown_fixed(quick->speedup.value, 2).text,
                        fv_shown_infinite(quick->psnr[FV_ZONE_FOVEA].value, 1).text);
    } else if (quick) {
        fv_writer_print(out, "No other level of these methods is faster.");
    }
    fv_writer_print(out, "</p>\n");
}

static void write_fact(struct fv_measure_page *page, const char *name, const struct fv_measure_row *row)
{
    char more[128] = "no such row";
    if (row)
        snprintf(more, sizeof more, "%s level %d, %s ms", row->method, row->level,
                 fv_shown_fixed(row->frame_ms.value, 2).text);
    fv_fact(page->out, name, fv_shown_fixed(row ? row->speedup.value : (double)NAN, 2),
            row ? " \xC3\x97" : "", more);
}

void fv_measure_verdict(struct fv_measure_page *page)
{
    const struct fv_measure_row *full = fv_measure_baseline(page), *first = &page->row[0];
    double full_db = full ? full->psnr[FV_ZONE_FOVEA].value : (double)NAN;
    const struct fv_measure_row *equal = isnan(full_db) ? NULL : fastest(page, full_db - margin_db);
    const struct fv_measure_row *quick = fastest(page, -INFINITY);
    char more[128];
    int least = first->frames, most = first->frames;
    for (int i = 0; i < page->rows; i++) {
        if (page->row[i].frames < least) least = page->row[i].frames;
        if (page->row[i].frames > most) most = page->row[i].frames;
    }
    write_sentences(page, full, equal, quick);
    fv_writer_print(page->out, "<dl class=\"facts\">\n");
    write_fact(page, "Speed-up, fovea as good", equal);
    write_fact(page, "Speed-up, fastest row", quick);
    snprintf(more, sizeof more, "every pixel, one sample; quartiles %s to %s",
             fv_shown_fixed(first->full_frame_ms.low, 2).text,
             fv_shown_fixed(first->full_frame_ms.high, 2).text);
    fv_fact(page->out, "Plain frame", fv_shown_fixed(first->full_frame_ms.value, 2), " ms", more);
    char frames[32];
    snprintf(frames, sizeof frames, least == most ? "%d" : "%d to %d", least, most);
    snprintf(more, sizeof more, "%d method%s; %s timed frames, %d judged pictures each", page->methods,
             page->methods == 1 ? "" : "s", frames, first->pictures);
    fv_fact(page->out, "Rows", fv_shown_fixed(page->rows, 0), "", more);
    fv_writer_print(page->out, "</dl>\n");
}
