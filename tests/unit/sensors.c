/* Simulated heads and eyes against what is known of real ones, and what latching does with a lost
 * gaze and with odd times. */
#include "sensors/motion.h"
#include "sensors/tape.h"
#include "tests/support/opened_sensors.h"

#include <math.h>

static const int64_t ms = 1000000;
static const double degree = M_PI / 180;
static const uint64_t seeds[] = {0, 1, 2, 77, UINT32_MAX};
enum { SEEDS = sizeof seeds / sizeof seeds[0] };
static const int64_t odd_times[] = {INT64_MIN,     INT64_MIN + 1, -1,       0, 1, 86400000000000,
                                    INT64_MAX / 2, INT64_MAX - 1, INT64_MAX};

static double angle_deg(const double a[3], const double b[3])
{
    double cross[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    double sine = sqrt(cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2]);
    return atan2(sine, a[0] * b[0] + a[1] * b[1] + a[2] * b[2]) / degree;
}

static void head_moves_like_a_head(void **state)
{
    (void)state;
    static const double upright[4] = {1, 0, 0, 0};
    for (int k = 0; k < SEEDS; k++) {
        struct fv_pose a, b;
        double sum = 0, fastest = 0, fastest_m_s = 0, farthest = 0, widest = 0;
        int steps = 60000;
        fv_sim_head(seeds[k], 0, &a);
        assert_true(fv_quat_angle(upright, a.rotation) / degree < 4);
        for (int i = 1; i <= steps; i++, a = b) {
            fv_sim_head(seeds[k], i * 2 * ms, &b);
            assert_true(fv_head_pose_good(&b));
            double speed = fv_quat_angle(a.rotation, b.rotation) / degree / 0.002, way = 0, out = 0;
            for (int c = 0; c < 3; c++) {
                way += pow(b.position_m[c] - a.position_m[c], 2);
                out += b.position_m[c] * b.position_m[c];
            }
            sum += speed;
            fastest = fmax(fastest, speed);
            fastest_m_s = fmax(fastest_m_s, sqrt(way) / 0.002);
            farthest = fmax(farthest, sqrt(out));
            widest = fmax(widest, fv_quat_angle(upright, b.rotation) / degree);
        }
        print_message("head, seed %llu: mean %.1f, fastest %.0f deg/s, to %.0f deg, %.2f m/s, to %.2f m\n",
                      (unsigned long long)seeds[k], sum / steps, fastest, widest, fastest_m_s, farthest);
        assert_true(sum / steps > 15 && sum / steps < 32);
        assert_true(fastest > 60 && fastest < 140);
        assert_true(widest > 30 && widest < 80);
        assert_true(fastest_m_s < 0.4 && farthest > 0.02 && farthest < 0.18);
    }
}

static void simulations_are_pure(void **state)
{
    (void)state;
    enum { TIMES = 500 };
    static struct fv_gaze_sample gaze[TIMES], again;
    static struct fv_pose head[TIMES], other;
    for (int i = 0; i < TIMES; i++) {
        fv_sim_gaze(5, i * 37 * ms, &gaze[i]);
        fv_sim_head(5, i * 37 * ms, &head[i]);
    }
    int differ = 0;
    for (int i = TIMES - 1; i >= 0; i -= 7) {
        fv_sim_gaze(5, i * 37 * ms, &again);
        fv_sim_head(5, i * 37 * ms, &other);
        assert_memory_equal(again.direction, gaze[i].direction, sizeof again.direction);
        assert_int_equal(again.valid, gaze[i].valid);
        assert_memory_equal(&other, &head[i], sizeof other);
        fv_sim_gaze(6, i * 37 * ms, &again);
        differ += memcmp(again.direction, gaze[i].direction, sizeof again.direction) != 0;
    }
    assert_true(differ > 60);
    for (unsigned i = 0; i < sizeof odd_times / sizeof odd_times[0]; i++) {
        fv_sim_gaze(1, odd_times[i], &again);
        fv_sim_head(1, odd_times[i], &other);
        assert_true(fv_head_pose_good(&other));
        assert_true(fv_gaze_direction_good(again.direction[0]) && fv_gaze_direction_good(again.direction[1]));
    }
}

/* Where both eyes look, as one direction: that of the sum. */
static void cyclopean(uint64_t seed, int64_t t_ns, double out[3])
{
    struct fv_gaze_sample g;
    fv_sim_gaze(seed, t_ns, &g);
    double length = 0;
    for (int i = 0; i < 3; i++) out[i] = g.direction[0][i] + g.direction[1][i], length += out[i] * out[i];
    for (int i = 0; i < 3; i++) out[i] /= sqrt(length);
}

