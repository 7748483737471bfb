/* page: the frame of an HTML report: one file, no network, no script; and its drawing of curves as
 * inline SVG. Curves stretch with the page, text and line widths do not. Nothing allocates. */
#ifndef FV_CLI_PAGE_H
#define FV_CLI_PAGE_H

#include "platform/files.h"

#include <stdbool.h>

/* Doctype to <main>, and </main> to the end. */
void fv_page_open(struct fv_writer *out, const char *title);
void fv_page_close(struct fv_writer *out);

/* A section with a heading; `note` (NULL: none) is a sentence below it. Both plain text. */
void fv_section_open(struct fv_writer *out, const char *heading, const char *note);
void fv_section_close(struct fv_writer *out);

/* A table row's bar, `fraction` (clamped to 0..1) of its column wide, as a cell. */
void fv_bar_cell(struct fv_writer *out, double fraction);

struct fv_plot {
    struct fv_writer *out;
    double x_low, x_high, y_low, y_high; /* the plotted range, low < high */
    bool moved;                          /* the path under way has a current point */
};

struct fv_plot_text {
    const char *caption; /* what is plotted, with its unit */
    const char *label;   /* for those who cannot see it */
    const char *x_name;  /* with its unit; NULL leaves the labels of the x axis out */
    int height_px;
};

/* Opens a figure with ticks at round numbers; the caller has set the writer and the range. */
void fv_plot_open(struct fv_plot *plot, const struct fv_plot_text *text);
void fv_plot_close(struct fv_plot *plot);

/* A path of a class of the page's style: line, band, bars, late, marks. NaN breaks a line. Points
 * outside are drawn at the edge. */
void fv_path_open(struct fv_plot *plot, const char *class);
void fv_path_point(struct fv_plot *plot, double x, double y);
void fv_path_box(struct fv_plot *plot, double x0, double x1, double y0, double y1);
void fv_path_close(struct fv_plot *plot);

/* A labelled line across, at y, or upright, at x. */
void fv_plot_across(struct fv_plot *plot, double y, const char *label);
void fv_plot_upright(struct fv_plot *plot, double x, const char *label);

#endif
