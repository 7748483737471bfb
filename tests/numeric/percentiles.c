/* percentiles: statistics of 1e5 frame records, the most that are kept: ranks by whole numbers, values that
 * are all the same, poisoned, denormal or as large as there are. */
#include "cli/columns.h"
#include "tests/support/program.h"
#include "tests/support/random.h"

#include <float.h>

#define COUNT(table) (sizeof table / sizeof table[0])
enum { RECORDS = 100000 };
static struct fv_frame_record records[RECORDS];
static struct fv_session session = {.record = records, .capacity = RECORDS};
static const struct fv_column *column = &fv_columns[FV_COLUMN_FRAME_MS];

/* Values 1 to n in any order: the percentile is its own rank, ceil(percent n / 100) in whole numbers. */
static void ranks_are_exact(void **state)
{
    (void)state;
    static const int counts[] = {1,   2,   3,    7,    25,   99,   100,   101,
                                 300, 700, 1000, 2900, 5600, 9999, 99999, 100000};
    for (unsigned c = 0; c < COUNT(counts); c++) {
        int64_t n = counts[c], step = 7919; /* a prime, which no count is a multiple of */
        for (int64_t i = 0; i < n; i++) records[i].frame_ms = (float)(1 + i * step % n);
        session.frames = n;
        for (int64_t percent = 1; percent <= 100; percent += n > 5000 ? 7 : 1) {
            int64_t rank = (percent * n + 99) / 100;
            double value = fv_column_percentile(&session, column, 0, n, (double)percent);
            if (value != (double)rank)
                fail_msg("%lld %% of %lld: %.9g, not %lld", (long long)percent, (long long)n, value,
                         (long long)rank);
        }
    }
}

/* What fills all records, what stands in every k-th instead, and what comes out. */
static void odd_values(void **state)
{
    (void)state;
    static const struct {
        float most, some;
        int every;
        double p1, p50, p99, mean;
    } table[] = {
        {5, 5, 1, 5, 5, 5, 5},
        {0, -0.0f, 2, 0, 0, 0, 0},
        {NAN, NAN, 1, NAN, NAN, NAN, NAN},
        {INFINITY, -INFINITY, 2, NAN, NAN, NAN, NAN},
        {NAN, 3, RECORDS, 3, 3, 3, 3},
        {2, NAN, 2, 2, 2, 2, 2},
        {2, INFINITY, 3, 2, 2, 2, 2},
        {1, 1000, 50, 1, 1, 1000, 20.98},
        {1, 1000, 200, 1, 1, 1, 5.995},
        {FLT_MAX, FLT_MAX, 1, FLT_MAX, FLT_MAX, FLT_MAX, FLT_MAX},
        {-FLT_MAX, FLT_MAX, 2, -FLT_MAX, -FLT_MAX, FLT_MAX, 0},
        {FLT_TRUE_MIN, FLT_TRUE_MIN, 1, FLT_TRUE_MIN, FLT_TRUE_MIN, FLT_TRUE_MIN, FLT_TRUE_MIN},
        {FLT_TRUE_MIN, -FLT_TRUE_MIN, 4, -FLT_TRUE_MIN, FLT_TRUE_MIN, FLT_TRUE_MIN,
         0.5 * (double)FLT_TRUE_MIN},
        {16777216, 16777215, 2, 16777215, 16777215, 16777216, 16777215.5},
    };
    session.frames = RECORDS;
    for (unsigned r = 0; r < COUNT(table); r++) {
        for (int i = 0; i < RECORDS; i++)
            records[i].frame_ms = i % table[r].every ? table[r].most : table[r].some;
        double expected[] = {table[r].p1, table[r].p50, table[r].p99};
        static const double percents[] = {1, 50, 99};
        for (int k = 0; k < 3; k++) {
            double p = fv_column_percentile(&session, column, 0, RECORDS, percents[k]);
            if (!(p == expected[k] || (isnan(p) && isnan(expected[k]))))
                fail_msg("row %u: p%g is %g, not %g", r, percents[k], p, expected[k]);
        }
        struct fv_summary s = fv_column_summary(&session, column);
        if (isnan(table[r].mean)) {
            assert_true(isnan(s.mean) && isnan(s.min) && isnan(s.max));
            continue;
        }
        if (!(fabs(s.mean - table[r].mean) <= 1e-12 * fabs(table[r].mean)))
            fail_msg("row %u: mean %.17g", r, s.mean);
        assert_true(s.min <= s.mean && s.mean <= s.max);
    }
}

/* Means of values that a sum in float would lose: against long double. */
static void means(void **state)
{
    (void)state;
    uint64_t random = 11;
    for (int spread = 0; spread < 8; spread++) {
        long double sum = 0;
        for (int i = 0; i < RECORDS; i++) {
            records[i].frame_ms =
                (float)random_decade(&random, pow(10, -4 * spread), pow(10, 4 * spread) * 1.001);
            sum += (long double)records[i].frame_ms;
        }
        assert_true(fabsl(fv_column_summary(&session, column).mean - sum / RECORDS) <=
                    1e-12L * sum / RECORDS);
    }
}

/* Times of day-long sessions, and of ones whose clock stands or runs to the end of int64. */
static void times(void **state)
{
    (void)state;
    static const struct {
        int64_t first, step;
        double last_s;
    } table[] = {{0, 13333333, 99999 * 0.013333333},
                 {0, 86400000000000, 99999 * 86400.0},
                 {0, 92233720368547, 99999 * 92233.720368547},
                 {7, 0, 99999 * 0.02},
                 {INT64_MAX - 1000000, 1, 99999e-9}};
    session.period_ms = 20;
    for (unsigned r = 0; r < COUNT(table); r++) {
        for (int i = 0; i < RECORDS; i++) records[i].t_ns = table[r].first + i * table[r].step;
        double before = -1;
        for (int i = 0; i < RECORDS; i += 333) {
            double t = fv_record_seconds(&session, i);
            assert_true(t >= before);
            before = t;
        }
        /* Beyond 2^53 ns, a hundred days, a difference is known to some of them. */
        assert_true(fabs(fv_record_seconds(&session, RECORDS - 1) - table[r].last_s) <
                    1e-12 * table[r].last_s + 3e-6);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(ranks_are_exact), cmocka_unit_test(odd_values),
                                       cmocka_unit_test(means), cmocka_unit_test(times)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
