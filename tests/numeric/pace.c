/* pace: flips aimed at and missed: tables, and a day of frames whose times are anything. */
#include "rt/frame/pace.h"
#include "tests/support/random.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

static void aims(void **state)
{
    (void)state;
    /* period 100, session begun at 1000 */
    static const struct {
        int64_t flip, now, need;
        int periods;
        int64_t start, aimed;
    } cases[] = {
        {0, 1000, 60, 1, 1040, 1},  /* as late as it can be */
        {0, 1000, 100, 1, 1000, 1}, /* all of the period */
        {4, 1401, 60, 1, 1440, 5},  /* the next one */
        {4, 1445, 60, 1, 1540, 6},  /* not enough left: the one after */
        {4, 1500, 60, 1, 1540, 6},  /* just over */
        {4, 1990, 60, 1, 2040, 11}, /* long late: none is made up for */
        {4, 1401, 60, 2, 1540, 6},  /* given two */
        {4, 1401, 150, 2, 1450, 6},
        {4, 1401, 500, 1, 1401, 6}, /* more than is given: at once, for the flip after */
        {0, 900, 60, 1, 1040, 1},   /* before the session */
        {4, 1401, -5, 1, 1505, 5},  /* nothing needed */
    };
    for (int i = 0; i < (int)(sizeof cases / sizeof cases[0]); i++) {
        struct fv_pace p = {.epoch_ns = 1000, .period_ns = 100, .flip = cases[i].flip};
        int64_t start = fv_pace_aim(&p, cases[i].now, cases[i].need, cases[i].periods);
        if (start != cases[i].start || p.flip != cases[i].aimed)
            fail_msg("case %d: begun at %lld for flip %lld", i, (long long)start, (long long)p.flip);
    }
}

static void lateness(void **state)
{
    (void)state;
    static const struct {
        int64_t flip, done, late;
    } cases[] = {{5, 1499, 0}, {5, 1500, 0}, {5, 1501, 1}, {5, 1600, 1},
                 {5, 1601, 2}, {5, 1400, 0}, {5, 0, 0}};
    for (int i = 0; i < (int)(sizeof cases / sizeof cases[0]); i++) {
        struct fv_pace p = {.epoch_ns = 1000, .period_ns = 100, .flip = cases[i].flip};
        assert_int_equal(fv_pace_done(&p, cases[i].done), cases[i].late);
        assert_int_equal(p.flip, cases[i].flip + cases[i].late);
    }
}

/* Frames are never begun before now, never shown before they are done nor before the one before, never in a
 * burst, and where there is time they are in time. */
static void any_times(void **state)
{
    (void)state;
    uint64_t seed = 7;
    struct fv_pace p = {.epoch_ns = 123456789, .period_ns = 13333333};
    int64_t now_ns = p.epoch_ns;
    for (int i = 0; i < 6500000; i++) {
        int64_t before = p.flip, need_ns = (int64_t)random_between(&seed, 0, 4e7),
                takes_ns = (int64_t)random_between(&seed, 0, 3e7);
        int periods = 1 + (int)random_between(&seed, 0, 3);
        if (i % 1000 == 0) takes_ns *= 100;
        int64_t start_ns = fv_pace_aim(&p, now_ns, need_ns, periods);
        assert_true(start_ns >= now_ns && p.flip >= before + periods);
        assert_true(start_ns == now_ns || fv_pace_deadline_ns(&p) - start_ns == need_ns);
        now_ns = start_ns + takes_ns;
        int64_t late = fv_pace_done(&p, now_ns);
        assert_true(late == 0 || takes_ns > 0);
        if (need_ns <= p.period_ns * periods && takes_ns <= need_ns) assert_int_equal(late, 0);
        assert_true(fv_pace_deadline_ns(&p) >= now_ns);
        assert_true(late == 0 || fv_pace_deadline_ns(&p) - now_ns < p.period_ns);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(aims),
        cmocka_unit_test(lateness),
        cmocka_unit_test(any_times),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
