/* predictors: head and gaze ahead of their samples against exact motions in long double, and against
 * histories that no sensor should give. */
#include "sensors/predict.h"
#include "sensors/tape.h"
#include "tests/support/program.h"
#include "tests/support/random.h"

#include <math.h>

enum { SAMPLES = 64 };
static const int64_t ms = 1000000;
static const double degree = M_PI / 180;

static struct fv_head_sample head[SAMPLES];
static struct fv_gaze_sample gaze[SAMPLES];

/* A head that turns about y (left positive) and moves along x at constant speeds; exact at any time. */
static struct fv_pose turning(double deg_s, double m_s, int64_t t_ns)
{
    long double seconds = 1e-9L * (long double)t_ns;
    long double half = fmodl((long double)deg_s * seconds, 720) * (3.14159265358979323846264338327950288L / 360);
    return (struct fv_pose){{(double)((long double)m_s * seconds), 1.6, 0}, {(double)cosl(half), 0, (double)sinl(half), 0}};
}

static double between_deg(const double a[3], const double b[3])
{
    double c[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    return atan2(sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2]), a[0] * b[0] + a[1] * b[1] + a[2] * b[2]) / degree;
}

/* Constant motion from a session time on: what `two` and `slope` must get to rounding, what `hold` loses. */
static const struct {
    const char *what;
    double deg_s, m_s;
    int64_t step_ns, start_ns, horizon_ns;
    double held_deg; /* error of holding; NaN: of all, as that is no head's motion */
} steady[] = {
    {"at rest", 0, 0, 1000000, 0, 80000000, 0},
    {"a slow turn", 20, 0.3, 1000000, 0, 40000000, 0.8},
    {"a fast turn", 300, 2, 3500000, 0, 80000000, 24},
    {"2000 deg/s at 1000 Hz", 2000, 0, 1000000, 0, 20000000, 40},
    {"2000 deg/s at 100 Hz", 2000, 0, 10000000, 0, 20000000, 40},
    {"2000 deg/s backwards", -2000, 0, 1000000, 0, 20000000, 40},
    {"after 24 hours", 90, 0.1, 1000000, 86400000000000, 80000000, 7.2},
    {"horizon 0", 90, 0, 1000000, 0, 0, 0},
    {"a time before the newest sample", 90, 0, 1000000, 0, -5000000, 0},
    {"faster than any head: 2100 deg/s", 2100, 0, 1000000, 0, 20000000, NAN},
    {"half a turn between samples", 180000, 0, 1000000, 0, 20000000, NAN},
    {"samples 60 ms apart", 90, 0, 60000000, 0, 20000000, NAN},
};

static void heads_in_steady_motion(void **state)
{
    (void)state;
    for (unsigned n = 0; n < sizeof steady / sizeof steady[0]; n++) {
        int64_t newest_ns = steady[n].start_ns + (SAMPLES - 1) * steady[n].step_ns;
        for (int i = 0; i < SAMPLES; i++) {
            head[i].t_ns = steady[n].start_ns + i * steady[n].step_ns;
            head[i].pose = turning(steady[n].deg_s, steady[n].m_s, head[i].t_ns);
        }
        int64_t t_ns = newest_ns + steady[n].horizon_ns;
        struct fv_pose want = turning(steady[n].deg_s, steady[n].m_s, t_ns > newest_ns ? t_ns : newest_ns);
        for (int p = 0; p < FV_HEAD_PREDICTORS; p++) {
            struct fv_pose got;
            fv_head_predictors[p].predict(head, SAMPLES, t_ns, &got);
            double error = fv_quat_angle(want.rotation, got.rotation) / degree;
            double moved = fv_quat_angle(head[SAMPLES - 1].pose.rotation, got.rotation) / degree;
            double held = steady[n].held_deg, bad = 0;
            if (isnan(held)) bad = moved; /* all hold */
            else if (p == FV_PREDICT_HEAD_HOLD) bad = fabs(error - held);
            else if (p == FV_PREDICT_HEAD_DECAY) bad = fmax(0, error - 0.35 * held);
            else bad = error + fabs(want.position_m[0] - got.position_m[0]);
            if (!(bad < 1e-7)) fail_msg("%s, %s: %g", steady[n].what, fv_head_predictors[p].name, bad);
        }
    }
}

