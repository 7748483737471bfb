/* fusion: orientation from simulated gyroscope and accelerometer against the exact motion: tilt from any start,
 * biases at rest and in motion, 2000 degrees a second, measured times that jitter; then samples no sensor should
 * give: what is held, what is counted. */
#include "sensors/imu/fusion.h"

#include "platform/pose.h"
#include "sensors/imu/integrate.h"
#include "sensors/sensors.h"
#include "tests/support/program.h"
#include "tests/support/random.h"

#include <float.h>
#include <math.h>

static const double degree = M_PI / 180, gravity = 9.80665;
static struct fv_fusion fusion;
static uint64_t dice;

static double length_error(const double q[4])
{
    return fabs(sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]) - 1);
}

/* Degrees between the estimated and the true direction of up, both in device axes. */
static double tilt_error(const double got[4], const double truth[4])
{
    double up[3] = {0, 1, 0}, back[4], c[3];
    fv_quat_conjugate(truth, back);
    fv_quat_rotate(back, up, up);
    fv_quat_rotate(got, up, c);
    return atan2(hypot(c[0], c[2]), c[1]) / degree;
}

/* What a resting accelerometer shows at a rotation. */
static void at_rest(const double q[4], double acc[3])
{
    double up[3] = {0, gravity, 0}, back[4];
    fv_quat_conjugate(q, back);
    fv_quat_rotate(back, up, acc);
}

