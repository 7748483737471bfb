/* Latches for a picture that is shown later: nothing is used that is not known yet, heads are predicted,
 * gazes carry what they may have moved, and a recording gives it all again to the bit. */
#include "sensors/motion.h"
#include "sensors/predict.h"
#include "sensors/sensors.h"
#include "sensors/tape.h"
#include "tests/support/opened_sensors.h"
#include "tests/support/random.h"

#include <math.h>

#define COUNT(table) (sizeof table / sizeof table[0])
static const int64_t ms = 1000000;
static const double degree = M_PI / 180;

static void open_tape(struct fv_writer *writer, const char *name)
{
    struct fv_error error;
    char path[256];
    snprintf(path, sizeof path, "%s/%s", program_folder(), name);
    assert_int_equal(fv_writer_open(writer, path, &error), 0);
    if (name[0] == 'h') fv_tape_begin_head(writer);
    else fv_tape_begin_gaze(writer);
}

static void close_tape(struct fv_writer *writer)
{
    struct fv_error error;
    assert_int_equal(fv_writer_close(writer, &error), 0);
}

/* gaze.csv: the left eye at these angles to the right, the right one straight ahead, every 5 ms; NAN: lost.
 * Another one at 9 s keeps the tape from starting again. */
static void write_gazes(int rows, const double *right_deg)
{
    static struct fv_writer w;
    open_tape(&w, "gaze.csv");
    for (int i = 0; i <= rows; i++) {
        double a = (i < rows ? right_deg[i] : 0) * degree;
        struct fv_gaze_sample s = {
            i < rows ? 5 * ms * i : 9000 * ms, {{sin(a), 0, -cos(a)}, {0, 0, -1}}, !isnan(a), 0};
        if (isnan(a)) memset(s.direction, 0, sizeof s.direction);
        fv_tape_write_gaze(&w, &s);
    }
    close_tape(&w);
}

static void words_are_predictors(void **state)
{
    (void)state;
    char words[64] = "";
    for (int p = 0; p < FV_HEAD_PREDICTORS; p++)
        snprintf(words + strlen(words), sizeof words - strlen(words), "%s%s", p ? "|" : "",
                 fv_head_predictors[p].name);
    assert_string_equal(fv_key_find("imu.predict")->unit, words);
    struct fv_sensors *s;
    struct fv_error error = {""};
    struct fv_config *c = sensor_settings("sim", "sim", 1, 1);
    strcpy(c->imu_predict, "crystal ball");
    assert_int_equal(fv_sensors_open(&s, c, &error), -1);
    assert_non_null(strstr(error.text, "imu.predict: 'crystal ball' is no way to predict"));
}

static void known_when_shown_is_as_it_is(void **state)
{
    (void)state;
    struct fv_sensors *s = opened(sensor_settings("sim", "sim", 1, 1));
    for (int64_t t_ns = 0; t_ns < 3000 * ms; t_ns += 13333333) {
        struct fv_pose head, want;
        struct fv_gaze gaze;
        struct fv_gaze_sample sample;
        fv_sim_head(1, t_ns, &want);
        fv_sim_gaze(1, t_ns, &sample);
        for (int64_t later = 0; later <= 100 * ms;
             later += 50 * ms) { /* the picture is shown before it is known */
            fv_sensors_latch(s, t_ns + later, t_ns, &head, &gaze);
            assert_memory_equal(&head, &want, sizeof head);
            if (!sample.valid) continue;
            assert_true(gaze.t_ns == t_ns && gaze.uncertainty_deg == 0.3);
            assert_memory_equal(gaze.direction, sample.direction, sizeof gaze.direction);
        }
    }
}

