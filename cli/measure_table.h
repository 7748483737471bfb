/* measure_table: `measure --table NAME`: a paper's table measured again (rt/measure/table.h), part by part, each in
 * a process of its own, and what came of it: table-NAME.csv, report.html, and a file a part in table-NAME/. What
 * is measured stays: the same command goes on with the parts that are missing. */
#ifndef FV_CLI_MEASURE_TABLE_H
#define FV_CLI_MEASURE_TABLE_H

#include "cli/cli.h"
#include "rt/measure/table.h"

/* Returns an exit code. */
int fv_measure_table(const struct fv_arguments *arguments);

struct fv_table_report {
    const struct fv_table *table;
    const struct fv_sheet *sheet;
    int parts;                     /* that are there */
    const char *folder;            /* of their files and pictures */
    char about[FV_PART_ABOUT];     /* machine, display, frames */
};

/* report.html. Returns 0, or -1 with the error set. */
int fv_table_page(const struct fv_table_report *report, const char *path, struct fv_error *error);

/* What it shows of a table, between its heading and its foot. Returns 0, or -1 with the error set: a picture could not
 * be read. */
typedef int fv_table_page_of(struct fv_writer *out, const struct fv_table_report *report, struct fv_error *error);
fv_table_page_of fv_table_page_weier2016, fv_table_page_kim2021, fv_table_page_peres2023, fv_table_page_polychronakis2023;

#endif
