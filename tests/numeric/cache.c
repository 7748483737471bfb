/* cache: what a pixel keeps of its history (rt/pass/cache.h): depths, worth and age in 32 bits, at their extremes;
 * the least weight of a new sample by age; and what they are for: a still view that grows better for a thousand
 * frames. */
#include "rt/pass/cache.h"

#include "cli/cli.h"
#include "tests/support/room.h"
#include "tests/support/shown.h"

#include <math.h>

enum { SIDE = 64 };

static struct fv_setup *opened(struct fv_setup *s, const char *a, const char *b, const char *c)
{
    struct fv_error error;
    const struct fv_config_request request = {
        .sets = 15,
        .set = {a, b, c, "scene.name=cornell", "display.sink=none", "display.width=64", "display.height=64",
                "display.eyes=1", "display.fov_in_deg=35", "display.fov_out_deg=35", "display.fov_up_deg=35",
                "display.fov_down_deg=35", "threads.workers=1", "method.area_spp=1", "output.tape=off"}};
    if (fv_setup_open(s, &request, &error) || fv_setup_take(s, 1, &error)) fail_msg("%s", error.text);
    return s;
}

static float packed(float w)
{
    return cache_depth(cache_of_depth(vf_of(w)))[0];
}

/* Good to 1/512 wherever they are, in order, and never out of range. */
static void depths_in_16_bits(void **state)
{
    (void)state;
    float before = 0;
    for (int e = -99; e <= 19; e++) {
        assert_true(packed(ldexpf(1, e)) == ldexpf(1, e));
        for (int i = 0; i < 1000; i++) {
            float w = ldexpf(1 + (float)i / 1000, e), got = packed(w);
            if (!(fabsf(got - w) <= w / 512 && got >= before)) fail_msg("%g came back as %g", (double)w, (double)got);
            before = got;
        }
    }
    assert_true(packed(0) == 0 && packed(-0.0f) == 0 && packed(1e-45f) >= 0 && packed(1e-45f) < 1e-38f);
    assert_true(fabsf(packed(1e-30f) - 1e-30f) <= 1e-30f / 512);
    assert_true(fabsf(packed(FV_INVERSE_DEPTH_MAX) - FV_INVERSE_DEPTH_MAX) <= FV_INVERSE_DEPTH_MAX / 512);
    static const float none[] = {FV_DEPTH_UNKNOWN, NAN, -INFINITY, -1e-30f};
    for (int i = 0; i < 4; i++) {
        assert_int_equal((uint32_t)cache_of_depth(vf_of(none[i]))[0], FV_CACHE_NONE);
        assert_true(isnan(packed(none[i])));
    }
    assert_true(isnan(cache_depth(vi_of((int32_t)(FV_CACHE_NONE | 0xffff)))[0]));
    assert_true(!(packed(INFINITY) <= FV_INVERSE_DEPTH_MAX));
}

static void ages_end_at_the_oldest(void **state)
{
    (void)state;
    for (int rho = 0; rho < 256; rho += 51)
        for (int age = 0; age < 256; age++) {
            int low = age & FV_CACHE_OLDEST;
            vi cache = vi_of((int32_t)(0x3f000000u | (uint32_t)rho << 8 | (uint32_t)age)), older = cache_older(cache);
            assert_int_equal(older[0], rho << 8 | (age & FV_CACHE_MOVING) | (low < FV_CACHE_OLDEST ? low + 1 : low));
            assert_true(cache_rho(cache)[0] == rho && cache_age(cache)[0] == low);
        }
}

