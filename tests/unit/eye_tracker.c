/* eye_tracker: simulated camera frames through the whole chain, pupil, glints, map, both eyes, against the
 * gaze that the frames were drawn from: how far off, how late at landings, what a blink is, what is told as
 * uncertain. */
#include "sensors/eye/binocular.h"
#include "sensors/eye/image_sim.h"

#include "tests/support/program.h"

#include <math.h>
#include <time.h>

enum { WIDTH = 320, HEIGHT = 240, HZ = 120, SECONDS = 4, FRAMES = HZ * SECONDS, GRID = 3 };
static const double degree = M_PI / 180;
static uint8_t pixels[WIDTH * HEIGHT];
static struct fv_eye_tracker tracker[2];
static struct fv_eye_camera camera[2];
static void *scratch;
static size_t bytes;
static int64_t spent_ns[FRAMES * 2];

static int64_t clock_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (int64_t)t.tv_sec * 1000000000 + t.tv_nsec;
}

/* As the camera sees it: it faces the eye. */
static struct fv_eye_state looking(const double at_deg[2], double pupil_mm, int64_t t_ns)
{
    struct fv_eye_state s = {.t_ns = t_ns, .pupil_mm = pupil_mm, .open = 1};
    fv_gaze_vector(at_deg, s.direction);
    s.direction[0] = -s.direction[0];
    return s;
}

static struct fv_eye_look look_at(int eye, const struct fv_eye_state *state)
{
    struct fv_eye_frame frame = {pixels, WIDTH, HEIGHT, WIDTH};
    struct fv_eye_look look;
    fv_eye_image(&camera[eye], state, pixels, WIDTH, NULL);
    fv_eye_tracker_frame(&tracker[eye], &frame, state->t_ns, &look);
    return look;
}

/* Looks at 9 targets as a user does, 5 frames each; then the map. */
static void calibrate(int eye)
{
    static struct fv_gaze_target target[GRID * GRID * 5];
    struct fv_eye_settings settings = {
        .model = FV_EYE_MODEL_USUAL, .confidence = 0.5, .leds = camera[eye].leds};
    int n = 0;
    fv_eye_tracker_begin(&tracker[eye], &settings, scratch, bytes);
    for (int k = 0; k < 5 * GRID * GRID; k++) {
        double at[2] = {18.0 * (k / 5 % GRID - 1), 11.0 * (k / 5 / GRID - 1)};
        struct fv_eye_state s = looking(at, 3.5 + 0.3 * (k % 5), k * 8000000 + 1);
        struct fv_eye_look look = look_at(eye, &s);
        target[n].feature = look.feature;
        target[n].direction_deg[0] = at[0], target[n].direction_deg[1] = at[1];
        target[n++].weight = look.seen ? look.confidence : 0;
    }
    enum fv_gaze_refusal refusal = fv_gaze_calibrate(target, n, &settings.map);
    if (refusal != FV_GAZE_CALIBRATED) fail_msg("%s", fv_gaze_refusal_text[refusal]);
    print_message("eye %d calibrated: %.2f deg by the pupil, %.2f by pupil minus glint\n", eye,
                  settings.map.pupil.error_deg, settings.map.difference.error_deg);
    assert_true(settings.map.difference.terms > 0);
    struct fv_glint_ring ring = tracker[eye].ring;
    fv_eye_tracker_begin(&tracker[eye], &settings, scratch, bytes);
    tracker[eye].ring = ring;
}

static double angle_deg(const double a[3], const double b[3])
{
    double cross[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    double sine = sqrt(cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2]);
    return atan2(sine, a[0] * b[0] + a[1] * b[1] + a[2] * b[2]) / degree;
}