/* Saccades by velocity, as an eye movement laboratory finds them. */
static void saccades_keep_the_main_sequence(void **state)
{
    (void)state;
    /* Peak velocities that Bahill, Clark and Stark (1975, figure 1) and later authors leave room for. */
    static const struct {
        double least_deg, most_deg, least_deg_s, most_deg_s;
    } bins[] = {{2, 4, 90, 300}, {4, 6, 180, 400}, {9, 11, 330, 560}, {14, 18, 400, 650}, {18, 25, 420, 720}};
    int count = 0, below_15 = 0, in_bin[5] = {0}, far = 0, samples = 0, pursuits = 0;
    double shortest = 1e9, longest = 0;
    for (int k = 0; k < SEEDS; k++) {
        double before[3], now[3], from[3] = {0, 0, -1}, peak = 0;
        int64_t last_end = -1, start = -1;
        cyclopean(seeds[k], 0, before);
        for (int64_t t = 1; t < 100000; t++, memcpy(before, now, sizeof now)) {
            cyclopean(seeds[k], t * ms, now);
            double speed = angle_deg(before, now) / 0.001, from_ahead = acos(-now[2]) / degree;
            assert_true(speed < 850 && from_ahead < 45);
            far += from_ahead > 20, samples++;
            pursuits += speed > 6 && speed < 30;
            if (start < 0 && speed > 70) start = t, peak = 0, memcpy(from, before, sizeof from);
            if (start >= 0) peak = fmax(peak, speed);
            if (start < 0 || speed > 40) continue;
            double amplitude = angle_deg(from, now), seconds = (double)(t - start) * 1e-3;
            double expected_s = 0.0022 * amplitude + 0.021;
            if (amplitude > 2) assert_true(seconds < expected_s + 0.004 && seconds > 0.4 * expected_s);
            for (int b = 0; b < 5; b++) {
                if (amplitude < bins[b].least_deg || amplitude > bins[b].most_deg) continue;
                in_bin[b]++;
                if (peak < bins[b].least_deg_s || peak > bins[b].most_deg_s)
                    fail_msg("%.1f degrees at %.0f deg/s", amplitude, peak);
            }
            if (last_end >= 0 && amplitude > 2) {
                shortest = fmin(shortest, (double)(start - last_end));
                longest = fmax(longest, (double)(start - last_end));
            }
            count++, below_15 += amplitude < 15, last_end = t, start = -1;
        }
    }
    print_message("%d saccades, %d below 15 degrees; %.1f%% beyond 20 degrees, %.1f%% pursuit-like\n", count,
                  below_15, 100.0 * far / samples, 100.0 * pursuits / samples);
    assert_true(count > SEEDS * 130 && count < SEEDS * 260);
    assert_true(below_15 > 0.8 * count && far < 0.1 * samples);
    assert_true(pursuits > 0.04 * samples && pursuits < 0.3 * samples);
    assert_true(shortest > 130);
    for (int b = 0; b < 5; b++) assert_true(in_bin[b] > 5);
}

static void eyes_meet_at_a_point(void **state)
{
    (void)state;
    double nearest = 1e9, farthest = 0;
    for (int k = 0; k < SEEDS; k++) {
        for (int64_t t = 0; t < 60000; t += 11) {
            struct fv_gaze_sample g;
            fv_sim_gaze(seeds[k], t * ms, &g);
            const double *l = g.direction[0], *r = g.direction[1];
            /* In x and z: -0.0315 + a lx = 0.0315 + b rx, a lz = b rz; then y agrees too. */
            double a = 0.063 / (l[0] - r[0] * l[2] / r[2]), b = a * l[2] / r[2];
            assert_true(fabs(a * l[1] - b * r[1]) < 1e-9);
            nearest = fmin(nearest, a), farthest = fmax(farthest, a);
        }
    }
    print_message("eyes meet at %.2f to %.2f m\n", nearest, farthest);
    assert_true(nearest > 0.48 && nearest < 0.8 && farthest > 2 && farthest < 5.1);
}

