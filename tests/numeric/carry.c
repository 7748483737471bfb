/* carry: what the pyramid carries over from the last frame. A head that turns sees far more of what it would if all
 * were traced than where tiles stay as they were; one that rests, the same bytes; what is uncovered has no trail; and
 * heads that jump, surfaces around the eye, pictures of nothing and frames that were cut. */
#include "rt/frame/loop.h"
#include "rt/measure/metrics.h"
#include "rt/pass/pyramid.h"
#include "rt/scene/path.h"
#include "tests/support/program.h"

#include <math.h>

enum { WIDTH = 329, HEIGHT = 285, EYES = 2 };
enum turns { ALWAYS, STAY, CARRY, TURNS }; /* every frame; in turns, what was stays; in turns, carried over */

static struct stage {
    struct fv_config config[TURNS];
    struct fv_scene scene;
    struct fv_tracer tracer;
    struct fv_workers workers;
    struct fv_plan plan[TURNS];
    struct fv_session session[TURNS];
    struct fv_loop loop[TURNS];
} s;

static const char *contrast; /* with and without what is refined */

/* Pixels of a sixth of a degree, so that all levels are there. */
static void open_stage(const char *scene, const char *const *sets, int count)
{
    static const char *const always[] = {
        "display.eyes=2", "display.fov_out_deg=26", "display.fov_in_deg=26", "display.fov_up_deg=23", "display.fov_down_deg=23",
        "fovea.inner_deg=3.5", "fovea.outer_deg=8", "method.lowest_deg=9"};
    static bool open;
    struct fv_config_request request = {.sets = 1, .set = {scene}};
    struct fv_error error;
    if (open) {
        fv_tracer_close(&s.tracer);
        fv_workers_stop(&s.workers);
    }
    open = true;
    for (size_t i = 0; i < sizeof always / sizeof always[0]; i++) request.set[request.sets++] = always[i];
    request.set[request.sets++] = contrast;
    for (int i = 0; i < count; i++) request.set[request.sets++] = sets[i];
    memset(&s, 0, sizeof s);
    if (fv_config_load(&s.config[0], &request, &error)) fail_msg("%s", error.text);
    s.config[0].display_width = WIDTH, s.config[0].display_height = HEIGHT;
    for (int i = 1; i < TURNS; i++) s.config[i] = s.config[0], s.config[i].method_refresh = 4;
    snprintf(s.config[STAY].method_carry, sizeof s.config[STAY].method_carry, "off");
    if (fv_scene_load(&s.scene, &s.config[0], &error) || fv_tracer_open(&s.tracer, &s.scene, &s.config[0], &error))
        fail_msg("%s", error.text);
    fv_workers_start(&s.workers, 2);
    for (int i = 0; i < TURNS; i++) {
        fv_frame_size(&s.loop[i].frame, &s.config[i]);
        fv_plan_make(&s.plan[i], fv_method_find("pyramid"), &s.scene, &s.config[i], &s.loop[i].frame);
        fv_loop_open(&s.loop[i], &s.config[i], &s.plan[i], &s.tracer, &s.workers, &s.session[i], 1);
    }
}

static int take_plain(void **state)
{
    (void)state;
    contrast = "method.contrast=1";
    return 0;
}

static int take_refined(void **state)
{
    (void)state;
    contrast = "method.contrast=0.25";
    return 0;
}

static const double ahead[3] = {0, 0, -1};

static double render(enum turns turns, const struct fv_pose *head, const double gaze[3])
{
    struct fv_loop *loop = &s.loop[turns];
    struct fv_frame_record record;
    double both[2][3];
    for (int e = 0; e < 2; e++) memcpy(both[e], gaze, sizeof both[e]);
    fv_loop_frame(loop, head, (const double(*)[3])both, 0, 0, &record);
    fv_pass_run(&fv_pass_present, &loop->frame, &s.workers);
    return (double)record.rays[FV_RAY_PRIMARY];
}

