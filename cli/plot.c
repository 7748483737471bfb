/* plot: see plot.h. Where ticks lie: plot_ticks.c. */
#include "cli/plot.h"

#include "cli/markup.h"
#include "cli/plot_ticks.h"

#include <math.h>

/* The nested drawing of a plot has these coordinates, x to the right and y downwards. */
enum { ACROSS = 10000, DOWN = 1000 };

/* Beyond these, and nearer to 0 on a logarithmic axis, values are held at them. */
static const double largest = 1e30, smallest = 1e-30;

static double clamp(double x, double low, double high)
{
    return fmin(fmax(x, low), high); /* NaN becomes low */
}

struct fv_axis fv_axis_empty(bool log)
{
    return (struct fv_axis){INFINITY, -INFINITY, log};
}

void fv_axis_hold(struct fv_axis *axis, double value)
{
    if (!isfinite(value) || (axis->log && !(value > 0))) return;
    value = clamp(value, axis->log ? smallest : -largest, largest);
    axis->low = fmin(axis->low, value);
    axis->high = fmax(axis->high, value);
}

void fv_axis_settle(struct fv_axis *axis, double least, struct fv_axis empty)
{
    static const double margin = 0.06;
    if (!(axis->low <= axis->high)) {
        *axis = empty;
        return;
    }
    double low = axis->log ? log(axis->low) : axis->low, high = axis->log ? log(axis->high) : axis->high;
    double length = (high - low) * (1 + 2 * margin), middle = (low + high) / 2;
    /* Numbers so large that `least` would be lost in rounding. */
    length = fmax(fmax(length, axis->log ? log(least) : least), 1e-9 * fabs(middle));
    low = middle - length / 2;
    high = middle + length / 2;
    axis->low = axis->log ? exp(low) : low;
    axis->high = axis->log ? exp(high) : high;
}

static double part_of(const struct fv_axis *axis, double value)
{
    if (axis->log) return clamp(log(value / axis->low) / log(axis->high / axis->low), 0, 1);
    return clamp((value - axis->low) / (axis->high - axis->low), 0, 1);
}

double fv_plot_part_x(const struct fv_plot *p, double x)
{
    return part_of(&p->x, x);
}

double fv_plot_part_y(const struct fv_plot *p, double y)
{
    return 1 - part_of(&p->y, y);
}

/* `word`: below it, NULL: nothing. */
static void write_x_tick(struct fv_plot *p, double value, const char *word)
{
    double at = 100 * fv_plot_part_x(p, value);
    fv_writer_print(p->out, "<line x1=\"%.2f%%\" x2=\"%.2f%%\" y1=\"0\" y2=\"100%%\"/>", at, at);
    if (!word) return;
    fv_writer_print(p->out, "<text x=\"%.2f%%\" y=\"100%%\" dy=\"18\" text-anchor=\"middle\">", at);
    fv_html_text(p->out, word);
    fv_writer_print(p->out, "</text>");
}

static void write_ticks(struct fv_plot *p, const struct fv_plot_text *text)
{
    struct fv_ticks ticks;
    fv_ticks_of(&p->y, text->height_px > 120 ? 6 : 3, &ticks);
    fv_writer_print(p->out, "<g class=\"grid\">");
    for (int i = 0; i < ticks.count; i++) {
        double at = 100 * fv_plot_part_y(p, ticks.value[i]);
        fv_writer_print(p->out,
                        "<line x1=\"0\" x2=\"100%%\" y1=\"%.2f%%\" y2=\"%.2f%%\"/>"
                        "<text x=\"-8\" y=\"%.2f%%\" dy=\".32em\" text-anchor=\"end\">%s</text>",
                        at, at, at, fv_tick_text(&ticks, i).text);
    }
    if (text->x_words)
        for (int i = 0; text->x_words[i]; i++) write_x_tick(p, i + 1, text->x_name ? text->x_words[i] : NULL);
    else fv_ticks_of(&p->x, text->narrow ? 4 : 6, &ticks);
    for (int i = 0; !text->x_words && i < ticks.count; i++)
        write_x_tick(p, ticks.value[i], text->x_name ? fv_tick_text(&ticks, i).text : NULL);
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
    write_ticks(p, text);
    if (!text->x_name) return;
    fv_writer_print(p->out, "<text x=\"100%%\" y=\"100%%\" dy=\"36\" text-anchor=\"end\">");
    fv_html_text(p->out, text->x_name);
    fv_writer_print(p->out, "</text>");
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
    /* The short step to and fro after a move makes a lone point a dot. */
    fv_writer_print(p->out, p->moved ? "L%.0f,%.1f" : "M%.0f,%.1fh9h-9", ACROSS * fv_plot_part_x(p, x),
                    DOWN * fv_plot_part_y(p, y));
    p->moved = true;
}

void fv_path_box(struct fv_plot *p, double x0, double x1, double y0, double y1)
{
    if (isnan(x0) || isnan(x1) || isnan(y0) || isnan(y1)) return;
    double top = DOWN * fv_plot_part_y(p, y1), bottom = DOWN * fv_plot_part_y(p, y0);
    fv_writer_print(p->out, "M%.1f,%.1fV%.1fH%.1fV%.1fz", ACROSS * fv_plot_part_x(p, x0), bottom, top,
                    ACROSS * fv_plot_part_x(p, x1), bottom);
}

void fv_path_close(struct fv_plot *p)
{
    fv_writer_print(p->out, "\"/></svg>\n");
}

