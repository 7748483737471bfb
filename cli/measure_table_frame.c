/* measure_table_frame: report.html of `measure --table NAME`: heading and foot, and between them the table's own
 * page. */
#include "cli/measure_table.h"

#include "cli/page.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

static const struct {
    const char *table;
    fv_table_page_of *write;
} pages[] = {{"weier2016", fv_table_page_weier2016},
             {"kim2021", fv_table_page_kim2021},
             {"peres2023", fv_table_page_peres2023},
             {"polychronakis2023", fv_table_page_polychronakis2023}};

int fv_table_page(const struct fv_table_report *report, const char *path, struct fv_error *error)
{
    static struct fv_writer out;
    const struct fv_table *table = report->table;
    struct fv_error closing;
    char title[96];
    int failed = 0;
    if (fv_writer_open(&out, path, error)) return -1;
    snprintf(title, sizeof title, "%s, paper and ours", table->paper);
    fv_page_open(&out, title);
    fv_writer_print(&out, "<header>\n<h1>");
    fv_html_text(&out, title);
    fv_writer_print(&out, "</h1>\n<p class=\"soft\">");
    fv_html_text(&out, report->about);
    fv_writer_print(&out, "</p>\n");
    if (report->parts < table->parts)
        fv_writer_print(&out, "<p class=\"verdict\"><b>%d of %d parts are not here:</b> their scene is not at hand, "
                              "or they are not measured yet.</p>\n",
                        table->parts - report->parts, table->parts);
    fv_writer_print(&out, "</header>\n");
    for (size_t i = 0; i < sizeof pages / sizeof pages[0]; i++)
        if (strcmp(pages[i].table, table->name) == 0) failed = pages[i].write(&out, report, error);
    fv_writer_print(&out, "<footer>Foveola %s. The same numbers as data: table-%s.csv.</footer>\n", FV_VERSION,
                    table->name);
    fv_page_close(&out);
    if (failed) out.failed = out.failed ? out.failed : EIO; /* so that close removes the file */
    int closed = fv_writer_close(&out, &closing);
    if (!failed) *error = closing;
    return closed;
}
