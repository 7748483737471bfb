/* measure_selective_page: what report.html shows of `measure --table kim2021`, in two files. */
#ifndef FV_CLI_MEASURE_SELECTIVE_PAGE_H
#define FV_CLI_MEASURE_SELECTIVE_PAGE_H

#include "cli/markup.h"
#include "cli/measure_table.h"

/* A cell of ours with the paper's, where it has one, small beside it; a paper's alone is small, too. */
void fv_selective_cell(struct fv_writer *out, const struct fv_sheet *sheet, const char *row,
                       const char *quantity, struct fv_shown (*show)(double));

/* Numbers as cells show them. */
struct fv_shown fv_selective_decibels(double value);

/* measure_selective_figures.c: Figures 6 to 8, each left out where its part is not there. Returns 0, or -1
 * with the error set: a picture could not be read. */
int fv_selective_figures(struct fv_writer *out, const struct fv_table_report *report, struct fv_error *error);

#endif
