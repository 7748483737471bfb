/* turn: late pictures turned by a head at 100 degrees a second over a period of 75 Hz, both eyes of 1832 x 1920, against
 * memcpy of the same pictures, by turns in one process, by thread CPU time: a pinhole's, through a lens, and where the
 * lens's colours part. */
#include "platform/clock.h"
#include "rt/pass/turn.h"
#include "tests/support/stage.h"

enum { WIDTH = 1832, HEIGHT = 1920, ROUNDS = 15 };
static const char *const sets[] = {"scene.name=cornell", "method.name=full", "display.sink=png", "budget.pace=vsync", "threads.workers=1", "display.eyes=2", NULL};
static const char *const lens[] = {"display.lens=radial", "display.lens_unit_px=900", "display.lens_x_px=900", "display.lens_y_px=960",
                                   "display.lens_k=0.2485 -0.0768 0.2194", "display.lens_visible_deg=54", NULL};
static const char *const colours[] = {"display.lens=radial", "display.lens_unit_px=900", "display.lens_x_px=900", "display.lens_y_px=960",
                                      "display.lens_k=0.2485 -0.0768 0.2194", "display.lens_visible_deg=54",
                                      "display.lens_red=0.98766 -0.01666", "display.lens_blue=1.02059 0.01666", NULL};
static const struct {
    const char *name, *const *more;
    double limit;
} rows[] = {{"a pinhole's", NULL, 60}, {"through a lens", lens, 90}, {"colours part", colours, 180}};

static struct stage s;

static double turn_ns(void)
{
    struct fv_frame *f = &s.loop.frame;
    int64_t begun_ns = fv_clock_thread_ns();
    for (int i = 0; i < f->tiles; i++) {
        struct fv_tile tile = fv_tile_at(f, i, 0);
        fv_pass_turn.run(f, &tile);
    }
    return (double)(fv_clock_thread_ns() - begun_ns);
}

static double copy_ns(void)
{
    const struct fv_frame *f = &s.loop.frame;
    int64_t begun_ns = fv_clock_thread_ns();
    for (int e = 0; e < 2; e++) memcpy(f->buffer[f->fringe ? FV_PICTURE : FV_TURNED][e], f->buffer[f->fringe ? FV_GREEN : FV_PICTURE][e], (size_t)(4 * f->stride * f->height));
    return (double)(fv_clock_thread_ns() - begun_ns);
}

static int by_size(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void ratios(void **state)
{
    static struct fv_workers one;
    (void)state;
    fv_workers_start(&one, 1);
    for (int i = 0; i < 3; i++) {
        double ours[ROUNDS], theirs[ROUNDS], ratio[ROUNDS];
        struct fv_error error;
        stage_set(&s, WIDTH, sets, rows[i].more);
        s.config.display_height = HEIGHT;
        if (fv_scene_load(&s.scene, &s.config, &error)) fail_msg("%s", error.text);
        stage_open(&s, &one);
        struct fv_frame *f = &s.loop.frame;
        struct fv_pose head = {{0, 0, 0}, {1, 0, 0, 0}};
        double gaze[3] = {0, 0, -1};
        for (int e = 0; e < 2; e++) {
            fv_loop_view(&s.loop, e, &head, gaze, &f->view[e]);
            uint32_t *picture = f->buffer[f->fringe ? FV_GREEN : FV_PICTURE][e];
            for (int64_t k = 0; k < f->stride * f->height; k++) picture[k] = 0xff000000u | (uint32_t)(k * 2654435761u >> 8);
        }
        fv_quat_from_yaw_pitch_roll(100.0 / 75 * M_PI / 180, 0.004, 0.001, head.rotation);
        assert_true(fv_turn_set(f, &head));
        for (int n = 0; n < ROUNDS; n++) {
            ours[n] = turn_ns();
            theirs[n] = copy_ns();
            ratio[n] = ours[n] / theirs[n];
        }
        qsort(ours, ROUNDS, sizeof *ours, by_size), qsort(theirs, ROUNDS, sizeof *theirs, by_size), qsort(ratio, ROUNDS, sizeof *ratio, by_size);
        printf("%-15s %d x %d: an eye %.2f ms of one core, %.2f ns a pixel; memcpy %.2f ms, ratio %.1f (quartiles %.1f to %.1f)\n", rows[i].name, WIDTH,
               HEIGHT, 0.5e-6 * ours[ROUNDS / 2], ours[ROUNDS / 2] / (2.0 * WIDTH * HEIGHT), 0.5e-6 * theirs[ROUNDS / 2], ratio[ROUNDS / 2],
               ratio[ROUNDS / 4], ratio[3 * ROUNDS / 4]);
        assert_true(ratio[ROUNDS / 2] < rows[i].limit);
        stage_close(&s);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(ratios)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
