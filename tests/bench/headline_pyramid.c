/* headline_pyramid: what the headset of Polychronakis et al. 2023 would show: both eyes of vive-pro-eye (2468 x 2740 at
 * 90 Hz) of the three scenes of fields, the fovea at 7.5 degrees, on all cores: wall time of a frame, frames a second,
 * and by which factor the machine or the method would have to be faster to hold the rate: with half of the frames, with
 * 99 % of them, and by the mean CPU time of a frame shared out evenly, which does not depend on what else the machine
 * does.
 *
 * The viewer walks along the scene's path and turns by 20 degrees a second besides, frame by frame a period apart, at
 * some places of the path; what the first frames of each take is not counted. Times are without presenting. Each scene
 * has a process of its own, as memory is never given back. Nothing is asserted but that frames come out.
 *
 * bench_headline_pyramid [FRAMES]: counted at each place, 1 to 100. With a size, WIDTHxHEIGHT, pictures of that size. */
#include "cli/cli.h"
#include "platform/log.h"
#include "rt/measure/contest.h"
#include "rt/measure/rank.h"
#include "tests/support/program.h"

#include <math.h>
#include <sys/wait.h>

enum { PLACES = 4, WARM = 5, FRAMES_MAX = 100, FRAMES = 16 };

static const struct row {
    const char *name;
    bool full;
    int ssaa, refresh, level;
} rows[] = {
    {"full marching", true, 1, 1, 0},
    {"1 sample, all refreshed", false, 1, 1, 0},
    {"1 sample, by quarters", false, 1, 4, 0},
    {"16 samples where masked, by quarters", false, 16, 4, 0},
    {"the smallest level", false, 1, 1, -1},
};
enum { ROWS = sizeof rows / sizeof rows[0] };

static const char *const scenes[] = {"primitives", "columns", "temple"};
enum { SCENES = sizeof scenes / sizeof scenes[0] };

static int frames = FRAMES;
static char size[2][40] = {"display.headset=vive-pro-eye", "display.headset=vive-pro-eye"};

struct bench {
    struct fv_setup setup;
    struct fv_config config;
    struct fv_contender full, pyramid;
};

static void open_bench(struct bench *b, const char *scene)
{
    char name[48];
    struct fv_error error;
    snprintf(name, sizeof name, "scene.name=%s", scene);
    struct fv_config_request request = {.sets = 9,
                                        .set = {name, "display.headset=vive-pro-eye", "display.sink=none", "display.eyes=2",
                                                "fovea.inner_deg=7.5", "eye.source=none", "imu.source=none", size[0], size[1]}};
    if (fv_setup_open(&b->setup, &request, &error) || fv_setup_start(&b->setup, false, &error)) fail_msg("%s", error.text);
    b->config = b->setup.config;
    struct fv_contender *contender[2] = {&b->full, &b->pyramid};
    for (int i = 0; i < 2; i++) {
        fv_contender_plan(contender[i], fv_method_find(i ? "pyramid" : "full"), &b->config, &b->setup.tracer);
        fv_contender_open(contender[i], &b->config, &b->setup.tracer, &b->setup.workers);
    }
}

static void render(struct bench *b, struct fv_contender *c, int place, int n, struct fv_frame_record *record)
{
    static const double ahead[2][3] = {{0, 0, -1}, {0, 0, -1}};
    struct fv_pose stand, head, turn = {{0, 0, 0}, {1, 0, 0, 0}};
    double s = n / b->config.budget_hz, at_s = b->config.scene_path_seconds * (place + 0.5) / PLACES + s;
    int64_t t_ns = llround(at_s * 1e9);
    fv_path_pose(&b->config.scene_path, b->config.scene_path_seconds, t_ns, &stand);
    fv_quat_from_yaw_pitch_roll(20 * s * M_PI / 180, 0, 0, turn.rotation);
    fv_pose_compose(&stand, &turn, &head);
    fv_loop_frame(&c->loop, &head, ahead, 0, t_ns, record);
}

