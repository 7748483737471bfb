/* plot: curves, points and error bars as inline SVG. Curves stretch with the page; text, line widths
 * and markers do not. Nothing allocates. */
#ifndef FV_CLI_PLOT_H
#define FV_CLI_PLOT_H

#include "platform/files.h"

#include <stdbool.h>

/* Colours and markers, told apart by those who see colours differently, too (Okabe and Ito 2008):
 * slot i has colour and marker i modulo this. */
enum { FV_PLOT_SLOTS = 8 };

/* The plotted range: low < high, and on a logarithmic axis 0 < low. A linear axis with low > high runs the
 * other way: `low` is still at the left or the bottom. */
struct fv_axis {
    double low, high;
    bool log;
};

/* An axis made to fit: begun empty, held values in turn (what is not finite, and what is not positive on
 * a logarithmic axis, is passed over), settled. Settling leaves a margin, makes the axis at least `least`
 * long (a ratio where logarithmic, > 1), and takes `empty` where it holds nothing. */
struct fv_axis fv_axis_empty(bool log);
void fv_axis_hold(struct fv_axis *axis, double value);
void fv_axis_settle(struct fv_axis *axis, double least, struct fv_axis empty);

struct fv_plot {
    struct fv_writer *out;
    struct fv_axis x, y;
    bool moved; /* the path under way has a current point */
};

struct fv_plot_text {
    const char *caption; /* what is plotted, with its unit */
    const char *label;   /* for those who cannot see it */
    const char *x_name;  /* with its unit; NULL leaves the labels of the x axis out */
    int height_px;
    bool narrow; /* of several beside each other: fewer ticks */
    /* What stands at 1, 2, 3, ... on the x axis, NULL behind the last; NULL: ticks at round numbers. */
    const char *const *x_words;
};

/* Opens a figure with ticks at round numbers; the caller has set the writer and the axes. */
void fv_plot_open(struct fv_plot *plot, const struct fv_plot_text *text);
void fv_plot_close(struct fv_plot *plot);

/* A path of a class of the page's style: line, band, bars, late, marks, "curve cN" of slot N. NaN breaks
 * a line. Points outside are drawn at the edge. */
void fv_path_open(struct fv_plot *plot, const char *class);
void fv_path_point(struct fv_plot *plot, double x, double y);
void fv_path_box(struct fv_plot *plot, double x0, double x1, double y0, double y1);
void fv_path_close(struct fv_plot *plot);

/* A labelled line across, at y, or upright, at x. */
void fv_plot_across(struct fv_plot *plot, double y, const char *label);
void fv_plot_upright(struct fv_plot *plot, double x, const char *label);

/* A slot's marker at a point, nothing where that is NaN. */
struct fv_mark {
    int slot;
    bool ring;         /* around it */
    const char *label; /* beside it, NULL: none */
    const char *what;  /* shown where it is pointed at */
};
void fv_plot_point(struct fv_plot *plot, double x, double y, const struct fv_mark *mark);

/* Error bars through (x, y), each left out where an end or its place is NaN. */
struct fv_bars {
    double x_low, x_high, y_low, y_high;
};
void fv_plot_bars(struct fv_plot *plot, double x, double y, const struct fv_bars *bars, int slot);

/* The part of the plot's width (from the left) and of its height (from the top) at which a point is
 * drawn; 0 to 1. */
double fv_plot_part_x(const struct fv_plot *plot, double x);
double fv_plot_part_y(const struct fv_plot *plot, double y);

/* A slot's line and marker, beside its name. */
void fv_plot_key(struct fv_writer *out, int slot);

/* What every page holds once, before its plots: the markers' shapes. */
void fv_plot_shapes(struct fv_writer *out);

#endif
