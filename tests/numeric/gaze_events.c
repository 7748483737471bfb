/* gaze_events: made-up gaze of which every event is known, at several rates; and streams that are no gaze:
 * NaN, times that stand still, run backwards, or jump. */
#include "sensors/eye/gaze_events.h"
#include "sensors/motion.h"
#include "tests/support/program.h"
#include "tests/support/random.h"

#include <math.h>

#define COUNT(table) (sizeof table / sizeof table[0])

/* Two seconds: fixation; a saccade of 10 degrees in 43 ms at 0.5 s; fixation; pursuit at 15 degrees a second
 * from 1 to 1.6 s; a blink until 1.8 s; fixation. */
static enum fv_gaze_event made_up(double t, double out[2], bool *valid)
{
    double pursued = fmin(fmax(t - 1, 0), 0.6) * 15, s = (t - 0.5) / 0.043;
    out[0] = 10 * fv_motion_minimum_jerk(s) + pursued;
    out[1] = 3 * fv_motion_minimum_jerk(s) - 0.3 * pursued;
    *valid = !(t >= 1.6 && t < 1.8);
    if (!*valid) return FV_EVENT_BLINK;
    if (s >= 0 && s <= 1) return FV_EVENT_SACCADE;
    return t >= 1 && t < 1.6 ? FV_EVENT_PURSUIT : FV_EVENT_FIXATION;
}

static void known_events(void **state)
{
    (void)state;
    static const struct {
        double hz, noise_deg, least;
    } table[] = {{90, 0.02, 0.9},   {120, 0.03, 0.92},  {250, 0.03, 0.93},
                 {500, 0.02, 0.93}, {1000, 0.01, 0.93}, {2000, 0.005, 0.9}};
    for (unsigned i = 0; i < COUNT(table); i++) {
        struct fv_gaze_events events = {0};
        uint64_t seed = i;
        int right = 0, told = 0, saccades = 0;
        int64_t told_ns = 0, last_ns = -1;
        bool in_saccade = false;
        for (int n = 0; n < 2 * table[i].hz; n++) {
            double t = n / table[i].hz, at[2], late[2];
            bool valid, ignored;
            made_up(t, at, &valid);
            for (int j = 0; j < 2; j++) at[j] += table[i].noise_deg * random_between(&seed, -1.7, 1.7);
            int64_t t_ns = llround(t * 1e9);
            enum fv_gaze_event e = fv_gaze_events_add(&events, t_ns, at[0], at[1], valid, &told_ns);
            if (e == FV_EVENT_NONE) continue;
            assert_true(told_ns > last_ns && told_ns < t_ns);
            assert_true(t_ns - told_ns <= FV_EVENT_SLOPE_NS + FV_EVENT_AHEAD_NS + 3e9 / table[i].hz);
            last_ns = told_ns;
            right += e == made_up((double)told_ns * 1e-9, late, &ignored);
            told++;
            saccades += e == FV_EVENT_SACCADE && !in_saccade;
            in_saccade = e == FV_EVENT_SACCADE;
        }
        if (told < 2 * table[i].hz * 0.95 || right < table[i].least * told || saccades != 1)
            fail_msg("%g Hz: %d of %d right, %d saccades", table[i].hz, right, told, saccades);
    }
}

static void no_gaze_at_all(void **state)
{
    (void)state;
    struct fv_gaze_events events = {0};
    uint64_t seed = 1;
    int64_t t_ns = -1000000000, told_ns;
    for (int i = 0; i < 200000; i++) {
        static const double odd[] = {NAN, INFINITY, -INFINITY, 1e300, -1e300, 0, 9999};
        static const int64_t steps[] = {0,       -5000000, 1,        2000000,    2000000,
                                        2000000, 2000000,  90000000, 1000000000, INT64_C(1) << 40};
        double x =
            random_bits(&seed) % 3 ? random_between(&seed, -20, 20) : odd[random_bits(&seed) % COUNT(odd)];
        enum fv_gaze_event e = fv_gaze_events_add(&events, t_ns += steps[random_bits(&seed) % COUNT(steps)],
                                                  x, x, random_bits(&seed) % 9 != 0, &told_ns);
        assert_true(e >= FV_EVENT_NONE && e <= FV_EVENT_BLINK);
        assert_true(isfinite(events.noise) && isfinite(events.way[0] + events.way[1] + events.way[2]));
        assert_true(events.told <= events.sloped && events.sloped <= events.added);
    }
}

/* The extremes of time: differences do not overflow. */
static void far_times(void **state)
{
    (void)state;
    struct fv_gaze_events events = {0};
    int64_t told_ns;
    assert_int_equal(fv_gaze_events_add(&events, INT64_MIN, 0, 0, true, &told_ns), FV_EVENT_NONE);
    assert_int_equal(fv_gaze_events_add(&events, INT64_MAX, 0, 0, true, &told_ns), FV_EVENT_NONE);
    assert_int_equal(fv_gaze_events_add(&events, INT64_MIN, 0, 0, true, &told_ns), FV_EVENT_NONE);
    assert_int_equal(events.added, 1);
}

/* A steady eye, however noisy, makes no saccades after the first moments. */
static void noise_alone(void **state)
{
    (void)state;
    for (int level = 0; level < 4; level++) {
        struct fv_gaze_events events = {0};
        uint64_t seed = 7;
        int saccades = 0;
        int64_t told_ns;
        for (int i = 0; i < 5000; i++) {
            double x = 0.1 * level * random_between(&seed, -1, 1),
                   y = 0.1 * level * random_between(&seed, -1, 1);
            saccades +=
                fv_gaze_events_add(&events, i * INT64_C(2000000), x, y, true, &told_ns) == FV_EVENT_SACCADE &&
                i > 1000;
        }
        if (saccades > 20) fail_msg("level %d: %d samples of saccades", level, saccades);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(known_events), cmocka_unit_test(no_gaze_at_all),
                                       cmocka_unit_test(far_times), cmocka_unit_test(noise_alone)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
