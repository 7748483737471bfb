/* binocular: looks of two eyes made by hand: both, one, none, one that is wrong, one half closed, cameras
 * that take turns, odd times and numbers. */
#include "sensors/eye/binocular.h"

#include "sensors/tape.h"
#include "tests/support/program.h"
#include "tests/support/random.h"

#include <math.h>

static const int64_t frame_ns = 8000000;
static struct fv_binocular b;
static struct fv_gaze_sample sample;

static struct fv_eye_look look(int64_t t_ns, double x, double y)
{
    return (struct fv_eye_look){
        .t_ns = t_ns, .seen = true, .at_deg = {x, y}, .error_deg = 0.2, .confidence = 1};
}

static struct fv_eye_look shut(int64_t t_ns)
{
    return (struct fv_eye_look){.t_ns = t_ns};
}

static void near_to(int eye, double x, double y, double off_deg)
{
    double at[2];
    fv_gaze_degrees(sample.direction[eye], at);
    if (!(hypot(at[0] - x, at[1] - y) <= off_deg))
        fail_msg("eye %d: %g %g for %g %g", eye, at[0], at[1], x, y);
    assert_true(sample.valid && fv_gaze_direction_good(sample.direction[eye]));
}

/* Both eyes rest, 4 degrees apart, for `frames` frames up to t_ns. */
static int64_t both_rest(int frames)
{
    fv_binocular_begin(&b, 0.03);
    int64_t t_ns = 0;
    for (int i = 0; i < frames; i++, t_ns += frame_ns) {
        struct fv_eye_look l = look(t_ns, 12, 5), r = look(t_ns, 8, 5);
        assert_true(fv_binocular_add(&b, &l, &r, &sample));
        assert_int_equal(sample.t_ns, t_ns);
        near_to(0, 12, 5, 1e-9), near_to(1, 8, 5, 1e-9);
    }
    return t_ns;
}

static void one_eye_lost(void **state)
{
    (void)state;
    int64_t t_ns = both_rest(10);
    for (int i = 0; i < 20; i++, t_ns += frame_ns) { /* the other is placed by it, and told less certain */
        struct fv_eye_look l = shut(t_ns), r = look(t_ns, -3, 0);
        double before = sample.uncertainty_deg;
        assert_true(fv_binocular_add(&b, &l, &r, &sample));
        near_to(0, 1, 0, 1e-9), near_to(1, -3, 0, 1e-9);
        if (i == 0) assert_true(sample.uncertainty_deg > before + 0.3);
    }
    struct fv_eye_look l = shut(t_ns), r = shut(t_ns);
    assert_true(fv_binocular_add(&b, &l, &r, &sample));
    assert_true(!sample.valid && sample.t_ns == t_ns);
    assert_false(fv_binocular_add(&b, NULL, NULL, &sample));
    /* From the start: the other is taken to look the same way. */
    fv_binocular_begin(&b, 0.03);
    l = look(1000, 7, 1);
    assert_true(fv_binocular_add(&b, &l, NULL, &sample));
    near_to(0, 7, 1, 1e-9), near_to(1, 7, 1, 1e-9);
    assert_true(sample.uncertainty_deg >= 0.2);
}

/* An eye that jumps alone is not believed, unless it stays there. */
static void disputes(void **state)
{
    (void)state;
    int64_t t_ns = both_rest(10);
    int frames = 0;
    for (; frames < 40; frames++, t_ns += frame_ns) {
        struct fv_eye_look l = look(t_ns, 12, 5), r = look(t_ns, 30, -10);
        r.confidence = 0.6;
        assert_true(fv_binocular_add(&b, &l, &r, &sample));
        near_to(0, 12, 5, 9);
        double at[2];
        fv_gaze_degrees(sample.direction[1], at);
        if (at[0] > 25) break;
        near_to(0, 12, 5, 1e-9), near_to(1, 8, 5, 1e-9);
    }
    assert_true(frames > 10 && frames < 25);
    /* One whose lid cuts the pupil: told by its error. */
    t_ns = both_rest(10);
    for (int i = 0; i < 8; i++, t_ns += frame_ns) {
        struct fv_eye_look l = look(t_ns, 12, 2), r = look(t_ns, 8, 5);
        l.error_deg = 2.5;
        assert_true(fv_binocular_add(&b, &l, &r, &sample));
        near_to(0, 12, 5, 1e-9), near_to(1, 8, 5, 1e-9);
        assert_true(sample.uncertainty_deg < 1.5);
    }
}

/* Each frame gives a sample of its own time; the eye that is not in it is where it was in relation. */
static void in_turns(void **state)
{
    (void)state;
    fv_binocular_begin(&b, 0.03);
    for (int i = 0; i < 200; i++) {
        int64_t t_ns = i * frame_ns * 3 / 4;
        double x = i < 100 ? 0 : 15;
        struct fv_eye_look one = look(t_ns, x + (i % 2 ? -2 : 2), 3);
        assert_true(fv_binocular_add(&b, i % 2 ? NULL : &one, i % 2 ? &one : NULL, &sample));
        assert_int_equal(sample.t_ns, t_ns);
        if (i >= 4) near_to(0, x + 2, 3, 0.01), near_to(1, x - 2, 3, 0.01);
    }
    /* One camera sees nothing: no sample, as the other one did a moment ago; then only when it sees nothing
     * either. */
    int64_t t_ns = 200 * frame_ns * 3 / 4;
    struct fv_eye_look l = shut(t_ns), r = shut(t_ns + frame_ns);
    assert_false(fv_binocular_add(&b, &l, NULL, &sample));
    assert_true(fv_binocular_add(&b, NULL, &r, &sample));
    assert_false(sample.valid);
}

/* Times that stand still, go back or jump; any numbers: samples' times grow, directions are good, nothing is
 * NaN. */
static void anything(void **state)
{
    (void)state;
    uint64_t seed = 3;
    int64_t t_ns = 0, last_ns = INT64_MIN;
    static const int64_t steps[] = {0, 1, -1, 8000000, 16000000, 4000000, 2000000000, -3000000};
    static const double odd[] = {0, 1e-300, 79, -60, 500, -1e5, 12, 3};
    fv_binocular_begin(&b, 0.03);
    for (int i = 0; i < 100000; i++) {
        t_ns += steps[random_bits(&seed) >> 61];
        struct fv_eye_look l = look(t_ns, odd[random_bits(&seed) >> 61], odd[random_bits(&seed) >> 61]),
                           r = look(t_ns + steps[random_bits(&seed) >> 61], odd[random_bits(&seed) >> 61], 0);
        unsigned pick = (unsigned)(random_bits(&seed) >> 60);
        if (pick & 1) l = shut(t_ns);
        r.error_deg = pick & 4 ? 0 : 1e4;
        if (!fv_binocular_add(&b, pick & 2 ? &l : NULL, pick & 8 ? &r : NULL, &sample)) continue;
        assert_true(sample.t_ns > last_ns);
        last_ns = sample.t_ns;
        if (!sample.valid) continue;
        assert_true(isfinite(sample.uncertainty_deg) && sample.uncertainty_deg >= 0);
        for (int eye = 0; eye < 2; eye++) assert_true(fv_gaze_direction_good(sample.direction[eye]));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(one_eye_lost), cmocka_unit_test(disputes),
                                       cmocka_unit_test(in_turns), cmocka_unit_test(anything)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