/* The slow turn's pose at 60.5 ms: 1.815 degrees. */
#define TURNED_60_5 {{0, 1.6, 0}, {0.99987456783, 0, 0.01583820072, 0}}

/* One or all samples of a slow turn spoilt: the prediction is good, and as far as the others say, near. */
static const struct {
    const char *what;
    int first, last; /* samples spoilt */
    struct fv_head_sample with;
    bool keep_time;
    double most_deg; /* at 20 ms */
} spoilt[] = {
    {"newest is NaN", 63, 63, {0, {{0, 0, 0}, {NAN, 0, 0, 0}}}, true, 0.001},
    {"newest is far away", 63, 63, {0, {{1e300, 0, 0}, {1, 0, 0, 0}}}, true, 0.001},
    {"newest is no rotation", 63, 63, {0, {{0, 0, 0}, {0, 0, 0, 0}}}, true, 0.001},
    {"one in the middle is infinite", 55, 55, {0, {{0, 0, 0}, {INFINITY, 0, 0, 0}}}, true, 0.001},
    {"all but one are NaN", 0, 62, {0, {{0, NAN, 0}, {1, 0, 0, 0}}}, true, 0.61},
    {"all are NaN", 0, 63, {0, {{0, NAN, 0}, {1, 0, 0, 0}}}, true, 3},
    {"stuck at the newest time", 32, 62, {63000000, {{0, 0, 0}, {1, 0, 0, 0}}}, false, 0.61},
    {"older ones in the future", 0, 62, {INT64_MAX, {{0, 0, 0}, {1, 0, 0, 0}}}, false, 0.61},
    {"older ones at the beginning of time", 0, 62, {INT64_MIN, {{0, 0, 0}, {1, 0, 0, 0}}}, false, 0.61},
    {"1 ns before the newest, turned round", 62, 62, {62999999, {{0, 0, 0}, {0, 0, 1, 0}}}, false, 0.61},
    {"one comes 1.5 ms late", 62, 62, {60500000, TURNED_60_5}, false, 0.001},
    {"the last one comes 2.5 ms late", 63, 63, {60500000, TURNED_60_5}, false, 0.08},
    {"newest at the end of time", 63, 63, {INT64_MAX, {{0, 0, 0}, {1, 0, 0, 0}}}, false, 3},
};

static void heads_from_spoilt_histories(void **state)
{
    (void)state;
    for (unsigned n = 0; n < sizeof spoilt / sizeof spoilt[0]; n++) {
        for (int i = 0; i < SAMPLES; i++) {
            head[i] = (struct fv_head_sample){i * ms, turning(30, 0, i * ms)};
            if (i < spoilt[n].first || i > spoilt[n].last) continue;
            head[i] = spoilt[n].with;
            if (spoilt[n].keep_time) head[i].t_ns = i * ms;
        }
        struct fv_pose want = turning(30, 0, 83 * ms), got;
        for (int p = 0; p < FV_HEAD_PREDICTORS; p++) {
            fv_head_predictors[p].predict(head, SAMPLES, 83 * ms, &got);
            double more = p == FV_PREDICT_HEAD_HOLD ? 0.65 : p == FV_PREDICT_HEAD_DECAY ? 0.1 : 0;
            double error = fv_quat_angle(want.rotation, got.rotation) / degree;
            if (!fv_head_pose_good(&got) || !(error < spoilt[n].most_deg + more))
                fail_msg("%s, %s: %g degrees off", spoilt[n].what, fv_head_predictors[p].name, error);
        }
    }
    for (int count = -1; count <= 1; count++)
        for (int p = 0; p < FV_HEAD_PREDICTORS; p++) {
            struct fv_pose got;
            head[0] = (struct fv_head_sample){INT64_MIN, {{1e3, -1e3, 1e3}, {0, 0, 0, -1}}};
            fv_head_predictors[p].predict(head, count, INT64_MAX, &got);
            assert_true(fv_head_pose_good(&got));
            assert_true(count == 1 ? got.rotation[3] == -1 : got.rotation[0] == 1);
        }
}

