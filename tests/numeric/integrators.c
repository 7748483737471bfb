/* integrators: orientation from angular rate against exact motions in long double: fast turns, coning,
 * half turns between samples, a second between them, samples that are no numbers. */
#include "sensors/imu/integrate.h"
#include "tests/support/long_rotation.h"
#include "tests/support/program.h"

#include <math.h>

static const struct fv_integrator *const exact = &fv_integrators[FV_INTEGRATE_EXACT];

/* Rotation by `angle` about a unit axis. */
static struct long_rotation about(const long double axis[3], long double angle)
{
    return long_exp((long double[3]){axis[0] * angle, axis[1] * angle, axis[2] * angle});
}

static double length_error(const double q[4])
{
    return fabs(sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]) - 1);
}

/* Constant rates about a skew axis. Errors in radians: with x half a step's angle, Euler turns 2 atan(x), too
 * little by the fraction x^2 / 3, the midpoint rule too much by x^2 / 24; the exact one errs by rounding. */
static const struct {
    const char *what;
    double deg_s, hz;
    int steps;
    double euler, midpoint, exact;
} turns[] = {
    {"at rest", 0, 1000, 10000, 0, 0, 0},
    {"the earth's rotation", 15.0 / 3600, 1000, 10000, 1e-15, 1e-15, 1e-15},
    {"2000 deg/s, 1000 Hz", 2000, 1000, 10000, 3.6e-2, 4.5e-3, 1e-11},
    {"2000 deg/s, 285.714 Hz", 2000, 1 / 0.0035, 2857, 0.44, 5.5e-2, 1e-11},
    {"2000 deg/s, 100 Hz", 2000, 100, 1000, 4, 0.5, 1e-11},
    {"5000 deg/s, 100 Hz: half a turn and more between samples", 5000, 100, 10, 4, 4, 1e-12},
    {"180 deg/s, 1 Hz: half a turn between samples", 180, 1, 10, 4, 4, 1e-13},
    {"360 deg/s, 1 Hz: a whole turn between samples", 360, 1, 10, 4, 4, 1e-12},
    {"1e-9 deg/s, 1 Hz", 1e-9, 1, 10, 1e-15, 1e-15, 1e-15},
    {"denormal rate", 1e-310, 1000, 1000, 1e-300, 1e-300, 1e-300},
};

static void constant_rates(void **state)
{
    (void)state;
    const long double axis[3] = {2 / 7.0L, 3 / 7.0L, -6 / 7.0L};
    for (unsigned n = 0; n < sizeof turns / sizeof turns[0]; n++) {
        double rate[3], dt_s = 1 / turns[n].hz, bound[FV_INTEGRATORS] = {turns[n].euler, turns[n].midpoint, turns[n].exact};
        long double speed = 0;
        for (int i = 0; i < 3; i++) {
            rate[i] = (double)(turns[n].deg_s * (LONG_PI / 180) * axis[i]);
            speed += (long double)rate[i] * axis[i];
        }
        struct long_rotation q = about(axis, fmodl(speed * dt_s * turns[n].steps, 4 * LONG_PI));
        for (int m = 0; m < FV_INTEGRATORS; m++) {
            struct fv_attitude a;
            fv_attitude_begin(&a, NULL, rate);
            for (int i = 0; i < turns[n].steps; i++) fv_attitude_add(&fv_integrators[m], &a, rate, dt_s);
            assert_int_equal(a.rejected + a.gaps, 0);
            assert_true(length_error(a.rotation) < 1e-14);
            double error = long_angle(a.rotation, q);
            if (!(error <= bound[m]))
                fail_msg("%s, %s: %g rad off, at most %g", turns[n].what, fv_integrators[m].name, error, bound[m]);
        }
    }
}

enum { CONE_HZ = 7 };
static const long double cone = 0.2L;

/* Coning: the device's axis runs round a cone of half-angle `cone`; its rotation and its rate, exactly
 * (Savage 1998, section on coning). */
