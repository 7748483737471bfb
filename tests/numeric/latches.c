/* latches: what the loop gets from sensors after 1e7 frames and over gaps of days, at times that stand,
 * go back, or lie at the ends of int64; heads turning at 2000 degrees a second, gazes that jump across
 * the view. */
#include "sensors/motion.h"
#include "sensors/sensors.h"
#include "sensors/tape.h"
#include "tests/support/long_rotation.h"
#include "tests/support/opened_sensors.h"
#include "tests/support/random.h"

#include <float.h>

#define COUNT(table) (sizeof table / sizeof table[0])
static const int64_t ms = 1000000, day_ns = INT64_C(86400000000000), period_ns = 13333333;
static const double degree = M_PI / 180;

/* What is shown as soon as it is known. */
static void latch(struct fv_sensors *s, int64_t t_ns, struct fv_pose *head, struct fv_gaze *gaze)
{
    fv_sensors_latch(s, t_ns, t_ns, head, gaze);
}

/* gaze.csv: both eyes at these angles to the right; NAN: lost. */
static void write_gazes(int rows, const int64_t *t_ns, const double *right_deg)
{
    static struct fv_writer w;
    struct fv_error error;
    char path[256];
    snprintf(path, sizeof path, "%s/gaze.csv", program_folder());
    assert_int_equal(fv_writer_open(&w, path, &error), 0);
    fv_tape_begin_gaze(&w);
    for (int i = 0; i < rows; i++) {
        double a = right_deg[i] * degree;
        struct fv_gaze_sample s = {t_ns[i], {{sin(a), 0, -cos(a)}, {sin(a), 0, -cos(a)}}, !isnan(a), 0};
        if (isnan(a)) memset(s.direction, 0, sizeof s.direction);
        fv_tape_write_gaze(&w, &s);
    }
    assert_int_equal(fv_writer_close(&w, &error), 0);
}

/* head.csv: turning about the vertical by `step_deg` each row. */
static void write_heads(int rows, int64_t step_ns, double step_deg)
{
    static struct fv_writer w;
    struct fv_error error;
    char path[256];
    snprintf(path, sizeof path, "%s/head.csv", program_folder());
    assert_int_equal(fv_writer_open(&w, path, &error), 0);
    fv_tape_begin_head(&w);
    for (int i = 0; i < rows; i++) {
        struct fv_head_sample s = {i * step_ns, {{0.1 * i, 0, -1e-6 * i}, {0}}};
        fv_quat_from_yaw_pitch_roll(i * step_deg * degree, 0, 0, s.pose.rotation);
        fv_tape_write_head(&w, &s);
    }
    assert_int_equal(fv_writer_close(&w, &error), 0);
}

static void check_latched(const struct fv_pose *head, const struct fv_gaze *gaze, double noise_deg)
{
    if (!fv_head_pose_good(head)) fail_msg("a bad pose was latched");
    for (int eye = 0; eye < 2; eye++)
        if (!fv_gaze_direction_good(gaze->direction[eye])) fail_msg("a bad gaze was latched");
    if (!(gaze->uncertainty_deg >= noise_deg && gaze->uncertainty_deg <= fmax(20, noise_deg)))
        fail_msg("an uncertainty of %g was latched", gaze->uncertainty_deg);
}