/* A head at 30 degrees a second, whose pose comes again in every row until the next one is read; at rest
 * it comes again for long. `row`: of the newest sample; the poses before `rest` rows are all the first. */
static void heads_that_come_again(void **state)
{
    (void)state;
    static const struct {
        const char *what;
        int rows_a_pose, rest, newest;
        double most_deg;
    } logs[] = {{"every fourth", 4, 0, 63, 1e-9},       {"every fourth, just read", 4, 0, 60, 1e-9},
                {"every fifth", 5, 0, 62, 1e-9},        {"every other", 2, 0, 63, 1e-9},
                {"too far apart", 6, 0, 63, 2},         {"rests", 64, 0, 63, 1.3},
                {"rested, then moved", 1, 62, 63, 0.6}, {"rested, then turned", 1, 59, 63, 0.01}};
    for (unsigned n = 0; n < sizeof logs / sizeof logs[0]; n++) {
        for (int i = 0; i <= logs[n].newest; i++) {
            int read = i < logs[n].rest ? 0 : i - i % logs[n].rows_a_pose;
            head[i].t_ns = i * 10 * ms;
            head[i].pose = turning(30, 0, (i < logs[n].rest ? logs[n].rest - 1 : read) * 10 * ms);
        }
        struct fv_pose want = turning(30, 0, (logs[n].newest * 10 + 10) * ms), got;
        if (logs[n].rows_a_pose == 64) want = head[0].pose;
        for (int p = FV_PREDICT_HEAD_TWO; p <= FV_PREDICT_HEAD_SLOPE; p++) {
            fv_head_predictors[p].predict(head, logs[n].newest + 1, (logs[n].newest * 10 + 10) * ms, &got);
            double error = fv_quat_angle(want.rotation, got.rotation) / degree;
            if (!(error < logs[n].most_deg))
                fail_msg("%s, %s: %g degrees off", logs[n].what, fv_head_predictors[p].name, error);
        }
    }
}

/* The decay's end: no further than FV_PREDICT_MAX_NS however late it is asked. */
static void no_further_than_the_limit(void **state)
{
    (void)state;
    for (int i = 0; i < SAMPLES; i++) head[i] = (struct fv_head_sample){i * ms, turning(100, 1, i * ms)};
    for (int p = 0; p < FV_HEAD_PREDICTORS; p++) {
        struct fv_pose at_limit, later;
        fv_head_predictors[p].predict(head, SAMPLES, 63 * ms + FV_PREDICT_MAX_NS, &at_limit);
        fv_head_predictors[p].predict(head, SAMPLES, INT64_MAX, &later);
        assert_memory_equal(&at_limit, &later, sizeof later);
    }
}

/* Noise of 0.01 degrees on a turn: the slope over 20 ms errs far less than the last two samples do. */
static void slope_averages_noise(void **state)
{
    (void)state;
    double sum[FV_HEAD_PREDICTORS] = {0};
    uint64_t random = 1;
    for (int n = 0; n < 200; n++) {
        for (int i = 0; i < SAMPLES; i++) {
            double turn[3], noise[4];
            for (int k = 0; k < 3; k++) turn[k] = 0.01 * degree * random_between(&random, -1, 1);
            head[i] = (struct fv_head_sample){i * ms, turning(30, 0, i * ms)};
            fv_quat_from_vector(turn, noise);
            fv_quat_multiply(head[i].pose.rotation, noise, head[i].pose.rotation);
        }
        struct fv_pose want = turning(30, 0, 83 * ms), got;
        for (int p = 0; p < FV_HEAD_PREDICTORS; p++) {
            fv_head_predictors[p].predict(head, SAMPLES, 83 * ms, &got);
            sum[p] += fv_quat_angle(want.rotation, got.rotation) / degree;
        }
    }
    assert_true(sum[FV_PREDICT_HEAD_SLOPE] < 0.15 * sum[FV_PREDICT_HEAD_TWO]);
    assert_true(sum[FV_PREDICT_HEAD_SLOPE] < sum[FV_PREDICT_HEAD_HOLD]);
}