static struct long_rotation coning(long double t, double rate[3])
{
    long double speed = 2 * LONG_PI * CONE_HZ, phase = speed * t;
    rate[0] = (double)(-speed * sinl(cone) * sinl(phase));
    rate[1] = (double)(speed * sinl(cone) * cosl(phase));
    rate[2] = (double)(-speed * (1 - cosl(cone)));
    long double sine = sinl(cone / 2);
    return (struct long_rotation){cosl(cone / 2), {sine * cosl(phase), sine * sinl(phase), 0}};
}

static double coning_error(const struct fv_integrator *integrator, int hz, double seconds)
{
    struct fv_attitude a;
    double rate[3];
    struct long_rotation q = coning(0, rate);
    double from[4] = {(double)q.w, (double)q.v[0], (double)q.v[1], (double)q.v[2]};
    fv_attitude_begin(&a, from, rate);
    int steps = (int)(seconds * hz);
    for (int i = 1; i <= steps; i++) {
        q = coning((long double)i / hz, rate);
        fv_attitude_add(integrator, &a, rate, 1.0 / hz);
    }
    return long_angle(a.rotation, q);
}

/* Twice the samples: half the error at first order, a quarter at second. Not after whole turns of the cone,
 * where Euler's first-order error has cancelled. */
static void orders_of_convergence(void **state)
{
    (void)state;
    static const double order[FV_INTEGRATORS] = {1, 2, 2};
    for (int m = 0; m < FV_INTEGRATORS; m++)
        for (int hz = 1000; hz <= 4000; hz *= 2) {
            double ratio = coning_error(&fv_integrators[m], hz, 2.03) / coning_error(&fv_integrators[m], 2 * hz, 2.03);
            if (fabs(log2(ratio) - order[m]) > 0.15)
                fail_msg("%s, %d Hz: order %.2f, must be %g", fv_integrators[m].name, hz, log2(ratio), order[m]);
        }
}

/* A million steps in double against the same product in long double: rounding does not add up. */
static void a_million_steps(void **state)
{
    (void)state;
    struct fv_attitude a;
    struct long_rotation q = {1, {0}};
    long double before[3] = {0};
    double rate[3];
    fv_attitude_begin(&a, NULL, NULL);
    for (int i = 1; i <= 1000000; i++) {
        coning((long double)i / 1000, rate);
        fv_attitude_add(exact, &a, rate, 0.001);
        long double turn[3];
        for (int k = 0; k < 3; k++) {
            turn[k] = (before[k] + rate[k]) / 2 * 0.001;
            before[k] = rate[k];
        }
        q = long_product(q, long_exp(turn));
    }
    assert_true(long_angle(a.rotation, q) < 1e-11);
    assert_true(length_error(a.rotation) < 1e-15);
}

/* One odd sample in the middle of a steady turn about y at 1 rad/s, sampled at 100 Hz for 2 s: what is
 * rejected, and how far the end is from the turn that the good samples tell of. */
static const struct {
    const char *what;
    double rate[3], dt_s;
    int rejected, gaps;
    double lost; /* rad */
} odd[] = {
    {"NaN rate", {0, NAN, 0}, 0.01, 1, 0, 0},
    {"infinite rate", {0, INFINITY, 0}, 0.01, 1, 0, 0},
    {"rate of 1e300", {1e300, 0, 0}, 0.01, 1, 0, 0},
    {"all NaN", {NAN, NAN, NAN}, 0.01, 1, 0, 0},
    {"just too fast", {0, 100.1, 0}, 0.01, 1, 0, 0},
    {"dt 0", {0, 5, 0}, 0, 1, 0, 0.01},
    {"dt negative", {0, 5, 0}, -1, 1, 0, 0.01},
    {"dt NaN", {0, 5, 0}, NAN, 1, 0, 0.01},
    {"dt infinite", {0, 5, 0}, INFINITY, 1, 0, 0.01},
    {"dt 1 s", {0, 1, 0}, 1, 0, 0, -0.99},
    {"dt a little more than 1 s", {0, 1, 0}, 1.0000001, 0, 1, 0.01},
    {"dt 1e300 s", {0, 1, 0}, 1e300, 0, 1, 0.01},
    {"dt denormal", {0, 1, 0}, 1e-310, 0, 0, 0.01},
    {"NaN after nearly 1 s: the next one is beyond it", {0, NAN, 0}, 0.995, 1, 1, 0.02},
};