/* 37 hours at 75 Hz: counts add up to the frame, and the last second is, bit for bit, the first one. */
static void ten_million_latches(void **state)
{
    (void)state;
    enum { ROWS = 9, FRAMES = 10000000, COMPARED = 75 };
    static struct fv_gaze first[COMPARED];
    static struct fv_pose first_head[COMPARED];
    int64_t t_ns[ROWS];
    /* Lasts 15 frames; rows 3 and 4 are lost. */
    const double right_deg[ROWS] = {-50, 50, 0, NAN, NAN, 1e-9, -1e-300, 89.9, 10};
    for (int i = 0; i < ROWS; i++) t_ns[i] = i * (15 * period_ns / ROWS);
    write_gazes(ROWS, t_ns, right_deg);
    write_heads(150, period_ns / 10, 2.6666);
    struct fv_sensors *s = opened(sensor_settings("tape", "tape", 3, 4));
    struct fv_pose head;
    struct fv_gaze gaze;
    int64_t held = 0;
    for (int64_t n = 0; n < FRAMES; n++) {
        latch(s, n * period_ns, &head, &gaze);
        check_latched(&head, &gaze, 0.3);
        held += gaze.held;
        if (n < COMPARED) first[n] = gaze, first_head[n] = head;
    }
    struct fv_sensors_counts c = fv_sensors_counts(s);
    assert_true(c.gaze_samples == FRAMES && c.imu_samples == FRAMES && c.imu_rejected == 0 &&
                c.gaze_lost == held);
    assert_true(held > FRAMES / 10 && held < FRAMES / 3);
    /* A whole number of both tapes' lengths later, with a gap of months before. */
    struct fv_tape tape;
    struct fv_error error;
    char path[256];
    snprintf(path, sizeof path, "%s/gaze.csv", program_folder());
    assert_int_equal(fv_tape_read(&tape, path, &error), 0);
    int64_t gaze_length = tape.last_ns + tape.last_ns / (tape.rows - 1);
    snprintf(path, sizeof path, "%s/head.csv", program_folder());
    assert_int_equal(fv_tape_read(&tape, path, &error), 0);
    int64_t head_length = tape.last_ns + tape.last_ns / (tape.rows - 1);
    for (int64_t rounds = 1; rounds <= 100; rounds *= 10)
        for (int n = 0; n < COMPARED; n++) {
            int64_t later_ns = rounds * gaze_length * head_length;
            if (n % 25 == 0) s = opened(sensor_settings("tape", "tape", 3, 4));
            latch(s, later_ns + n * period_ns, &head, &gaze);
            assert_memory_equal(&head, &first_head[n], sizeof head);
            if (gaze.held) continue; /* depends on when it was lost */
            assert_memory_equal(gaze.direction, first[n].direction, sizeof gaze.direction);
            assert_true(gaze.t_ns - later_ns == first[n].t_ns || first[n].held);
        }
}

/* Lost at 10 ms; then latched at these times, one after another, of which some stand, go back or jump. */
static void uncertainty(void **state)
{
    (void)state;
    static const double holds_ms[] = {0, 5e-324, 1e-6, 250, 1000, 60000}, noises[] = {0, 0.3, 20, 45};
    const int64_t rows_ns[] = {0, 10 * ms, 20 * ms, 9 * day_ns},
                  times[] = {20 * ms,   20 * ms,   21 * ms,   20 * ms, -1,     -day_ns,    INT64_MIN,
                             1000 * ms, 1020 * ms, 1320 * ms, 61 * ms, day_ns, 2 * day_ns, 8 * day_ns};
    const double right_deg[] = {-30, 40, NAN, 0};
    write_gazes(4, rows_ns, right_deg);
    for (unsigned h = 0; h < COUNT(holds_ms); h++)
        for (unsigned n = 0; n < COUNT(noises); n++) {
            struct fv_config *c = sensor_settings("tape", "none", 3, 4);
            c->eye_hold_ms = holds_ms[h], c->eye_noise_deg = noises[n];
            struct fv_sensors *s = opened(c);
            struct fv_pose head;
            struct fv_gaze gaze;
            latch(s, 15 * ms, &head, &gaze);
            assert_true(!gaze.held && gaze.t_ns == 10 * ms && gaze.uncertainty_deg == noises[n]);
            for (unsigned t = 0; t < COUNT(times); t++) {
                latch(s, times[t], &head, &gaze);
                check_latched(&head, &gaze, noises[n]);
                long double since_ms = ((long double)times[t] - 15 * ms) / ms;
                long double lost = since_ms >= (long double)holds_ms[h] ? 1
                                   : since_ms > 0                       ? since_ms / (long double)holds_ms[h]
                                                                        : 0;
                long double expected = noises[n] + fmaxl(20 - noises[n], 0) * lost;
                assert_true(gaze.held);
                if (!(fabsl(gaze.uncertainty_deg - expected) < 1e-12L))
                    fail_msg("hold %g ms, %g ms: %g", holds_ms[h], (double)since_ms, gaze.uncertainty_deg);
                double angle = atan2(gaze.direction[0][0], -gaze.direction[0][2]) / degree;
                if (since_ms <= (long double)holds_ms[h]) assert_true(fabs(angle - 40) < 1e-12);
                if (since_ms >= (long double)holds_ms[h] + 300)
                    assert_true(angle == 0 && gaze.direction[0][2] == -1);
            }
            latch(s, 9 * day_ns, &head, &gaze);
            assert_true(!gaze.held && gaze.uncertainty_deg == noises[n]);
        }
}

