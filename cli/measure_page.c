/* measure_page: the order of the page's parts, scene by scene; see measure_sections.h for where each is. */
#include "cli/measure_sections.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#ifndef FV_VERSION
#define FV_VERSION "unknown"
#endif

/* Methods known by name have the first slots; others the following, in the order of the report's rows. */
static int slot_of(const struct fv_measure_report *report, const char *method)
{
    static const char *const known[] = {"full", "reproject", "selective", "denoise", "pyramid"};
    enum { KNOWN = sizeof known / sizeof known[0] };
    const char *other[FV_ROWS_MAX];
    int others = 0;
    for (int i = 0; i < KNOWN; i++)
        if (strcmp(known[i], method) == 0) return i;
    for (int i = 0; i < report->rows; i++) {
        const char *name = report->row[i].method;
        bool seen = false;
        for (int k = 0; k < KNOWN; k++) seen |= strcmp(known[k], name) == 0;
        for (int k = 0; k < others; k++) seen |= strcmp(other[k], name) == 0;
        if (seen) continue;
        if (strcmp(name, method) == 0) break;
        other[others++] = name;
    }
    return KNOWN + others;
}

/* The scene that begins at the report's row `first`. Returns the row behind its last. */
static int take_scene(struct fv_measure_page *page, int first)
{
    const struct fv_measure_report *report = page->report;
    page->row = &report->row[first];
    page->rows = page->methods = 0;
    page->ms = fv_axis_empty(true);
    for (int i = 0; first + i < report->rows && strcmp(page->row[i].scene, page->row[0].scene) == 0; i++) {
        const struct fv_measure_row *r = &page->row[i];
        if (i == 0 || strcmp(r->method, r[-1].method) != 0)
            page->method[page->methods++] =
                (struct fv_measure_method){r->method, i, i, slot_of(report, r->method)};
        page->method[page->methods - 1].end = ++page->rows;
        fv_axis_hold(&page->ms, r->frame_ms.value);
        fv_axis_hold(&page->ms, r->frame_ms.low);
        fv_axis_hold(&page->ms, r->frame_ms.high);
    }
    /* The display's period belongs into the plots unless frame times are of quite another size. */
    double period = report->period_ms;
    if (period * 40 > page->ms.high && period < page->ms.low * 40) fv_axis_hold(&page->ms, period);
    fv_axis_settle(&page->ms, 2, (struct fv_axis){1, 100, true});
    return first + page->rows;
}

const struct fv_measure_row *fv_measure_baseline(const struct fv_measure_page *page)
{
    for (int i = 0; i < page->rows; i++)
        if (strcmp(page->row[i].method, "full") == 0 && page->row[i].level == 0) return &page->row[i];
    return NULL;
}

struct fv_shown fv_shown_infinite(double value, int decimals)
{
    if (!isinf(value)) return fv_shown_fixed(value, decimals);
    return value > 0 ? (struct fv_shown){"\xE2\x88\x9E"} : (struct fv_shown){"\xE2\x88\x92\xE2\x88\x9E"};
}

void fv_measure_name(struct fv_measure_page *page, const struct fv_measure_method *method)
{
    fv_plot_key(page->out, method->slot);
    fv_html_text(page->out, method->name);
}

static int count_scenes(const struct fv_measure_report *report)
{
    int scenes = 0;
    for (int i = 0; i < report->rows; i++)
        scenes += i == 0 || strcmp(report->row[i].scene, report->row[i - 1].scene) != 0;
    return scenes;
}

static void write_scene(struct fv_measure_page *page, bool headed)
{
    static void (*const sections[])(struct fv_measure_page *) = {
        fv_measure_verdict,       fv_measure_main_plots, fv_measure_zones,
        fv_measure_time_to_error, fv_measure_pictures,   fv_measure_rows,
    };
    if (headed) {
        fv_writer_print(page->out, "<h2 class=\"scene\" id=\"scene%d\">",
                        (int)(page->row - page->report->row));
        fv_html_text(page->out, page->row[0].scene);
        fv_writer_print(page->out, "</h2>\n");
    }
    for (size_t i = 0; i < sizeof sections / sizeof sections[0]; i++) sections[i](page);
}

static void write_contents(struct fv_measure_page *page)
{
    const struct fv_measure_report *report = page->report;
    fv_writer_print(page->out, "<nav>Scenes:");
    for (int i = 0; i < report->rows; i++) {
        if (i > 0 && strcmp(report->row[i].scene, report->row[i - 1].scene) == 0) continue;
        fv_writer_print(page->out, " <a href=\"#scene%d\">", i);
        fv_html_text(page->out, report->row[i].scene);
        fv_writer_print(page->out, "</a>");
    }
    fv_writer_print(page->out, "</nav>\n");
}

int fv_measure_page(const struct fv_measure_report *report, const char *path, struct fv_error *error)
{
    static struct fv_writer out;
    static struct fv_measure_page page;
    struct fv_error closing;
    char title[160];
    int scenes = count_scenes(report);
    page = (struct fv_measure_page){.out = &out, .report = report, .error = error};
    if (fv_writer_open(&out, path, error)) return -1;
    snprintf(title, sizeof title, "Error against run time%s%s", scenes == 1 ? ": " : "",
             scenes == 1 ? report->row[0].scene : "");
    fv_page_open(&out, title);
    fv_measure_flip_filter(&page);
    fv_measure_header(&page, title);
    if (scenes > 1) write_contents(&page);
    for (int first = 0; first < report->rows;) {
        first = take_scene(&page, first);
        write_scene(&page, scenes > 1);
    }
    fv_measure_numerics(&page);
    fv_measure_definitions(&page);
    fv_writer_print(&out, "<footer>Foveola %s. The same numbers as data: measure.csv.</footer>\n",
                    FV_VERSION);
    fv_page_close(&out);
    if (page.failed) out.failed = out.failed ? out.failed : EIO; /* so that close removes the file */
    if (fv_writer_close(&out, &closing) == 0) return 0;
    if (!page.failed) *error = closing;
    return -1;
}
