/* measure_sections: what the parts of measure's report.html share; measure_page.c puts them in order. */
#ifndef FV_CLI_MEASURE_SECTIONS_H
#define FV_CLI_MEASURE_SECTIONS_H

#include "cli/markup.h"
#include "cli/measure_page.h"
#include "cli/page.h"
#include "cli/plot.h"

/* Rows `row[first]` to `row[end - 1]` of the scene, all of one method, in the order of levels. */
struct fv_measure_method {
    const char *name;
    int first, end;
    int slot; /* colour and marker: the same for a method wherever it stands */
};

struct fv_measure_page {
    struct fv_writer *out;
    const struct fv_measure_report *report;
    /* The scene under way: its rows, its methods, the range of its frame times. */
    int rows, methods;
    const struct fv_measure_row *row;
    struct fv_measure_method method[FV_ROWS_MAX];
    struct fv_axis ms;
    bool failed;
    struct fv_error *error;
};

/* The scene's row of `full` at its first level, NULL where it is not there. */
const struct fv_measure_row *fv_measure_baseline(const struct fv_measure_page *page);

/* A value for people: decibels and the like may be infinite. */
struct fv_shown fv_shown_infinite(double value, int decimals);

/* A method's key and name, as plain content of a cell or a heading. */
void fv_measure_name(struct fv_measure_page *page, const struct fv_measure_method *method);

/* measure_verdict.c: what was measured on what, and what came of it. */
void fv_measure_header(struct fv_measure_page *page, const char *title);
void fv_measure_verdict(struct fv_measure_page *page);

/* measure_plots.c */
void fv_measure_main_plots(struct fv_measure_page *page);
void fv_measure_zones(struct fv_measure_page *page);

/* measure_tables.c */
void fv_measure_time_to_error(struct fv_measure_page *page);
void fv_measure_rows(struct fv_measure_page *page);
void fv_measure_numerics(struct fv_measure_page *page);
void fv_measure_definitions(struct fv_measure_page *page);

/* measure_pictures.c; the filter, once a page, colours the differences' grey levels. */
void fv_measure_flip_filter(struct fv_measure_page *page);
void fv_measure_pictures(struct fv_measure_page *page);

#endif