static void blinks_are_like_blinks(void **state)
{
    (void)state;
    for (int k = 0; k < SEEDS; k++) {
        int64_t start = -1, last_start = -1, blinks = 0;
        for (int64_t t = 0; t < 200000; t++) {
            struct fv_gaze_sample g;
            fv_sim_gaze(seeds[k], t * ms, &g);
            if (!g.valid && start < 0) {
                start = t;
                if (last_start >= 0) assert_in_range(start - last_start, 1995, 6005);
                last_start = start, blinks++;
            } else if (g.valid && start >= 0) {
                assert_in_range(t - start, 99, 301);
                start = -1;
            }
        }
        assert_in_range(blinks, 45, 55);
    }
}

static void minimum_jerk_and_noise_are_bounded(void **state)
{
    (void)state;
    assert_true(fv_motion_minimum_jerk(NAN) == 0 && fv_motion_minimum_jerk(-INFINITY) == 0);
    assert_true(fv_motion_minimum_jerk(0.5) == 0.5 && fv_motion_minimum_jerk(INFINITY) == 1);
    for (int i = 0; i < 1000; i++)
        assert_true(fv_motion_minimum_jerk(i * 1e-3) <= fv_motion_minimum_jerk((i + 1) * 1e-3));
    double power = 0;
    for (int i = 0; i < 50000; i++) {
        double x = fv_motion_noise(3, 9, i * 20 * ms, 0.3, 5);
        assert_true(fabs(x) < 4);
        power += x * x;
    }
    assert_true(fabs(power / 50000 - 1) < 0.1);
}

static struct fv_config *settings(const char *eye, const char *imu)
{
    static struct fv_config config;
    memset(&config, 0, sizeof config);
    snprintf(config.eye_source, sizeof config.eye_source, "%s", eye);
    snprintf(config.imu_source, sizeof config.imu_source, "%s", imu);
    strcpy(config.imu_predict, "decay");
    config.eye_seed = 1, config.imu_seed = 1;
    config.eye_hold_ms = 1000, config.eye_noise_deg = 0.3;
    return &config;
}

/* What is shown as soon as it is known. */
static void latch(struct fv_sensors *s, int64_t t_ns, struct fv_pose *head, struct fv_gaze *gaze)
{
    fv_sensors_latch(s, t_ns, t_ns, head, gaze);
}

/* Two gazes at 0 and 10 ms, the eye lost at 20 ms, back at 5 s. */
static const char *gap_tape(void)
{
    static char path[FV_PATH_MAX];
    static struct fv_writer w;
    struct fv_error error;
    double l[3] = {sin(0.2), 0, -cos(0.2)}, r[3] = {0, sin(0.3), -cos(0.3)};
    struct fv_gaze_sample s = {.direction = {{0, 0, -1}, {0, 0, -1}}, .valid = true};
    snprintf(path, sizeof path, "%s/unit_sensors_gap_%ld.csv", FV_BINARY_DIR, (long)getpid());
    assert_int_equal(fv_writer_open(&w, path, &error), 0);
    fv_tape_begin_gaze(&w);
    fv_tape_write_gaze(&w, &s);
    s.t_ns = 10 * ms;
    memcpy(s.direction[0], l, sizeof l), memcpy(s.direction[1], r, sizeof r);
    fv_tape_write_gaze(&w, &s);
    s.t_ns = 20 * ms, s.valid = false;
    fv_tape_write_gaze(&w, &s);
    s.t_ns = 5000 * ms, s.valid = true;
    fv_tape_write_gaze(&w, &s);
    assert_int_equal(fv_writer_close(&w, &error), 0);
    return path;
}

static void lost_gaze_is_held_then_centred(void **state)
{
    (void)state;
    static const double holds_ms[] = {0, 250, 1000, 2000};
    const char *path = gap_tape();
    for (int k = 0; k < 4; k++) {
        struct fv_config *config = settings("tape", "none");
        snprintf(config->eye_tape, sizeof config->eye_tape, "%s", path);
        config->eye_hold_ms = holds_ms[k];
        struct fv_sensors *s = opened(config);
        struct fv_pose head;
        struct fv_gaze good, g, last;
        latch(s, 10 * ms, &head, &good);
        assert_false(good.held);
        assert_true(good.t_ns == 10 * ms && good.uncertainty_deg == 0.3);
        last = good;
        for (int64_t t = 20; t < 4990; t += 10, last = g) {
            latch(s, t * ms, &head, &g);
            double lost_ms = (double)(t - 10), share = holds_ms[k] > 0 ? fmin(lost_ms / holds_ms[k], 1) : 1;
            assert_true(g.held && g.t_ns == 10 * ms);
            assert_true(fabs(g.uncertainty_deg - (0.3 + 19.7 * share)) < 1e-9);
            for (int eye = 0; eye < 2; eye++) {
                const double *d = g.direction[eye], centre[3] = {0, 0, -1};
                double part = fv_motion_minimum_jerk((lost_ms - holds_ms[k]) / 300);
                assert_true(fv_gaze_direction_good(d));
                if (part == 0) assert_memory_equal(d, good.direction[eye], sizeof centre);
                if (part == 1) assert_memory_equal(d, centre, sizeof centre);
                double whole = angle_deg(good.direction[eye], centre);
                assert_true(fabs(angle_deg(good.direction[eye], d) - part * whole) < 1e-6);
                assert_true(fabs(angle_deg(d, centre) - (1 - part) * whole) < 1e-6);
                assert_true(angle_deg(last.direction[eye], d) < 1.2);
            }
        }
        latch(s, 5000 * ms, &head, &g);
        assert_true(!g.held && g.uncertainty_deg == 0.3);
        struct fv_sensors_counts counts = fv_sensors_counts(s);
        assert_int_equal(counts.gaze_samples, 499);
        assert_int_equal(counts.gaze_lost, 497);
        assert_true(counts.imu_samples == 0 && counts.imu_rejected == 0);
    }
    unlink(path);
}

