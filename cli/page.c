/* page: see page.h; what it looks like: page_style.h. */
#include "cli/page.h"

#include "cli/page_style.h"
#include "cli/plot.h"

#include <math.h>

void fv_page_open(struct fv_writer *out, const char *title)
{
    fv_writer_print(out, "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
                         "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n"
                         "<link rel=\"icon\" href=\"data:,\">\n<title>");
    fv_html_text(out, title);
    fv_writer_print(out, "</title>\n<style>");
    fv_writer_bytes(out, fv_page_style, sizeof fv_page_style - 1);
    fv_writer_print(out, "</style>\n</head>\n<body>\n");
    fv_plot_shapes(out);
    fv_writer_print(out, "<main>\n");
}

void fv_page_close(struct fv_writer *out)
{
    fv_writer_print(out, "</main>\n</body>\n</html>\n");
}

void fv_section_open(struct fv_writer *out, const char *heading, const char *note)
{
    fv_writer_print(out, "<section>\n<h2>");
    fv_html_text(out, heading);
    fv_writer_print(out, "</h2>\n");
    if (!note) return;
    fv_writer_print(out, "<p class=\"note\">");
    fv_html_text(out, note);
    fv_writer_print(out, "</p>\n");
}

void fv_section_close(struct fv_writer *out)
{
    fv_writer_print(out, "</section>\n");
}

void fv_terms(struct fv_writer *out, const char *heading, const char *const (*rows)[2], int n)
{
    fv_section_open(out, heading, NULL);
    fv_writer_print(out, "<dl class=\"terms\">\n");
    for (int i = 0; i < n; i++) fv_writer_print(out, "<dt>%s</dt><dd>%s</dd>\n", rows[i][0], rows[i][1]);
    fv_writer_print(out, "</dl>\n");
    fv_section_close(out);
}

void fv_fact(struct fv_writer *out, const char *name, struct fv_shown value, const char *unit,
             const char *more)
{
    fv_writer_print(out, "<div><dt>");
    fv_html_text(out, name);
    fv_writer_print(out, "</dt><dd class=\"value\">%s%s</dd><dd class=\"more\">", value.text, unit);
    fv_html_text(out, more);
    fv_writer_print(out, "</dd></div>\n");
}

void fv_table_open(struct fv_writer *out, const char *class, const char *cells)
{
    fv_writer_print(out, "<div class=\"scroll\"><table class=\"%s\">\n<thead><tr>%s</tr></thead>\n<tbody>\n",
                    class, cells);
}

void fv_table_close(struct fv_writer *out)
{
    fv_writer_print(out, "</tbody></table></div>\n");
}

void fv_name_cell(struct fv_writer *out, const char *name)
{
    fv_writer_print(out, "<th scope=\"row\">");
    fv_html_text(out, name);
    fv_writer_print(out, "</th>");
}

void fv_number_cell(struct fv_writer *out, struct fv_shown shown)
{
    fv_writer_print(out, "<td class=\"n\">%s</td>", shown.text);
}

void fv_bar_cell(struct fv_writer *out, double fraction)
{
    fv_writer_print(out, "<td class=\"bar\" aria-hidden=\"true\"><i style=\"width:%.2f%%\"></i></td>",
                    100 * fmin(fmax(fraction, 0), 1)); /* NaN becomes 0 */
}