/* Two recordings that part after 500 ms say the same as long as it is not later than that. */
static void nothing_later_is_used(void **state)
{
    (void)state;
    static struct fv_sensors *s[2];
    static const int64_t horizons_ns[] = {1, 100, 5000000, 15000000, 30000000, 99999999, 5000000000};
    for (int which = 0; which < 2; which++) {
        static struct fv_writer heads, gazes;
        open_tape(&heads, "head.csv"), open_tape(&gazes, "gaze.csv");
        for (int64_t i = 0; i < 100; i++) {
            uint64_t seed = which == 1 && i > 50 ? 7 : 1;
            struct fv_head_sample h = {.t_ns = i * 10 * ms};
            struct fv_gaze_sample g;
            fv_sim_head(seed, i * 10 * ms, &h.pose), fv_sim_gaze(seed, i * 10 * ms, &g);
            fv_tape_write_head(&heads, &h), fv_tape_write_gaze(&gazes, &g);
        }
        close_tape(&heads), close_tape(&gazes);
        s[which] = opened(sensor_settings("tape", "tape", 1, 1));
    }
    int different = 0;
    for (int64_t now_ns = 0; now_ns < 600 * ms; now_ns += 3333333)
        for (unsigned k = 0; k < COUNT(horizons_ns); k++) {
            struct fv_pose head[2];
            struct fv_gaze gaze[2];
            memset(gaze, 0, sizeof gaze);
            for (int i = 0; i < 2; i++)
                fv_sensors_latch(s[i], now_ns, now_ns + horizons_ns[k], &head[i], &gaze[i]);
            bool same = memcmp(&head[0], &head[1], sizeof head[0]) == 0 &&
                        memcmp(&gaze[0], &gaze[1], sizeof gaze[0]) == 0;
            if (now_ns < 510 * ms && !same) fail_msg("different at %lld ms", (long long)(now_ns / ms));
            different += !same;
        }
    assert_true(different > 100);
}

/* Between two readings of a simulated device nothing new is known. */
static void simulated_devices_have_a_rate(void **state)
{
    (void)state;
    struct fv_sensors *s = opened(sensor_settings("sim", "sim", 1, 1));
    for (int64_t n = 1; n < 400; n++) {
        struct fv_pose head[2];
        struct fv_gaze gaze[2];
        int64_t show_ns = n * 5 * ms + 20 * ms;
        fv_sensors_latch(s, n * 5 * ms, show_ns, &head[0], &gaze[0]);
        fv_sensors_latch(s, n * 5 * ms + 999999, show_ns, &head[1], &gaze[1]);
        assert_memory_equal(&head[0], &head[1], sizeof head[0]);
        if (gaze[0].held) continue;
        assert_true(gaze[0].t_ns == n * 5 * ms && gaze[1].t_ns == n * 5 * ms);
        assert_memory_equal(gaze[0].direction, gaze[1].direction, sizeof gaze[0].direction);
        assert_true(gaze[0].uncertainty_deg == gaze[1].uncertainty_deg);
        fv_sensors_latch(s, n * 5 * ms + 4 * ms, show_ns, &head[1], &gaze[1]);
        assert_true(gaze[1].t_ns == n * 5 * ms);
        assert_true(memcmp(&head[0], &head[1], sizeof head[0]) != 0);
    }
}

/* The left eye's last five gazes (degrees right, 5 ms apart), known at 20 ms + age, shown after the horizon;
 * what is added to the noise of 0.3 degrees. */
static const struct {
    const char *what;
    double right_deg[5];
    int64_t age_ns, horizon_ns;
    double more_deg;
} moves[] = {
    {"still", {5, 5, 5, 5, 5}, 0, 15000000, 0},
    {"within the noise", {5, 5.1, 4.9, 5, 5.299}, 4999999, 95000000, 0},
    {"pursuit at 30 deg/s", {0, 0.15, 0.3, 0.45, 0.6}, 0, 15000000, 15 * 0.015},
    {"to the left, sampled 4 ms ago", {0.6, 0.45, 0.3, 0.15, 0}, 4000000, 15000000, 15 * 0.019},
    {"100 deg/s", {0, 0.5, 1, 1.5, 2.3}, 0, 10000000, 1},
    {"a saccade", {0, 2, 4, 6, 8}, 0, 15000000, 1.5},
    {"across the view", {-80, 80, -80, 80, -80}, 0, 15000000, 0},
    {"across the view and not back", {-80, 80, -80, 80, 80}, 0, 15000000, 1.5},
    {"just found", {NAN, NAN, NAN, NAN, 8}, 0, 15000000, 1.5},
    {"lost between", {0, NAN, NAN, NAN, 0.6}, 0, 15000000, 15 * 0.015},
    {"as far ahead as is predicted", {0, 2, 4, 6, 8}, 0, 100000000, 10},
    {"farther", {0, 2, 4, 6, 8}, 0, 5000000000, 10},
    {"farther, nearly stale", {0, 2, 4, 6, 8}, 100000000, 5000000000, 19.7},
};

