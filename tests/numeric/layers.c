/* layers: the three layers of the method denoise (rt/pass/denoise_layers.c): areas and samples of Peres et al. 2023, Table 1,
 * exactly; by degrees; empty ones, one of a single pixel; shares of what is left out; when they are made anew. And frames with
 * them: no iterations, no paths, nothing sampled. */
#include "rt/pass/denoise.h"
#include "tests/support/stage.h"

static struct stage stage;

static void open_stage(const char *const *sets, int eyes, int width, int height)
{
    static const char *const always[] = {"scene.name=cornell", "method.name=denoise", NULL};
    struct fv_error error;
    struct stage *s = &stage;
    stage_set(s, 64, always, sets);
    s->config.display_eyes = eyes;
    s->config.display_width = width;
    s->config.display_height = height;
    if (fv_scene_load(&s->scene, &s->config, &error)) fail_msg("%s", error.text);
    stage_open(s, stage_workers());
}

/* The layers alone, no rays. */
static void distribute(double gaze_deg)
{
    struct fv_frame *f = &stage.loop.frame;
    struct fv_pose head = {{0, 1, 0}, {1, 0, 0, 0}};
    double gaze[3] = {sin(gaze_deg * M_PI / 180), 0, -cos(gaze_deg * M_PI / 180)};
    for (int e = 0; e < f->eyes; e++) fv_loop_view(&stage.loop, e, &head, gaze, &f->view[e]);
    stage.plan.method->parameters(&stage.config, 0, &f->parameters);
    fv_layers_begin(f);
    fv_pass_run(&fv_pass_distribute, f, stage_workers());
}

struct counts {
    long area[FV_LAYERS], sampled[FV_LAYERS], samples[FV_LAYERS];
};

static struct counts count(int eye)
{
    const struct fv_frame *f = &stage.loop.frame;
    const uint8_t *layer = f->buffer[FV_LAYER][eye];
    struct counts c = {{0}, {0}, {0}};
    for (int y = 0; y < f->height; y++)
        for (int x = 0; x < f->width; x++) {
            int of = layer[y * f->stride + x], n = of & FV_LAYER_NUMBER;
            assert_true(n < FV_LAYERS);
            c.area[n]++;
            c.sampled[n] += (of & FV_LAYER_SAMPLED) != 0;
            c.samples[n] += of & FV_LAYER_SAMPLED ? f->parameters.layer_spp[n] : 0;
        }
    return c;
}

static void areas_of_table_1(void **state)
{
    (void)state;
    static const struct {
        int width, height;
        const char *sets[3];
        struct counts want;
    } rows[] = {{960, 1080, {"denoise.inner_px=144", "denoise.outer_px=288"},
                 {{65144, 195432, 776224}, {65144, 195432, 776224}, {260576, 586296, 1552448}}},
                {1832, 1920, {"denoise.inner_px=265", "denoise.outer_px=530"},
                 {{220618, 661855, 2634967}, {220618, 661855, 2634967}, {882472, 1985565, 5269934}}}};
    for (int i = 0; i < 2; i++) {
        open_stage(rows[i].sets, 2, rows[i].width, rows[i].height);
        distribute(0);
        for (int e = 0; e < 2; e++) {
            struct counts c = count(e);
            for (int n = 0; n < FV_LAYERS; n++)
                print_message("%d x %d, eye %d, layer %d: %ld pixels, %ld samples\n", rows[i].width, rows[i].height, e, n, c.area[n], c.samples[n]);
            assert_memory_equal(&c, &rows[i].want, sizeof c);
        }
        stage_close(&stage);
    }
}

