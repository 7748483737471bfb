/* depth: see depth.h. Grids are traced by tiles of 32 x 32 points, in packets of 4 x 4. */
#include "rt/measure/depth.h"

#include "platform/arena.h"
#include "platform/clock.h"
#include "rt/pass/kernels.h"
#include "rt/trace/rays.h"

#include <math.h>
#include <string.h>

enum { TILE = 32, REPEATS = 5, BUCKETS = 1 << 15 };

static const int spacings[FV_DEPTH_SPACINGS] = {4, 8, 16};

extern const struct fv_depth_method fv_depth_methods_base[FV_DEPTH_METHODS];
#ifdef __x86_64__
extern const struct fv_depth_method fv_depth_methods_avx2[FV_DEPTH_METHODS],
    fv_depth_methods_avx512[FV_DEPTH_METHODS];
#endif

const struct fv_depth_method *fv_depth_methods(enum fv_isa isa)
{
    static const struct fv_depth_method *const table[FV_ISA_COUNT] = {
        [FV_ISA_BASE] = fv_depth_methods_base,
#ifdef __x86_64__
        [FV_ISA_AVX2] = fv_depth_methods_avx2,
        [FV_ISA_AVX512] = fv_depth_methods_avx512,
#endif
    };
    return table[isa];
}

/* Inverse depths of a grid of points, each in the middle of a cell of spacing x spacing pixels. */
struct grid {
    const struct fv_tracer *tracer;
    const struct fv_view *view;
    struct fv_samples *samples; /* of each worker */
    int width, height, spacing;
    int64_t stride;
    float *inverse_depth;
};

/* Where the i-th sample of a tile lies in it: packets of 4 x 4, row by row. */
static int column(int i)
{
    return i / 16 % (TILE / 4) * 4 + i % 4;
}

static int row_of(int i)
{
    return i / 16 / (TILE / 4) * 4 + i % 16 / 4;
}

static void trace_tile(void *context, int tile, int worker)
{
    const struct grid *g = context;
    struct fv_samples *s = &g->samples[worker];
    int across = (g->width + TILE - 1) / TILE, x0 = tile % across * TILE, y0 = tile / across * TILE;
    int64_t rays[FV_RAY_KINDS] = {0};
    s->count = TILE * TILE;
    for (int i = 0; i < s->count; i++) {
        s->x[i] = ((float)(x0 + column(i)) + 0.5f) * (float)g->spacing;
        s->y[i] = ((float)(y0 + row_of(i)) + 0.5f) * (float)g->spacing;
    }
    fv_kernels(g->tracer->isa)->trace(g->tracer, g->view, s, 0, rays);
    for (int i = 0; i < s->count; i++) {
        int x = x0 + column(i), y = y0 + row_of(i);
        if (x < g->width && y < g->height) g->inverse_depth[y * g->stride + x] = s->inverse_depth[i];
    }
}

static void trace_grid(struct grid *g, struct fv_workers *workers)
{
    int tiles = ((g->width + TILE - 1) / TILE) * ((g->height + TILE - 1) / TILE);
    fv_workers_run(workers, tiles, trace_tile, g);
}

/* The nodes are framed by copies of the outermost ones: `inverse_depth` points behind the frame. */
static void frame_nodes(const struct grid *g)
{
    for (int y = 0; y < g->height; y++) {
        float *row = g->inverse_depth + y * g->stride;
        row[-1] = row[0];
        row[g->width] = row[g->width - 1];
    }
    size_t bytes = (size_t)(g->width + 2) * sizeof(float);
    float *first = g->inverse_depth - 1, *last = first + (g->height - 1) * g->stride;
    memcpy(first - g->stride, first, bytes);
    memcpy(last + g->stride, last, bytes);
}

/* The pixels of row y, from half a cell left of the picture on, out of the framed nodes. */
static struct fv_depth_span span_at(const struct grid *nodes, int y, float *out)
{
    float at = ((float)y + 0.5f) / (float)nodes->spacing - 0.5f, above = floorf(at);
    const float *upper = nodes->inverse_depth - 1 + (int64_t)above * nodes->stride;
    return (struct fv_depth_span){.upper = upper, .lower = upper + nodes->stride, .down = at - above,
                                  .runs = nodes->width + 1, .spacing = nodes->spacing, .out = out};
}

