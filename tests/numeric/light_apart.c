/* light_apart: sampled light that reproject keeps and blends apart from the rest: the picture is that of light
 * blended with the rest, whether tiles are fine or coarse and whatever moves; where nothing moves it converges; what
 * the light is worth is counted; and a new beginning knows nothing of it. */
#include "tests/support/stage.h"

enum { SIDE = 160, EARLY = 2, SETS = 5 };

static struct fv_workers workers;
static struct stage reference, foveated;

/* Both lists end with NULL; later settings win. */
static void open_stage(struct stage *s, const char *method, int side, const char *const *sets, const char *const *more)
{
    const char *all[16] = {"scene.name=cornell", "fovea.inner_deg=8", "fovea.outer_deg=16", "method.density_deg=181", "display.sink=png", method};
    for (int n = 6; *sets; sets++) all[n++] = *sets;
    struct fv_error error;
    stage_set(s, side, all, more);
    s->config.display_fov_in_deg = 47.5, s->config.display_fov_out_deg = 46.6;
    s->config.display_fov_up_deg = s->config.display_fov_down_deg = 53;
    if (fv_scene_load(&s->scene, &s->config, &error)) fail_msg("%s", error.text);
    stage_open(s, &workers);
}

static void render(struct stage *s, double step, int frame)
{
    struct fv_pose head = {{0.002 * step * frame, 1.35, 2.05}, {1, 0, 0, 0}};
    fv_quat_from_yaw_pitch_roll(0.004 * step * frame, 0, 0, head.rotation);
    stage_frame_from(s, &head, 5.8, frame * 13333333ll);
    fv_pass_run(&fv_pass_present, &s->loop.frame, &workers);
}

/* Of the pictures, in which light and the rest have come together. */
static double psnr(const struct stage *a, const struct stage *b)
{
    const uint8_t *p = a->loop.frame.buffer[FV_PICTURE][0], *q = b->loop.frame.buffer[FV_PICTURE][0];
    double sum = 1e-3, side = a->loop.frame.width;
    for (int y = 0; y < side; y++)
        for (int x = 0; x < side; x++)
            for (int c = 0; c < 3; c++) {
                int64_t at = 4 * (y * a->loop.frame.stride + x) + c;
                sum += pow((double)p[at] - (double)q[at], 2);
            }
    return 10 * log10(255 * 255 * 3 * side * side / sum);
}

static const struct setup {
    const char *what, *sets[SETS + 1];
    double step; /* of the head */
    int last;    /* frame */
    double least, gain; /* PSNR of the last frame, dB, and how much more at least than that of an early one */
} setups[] = {
    {"nothing moves", {NULL}, 0, 60, 30.5, 0.3},
    {"the same, ambient occlusion", {"method.ao_spp=4", "method.ao_radius=0.5"}, 0, 60, 29, 0.2},
    {"the head moves", {NULL}, 1, 16, 28.5, -9},
    {"the same, ambient occlusion", {"method.ao_spp=4", "method.ao_radius=0.5"}, 3, 16, 28, -9},
    {"coarse tiles", {"fovea.inner_deg=3", "fovea.outer_deg=5", "method.density_deg=0"}, 1, 16, 26, -9},
    {"an object moves", {"scene.moving=box 0.4 0.4 0.4 at -0.5 0.9 0.4 0 at 0.7 0.9 0.4 40 in 1"}, 1, 16, 26, -9},
    {"the paper's way",
     {"method.support=4", "method.support_samples=add", "method.history=drop", "method.history_filter=linear",
      "method.resample=1e6"}, 1, 16, 27, -9},
};

/* PSNR of an early frame and the last one against many samples. */
static void judge(const struct setup *s, const char *light, double out[2])
{
    const char *const many[] = {"method.spp=9", "method.area_spp=36", NULL};
    const char *const few[] = {light, "method.area_spp=4", NULL};
    open_stage(&reference, "method.name=full", SIDE, s->sets, many);
    open_stage(&foveated, "method.name=reproject", SIDE, s->sets, few);
    assert_int_equal(foveated.plan.planes, strstr(light, "apart") ? FV_PLANES : 1);
    assert_int_equal(reference.plan.planes, 1);
    for (int n = 0; n <= s->last; n++) {
        render(&foveated, s->step, n);
        if (n != EARLY && n != s->last) continue;
        render(&reference, s->step, n);
        out[n == s->last] = psnr(&foveated, &reference);
    }
    stage_close(&reference);
    stage_close(&foveated);
}

static void light_apart_is_light_with_the_rest(void **state)
{
    (void)state;
    for (unsigned i = 0; i < sizeof setups / sizeof *setups; i++) {
        const struct setup *s = &setups[i];
        double whole[2], apart[2];
        judge(s, "method.light=whole", whole);
        judge(s, "method.light=apart", apart);
        print_message("%s: frame %d %.1f dB (with the rest %.1f), frame %d %.1f (%.1f)\n", s->what, EARLY, apart[0],
                      whole[0], s->last, apart[1], whole[1]);
        assert_true(apart[1] > s->least && apart[1] > whole[1] - 1);
        assert_true(apart[1] > apart[0] + s->gain);
    }
}

/* A pixel's light is never worth more samples than the frames since the first can have given it: two each, where
 * a support node lies in the pixel too. */
static void counts_are_of_frames(void **state)
{
    (void)state;
    const char *const sets[] = {"method.light=apart", "method.area_spp=1", "fovea.p_min=1", "method.post_filter=9", NULL};
    open_stage(&foveated, "method.name=reproject", SIDE, sets, sets);
    for (int n = 0; n < 20; n++) {
        render(&foveated, 0, n);
        const struct fv_raster *r = &foveated.loop.frame.raster[FV_FINE][0];
        const uint32_t *albedo = r->colour + FV_PLANE_ALBEDO * r->plane, *light = r->colour + FV_PLANE_LIGHT * r->plane;
        unsigned most = 0;
        for (int y = 0; y < SIDE; y++)
            for (int x = 0; x < SIDE; x++) {
                int64_t at = y * r->stride + x;
                unsigned count = albedo[at] >> 30 | (light[at] >> 30) << 2;
                most = count > most ? count : most;
            }
        assert_true(most <= (unsigned)n * 2 && (n < 18 || most == 15));
    }
    stage_close(&foveated);
}

static void a_new_beginning_knows_nothing(void **state)
{
    (void)state;
    const char *const sets[] = {"method.light=apart", "method.post_filter=16", NULL};
    const int side = SIDE - 12; /* of whole blocks, not of whole tiles: what lies beyond is reprojected, not sampled */
    open_stage(&reference, "method.name=reproject", side, sets, sets);
    open_stage(&foveated, "method.name=reproject", side, sets, sets);
    for (int n = 0; n < 8; n++) render(&foveated, 8, n);
    fv_loop_restart(&foveated.loop);
    for (int n = 0; n < 4; n++) {
        render(&reference, 8, n);
        render(&foveated, 8, n);
        assert_true(psnr(&foveated, &reference) > 90); /* the same bytes: 120 */
    }
    stage_close(&reference);
    stage_close(&foveated);
}

static int start(void **state)
{
    (void)state;
    return fv_workers_start(&workers, 1) != 1;
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(light_apart_is_light_with_the_rest),
                                       cmocka_unit_test(counts_are_of_frames),
                                       cmocka_unit_test(a_new_beginning_knows_nothing)};
    return cmocka_run_group_tests(tests, start, NULL);
}
