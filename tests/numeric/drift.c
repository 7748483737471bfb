/* drift: what rounding does to a rotation that is multiplied by another, step after step, as a gyroscope's
 * are: how far angle and length go off, by what law they grow, and where that leads after 1e9 steps (290
 * hours at 1 kHz). Exact is the power of the step as it is in double, through its logarithm in long double.
 *
 * drift [steps]: 2e7 by default, from which 1e9 is extrapolated; the label soak runs all 1e9. */
#include "platform/pose.h"
#include "tests/support/long_rotation.h"
#include "tests/support/program.h"
#include "tests/support/random.h"

#include <stdbool.h>

static int64_t steps_max = 20000000;
static const int64_t target = 1000000000;
static const double allowed_rad =
    1e-6; /* after 1e9 steps; a hundredth of a pixel, at 67 a degree, is 2.6e-6 */

static const struct {
    const char *what;
    double vector[3];
    bool normalised;
} cases[] = {
    {"2000 deg/s at 1 kHz", {0.0209, -0.0209, 0.0185}, true},
    {"2000 deg/s at 1 kHz, length left alone", {0.0209, -0.0209, 0.0185}, false},
    {"1 mrad about one axis", {0, 1e-3, 0}, true},
    {"the earth at 1 kHz", {4e-8, 6e-8, 0}, true},
    {"1e-12 rad", {1e-12, 0, 0}, true},
    {"nearly half a turn", {1.8, -1.8, 1.83}, true},
};

static struct long_rotation power(const double step[4], int64_t n)
{
    long double r[3], angle = long_log(long_unit(long_of(step)), r);
    long double turned = remainderl(angle * (long double)n, 2 * LONG_PI);
    for (int i = 0; i < 3; i++) r[i] *= angle > 0 ? turned / angle : 0;
    return long_exp(r);
}

static void products_drift_slowly(void **state)
{
    (void)state;
    for (unsigned c = 0; c < sizeof cases / sizeof cases[0]; c++) {
        double step[4], q[4] = {1, 0, 0, 0}, off = 0, steepest = 0, length = 0;
        fv_quat_from_vector(cases[c].vector, step);
        int64_t at = 1000, n = 0;
        print_message("%s:", cases[c].what);
        for (; n < steps_max; at = at * 10 < steps_max ? at * 10 : steps_max) {
            for (; n < at; n++) {
                fv_quat_multiply(q, step, q);
                if (cases[c].normalised) fv_quat_normalise(q);
            }
            off = long_angle(q, power(step, n));
            if (n < steps_max) steepest = fmax(steepest, (off + 1e-15) / (double)n);
            long double all[4] = {q[0], q[1], q[2], q[3]};
            length = (double)(long_length(all, 4) - 1);
            print_message("  %.0e: %.1e rad", (double)n, off);
        }
        /* Rounding errors of one sign add up in proportion to the steps, those of both signs with their root.
         * The first, the worse law, extrapolates; it must hold for what was run. Small steps leave the exact
         * start late, but no product rounds by more than some 2e-16: 2e-7 in all. */
        if (off > steepest * (double)n) fail_msg("%s: drift grows faster than the steps", cases[c].what);
        double there = fmax(off, 1e-16) * (double)target / (double)n;
        print_message("; length off by %.1e; at most %.1e rad after 1e9\n", length, there);
        if (cases[c].normalised && fabs(length) > 3e-16)
            fail_msg("%s: length off by %g", cases[c].what, length);
        if (!cases[c].normalised && fabs(length) > 3e-16 * (double)n)
            fail_msg("%s: length off by %g", cases[c].what, length);
        if (!(there < allowed_rad)) fail_msg("%s: %g rad after 1e9 steps", cases[c].what, there);
    }
}

/* Steps that differ, 64 in turn. */
static void changing_steps_drift_slowly(void **state)
{
    (void)state;
    enum { STEPS = 64 };
    static double step[STEPS][4];
    struct long_rotation round = {1, {0}};
    uint64_t random = 3;
    double q[4] = {1, 0, 0, 0};
    for (int k = 0; k < STEPS; k++) {
        double r[3];
        random_direction(&random, r);
        double size = random_decade(&random, 1e-9, 0.5);
        for (int i = 0; i < 3; i++) r[i] *= size;
        fv_quat_from_vector(r, step[k]);
        round = long_product(round, long_unit(long_of(step[k])));
    }
    int64_t rounds = steps_max / STEPS;
    for (int64_t n = 0; n < rounds; n++)
        for (int k = 0; k < STEPS; k++) {
            fv_quat_multiply(q, step[k], q);
            fv_quat_normalise(q);
        }
    long double r[3], angle = long_log(round, r),
                      turned = remainderl(angle * (long double)rounds, 2 * LONG_PI);
    for (int i = 0; i < 3; i++) r[i] *= turned / angle;
    double off = long_angle(q, long_exp(r)), there = off * (double)target / (double)(rounds * STEPS);
    print_message("64 steps in turn: %.1e rad after %.0e; at most %.1e after 1e9\n", off,
                  (double)(rounds * STEPS), there);
    assert_true(there < allowed_rad);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(products_drift_slowly),
                                       cmocka_unit_test(changing_steps_drift_slowly)};
    if (argc > 1) steps_max = strtoll(argv[1], NULL, 10);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