static void gazes_may_have_moved(void **state)
{
    (void)state;
    for (unsigned n = 0; n < COUNT(moves); n++) {
        write_gazes(5, moves[n].right_deg);
        struct fv_sensors *s = opened(sensor_settings("tape", "none", 1, 1));
        struct fv_pose head;
        struct fv_gaze gaze;
        int64_t now_ns = 20 * ms + moves[n].age_ns;
        fv_sensors_latch(s, now_ns, now_ns + moves[n].horizon_ns, &head, &gaze);
        if (gaze.held || gaze.t_ns != 20 * ms ||
            !(fabs(gaze.uncertainty_deg - 0.3 - moves[n].more_deg) < 1e-9))
            fail_msg("%s: %.12g", moves[n].what, gaze.uncertainty_deg);
        assert_true(fabs(gaze.direction[0][0] - sin(moves[n].right_deg[4] * degree)) < 1e-15);
        if (moves[n].horizon_ns > 100 * ms) continue;
        /* Lost from here on: what is not known only grows. */
        double before_deg = gaze.uncertainty_deg;
        for (int64_t t = 130; t < 1500; t += 10) {
            fv_sensors_latch(s, t * ms, (t + 15) * ms, &head, &gaze);
            assert_true(gaze.held && gaze.t_ns == 20 * ms && gaze.uncertainty_deg >= before_deg);
            before_deg = gaze.uncertainty_deg;
        }
        assert_true(fabs(before_deg - 20) < 1e-12);
    }
}

/* A tape may say how sure each gaze is; the settings' noise is for those that do not. */
static void tapes_know_their_uncertainty(void **state)
{
    (void)state;
    static struct fv_writer w;
    static const double known_deg[] = {0, 1.25, 20, 90};
    open_tape(&w, "gaze.csv");
    for (int i = 0; i < 4; i++) {
        struct fv_gaze_sample g = {i * 10 * ms, {{0, 0, -1}, {0, 0, -1}}, true, known_deg[i]};
        fv_tape_write_gaze(&w, &g);
    }
    close_tape(&w);
    struct fv_sensors *s = opened(sensor_settings("tape", "none", 1, 1));
    for (int i = 0; i < 4; i++) {
        struct fv_pose head;
        struct fv_gaze gaze;
        double want_deg = known_deg[i] > 0 ? known_deg[i] : 0.3;
        fv_sensors_latch(s, i * 10 * ms, i * 10 * ms, &head, &gaze);
        assert_true(gaze.uncertainty_deg == want_deg);
        if (i == 0) continue; /* alone */
        fv_sensors_latch(s, i * 10 * ms, i * 10 * ms + 9 * ms, &head, &gaze);
        assert_true(gaze.uncertainty_deg == want_deg);
    }
}

/* Before the first row nothing is known; after the last one the tape starts again, and what was before that
 * says nothing about velocity. */
static void ends_of_a_tape(void **state)
{
    (void)state;
    static struct fv_writer w;
    open_tape(&w, "head.csv");
    for (int i = 0; i < 10; i++) {
        struct fv_head_sample h = {20 * ms + i * 10 * ms, {{0.1 * i, 0, 0}, {0}}};
        fv_quat_from_yaw_pitch_roll(i * degree, 0, 0, h.pose.rotation);
        fv_tape_write_head(&w, &h);
    }
    close_tape(&w);
    struct fv_sensors *s = opened(sensor_settings("none", "tape", 1, 1));
    static const struct {
        int64_t now_ms, show_ms;
        double yaw_deg; /* with a velocity that does not decay */
    } cases[] = {{0, 15, 0},     {19, 500, 0},    {20, 35, 0},     {30, 45, 2.5},   {39, 45, 2.5},
                 {110, 120, 10}, {119, 120, 10},  {120, 135, 0},   {130, 145, 2.5}, {1130, 1145, 2.5},
                 {30, 5000, 11}, {1120, 1219, 0}, {1010, 1020, 10}};
    struct fv_config *c = sensor_settings("none", "tape", 1, 1);
    strcpy(c->imu_predict, "two");
    s = opened(c);
    for (unsigned i = 0; i < COUNT(cases); i++) {
        struct fv_pose head;
        struct fv_gaze gaze;
        fv_sensors_latch(s, cases[i].now_ms * ms, cases[i].show_ms * ms, &head, &gaze);
        double ahead[3] = {0, 0, -1};
        fv_quat_rotate(head.rotation, ahead, ahead);
        double yaw_deg = atan2(-ahead[0], -ahead[2]) / degree;
        if (!(fabs(yaw_deg - cases[i].yaw_deg) < 1e-9) ||
            !(fabs(head.position_m[0] - 0.1 * cases[i].yaw_deg) < 1e-9))
            fail_msg("%lld ms: %g", (long long)cases[i].now_ms, yaw_deg);
    }
}

