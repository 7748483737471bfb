/* frames: the loop over very many frames, and where frame numbers, which are seeds too, wrap in 32 bits:
 * pictures do not depend on how many frames went before.
 *
 * frames [N]: N frames in a row, 4000 by default; the label soak runs 1e7. */
#include "cli/cli.h"
#include "tests/support/program.h"
#include "tests/support/shown.h"

#include <math.h>

enum { EYES = 2, SEQUENCE = 8, PERIOD = 100 };
static int64_t frames_in_a_row = 4000;
static struct fv_setup setups[3];

/* A small cornell box, whose area light draws random numbers. */
static struct fv_setup *opened(struct fv_setup *s, const char *method)
{
    struct fv_error error;
    const struct fv_config_request request = {
        .sets = 15,
        .set = {"scene.name=cornell", method, "method.spp=3", "display.sink=none", "display.width=48",
                "display.height=40", "display.fov_in_deg=25", "display.fov_out_deg=20",
                "display.fov_up_deg=22", "display.fov_down_deg=22", "fovea.inner_deg=3", "fovea.outer_deg=8",
                "fovea.p_min=0.1", "threads.workers=1", "method.area_spp=1"}};
    if (s->loop.frame.width) return s;
    if (fv_setup_open(s, &request, &error) || fv_setup_take(s, PERIOD, &error)) fail_msg("%s", error.text);
    return s;
}

/* Where the viewer stands and looks in a frame: the same every PERIOD frames. */
static void pose_of(const struct fv_setup *s, int64_t number, struct fv_pose *head, double gaze[2][3])
{
    struct fv_pose stand, turn = {{0, 0, 0}, {1, 0, 0, 0}};
    double at = (double)(number % PERIOD) * 2 * M_PI / PERIOD;
    fv_path_pose(&s->config.scene_path, 0, 0, &stand);
    fv_quat_from_yaw_pitch_roll(0.2 * sin(at), 0.1 * cos(at), 0, turn.rotation);
    fv_pose_compose(&stand, &turn, head);
    for (int eye = 0; eye < 2; eye++) {
        gaze[eye][0] = 0.2 * cos(at), gaze[eye][1] = 0;
        gaze[eye][2] = -sqrt(1 - gaze[eye][0] * gaze[eye][0]);
    }
}

/* As if nothing had been rendered before: black, and no history anywhere. */
static void clear_history(struct fv_setup *s)
{
    for (int b = FV_COLOUR; b <= FV_COARSEST_HISTORY_CACHE; b++)
        if (s->plan.buffers & FV_BIT(b)) memset(s->loop.frame.buffer[b][0], b % 2 ? 0xff : 0, (size_t)s->plan.bytes[b]);
}

/* FNV-1a of both eyes' pixels, flags too. */
static uint64_t fingerprint(const struct fv_frame *f)
{
    uint64_t h = 0xcbf29ce484222325u;
    for (int eye = 0; eye < EYES; eye++)
        for (int y = 0; y < f->height; y++)
            for (int x = 0; x < f->width; x++)
                h = (h ^ shown_pixel(f, eye, x, y)) * 0x100000001b3u;
    return h;
}

static void sequence(struct fv_setup *s, int64_t first, uint64_t out[SEQUENCE])
{
    clear_history(s);
    s->loop.frame.number = first;
    for (int n = 0; n < SEQUENCE; n++) {
        struct fv_frame_record r;
        struct fv_pose head;
        double gaze[2][3];
        pose_of(s, n, &head, gaze);
        fv_loop_frame(&s->loop, &head, gaze, 0.3, n, &r);
        assert_true(r.frame == first + n && s->loop.frame.number == first + n + 1);
        out[n] = fingerprint(&s->loop.frame);
    }
}

/* Frame numbers that agree in their low 32 bits give the same bytes, across the wrap and at the end of int64.
 */
static void numbers_wrap(void **state)
{
    (void)state;
    static const int64_t around[] = {(INT64_C(1) << 32) - 4, (INT64_C(1) << 33) - 4, (INT64_C(1) << 53) - 4,
                                     INT64_MAX - UINT32_MAX - 4};
    static const int64_t half[] = {(INT64_C(1) << 31) - 4, (INT64_C(3) << 31) - 4,
                                   INT64_MAX - UINT32_MAX - (INT64_C(1) << 31) - 4};
    static const char *const methods[] = {"method.name=full", "method.name=reproject"};
    for (int m = 0; m < 2; m++) {
        struct fv_setup *s = opened(&setups[m], methods[m]);
        uint64_t expected[SEQUENCE], got[SEQUENCE];
        sequence(s, around[0], expected); /* so that all begin with the same view before */
        sequence(s, around[0], expected);
        for (unsigned i = 1; i < 4; i++) {
            sequence(s, around[i], got);
            assert_memory_equal(got, expected, sizeof got);
        }
        for (int n = 1; n < SEQUENCE; n++) assert_true(expected[n] != expected[0]);
        sequence(s, half[0], expected);
        for (unsigned i = 1; i < 3; i++) {
            sequence(s, half[i], got);
            assert_memory_equal(got, expected, sizeof got);
        }
    }
}

