/* light_maps: shadows by lights' maps against shadow rays, by the maps' side: their bytes, the time that
 * making them takes, the share of the pixels that hit something and come out otherwise, and the CPU time of
 * frames of `full` (1 sample) with maps for all pixels over that with rays, in turn at the same poses.
 * Printed as a table. */
#include "platform/files.h"
#include "rt/frame/loop.h"
#include "rt/measure/rank.h"
#include "rt/scene/path.h"
#include "tests/support/program.h"

#include <math.h>

enum { POSES = 12 };

static const char *const scenes[][3] = {
    {"scene.name=sponza", "scene.ambient=0.1 0.1 0.1", "its point light"},
    {"scene.name=sponza", "scene.sun=0.2 1 0.3  3 3 3", "and a sun"},
    {"scene.name=atrium", "scene.ambient=0.1 0.1 0.1", "its point and area light"},
    {"scene.name=cornell", "scene.point_lights=0.5 1.5 0.6  3 3 3", "a point and its area light"},
};

struct bench {
    struct fv_config config;
    struct fv_scene scene;
    struct fv_tracer tracer;
    struct fv_plan plan;
    struct fv_session session;
    struct fv_loop loop;
};

static struct fv_workers workers;

static void open_scene(struct bench *b, const char *const scene[3])
{
    static char library[600];
    struct fv_error error;
    snprintf(library, sizeof library, "scene.library=%s/../shared/data/scenes", FV_SOURCE_DIR);
    struct fv_config_request request = {.sets = 7,
                                        .set = {scene[0], scene[1], library, "method.name=full",
                                                "display.eyes=1", "method.area_spp=1", "display.sink=none"}};
    if (fv_config_load(&b->config, &request, &error) || fv_scene_load(&b->scene, &b->config, &error) ||
        fv_tracer_open(&b->tracer, &b->scene, &b->config, &error))
        fail_msg("%s", error.text);
    fv_frame_size(&b->loop.frame, &b->config);
    fv_plan_make(&b->plan, fv_method_find("full"), &b->scene, &b->config, &b->loop.frame);
    fv_loop_open(&b->loop, &b->config, &b->plan, &b->tracer, &workers, &b->session, 1);
}

static double frame_ms(struct bench *b, int n, bool mapped)
{
    static const double gaze[2][3] = {{0, 0, -1}, {0, 0, -1}};
    struct fv_pose pose;
    struct fv_frame_record record;
    fv_path_pose(&b->config.scene_path, b->config.scene_path_seconds, (int64_t)n * 2000000000, &pose);
    for (int w = 0; w < workers.count; w++) b->loop.frame.scratch[w].samples.mapped = mapped;
    b->loop.frame.number = 0; /* the same random numbers */
    fv_loop_frame(&b->loop, &pose, gaze, 0, 0, &record);
    return (double)record.cpu_ms;
}

/* Of the pixels that hit something, by the loop's view. */
static void count_different(struct bench *b, int64_t *hits, int64_t *different)
{
    static struct fv_samples rays;
    struct fv_frame *f = &b->loop.frame;
    struct fv_samples *s = &f->scratch[0].samples;
    for (int t = 0; t < f->tiles; t += 7) {
        struct fv_tile tile = fv_tile_at(f, t, 0);
        fv_tile_place(f, &tile, fv_tile_inside(f, &tile));
        s->mapped = false;
        fv_samples_trace(f, &tile, 1);
        rays = *s;
        s->mapped = true;
        fv_samples_trace(f, &tile, 1);
        for (int i = 0; i < s->count; i++) {
            *hits += s->inverse_depth[i] > 0;
            *different += fabsf(s->red[i] - rays.red[i]) > 1e-5f * rays.red[i];
        }
    }
}

static void measure(struct bench *b, int side)
{
    double maps[POSES], rays[POSES], ratio[POSES];
    int64_t hits = 0, different = 0, start_ns = fv_clock_now_ns(&fv_clock_monotonic);
    fv_visibility_make(&b->tracer, side, b->loop.frame.kernels->map_row, &workers);
    double made_ms = (double)(fv_clock_now_ns(&fv_clock_monotonic) - start_ns) * 1e-6;
    for (int n = 0; n < POSES; n++) {
        for (int k = 0; k < 2; k++) *((n + k) % 2 ? &maps[n] : &rays[n]) = frame_ms(b, n, (n + k) % 2);
        ratio[n] = maps[n] / rays[n];
        count_different(b, &hits, &different);
    }
    fv_rank_sort(maps, POSES), fv_rank_sort(rays, POSES), fv_rank_sort(ratio, POSES);
    print_message("| %d | %.1f | %.0f | %.2f | %.1f | %.1f | %.3f |\n", side,
                  (double)fv_visibility_bytes(&b->scene, side) * 0x1p-20, made_ms,
                  100 * (double)different / (double)hits, maps[POSES / 2], rays[POSES / 2], ratio[POSES / 2]);
}

static void table(void **state)
{
    (void)state;
    print_message("%d poses, one eye; CPU ms of all workers, medians\n", POSES);
    for (unsigned i = 0; i < sizeof scenes / sizeof scenes[0]; i++) {
        static struct bench b;
        if (strstr(scenes[i][0], "sponza") && !fv_file_exists(FV_SOURCE_DIR "/../shared/data/scenes"))
            continue;
        open_scene(&b, scenes[i]);
        print_message(
            "\n%s, %s\n| texels | MB | made, ms | differs, %% | maps, ms | rays, ms | maps / rays |\n"
            "| --- | --- | --- | --- | --- | --- | --- |\n",
            scenes[i][0] + strlen("scene.name="), scenes[i][2]);
        for (int side = 128; side <= 2048; side *= 2) measure(&b, side);
        fv_tracer_close(&b.tracer);
    }
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