/* Turning between two rows is exact: up to 2000 degrees a second, and nearly half a turn from row to row. */
static void fast_heads(void **state)
{
    (void)state;
    static const struct {
        int64_t step_ns;
        double deg_s;
    } table[] = {{1000000, 2000},     {10000000, 2000}, {10000000, -2000}, {89000000, 2000},
                 {1000000000, 179.9}, {1000, 2000},     {1000000, 1e-6},   {1, 2000}};
    uint64_t random = 12;
    for (unsigned r = 0; r < COUNT(table); r++) {
        enum { ROWS = 50 };
        double step_deg = table[r].deg_s * 1e-9 * (double)table[r].step_ns;
        write_heads(ROWS, table[r].step_ns, step_deg);
        struct fv_sensors *s = opened(sensor_settings("none", "tape", 3, 4));
        int64_t last_ns = (ROWS - 1) * table[r].step_ns;
        for (int n = 0; n < 2000; n++) {
            int64_t t_ns =
                n < 50 ? n * table[r].step_ns : (int64_t)random_between(&random, 0, (double)last_ns);
            struct fv_pose head;
            struct fv_gaze gaze;
            latch(s, t_ns, &head, &gaze);
            check_latched(&head, &gaze, 0.3);
            long double rows = (long double)t_ns / table[r].step_ns,
                        yaw[3] = {0, step_deg * rows * LONG_PI / 180, 0};
            if (!(long_angle(head.rotation, long_exp(yaw)) < 4e-14))
                fail_msg("row %u, %lld ns: off by %g", r, (long long)t_ns,
                         long_angle(head.rotation, long_exp(yaw)));
            assert_true(fabs(head.position_m[0] - (double)rows * 0.1) < 1e-14 &&
                        fabs(head.position_m[2] + (double)rows * 1e-6) < 1e-14);
        }
        assert_int_equal(fv_sensors_counts(s).imu_rejected, 0);
    }
}

/* A gaze that jumps is taken at once; lost at the rim, it goes home in front of the face, never back. */
static void jumping_gaze(void **state)
{
    (void)state;
    enum { ROWS = 40 };
    int64_t t_ns[ROWS];
    double right_deg[ROWS];
    for (int i = 0; i < ROWS; i++) t_ns[i] = i * 10 * ms, right_deg[i] = i % 2 ? 89.9 : -89.9;
    t_ns[ROWS - 1] = day_ns, right_deg[ROWS - 2] = NAN;
    write_gazes(ROWS, t_ns, right_deg);
    struct fv_sensors *s = opened(sensor_settings("tape", "none", 3, 4));
    struct fv_pose head;
    struct fv_gaze gaze;
    double before = 89.9;
    for (int i = 0; i < ROWS - 2; i++) {
        latch(s, t_ns[i] + i % 10 * ms, &head, &gaze);
        check_latched(&head, &gaze, 0.3);
        assert_true(!gaze.held && fabs(gaze.direction[1][0] - sin(right_deg[i] * degree)) < 1e-15);
    }
    for (int64_t t = 390; t < 2000; t++) {
        latch(s, t * ms, &head, &gaze);
        check_latched(&head, &gaze, 0.3);
        double angle = atan2(gaze.direction[0][0], -gaze.direction[0][2]) / degree;
        assert_true(gaze.held && angle <= before + 1e-12 && angle >= 0 && before - angle < 0.7);
        before = angle;
    }
    assert_true(before == 0);
}

