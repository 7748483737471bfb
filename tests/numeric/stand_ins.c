/* stand_ins: frames that were cut, in part or wholly: while nothing moves they look like the frame before,
 * where it does they stay near the frame that was not cut, and a poisoned value moves no tile. */
#include "cli/cli.h"
#include "rt/pass/cache.h"
#include "tests/support/program.h"
#include "tests/support/shown.h"

#include <math.h>

enum { EYES = 2, STAGES = 4, FRAMES = 6 };

static struct fv_setup setups[2];
static uint32_t kept[EYES][256 * 256];

static struct fv_setup *opened(struct fv_setup *s, const char *support)
{
    struct fv_error error;
    const struct fv_config_request request = {
        .sets = 13,
        .set = {"scene.name=cornell", support, "display.sink=none", "display.width=200", "display.height=180",
                "display.fov_in_deg=35", "display.fov_out_deg=30", "display.fov_up_deg=32",
                "display.fov_down_deg=32", "threads.workers=2", "method.area_spp=16", "output.tape=off", "method.jitter=off"}};
    if (!s->loop.frame.width && (fv_setup_open(s, &request, &error) || fv_setup_take(s, FRAMES, &error)))
        fail_msg("%s", error.text);
    return s;
}

/* What the next frames are told to be. */
struct told {
    struct fv_setup *setup;
    int level;
    int done[FRAMES]; /* of every stage that can be cut; -1: all */
    double turn;      /* of the head, radians a frame */
    uint32_t poison; /* put into both rasters' caches before the last frame, in the middle of each tile */
    int frame;
};

static void latch(void *context, int64_t now_ns, int64_t show_ns, struct fv_pose *head, double gaze[2][3],
                  double *uncertainty_deg)
{
    struct told *t = context;
    struct fv_pose stand, turn = {{0, 0, 0}, {1, 0, 0, 0}};
    const double ahead[2][3] = {{0.1, 0.1, -1}, {0.1, 0.1, -1}};
    (void)now_ns, (void)show_ns;
    fv_path_pose(&t->setup->config.scene_path, 0, 0, &stand);
    fv_quat_from_yaw_pitch_roll(t->turn * t->frame, 0, 0, turn.rotation);
    fv_pose_compose(&stand, &turn, head);
    memcpy(gaze, ahead, sizeof ahead);
    *uncertainty_deg = 0.3;
}

static bool decided(void *context, int64_t frame, struct fv_decision *d)
{
    struct told *t = context;
    *d = (struct fv_decision){.t_ns = frame * 10000000, .level = t->level, .done = {-1, -1, -1, -1}};
    for (int i = 1; i < STAGES; i++) d->done[i] = t->done[frame];
    t->frame = (int)frame;
    return true;
}

static bool wants(void *context, int64_t frame, bool last)
{
    (void)context, (void)frame, (void)last;
    return false;
}

static void present(void *context, const struct fv_frame *frame)
{
    (void)context, (void)frame;
}

static void keep_shown(const struct fv_frame *f, uint32_t out[EYES][256 * 256])
{
    for (int e = 0; e < EYES; e++)
        for (int y = 0; y < f->height; y++)
            for (int x = 0; x < f->width; x++) out[e][y * f->stride + x] = shown_pixel(f, e, x, y);
}

/* Before the last frame: what it will find as history is kept. */
static bool after(void *context, const struct fv_session *session, const struct fv_frame_record *r)
{
    struct told *t = context;
    struct fv_frame *f = &t->setup->loop.frame;
    (void)session;
    assert_true(r->cut == (t->done[r->frame] >= 0));
    if (r->frame != FRAMES - 2) return true;
    keep_shown(f, kept);
    for (int e = 0; e < EYES && t->poison != 0; e++)
        for (int y = FV_TILE / 2; y < f->height; y += FV_TILE)
            for (int x = FV_TILE / 2; x < f->width; x += FV_TILE)
                for (int n = 0; n < 4; n++) { /* wherever the node's middle is rounded to */
                    int row = y + n / 2 * 4, column = x + n % 2 * 4;
                    f->raster[FV_FINE][e].cache[row * f->stride + column] = t->poison;
                    for (int d = FV_COARSE; d < FV_DENSITIES; d++)
                        f->raster[d][e].cache[(row >> d) * (f->stride >> d) + (column >> d)] = t->poison;
                }
    return true;
}

