/* fixation: robust choice of the looks at a target: the median against sorting; made-up fixations with nearly
 * half of the looks elsewhere, saccades, single jumps, numbers that are none; equal looks; glints astray; and
 * the condition number against matrices of which it is known. */
#include "sensors/eye/fixation.h"
#include "tests/support/program.h"
#include "tests/support/random.h"

#include <math.h>

enum { MOST = FV_FIXATION_LOOKS_MAX };
static struct fv_fixation_look look[MOST];
static bool chosen[MOST];
static const double near_px = 2.7;

static int compare(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void medians(void **state)
{
    (void)state;
    static const double large[] = {1e308, -1e308, 1.7e308, 1.6e308};
    uint64_t seed = 1;
    for (int round = 0; round < 400; round++) {
        static double value[MOST], sorted[MOST];
        int n = 1 + round % 61 + (round % 7 == 0 ? 900 : 0);
        for (int i = 0; i < n; i++) {
            value[i] = random_between(&seed, -1, 1);
            if (round % 3 == 0) value[i] = floor(3 * value[i]); /* many equal ones */
            if (round % 5 == 0) value[i] = i;
        }
        memcpy(sorted, value, sizeof value);
        qsort(sorted, (size_t)n, sizeof sorted[0], compare);
        double expected = n % 2 ? sorted[n / 2] : 0.5 * sorted[n / 2] + 0.5 * sorted[n / 2 - 1];
        assert_true(fv_fixation_median(value, n) == expected);
    }
    double four[4];
    memcpy(four, large, sizeof four);
    assert_true(fv_fixation_median(four, 4) == 0.5 * 1e308 + 0.5 * 1.6e308);
}

static double normal(uint64_t *seed)
{
    double sum = 0;
    for (int i = 0; i < 12; i++) sum += random_between(seed, -0.5, 0.5);
    return sum;
}

/* A fixation at (300, 200) with noise; the glint 10 px beside it. */
static void fixate(int n, double noise, uint64_t *seed)
{
    for (int i = 0; i < n; i++) {
        double x = 300 + noise * normal(seed), y = 200 + noise * normal(seed);
        look[i] = (struct fv_fixation_look){
            i * INT64_C(8333333),
            {{x, y}, {310 + noise * normal(seed), 205 + noise * normal(seed)}, true},
            0.9};
    }
}

/* What is not of the fixation: so many of the looks, and where they are. */
enum kind { SCATTERED, ELSEWHERE, ARRIVING, JUMPS, INFINITE, ENORMOUS };

static void wrong(int n, int count, enum kind kind, uint64_t *seed)
{
    for (int k = 0; k < count; k++) {
        int i = kind == ARRIVING ? k : kind == ELSEWHERE ? n - 1 - k : (int)((int64_t)k * n / count);
        double *p = look[i].feature.pupil;
        switch (kind) {
        case SCATTERED:
            for (int j = 0; j < 2; j++) p[j] = random_between(seed, 0, 600);
            break;
        case ELSEWHERE: p[0] = 340 + 0.2 * normal(seed); break;
        case ARRIVING: p[0] = 250 + 50.0 * k / count; break; /* a slow move to the target */
        case JUMPS: p[1] += k % 2 ? 9 : -200; break;
        case INFINITE: p[k % 2] = k % 3 ? NAN : INFINITY; break;
        case ENORMOUS: p[0] = k % 2 ? 1e300 : -1e300; break;
        }
    }
}

static void wrong_looks_are_left_out(void **state)
{
    (void)state;
    uint64_t seed = 2;
    for (int round = 0; round < 240; round++) {
        int n = 20 + round % 5 * 40, count = n * 45 / 100;
        double noise = round % 2 ? 0.25 : 0.05, sum[2] = {0, 0};
        struct fv_fixation f;
        enum kind kind = (enum kind)(round / 5 % 6);
        fixate(n, noise, &seed);
        wrong(n, count, kind, &seed);
        fv_fixation_choose(look, n, near_px, chosen, &f);
        int looks = 0;
        for (int i = 0; i < n; i++) {
            if (!chosen[i]) continue;
            looks++;
            for (int j = 0; j < 2; j++) sum[j] += look[i].feature.pupil[j];
            /* Nothing of what is wrong but by chance where the right ones are. */
            assert_true(hypot(look[i].feature.pupil[0] - 300, look[i].feature.pupil[1] - 200) <
                        6 * noise + 1);
        }
        assert_int_equal(looks, f.looks);
        /* Most of the right ones; their middle as good as without the wrong ones. */
        assert_true(looks >= (n - count) * 7 / 10);
        for (int j = 0; j < 2; j++) {
            double least = 3 * noise / sqrt(looks) + (kind == ARRIVING ? 0.3 : 0.02);
            if (fabs(sum[j] / looks - (j ? 200 : 300)) > least)
                fail_msg("kind %d, %d looks, noise %g: middle off by %g", (int)kind, n, noise,
                         sum[j] / looks - (j ? 200 : 300));
            assert_true(fabs(f.pupil[j] - (j ? 200 : 300)) < least + noise);
        }
        assert_true(f.spread_px < 2 * noise + 0.2);
    }
}

static void odd_looks(void **state)
{
    (void)state;
    struct fv_fixation f;
    uint64_t seed = 3;
    fv_fixation_choose(look, 0, near_px, chosen, &f);
    assert_true(f.looks == 0 && f.length_ns == 0);
    /* All the same: all are chosen, at once and exactly. */
    fixate(MOST, 0, &seed);
    fv_fixation_choose(look, MOST, near_px, chosen, &f);
    assert_true(f.looks == MOST && f.pupil[0] == 300 && f.pupil[1] == 200 && f.spread_px == 0);
    assert_int_equal(f.length_ns, (MOST - 1) * INT64_C(8333333));
    /* None that is a number, or of any weight. */
    for (int i = 0; i < 40; i++) look[i].feature.pupil[i % 2] = NAN;
    for (int i = 40; i < 50; i++) look[i].weight = i % 2 ? 0 : (double)NAN;
    fv_fixation_choose(look, 50, near_px, chosen, &f);
    assert_int_equal(f.looks, 0);
    /* One. */
    fv_fixation_choose(look + 50, 1, near_px, chosen, &f);
    assert_true(f.looks == 1 && f.length_ns == 0);
}

static void glints_astray_are_not_seen(void **state)
{
    (void)state;
    struct fv_fixation f;
    uint64_t seed = 4;
    fixate(100, 0.1, &seed);
    for (int i = 0; i < 100; i += 5) look[i].feature.glint[0] += i % 2 ? 4 : -30;
    look[1].feature.glint[1] = NAN;
    look[2].feature.glint_seen = false;
    fv_fixation_choose(look, 100, near_px, chosen, &f);
    assert_true(f.looks >= 95);
    int with = 0;
    for (int i = 0; i < 100; i++) {
        if (chosen[i] && (i % 5 == 0 || i == 1 || i == 2)) assert_false(look[i].feature.glint_seen);
        with += chosen[i] && look[i].feature.glint_seen;
    }
    assert_true(with >= 70);
}

static void condition_numbers(void **state)
{
    (void)state;
    double row[FV_GAZE_TERMS][FV_GAZE_TERMS + 2];
    memset(row, 0, sizeof row);
    for (int i = 0; i < FV_GAZE_TERMS; i++) row[i][i] = i % 2 ? 3 : -0.003;
    assert_true(fabs(fv_gaze_condition(row, FV_GAZE_TERMS) - 1000) < 1e-9);
    assert_true(fv_gaze_condition(row, 1) == 1);
    /* [1 a; 0 1]: the larger singular value is (a + sqrt(a^2 + 4)) / 2, the smaller one its inverse. What
     * lies below the diagonal plays no part. */
    for (double a = 1e-8; a < 1e6; a *= 100) {
        double one[FV_GAZE_TERMS][FV_GAZE_TERMS + 2] = {{1, a}, {99, 1}}, s = 0.5 * (a + hypot(a, 2));
        assert_true(fabs(fv_gaze_condition(one, 2) / (s * s) - 1) < 1e-4);
    }
    row[3][3] = 0;
    assert_true(isinf(fv_gaze_condition(row, FV_GAZE_TERMS)));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(medians), cmocka_unit_test(wrong_looks_are_left_out), cmocka_unit_test(odd_looks),
        cmocka_unit_test(glints_astray_are_not_seen), cmocka_unit_test(condition_numbers)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
