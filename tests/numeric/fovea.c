/* fovea: the foveal function, the selection of blocks by it, and the thresholds it is compared with, at
 * settings where nothing is left between r0 and r1, no peripheral sample or no other one, and at frame
 * numbers at which 32, 53 and 63 bits end. */
#include "rt/pass/pass.h"
#include "rt/trace/tracer.h"
#include "tests/support/program.h"
#include "tests/support/random.h"

#include <float.h>

#define COUNT(table) (sizeof table / sizeof table[0])

static void foveal_function(void **state)
{
    (void)state;
    static const struct {
        struct fv_foveal f;
        float e, p;
    } table[] = {
        /* r1 = r0, r1 < r0: a step at r0 */
        {{10, 10, 0.2f}, 10, 1},
        {{10, 10, 0.2f}, 10.000001f, 0.2f},
        {{20, 10, 0.1f}, 15, 1},
        {{20, 10, 0.1f}, 20, 1},
        {{20, 10, 0.1f}, 20.00001f, 0.1f},
        /* as near to a step as floats are */
        {{10, 10.000001f, 0}, 10, 1},
        {{10, 10.000001f, 0}, 10.000001f, 0},
        /* r0 = 0 */
        {{0, 0, 0}, 0, 1},
        {{0, 0, 0}, FLT_TRUE_MIN, 0},
        {{0, 0, 0}, 180, 0},
        {{0, 20, 0}, 10, 0.5f},
        {{0, FLT_TRUE_MIN, 0}, 0, 1},
        {{0, FLT_TRUE_MIN, 0}, FLT_TRUE_MIN, 0},
        /* r0 = 180 */
        {{180, 180, 0}, 180, 1},
        {{180, 180, 0}, 179, 1},
        {{0, 180, 0}, 180, 0},
        {{0, 180, 0}, 90, 0.5f},
        {{179, 199, 0.1f}, 180, 0.955f},
        /* p_min = 0 and 1 */
        {{10, 20, 0}, 15, 0.5f},
        {{10, 20, 0}, 20, 0},
        {{10, 20, 1}, 15, 1},
        {{0, 0, 1}, 90, 1},
        {{10, 20, FLT_TRUE_MIN}, 90, FLT_TRUE_MIN},
        /* not a number, not finite, outside 0 to 180 */
        {{10, 20, 0}, NAN, 1},
        {{0, 0, 0}, NAN, 1},
        {{10, 20, 0.05f}, INFINITY, 0.05f},
        {{10, 20, 0.05f}, -INFINITY, 1},
        {{10, 20, 0.05f}, -1, 1},
        {{INFINITY, INFINITY, 0}, 180, 1},
        {{10, INFINITY, 0}, 180, 1},
        {{1e30f, 2e30f, 0}, 180, 1},
    };
    for (unsigned i = 0; i < COUNT(table); i++) {
        float p = fv_foveal_probability(&table[i].f, table[i].e);
        if (!(fabsf(p - table[i].p) <= 1e-6f * table[i].p))
            fail_msg("row %u: %g, not %g", i, (double)p, (double)table[i].p);
    }
}

/* Random settings: within [p_min, 1], never growing with eccentricity, and the formula's value. */
static void within_bounds_and_monotone(void **state)
{
    (void)state;
    uint64_t random = 9;
    double worst = 0;
    for (int n = 0; n < 1000000; n++) {
        float r0 = (float)random_between(&random, 0, 180),
              r1 = n % 4 ? r0 + (float)random_decade(&random, 1e-6, 180)
                         : (float)random_between(&random, 0, 180);
        float p_min = n % 5 ? (float)random_between(&random, 0, 1) : (float)random_decade(&random, 1e-40, 1);
        struct fv_foveal f = {r0, r1, p_min};
        float e = (float)random_between(&random, -1, 181), next = nextafterf(e, INFINITY);
        if (n % 3 == 0) e = nextafterf(r1, -INFINITY), next = r1;
        if (n % 3 == 1 && r1 > r0) e = (float)random_between(&random, r0, r1), next = e + (r1 - e) * 0.5f;
        float p = fv_foveal_probability(&f, e), q = fv_foveal_probability(&f, next);
        if (!(p >= p_min && p <= 1 && q <= p && q >= p_min))
            fail_msg("r0 %.9g, r1 %.9g, p_min %.9g: %.9g at %.9g, %.9g at %.9g", (double)r0, (double)r1,
                     (double)p_min, (double)p, (double)e, (double)q, (double)next);
        if (!(e > r0 && e < r1)) continue;
        long double exact = 1 - ((long double)e - r0) / ((long double)r1 - r0) * (1 - (long double)p_min);
        worst = fmax(worst, fabs((double)(p - exact)));
    }
    print_message("foveal function: off by at most %.1e\n", worst);
    assert_true(worst < 4 * 0x1p-24);
}

enum { WIDTH = 203, HEIGHT = 150, TILES_MAX = 64 };
static uint64_t selected[TILES_MAX];

