/* broad: the fusion's inclination on five trials of the BROAD benchmark (Laidig, Caruso, Cereatti and Seel 2021), by
 * its measure: root mean square over the samples of the movement whose truth is known, of the error quaternion's
 * part that is not about the vertical. Beside it what others reach on these trials, and a sample's time. */
#include "sensors/imu/fusion.h"

#include "platform/pose.h"
#include "tests/support/program.h"

#include <math.h>
#include <time.h>

#define FOLDER FV_SOURCE_DIR "/../shared/data/imu/broad"
static const double most_deg = 0.9, hz = 285.7142857;

enum { TRIALS = 5, SAMPLES = 60000, ROUNDS = 5 };
enum { RATE = 0, ACC = 3, TRUTH = 9, MOVES = 13, COLUMNS = 14 };

static const struct {
    const char *name;
    double vqf_deg; /* measured with its authors' program, without the magnetometer */
} trials[TRIALS] = {{"02_undisturbed_slow_rotation_B", 0.429},
                    {"07_undisturbed_fast_rotation_B", 1.023},
                    {"10_undisturbed_slow_translation_A", 0.299},
                    {"21_undisturbed_fast_combined", 1.716},
                    {"24_disturbed_tapping_A", 0.607}};

static float row[SAMPLES][COLUMNS];
static double rotation[SAMPLES][4], nanoseconds[TRIALS * ROUNDS];

static int by_value(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static int read_trial(const char *name)
{
    char path[512];
    snprintf(path, sizeof path, FOLDER "/%s.f32", name);
    FILE *f = fopen(path, "rb");
    if (!f) {
        print_message("no %s: skipped\n", path);
        skip();
    }
    int count = (int)fread(row, sizeof row[0], SAMPLES, f);
    fclose(f);
    return count;
}

/* Nanoseconds a sample, of this thread. */
static double run(int count, struct fv_fusion *fusion)
{
    struct timespec from, to;
    fv_fusion_begin(fusion, NULL);
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &from);
    for (int i = 0; i < count; i++) {
        double rate[3], acc[3];
        for (int k = 0; k < 3; k++) rate[k] = row[i][RATE + k], acc[k] = row[i][ACC + k];
        fv_fusion_add(fusion, rate, acc, 1 / hz);
        memcpy(rotation[i], fusion->rotation, sizeof rotation[i]);
    }
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &to);
    return (1e9 * (double)(to.tv_sec - from.tv_sec) + (double)(to.tv_nsec - from.tv_nsec)) / count;
}

/* Radians of the error that are not about the vertical. The truth's world has z up: turned about x, y is. */
static double inclination(const double got[4], const float truth[4])
{
    static const double z_to_y[4] = {M_SQRT1_2, -M_SQRT1_2, 0, 0};
    double want[4] = {truth[0], truth[1], truth[2], truth[3]}, back[4], error[4];
    fv_quat_normalise(want);
    fv_quat_multiply(z_to_y, want, want);
    fv_quat_conjugate(got, back);
    fv_quat_multiply(want, back, error);
    return 2 * atan2(hypot(error[1], error[3]), hypot(error[0], error[2]));
}

static double rmse_deg(int count)
{
    double sum = 0;
    int judged = 0;
    for (int i = 0; i < count; i++) {
        const float *truth = &row[i][TRUTH];
        if (row[i][MOVES] < 0.5f || !isfinite(truth[0] + truth[1] + truth[2] + truth[3])) continue;
        double error = inclination(rotation[i], truth);
        sum += error * error;
        judged++;
    }
    assert_true(judged > count / 4);
    return sqrt(sum / judged) * (180 / M_PI);
}

static void inclination_of_broad(void **state)
{
    (void)state;
    static struct fv_fusion fusion;
    double mean = 0, vqf = 0;
    print_message("%-36s %8s %8s\n", "inclination RMSE, degrees", "here", "VQF");
    for (int t = 0; t < TRIALS; t++) {
        int count = read_trial(trials[t].name);
        for (int i = 0; i < ROUNDS; i++) nanoseconds[t * ROUNDS + i] = run(count, &fusion);
        double rmse = rmse_deg(count);
        mean += rmse / TRIALS;
        vqf += trials[t].vqf_deg / TRIALS;
        print_message("%-36s %8.3f %8.3f\n", trials[t].name, rmse, trials[t].vqf_deg);
        assert_int_equal(fusion.counts.samples, count);
        assert_int_equal(fusion.counts.bad + fusion.counts.mistimed + fusion.counts.stuck + fusion.counts.gaps, 0);
    }
    qsort(nanoseconds, TRIALS * ROUNDS, sizeof nanoseconds[0], by_value);
    print_message("%-36s %8.3f %8.3f (BasicVQF 1.15, x-io Fusion 2.95)\n", "mean", mean, vqf);
    print_message("ns a sample, median: %.0f (VQF 250)\n", nanoseconds[TRIALS * ROUNDS / 2]);
    assert_true(mean <= most_deg);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(inclination_of_broad)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
