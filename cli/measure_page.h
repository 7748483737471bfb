/* measure_page: report.html of `measure`: error against run time, for people. */
#ifndef FV_CLI_MEASURE_PAGE_H
#define FV_CLI_MEASURE_PAGE_H

#include "cli/numerics.h"
#include "rt/measure/row.h"

struct fv_measure_report {
    int rows;                         /* at least 1 */
    const struct fv_measure_row *row; /* sorted (fv_rows_sort); of one scene or of several */
    int numerics;                     /* 0: none were measured */
    const struct fv_numeric_row *numeric;
    int missing;      /* rows that a whole sweep has and this one not (yet) */
    double period_ms; /* of the display; 0 or NaN where it is not known */
    /* Folder that holds, for some of the rows and scenes, SCENE-reference.jpg, SCENE-METHOD-LEVEL.jpg and
     * SCENE-METHOD-LEVEL-difference.jpg (FLIP of each pixel, black to white at fv_difference_white). NULL: none. */
    const char *pictures;
};

/* Embeds the pictures. Returns 0, or -1 with the error set: no page is left then. */
int fv_measure_page(const struct fv_measure_report *report, const char *path, struct fv_error *error);

#endif