static int by_size(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double part_of(double *value, int n, double part)
{
    if (n == 0) return INFINITY;
    qsort(value, (size_t)n, sizeof *value, by_size);
    return value[(int)(part * (n - 1))];
}

struct outcome {
    double median, p95, landing_p90,
        within; /* degrees; within: share of errors that the uncertainty covers */
    int shut, blinks, open, seen, saccades;
};

/* A stream of the simulated eyes. eyes: 1 or 2 cameras; apart_ns: the second camera's frames come so much
 * later. */
static struct outcome stream(int eyes, uint64_t seed, int64_t apart_ns)
{
    static struct fv_binocular b;
    static double error[FRAMES * 2], landing[FRAMES];
    struct outcome o = {0};
    struct fv_gaze_sample truth, before, sample;
    int n = 0, covered = 0, landings = 0, timed = 0;
    double speed_before = 0;
    fv_binocular_begin(&b, 0.03);
    fv_sim_gaze(seed, 0, &before);
    for (int i = 1; i < FRAMES; i++) {
        int64_t t_ns = i * INT64_C(1000000000) / HZ;
        struct fv_eye_look look[2];
        bool any = false;
        for (int eye = 0; eye < eyes; eye++) {
            struct fv_eye_state s;
            fv_eye_state_at(seed, eye, t_ns + eye * apart_ns, &s);
            int64_t begun_ns = clock_ns();
            look[eye] = look_at(eye, &s);
            spent_ns[timed++] = clock_ns() - begun_ns;
            if (apart_ns) any = fv_binocular_add(&b, eye ? NULL : &look[0], eye ? &look[1] : NULL, &sample);
        }
        if (!apart_ns) any = fv_binocular_add(&b, &look[0], eyes > 1 ? &look[1] : NULL, &sample);
        if (!any) continue;
        fv_sim_gaze(seed, sample.t_ns, &truth);
        struct fv_eye_state s;
        fv_eye_state_at(seed, 0, sample.t_ns, &s);
        if (s.open <= 0) {
            o.shut++;
            o.blinks += !sample.valid;
        }
        double speed = angle_deg(truth.direction[0], before.direction[0]) * HZ;
        if (s.open >= 1) {
            o.open++;
            o.seen += sample.valid;
        }
        if (s.open >= 1 && sample.valid) {
            double off = angle_deg(sample.direction[0], truth.direction[0]);
            if (eyes == 2) off = fmax(off, angle_deg(sample.direction[1], truth.direction[1]));
            covered += off <= 2.5 * sample.uncertainty_deg;
            /* The first sample after a saccade. */
            if (speed_before > 60 && speed < 20) landing[landings++] = off;
            error[n++] = off;
        }
        o.saccades += b.event == FV_EVENT_SACCADE;
        speed_before = speed;
        before = truth;
    }
    o.median = part_of(error, n, 0.5);
    o.p95 = part_of(error, n, 0.95);
    o.landing_p90 = part_of(landing, landings, 0.9);
    o.within = (double)covered / n;
    print_message(
        "%d eyes, seed %d: median %.2f deg, 95 %% %.2f, %d landings 90 %% %.2f; within 2.5 times the "
        "uncertainty %.1f %%; blinks %d of %d, seen %d of %d\n",
        eyes, (int)seed, o.median, o.p95, landings, o.landing_p90, 100 * o.within, o.blinks, o.shut, o.seen,
        o.open);
    return o;
}

static void judge(struct outcome o, double median, double p95)
{
    assert_true(o.median < median && o.p95 < p95);
    assert_true(o.landing_p90 < p95);
    assert_true(o.within > 0.9);
    assert_true(o.shut > 4 && o.blinks >= o.shut - 1);
    assert_true(o.seen >= o.open * 95 / 100);
    assert_true(o.saccades > 10);
}

static void both_eyes(void **state)
{
    (void)state;
    for (int eye = 0; eye < 2; eye++) calibrate(eye);
    judge(stream(2, 5, 0), 0.6, 1.5);
}

static void one_eye(void **state)
{
    (void)state;
    calibrate(0);
    judge(stream(1, 6, 0), 0.6, 1.5);
    assert_true(tracker[0].with_glint > tracker[0].seen / 2);
}

/* Cameras that take turns: each sample is of its own time. */
static void in_turns(void **state)
{
    (void)state;
    for (int eye = 0; eye < 2; eye++) calibrate(eye);
    judge(stream(2, 5, 4166667), 0.8, 2);
}

/* Without a calibration: this camera is where the model has it, and the uncertainty says that nobody knows.
 */
static void by_the_model(void **state)
{
    (void)state;
    struct fv_eye_settings settings = {.model = FV_EYE_MODEL_USUAL, .confidence = 0.5};
    fv_eye_tracker_begin(&tracker[0], &settings, scratch, bytes);
    for (int i = -2; i <= 2; i++)
        for (int j = -1; j <= 1; j++) {
            double at[2] = {9.0 * i, 9.0 * j};
            struct fv_eye_state s = looking(at, 4, 1000000 * (20 + 3 * i + j));
            struct fv_eye_look look = look_at(0, &s);
            assert_true(look.seen && look.error_deg >= FV_EYE_MODEL_ERROR_DEG);
            if (hypot(look.at_deg[0] - at[0], look.at_deg[1] - at[1]) > 1)
                fail_msg("%g %g for %g %g", look.at_deg[0], look.at_deg[1], at[0], at[1]);
        }
    /* Mirrored. */
    settings.model.radius = -settings.model.radius;
    fv_eye_tracker_begin(&tracker[0], &settings, scratch, bytes);
    double at[2] = {10, 5};
    struct fv_eye_state s = looking(at, 4, 1);
    struct fv_eye_look look = look_at(0, &s);
    assert_true(hypot(look.at_deg[0] + at[0], look.at_deg[1] - at[1]) < 1);
}

/* Frames that show no eye, or are too large for the memory, or of settings that make no sense: not seen,
 * never NaN. */
static void odd_frames(void **state)
{
    (void)state;
    struct fv_eye_settings settings = {.model = {NAN, INFINITY, 0}, .confidence = 0, .leds = 99};
    struct fv_eye_look look;
    fv_eye_tracker_begin(&tracker[0], &settings, scratch, bytes);
    static const int sizes[][2] = {{WIDTH, HEIGHT}, {8, 8}, {1, 1}, {100000, 2}, {0, 0}};
    for (int i = 0; i < 5; i++) {
        struct fv_eye_frame frame = {pixels, sizes[i][0], sizes[i][1], WIDTH};
        for (int grey = 0; grey < 256; grey += 85) {
            memset(pixels, grey, sizeof pixels);
            fv_eye_tracker_frame(&tracker[0], &frame, i, &look);
            assert_true(!look.seen && look.at_deg[0] == 0 && look.error_deg == 0);
        }
    }
    double at[2] = {3, 3};
    struct fv_eye_state s = looking(at, 4, 9);
    look = look_at(0, &s); /* a model that is none */
    assert_false(look.seen);
    assert_true(look.confidence > 0.5);
}

static void timing(void **state)
{
    (void)state;
    static struct fv_pupil_track fresh;
    double cost[300];
    struct fv_eye_frame frame = {pixels, WIDTH, HEIGHT, WIDTH};
    struct fv_eye_look look;
    calibrate(0);
    for (int i = 0; i < 300; i++) {
        struct fv_eye_state s;
        if (i % 10 == 0) {
            fv_eye_state_at(6, 0, i * INT64_C(8000000), &s);
            fv_eye_image(&camera[0], &s, pixels, WIDTH, NULL);
        }
        if (i % 2) tracker[0].track = fresh; /* a search in the whole frame */
        int64_t begun_ns = clock_ns();
        fv_eye_tracker_frame(&tracker[0], &frame, 1000000000 + i, &look);
        cost[i] = (double)(clock_ns() - begun_ns) * 1e-6;
    }
    print_message("a frame of %dx%d to a gaze: median %.3f ms, 99 %% %.3f ms of CPU time\n", WIDTH, HEIGHT,
                  part_of(cost, 300, 0.5), part_of(cost, 300, 0.99));
}

static int begin(void **state)
{
    (void)state;
    bytes = (fv_pupil_scratch_bytes(WIDTH, HEIGHT) + 63) & ~(size_t)63;
    scratch = aligned_alloc(64, bytes);
    for (int eye = 0; eye < 2; eye++) camera[eye] = fv_eye_camera_usual(WIDTH, HEIGHT, 3 + (uint64_t)eye);
    return scratch == NULL;
}

static int end(void **state)
{
    (void)state;
    free(scratch);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(both_eyes),  cmocka_unit_test(one_eye),
                                       cmocka_unit_test(in_turns),   cmocka_unit_test(by_the_model),
                                       cmocka_unit_test(odd_frames), cmocka_unit_test(timing)};
    return cmocka_run_group_tests(tests, begin, end);
}
