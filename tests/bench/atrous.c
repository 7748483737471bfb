/* atrous: iterations of the a-trous filter against copying the bytes that they touch: a pass reads 12 bytes a pixel and writes
 * 4, so 16 are copied for each pass; two of an iteration in passes across and down, one of a full one. The eye of the Full HD
 * pair (960 x 1080), every instruction set, steps 1 to 16, as whole rows and columns and tile by tile. Filter and copy take
 * turns on two threads; CPU time of both, medians. Printed as a table; its last column is against moving no more bytes than the
 * filter, reading and writing together, half of that copy. */
#include "platform/clock.h"
#include "platform/heap.h"
#include "platform/threads.h"
#include "rt/measure/rank.h"
#include "rt/pass/atrous.h"
#include "rt/pass/kernels.h"
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include "tests/support/random.h"


enum { WIDTH = 960, HEIGHT = 1080, STRIDE = WIDTH, PIXELS = STRIDE * HEIGHT, ROUNDS = 9, BYTES = 16, PARTS = 2 };

static _Alignas(64) uint32_t light[PIXELS], between[PIXELS], filtered[PIXELS], facing[PIXELS];
static _Alignas(64) float inverse_depth[PIXELS], variance[2][PIXELS];
static _Alignas(64) char from[(size_t)PIXELS * BYTES], to[(size_t)PIXELS * BYTES];
static struct fv_view view;

/* A floor below and a wall ahead, dimly lit, and noise. */
static void make_up(const struct fv_kernels *k)
{
    static _Alignas(64) float rgb[3][WIDTH];
    uint64_t random = 3;
    struct fv_lens lens = {1, 1, 1.125, 1.125, WIDTH, HEIGHT};
    struct fv_pose pose = {.rotation = {1, 0, 0, 0}};
    fv_view_set(&view, &lens, &pose, (const double[3]){0, 0, -1});
    for (int y = 0; y < HEIGHT; y++) {
        float below = (float)(y - HEIGHT / 2) / (HEIGHT / 2) * 1.125f / 1.6f;
        bool floor = below > 1 / 12.0f;
        for (int x = 0; x < WIDTH; x++) {
            inverse_depth[y * STRIDE + x] = floor ? below : 1 / 12.0f;
            facing[y * STRIDE + x] = floor ? 511u | 1022u << 10 | 511u << 20 : 511u | 511u << 10 | 1022u << 20;
            variance[0][y * STRIDE + x] = 0.1f;
            for (int c = 0; c < 3; c++) rgb[c][x] = (float)random_decade(&random, 0.05, 2);
        }
        k->pack_light(rgb[0], rgb[1], rgb[2], 1, light + y * STRIDE, WIDTH);
    }
}

static struct fv_workers workers;

struct way {
    const char *name;
    enum fv_atrous_taps taps[2];
    int passes, across[2], down[2]; /* how large the rectangles are, by pass */
    bool varies;
};

static const struct way ways[] = {
    {"two passes, rows and columns", {FV_ATROUS_ACROSS, FV_ATROUS_DOWN}, 2, {WIDTH, 96}, {32, HEIGHT}, false},
    {"the same by variance", {FV_ATROUS_ACROSS, FV_ATROUS_DOWN}, 2, {WIDTH, 96}, {32, HEIGHT}, true},
    {"two passes, tiles", {FV_ATROUS_ACROSS, FV_ATROUS_DOWN}, 2, {32, 32}, {32, 32}, false},
    {"25 pixels, columns", {FV_ATROUS_FULL}, 1, {96}, {HEIGHT}, false},
};

struct job {
    const struct fv_kernels *kernels;
    const struct way *way;
    struct fv_atrous pass;
    int across, down; /* of the pass */
    int64_t ns[FV_WORKERS_MAX];
};

static void filter_rectangle(void *context, int index, int worker)
{
    struct job *j = context;
    int64_t start_ns = fv_clock_thread_ns();
    int columns = (WIDTH + j->across - 1) / j->across;
    struct fv_atrous a = j->pass;
    a.x = index % columns * j->across, a.y = index / columns * j->down;
    a.columns = WIDTH - a.x < j->across ? WIDTH - a.x : j->across;
    a.rows = HEIGHT - a.y < j->down ? HEIGHT - a.y : j->down;
    j->kernels->atrous(&a);
    j->ns[worker] += fv_clock_thread_ns() - start_ns;
}

