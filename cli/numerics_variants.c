/* numerics_variants: what leaving out code for things that the scene does not hold saves: every tracing
 * kernel that can show the scene on the same samples of its first view (rt/trace/variant.h). Their radiance
 * must not differ at all. */
#include "cli/experiments.h"

#include <math.h>
#include <stdio.h>

enum { PLACES = 7, REPEATS = 9, SIDE = 32 };

static struct fv_samples samples[PLACES * PLACES];
static double difference[PLACES * PLACES * FV_SAMPLES_MAX];
static float first[PLACES * PLACES][3][FV_SAMPLES_MAX];

/* Squares of pixels, spread over the view. */
static void place(const struct fv_view *view)
{
    for (int p = 0; p < PLACES * PLACES; p++) {
        float x = (float)(p % PLACES * (view->width - SIDE) / (PLACES - 1));
        float y = (float)(p / PLACES * (view->height - SIDE) / (PLACES - 1));
        samples[p].count = SIDE * SIDE;
        for (int i = 0; i < SIDE * SIDE; i++) {
            int block = i / 16; /* 4 x 4 pixels, as frames trace them */
            samples[p].x[i] = x + (float)(block % 8 * 4 + i % 4) + 0.5f;
            samples[p].y[i] = y + (float)(block / 8 * 4 + i % 16 / 4) + 0.5f;
        }
    }
}

/* CPU time of all samples once, ns a sample. */
static double trace(const struct fv_setup *setup, const struct fv_view *view, enum fv_variant variant)
{
    const struct fv_kernels *kernels = fv_kernels_for(setup->tracer.isa, variant);
    int64_t rays[FV_RAY_KINDS] = {0}, start_ns = fv_clock_thread_ns();
    for (int p = 0; p < PLACES * PLACES; p++) kernels->trace(&setup->tracer, view, &samples[p], 0, rays);
    return (double)(fv_clock_thread_ns() - start_ns) / (PLACES * PLACES * SIDE * SIDE);
}

static void keep(void)
{
    for (int p = 0; p < PLACES * PLACES; p++)
        for (int i = 0; i < SIDE * SIDE; i++) {
            first[p][0][i] = samples[p].red[i];
            first[p][1][i] = samples[p].green[i];
            first[p][2][i] = samples[p].blue[i];
        }
}

static void set_errors(struct fv_numeric_row *row)
{
    int n = 0;
    for (int p = 0; p < PLACES * PLACES; p++)
        for (int i = 0; i < SIDE * SIDE; i++)
            difference[n++] = (double)fmaxf(
                fmaxf(fabsf(first[p][0][i] - samples[p].red[i]), fabsf(first[p][1][i] - samples[p].green[i])),
                fabsf(first[p][2][i] - samples[p].blue[i]));
    fv_numerics_errors(row, difference, n);
}

void fv_experiment_variants(struct fv_setup *setup, struct fv_numerics *n)
{
    struct fv_view view;
    double least[FV_VARIANTS];
    enum fv_variant smallest = fv_variant_for(setup->scene.features);
    fv_numerics_view(setup, &view);
    if (view.width < SIDE || view.height < SIDE) return;
    place(&view);
    for (int k = 0; k < REPEATS && !fv_numerics_stopped(n); k++)
        for (int v = (int)smallest; v < FV_VARIANTS; v++) {
            if (!fv_variant_shows((enum fv_variant)v, setup->scene.features)) continue;
            double ns = trace(setup, &view, (enum fv_variant)v);
            least[v] = k ? fmin(least[v], ns) : ns;
        }
    for (int v = FV_VARIANTS - 1; v >= (int)smallest && !fv_numerics_stopped(n); v--) {
        if (!fv_variant_shows((enum fv_variant)v, setup->scene.features)) continue;
        struct fv_numeric_row *row =
            fv_numerics_add(n, "leaving out", fv_variants[v].name, "of radiance",
                            v == (int)smallest ? "what the plan chose" : "holds more than the scene");
        trace(setup, &view, (enum fv_variant)v);
        if (v == FV_VARIANTS - 1) keep();
        set_errors(row);
        row->cost = least[v];
        snprintf(row->cost_unit, sizeof row->cost_unit, "ns/sample");
    }
}
