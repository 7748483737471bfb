/* experiments: what numerics.c puts into its table: each measures one quantity and adds its rows. */
#ifndef FV_CLI_EXPERIMENTS_H
#define FV_CLI_EXPERIMENTS_H

#include "cli/numerics.h"

/* The table under way. */
struct fv_numerics {
    struct fv_numeric_row *row;
    int rows;
    const volatile int *stopped;
};

static inline bool fv_numerics_stopped(const struct fv_numerics *n)
{
    return n->stopped && *n->stopped;
}

/* A new row, its condition in printf form; errors and cost are NaN until they are set. */
struct fv_numeric_row *fv_numerics_add(struct fv_numerics *numerics, const char *quantity, const char *method,
                                       const char *error_unit, const char *condition, ...)
    __attribute__((format(printf, 5, 6)));

/* Sorts the errors and sets the row's percentiles; NaN where count is 0. */
void fv_numerics_errors(struct fv_numeric_row *row, double *error, int count);

/* The left eye's view from the start of the scene's path, straight ahead. */
void fv_numerics_view(const struct fv_setup *setup, struct fv_view *view);

void fv_experiment_integration(struct fv_setup *setup, struct fv_numerics *numerics);
void fv_experiment_variants(struct fv_setup *setup, struct fv_numerics *numerics);
void fv_experiment_depth(struct fv_setup *setup, struct fv_numerics *numerics);
void fv_experiment_head(struct fv_setup *setup, struct fv_numerics *numerics);
void fv_experiment_gaze(struct fv_setup *setup, struct fv_numerics *numerics);

#endif