static void copy_part(void *context, int index, int worker)
{
    struct job *j = context;
    int64_t start_ns = fv_clock_thread_ns();
    size_t part = sizeof to / PARTS;
    memcpy(to + (size_t)index * part, from + (size_t)index * part, part);
    j->ns[worker] += fv_clock_thread_ns() - start_ns;
}

static double ms_of(const struct job *j)
{
    int64_t ns = 0;
    for (int w = 0; w < workers.count; w++) ns += j->ns[w];
    return (double)ns * 1e-6;
}

static double filter_ms(const struct fv_kernels *k, const struct way *way, int step)
{
    struct job j = {.kernels = k, .way = way};
    j.pass = (struct fv_atrous){.step = step, .width = WIDTH, .height = HEIGHT, .stride = STRIDE, .view = &view, .inverse_depth = inverse_depth,
                                .facing = facing, .sigma_light = 1, .sigma_normal = 0.3f, .sigma_position = 1};
    for (int p = 0; p < way->passes; p++) {
        j.pass.taps = way->taps[p];
        j.pass.light = p ? between : light, j.pass.filtered = p + 1 < way->passes ? between : filtered;
        if (way->varies) j.pass.variance = variance[p], j.pass.filtered_variance = variance[1 - p];
        j.across = way->across[p], j.down = way->down[p];
        int columns = (WIDTH + j.across - 1) / j.across, rows = (HEIGHT + j.down - 1) / j.down;
        fv_workers_run(&workers, columns * rows, filter_rectangle, &j);
    }
    return ms_of(&j);
}

static double copy_ms(int passes)
{
    struct job j = {0};
    for (int p = 0; p < passes; p++) fv_workers_run(&workers, PARTS, copy_part, &j);
    return ms_of(&j);
}

static void measure(const struct fv_kernels *k, const char *isa, const struct way *way, int step)
{
    double ms[ROUNDS], copy[ROUNDS], ratio[ROUNDS], megapixels = PIXELS * 1e-6;
    filter_ms(k, way, step);
    copy_ms(1);
    for (int i = 0; i < ROUNDS; i++) {
        ms[i] = filter_ms(k, way, step), copy[i] = copy_ms(way->passes);
        ratio[i] = ms[i] / copy[i];
        from[i] = to[i + 1];
    }
    fv_rank_sort(ms, ROUNDS), fv_rank_sort(copy, ROUNDS), fv_rank_sort(ratio, ROUNDS);
    print_message("| %s | %s | %d | %.2f | %.2f | %.2f | %.2f |\n", isa, way->name, step, ms[ROUNDS / 2] / megapixels, copy[ROUNDS / 2] / megapixels, ratio[ROUNDS / 2],
                  2 * ratio[ROUNDS / 2]);
}

static void table(void **state)
{
    (void)state;
    static const char *const names[FV_ISA_COUNT] = {[FV_ISA_BASE] = "base", [FV_ISA_AVX2] = "avx2", [FV_ISA_AVX512] = "avx512"};
    memset(from, 1, sizeof from);
    make_up(fv_kernels(FV_ISA_BASE));
    print_message("| instructions | filter | step | ms a megapixel | copy | ratio | over moving as many |\n| --- | --- | --- | --- | --- | --- | --- |\n");
    for (int isa = (int)fv_cpu_isa(); isa >= 0; isa--)
        for (unsigned w = 0; w < sizeof ways / sizeof ways[0]; w++)
            for (int step = 1; step <= 16; step *= 4) measure(fv_kernels((enum fv_isa)isa), names[isa], &ways[w], step);
    assert_int_equal(fv_heap_calls(), 0);
}

static int start_workers(void **state)
{
    (void)state;
    return fv_workers_start(&workers, 2) < 1;
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(table)};
    return cmocka_run_group_tests(tests, start_workers, NULL);
}