static void look(double x_deg, double y_deg, double out[3])
{
    double x = x_deg * degree, y = y_deg * degree;
    out[0] = sin(x) * cos(y);
    out[1] = sin(y);
    out[2] = -cos(x) * cos(y);
}

/* The last two gazes (degrees right, both eyes), their distance in time, and where constant velocity must
 * lead after the horizon. */
static const struct {
    const char *what;
    double before_deg, newest_deg;
    int64_t apart_ns, horizon_ns;
    double want_deg;
} pursuits[] = {
    {"still", 5, 5, 5000000, 80000000, 5},
    {"pursuit at 30 deg/s", 0, 0.15, 5000000, 40000000, 1.35},
    {"to the left", 10, 9.85, 5000000, 40000000, 8.65},
    {"a saccade at 900 deg/s", 0, 4.5, 5000000, 10000000, 13.5},
    {"past the limit of 100 ms", 0, 0.15, 5000000, 5000000000, 3.15},
    {"horizon 0", 0, 0.15, 5000000, 0, 0.15},
    {"before the newest", 0, 0.15, 5000000, -40000000, 0.15},
    {"across the view between samples", -40, 40, 5000000, 20000000, 40},
    {"would turn behind the face", 60, 64, 5000000, 80000000, 64},
    {"too far apart", 0, 1, 51000000, 20000000, 1},
    {"1 ns apart", 0, 1, 1, 20000000, 1},
};

static void gazes(void **state)
{
    (void)state;
    for (unsigned n = 0; n < sizeof pursuits / sizeof pursuits[0]; n++) {
        double got[2][3], want[3], newest[3];
        for (int eye = 0; eye < 2; eye++) {
            look(pursuits[n].before_deg, 0, gaze[0].direction[eye]);
            look(pursuits[n].newest_deg, 0, gaze[1].direction[eye]);
        }
        gaze[0].valid = gaze[1].valid = true;
        gaze[0].t_ns = 0;
        gaze[1].t_ns = pursuits[n].apart_ns;
        int64_t t_ns = gaze[1].t_ns + pursuits[n].horizon_ns;
        look(pursuits[n].want_deg, 0, want);
        look(pursuits[n].newest_deg, 0, newest);
        fv_gaze_predictors[FV_PREDICT_GAZE_HOLD].predict(gaze, 2, t_ns, got);
        assert_true(between_deg(got[0], newest) < 1e-9 && between_deg(got[1], newest) < 1e-9);
        fv_gaze_predictors[FV_PREDICT_GAZE_VELOCITY].predict(gaze, 2, t_ns, got);
        for (int eye = 0; eye < 2; eye++)
            if (!(between_deg(got[eye], want) < 1e-9))
                fail_msg("%s: %g degrees off", pursuits[n].what, between_deg(got[eye], want));
    }
}