static void frame_of(struct fv_frame *f, struct fv_tracer *tracer, double half_deg, const double gaze[3],
                     struct fv_foveal foveal)
{
    double t = tan(half_deg * M_PI / 180);
    struct fv_lens lens = {t, t, t * 0.7, t * 0.7, WIDTH, HEIGHT};
    struct fv_pose pose = {{0, 0, 0}, {0.6, 0, 0.8, 0}};
    memset(f, 0, sizeof *f);
    f->noise = fv_noise();
    f->tracer = tracer;
    f->eyes = 1, f->width = WIDTH, f->height = HEIGHT;
    f->tiles_x = (WIDTH + FV_TILE - 1) / FV_TILE, f->tiles_y = (HEIGHT + FV_TILE - 1) / FV_TILE;
    f->tiles = f->tiles_x * f->tiles_y;
    f->has_history = true;
    f->parameters.foveal = foveal;
    f->buffer[FV_SELECTED][0] = selected;
    fv_view_set(&f->view[0], &lens, &pose, gaze);
}

/* Least eccentricity of the pixels' centres of a block. */
static float nearest_deg(const struct fv_frame *f, const struct fv_tile *tile, int block)
{
    float least = 1000;
    for (int i = 0; i < 16; i++)
        least =
            fminf(least, fv_eccentricity_deg(&f->view[0], (float)(tile->x0 + block % 8 * 4 + i % 4) + 0.5f,
                                             (float)(tile->y0 + block / 8 * 4 + i / 4) + 0.5f));
    return least;
}

static int check_selection(struct fv_frame *f, const char *what)
{
    int blocks = 0;
    for (int n = 0; n < f->tiles; n++) {
        struct fv_tile tile = {.index = n, .x0 = n % f->tiles_x * FV_TILE, .y0 = n / f->tiles_x * FV_TILE};
        fv_pass_select.run(f, &tile);
        uint64_t inside = fv_tile_inside(f, &tile);
        if (selected[n] & ~inside) fail_msg("%s: tile %d: blocks outside the picture", what, n);
        for (int block = 0; block < 64; block++) {
            if (!(inside >> block & 1)) continue;
            const struct fv_foveal *v = &f->parameters.foveal;
            bool is = selected[n] >> block & 1;
            float e = fv_tile_eccentricity_deg(f, &tile, block),
                  threshold = fv_tile_threshold(f, &tile, block);
            /* At its centre at least, at its nearest corner at most; whole where a pixel lies within r0. */
            bool must = threshold < fv_foveal_probability(v, e) || nearest_deg(f, &tile, block) <= v->r0_deg;
            bool may = threshold < fv_foveal_probability(v, e - 2.9f * f->view[0].pixel_deg);
            if (is ? !may : must)
                fail_msg("%s, frame %lld: tile %d, block %d at %g degrees, threshold %g: %s", what,
                         (long long)f->number, n, block, (double)e, (double)threshold,
                         is ? "selected" : "not selected");
            blocks += is;
        }
    }
    return blocks;
}

static void selection(void **state)
{
    (void)state;
    enum { SOME, ALL, SPOT }; /* what is to be selected */
    static const struct {
        const char *what;
        struct fv_foveal f;
        int expected;
    } table[] = {
        {"usual", {10, 20, 0.05f}, SOME},
        {"r1 = r0", {15, 15, 0.05f}, SOME},
        {"r1 < r0", {20, 5, 0.1f}, SOME},
        {"r1 < r0, p_min 0", {20, 0, 0}, SOME},
        {"r0 0", {0, 20, 0.05f}, SOME},
        {"r0 0, p_min 0", {0, 20, 0}, SOME},
        {"r0 r1 p_min 0", {0, 0, 0}, SPOT},
        {"r0 r1 0, p_min tiny", {0, 0, 1e-8f}, SPOT},
        {"r0 r1 0, p_min 1", {0, 0, 1}, ALL},
        {"p_min 1", {10, 20, 1}, ALL},
        {"p_min below 1", {0, 0, 0.99999994f}, ALL},
        {"r0 180, p_min 0", {180, 180, 0}, ALL},
        {"r0 0, r1 180", {0, 180, 0}, SOME},
        {"r0 infinite", {INFINITY, INFINITY, 0}, ALL},
        {"p_min 0.5", {0, 0, 0.5f}, SOME},
        {"steep", {12, 12.001f, 0.01f}, SOME},
    };
    static const double halves[] = {0.5, 30, 87.5};
    static const double gazes[][3] = {{0, 0, -1},         {0.2, -0.1, -0.97}, {0.99, 0, -0.1},
                                      {-0.6, 0.8, -1e-9}, {0, 0, 1},          {NAN, 0, 0}};
    static const int64_t frames[] = {0,         1, INT64_C(1) << 31, INT64_C(1) << 32, INT64_C(1) << 53,
                                     INT64_MAX, -1};
    static struct fv_frame f;
    static struct fv_tracer tracer;
    for (unsigned i = 0; i < COUNT(table); i++)
        for (unsigned k = 0; k < COUNT(halves) * COUNT(gazes); k++) {
            frame_of(&f, &tracer, halves[k / COUNT(gazes)], gazes[k % COUNT(gazes)], table[i].f);
            int all = (WIDTH + 3) / 4 * ((HEIGHT + 3) / 4), first = -1;
            for (unsigned n = 0; n < COUNT(frames); n++) {
                f.number = frames[n];
                int blocks = check_selection(&f, table[i].what);
                if (frames[n] == 0) first = blocks;
                if (frames[n] == INT64_C(1) << 32)
                    assert_int_equal(blocks, first); /* the period of the thresholds */
                if (table[i].expected == ALL) assert_int_equal(blocks, all);
                /* At 87.5 degrees a block spans up to 50: what r0 may touch is more. */
                if (table[i].expected == SPOT && k < 2 * COUNT(gazes)) assert_in_range(blocks, 0, 9);
            }
            f.has_history = false; /* nothing to fill from: everything */
            struct fv_tile tile = {.index = 0};
            fv_pass_select.run(&f, &tile);
            assert_true(selected[0] == ~UINT64_C(0));
        }
}

