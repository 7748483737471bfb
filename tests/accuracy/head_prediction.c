/* head_prediction: each predictor of the head against what a recorded one did: from the poses that were known at a
 * time to a horizon later, at every sample of the recording. Beyond 20 ms no predictor that is asked for may err by
 * more than a degree in 95 of 100 cases. */
#include "sensors/predict.h"
#include "sensors/tape.h"

#include "tests/support/program.h"

#include <math.h>

#define FILE_NAME FV_SOURCE_DIR "/../shared/data/head/user1_quaternion.txt"
static const double most_deg = 1.0;
static const int64_t apart_ns = 50000000; /* what the head did is known between samples at most this far apart */

enum { HEADS = 20000, HISTORY = 32, HORIZONS = 3, ASKED = 1 };
static const int64_t horizon_ns[HORIZONS] = {10000000, 20000000, 40000000};

static char text[4 << 20];
static struct fv_head_sample head[HEADS];
static double error_deg[HEADS];
static int heads;

static int by_value(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Readings that come again, the same to the bit, are logged twice: what the head did lies between those that differ. */
static void read_heads(void)
{
    struct fv_tape tape;
    struct fv_error error;
    FILE *f = fopen(FILE_NAME, "rb");
    if (!f) {
        print_message("no " FILE_NAME ": skipped\n");
        skip();
    }
    size_t size = fread(text, 1, sizeof text - 1, f);
    fclose(f);
    if (fv_tape_parse(&tape, FILE_NAME, text, size, NULL, NULL, &error)) fail_msg("%s", error.text);
    assert_in_range(tape.heads, 1000, HEADS);
    assert_int_equal(fv_tape_parse(&tape, FILE_NAME, text, size, head, NULL, &error), 0);
    for (int i = 0; i < tape.heads; i++)
        if (i == 0 || memcmp(&head[i].pose, &head[i - 1].pose, sizeof head[i].pose) != 0) head[heads++] = head[i];
}

/* Where the head was at a time after sample i; false where it is not known. */
static bool came(int i, int64_t t_ns, double rotation[4])
{
    while (i + 1 < heads && head[i + 1].t_ns < t_ns) i++;
    if (i + 1 >= heads || head[i + 1].t_ns - head[i].t_ns > apart_ns) return false;
    double part = (double)(t_ns - head[i].t_ns) / (double)(head[i + 1].t_ns - head[i].t_ns);
    fv_quat_slerp(head[i].pose.rotation, head[i + 1].pose.rotation, part, rotation);
    return true;
}

/* The errors of a predictor, sorted; returns their number. */
static int errors(const struct fv_head_predictor *predictor, int64_t ahead_ns)
{
    int count = 0;
    for (int i = HISTORY - 1; i < heads; i++) {
        double rotation[4];
        struct fv_pose predicted;
        if (head[i].t_ns - head[i - 1].t_ns > apart_ns || !came(i, head[i].t_ns + ahead_ns, rotation)) continue;
        predictor->predict(head + i - (HISTORY - 1), HISTORY, head[i].t_ns + ahead_ns, &predicted);
        error_deg[count++] = fv_quat_angle(predicted.rotation, rotation) * (180 / M_PI);
    }
    qsort(error_deg, (size_t)count, sizeof error_deg[0], by_value);
    return count;
}

static void recorded_head(void **state)
{
    (void)state;
    double least = INFINITY, usual = INFINITY;
    read_heads();
    print_message("%-28s", "error in degrees, p50 p95 p99");
    for (int k = 0; k < HORIZONS; k++) print_message("%17d ms", (int)(horizon_ns[k] / 1000000));
    print_message("\n");
    for (int p = 0; p < FV_HEAD_PREDICTORS; p++) {
        print_message("%-28s", fv_head_predictors[p].what);
        for (int k = 0; k < HORIZONS; k++) {
            int count = errors(&fv_head_predictors[p], horizon_ns[k]);
            assert_true(count > heads / 2);
            double p95 = error_deg[count * 95 / 100];
            print_message("   %5.2f %5.2f %5.2f", error_deg[count / 2], p95, error_deg[count * 99 / 100]);
            if (k == ASKED) least = fmin(least, p95);
            if (k == ASKED && p == FV_PREDICT_HEAD_DECAY) usual = p95;
        }
        print_message("\n");
    }
    print_message("20 ms ahead, p95: the usual one %.3f, the best %.3f\n", usual, least);
    assert_true(usual <= most_deg);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(recorded_head)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