static int by_value(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double noise(double most)
{
    return random_between(&dice, -most, most);
}

/* One step: the truth turns at `rate` for dt_s; the sensors show it with a bias and some noise. */
static void step(double truth[4], const double rate[3], const double bias[3], double dt_s)
{
    double turn[3], by[4], shown[3], acc[3];
    for (int i = 0; i < 3; i++) turn[i] = rate[i] * dt_s;
    fv_quat_from_vector(turn, by);
    fv_quat_multiply(truth, by, truth);
    fv_quat_normalise(truth);
    at_rest(truth, acc);
    for (int i = 0; i < 3; i++) {
        shown[i] = rate[i] + bias[i] + noise(1e-3);
        acc[i] += noise(0.02);
    }
    fv_fusion_add(&fusion, shown, acc, dt_s);
    assert_true(length_error(fusion.rotation) < 1e-12);
}

/* The first acceleration tilts it, whatever way up; upside down too. */
static void tilts_from_any_start(void **state)
{
    (void)state;
    dice = 1;
    for (int n = 0; n < 200; n++) {
        double truth[4], acc[3], rate[3] = {0};
        random_rotation(&dice, truth);
        if (n == 0) truth[0] = truth[2] = truth[3] = 0, truth[1] = 1;
        if (n == 1) truth[0] = truth[1] = truth[2] = 0, truth[3] = 1;
        at_rest(truth, acc);
        fv_fusion_begin(&fusion, NULL);
        fv_fusion_add(&fusion, rate, acc, n % 2 ? 0.001 : 86400);
        if (!(tilt_error(fusion.rotation, truth) < 1e-5)) fail_msg("%d: %g", n, tilt_error(fusion.rotation, truth));
    }
}

/* Motions about all axes for 120 s: how far bias and tilt are off at the end. */
static const struct {
    const char *what;
    double hz, jitter, swing_deg_s, rest_s, bias_deg_s[3], most_bias_deg_s, most_tilt_deg;
} motions[] = {
    {"at rest, 1 kHz", 1000, 0, 0, 60, {0.4, -0.3, 0.5}, 0.01, 0.05},
    {"at rest, 100 Hz, times that jitter", 100, 0.5, 0, 60, {0.4, -0.3, 0.5}, 0.02, 0.1},
    {"in motion, never at rest", 500, 0, 120, 0, {0.4, -0.3, 0.5}, 0.2, 0.3},
    {"in motion, times that jitter", 500, 0.7, 120, 0, {0.4, -0.3, 0.5}, 0.2, 0.3},
    {"fast, after a rest", 1000, 0, 1500, 10, {1, -1, 1}, 0.1, 0.5},
    {"no bias", 1000, 0, 300, 0, {0, 0, 0}, 0.1, 0.3},
};

static void learns_biases(void **state)
{
    (void)state;
    for (unsigned n = 0; n < sizeof motions / sizeof motions[0]; n++) {
        double truth[4] = {1, 0, 0, 0}, bias[3], t = 0, off = 0;
        dice = n + 1;
        for (int i = 0; i < 3; i++) bias[i] = motions[n].bias_deg_s[i] * degree;
        fv_fusion_begin(&fusion, NULL);
        while (t < 120) {
            double dt_s = (1 + noise(motions[n].jitter)) / motions[n].hz, rate[3];
            double swing = t < motions[n].rest_s ? 0 : motions[n].swing_deg_s * degree;
            rate[0] = swing * sin(1.7 * t), rate[1] = swing * sin(1.1 * t + 1), rate[2] = swing * cos(0.9 * t);
            step(truth, rate, bias, dt_s);
            t += dt_s;
        }
        for (int i = 0; i < 3; i++) off = fmax(off, fabs(fusion.bias[i] - bias[i]) / degree);
        double tilt = tilt_error(fusion.rotation, truth);
        if (!(off <= motions[n].most_bias_deg_s && tilt <= motions[n].most_tilt_deg))
            fail_msg("%s: bias %g deg/s off, tilt %g deg", motions[n].what, off, tilt);
        assert_int_equal(fusion.resting, motions[n].swing_deg_s == 0);
    }
}

/* A head that is pushed about by half of gravity while it turns, from the first sample on: it averages out. */
static void pushes_average_out(void **state)
{
    (void)state;
    double truth[4] = {1, 0, 0, 0}, worst = 0;
    dice = 1;
    fv_fusion_begin(&fusion, NULL);
    for (int i = 0; i < 60000; i++) {
        double t = i * 0.001, acc[3], push[3], back[4], rate[3] = {0.5 * sin(t), 0.8 * cos(0.7 * t), 0.3 * sin(2 * t)};
        double turn[3] = {rate[0] * 0.001, rate[1] * 0.001, rate[2] * 0.001}, by[4];
        fv_quat_from_vector(turn, by);
        fv_quat_multiply(truth, by, truth);
        at_rest(truth, acc);
        push[0] = 5 * sin(9 * t), push[1] = 4 * sin(7 * t), push[2] = 5 * cos(11 * t);
        fv_quat_conjugate(truth, back);
        fv_quat_rotate(back, push, push);
        for (int k = 0; k < 3; k++) acc[k] += push[k];
        fv_fusion_add(&fusion, rate, acc, 0.001);
        if (t > 20) worst = fmax(worst, tilt_error(fusion.rotation, truth));
    }
    if (!(worst < 0.6)) fail_msg("%g degrees", worst);
}

/* Begins upright, turning at 90 degrees a second about y for 5 s at 1 kHz. */
static void begin_turning(void)
{
    fv_fusion_begin(&fusion, NULL);
    for (int i = 0; i < 5000; i++)
        fv_fusion_add(&fusion, (double[3]){0, 90 * degree + (i % 2) * 1e-9, 0}, (double[3]){0, gravity, 0}, 0.001);
}

#define FINE {0, M_PI / 2, 0}
#define DOWN {0, 9.80665, 0}

/* After that turning, `times` of a sample; which count grows, and how far the rotation may have gone. */
static const struct {
    const char *what;
    double rate[3], acc[3], dt_s;
    int times;
    size_t count; /* offset in the counts; 0 (samples): none */
    double turned_deg;
} insane[] = {
    {"sane", FINE, DOWN, 0.001, 1, 0, 0.09},
    {"NaN rate", {0, NAN, 0}, DOWN, 0.001, 10, offsetof(struct fv_fusion_counts, bad), 0},
    {"infinite rate", {INFINITY, 0, 0}, DOWN, 0.001, 10, offsetof(struct fv_fusion_counts, bad), 0},
    {"a rate of no gyroscope", {0, 101, 0}, DOWN, 0.001, 10, offsetof(struct fv_fusion_counts, bad), 0},
    {"the largest number", {DBL_MAX, DBL_MAX, -DBL_MAX}, DOWN, 0.001, 10, offsetof(struct fv_fusion_counts, bad), 0},
    {"no time", FINE, DOWN, 0, 10, offsetof(struct fv_fusion_counts, mistimed), 0},
    {"time goes back", FINE, DOWN, -0.001, 10, offsetof(struct fv_fusion_counts, mistimed), 0},
    {"time is NaN", FINE, DOWN, NAN, 10, offsetof(struct fv_fusion_counts, mistimed), 0},
    {"time is infinite", FINE, DOWN, INFINITY, 10, offsetof(struct fv_fusion_counts, mistimed), 0},
    {"a second", FINE, DOWN, 1, 1, 0, 90},
    {"more than a second", FINE, DOWN, 1.001, 1, offsetof(struct fv_fusion_counts, gaps), 0},
    {"a day", FINE, DOWN, 86400, 1, offsetof(struct fv_fusion_counts, gaps), 0},
    {"NaN acceleration", FINE, {0, NAN, 0}, 0.001, 1, offsetof(struct fv_fusion_counts, no_down), 0.09},
    {"infinite acceleration", FINE, {0, INFINITY, 0}, 0.001, 1, offsetof(struct fv_fusion_counts, no_down), 0.09},
    {"the largest acceleration", FINE, {DBL_MAX, 0, 0}, 0.001, 1, offsetof(struct fv_fusion_counts, no_down), 0.09},
    {"free fall", FINE, {0, 0.1, 0}, 0.001, 1, offsetof(struct fv_fusion_counts, no_down), 0.09},
    {"no acceleration", FINE, {0, 0, 0}, 0.001, 1, offsetof(struct fv_fusion_counts, no_down), 0.09},
    {"a knock of 16 g", FINE, {160, 9.8, 0}, 0.001, 1, 0, 0.09},
    {"2000 degrees a second", {0, 2000 * M_PI / 180, 0}, DOWN, 0.001, 1, 0, 2},
};

static void decides_insane_samples(void **state)
{
    (void)state;
    for (unsigned n = 0; n < sizeof insane / sizeof insane[0]; n++) {
        begin_turning();
        double before[4], predicted[4];
        memcpy(before, fusion.rotation, sizeof before);
        for (int i = 0; i < insane[n].times; i++) fv_fusion_add(&fusion, insane[n].rate, insane[n].acc, insane[n].dt_s);
        double turned = fv_quat_angle(before, fusion.rotation) / degree;
        int64_t counted, all;
        memcpy(&counted, (char *)&fusion.counts + insane[n].count, sizeof counted);
        all = fusion.counts.mistimed + fusion.counts.bad + fusion.counts.stuck + fusion.counts.gaps +
              fusion.counts.saturated + fusion.counts.no_down;
        if (!(fabs(turned - insane[n].turned_deg) < 0.1 * insane[n].turned_deg + 1e-9))
            fail_msg("%s: turned %g", insane[n].what, turned);
        if (insane[n].count ? counted != insane[n].times || all != counted : all != 0)
            fail_msg("%s: %d of %d counted", insane[n].what, (int)counted, (int)all);
        fv_fusion_predict(&fusion, 0.02, predicted);
        assert_true(length_error(fusion.rotation) < 1e-12 && length_error(predicted) < 1e-12);
        /* And goes on as if nothing had been; a time that was missed is made up for. */
        memcpy(before, fusion.rotation, sizeof before);
        double missed = fusion.missing_s;
        fv_fusion_add(&fusion, (double[3]){1e-9, 90 * degree, 0}, (double[3]){0, gravity, 0}, 0.001);
        turned = fv_quat_angle(before, fusion.rotation) / degree;
        if (!(fabs(turned - 90 * (missed + 0.001)) < 0.02)) fail_msg("%s, then: %g", insane[n].what, turned);
    }
}

/* After a gap, in which the head has tilted by 20 degrees, it finds down again within seconds; and a push just then
 * does not turn the world. */
static void finds_down_after_a_gap(void **state)
{
    (void)state;
    double truth[4], acc[3];
    fv_quat_from_vector((double[3]){20 * degree, 0, 0}, truth);
    fv_fusion_begin(&fusion, NULL);
    for (int i = 0; i < 5000; i++)
        fv_fusion_add(&fusion, (double[3]){0, i % 2 * 1e-9, 0}, (double[3]){0, gravity, 0}, 0.001);
    fv_fusion_add(&fusion, (double[3]){0, 0, 0}, (double[3]){5, gravity, 0}, 2);
    fv_fusion_add(&fusion, (double[3]){0, 1e-9, 0}, (double[3]){5, gravity, 0}, 0.001);
    assert_int_equal(fusion.counts.gaps, 1);
    double turned = tilt_error(fusion.rotation, (double[4]){1, 0, 0, 0});
    if (!(turned > 1e-3 && turned < 0.2)) fail_msg("%g degrees by one push", turned);
    at_rest(truth, acc);
    for (int i = 0; i < 20000; i++) fv_fusion_add(&fusion, (double[3]){0, i % 2 * 1e-9, 0}, acc, 0.001);
    assert_true(tilt_error(fusion.rotation, truth) < 0.5);
}

/* The very same sample again and again: held after 0.1 s, no rate to predict by; the next that differs goes on. */
static void holds_when_stuck(void **state)
{
    (void)state;
    double predicted[4], held[4];
    begin_turning();
    for (int i = 0; i < 1000; i++) fv_fusion_add(&fusion, (double[3])FINE, (double[3])DOWN, 0.001);
    assert_in_range(fusion.counts.stuck, 890, 905);
    memcpy(held, fusion.rotation, sizeof held);
    fv_fusion_predict(&fusion, 0.1, predicted);
    assert_true(fv_quat_angle(predicted, held) < 1e-12 && !fusion.resting);
    fv_fusion_add(&fusion, (double[3]){0, 1, 0}, (double[3])DOWN, 0.001);
    assert_true(fabs(fv_quat_angle(fusion.rotation, held) - 0.001) < 1e-5);
    /* Slow sensors may repeat themselves for 0.1 s, but not 16 times. */
    begin_turning();
    for (int i = 0; i < 14; i++) fv_fusion_add(&fusion, (double[3])FINE, (double[3])DOWN, 0.02);
    assert_int_equal(fusion.counts.stuck, 0);
}

/* At full scale a rate teaches no bias, an acceleration no down. */
static void saturates(void **state)
{
    (void)state;
    struct fv_fusion_settings settings = fv_fusion_usual;
    settings.rate_full = 8.7266;
    settings.acc_full = 39.2266;
    fv_fusion_begin(&fusion, &settings);
    for (int i = 0; i < 5000; i++)
        fv_fusion_add(&fusion, (double[3]){8.7266, 1e-6 * (i % 2), 0}, (double[3]){0, gravity, 0}, 0.001);
    assert_int_equal(fusion.counts.saturated, 5000);
    assert_true(fusion.bias[0] == 0 && fusion.bias[1] == 0 && fusion.bias[2] == 0);
    fv_fusion_begin(&fusion, &settings);
    for (int i = 0; i < 5000; i++)
        fv_fusion_add(&fusion, (double[3]){0, 1e-6 * (i % 2), 0}, (double[3]){-39.2266, gravity, 0}, 0.001);
    assert_int_equal(fusion.counts.no_down, 5000);
    assert_true(fv_quat_angle(fusion.rotation, (double[4]){1, 0, 0, 0}) < 1e-4);
}

/* Ahead at the constant rate, no further than the limit, nor where the rate has been missing as long. */
static void predicts(void **state)
{
    (void)state;
    static const struct {
        double ahead_s, missing_s, turned_deg;
    } rows[] = {{0, 0, 0},      {0.02, 0, 1.8}, {0.1, 0, 9}, {5, 0, 9},           {-1, 0, 0},     {INFINITY, 0, 9},
                {NAN, 0, 0}, {0.02, 0.01, 2.7}, {0.02, 0.09, 9}, {0.02, 0.1, 0}, {0.02, 0.5, 0}};
    begin_turning();
    for (unsigned n = 0; n < sizeof rows / sizeof rows[0]; n++) {
        double to[4];
        fusion.missing_s = rows[n].missing_s;
        fv_fusion_predict(&fusion, rows[n].ahead_s, to);
        double turned = fv_quat_angle(fusion.rotation, to) / degree;
        if (!(fabs(turned - rows[n].turned_deg) < 0.02 * rows[n].turned_deg + 1e-9)) fail_msg("row %u: %g", n, turned);
    }
}

/* The simulated head's sensors at 1 kHz, the accelerometer feeling its sway and swing: how far it is from what the
 * head does in 20 ms to what is predicted from the rate, and the tilt meanwhile. */
static void predicts_a_head(void **state)
{
    (void)state;
    enum { MS = 20000, AHEAD_MS = 20 };
    static struct fv_pose head[MS + AHEAD_MS + 2];
    static double off[MS];
    const double dt_s = 0.001;
    int count = 0;
    for (int i = 0; i < MS + AHEAD_MS + 2; i++) fv_sim_head(5, INT64_C(1000000) * i, &head[i]);
    dice = 5;
    fv_fusion_begin(&fusion, NULL);
    for (int i = 1; i < MS; i++) {
        double rate[3], acc[3], back[4], predicted[4], want[4], got[4];
        fv_quat_between(head[i - 1].rotation, head[i].rotation, rate);
        for (int k = 0; k < 3; k++) {
            rate[k] = rate[k] / dt_s + noise(2e-3);
            acc[k] = (head[i + 1].position_m[k] - 2 * head[i].position_m[k] + head[i - 1].position_m[k]) / (dt_s * dt_s);
        }
        acc[1] += gravity;
        fv_quat_conjugate(head[i].rotation, back);
        fv_quat_rotate(back, acc, acc);
        fv_fusion_add(&fusion, rate, acc, dt_s);
        fv_fusion_predict(&fusion, AHEAD_MS * dt_s, predicted);
        fv_quat_between(fusion.rotation, predicted, rate);
        fv_quat_from_vector(rate, got);
        fv_quat_between(head[i].rotation, head[i + AHEAD_MS].rotation, rate);
        fv_quat_from_vector(rate, want);
        off[count++] = fv_quat_angle(got, want) / degree;
        double tilt = tilt_error(fusion.rotation, head[i].rotation);
        if (!(tilt < 1.0)) fail_msg("tilt %g degrees at %d ms", tilt, i);
    }
    qsort(off, (size_t)count, sizeof off[0], by_value);
    if (!(off[count * 95 / 100] <= 0.5)) fail_msg("95 %% within %g degrees", off[count * 95 / 100]);
    print_message("a simulated head 20 ms ahead: 50 %% within %.3f, 95 %% within %.3f degrees\n", off[count / 2],
                  off[count * 95 / 100]);
}

/* Whatever comes, in whatever order, the rotation is one and the bias bounded. */
static void survives_anything(void **state)
{
    (void)state;
    static const double odd[] = {NAN, INFINITY, -INFINITY, DBL_MAX, -DBL_MAX, DBL_MIN, 4.9e-324, 0, -0.0, 35, -35, 157};
    dice = 7;
    fv_fusion_begin(&fusion, NULL);
    for (int n = 0; n < 200000; n++) {
        double rate[3], acc[3], dt_s = random_decade(&dice, 1e-9, 2);
        for (int i = 0; i < 3; i++) rate[i] = noise(40), acc[i] = noise(100);
        if (random_bits(&dice) % 8 == 0) rate[random_bits(&dice) % 3] = odd[random_bits(&dice) % 12];
        if (random_bits(&dice) % 8 == 0) acc[random_bits(&dice) % 3] = odd[random_bits(&dice) % 12];
        if (random_bits(&dice) % 8 == 0) dt_s = odd[random_bits(&dice) % 12];
        fv_fusion_add(&fusion, rate, acc, dt_s);
        assert_true(length_error(fusion.rotation) < 1e-12);
        for (int i = 0; i < 3; i++) assert_true(fabs(fusion.bias[i]) <= 2 * degree + 1e-12 && fusion.spread[i][i] > 0);
    }
    /* And finds back. */
    double truth[4] = {1, 0, 0, 0}, none[3] = {0, 0, 0};
    for (int i = 0; i < 60000; i++) step(truth, none, none, 0.001);
    assert_true(tilt_error(fusion.rotation, truth) < 0.1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(tilts_from_any_start), cmocka_unit_test(learns_biases),
        cmocka_unit_test(pushes_average_out),   cmocka_unit_test(decides_insane_samples),
        cmocka_unit_test(holds_when_stuck),     cmocka_unit_test(saturates),
        cmocka_unit_test(predicts),             cmocka_unit_test(predicts_a_head),
        cmocka_unit_test(finds_down_after_a_gap),
        cmocka_unit_test(survives_anything)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