static void odd_times(void **state)
{
    (void)state;
    static const int64_t times[] = {INT64_MIN,      INT64_MIN + 1,      INT64_MIN / 2, -1,       0, 1,
                                    86400000000000, FV_MOTION_LIMIT_NS, INT64_MAX - 1, INT64_MAX};
    static const char *const sources[] = {"sim", "tape", "none"};
    static const double still[3] = {1, NAN, 2};
    static struct fv_writer w;
    write_gazes(3, still);
    open_tape(&w, "head.csv");
    for (int i = 0; i < 3; i++) {
        struct fv_head_sample h = {i * 10 * ms, {{1e4, -1e4, 9000 + i}, {0, 0, 1, 0}}};
        fv_tape_write_head(&w, &h);
    }
    close_tape(&w);
    for (unsigned k = 0; k < COUNT(sources); k++)
        for (unsigned i = 0; i < COUNT(times); i++)
            for (unsigned j = 0; j < COUNT(times); j++) {
                struct fv_sensors *s = opened(sensor_settings(sources[k], sources[k], 1, 1));
                struct fv_pose head;
                struct fv_gaze gaze;
                for (int twice = 0; twice < 2; twice++) {
                    fv_sensors_latch(s, times[i], times[j], &head, &gaze);
                    assert_true(fv_head_pose_good(&head));
                    for (int eye = 0; eye < 2; eye++)
                        assert_true(fv_gaze_direction_good(gaze.direction[eye]));
                    assert_true(gaze.uncertainty_deg >= 0.3 && gaze.uncertainty_deg <= 20);
                }
            }
}

/* A session whose pictures came at uneven times, periods left out: what was latched comes again to the bit
 * when its recording is asked for the times that it was for. */
static void a_recording_gives_the_same(void **state)
{
    (void)state;
    enum { FRAMES = 4000 };
    static struct fv_pose head[FRAMES];
    static struct fv_gaze gaze[FRAMES];
    static int64_t show_ns[FRAMES];
    static struct fv_writer heads, gazes;
    const int64_t period_ns = 11111111;
    uint64_t random = 9;
    int held = 0, unsure = 0;
    struct fv_sensors *s = opened(sensor_settings("sim", "sim", 1, 1));
    open_tape(&heads, "head.csv"), open_tape(&gazes, "gaze.csv");
    for (int64_t n = 0, period = 1; n < FRAMES; n++, period += 1 + (n % 7 == 0) + 9 * (n % 100 == 0)) {
        show_ns[n] = period * period_ns + period_ns / 2;
        int64_t now_ns = show_ns[n] - (int64_t)random_between(&random, 1e6, 3e7);
        fv_sensors_latch(s, now_ns, show_ns[n], &head[n], &gaze[n]);
        held += gaze[n].held, unsure += gaze[n].uncertainty_deg > 1;
        struct fv_head_sample h = {show_ns[n], head[n]};
        struct fv_gaze_sample g = {
            .t_ns = show_ns[n], .valid = !gaze[n].held, .uncertainty_deg = gaze[n].uncertainty_deg};
        memcpy(g.direction, gaze[n].direction, sizeof g.direction);
        fv_tape_write_head(&heads, &h), fv_tape_write_gaze(&gazes, &g);
    }
    close_tape(&heads), close_tape(&gazes);
    print_message("%d of %d gazes held, %d unsure by more than a degree\n", held, FRAMES, unsure);
    assert_true(held > 50 && unsure > 100);
    s = opened(sensor_settings("tape", "tape", 1, 1));
    for (int n = 0; n < FRAMES; n++) {
        struct fv_pose h;
        struct fv_gaze g;
        fv_sensors_latch(s, show_ns[n], show_ns[n], &h, &g);
        assert_memory_equal(&h, &head[n], sizeof h);
        assert_memory_equal(g.direction, gaze[n].direction, sizeof g.direction);
        assert_true(g.held == gaze[n].held && g.uncertainty_deg == gaze[n].uncertainty_deg);
    }
}