/* Of the scene's path, turned and moved on. */
static struct fv_pose head_at(double at_s, double yaw_deg, double right_m)
{
    struct fv_pose head, moved, way = {{right_m, 0, 0}, {cos(yaw_deg / 360 * acos(-1)), 0, sin(yaw_deg / 360 * acos(-1)), 0}};
    fv_path_pose(&s.config[0].scene_path, s.config[0].scene_path_seconds, (int64_t)(at_s * 1e9), &head);
    fv_pose_compose(&head, &way, &moved);
    return moved;
}

static const uint8_t *row_of(enum turns turns, int eye, int y)
{
    const struct fv_frame *f = &s.loop[turns].frame;
    return (const uint8_t *)f->buffer[FV_PICTURE][eye] + 4 * y * f->stride;
}

static void assert_same(enum turns a, enum turns b)
{
    for (int e = 0; e < EYES; e++)
        for (int y = 0; y < HEIGHT; y++) assert_memory_equal(row_of(a, e, y), row_of(b, e, y), 4 * WIDTH);
}

/* Pixels of both eyes that are off by more than `off` of 255. */
static int far_pixels(enum turns a, enum turns b, int off)
{
    int count = 0;
    for (int e = 0; e < EYES; e++)
        for (int i = 0; i < WIDTH * HEIGHT; i++) {
            const uint8_t *p = row_of(a, e, i / WIDTH) + i % WIDTH * 4, *q = row_of(b, e, i / WIDTH) + i % WIDTH * 4;
            count += abs(p[0] - q[0]) > off || abs(p[1] - q[1]) > off || abs(p[2] - q[2]) > off;
        }
    return count;
}

/* Of the right eye's pictures. */
static double ssim(enum turns turns)
{
    static struct fv_metrics *metrics;
    static uint8_t zone[WIDTH * HEIGHT];
    static struct fv_errors errors;
    struct fv_metrics_picture p[2];
    if (!metrics) metrics = fv_metrics_open(WIDTH, HEIGHT, 6);
    for (int i = 0; i < 2; i++)
        p[i] = (struct fv_metrics_picture){WIDTH, HEIGHT, 4, 4 * s.loop[0].frame.stride, row_of(i ? turns : ALWAYS, 1, 0)};
    fv_zones_of_view(&s.loop[0].frame.view[1], zone);
    fv_metrics_compare(metrics, &s.workers, &p[0], &p[1], zone, &errors);
    assert_true(errors.psnr[FV_ZONE_FOVEA] > 60);
    return errors.ssim[FV_ZONE_ALL];
}

static const char *const scenes[] = {"scene.name=primitives", "scene.name=columns", "scene.name=temple"};

/* At 90 Hz. Returns 1 - SSIM of what is carried over against what stays. */
static double turn_head(const char *scene, const char *isa)
{
    double carried = 0, stayed = 0, rays[TURNS] = {0};
    open_stage(scene, &isa, 1);
    for (int i = 0; i < 9; i++) {
        struct fv_pose head = head_at(6.1, 20.0 / 90 * i, 0.3 / 90 * i);
        for (int t = 0; t < TURNS; t++) rays[t] += i ? render((enum turns)t, &head, ahead) : 0 * render((enum turns)t, &head, ahead);
        if (i < 5) continue;
        carried += 0.25 * (1 - ssim(CARRY));
        stayed += 0.25 * (1 - ssim(STAY));
    }
    print_message("%s, %s: SSIM %.4f carried over, %.4f where tiles stay; rays %.3f and %.3f\n", scene, isa, 1 - carried,
                  1 - stayed, rays[CARRY] / rays[ALWAYS], rays[STAY] / rays[ALWAYS]);
    assert_true(rays[CARRY] < 1.15 * rays[STAY]);
    return carried / stayed;
}

static void heads_that_turn(void **state)
{
    (void)state;
    for (int n = 0; n < 3; n++) assert_true(turn_head(scenes[n], "threads.isa=auto") < 0.55);
    assert_true(turn_head(scenes[0], "threads.isa=avx2") < 0.55);
    assert_true(turn_head(scenes[0], "threads.isa=base") < 0.55);
}

