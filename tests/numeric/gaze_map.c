/* gaze_map: calibrations of 5, 9 and 13 targets by the simulated eye, tried elsewhere than at the targets;
 * the QR against long double; and calibrations that cannot be, each refused with its reason. */
#include "sensors/eye/gaze_map.h"
#include "tests/support/program.h"
#include "tests/support/random.h"

#include <math.h>

#define COUNT(table) (sizeof table / sizeof table[0])
enum { EACH = 40, MOST = 13 * EACH };
static struct fv_gaze_target target[FV_GAZE_TARGETS_MAX + 1];
static const double places[13][2] = {{0, 0},   {-16, 10}, {16, 10}, {-16, -10}, {16, -10}, {0, 10}, {0, -10},
                                     {-16, 0}, {16, 0},   {-8, 5},  {8, 5},     {-8, -5},  {8, -5}};

/* What a camera below the eye sees of a gaze; `shift`: the headset has slipped by that many pixels. */
static struct fv_gaze_feature look(const double deg[2], double noise, double shift, uint64_t *seed)
{
    double x = deg[0] * (M_PI / 180), y = (deg[1] + 15) * (M_PI / 180);
    double g[2] = {sin(x) * cos(y), sin(y)};
    struct fv_gaze_feature f = {.glint_seen = true};
    for (int i = 0; i < 2; i++) {
        f.pupil[i] = 300 + shift + (i ? -160 : 160) * g[i] + noise * random_between(seed, -1.7, 1.7);
        f.glint[i] = 310 + shift + (i ? -80 : 80) * g[i] + noise * random_between(seed, -1.7, 1.7);
    }
    return f;
}

static int calibration(int count, double noise, bool glints, uint64_t *seed)
{
    for (int i = 0; i < count * EACH; i++) {
        target[i] = (struct fv_gaze_target){
            look(places[i / EACH], noise, 0, seed), {places[i / EACH][0], places[i / EACH][1]}, 1};
        target[i].feature.glint_seen = glints;
    }
    return count * EACH;
}

static void calibrations(void **state)
{
    (void)state;
    static const struct {
        int count;
        bool glints;
        double noise_px, most_deg;
    } table[] = {{5, false, 0, 1.5},   {5, false, 0.3, 1.6},  {9, false, 0, 0.5},  {9, false, 0.3, 0.6},
                 {13, false, 0, 0.25}, {13, false, 0.3, 0.4}, {9, true, 0.1, 0.6}, {13, true, 0.1, 0.4}};
    uint64_t seed = 1;
    for (unsigned i = 0; i < COUNT(table); i++) {
        struct fv_gaze_map map;
        int n = calibration(table[i].count, table[i].noise_px, table[i].glints, &seed);
        assert_int_equal(fv_gaze_calibrate(target, n, &map), FV_GAZE_CALIBRATED);
        double worst = 0, error;
        for (int j = 0; j < 200; j++) {
            double at[2] = {random_between(&seed, -16, 16), random_between(&seed, -10, 10)}, found[2];
            struct fv_gaze_feature f = look(at, 0, table[i].glints ? 4 : 0, &seed);
            assert_true(fv_gaze_map_at(&map, &f, found, &error));
            worst = fmax(worst, hypot(found[0] - at[0], found[1] - at[1]));
        }
        if (worst > table[i].most_deg)
            fail_msg("%d targets, noise %g: %.3f degrees", table[i].count, table[i].noise_px, worst);
    }
}

/* Far outside of what was calibrated the map stays within what its slopes give, and says how unsure it is. */
static void beyond_the_calibration(void **state)
{
    (void)state;
    static const double far[] = {0, 1e3, -1e4, 1e9, -1e300};
    struct fv_gaze_map map;
    uint64_t seed = 2;
    int n = calibration(13, 0.2, false, &seed);
    assert_int_equal(fv_gaze_calibrate(target, n, &map), FV_GAZE_CALIBRATED);
    for (unsigned i = 0; i < COUNT(far); i++)
        for (unsigned j = 0; j < COUNT(far); j++) {
            struct fv_gaze_feature f = {.pupil = {far[i], far[j]}};
            double at[2], error;
            assert_true(fv_gaze_map_at(&map, &f, at, &error));
            assert_true(fabs(at[0]) < 1000 && fabs(at[1]) < 1000 && isfinite(error) &&
                        error > 3 * map.pupil.error_deg);
        }
    struct fv_gaze_feature odd = {.pupil = {NAN, 0}};
    double at[2], error;
    assert_false(fv_gaze_map_at(&map, &odd, at, &error));
    memset(&map, 0, sizeof map);
    odd.pupil[0] = 0;
    assert_false(fv_gaze_map_at(&map, &odd, at, &error));
}