/* Counts of errors by their upper 15 bits below the sign: 7 of the mantissa. */
static void count_errors(const float *guess, const float *exact, int n, uint32_t *bucket)
{
    for (int i = 0; i < n; i++) {
        uint32_t bits;
        if (!(exact[i] > 0)) continue;
        float error = fabsf(guess[i] - exact[i]) / fmaxf(guess[i], exact[i]);
        memcpy(&bits, &error, sizeof bits);
        bucket[bits >> 16 & (BUCKETS - 1)]++;
    }
}

static double percentile(const uint32_t *bucket, double part)
{
    int64_t total = 0, below = 0;
    int at = 0;
    float value;
    for (int i = 0; i < BUCKETS; i++) total += bucket[i];
    if (total == 0) return NAN;
    int64_t wanted = (int64_t)(part * (double)(total - 1));
    while ((below += bucket[at]) <= wanted) at++;
    uint32_t bits = at ? (uint32_t)at << 16 | 0x8000 : 0;
    memcpy(&value, &bits, sizeof value);
    return fmin((double)value, 1);
}

/* One method at one spacing over the whole picture. */
static void measure(const struct fv_depth_method *method, const struct grid *exact, const struct grid *nodes,
                    float *line, uint32_t *bucket, struct fv_depth_row *out)
{
    int64_t least_ns = INT64_MAX;
    memset(bucket, 0, BUCKETS * sizeof *bucket);
    for (int k = 0; k < REPEATS; k++) {
        int64_t start_ns = fv_clock_thread_ns();
        for (int y = 0; y < exact->height; y++) {
            struct fv_depth_span span = span_at(nodes, y, line);
            method->row(&span);
        }
        int64_t ns = fv_clock_thread_ns() - start_ns;
        if (ns < least_ns) least_ns = ns;
    }
    for (int y = 0; y < exact->height; y++) {
        struct fv_depth_span span = span_at(nodes, y, line);
        method->row(&span);
        const float *pixels = exact->inverse_depth + y * exact->stride;
        count_errors(line + nodes->spacing / 2, pixels, exact->width, bucket);
    }
    *out = (struct fv_depth_row){.method = method->name, .spacing = nodes->spacing,
                                 .error_p50 = percentile(bucket, 0.5), .error_p95 = percentile(bucket, 0.95),
                                 .ns_pixel = (double)least_ns / ((double)exact->width * exact->height)};
}

static void *take(size_t bytes)
{
    return fv_arena_take(fv_arena(), "depth measurement", bytes, 64);
}

int fv_depth_measure(const struct fv_tracer *tracer, const struct fv_view *view, struct fv_workers *workers,
                     struct fv_depth_row row[FV_DEPTH_ROWS], const volatile int *stopped)
{
    const struct fv_depth_method *methods = fv_depth_methods(tracer->isa);
    struct fv_samples *samples = take((size_t)workers->count * sizeof *samples);
    struct grid exact = {tracer, view, samples, view->width, view->height, 1, view->width, NULL};
    struct grid nodes = exact;
    size_t most = (size_t)(view->width / spacings[0] + 3) * (size_t)(view->height / spacings[0] + 3);
    float *node = take(most * sizeof *node), *line = take((size_t)(view->width + 64) * sizeof *line);
    uint32_t *bucket = take(BUCKETS * sizeof *bucket);
    int rows = 0;
    exact.inverse_depth = take((size_t)view->width * (size_t)view->height * sizeof(float));
    trace_grid(&exact, workers);
    for (int s = 0; s < FV_DEPTH_SPACINGS; s++) {
        nodes.spacing = spacings[s];
        nodes.width = (view->width + spacings[s] - 1) / spacings[s];
        nodes.height = (view->height + spacings[s] - 1) / spacings[s];
        nodes.stride = nodes.width + 2;
        nodes.inverse_depth = node + nodes.stride + 1;
        trace_grid(&nodes, workers);
        frame_nodes(&nodes);
        for (int m = 0; m < FV_DEPTH_METHODS; m++) {
            if (stopped && *stopped) return rows;
            measure(&methods[m], &exact, &nodes, line, bucket, &row[rows++]);
        }
    }
    return rows;
}