/* A view that is not finite hides nothing: what cannot be judged is sampled. */
static void poisoned_view(void **state)
{
    (void)state;
    static struct fv_frame f;
    static struct fv_tracer tracer;
    const double ahead[3] = {0, 0, -1};
    frame_of(&f, &tracer, 40, ahead, (struct fv_foveal){0, 0, 0});
    f.view[0].gaze[1] = NAN;
    for (int n = 0; n < f.tiles; n++) {
        struct fv_tile tile = {.index = n, .x0 = n % f.tiles_x * FV_TILE, .y0 = n / f.tiles_x * FV_TILE};
        fv_pass_select.run(&f, &tile);
        assert_true(selected[n] == fv_tile_inside(&f, &tile));
    }
}

static int by_size(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/* Each cell's thresholds over 4096 frames, wherever those begin: in [0, 1), their mean 1/2, and no gap
 * between neighbours above 1.9 times the mean one, the bound of the golden ratio's sequence (1 + 2 /
 * sqrt 5: the three-gap theorem). */
static void thresholds_are_spread_evenly(void **state)
{
    (void)state;
    enum { FRAMES = 4096 };
    static const int64_t starts[] = {0,
                                     INT32_MAX - 2048,
                                     UINT32_MAX - INT64_C(2048),
                                     (INT64_C(1) << 53) - 2048,
                                     INT64_MAX - FRAMES + 1,
                                     INT64_MIN,
                                     -2048};
    static float value[FRAMES + 1];
    const float *mask = fv_noise();
    double worst_mean = 0, worst_gap = 0;
    for (unsigned s = 0; s < COUNT(starts); s++)
        for (int cell = 0; cell < 4096; cell++) {
            double sum = 0;
            for (int n = 0; n < FRAMES; n++) {
                value[n] = fv_noise_threshold(mask, cell % 64, cell / 64, starts[s] + n);
                if (!(value[n] >= 0 && value[n] < 1))
                    fail_msg("cell %d, frame %lld: %g", cell, (long long)starts[s] + n, (double)value[n]);
                sum += (double)value[n];
            }
            worst_mean = fmax(worst_mean, fabs(sum / FRAMES - 0.5));
            if (cell % 97) continue; /* the others' are the same, turned */
            qsort(value, FRAMES, sizeof value[0], by_size);
            value[FRAMES] = value[0] + 1;
            for (int n = 0; n < FRAMES; n++)
                worst_gap = fmax(worst_gap, (double)(value[n + 1] - value[n]) * FRAMES);
        }
    print_message("thresholds: mean off by at most %.1e, greatest gap %.3f mean ones\n", worst_mean,
                  worst_gap);
    assert_true(worst_mean < 2.0 / FRAMES && worst_gap < 1.9);
}

/* Cells are looked up on a torus, with negative numbers too. */
static void thresholds_repeat(void **state)
{
    (void)state;
    static const int cells[][2] = {{-1, 63},       {-64, 0},        {64, 0},
                                   {INT32_MIN, 0}, {INT32_MAX, 63}, {1000000, 0}};
    for (unsigned i = 0; i < COUNT(cells); i++)
        for (int y = 0; y < 64; y++) {
            assert_true(fv_noise_threshold(fv_noise(), cells[i][0], y, 7) ==
                        fv_noise_threshold(fv_noise(), cells[i][1], y, 7));
            assert_true(fv_noise_threshold(fv_noise(), y, cells[i][0], -7) ==
                        fv_noise_threshold(fv_noise(), y, cells[i][1], -7));
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(foveal_function),
                                       cmocka_unit_test(within_bounds_and_monotone),
                                       cmocka_unit_test(selection),
                                       cmocka_unit_test(poisoned_view),
                                       cmocka_unit_test(thresholds_are_spread_evenly),
                                       cmocka_unit_test(thresholds_repeat)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