/* Looked up anywhere in int64 as at the time that whole lengths of the tape lead back to. */
static void tape_times(void **state)
{
    (void)state;
    static const struct fv_head_sample heads[] = {
        {3, {{1, 0, 0}, {1, 0, 0, 0}}}, {8, {{2, 0, 0}, {0, 1, 0, 0}}}, {13, {{3, 0, 0}, {0, 0, 1, 0}}}};
    static const struct fv_gaze_sample gazes[] = {{3, {{0, 0, -1}, {0, 0, -1}}, true, 0},
                                                  {8, {{0.6, 0, -0.8}, {0, 0, -1}}, true, 0},
                                                  {13, {{0, 0, -1}, {0, 0.6, -0.8}}, true, 0}};
    static const int64_t times[] = {INT64_MIN,
                                    INT64_MIN + 1,
                                    INT64_MIN / 2,
                                    -1,
                                    0,
                                    2,
                                    3,
                                    4,
                                    12,
                                    13,
                                    14,
                                    17,
                                    18,
                                    19,
                                    INT64_C(1) << 53,
                                    INT64_MAX / 2,
                                    INT64_MAX - 12,
                                    INT64_MAX - 1,
                                    INT64_MAX};
    for (int rows = 1; rows <= 3; rows++) {
        int64_t last = heads[rows - 1].t_ns, length = rows > 1 ? last - 3 + (last - 3) / (rows - 1) : 1;
        struct fv_tape tape = {.heads = rows,
                               .gazes = rows,
                               .rows = rows,
                               .first_ns = 3,
                               .last_ns = last,
                               .head = heads,
                               .gaze = gazes};
        for (unsigned i = 0; i < COUNT(times); i++) {
            struct fv_pose head, same;
            struct fv_gaze_sample gaze, as;
            __int128 at = times[i] < 3       ? times[i]
                          : times[i] <= last ? times[i]
                                             : 3 + ((__int128)times[i] - 3) % length;
            fv_tape_head_at(&tape, times[i], &head);
            fv_tape_gaze_at(&tape, times[i], &gaze);
            assert_true(fv_head_pose_good(&head) && gaze.valid == (times[i] >= 3));
            assert_true(gaze.t_ns <= times[i] &&
                        (gaze.valid ? times[i] - gaze.t_ns <= length : gaze.t_ns == times[i]));
            if (at < 3) continue;
            fv_tape_head_at(&tape, (int64_t)at, &same);
            fv_tape_gaze_at(&tape, (int64_t)at, &as);
            assert_memory_equal(&head, &same, sizeof head);
            assert_memory_equal(gaze.direction, as.direction, sizeof gaze.direction);
        }
    }
}

/* Rows with times that a tape cannot have are dropped; none makes the others wrong. */
static void tape_rows(void **state)
{
    (void)state;
    static const char *const times[] = {"9223372036854775807",
                                        "9223372036854775808",
                                        "-9223372036854775808",
                                        "-9223372036854775809",
                                        "99999999999999999999999",
                                        "4611686018427387904",
                                        "1000000000000001",
                                        "-1",
                                        "1e3",
                                        "nan",
                                        "",
                                        "0x10"};
    for (unsigned i = 0; i < COUNT(times); i++) {
        char text[512];
        struct fv_tape tape;
        struct fv_error error;
        struct fv_head_sample heads[3];
        int size = snprintf(
            text, sizeof text,
            "# foveola head "
            "1\nt_ns,position_x_m,position_y_m,position_z_m,rotation_w,rotation_x,rotation_y,rotation_z\n"
            "0,0,0,0,1,0,0,0\n%s,0,0,0,1,0,0,0\n5,0,0,0,0,1,0,0\n",
            times[i]);
        if (fv_tape_parse(&tape, "test", text, (size_t)size, heads, NULL, &error))
            fail_msg("%s: %s", times[i], error.text);
        assert_true(tape.rejected == 1 && tape.heads == 2 && heads[1].t_ns == 5);
    }
}

