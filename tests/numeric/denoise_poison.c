/* denoise_poison: NaN, infinities, huge numbers and denormals put into one pixel of what the passes of denoise hand to each other.
 * Beyond the filter's reach nothing changes at all; within, what is no light (depth, normal, variance, albedo) changes neighbours by no
 * more than one sample among them weighs; and nothing is left of it when its source is traced again. */
#include "rt/pass/denoise.h"
#include "tests/support/stage.h"

enum { SIDE = 96, STEPS = 4 + 2 + 1, REACH = 2 * STEPS + 2 }; /* of iterations 3 and of fill */

static const uint32_t odd_bits[] = {0x7fc00000, 0xffc00000, 0x7f800001, 0x7f800000, 0xff800000, 0x7f7fffff, 0xff7fffff, 0x00000001,
                                    0x80000001, 0x80000000, 0xbf800000, 0xffffffff, 0xff00ff00, 0xfeffff00, 0x0000ff00};
enum { ODD = sizeof odd_bits / sizeof *odd_bits };

static struct stage stage;
static uint32_t clean[SIDE][SIDE];

static void take(uint32_t to[SIDE][SIDE])
{
    for (int y = 0; y < SIDE; y++) memcpy(to[y], stage_row(&stage, y), sizeof to[y]);
}

/* Passes from paths on, with one word of a plane set after it. `plane` FV_BUFFERS: none. */
static void render(enum fv_buffer plane, int x, int y, uint32_t bits)
{
    struct fv_frame *f = &stage.loop.frame;
    bool on = false;
    for (int i = 0; i < stage.plan.passes; i++) {
        on |= strcmp(stage.plan.pass[i]->name, "paths") == 0;
        if (!on) continue;
        fv_pass_run(stage.plan.pass[i], f, stage_workers());
        if (strcmp(stage.plan.pass[i]->name, "paths") == 0 && plane < FV_BUFFERS) ((uint32_t *)f->buffer[plane][0])[y * f->stride + x] = bits;
    }
}

static void open_stage(const char *const *sets)
{
    static const char *const always[] = {"scene.name=cornell", "method.name=denoise", "denoise.iterations=3 3 3", "denoise.spp=2 1 1", NULL};
    stage_begin(&stage, SIDE, always, sets, stage_workers());
    stage_frame(&stage, 0, 0, 0);
    render(FV_BUFFERS, 0, 0, 0);
    take(clean);
}

/* The largest step within reach but for the pixel itself. */
static int check_reach(const char *what, int x, int y, uint32_t bits)
{
    int most = 0;
    for (int v = 0; v < SIDE; v++)
        for (int u = 0; u < SIDE; u++) {
            int step = stage_step(clean[v][u], stage_row(&stage, v)[u]);
            bool within = abs(u - x) <= REACH && abs(v - y) <= REACH;
            if (step && !within) fail_msg("%s, %08x at (%d, %d): (%d, %d) differs by %d", what, bits, x, y, u, v, step);
            if (within && (u != x || v != y) && step > most) most = step;
        }
    return most;
}

static void stays_within_reach(const char *const *sets)
{
    static const struct {
        enum fv_buffer plane;
        const char *name;
        int most; /* codes that neighbours may change by */
    } planes[] = {{FV_LIGHT, "light", 1023}, {FV_DEPTH, "depth", 120}, {FV_FACING, "facing", 120}, {FV_VARIANCE, "variance", 120},
                  {FV_ALBEDO, "albedo", 0},  {FV_COLOUR, "colour", 0}};
    static const int places[][2] = {{48, 48}, {20, 70}, {0, 0}, {95, 95}, {63, 32}};
    open_stage(sets);
    for (unsigned p = 0; p < sizeof planes / sizeof *planes; p++) {
        int most = 0;
        if (!stage.loop.frame.buffer[planes[p].plane][0]) continue;
        for (int i = 0; i < 5; i++)
            for (int k = 0; k < ODD; k++) {
                render(planes[p].plane, places[i][0], places[i][1], odd_bits[k]);
                int step = check_reach(planes[p].name, places[i][0], places[i][1], odd_bits[k]);
                if (step > planes[p].most) fail_msg("%s, %08x at (%d, %d): neighbours change by %d of 1023", planes[p].name, odd_bits[k], places[i][0], places[i][1], step);
                most = step > most ? step : most;
            }
        print_message("%s: neighbours change by %d of 1023 at most\n", planes[p].name, most);
    }
    render(FV_BUFFERS, 0, 0, 0);
    for (int y = 0; y < SIDE; y++) assert_memory_equal(clean[y], stage_row(&stage, y), sizeof clean[y]);
    stage_close(&stage);
}

static void guided(void **state)
{
    (void)state;
    stays_within_reach((const char *const[]){NULL});
}

static void by_light_itself(void **state)
{
    (void)state;
    stays_within_reach((const char *const[]){"denoise.deviations=0", NULL});
}

static void with_holes(void **state)
{
    (void)state;
    stays_within_reach((const char *const[]){"denoise.p=0.5", "fovea.inner_deg=3", "fovea.outer_deg=6", NULL});
}

/* Sigmas of 0, where only what is equal counts, and of no bound: pictures of codes that are there, and not black. */
static void sigmas_without_bounds(void **state)
{
    (void)state;
    static const char *const all[][4] = {{"denoise.deviations=1e6", NULL},
                                         {"denoise.deviations=1e-6", NULL},
                                         {"denoise.deviations=0", "denoise.sigma_light=0", "denoise.sigma_normal=0", NULL},
                                         {"denoise.sigma_position=0", "denoise.p=1", NULL}};
    for (unsigned i = 0; i < sizeof all / sizeof *all; i++) {
        open_stage(all[i]);
        double sum = 0;
        for (int y = 0; y < SIDE; y++)
            for (int x = 0; x < SIDE; x++) sum += (clean[y][x] >> 10 & 1023) / (double)(SIDE * SIDE);
        print_message("case %u: mean green %.1f\n", i, sum);
        assert_true(sum > 50 && sum < 700);
        stage_close(&stage);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(guided), cmocka_unit_test(by_light_itself), cmocka_unit_test(with_holes),
                                       cmocka_unit_test(sigmas_without_bounds)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