static void gazes_from_spoilt_histories(void **state)
{
    (void)state;
    static const double bad[][3] = {{NAN, 0, -1}, {0, 0, 0}, {0, 0, 1}, {0, 0, -1e300}, {INFINITY, 0, -1}};
    for (unsigned n = 0; n < sizeof bad / sizeof bad[0]; n++)
        for (int which = 0; which < 3; which++) {
            double got[2][3], want[3];
            for (int i = 0; i < 3; i++) {
                gaze[i] = (struct fv_gaze_sample){.t_ns = 5 * ms * i, .valid = true};
                for (int eye = 0; eye < 2; eye++) look(0.1 * i, 0, gaze[i].direction[eye]);
            }
            memcpy(gaze[which].direction[n % 2], bad[n], sizeof bad[n]);
            fv_gaze_predictors[FV_PREDICT_GAZE_VELOCITY].predict(gaze, 3, 20 * ms, got);
            look(0.4, 0, want);
            for (int eye = 0; eye < 2; eye++) assert_true(between_deg(got[eye], want) < 1e-9);
        }
    double got[2][3];
    for (int i = 0; i < 3; i++) gaze[i].valid = false;
    for (int p = 0; p < FV_GAZE_PREDICTORS; p++)
        for (int count = 0; count <= 3; count++) {
            fv_gaze_predictors[p].predict(gaze, count, INT64_MAX, got);
            for (int eye = 0; eye < 2; eye++) assert_true(got[eye][0] == 0 && got[eye][1] == 0 && got[eye][2] == -1);
        }
}

/* Gazes by their time in ms and angle to the right (NAN: lost) and what speed they show with a noise of 0.3
 * degrees. */
static void gaze_speeds(void **state)
{
    (void)state;
    static const struct {
        const char *what;
        int count;
        double at_ms[5], right_deg[5], want_deg_s;
    } rows[] = {
        {"none", 0, {0}, {0}, INFINITY},
        {"alone", 1, {0}, {5}, INFINITY},
        {"lost but for one", 3, {0, 5, 10}, {NAN, 3, NAN}, INFINITY},
        {"still", 2, {0, 5}, {5, 5}, 0},
        {"noise", 5, {0, 5, 10, 15, 20}, {5, 5.2, 4.8, 5.1, 5.29}, 0},
        {"pursuit", 5, {0, 5, 10, 15, 20}, {0, 0.15, 0.3, 0.45, 0.6}, 15},
        {"only the last 20 ms", 5, {-30, 0, 10, 15, 20}, {-60, 0, 0.3, 0.45, 0.6}, 15},
        {"slow tracker", 2, {0, 33}, {0, 3.6}, 100},
        {"49 ms apart", 2, {0, 49}, {0, 5.2}, 100},
        {"too far apart", 2, {0, 51}, {0, 5.2}, INFINITY},
        {"times that stand and go back", 5, {0, 20, 20, 10, 20}, {0, 50, 40, 30, 0.6}, 15},
        {"at the ends of time", 2, {-9.2e12, 9.2e12}, {0, 5}, INFINITY},
        {"1 ns apart", 2, {0, 1e-6}, {0, 1.3}, 1e9},
    };
    for (unsigned n = 0; n < sizeof rows / sizeof rows[0]; n++) {
        for (int i = 0; i < rows[n].count; i++) {
            gaze[i] = (struct fv_gaze_sample){.t_ns = llround(rows[n].at_ms[i] * 1e6),
                                              .valid = !isnan(rows[n].right_deg[i])};
            look(rows[n].right_deg[i], 0, gaze[i].direction[0]);
            look(0, 0, gaze[i].direction[1]);
        }
        double got = fv_gaze_speed_deg_s(gaze, rows[n].count, 0.3);
        if (!(got == rows[n].want_deg_s || fabs(got - rows[n].want_deg_s) <= 1e-9 * rows[n].want_deg_s))
            fail_msg("%s: %.12g", rows[n].what, got);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(heads_in_steady_motion),
                                       cmocka_unit_test(heads_from_spoilt_histories),
                                       cmocka_unit_test(no_further_than_the_limit),
                                       cmocka_unit_test(slope_averages_noise),
                                       cmocka_unit_test(gazes),
                                       cmocka_unit_test(gazes_from_spoilt_histories),
                                       cmocka_unit_test(heads_that_come_again),
                                       cmocka_unit_test(gaze_speeds)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