static void latching_is_deterministic_and_never_bad(void **state)
{
    (void)state;
    struct fv_sensors *a = opened(settings("sim", "sim")), *b = opened(settings("sim", "sim"));
    struct fv_pose head[2];
    struct fv_gaze gaze[2];
    int held = 0;
    for (int64_t t = 0; t < 20000; t += 13) {
        memset(gaze, 0, sizeof gaze);
        latch(a, t * ms, &head[0], &gaze[0]);
        latch(b, t * ms, &head[1], &gaze[1]);
        assert_memory_equal(&head[0], &head[1], sizeof head[0]);
        assert_memory_equal(gaze[0].direction, gaze[1].direction, sizeof gaze[0].direction);
        assert_true(gaze[0].uncertainty_deg == gaze[1].uncertainty_deg && gaze[0].held == gaze[1].held);
        held += gaze[0].held;
        if (gaze[0].held) assert_true(gaze[0].uncertainty_deg < 0.3 + 19.7 * 0.33);
    }
    assert_true(held > 20);
    assert_int_equal(fv_sensors_counts(a).gaze_lost, held);
    assert_int_equal(fv_sensors_counts(a).imu_samples, fv_sensors_counts(a).gaze_samples);
    assert_int_equal(fv_sensors_counts(a).imu_rejected, 0);
    for (unsigned i = 0; i < sizeof odd_times / sizeof odd_times[0]; i++) {
        latch(a, odd_times[i], &head[0], &gaze[0]);
        assert_true(fv_head_pose_good(&head[0]));
        assert_true(fv_gaze_direction_good(gaze[0].direction[0]) &&
                    fv_gaze_direction_good(gaze[0].direction[1]));
        assert_true(gaze[0].uncertainty_deg >= 0.3 && gaze[0].uncertainty_deg <= 20);
    }
}

static void one_tape_serves_eye_and_head(void **state)
{
    (void)state;
    static struct fv_writer w;
    char path[FV_TEXT_MAX];
    struct fv_error error;
    snprintf(path, sizeof path, "%s/unit_sensors_both_%ld.csv", FV_BINARY_DIR, (long)getpid());
    assert_int_equal(fv_writer_open(&w, path, &error), 0);
    fv_writer_print(&w, "raw_timestamp,status,left_status,right_status,gaze_forward_x,gaze_forward_y,"
                        "gaze_forward_z,left_forward_x,left_forward_y,left_forward_z,right_forward_x,"
                        "right_forward_y,right_forward_z,HMD_position_x,HMD_position_y,HMD_position_z,"
                        "HMD_rotation_x,HMD_rotation_y,HMD_rotation_z\n");
    for (int i = 0; i < 100; i++)
        fv_writer_print(&w, "%lld,2,2,2,0,0,1,0.6,0,0.8,0,0.6,0.8,%g,0,0,%s,0,0\n",
                        1000534031063207000LL + i * 10 * ms, 3 + i * 0.01, i == 50 ? "1.5" : "0");
    assert_int_equal(fv_writer_close(&w, &error), 0);
    struct fv_config *config = settings("tape", "tape");
    snprintf(config->eye_tape, sizeof config->eye_tape, "%s", path);
    snprintf(config->imu_tape, sizeof config->imu_tape, "%s", path);
    struct fv_sensors *s = opened(config);
    for (int i = 0; i < 300; i++) {
        struct fv_pose head;
        struct fv_gaze gaze;
        latch(s, i * 10 * ms, &head, &gaze);
        assert_true(fabs(head.position_m[0] - i % 100 * 0.01) < 1e-9);
        assert_true(!gaze.held && gaze.t_ns == i * 10 * ms && fabs(gaze.direction[0][0] - 0.6) < 1e-15);
    }
    struct fv_sensors_counts counts = fv_sensors_counts(s);
    assert_true(counts.imu_samples == 300 && counts.imu_rejected == 1 && counts.gaze_samples == 300);
    unlink(path);
}

