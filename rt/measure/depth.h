/* depth: how well the support G-buffer's nodes tell every pixel's depth, by the way it is interpolated
 * between them, against what that costs: reprojection stands on this. */
#ifndef FV_MEASURE_DEPTH_H
#define FV_MEASURE_DEPTH_H

#include "platform/threads.h"
#include "rt/trace/tracer.h"

/* One row of pixels between two rows of nodes. Run r of the row's pixels lies between the nodes r and
 * r + 1; it is `spacing` pixels long. */
struct fv_depth_span {
    const float *upper, *lower; /* the nodes' inverse depths, 1/m, 0: nothing hit; runs + 1 of each */
    float down;                 /* how far from upper to lower, in [0, 1) */
    int runs, spacing;          /* spacing: 4, 8 or 16 */
    float *out;                 /* inverse depths of runs * spacing pixels */
};

/* A way to interpolate; compiled once for each instruction set (depth_kernel.c). */
struct fv_depth_method {
    const char *name;
    void (*row)(const struct fv_depth_span *span);
};
enum { FV_DEPTH_NEAREST, FV_DEPTH_INVERSE, FV_DEPTH_LINEAR, FV_DEPTH_FRONT, FV_DEPTH_METHODS };
enum { FV_DEPTH_SPACINGS = 3, FV_DEPTH_ROWS = FV_DEPTH_METHODS * FV_DEPTH_SPACINGS };

/* FV_DEPTH_METHODS rows. */
const struct fv_depth_method *fv_depth_methods(enum fv_isa isa);

/* Errors are |w' - w| / max(w', w) of inverse depths w (the relative depth difference that reprojection
 * allows for), over the pixels that hit something, to 0.4 %; NaN where none does. */
struct fv_depth_row {
    const char *method;
    int spacing;
    double error_p50, error_p95;
    double ns_pixel; /* thread CPU time, least of several repeats */
};

/* Traces the view's pixels and nodes through `workers` and measures all methods at all spacings. Memory is
 * taken from the arena: call once. Returns the number of rows done before `stopped` (NULL: never) became
 * true. */
int fv_depth_measure(const struct fv_tracer *tracer, const struct fv_view *view, struct fv_workers *workers,
                     struct fv_depth_row row[FV_DEPTH_ROWS], const volatile int *stopped);

#endif