/* k(dt) grows from k_min at the age of one frame to k_max at t_max, exponentially, and stays there. */
static void least_weights(void **state)
{
    (void)state;
    static const struct {
        const char *k_min, *k_max, *t_max;
        double at_1, at_middle, at_end;
        int end;
    } cases[] = {
        {"method.k_min=0.25", "method.k_max=0.6", "method.t_max=31", 0.25, 0.38729833, 0.6, 31},
        {"method.k_min=0.4", "method.k_max=0.4", "method.t_max=31", 0.4, 0.4, 0.4, 31},
        {"method.k_min=0.25", "method.k_max=0.6", "method.t_max=1", 0.6, 0.6, 0.6, 1},
        {"method.k_min=0", "method.k_max=1", "method.t_max=127", 0, 1e-3, 1, 127},
        {"method.k_min=0.6", "method.k_max=0.1", "method.t_max=31", 0.1, 0.1, 0.1, 31},
    };
    for (unsigned n = 0; n < sizeof cases / sizeof cases[0]; n++) {
        static struct fv_setup setups[sizeof cases / sizeof cases[0]]; /* to the program's end */
        const struct fv_frame *f = &opened(&setups[n], cases[n].k_min, cases[n].k_max, cases[n].t_max)->loop.frame;
        int end = cases[n].end;
        assert_true(fabs((double)f->k[0][1] - cases[n].at_1) < 2e-6);
        assert_true(fabs((double)f->k[0][(1 + end) / 2] - cases[n].at_middle) < 2e-5);
        assert_true(fabs((double)f->k[0][end] - cases[n].at_end) < 2e-6);
        for (int age = 0; age <= FV_CACHE_OLDEST; age++) {
            float k = f->k[0][age];
            assert_true(k >= 0 && k <= 1 && (age == 0 || k >= f->k[0][age - 1]));
            assert_true(age < end || k == f->k[0][end]);
            assert_true(f->k[1][age] <= k && f->k[1][age] <= 1 / 256.0f);
        }
    }
}

static void render(struct fv_loop *loop)
{
    struct fv_frame_record r;
    const struct fv_pose head = {.rotation = {1, 0, 0, 0}};
    const double gaze[2][3] = {{0, 0, -1}, {0, 0, -1}};
    fv_loop_frame(loop, &head, gaze, 0.3, 0, &r);
}

static double reference[SIDE][SIDE][3];

/* The sum over the picture of how far off the reference it is, or how much it is added to it. */
static double visit(const struct fv_frame *f, double add)
{
    double sum = 0;
    for (int y = 0; y < SIDE; y++)
        for (int x = 0; x < SIDE; x++)
            for (int c = 0; c < 3; c++) {
                double is = shown_pixel(f, 0, x, y) >> 10 * c & 1023;
                sum += pow(is - reference[y][x][c], 2);
                reference[y][x][c] += add * is;
            }
    return sqrt(sum / (3 * SIDE * SIDE));
}

/* Of a room lit by a lamp that is sampled once a pixel, soft shadows, edges and all: frame by frame
 * nearer to what many samples show. */
static void still_views_converge(void **state)
{
    (void)state;
    static struct room room;
    static struct fv_loop loop;
    static struct fv_plan plan;
    static struct fv_workers workers;
    static const int steps[] = {3, 10, 50, 250, 1000};
    struct fv_config *c = &room.small.config;
    fv_workers_start(&workers, 1);
    room_open(&room, &workers, FV_SCENE_AREA_LIGHTS, 1, SIDE);
    c->method_spp = 64, c->method_area_spp = 1, c->method_density_deg = 181, c->fovea_p_min = 0.2;
    for (int n = 0; n < 8; n++) render(&room.loop), visit(&room.loop.frame, 1 / 8.0);
    fv_frame_size(&loop.frame, c);
    fv_plan_make(&plan, fv_method_find("reproject"), &room.small.scene, c, &loop.frame);
    fv_loop_open(&loop, c, &plan, &room.small.tracer, &workers, &room.session, 1);
    double before = INFINITY, first = 0;
    for (int n = 1, step = 0; n <= 1000; n++) {
        render(&loop);
        if (n != steps[step]) continue;
        double off = visit(&loop.frame, 0);
        print_message("after %d frames: %.2f of 1023 off\n", n, off);
        /* What is left at last are roundings to 1023ths, which come and go, in the reference's eight pictures too. */
        if (!(off < before || off < 4.5)) fail_msg("%.2f before", before);
        before = off;
        if (!step++) first = off;
    }
    assert_true(before < 0.5 * first);
    fv_workers_stop(&workers);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(depths_in_16_bits), cmocka_unit_test(ages_end_at_the_oldest),
                                       cmocka_unit_test(least_weights), cmocka_unit_test(still_views_converge)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