/* What is let in: here alone it is decided which poses and gazes the rest of the program sees. */
static void what_is_good(void **state)
{
    (void)state;
    static const struct {
        double position[3], rotation[4];
        bool good;
    } poses[] = {
        {{0, 0, 0}, {1, 0, 0, 0}, true},           {{1e4, -1e4, 0}, {0.5, -0.5, 0.5, -0.5}, true},
        {{0, 0, 0}, {1.0009, 0, 0, 0}, true},      {{0, 0, 0}, {1.0011, 0, 0, 0}, false},
        {{0, 0, 0}, {0.9989, 0, 0, 0}, false},     {{0, 0, 0}, {0, 0, 0, 0}, false},
        {{1.0001e4, 0, 0}, {1, 0, 0, 0}, false},   {{NAN, 0, 0}, {1, 0, 0, 0}, false},
        {{0, INFINITY, 0}, {1, 0, 0, 0}, false},   {{0, 0, -INFINITY}, {1, 0, 0, 0}, false},
        {{0, 0, 0}, {NAN, 0, 0, 0}, false},        {{0, 0, 0}, {1, 0, 0, NAN}, false},
        {{0, 0, 0}, {INFINITY, 0, 0, 0}, false},   {{0, 0, 0}, {1e200, 0, 0, 0}, false},
        {{5e-324, 0, 0}, {1, 5e-324, 0, 0}, true}, {{0, 0, 0}, {INFINITY, -INFINITY, 0, 0}, false},
    };
    for (unsigned i = 0; i < COUNT(poses); i++) {
        struct fv_pose p;
        memcpy(p.position_m, poses[i].position, sizeof p.position_m);
        memcpy(p.rotation, poses[i].rotation, sizeof p.rotation);
        if (fv_head_pose_good(&p) != poses[i].good) fail_msg("pose %u", i);
    }
    static const struct {
        double d[3];
        bool good;
    } gazes[] = {{{0, 0, -1}, true},       {{0.6, 0, -0.8}, true},       {{1, 0, -1e-300}, true},
                 {{1, 0, 0}, false},       {{0, 0, 1}, false},           {{0, 0, -1.0011}, false},
                 {{0, 0, -0.9989}, false}, {{0, 0, 0}, false},           {{NAN, 0, -1}, false},
                 {{0, 0, NAN}, false},     {{INFINITY, 0, -1}, false},   {{0, 0, -INFINITY}, false},
                 {{0, 0, -1e200}, false},  {{1e-160, 0, -1e-160}, false}};
    for (unsigned i = 0; i < COUNT(gazes); i++)
        if (fv_gaze_direction_good(gazes[i].d) != gazes[i].good) fail_msg("gaze %u", i);
}

/* Simulated heads and eyes move after a day, 1e7 frames and a century as they do at the start. */
static void simulations_do_not_age(void **state)
{
    (void)state;
    const int64_t starts[] = {0,
                              day_ns,
                              10000000 * period_ns,
                              365 * day_ns,
                              36500 * day_ns,
                              -day_ns,
                              FV_MOTION_LIMIT_NS - 5000 * ms,
                              -FV_MOTION_LIMIT_NS};
    for (unsigned k = 0; k < COUNT(starts); k++) {
        double mean = 0, fastest = 0;
        struct fv_pose a, b;
        struct fv_gaze_sample gaze;
        enum { STEPS = 4000 };
        fv_sim_head(9, starts[k], &a);
        for (int n = 1; n <= STEPS; n++, a = b) {
            int64_t t_ns = starts[k] + n * ms;
            fv_sim_head(9, t_ns, &b);
            fv_sim_gaze(9, t_ns, &gaze);
            assert_true(fv_head_pose_good(&b) && fv_gaze_direction_good(gaze.direction[0]) &&
                        fv_gaze_direction_good(gaze.direction[1]));
            double speed = long_angle(a.rotation, long_unit(long_of(b.rotation))) / degree / 1e-3;
            mean += speed / STEPS;
            fastest = fmax(fastest, speed);
        }
        print_message("head from %.1e s on: mean %.1f, fastest %.1f deg/s\n", (double)starts[k] * 1e-9, mean,
                      fastest);
        assert_true(mean > 2 && mean < 60 && fastest < 145);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(ten_million_latches), cmocka_unit_test(uncertainty),
        cmocka_unit_test(fast_heads),          cmocka_unit_test(jumping_gaze),
        cmocka_unit_test(tape_times),          cmocka_unit_test(tape_rows),
        cmocka_unit_test(what_is_good),        cmocka_unit_test(simulations_do_not_age)};
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