static void one_odd_sample(void **state)
{
    (void)state;
    const double steady[3] = {0, 1, 0};
    const long double y[3] = {0, 1, 0};
    for (unsigned n = 0; n < sizeof odd / sizeof odd[0]; n++)
        for (int m = 0; m < FV_INTEGRATORS; m++) {
            struct fv_attitude a;
            fv_attitude_begin(&a, NULL, steady);
            for (int i = 0; i < 200; i++)
                if (i == 100) fv_attitude_add(&fv_integrators[m], &a, odd[n].rate, odd[n].dt_s);
                else fv_attitude_add(&fv_integrators[m], &a, steady, 0.01);
            struct long_rotation q = about(y, 2 - (long double)odd[n].lost);
            double error = long_angle(a.rotation, q), bound = m == FV_INTEGRATE_EXACT ? 1e-12 : 1e-3;
            if (odd[n].dt_s == 1 && m != FV_INTEGRATE_EXACT) bound = 0.1; /* their own error over a second */
            if (!(error < bound) || a.rejected != odd[n].rejected || a.gaps != odd[n].gaps || a.samples != 200)
                fail_msg("%s, %s: %g rad off, %d rejected, %d gaps", odd[n].what, fv_integrators[m].name, error,
                         (int)a.rejected, (int)a.gaps);
        }
}

/* A sensor that only gives bad samples for two seconds, then good ones again; one that is stuck. */
static void long_silences(void **state)
{
    (void)state;
    const double steady[3] = {0, 1, 0}, bad[3] = {NAN, 0, 0}, held[4] = {1, 0, 0, 0};
    const long double y[3] = {0, 1, 0};
    struct fv_attitude a;
    fv_attitude_begin(&a, held, steady);
    for (int i = 0; i < 200; i++) fv_attitude_add(exact, &a, bad, 0.01);
    assert_memory_equal(a.rotation, held, sizeof held);
    fv_attitude_add(exact, &a, steady, 0.01);
    assert_int_equal(a.gaps, 1);
    for (int i = 0; i < 100; i++) fv_attitude_add(exact, &a, steady, 0.01);
    struct long_rotation q = about(y, 1);
    assert_true(long_angle(a.rotation, q) < 1e-13);
    /* Stuck for an hour: a whole number of turns, as exactly as its samples. */
    double stuck[3] = {0, (double)(2 * LONG_PI), 0};
    fv_attitude_begin(&a, NULL, stuck);
    for (int i = 0; i < 3600000; i++) fv_attitude_add(exact, &a, stuck, 0.001);
    q = about(y, fmodl((long double)stuck[1] * (long double)0.001 * 3600000, 4 * LONG_PI));
    assert_true(long_angle(a.rotation, q) < 1e-9);
    assert_int_equal(a.rejected + a.gaps, 0);
}

/* What an attitude may begin with; the result is always a unit quaternion. */
static void hostile_beginnings(void **state)
{
    (void)state;
    static const double from[][4] = {{0, 0, 0, 0}, {NAN, 0, 0, 0}, {1, INFINITY, 0, 0}, {1e-320, 0, 0, 0}, {3, 0, 4, 0}};
    const double bad[3] = {INFINITY, 0, 0}, half[3] = {0, (double)LONG_PI, 0};
    for (unsigned n = 0; n < sizeof from / sizeof from[0]; n++)
        for (int m = 0; m < FV_INTEGRATORS; m++) {
            struct fv_attitude a;
            fv_attitude_begin(&a, from[n], bad);
            assert_true(a.rate[0] == 0 && length_error(a.rotation) < 1e-15);
            if (n < 4) assert_true(a.rotation[0] == 1);
            fv_attitude_add(&fv_integrators[m], &a, half, 1);
            assert_true(length_error(a.rotation) < 1e-15);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(constant_rates), cmocka_unit_test(orders_of_convergence),
                                       cmocka_unit_test(a_million_steps), cmocka_unit_test(one_odd_sample),
                                       cmocka_unit_test(long_silences), cmocka_unit_test(hostile_beginnings)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