/* Mean error, degrees, of latches `horizon_ms` ahead every 13.3 ms of a tape, by each predictor. What a head
 * did is known between readings that differ, at most 50 ms apart. */
static void tape_errors(const char *path, int64_t horizon_ms, double mean_deg[FV_HEAD_PREDICTORS])
{
    struct fv_config *c = sensor_settings("none", "tape", 1, 1);
    struct fv_tape tape;
    struct fv_error error;
    snprintf(c->imu_tape, sizeof c->imu_tape, "%s", path);
    if (fv_tape_read(&tape, path, &error)) fail_msg("%s", error.text);
    for (int p = 0; p < FV_HEAD_PREDICTORS; p++) {
        const struct fv_head_sample *a = tape.head, *b = a, *end = a + tape.heads;
        double sum = 0;
        int count = 0;
        strcpy(c->imu_predict, fv_head_predictors[p].name);
        struct fv_sensors *s = opened(c);
        for (int64_t now_ns = 100 * ms; b < end; now_ns += 13333333) {
            int64_t show_ns = now_ns + horizon_ms * ms;
            struct fv_pose head;
            struct fv_gaze gaze;
            double came[4];
            while (b < end && b->t_ns <= show_ns) {
                if (memcmp(&a->pose, &b->pose, sizeof a->pose) != 0) a = b;
                b++;
            }
            while (b < end && memcmp(&a->pose, &b->pose, sizeof a->pose) == 0) b++;
            if (b == end) break;
            fv_sensors_latch(s, now_ns, show_ns, &head, &gaze);
            if (b->t_ns - a->t_ns > 50 * ms || show_ns > b->t_ns) continue;
            fv_quat_slerp(a->pose.rotation, b->pose.rotation,
                          (double)(show_ns - a->t_ns) / (double)(b->t_ns - a->t_ns), came);
            sum += fv_quat_angle(came, head.rotation) / degree, count++;
        }
        assert_true(count > 1000);
        mean_deg[p] = sum / count;
    }
}

static void prediction_beats_holding_on_real_heads(void **state)
{
    (void)state;
    static const char *const tapes[] = {FV_SOURCE_DIR "/../shared/data/head/user1_quaternion.txt",
                                        FV_SOURCE_DIR "/../shared/data/gaze/varjo/p1_r1.csv"};
    for (unsigned i = 0; i < COUNT(tapes); i++) {
        if (!fv_file_exists(tapes[i])) {
            print_message("skipped: ../shared/data is not there\n");
            skip();
        }
        for (int64_t horizon_ms = 5; horizon_ms <= 30; horizon_ms += horizon_ms == 5 ? 10 : 15) {
            double mean_deg[FV_HEAD_PREDICTORS];
            tape_errors(tapes[i], horizon_ms, mean_deg);
            print_message("%s, %lld ms ahead, mean degrees:", strrchr(tapes[i], '/') + 1,
                          (long long)horizon_ms);
            for (int p = 0; p < FV_HEAD_PREDICTORS; p++)
                print_message(" %s %.3f", fv_head_predictors[p].name, mean_deg[p]);
            print_message("\n");
            assert_true(mean_deg[FV_PREDICT_HEAD_DECAY] < 0.6 * mean_deg[FV_PREDICT_HEAD_HOLD]);
            /* The default is the best. */
            for (int p = 0; p < FV_HEAD_PREDICTORS; p++)
                assert_true(mean_deg[FV_PREDICT_HEAD_DECAY] <= mean_deg[p]);
        }
    }
    assert_string_equal(fv_key_find("imu.predict")->initial, "decay");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(words_are_predictors),
        cmocka_unit_test(known_when_shown_is_as_it_is),
        cmocka_unit_test(nothing_later_is_used),
        cmocka_unit_test(simulated_devices_have_a_rate),
        cmocka_unit_test(gazes_may_have_moved),
        cmocka_unit_test(tapes_know_their_uncertainty),
        cmocka_unit_test(ends_of_a_tape),
        cmocka_unit_test(odd_times),
        cmocka_unit_test(a_recording_gives_the_same),
        cmocka_unit_test(prediction_beats_holding_on_real_heads),
    };
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