/* Whichever way the head rests; then what is carried over is what was traced. */
static void heads_that_rest(void **state)
{
    (void)state;
    static const double yaws_deg[] = {37.3, -123.45};
    for (int n = 0; n < 3; n++) {
        open_stage(scenes[n], NULL, 0);
        for (int k = 0; k < 2; k++) {
            double rays[TURNS] = {0};
            for (int t = 0; t < TURNS; t++) fv_loop_restart(&s.loop[t]);
            for (int i = 0; i < 5; i++) {
                struct fv_pose head = head_at(4, yaws_deg[k], 0.123);
                for (int t = 0; t < TURNS; t++) rays[t] += render((enum turns)t, &head, ahead);
                assert_same(ALWAYS, STAY);
                assert_same(ALWAYS, CARRY);
            }
            assert_true(rays[CARRY] <= rays[STAY] * 1.001 && rays[STAY] < 0.9 * rays[ALWAYS]);
        }
    }
}

static const char *field_of(const char *name, const char *text)
{
    static char set[320];
    program_write(name, text, strlen(text));
    snprintf(set, sizeof set, "scene.fields=%s/%s", program_folder(), name);
    return set;
}

static void open_field(const char *name, const char *text)
{
    const char *const sets[] = {field_of(name, text), "scene.sky=0 0 0", "scene.ambient=1 1 1", "scene.file=", "scene.path=0 0 0 0 0",
                                "scene.path_seconds=0"};
    open_stage("scene.name=none", sets, 6);
}

static const char post[] = "material wall diffuse 0.7 0.7 0.7 checker 0.6 0.6 0.65 1.1\nmaterial post diffuse 0.9 0.02 0.02\n"
                           "solid wall: translate(0, 0, -9, box(60, 60, 1))\nsolid post: capsule(0, -4, -2, 0, 4, -2, 0.04)\n";

/* Pixels that are far off where there is no post in the true picture, nor so near that lowest pixels are interpolated with it. */
static int trail(enum turns turns)
{
    int count = 0;
    for (int e = 0; e < EYES; e++)
        for (int i = 0; i < WIDTH * HEIGHT; i++) {
            const uint8_t *is = row_of(ALWAYS, e, i / WIDTH), *shown = row_of(turns, e, i / WIDTH) + i % WIDTH * 4;
            bool near = false;
            for (int x = i % WIDTH - 6; x <= i % WIDTH + 6; x++) near |= x >= 0 && x < WIDTH && is[4 * x + 1] < 150;
            count += !near && abs(is[i % WIDTH * 4 + 1] - shown[1]) > 32;
        }
    return count;
}

/* A thin post before a wall, and a head that moves sideways by 2 m/s: what it uncovers is the wall at once. */
static void uncovered_walls(void **state)
{
    (void)state;
    int carried = 0, stayed = 0;
    open_field("post.field", post);
    for (int i = 0; i < 13; i++) {
        struct fv_pose head = head_at(0, 0, 2.0 / 90 * (i - 6));
        for (int t = 0; t < TURNS; t++) render((enum turns)t, &head, ahead);
        if (i < 5) continue;
        carried += trail(CARRY);
        stayed += trail(STAY);
    }
    print_message("trail of a post before a wall: %d pixels in 8 frames, %d where tiles stay\n", carried, stayed);
    assert_true(carried <= 16 && stayed > 8 * 500);
}

/* What was never in view is traced: the picture is that of the first frame. */
static void heads_that_jump(void **state)
{
    (void)state;
    static const double yaws_deg[] = {0, 90, 180, -90, 0}, rights_m[] = {0, 0, 1e6, -1e6, 1e3};
    for (int n = 0; n < 3; n++) {
        open_stage(scenes[n], NULL, 0);
        for (int i = 0; i < 5; i++) {
            struct fv_pose head = head_at(2, yaws_deg[i], rights_m[i]);
            for (int t = 0; t < TURNS; t++) render((enum turns)t, &head, ahead);
            assert_same(ALWAYS, CARRY);
        }
    }
    /* What was kept coarser is traced. */
    open_stage(scenes[2], NULL, 0);
    for (int i = 0; i < 2; i++) {
        struct fv_pose head = head_at(6.1, 13 * i, 0);
        for (int t = 0; t < TURNS; t++) render((enum turns)t, &head, ahead);
    }
    print_message("turned by 13 degrees: %d pixels off, %d where tiles stay\n", far_pixels(ALWAYS, CARRY, 24), far_pixels(ALWAYS, STAY, 24));
    assert_true(far_pixels(ALWAYS, CARRY, 24) < 5500);
    /* Where the gaze jumps, levels differ: what was not held is traced. */
    open_stage(scenes[0], NULL, 0);
    for (int i = 0; i < 6; i++) {
        double gaze[3] = {i & 1 ? -0.3 : 0.25, i & 2 ? 0.2 : -0.1, -0.9};
        struct fv_pose head = head_at(6.1, 20.0 / 90 * i, 0.3 / 90 * i);
        for (int t = 0; t < TURNS; t++) render((enum turns)t, &head, gaze);
        print_message("gaze %d: SSIM %.4f carried over, %.4f where tiles stay\n", i, ssim(CARRY), ssim(STAY));
        if (i) assert_true(1 - ssim(CARRY) < 0.9 * (1 - ssim(STAY)));
    }
}

