/* light_maps: shadows by lights' maps against shadow rays, by the maps' side: their bytes, the time that
 * making them takes, the largest share of one that is too coarse, the share of the pixels that hit something and
 * come out otherwise, and the CPU time of frames of `full` (1 sample) with maps for all pixels over that with
 * rays, in turn at the same poses. Printed as a table. */
#include "platform/files.h"
#include "rt/measure/rank.h"
#include "tests/support/stage.h"

enum { POSES = 12, SIZE = 1024 };

static const char *const scenes[][3] = {
    {"scene.name=sponza", "scene.ambient=0.1 0.1 0.1", "its point light"},
    {"scene.name=sponza", "scene.sun=0.2 1 0.3  3 3 3", "and a sun"},
    {"scene.name=atrium", "scene.ambient=0.1 0.1 0.1", "its point and area light"},
    {"scene.name=cornell", "scene.point_lights=0.5 1.5 0.6  3 3 3", "a point and its area light"},
    {"scene.name=pipes", "scene.detail=0.2", "a sun and two points"},
};

static struct fv_workers workers;

static void open_scene(struct stage *b, const char *const scene[3])
{
    static char library[600];
    snprintf(library, sizeof library, "scene.library=%s/../shared/data/scenes", FV_SOURCE_DIR);
    const char *const sets[] = {scene[0], scene[1], library, "method.name=full", "method.area_spp=1", NULL};
    stage_begin(b, SIZE, sets, NULL, &workers);
}

static double frame_ms(struct stage *b, int n, bool mapped)
{
    struct fv_pose pose;
    fv_path_pose(&b->config.scene_path, b->config.scene_path_seconds, (int64_t)n * 2000000000, &pose);
    for (int w = 0; w < workers.count; w++) b->loop.frame.scratch[w].samples.mapped = mapped;
    b->loop.frame.number = 0; /* the same random numbers */
    stage_frame_from(b, &pose, 0, 0);
    return (double)b->record.cpu_ms;
}

/* Of the pixels that hit something, by the loop's view. */
static void count_different(struct stage *b, int64_t *hits, int64_t *different)
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

static void judge(struct stage *b, const char *what, double made_ms)
{
    double maps[POSES], rays[POSES], ratio[POSES];
    int64_t hits = 0, different = 0;
    float coarse = 0;
    int side = b->tracer.visibility->side;
    for (int i = 0; i < b->scene.lights; i++) coarse = fmaxf(coarse, b->tracer.visibility->map[i].coarse);
    for (int n = 0; n < POSES; n++) {
        for (int k = 0; k < 2; k++) *((n + k) % 2 ? &maps[n] : &rays[n]) = frame_ms(b, n, (n + k) % 2);
        ratio[n] = maps[n] / rays[n];
        count_different(b, &hits, &different);
    }
    fv_rank_sort(maps, POSES), fv_rank_sort(rays, POSES), fv_rank_sort(ratio, POSES);
    print_message("| %d%s | %.1f | %.0f | %.1f | %.2f | %.1f | %.1f | %.3f |\n", side, what,
                  (double)fv_visibility_bytes(&b->scene, side) * 0x1p-20, made_ms, 100 * (double)coarse,
                  100 * (double)different / (double)hits, maps[POSES / 2], rays[POSES / 2], ratio[POSES / 2]);
}

/* The same maps with nothing left to rays. */
static void forget_what_is_coarse(struct stage *b)
{
    for (int l = 0; l < b->scene.lights; l++) {
        struct fv_light_map *m = &b->tracer.visibility->map[l];
        uint32_t *word = (uint32_t *)(uintptr_t)m->nearness;
        m->coarse = 0;
        for (int64_t i = 0; m->nearness && i < (int64_t)m->faces * (m->side + 1) * (m->side + 1); i++)
            word[i] &= ~(uint32_t)FV_NODE_COARSE;
    }
}

static void measure(struct stage *b, int side)
{
    int64_t start_ns = fv_clock_now_ns(&fv_clock_monotonic);
    fv_visibility_make(&b->tracer, side, b->loop.frame.kernels->map_row, &workers);
    judge(b, "", (double)(fv_clock_now_ns(&fv_clock_monotonic) - start_ns) * 1e-6);
    if (side != 1024) return;
    forget_what_is_coarse(b);
    judge(b, ", all by map", 0);
}

static void table(void **state)
{
    (void)state;
    print_message("%d poses, one eye; CPU ms of all workers, medians\n", POSES);
    for (unsigned i = 0; i < sizeof scenes / sizeof scenes[0]; i++) {
        static struct stage b;
        if (strstr(scenes[i][0], "sponza") && !fv_file_exists(FV_SOURCE_DIR "/../shared/data/scenes"))
            continue;
        open_scene(&b, scenes[i]);
        print_message(
            "\n%s, %s\n| texels | MB | made, ms | coarse, %% | differs, %% | maps, ms | rays, ms | maps / rays |\n"
            "| --- | --- | --- | --- | --- | --- | --- | --- |\n",
            scenes[i][0] + strlen("scene.name="), scenes[i][2]);
        for (int side = 128; side <= 2048; side *= 2) measure(&b, side);
        stage_close(&b);
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
