/* quality: what foveation costs in rays and in error: the method reproject at the medium configuration
 * (10, 20 degrees, 0.05), after moving frames, against full rendering, both judged by 64 samples a pixel. */
#include "tests/support/program.h"

#include "platform/files.h"
#include "rt/frame/loop.h"
#include "rt/scene/path.h"

#include <math.h>

enum { FRAMES = 20, TIMED = 8 };
enum { FULL, MANY, FOVEATED, METHODS };

struct bench {
    struct fv_config config;
    struct fv_scene scene;
    struct fv_tracer tracer;
    struct fv_workers workers;
    struct fv_plan plan[METHODS];
    struct fv_session session[METHODS];
    struct fv_loop loop[METHODS];
};

static void open_bench(struct bench *b, const char *scene, const char *library)
{
    struct fv_error error;
    char set[600], name[64];
    snprintf(set, sizeof set, "scene.library=%s", library);
    snprintf(name, sizeof name, "scene.name=%s", scene);
    struct fv_config_request request = {.sets = 4, .set = {name, set, "display.eyes=1", "display.headset=rift-dk2"}};
    if (fv_config_load(&b->config, &request, &error) || fv_scene_load(&b->scene, &b->config, &error) ||
        fv_tracer_open(&b->tracer, &b->scene, &b->config, &error))
        fail_msg("%s", error.text);
    fv_workers_start(&b->workers, 2);
    for (int m = 0; m < METHODS; m++) {
        b->config.method_spp = m == MANY ? 64 : 1;
        struct fv_loop *l = &b->loop[m];
        fv_frame_size(&l->frame, &b->config);
        fv_plan_make(&b->plan[m], fv_method_find(m == FOVEATED ? "reproject" : "full"), &b->scene, &b->config, &l->frame);
        fv_loop_open(l, &b->config, &b->plan[m], &b->tracer, &b->workers, &b->session[m], 1);
    }
}

static void render(struct bench *b, int m, int frame, const double gaze[2][3], struct fv_frame_record *record)
{
    struct fv_pose stand, turn = {{0, 0, 0}, {1, 0, 0, 0}}, head;
    /* 60 degrees a second at 75 Hz, a slow walk besides. */
    fv_path_pose(&b->config.scene_path, b->config.scene_path_seconds, 4000000000 + frame * 13333333, &stand);
    fv_quat_from_yaw_pitch_roll(frame * 0.8 * M_PI / 180, 0, 0, turn.rotation);
    fv_pose_compose(&stand, &turn, &head);
    b->config.method_spp = m == MANY ? 64 : 1;
    fv_loop_frame(&b->loop[m], &head, gaze, 0, 0, record);
    fv_pass_run(&fv_pass_present, &b->loop[m].frame, &b->workers);
}

/* PSNR of two pictures over the pixels whose eccentricity lies between two angles. */
static double psnr(const struct fv_frame *a, const struct fv_frame *b, double from_deg, double to_deg)
{
    double sum = 0, n = 0;
    const uint8_t *pa = a->buffer[FV_PICTURE][0], *pb = b->buffer[FV_PICTURE][0];
    for (int y = 0; y < a->height; y++)
        for (int x = 0; x < a->width; x++) {
            float e = fv_eccentricity_deg(&a->view[0], (float)x + 0.5f, (float)y + 0.5f);
            if (e < from_deg || e > to_deg) continue;
            for (int c = 0; c < 3; c++) {
                double d = (double)pa[4 * (y * a->stride + x) + c] - pb[4 * (y * a->stride + x) + c];
                sum += d * d;
                n++;
            }
        }
    return sum > 0 ? 10 * log10(255 * 255 * n / sum) : 100;
}

static void judge(const char *scene, const char *library)
{
    static struct bench b;
    struct fv_frame_record full, many, foveated;
    const double gaze[2][3] = {{0.15, -0.1, -0.98}, {0.15, -0.1, -0.98}};
    memset(&b, 0, sizeof b);
    open_bench(&b, scene, library);
    int64_t rays = 0, all = 0;
    double full_ms = 0, foveated_ms = 0;
    for (int i = 0; i < FRAMES; i++) {
        render(&b, FOVEATED, i, gaze, &foveated);
        if (i == 0) continue; /* the first frame has no history: it is sampled whole, before the display starts */
        if (i >= FRAMES - TIMED) {
            render(&b, FULL, i, gaze, &full);
            full_ms += (double)full.cpu_ms;
            foveated_ms += (double)foveated.cpu_ms;
        }
        rays += foveated.rays[FV_RAY_PRIMARY] + foveated.rays[FV_RAY_SHADOW] + foveated.rays[FV_RAY_SECONDARY];
    }
    render(&b, MANY, FRAMES - 1, gaze, &many);
    all = full.rays[FV_RAY_PRIMARY] + full.rays[FV_RAY_SHADOW] + full.rays[FV_RAY_SECONDARY];
    const struct fv_frame *f = &b.loop[0].frame, *m = &b.loop[1].frame, *r = &b.loop[2].frame;
    double share = (double)rays / (FRAMES - 1) / (double)all, inner_full = psnr(f, m, 0, 10), inner = psnr(r, m, 0, 10);
    print_message("%s: %.1f %% of full's rays, %.2f times as fast; PSNR within 10 degrees %.2f dB (full %.2f), 10-20: %.2f (%.2f), beyond: %.2f (%.2f)\n",
                  scene, 100 * share, full_ms / foveated_ms, inner, inner_full, psnr(r, m, 10, 20), psnr(f, m, 10, 20), psnr(r, m, 20, 180), psnr(f, m, 20, 180));
    assert_true(share < 0.3);
    assert_true(inner > inner_full - 0.5);
    assert_true(psnr(r, m, 20, 180) > 22);
    fv_workers_stop(&b.workers);
    fv_tracer_close(&b.tracer);
}

static void atrium(void **state)
{
    (void)state;
    judge("atrium", "");
}

static void real_scene(void **state)
{
    const char *library = FV_SOURCE_DIR "/../shared/data/scenes";
    if (!fv_file_exists(library)) {
        print_message("%s is not there: skipped\n", library);
        skip();
    }
    judge(*state, library);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(atrium), cmocka_unit_test_prestate(real_scene, "sponza"),
                                       cmocka_unit_test_prestate(real_scene, "sibenik")};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