static void by_degrees(void **state)
{
    (void)state;
    static const char *const sets[] = {"fovea.inner_deg=8", "fovea.outer_deg=17", NULL};
    open_stage(sets, 1, 320, 256);
    for (double gaze_deg = -30; gaze_deg <= 30; gaze_deg += 15) {
        distribute(gaze_deg);
        const struct fv_frame *f = &stage.loop.frame;
        const uint8_t *layer = f->buffer[FV_LAYER][0], *of_tile = f->buffer[FV_TILE_LAYERS][0];
        for (int y = 0; y < f->height; y++)
            for (int x = 0; x < f->width; x++) {
                float e = stage_eccentricity(&stage, x, y);
                int n = layer[y * f->stride + x] & FV_LAYER_NUMBER;
                if (fabsf(e - 8) > 1e-3f && fabsf(e - 17) > 1e-3f && n != (e <= 8 ? 0 : e <= 17 ? 1 : 2)) fail_msg("%d, %d: %d at %g deg", x, y, n, (double)e);
                assert_true(of_tile[y / FV_TILE * f->tiles_x + x / FV_TILE] >> n & 1);
            }
    }
    stage_close(&stage);
}

static void shares(void **state)
{
    (void)state;
    static const char *const sets[] = {"fovea.inner_deg=10", "fovea.outer_deg=20", "denoise.p=0.5", NULL};
    open_stage(sets, 2, 480, 480);
    distribute(0);
    struct counts c = count(0), d = count(1);
    assert_true(c.sampled[0] == c.area[0]);
    print_message("middle: %.4f sampled, outer: %.4f\n", (double)c.sampled[1] / c.area[1], (double)c.sampled[2] / c.area[2]);
    assert_true(fabs((double)c.sampled[2] / c.area[2] - 0.5) < 0.01);
    assert_true((double)c.sampled[1] / c.area[1] > 0.65 && (double)c.sampled[1] / c.area[1] < 0.8);
    assert_true(labs(c.sampled[2] - d.sampled[2]) < c.area[2] / 100);
    /* Kept until something changes. */
    assert_true(stage.loop.frame.layers[0].fresh);
    distribute(0);
    assert_false(stage.loop.frame.layers[0].fresh);
    distribute(1);
    assert_true(stage.loop.frame.layers[0].fresh);
    stage.config.denoise_p = 1;
    distribute(1);
    c = count(0);
    assert_true(stage.loop.frame.layers[0].fresh && c.sampled[2] == 0 && c.sampled[0] == c.area[0]);
    stage_close(&stage);
}

/* Layers without pixels, and of one; whole frames of them show what others show, to noise. */
static void degenerate(void **state)
{
    (void)state;
    static const struct {
        const char *sets[6];
        int inner, most;
    } rows[] = {{{"fovea.inner_deg=0", "fovea.outer_deg=0", NULL}, 0, 1},
                {{"denoise.inner_px=0.5642", "denoise.outer_px=0.5642", NULL}, 1, 1},
                {{"fovea.inner_deg=180", "fovea.outer_deg=180", NULL}, 96 * 80, 96 * 80},
                {{"fovea.inner_deg=5", "fovea.outer_deg=5", "denoise.p=1", "denoise.iterations=5 5 5", NULL}, 1, 96 * 80},
                {{"denoise.spp=0 0 0", "denoise.iterations=0 0 0", NULL}, 1, 96 * 80},
                {{"denoise.spp=1 1 1", "denoise.iterations=0 0 0", NULL}, 1, 96 * 80}};
    for (unsigned i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        open_stage(rows[i].sets, 1, 96, 80);
        stage_frame(&stage, 0, 0, 0);
        struct counts c = count(0);
        if (c.area[0] < rows[i].inner || c.area[0] > rows[i].most) fail_msg("case %u: %ld pixels", i, c.area[0]);
        double sum = 0;
        for (int y = 0; y < 80; y++)
            for (int x = 0; x < 96; x++) sum += stage_row(&stage, y)[x] >> 10 & 1023;
        print_message("case %u: mean green %.1f\n", i, sum / (96 * 80));
        stage_close(&stage);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(areas_of_table_1), cmocka_unit_test(by_degrees), cmocka_unit_test(shares),
                                       cmocka_unit_test(degenerate)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
