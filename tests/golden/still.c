/* still: where nothing moves, reproject comes nearer to the converged picture frame by frame, over 1000 frames, in the
 * fovea and in the periphery: edges get smooth, light that is sampled at random gets calm. Judged by 400 samples a
 * pixel of full. */
#include "tests/support/program.h"

#include "rt/frame/loop.h"
#include "rt/scene/path.h"

#include <math.h>

enum { SIDE = 128, FRAMES = 1000, MANY_SPP = 400, PIXELS = SIDE * SIDE };
enum { FOVEA, BETWEEN, PERIPHERY, AREAS };
static const char *const area_names[AREAS] = {"within r0", "r0 to r1", "beyond r1"};
static const int judged[] = {1, 10, 100, FRAMES};
enum { JUDGED = sizeof judged / sizeof judged[0] };

struct stage {
    struct fv_config config;
    struct fv_scene scene;
    struct fv_tracer tracer;
    struct fv_workers workers;
    struct fv_plan plan[2];
    struct fv_session session[2];
    struct fv_loop loop[2]; /* full, reproject */
    uint8_t reference[4 * PIXELS];
};

static void open_stage(struct stage *s)
{
    struct fv_error error;
    struct fv_config_request request = {
        .sets = 8,
        .set = {"scene.name=cornell", "scene.path_seconds=0", "display.eyes=1", "display.width=128",
                "display.height=128", "fovea.inner_deg=10", "fovea.outer_deg=20", "fovea.p_min=0.05"}};
    if (fv_config_load(&s->config, &request, &error) || fv_scene_load(&s->scene, &s->config, &error) ||
        fv_tracer_open(&s->tracer, &s->scene, &s->config, &error))
        fail_msg("%s", error.text);
    fv_workers_start(&s->workers, 2);
    for (int m = 0; m < 2; m++) {
        s->config.method_spp = m ? 1 : MANY_SPP;
        fv_frame_size(&s->loop[m].frame, &s->config);
        fv_plan_make(&s->plan[m], fv_method_find(m ? "reproject" : "full"), &s->scene, &s->config, &s->loop[m].frame);
        fv_loop_open(&s->loop[m], &s->config, &s->plan[m], &s->tracer, &s->workers, &s->session[m], 1);
    }
}

/* The picture after one more frame, rows packed. */
static void render(struct stage *s, int m, bool shown, uint8_t *picture)
{
    static const double ahead[2][3] = {{0, 0, -1}, {0, 0, -1}};
    struct fv_frame *f = &s->loop[m].frame;
    struct fv_frame_record record;
    struct fv_pose head;
    s->config.method_spp = m ? 1 : MANY_SPP;
    fv_path_pose(&s->config.scene_path, 0, 0, &head);
    fv_loop_frame(&s->loop[m], &head, ahead, 0, 0, &record);
    if (!shown) return;
    fv_pass_run(&fv_pass_present, f, &s->workers);
    for (int y = 0; y < SIDE; y++)
        memcpy(picture + 4 * SIDE * y, (uint8_t *)f->buffer[FV_PICTURE][0] + 4 * f->stride * y, 4 * SIDE);
}

/* Root of the mean squared error of each area, in steps of 8-bit values. */
static void errors_of(const struct stage *s, const uint8_t *picture, double rmse[AREAS])
{
    double n[AREAS] = {0};
    memset(rmse, 0, AREAS * sizeof *rmse);
    for (int i = 0; i < PIXELS; i++) {
        double e = (double)fv_eccentricity_deg(&s->loop[1].frame.view[0], (float)(i % SIDE) + 0.5f,
                                               (float)(i / SIDE) + 0.5f);
        int area = e < 10 ? FOVEA : e < 20 ? BETWEEN : PERIPHERY;
        for (int c = 0; c < 3; c++) {
            double d = (double)picture[4 * i + c] - s->reference[4 * i + c];
            rmse[area] += d * d;
        }
        n[area] += 3;
    }
    for (int a = 0; a < AREAS; a++) rmse[a] = sqrt(rmse[a] / n[a]);
}

static void error_falls_where_nothing_moves(void **state)
{
    static struct stage s;
    static uint8_t picture[4 * PIXELS];
    double rmse[JUDGED][AREAS];
    (void)state;
    open_stage(&s);
    render(&s, 0, true, s.reference);
    for (int n = 1, at = 0; n <= FRAMES; n++) {
        bool shown = n == judged[at];
        render(&s, 1, shown, picture);
        if (shown) errors_of(&s, picture, rmse[at++]);
    }
    for (int a = 0; a < AREAS; a++) {
        print_message("%s: RMSE of 255 after", area_names[a]);
        for (int i = 0; i < JUDGED; i++) print_message(" %d frames %.2f,", judged[i], rmse[i][a]);
        print_message(" of %d samples a pixel\n", MANY_SPP);
        for (int i = 1; i < JUDGED; i++) assert_true(rmse[i][a] < 1.02 * rmse[i - 1][a]);
        assert_true(rmse[JUDGED - 1][a] < 0.5 * rmse[0][a]);
    }
    fv_workers_stop(&s.workers);
    fv_tracer_close(&s.tracer);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(error_falls_where_nothing_moves)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