static void eyes_in_surfaces_and_before_nothing(void **state)
{
    (void)state;
    static const char *const fields[] = {"material a diffuse 1 1 1\nsolid a: sphere(3)\n",
                                         "material a diffuse 1 1 1\nsolid a: translate(0, 0, 50, sphere(1))\n",
                                         "material a diffuse 1 1 1\nsolid a: plane(0, 1, 0, 0)\n"};
    for (int n = 0; n < 3; n++) {
        open_field("odd.field", fields[n]);
        for (int i = 0; i < 6; i++) {
            struct fv_pose head = head_at(0, 3 * i, 0.01 * i);
            for (int t = 0; t < TURNS; t++) render((enum turns)t, &head, ahead);
            assert_int_equal(far_pixels(ALWAYS, CARRY, 8), 0);
        }
    }
}

/* Where the scene has triangles nothing is carried over, nor left to stand. */
static void triangles_are_traced(void **state)
{
    (void)state;
    const char *const sets[] = {"scene.fields=builtin:primitives", "method.name=pyramid"};
    open_stage("scene.name=cornell", sets, 2);
    assert_null(s.loop[CARRY].frame.buffer[FV_HISTORY_STARTS][0]);
    for (int i = 0; i < 3; i++) {
        struct fv_pose head = head_at(0, i, 0.02 * i);
        render(ALWAYS, &head, ahead);
        render(CARRY, &head, ahead);
        assert_same(ALWAYS, CARRY);
    }
}

static int cut_tile(struct fv_frame *f, const struct fv_tile *tile)
{
    fv_pass_trace.stand_in(f, tile);
    return 0;
}

/* A frame of which nothing was traced is the last one, moved; the next ones are as good as ever. */
static void frames_that_were_cut(void **state)
{
    (void)state;
    struct fv_pass cut = fv_pass_trace;
    cut.run = cut_tile;
    open_stage(scenes[0], NULL, 0);
    for (int i = 0; i < 9; i++) {
        struct fv_pose head = head_at(6.1, 20.0 / 90 * i, 0.3 / 90 * i);
        for (int t = 0; t < TURNS; t++) {
            s.plan[t].pass[2] = i == 4 && t != ALWAYS ? &cut : &fv_pass_trace;
            render((enum turns)t, &head, ahead);
        }
        if (i < 4) continue;
        int carried = far_pixels(ALWAYS, CARRY, 32), stayed = far_pixels(ALWAYS, STAY, 32);
        print_message("%s: %d pixels off, %d where tiles stay\n", i == 4 ? "cut" : "then", carried, stayed);
        assert_true(2 * carried < stayed);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(heads_that_turn),  cmocka_unit_test(heads_that_rest),
                                       cmocka_unit_test(uncovered_walls),  cmocka_unit_test(heads_that_jump),
                                       cmocka_unit_test(eyes_in_surfaces_and_before_nothing),
                                       cmocka_unit_test(triangles_are_traced), cmocka_unit_test(frames_that_were_cut)};
    int failed = cmocka_run_group_tests_name("plain", tests, take_plain, NULL);
    return failed + cmocka_run_group_tests_name("refined", tests, take_refined, program_clean);
}
