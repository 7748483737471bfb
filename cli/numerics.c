/* numerics: the table of experiments and the rows they add; numerics_csv.c writes and reads them. */
#include "cli/experiments.h"

#include "rt/measure/depth.h"
#include "rt/measure/rank.h"

#include <assert.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>

static void (*const experiments[])(struct fv_setup *setup, struct fv_numerics *numerics) = {
    fv_experiment_variants, fv_experiment_integration, fv_experiment_depth, fv_experiment_head,
    fv_experiment_gaze};

struct fv_numeric_row *fv_numerics_add(struct fv_numerics *n, const char *quantity, const char *method,
                                       const char *error_unit, const char *condition, ...)
{
    assert(n->rows < FV_NUMERICS_MAX);
    struct fv_numeric_row *r = &n->row[n->rows++];
    va_list arguments;
    *r = (struct fv_numeric_row){.error_p50 = NAN, .error_p95 = NAN, .cost = NAN};
    snprintf(r->quantity, sizeof r->quantity, "%s", quantity);
    snprintf(r->method, sizeof r->method, "%s", method);
    snprintf(r->error_unit, sizeof r->error_unit, "%s", error_unit);
    va_start(arguments, condition);
    vsnprintf(r->condition, sizeof r->condition, condition, arguments);
    va_end(arguments);
    return r;
}

void fv_numerics_errors(struct fv_numeric_row *row, double *error, int count)
{
    if (count < 1) return;
    fv_rank_sort(error, count);
    row->error_p50 = fv_rank_percentile(error, count, 50);
    row->error_p95 = fv_rank_percentile(error, count, 95);
}

void fv_numerics_view(const struct fv_setup *setup, struct fv_view *view)
{
    static const double ahead[3] = {0, 0, -1};
    struct fv_pose stand;
    fv_path_pose(&setup->config.scene_path, setup->config.scene_path_seconds, 0, &stand);
    fv_loop_view(&setup->loop, 0, &stand, ahead, view);
}

void fv_experiment_depth(struct fv_setup *setup, struct fv_numerics *n)
{
    struct fv_depth_row row[FV_DEPTH_ROWS];
    struct fv_view view;
    fv_numerics_view(setup, &view);
    int rows = fv_depth_measure(&setup->tracer, &view, &setup->workers, row, n->stopped);
    for (int i = 0; i < rows; i++) {
        struct fv_numeric_row *r = fv_numerics_add(n, "depth interpolation", row[i].method, "of the depth",
                                                   "a node every %d pixels", row[i].spacing);
        r->error_p50 = row[i].error_p50;
        r->error_p95 = row[i].error_p95;
        r->cost = row[i].ns_pixel;
        snprintf(r->cost_unit, sizeof r->cost_unit, "ns/pixel");
    }
}

int fv_numerics_measure(struct fv_setup *setup, struct fv_numeric_row *row, const volatile int *stopped)
{
    struct fv_numerics n = {.row = row, .stopped = stopped};
    for (unsigned i = 0; i < sizeof experiments / sizeof experiments[0] && !fv_numerics_stopped(&n); i++)
        experiments[i](setup, &n);
    return n.rows;
}
