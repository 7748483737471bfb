/* vsync: the beat from times with jitter, gaps, times that cannot be, and a display that changes its rate. */
#include "platform/vsync.h"

#include "tests/support/program.h"
#include "tests/support/random.h"

static struct fv_vsync v;
static struct fv_beat beat;
static const int64_t period = 11111111;

/* The period to a ten-thousandth out of times that jitter by 20 us, whether steps are counted or not; gaps do no harm. */
static void measured(void **state)
{
    (void)state;
    for (int counted = 0; counted < 2; counted++) {
        uint64_t seed = 3;
        fv_vsync_begin(&v, 11000000);
        assert_false(fv_vsync_beat(&v, 0, &beat));
        int64_t t_ns = 1000000000;
        for (int i = 0; i < 3000; i++) {
            int64_t steps = random_between(&seed, 0, 1) < 0.1 ? 1 + (int64_t)random_between(&seed, 0, 20) : 1;
            t_ns += steps * period;
            fv_vsync_saw(&v, t_ns + (int64_t)random_between(&seed, -20000, 20000), counted ? steps : 0);
        }
        assert_true(v.odd == 0 && v.count == 2999);
        assert_true(fv_vsync_beat(&v, t_ns + 100000, &beat));
        assert_true(llabs(beat.period_ns - period) < 6000 && llabs(beat.flip_ns - t_ns) <= 20000);
    }
}

static void odd_times(void **state)
{
    (void)state;
    fv_vsync_begin(&v, period);
    fv_vsync_saw(&v, 1000000000, 0);
    static const int64_t bad[] = {1000000000, 999999999, 1000005000, INT64_MIN, -1, 1002000000};
    for (int i = 0; i < 6; i++) fv_vsync_saw(&v, bad[i], 0);
    fv_vsync_saw(&v, 1000000000 + 3 * period, 1); /* three in the time of one */
    assert_true(v.odd == 7 && v.count == 0);
    fv_vsync_saw(&v, 1000000000 + period, 1);
    assert_true(v.odd == 7 && v.count == 1 && fv_vsync_beat(&v, 1012000000, &beat));
    assert_int_equal(beat.period_ns, period);
    /* Silent for more than a second; or ahead of the clock. */
    assert_false(fv_vsync_beat(&v, 2100000000, &beat));
    assert_false(fv_vsync_beat(&v, 0, &beat));
    /* Another clock, for good: the beat begins again there. */
    for (int i = 0; i < 20; i++) fv_vsync_saw(&v, 500 + i * period, 1);
    assert_true(fv_vsync_beat(&v, 500 + 19 * period, &beat) && beat.flip_ns == 500 + 19 * period);
    fv_vsync_begin(&v, 0); /* no period: nothing is divided by it */
    fv_vsync_saw(&v, 5, 0);
    fv_vsync_saw(&v, INT64_MAX, 0);
    fv_vsync_saw(&v, INT64_MAX, 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(measured), cmocka_unit_test(odd_times)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