/* Lost at every odd time, after a gaze at another. */
static void odd_times_without_an_eye(void **state)
{
    (void)state;
    const char *path = gap_tape();
    struct fv_config *config = settings("tape", "none");
    snprintf(config->eye_tape, sizeof config->eye_tape, "%s", path);
    for (unsigned i = 0; i < sizeof odd_times / sizeof odd_times[0]; i++) {
        for (int64_t good = 0; good < 2; good++) {
            struct fv_sensors *s = opened(config);
            struct fv_pose head;
            struct fv_gaze gaze;
            if (good) latch(s, 10 * ms, &head, &gaze);
            latch(s, odd_times[i], &head, &gaze);
            latch(s, odd_times[sizeof odd_times / sizeof odd_times[0] - 1 - i], &head, &gaze);
            for (int eye = 0; eye < 2; eye++) assert_true(fv_gaze_direction_good(gaze.direction[eye]));
            assert_true(gaze.uncertainty_deg >= 0.3 && gaze.uncertainty_deg <= 20);
        }
    }
    unlink(path);
}

static void nothing_looks_ahead(void **state)
{
    (void)state;
    struct fv_sensors *s = opened(settings("none", "none"));
    struct fv_pose head;
    struct fv_gaze gaze;
    latch(s, 123 * ms, &head, &gaze);
    assert_true(head.rotation[0] == 1 && head.position_m[1] == 0);
    assert_true(gaze.direction[0][2] == -1 && gaze.direction[1][2] == -1 && !gaze.held);
    assert_int_equal(fv_sensors_counts(s).gaze_samples, 0);
}

static void unusable_settings_are_named(void **state)
{
    (void)state;
    static const struct {
        const char *eye, *imu, *eye_tape, *imu_tape, *expected;
    } cases[] = {
        {"tape", "sim", "", "x.csv", "eye.tape: no tape is named"},
        {"sim", "tape", "x.csv", "", "imu.tape: no tape is named"},
        {"tape", "sim", "/nowhere/x.csv", "", "/nowhere/x.csv"},
        {"sim", "tape", "", "/", "not a regular file"},
        {"camera", "sim", "", "", "eye.source"},
        {"sim", "stick", "", "", "imu.source"},
    };
    for (unsigned i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct fv_config *config = settings(cases[i].eye, cases[i].imu);
        struct fv_sensors *s;
        struct fv_error error = {""};
        snprintf(config->eye_tape, sizeof config->eye_tape, "%s", cases[i].eye_tape);
        snprintf(config->imu_tape, sizeof config->imu_tape, "%s", cases[i].imu_tape);
        assert_int_equal(fv_sensors_open(&s, config, &error), -1);
        if (!strstr(error.text, cases[i].expected)) fail_msg("%s", error.text);
    }
    /* A gaze tape holds no head. */
    const char *path = gap_tape();
    struct fv_config *config = settings("none", "tape");
    struct fv_sensors *s;
    struct fv_error error = {""};
    snprintf(config->imu_tape, sizeof config->imu_tape, "%s", path);
    assert_int_equal(fv_sensors_open(&s, config, &error), -1);
    assert_non_null(strstr(error.text, "no good head pose"));
    unlink(path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(head_moves_like_a_head),
        cmocka_unit_test(simulations_are_pure),
        cmocka_unit_test(saccades_keep_the_main_sequence),
        cmocka_unit_test(eyes_meet_at_a_point),
        cmocka_unit_test(blinks_are_like_blinks),
        cmocka_unit_test(minimum_jerk_and_noise_are_bounded),
        cmocka_unit_test(lost_gaze_is_held_then_centred),
        cmocka_unit_test(latching_is_deterministic_and_never_bad),
        cmocka_unit_test(one_tape_serves_eye_and_head),
        cmocka_unit_test(odd_times_without_an_eye),
        cmocka_unit_test(nothing_looks_ahead),
        cmocka_unit_test(unusable_settings_are_named),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
