/* gaze_smooth: what rests becomes steadier, what moves is not delayed, and nothing is passed beyond. Eye
 * vectors keep their length, at every angle. */
#include "sensors/eye/gaze_smooth.h"
#include "sensors/eye/tracker.h"

#include "tests/support/program.h"
#include "tests/support/random.h"

#include <math.h>

static const int64_t ms = 1000000;

static double noise_of(uint64_t *seed)
{
    double sum = 0;
    for (int i = 0; i < 6; i++) sum += random_between(seed, -1, 1);
    return sum / sqrt(2);
}

/* Noise of several sizes: what is given out has a share of it, and the uncertainty says how much. */
static void rest_is_steadier(void **state)
{
    (void)state;
    static const double sizes[] = {0.01, 0.1, 0.5};
    for (int k = 0; k < 3; k++) {
        struct fv_gaze_smooth s = {.settle_s = 0.05};
        uint64_t seed = 1;
        double before = 0, after = 0, told = 0;
        int n = 0;
        for (int i = 0; i < 4000; i++) {
            double raw[2] = {3 + sizes[k] * noise_of(&seed), -2 + sizes[k] * noise_of(&seed)}, out[2];
            double spread = fv_gaze_smooth_add(&s, i * 5 * ms, raw, out);
            if (i < 500) continue;
            before += pow(raw[0] - 3, 2) + pow(raw[1] + 2, 2);
            after += pow(out[0] - 3, 2) + pow(out[1] + 2, 2);
            told += spread * spread;
            n++;
        }
        print_message("noise %g: %.4f from %.4f deg, told %.4f; learnt %.4f\n", sizes[k], sqrt(after / n),
                      sqrt(before / n), sqrt(told / n), s.noise);
        assert_true(after < 0.3 * before);
        assert_true(s.noise > 0.7 * sizes[k] && s.noise < 1.4 * sizes[k]);
        assert_true(told > 0.5 * after && told < 6 * after);
    }
}

/* Saccades by minimum jerk, 2.2 ms a degree + 21 ms: from the first sample that noise does not explain to the
 * landing the answer is the measurement itself; it never lies beyond where the eye goes. */
static void saccades_are_not_smoothed(void **state)
{
    (void)state;
    static const double rates[] = {60, 120, 240, 1000};
    for (int k = 0; k < 4; k++)
        for (double amplitude = 1; amplitude <= 30; amplitude *= 1.7) {
            struct fv_gaze_smooth s = {.settle_s = 0.05};
            double lasts = 0.0022 * amplitude + 0.021, out[2] = {0, 0}, worst = 0, landed = 0;
            for (int i = 0; i < 2 * rates[k]; i++) {
                double t = i / rates[k], u = fmin(fmax((t - 1) / lasts, 0), 1);
                double raw[2] = {amplitude * u * u * u * (10 + u * (6 * u - 15)), 0};
                fv_gaze_smooth_add(&s, (int64_t)(t * 1e9), raw, out);
                assert_true(out[0] >= -1e-12 && out[0] <= amplitude + 1e-9); /* no overshoot */
                assert_true(out[0] <= raw[0] + 1e-9);
                worst = fmax(worst, fabs(out[0] - raw[0]));
                if (u == 1 && landed == 0) landed = amplitude - out[0] + 1e-12;
            }
            if (worst > 0.5 || landed > 0.1)
                fail_msg("%g Hz, %g deg: %g deg behind at most, %g at the landing", rates[k], amplitude,
                         worst, landed);
        }
}

static void pursuit_lags_little(void **state)
{
    (void)state;
    static const double speeds[] = {5, 15, 30};
    for (int k = 0; k < 3; k++) {
        struct fv_gaze_smooth s = {.settle_s = 0.05};
        uint64_t seed = 4;
        double lag = 0;
        int n = 0;
        for (int i = 0; i < 240; i++) {
            double raw[2] = {speeds[k] * i / 120 + 0.05 * noise_of(&seed), 0.05 * noise_of(&seed)}, out[2];
            fv_gaze_smooth_add(&s, i * (int64_t)(1e9 / 120), raw, out);
            if (i > 60) lag += speeds[k] * i / 120 - out[0], n++;
        }
        print_message("%g deg/s: %.3f deg behind\n", speeds[k], lag / n);
        assert_true(lag / n < 0.3);
    }
}

static void odd_input(void **state)
{
    (void)state;
    static const double odd[] = {NAN, INFINITY, -INFINITY, 1e300, 0, 5, -5, 1e-300};
    static const int64_t steps[] = {0, -1, 1, INT64_MIN / 4, INT64_MAX / 4, 5000000, 200000000};
    struct fv_gaze_smooth s = {.settle_s = 0.05};
    uint64_t seed = 2, t_ns = 0;
    for (int i = 0; i < 100000; i++) {
        double raw[2] = {odd[random_bits(&seed) % 8], odd[random_bits(&seed) % 8]}, out[2] = {NAN, NAN};
        t_ns += (uint64_t)steps[random_bits(&seed) % 7];
        double spread = fv_gaze_smooth_add(&s, (int64_t)t_ns, raw, out);
        assert_true(isfinite(out[0]) && isfinite(out[1]) && spread >= 0 && spread < 10);
        if (i % 97 == 0) fv_gaze_smooth_lost(&s);
    }
    /* Nothing is smoothed where that is asked for; a gap and a loss begin anew. */
    struct fv_gaze_smooth none = {.settle_s = 0}, gap = {.settle_s = 0.05};
    for (int i = 0; i < 100; i++) {
        double raw[2] = {0.1 * (i % 2), 0}, out[2];
        fv_gaze_smooth_add(&none, i * 5 * ms, raw, out);
        assert_true(out[0] == raw[0]);
        fv_gaze_smooth_add(&gap, i * 101 * ms, raw, out);
        assert_true(out[0] == raw[0]);
    }
}

static void vectors_and_degrees(void **state)
{
    (void)state;
    uint64_t seed = 7;
    for (int i = 0; i < 10000; i++) {
        double angle = random_between(&seed, 0, 79), turn = random_between(&seed, 0, 2 * M_PI), v[3], back[2];
        if (i % 10 == 0) angle *= 1e-12;
        double at[2] = {angle * cos(turn), angle * sin(turn)};
        fv_gaze_vector(at, v);
        assert_true(fabs(v[0] * v[0] + v[1] * v[1] + v[2] * v[2] - 1) < 1e-12);
        assert_true(fabs(-v[2] - cos(angle * M_PI / 180)) < 1e-12);
        fv_gaze_degrees(v, back);
        assert_true(hypot(back[0] - at[0], back[1] - at[1]) < 1e-9);
    }
    const double far[2] = {1e5, 0};
    double v[3];
    fv_gaze_vector(far, v);
    assert_true(fabs(v[0] - sin(80 * M_PI / 180)) < 1e-12 && v[1] == 0 && v[2] < 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(rest_is_steadier),
                                       cmocka_unit_test(saccades_are_not_smoothed),
                                       cmocka_unit_test(pursuit_lags_little), cmocka_unit_test(odd_input),
                                       cmocka_unit_test(vectors_and_degrees)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