/* One sample in ten lost, not finite or weighing nothing: the same map as without it. */
static void bad_samples_are_left_out(void **state)
{
    (void)state;
    static struct fv_gaze_target good[MOST];
    struct fv_gaze_map a, b;
    uint64_t seed = 3;
    int n = calibration(9, 0.3, true, &seed), kept = 0;
    for (int i = 0; i < n; i++) {
        if (i % 10) good[kept++] = target[i];
        else if (i % 3 == 0) target[i].weight = 0;
        else if (i % 3 == 1) target[i].feature.pupil[i % 2] = NAN;
        else target[i].direction_deg[i % 2] = INFINITY;
    }
    assert_int_equal(fv_gaze_calibrate(target, n, &a), FV_GAZE_CALIBRATED);
    assert_int_equal(fv_gaze_calibrate(good, kept, &b), FV_GAZE_CALIBRATED);
    assert_memory_equal(&a, &b, sizeof a);
    assert_true(a.difference.terms > 0);
}

static void refusals(void **state)
{
    (void)state;
    struct fv_gaze_map map;
    uint64_t seed = 4;
    for (int kind = 0; kind < 9; kind++) {
        static const enum fv_gaze_refusal reason[] = {FV_GAZE_TARGETS_EQUAL,
                                                      FV_GAZE_TARGETS_COLLINEAR,
                                                      FV_GAZE_PUPIL_STILL,
                                                      FV_GAZE_PUPIL_COLLINEAR,
                                                      FV_GAZE_FEW,
                                                      FV_GAZE_FEW,
                                                      FV_GAZE_UNRELATED,
                                                      FV_GAZE_MANY,
                                                      FV_GAZE_FEW};
        int n = calibration(9, 0.2, false, &seed);
        for (int i = 0; i < n; i++) {
            struct fv_gaze_target *t = &target[i];
            if (kind == 0) t->direction_deg[0] = t->direction_deg[1] = 3;
            if (kind == 1) t->direction_deg[1] = 2 * t->direction_deg[0];
            if (kind == 2) t->feature.pupil[0] = t->feature.pupil[1] = 7;
            if (kind == 3) t->feature.pupil[1] = t->feature.pupil[0];
            if (kind == 6)
                for (int j = 0; j < 2; j++) t->feature.pupil[j] = random_between(&seed, 0, 100);
        }
        if (kind == 4) n = 4 * EACH; /* four places */
        if (kind == 5) n = 0;
        if (kind == 7) n = FV_GAZE_TARGETS_MAX + 1;
        if (kind == 8)
            for (int i = 0; i < n; i++) target[i].weight = NAN;
        enum fv_gaze_refusal why = fv_gaze_calibrate(target, n, &map);
        if (why != reason[kind]) fail_msg("kind %d: %s", kind, fv_gaze_refusal_text[why]);
        assert_int_equal(map.pupil.terms, 0);
        assert_true(strlen(fv_gaze_refusal_text[why]) > 10);
    }
    /* Numbers as large as there are overflow inside, and are refused. */
    int n = calibration(9, 0.2, false, &seed);
    for (int i = 0; i < n; i++) target[i].feature.pupil[i % 2] *= 1e305;
    assert_true(fv_gaze_calibrate(target, n, &map) != FV_GAZE_CALIBRATED);
}

/* Random systems, some nearly singular, against Gauss's elimination of the normal equations in long double.
 */
static void least_squares(void **state)
{
    (void)state;
    uint64_t seed = 5;
    for (int round = 0; round < 200; round++) {
        enum { N = 30 };
        double row[N][FV_GAZE_TERMS + 2], x[2][FV_GAZE_TERMS];
        long double m[FV_GAZE_TERMS][FV_GAZE_TERMS + 1] = {{0}};
        int terms = 1 + round % FV_GAZE_TERMS;
        for (int i = 0; i < N; i++) {
            for (int j = 0; j < terms + 2; j++) row[i][j] = random_between(&seed, -1, 1);
            if (terms > 1) row[i][1] = row[i][0] + 1e-3 * row[i][1];
            for (int j = 0; j < terms; j++)
                for (int k = 0; k <= terms; k++)
                    m[j][k] += (long double)row[i][j] * row[i][k]; /* k = terms: side 0 */
        }
        assert_true(fv_gaze_solve(row, N, terms, x));
        for (int p = 0; p < terms; p++)
            for (int i = p + 1; i < terms; i++)
                for (int k = terms; k >= p; k--) m[i][k] -= m[i][p] / m[p][p] * m[p][k];
        for (int i = terms - 1; i >= 0; i--) {
            for (int k = i + 1; k < terms; k++) m[i][terms] -= m[i][k] * m[k][terms];
            m[i][terms] /= m[i][i];
            if (fabs((double)m[i][terms] - x[0][i]) > 1e-8 * (1 + fabs(x[0][i])))
                fail_msg("round %d, term %d: %.12g, not %.12g", round, i, x[0][i], (double)m[i][terms]);
        }
    }
    double flat[4][FV_GAZE_TERMS + 2] = {{1, 2, 0, 0}, {2, 4, 0, 0}, {3, 6, 1, 1}, {4, 8, 1, 1}},
                                   x[2][FV_GAZE_TERMS];
    assert_false(fv_gaze_solve(flat, 4, 2, x));
    assert_false(fv_gaze_solve(flat, 1, 2, x));
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(calibrations),
                                       cmocka_unit_test(beyond_the_calibration),
                                       cmocka_unit_test(bad_samples_are_left_out), cmocka_unit_test(refusals),
                                       cmocka_unit_test(least_squares)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