static void run_row(struct bench *b, const struct row *row)
{
    static double ms[PLACES * FRAMES_MAX];
    struct fv_contender *c = row->full ? &b->full : &b->pyramid;
    struct fv_frame_record record;
    double period_ms = 1e3 / b->config.budget_hz, cpu_ms = 0, primary = 0;
    int counted = 0, warm = row->full ? 0 : WARM, count = row->full ? 1 : frames;
    b->config.method_ssaa = row->ssaa;
    b->config.method_ssaa_middle = 1;
    b->config.method_refresh = row->refresh;
    c->loop.level = row->level < 0 ? c->plan.method->levels - 1 : row->level;
    for (int place = 0; place < PLACES; place++) {
        fv_loop_restart(&c->loop);
        for (int n = 0; n < warm + count; n++) {
            fv_log_progress("%s: frame %d of %d", row->name, place * (warm + count) + n + 1, PLACES * (warm + count));
            render(b, c, place, n, &record);
            if (n < warm) continue;
            ms[counted++] = (double)record.frame_ms;
            cpu_ms += (double)record.cpu_ms;
            primary += (double)record.rays[FV_RAY_PRIMARY];
        }
    }
    fv_rank_sort(ms, counted);
    double p50_ms = fv_rank_percentile(ms, counted, 50), p99_ms = fv_rank_percentile(ms, counted, 99);
    assert_true(p50_ms > 0);
    cpu_ms /= counted * b->setup.workers.count;
    print_message("| %s | %.2f | %.1f | %.1f | %.1f | %.2f | %.2f | %.1f | %.2f |\n", row->name, 1e-6 * primary / counted, p50_ms,
                  p99_ms, 1e3 / p50_ms, p50_ms / period_ms, p99_ms / period_ms, cpu_ms, cpu_ms / period_ms);
}

static void run_scene(const char *scene)
{
    static struct bench b;
    open_bench(&b, scene);
    const struct fv_config *c = &b.config;
    print_message("\n%s: 2 x %lld x %lld at %g Hz, %s, %s, %d workers; %d places, %d frames each\n"
                  "| | primary rays, M | p50 ms | p99 | frames a second | factor wanting, p50 | p99 | CPU ms a worker | factor |\n"
                  "| --- | --- | --- | --- | --- | --- | --- | --- | --- |\n",
                  scene, (long long)c->display_width, (long long)c->display_height, c->budget_hz, fv_cpu_name(),
                  fv_cpu_isa_name(b.setup.tracer.isa), b.setup.workers.count, PLACES, frames);
    for (int i = 0; i < ROWS; i++) run_row(&b, &rows[i]);
}

static void scene_test(void **state)
{
    int status;
    fflush(stdout);
    pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        run_scene(*state);
        fflush(stdout);
        _exit(0);
    }
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_int_equal(status, 0);
}

int main(int argc, char **argv)
{
    struct CMUnitTest tests[SCENES];
    int width = 0, height = 0;
    for (int i = 1; i < argc; i++)
        if (sscanf(argv[i], "%dx%d", &width, &height) == 2) {
            snprintf(size[0], sizeof size[0], "display.width=%d", width);
            snprintf(size[1], sizeof size[1], "display.height=%d", height);
        } else frames = atoi(argv[i]);
    if (frames < 1 || frames > FRAMES_MAX) {
        fprintf(stderr, "usage: bench_headline_pyramid [FRAMES, 1 to %d] [WIDTHxHEIGHT]\n", FRAMES_MAX);
        return 2;
    }
    for (int k = 0; k < SCENES; k++) {
        tests[k] = (struct CMUnitTest)cmocka_unit_test_prestate(scene_test, (void *)(uintptr_t)scenes[k]);
        tests[k].name = scenes[k];
    }
    return cmocka_run_group_tests(tests, NULL, NULL);
}
