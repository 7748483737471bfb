/* path: the viewer's path at every length and number of way points, from the first frame to the ends of
 * int64: finite, exactly periodic, and never jumping. */
#include "rt/scene/path.h"
#include "tests/support/program.h"
#include "tests/support/random.h"

#include <float.h>
#include <stdbool.h>

#define FAR FV_LIST_LARGEST
#define COUNT(table) (sizeof table / sizeof table[0])
static const int64_t day_ns = INT64_C(86400000000000), frames_1e7_ns = INT64_C(10000000) * 13333333;

static const struct fv_list paths[] = {
    {0, {0}},
    {5, {1, 2, 3, 30, -10}},
    {5, {FAR, -FAR, FAR, FAR, -FAR}},
    {15, {1, 2, 3, 30, -10, 1, 2, 3, 30, -10, 1, 2, 3, 30, -10}},
    {10, {0, 1.6, 4, 0, 0, 0, 1.6, -4, 170, 20}},
    {20, {0, 1.6, 4, 0, 0, 1, 1.6, 2, -30, 10, 1, 1.6, 2, -30, 10, -3, 2, -4, 90, -90}},
    {15, {-FAR, 0, 0, -FAR, 0, FAR, 0, 0, FAR, 0, -FAR, FAR, 5e-324, 0, 0}},
};
static const double lengths_s[] = {0, -1, NAN, 1e-300, 2e-10, 1e-9, 1e-6, 0.1, 20, 86400, 1e6};

static void every_path_at_every_time(void **state)
{
    (void)state;
    const int64_t times[] = {0,
                             1,
                             -1,
                             2,
                             999999999,
                             day_ns,
                             -day_ns,
                             frames_1e7_ns,
                             INT64_MAX / 2,
                             INT64_MAX - 1,
                             INT64_MAX,
                             INT64_MIN + 1,
                             INT64_MIN};
    for (unsigned p = 0; p < COUNT(paths); p++)
        for (unsigned s = 0; s < COUNT(lengths_s); s++)
            for (unsigned t = 0; t < COUNT(times); t++) {
                struct fv_pose pose, first;
                double largest = 0, n2 = 0;
                fv_path_pose(&paths[p], lengths_s[s], times[t], &pose);
                fv_path_pose(&paths[p], 0, 0, &first);
                for (int i = 0; i < paths[p].count; i++) largest = fmax(largest, fabs(paths[p].value[i]));
                /* Catmull-Rom overshoots by an eighth of a step at most, which is twice the largest. */
                for (int i = 0; i < 3; i++) assert_true(fabs(pose.position_m[i]) <= 1.5 * largest);
                for (int i = 0; i < 4; i++) n2 += pose.rotation[i] * pose.rotation[i];
                assert_true(fabs(n2 - 1) < 4 * DBL_EPSILON);
                assert_true(fv_pose_sound(&pose));
                bool stands = paths[p].count <= 5 || p == 3 || !(lengths_s[s] >= 1e-9);
                for (int i = 0; i < 3 && stands; i++)
                    assert_true(fabs(pose.position_m[i] - first.position_m[i]) <=
                                4 * DBL_EPSILON * fabs(first.position_m[i]));
                for (int i = 0; i < 3 && paths[p].count; i++)
                    assert_true(first.position_m[i] == paths[p].value[i]);
                for (int i = 0; i < 4 && stands && p != 2 && p != 6; i++)
                    assert_true(fabs(pose.rotation[i] - first.rotation[i]) < 1e-15);
            }
}

/* There and back again takes a whole number of nanoseconds, after which every bit is the same. */
static void period_is_exact(void **state)
{
    (void)state;
    uint64_t random = 10;
    for (unsigned p = 3; p < COUNT(paths); p++)
        for (unsigned s = 5; s < COUNT(lengths_s); s++)
            for (int n = 0; n < 300; n++) {
                int64_t period_ns = (int64_t)(2e9 * lengths_s[s]),
                        t_ns = (int64_t)random_between(&random, 0, (double)period_ns);
                int64_t most = INT64_MAX / period_ns - 1,
                        rounds = (int64_t)(random_bits(&random) %
                                           (uint64_t)(most < INT64_MAX / 2 ? most : INT64_MAX / 2));
                struct fv_pose a, b, c;
                fv_path_pose(&paths[p], lengths_s[s], t_ns, &a);
                fv_path_pose(&paths[p], lengths_s[s], t_ns + rounds * period_ns, &b);
                fv_path_pose(&paths[p], lengths_s[s], t_ns - rounds * period_ns, &c);
                assert_memory_equal(&a, &b, sizeof a);
                assert_memory_equal(&a, &c, sizeof a);
            }
}

/* The ends, and the way points between them, are met; motion from one millisecond to the next is bounded, in
 * the first seconds, around each turning point, after a day, after 1e7 frames and at the ends of time. */
static void continuous(void **state)
{
    (void)state;
    const double seconds = 20;
    const int64_t starts[] = {0,
                              INT64_C(19990000000),
                              INT64_C(39990000000),
                              -5000000,
                              day_ns - 10000000,
                              frames_1e7_ns,
                              INT64_MAX - 45000000000,
                              INT64_MIN};
    for (unsigned p = 4; p < 6; p++) {
        int rows = paths[p].count / 5;
        const double *last = paths[p].value + 5 * (rows - 1);
        struct fv_pose a, b;
        fv_path_pose(&paths[p], seconds, 20000000000, &a);
        for (int i = 0; i < 3; i++) assert_true(fabs(a.position_m[i] - last[i]) < 1e-12);
        double step = 0;
        for (int i = 5; i < paths[p].count; i++)
            step = fmax(step, fabs(paths[p].value[i] - paths[p].value[i - 5]));
        double per_ms =
            1.9 * (rows - 1) / seconds * 2 * step * 1e-3; /* easing 1.9, slope of the spline below 2 */
        for (unsigned s = 0; s < COUNT(starts); s++)
            for (int n = 0; n < 44000; n++) {
                fv_path_pose(&paths[p], seconds, starts[s] + n * INT64_C(1000000), &a);
                fv_path_pose(&paths[p], seconds, starts[s] + (n + 1) * INT64_C(1000000), &b);
                double turn = 0;
                for (int i = 0; i < 3; i++) assert_true(fabs(a.position_m[i] - b.position_m[i]) <= per_ms);
                for (int i = 0; i < 4; i++) turn += pow(a.rotation[i] - b.rotation[i], 2);
                assert_true(sqrt(turn) <= per_ms * M_PI / 180);
            }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(every_path_at_every_time),
                                       cmocka_unit_test(period_is_exact), cmocka_unit_test(continuous)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