static void run(struct told *t)
{
    const struct fv_loop_io io = {t, latch, wants, present, decided, after, NULL, NULL};
    fv_loop_restart(&t->setup->loop);
    t->setup->session.frames = 0;
    fv_loop_run(&t->setup->loop, &io, FRAMES);
}

/* Root of the mean square difference to `other` in 1023ths, and the share of pixels that differ by over 100.
 */
static double difference(const struct fv_frame *f, uint32_t other[EYES][256 * 256], double *share)
{
    double sum = 0, far = 0;
    for (int e = 0; e < EYES; e++)
        for (int y = 0; y < f->height; y++)
            for (int x = 0; x < f->width; x++) {
                uint32_t a = shown_pixel(f, e, x, y), b = other[e][y * f->stride + x];
                int most = 0;
                for (int shift = 0; shift < 30; shift += 10) {
                    int d = abs((int)(a >> shift & 1023) - (int)(b >> shift & 1023));
                    sum += d * d;
                    most = d > most ? d : most;
                }
                far += most > 100;
            }
    double pixels = (double)EYES * f->width * f->height;
    *share = far / pixels;
    return sqrt(sum / (3 * pixels));
}

static const struct {
    const char *support;
    int level;
} settings[] = {
    {"method.support=8", 0}, {"method.support=4", 0}, {"method.support=8", 9}, {"method.support=8", 1}};
enum { SETTINGS = sizeof settings / sizeof settings[0] };

static void still(void **state)
{
    (void)state;
    for (int i = 0; i < SETTINGS; i++)
        for (int done = 0; done <= 60; done += 20) {
            struct told t = {opened(&setups[i == 1], settings[i].support),
                             settings[i].level,
                             {-1, -1, -1, -1, -1, done},
                             0,
                             0,
                             0};
            double share;
            run(&t);
            double rms = difference(&t.setup->loop.frame, kept, &share);
            if (!(rms < 25 && share < 0.01))
                fail_msg("%s, level %d, %d tiles done: %.1f off, %.3f %% far off", settings[i].support,
                         settings[i].level, done, rms, 100 * share);
        }
}

/* Of 0.5 degrees a frame; the first frames cut too. */
static void turning(void **state)
{
    (void)state;
    static uint32_t uncut[EYES][256 * 256];
    for (int i = 0; i < SETTINGS; i++) {
        struct told t = {opened(&setups[i == 1], settings[i].support),
                         settings[i].level,
                         {-1, -1, -1, -1, -1, -1},
                         0.0087,
                         0,
                         0};
        struct fv_frame *f = &t.setup->loop.frame;
        double share;
        run(&t);
        keep_shown(f, uncut);
        for (int cut = 1; cut <= 3; cut++) {
            for (int n = 0; n < FRAMES; n++) t.done[n] = n >= FRAMES - cut ? 10 : -1;
            run(&t);
            double rms = difference(f, uncut, &share);
            if (!(rms < 25 + 12 * cut && share < 0.03 + 0.015 * cut))
                fail_msg("%s, level %d, %d frames cut: %.1f off, %.2f %% far off", settings[i].support,
                         settings[i].level, cut, rms, 100 * share);
        }
    }
    /* The very first frame: what was not sampled comes from the support image, which is never cut then. */
    struct told t = {opened(&setups[0], settings[0].support), 0, {10, -1, -1, -1, -1, -1}, 0, 0, 0};
    run(&t);
}

static void poisoned(void **state)
{
    (void)state;
    /* The depths infinity, 1e30, NaN and none; 0, long ago; 0.1, just now and certain. */
    static const uint32_t odd[] = {0xff000000, 0xe2940000, 0xff800000, 0xffffffff, 0x000000ff, 0x7b9aff00};
    for (int i = 0; i < (int)(sizeof odd / sizeof odd[0]); i++) {
        struct told t = {opened(&setups[0], settings[0].support), 0, {-1, -1, -1, -1, -1, 0}, 0.002, 0, 0};
        static uint32_t clean[EYES][256 * 256];
        struct fv_frame *f = &t.setup->loop.frame;
        double share;
        run(&t);
        keep_shown(f, clean);
        t.poison = odd[i];
        run(&t);
        double rms = difference(f, clean, &share);
        if (!(rms < 10 && share < 0.005))
            fail_msg("%08x: %.1f off, %.3f %% far off", odd[i], rms, 100 * share);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(still),
        cmocka_unit_test(turning),
        cmocka_unit_test(poisoned),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
