/* page: see page.h. Ticks lie at round numbers (1, 2 or 5 times a power of ten). */
#include "cli/page.h"

#include "cli/markup.h"
#include "cli/page_style.h"

#include <math.h>
#include <stdio.h>

/* The nested drawing of a plot has these coordinates, x to the right and y downwards. */
enum { ACROSS = 10000, DOWN = 1000 };

void fv_page_open(struct fv_writer *out, const char *title)
{
    fv_writer_print(out, "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
                         "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n"
                         "<link rel=\"icon\" href=\"data:,\">\n<title>");
    fv_html_text(out, title);
    fv_writer_print(out, "</title>\n<style>");
    fv_writer_bytes(out, fv_page_style, sizeof fv_page_style - 1);
    fv_writer_print(out, "</style>\n</head>\n<body>\n<main>\n");
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

static double clamp(double x, double low, double high)
{
    return fmin(fmax(x, low), high); /* NaN becomes low */
}

void fv_bar_cell(struct fv_writer *out, double fraction)
{
    fv_writer_print(out, "<td class=\"bar\" aria-hidden=\"true\"><i style=\"width:%.2f%%\"></i></td>",
                    100 * clamp(fraction, 0, 1));
}

static double part_x(const struct fv_plot *p, double x)
{
    return clamp((x - p->x_low) / (p->x_high - p->x_low), 0, 1);
}

static double part_y(const struct fv_plot *p, double y)
{
    return 1 - clamp((y - p->y_low) / (p->y_high - p->y_low), 0, 1);
}

/* The smallest round step that makes at most `most` ticks, and the decimals that tell them apart. */
static double round_step(double low, double high, int most, int *decimals)
{
    static const double factors[] = {1, 2, 5, 10};
    double least = (high - low) / most, power = pow(10, floor(log10(least)));
    int k = 0;
    while (k < 3 && factors[k] * power < least * (1 - 1e-9)) k++;
    double step = factors[k] * power;
    *decimals = (int)clamp(-floor(log10(step) + 1e-9), 0, 9);
    return step;
}

static void write_tick_text(struct fv_plot *p, double value, double step, int decimals)
{
    if (step >= 1000) fv_writer_print(p->out, "%s</text>", fv_shown_count(value).text);
    else fv_writer_print(p->out, "%.*f</text>", decimals, value);
}

static void write_ticks(struct fv_plot *p, bool x_labels, int height_px)
{
    int decimals;
    double step = round_step(p->y_low, p->y_high, height_px > 120 ? 6 : 3, &decimals);
    fv_writer_print(p->out, "<g class=\"grid\">");
    /* Adding 0 turns -0 into 0. */
    for (double i = ceil(p->y_low / step - 1e-9) + 0.0; i * step <= p->y_high + 1e-9 * step; i++) {
        double at = 100 * part_y(p, i * step);
        fv_writer_print(p->out,
                        "<line x1=\"0\" x2=\"100%%\" y1=\"%.2f%%\" y2=\"%.2f%%\"/>"
                        "<text x=\"-8\" y=\"%.2f%%\" dy=\".32em\" text-anchor=\"end\">",
                        at, at, at);
        write_tick_text(p, i * step, step, decimals);
    }
    step = round_step(p->x_low, p->x_high, 6, &decimals);
    for (double i = ceil(p->x_low / step - 1e-9) + 0.0; i * step <= p->x_high + 1e-9 * step; i++) {
        double at = 100 * part_x(p, i * step);
        fv_writer_print(p->out, "<line x1=\"%.2f%%\" x2=\"%.2f%%\" y1=\"0\" y2=\"100%%\"/>", at, at);
        if (!x_labels) continue;
        fv_writer_print(p->out, "<text x=\"%.2f%%\" y=\"100%%\" dy=\"18\" text-anchor=\"middle\">", at);
        write_tick_text(p, i * step, step, decimals);
    }
    fv_writer_print(p->out, "</g>");
}

void fv_plot_open(struct fv_plot *p, const struct fv_plot_text *text)
{
    fv_writer_print(p->out, "<figure class=\"plot%s\"><figcaption>", text->x_name ? " axis" : "");
    fv_html_text(p->out, text->caption);
    fv_writer_print(p->out, "</figcaption><div><svg role=\"img\" style=\"height:%dpx\" aria-label=\"",
                    text->height_px);
    fv_html_text(p->out, text->label);
    fv_writer_print(p->out, "\">\n");
    write_ticks(p, text->x_name != NULL, text->height_px);
    if (text->x_name) {
        fv_writer_print(p->out, "<text x=\"100%%\" y=\"100%%\" dy=\"36\" text-anchor=\"end\">");
        fv_html_text(p->out, text->x_name);
        fv_writer_print(p->out, "</text>");
    }
}

void fv_plot_close(struct fv_plot *p)
{
    fv_writer_print(p->out, "</svg></div></figure>\n");
}

void fv_path_open(struct fv_plot *p, const char *class)
{
    fv_writer_print(
        p->out,
        "<svg viewBox=\"0 0 %d %d\" preserveAspectRatio=\"none\" width=\"100%%\" height=\"100%%\">"
        "<path class=\"%s\" d=\"",
        ACROSS, DOWN, class);
    p->moved = false;
}

void fv_path_point(struct fv_plot *p, double x, double y)
{
    if (isnan(x) || isnan(y)) {
        p->moved = false;
        return;
    }
    /* The short step after a move makes a lone point a dot. */
    fv_writer_print(p->out, p->moved ? "L%.0f,%.1f" : "M%.0f,%.1fh9", ACROSS * part_x(p, x),
                    DOWN * part_y(p, y));
    p->moved = true;
}

void fv_path_box(struct fv_plot *p, double x0, double x1, double y0, double y1)
{
    if (isnan(x0) || isnan(x1) || isnan(y0) || isnan(y1)) return;
    fv_writer_print(p->out, "M%.1f,%.1fV%.1fH%.1fV%.1fz", ACROSS * part_x(p, x0), DOWN * part_y(p, y0),
                    DOWN * part_y(p, y1), ACROSS * part_x(p, x1), DOWN * part_y(p, y0));
}

void fv_path_close(struct fv_plot *p)
{
    fv_writer_print(p->out, "\"/></svg>\n");
}

void fv_plot_across(struct fv_plot *p, double y, const char *label)
{
    double at = 100 * part_y(p, y);
    fv_writer_print(p->out,
                    "<g class=\"limit\"><line x1=\"0\" x2=\"100%%\" y1=\"%.2f%%\" y2=\"%.2f%%\"/>"
                    "<text x=\"100%%\" y=\"%.2f%%\" dx=\"-4\" dy=\"-6\" text-anchor=\"end\">",
                    at, at, at);
    fv_html_text(p->out, label);
    fv_writer_print(p->out, "</text></g>\n");
}

void fv_plot_upright(struct fv_plot *p, double x, const char *label)
{
    double part = part_x(p, x);
    bool left = part > 0.6; /* of the line, where there is room */
    fv_writer_print(p->out,
                    "<g class=\"limit\"><line x1=\"%.2f%%\" x2=\"%.2f%%\" y1=\"0\" y2=\"100%%\"/>"
                    "<text x=\"%.2f%%\" y=\"0\" dx=\"%d\" dy=\"14\" text-anchor=\"%s\">",
                    100 * part, 100 * part, 100 * part, left ? -6 : 6, left ? "end" : "start");
    fv_html_text(p->out, label);
    fv_writer_print(p->out, "</text></g>\n");
}
