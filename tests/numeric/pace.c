/* pace: flips aimed at and missed: tables, and a day of frames whose times are anything. */
#include "rt/frame/pace.h"
#include "tests/support/random.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include <math.h>

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

/* A display whose period is 1 % off and drifts, told of by a refresh now and then: session times grow, deadlines are
 * the lead before its refreshes, and nothing is skipped for its sake. */
static void follows(void **state)
{
    (void)state;
    uint64_t seed = 9;
    struct fv_pace p = {.epoch_ns = 7000000000, .period_ns = 13333333};
    double flip_ns = 7000000000 - 4e6, period_ns = 13200000;
    int64_t now_ns = p.epoch_ns, shown_ns = 0;
    for (int i = 0; i < 400000; i++) {
        period_ns += random_between(&seed, -2, 2);
        while (flip_ns + period_ns < (double)now_ns) flip_ns += period_ns;
        struct fv_beat beat = {(int64_t)flip_ns, (int64_t)period_ns, 3000000};
        int64_t before = p.flip;
        if (i % 7 == 0) fv_pace_follow(&p, &beat);
        int64_t start_ns = fv_pace_aim(&p, now_ns, 6000000, 1);
        assert_true(start_ns >= now_ns && fv_pace_shown_ns(&p) > shown_ns);
        shown_ns = fv_pace_shown_ns(&p);
        if (i > 0) assert_int_equal(p.flip, before + 1);
        double off = ((double)fv_pace_deadline_ns(&p) + 3e6 - flip_ns) / period_ns;
        if (fabs(off - floor(off + 0.5)) > 1e-3) fail_msg("frame %d: %g periods", i, off);
        assert_true(fv_pace_shown_ns(&p) - fv_pace_deadline_ns(&p) + p.epoch_ns == 3000000 + p.period_ns / 2);
        now_ns = start_ns + 5500000;
        assert_int_equal(fv_pace_done(&p, now_ns), 0);
    }
}

/* Refreshes from before the session, far ahead, at half a period's distance: numbered to the nearest flip. */
static void numbered(void **state)
{
    (void)state;
    static const struct {
        int64_t flip_ns, anchor;
    } cases[] = {{1000, 0}, {951, 0}, {950, -1}, {1049, 0}, {1050, 0}, {1051, 1}, {-5000, -60}, {91000, 900}};
    for (int i = 0; i < (int)(sizeof cases / sizeof cases[0]); i++) {
        struct fv_pace p = {.epoch_ns = 1000, .period_ns = 100, .flip = 5};
        fv_pace_follow(&p, &(struct fv_beat){cases[i].flip_ns, 101, 10});
        if (p.anchor != cases[i].anchor) fail_msg("case %d: %lld", i, (long long)p.anchor);
        assert_int_equal(fv_pace_deadline_ns(&p), cases[i].flip_ns + (5 - p.anchor) * 101 - 10);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(aims),
        cmocka_unit_test(lateness),
        cmocka_unit_test(any_times),
        cmocka_unit_test(follows),
        cmocka_unit_test(numbered),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