/* Mean of the 10-bit channels; with the standing head, only the seed changes from frame to frame. */
static double brightness(struct fv_setup *s, int64_t number)
{
    struct fv_frame_record r;
    struct fv_pose head;
    double gaze[2][3], sum = 0;
    pose_of(s, 0, &head, gaze);
    s->loop.frame.number = number;
    fv_loop_frame(&s->loop, &head, gaze, 0.3, 0, &r);
    const struct fv_frame *f = &s->loop.frame;
    for (int y = 0; y < f->height; y++)
        for (int x = 0; x < f->width; x++) {
            uint32_t pixel = shown_pixel(f, 0, x, y);
            sum += (pixel & 1023) + (pixel >> 10 & 1023) + (pixel >> 20 & 1023);
        }
    return sum / (3.0 * f->width * f->height);
}

/* Seeds around 2^31, 2^32 and 2^53 light the room as those at the start do. */
static void seeds_are_even(void **state)
{
    (void)state;
    static const int64_t starts[] = {1,
                                     (INT64_C(1) << 31) - 8,
                                     (INT64_C(1) << 32) / 3 - 8,
                                     (INT64_C(1) << 32) - 8,
                                     (INT64_C(1) << 53) - 8,
                                     INT64_MAX / 3 - 8};
    struct fv_setup *s = opened(&setups[0], "method.name=full");
    double usual = 0;
    for (unsigned k = 0; k < 6; k++) {
        double sum = 0, least = INFINITY, most = 0;
        for (int n = 0; n < 16; n++) {
            double b = brightness(s, starts[k] + n);
            sum += b / 16, least = fmin(least, b), most = fmax(most, b);
        }
        if (k == 0) usual = sum;
        print_message("brightness from frame %lld on: %.2f (%.2f to %.2f) of 1023\n", (long long)starts[k],
                      sum, least, most);
        assert_true(fabs(sum / usual - 1) < 2e-3 && most / least < 1.02);
    }
}

struct run {
    struct fv_setup *s;
    double first_db;
};

static void latch(void *context, int64_t now_ns, int64_t t_ns, struct fv_pose *head, double gaze[2][3],
                  double *uncertainty_deg)
{
    assert_true(now_ns <= t_ns);
    struct run *run = context;
    pose_of(run->s, llround((double)t_ns / (double)run->s->loop.period_ns), head, gaze);
    *uncertainty_deg = 0.3;
}

static bool wants(void *context, int64_t frame, bool last)
{
    (void)context, (void)frame, (void)last;
    return false;
}

static void present(void *context, const struct fv_frame *frame)
{
    (void)context, (void)frame;
    fail_msg("presented, though not wanted");
}

/* PSNR of the last frame's left picture against every pixel traced. */
static double decibel(const struct fv_setup *s, int64_t number)
{
    struct fv_setup *full = opened(&setups[2], "method.name=full");
    struct fv_frame_record r;
    struct fv_pose head;
    double gaze[2][3], sum = 0;
    pose_of(s, number, &head, gaze);
    fv_loop_frame(&full->loop, &head, gaze, 0.3, 0, &r);
    const struct fv_frame *f = &s->loop.frame;
    for (int y = 0; y < f->height; y++)
        for (int x = 0; x < f->width; x++) {
            uint32_t a = shown_pixel(f, 0, x, y);
            uint32_t b = shown_pixel(&full->loop.frame, 0, x, y);
            for (int shift = 0; shift < 30; shift += 10)
                sum += pow((double)(a >> shift & 1023) - (double)(b >> shift & 1023), 2);
        }
    return 10 * log10(1023.0 * 1023.0 * 3 * f->width * f->height / sum);
}

static bool after(void *context, const struct fv_session *session, const struct fv_frame_record *r)
{
    struct run *run = context;
    if (!(isfinite(r->frame_ms) && r->frame_ms >= 0 && r->rays[FV_RAY_PRIMARY] > 0 &&
          r->sampled_fraction > 0 && r->sampled_fraction <= 1))
        fail_msg("frame %lld", (long long)r->frame);
    if (session->frames % PERIOD == 0 && session->frames <= 10 * PERIOD)
        run->first_db = decibel(run->s, session->frames - 1);
    return true;
}

/* History that is carried from frame to frame neither fades nor collects error; records end where their
 * room does, totals go on. */
static void many_frames(void **state)
{
    (void)state;
    struct run run = {.s = opened(&setups[1], "method.name=reproject")};
    struct fv_session *session = &run.s->session;
    const struct fv_loop_io io = {&run, latch, wants, present, NULL, after, NULL, NULL};
    memset(session->record, 0, (size_t)session->capacity * sizeof *session->record);
    clear_history(run.s);
    run.s->loop.frame.number = (INT64_C(1) << 32) - frames_in_a_row / 2; /* wraps half way */
    fv_loop_run(&run.s->loop, &io, frames_in_a_row);
    double last_db = decibel(run.s, frames_in_a_row - 1);
    print_message("%.2f dB after %d frames, %.2f after %lld\n", run.first_db, 10 * PERIOD, last_db,
                  (long long)frames_in_a_row);
    assert_true(session->frames == frames_in_a_row && session->missed <= session->frames);
    assert_true(session->record[PERIOD - 1].t_ns == (PERIOD - 1) * run.s->loop.period_ns);
    assert_true(last_db > 20 && last_db > run.first_db - 1);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(numbers_wrap), cmocka_unit_test(seeds_are_even),
                                       cmocka_unit_test(many_frames)};
    if (argc > 1) frames_in_a_row = strtoll(argv[1], NULL, 10) / PERIOD * PERIOD;
    return cmocka_run_group_tests(tests, NULL, NULL);
}