void fv_plot_across(struct fv_plot *p, double y, const char *label)
{
    double at = 100 * fv_plot_part_y(p, y);
    fv_writer_print(p->out,
                    "<g class=\"limit\"><line x1=\"0\" x2=\"100%%\" y1=\"%.2f%%\" y2=\"%.2f%%\"/>"
                    "<text x=\"100%%\" y=\"%.2f%%\" dx=\"-4\" dy=\"-6\" text-anchor=\"end\">",
                    at, at, at);
    fv_html_text(p->out, label);
    fv_writer_print(p->out, "</text></g>\n");
}

void fv_plot_upright(struct fv_plot *p, double x, const char *label)
{
    double part = fv_plot_part_x(p, x);
    bool left = part > 0.6; /* of the line, where there is room */
    fv_writer_print(p->out,
                    "<g class=\"limit\"><line x1=\"%.2f%%\" x2=\"%.2f%%\" y1=\"0\" y2=\"100%%\"/>"
                    "<text x=\"%.2f%%\" y=\"0\" dx=\"%d\" dy=\"14\" text-anchor=\"%s\">",
                    100 * part, 100 * part, 100 * part, left ? -6 : 6, left ? "end" : "start");
    fv_html_text(p->out, label);
    fv_writer_print(p->out, "</text></g>\n");
}

void fv_plot_point(struct fv_plot *p, double x, double y, const struct fv_mark *mark)
{
    if (isnan(x) || isnan(y)) return;
    double across = 100 * fv_plot_part_x(p, x), down = 100 * fv_plot_part_y(p, y);
    int slot = mark->slot % FV_PLOT_SLOTS;
    fv_writer_print(p->out, "<g class=\"point c%d\"><title>", slot);
    fv_html_text(p->out, mark->what);
    fv_writer_print(p->out, "</title>");
    if (mark->ring)
        fv_writer_print(p->out, "<circle class=\"ring\" cx=\"%.2f%%\" cy=\"%.2f%%\" r=\"9\"/>", across, down);
    fv_writer_print(p->out, "<use href=\"#mark%d\" x=\"%.2f%%\" y=\"%.2f%%\"/>", slot, across, down);
    if (mark->label) {
        bool below = down<8, before = across> 96; /* where there is room */
        fv_writer_print(p->out, "<text x=\"%.2f%%\" y=\"%.2f%%\" dx=\"%d\" dy=\"%d\" text-anchor=\"%s\">",
                        across, down, before ? -8 : 8, below ? 18 : -9, before ? "end" : "start");
        fv_html_text(p->out, mark->label);
        fv_writer_print(p->out, "</text>");
    }
    fv_writer_print(p->out, "</g>\n");
}

static void write_bar(struct fv_plot *p, double x0, double x1, double y0, double y1)
{
    if (isnan(x0) || isnan(x1) || isnan(y0) || isnan(y1)) return;
    fv_writer_print(p->out, "<line x1=\"%.2f%%\" x2=\"%.2f%%\" y1=\"%.2f%%\" y2=\"%.2f%%\"/>",
                    100 * fv_plot_part_x(p, x0), 100 * fv_plot_part_x(p, x1), 100 * fv_plot_part_y(p, y0),
                    100 * fv_plot_part_y(p, y1));
}

void fv_plot_bars(struct fv_plot *p, double x, double y, const struct fv_bars *bars, int slot)
{
    fv_writer_print(p->out, "<g class=\"error c%d\">", slot % FV_PLOT_SLOTS);
    write_bar(p, bars->x_low, bars->x_high, y, y);
    write_bar(p, x, x, bars->y_low, bars->y_high);
    fv_writer_print(p->out, "</g>");
}

void fv_plot_key(struct fv_writer *out, int slot)
{
    slot %= FV_PLOT_SLOTS;
    fv_writer_print(out,
                    "<svg class=\"key\" width=\"26\" height=\"14\" aria-hidden=\"true\">"
                    "<path class=\"curve c%d\" d=\"M1,7h24\"/>"
                    "<use class=\"c%d\" href=\"#mark%d\" x=\"13\" y=\"7\"/></svg>",
                    slot, slot, slot);
}

void fv_plot_shapes(struct fv_writer *out)
{
    /* Of about the same area, around 0. */
    static const char *const shapes[FV_PLOT_SLOTS] = {
        "M-4,-4h8v8h-8z",
        "M-4.6,0a4.6,4.6 0 1 0 9.2,0a4.6,4.6 0 1 0 -9.2,0z",
        "M0,-5.6L5.4,4H-5.4z",
        "M0,-6L5.2,0L0,6L-5.2,0z",
        "M0,5.6L5.4,-4H-5.4z",
        "M-1.8,-5.2h3.6v3.4h3.4v3.6h-3.4v3.4h-3.6v-3.4h-3.4v-3.6h3.4z",
        "M0,-5.4L5.2,-1.6L3.2,4.4H-3.2L-5.2,-1.6z",
        "M-5.4,-2.6H5.4V2.6H-5.4z",
    };
    fv_writer_print(out, "<svg class=\"shapes\" width=\"0\" height=\"0\" aria-hidden=\"true\"><defs>");
    for (int i = 0; i < FV_PLOT_SLOTS; i++)
        fv_writer_print(out, "<path class=\"mark\" id=\"mark%d\" d=\"%s\"/>", i, shapes[i]);
    fv_writer_print(out, "</defs></svg>\n");
}
