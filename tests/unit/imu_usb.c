/* imu_usb: the feed of an inertial sensor on a port that is made up, on a clock that is made up: what it does when the
 * device is not there, is unplugged, fails, stalls, keeps silent, sends short, repeated or absurd reports. */
#include "sensors/imu/head.h"
#include "sensors/imu/layout.h"

#include "tests/support/made_up_imu.h"

static void run_for(int64_t ns)
{
    int64_t until_ns = host.now_ns + ns;
    for (int64_t steps = 0; host.now_ns < until_ns; steps++) {
        assert_true(steps < 100000); /* a busy loop */
        fv_imu_feed_step(&feed);
    }
}

static struct fv_imu_state got(void)
{
    struct fv_imu_state s;
    assert_true(fv_mailbox_get(&feed.box, &s, sizeof s));
    for (int i = 0; i < 4; i++) assert_true(isfinite(s.rotation[i]));
    for (int i = 0; i < 3; i++) assert_true(isfinite(s.rate[i]));
    return s;
}

static void begin(void)
{
    assert_int_equal(fv_imu_feed_search(&feed, &error), 0);
}

/* A second at 90 degrees a second to the left: every sample is there, once, and the head is where it must be. */
static void streams(void **state)
{
    (void)state;
    begin();
    run_for(1000 * ms);
    struct fv_imu_state s = got();
    assert_true(s.connected && s.counts.connects == 1 && s.counts.reports == 1000);
    assert_true(s.counts.samples == 1002 && s.counts.repeated == 1998 && s.counts.lost == 0 && s.counts.rejected == 0);
    assert_true(s.counts.foreign + s.counts.failures + s.counts.stalls + s.counts.refused + s.counts.empty == 0);
    assert_int_equal(s.good, 1002);
    assert_true(s.t_ns > host.now_ns - ms && s.t_ns <= host.now_ns);
    struct fv_pose head;
    const struct fv_neck neck = {0.075, 0.0805};
    assert_true(fv_imu_head(&s, &neck, true, s.t_ns, 0, &head));
    double turn[3];
    fv_quat_to_vector(head.rotation, turn);
    assert_true(fabs(turn[1] - M_PI / 2) < 0.02 && fabs(turn[0]) < 0.01 && fabs(turn[2]) < 0.01);
    /* Looking to the left the eyes are to the left of, and behind, where they were. */
    assert_true(fabs(head.position_m[0] + 0.0805) < 0.003 && fabs(head.position_m[2] - 0.0805) < 0.003);
    assert_true(fabs(head.position_m[1]) < 1e-3);
    fv_imu_feed_close(&feed);
    assert_true(!host.open && host.closes == 1 && !got().connected);
}

static void searches(void **state)
{
    (void)state;
    host.plugged = false;
    assert_int_equal(fv_imu_feed_search(&feed, &error), 1);
    assert_string_equal(error.text, "imu: none is plugged in");
    run_for(10000 * ms);
    assert_true(host.opens >= 10 && host.opens <= 12 && feed.phase == FV_IMU_SEARCHING);
    host.plugged = host.forbidden = true;
    assert_int_equal(fv_imu_feed_search(&feed, &error), -1);
    run_for(1500 * ms);
    assert_false(feed.told);
    run_for(1500 * ms);
    assert_true(feed.told);
    assert_true(feed.phase == FV_IMU_SEARCHING && got().counts.samples == 0);
    host.forbidden = false;
    run_for(1100 * ms);
    assert_true(feed.phase == FV_IMU_STREAMING && got().counts.samples > 0);
}

/* Unplugged and plugged in again, told in either way: the stream goes on, the head has not turned meanwhile, and the
 * device's clock may be any. */
static void unplugged(void **state)
{
    (void)state;
    for (int way = 0; way < 2; way++) {
        fresh(NULL);
        host.silent_end = way == 1;
        begin();
        run_for(500 * ms);
        struct fv_imu_state before = got(), s;
        host.plugged = false;
        run_for(5000 * ms);
        s = got();
        assert_true(!s.connected && host.closes == 1 && host.opens >= 4);
        assert_true(s.counts.failures == (way == 1) && fv_quat_angle(before.rotation, s.rotation) < 1e-12);
        host.plugged = true;
        host.ticks = 0xfff00000u * (unsigned)(way + 1);
        run_for(2000 * ms);
        s = got();
        assert_true(s.connected && s.counts.connects == 2 && s.counts.samples > before.counts.samples + 900);
        assert_true(s.counts.lost == 0 && s.t_ns > host.now_ns - 2 * ms && s.t_ns <= host.now_ns);
        int64_t again = s.counts.samples - before.counts.samples;
        double expected = 1.5 * (1e-3 * (double)again) * M_PI / 3; /* 90 degrees a second */
        assert_true(fabs(fv_quat_angle(before.rotation, s.rotation) - fmin(expected, 2 * M_PI - expected)) < 0.05);
    }
}

/* A halted endpoint: what is in flight is cancelled, the halt cleared, and nothing but time is lost. */
static void stalls(void **state)
{
    (void)state;
    begin();
    run_for(100 * ms);
    host.halts = true;
    run_for(500 * ms);
    struct fv_imu_state s = got();
    assert_true(s.counts.stalls == 1 && host.unstalls == 1 && host.cancels == FV_IMU_TRANSFERS - 1);
    assert_true(s.connected && s.counts.connects == 1 && s.counts.samples > 500);
    /* One that cannot be cleared ends the stream, in bounded time, and is opened again. */
    host.halts = host.unstall_fails = true;
    run_for(4000 * ms);
    assert_true(host.closes >= 1 && host.unstalls < 200);
    host.halts = host.unstall_fails = false;
    run_for(4000 * ms);
    assert_true(got().connected && got().t_ns > host.now_ns - 2 * ms);
}

static void silent(void **state)
{
    (void)state;
    begin();
    run_for(100 * ms);
    host.mute = true;
    run_for(2500 * ms);
    assert_true(got().counts.silences == 1 && host.closes == 1);
    host.mute = false;
    run_for(2000 * ms);
    assert_true(got().connected && got().counts.connects == 2 && got().t_ns > host.now_ns - 2 * ms);
}

/* Submissions that are refused are tried again. */
static void refused(void **state)
{
    (void)state;
    host.refuses = true;
    begin();
    run_for(300 * ms);
    assert_true(got().counts.refused >= FV_IMU_TRANSFERS && got().counts.reports == 0);
    host.refuses = false;
    run_for(300 * ms);
    assert_true(got().counts.reports > 90 && feed.flying[0] && feed.flying[FV_IMU_TRANSFERS - 1]);
}

/* Some failures cost nothing but themselves; only failures, as of a bad cable: opened again once a second, no busy loop. */
static void fails(void **state)
{
    (void)state;
    begin();
    run_for(100 * ms);
    for (int i = 0; i < FV_IMU_FAILURES_MAX; i++)
        fv_imu_feed_end(&feed, oldest(&host, 0), FV_IMU_FAILED, host.report, 0, host.now_ns);
    run_for(100 * ms);
    struct fv_imu_state s = got();
    assert_true(s.connected && s.counts.connects == 1 && s.counts.failures == FV_IMU_FAILURES_MAX);
    assert_int_equal(host.queued, FV_IMU_TRANSFERS);
    host.fails = true;
    run_for(5000 * ms);
    assert_true(host.closes >= 4 && host.closes <= 5 && host.submits < 1000);
    host.fails = false;
    run_for(1500 * ms);
    s = got();
    assert_true(s.connected && s.counts.reports > 300 && s.t_ns > host.now_ns - 2 * ms);
}

static void short_ones(struct host *h)
{
    static const int sizes[] = {0, 1, 51, 52, 53, 64};
    h->bytes = sizes[h->sent % 6];
}

/* Short, long and empty ends between good ones: counted, not decoded. */
static void odd_reports(void **state)
{
    (void)state;
    host.spoil = short_ones;
    begin();
    run_for(600 * ms);
    struct fv_imu_state s = got();
    assert_true(s.connected && s.counts.connects == 1);
    assert_true(s.counts.reports + s.counts.foreign + s.counts.empty >= 600 && s.counts.reports >= 90);
    assert_true(s.counts.foreign >= 390 && s.counts.samples >= 270 && s.counts.lost >= 290);
    int64_t before = s.counts.too_long;
    fv_imu_feed_end(&feed, oldest(&host, 0), FV_IMU_TOO_LONG, host.report, 64, host.now_ns);
    assert_int_equal(got().counts.too_long, before + 1);
    fv_imu_feed_end(&feed, -1, FV_IMU_CAME, host.report, 52, host.now_ns);
    fv_imu_feed_end(&feed, FV_IMU_TRANSFERS, FV_IMU_CAME, host.report, 52, host.now_ns);
    assert_int_equal(got().counts.reports, s.counts.reports);
}

static void same_again(struct host *h)
{
    static uint8_t kept[64];
    if (h->sent % 2 == 0) memcpy(kept, h->report, sizeof kept);
    else memcpy(h->report, kept, sizeof kept);
}

static void stuck(struct host *h)
{
    for (int n = 0; n < 3; n++) memset(h->report + 1 + 17 * n, 7, 12);
}

static void far_off(struct host *h)
{
    if (h->sent == 400) h->ticks += 3000000000u; /* its clock begins anew */
}

/* Reports that come twice change nothing; a stuck sensor is known for one, and its pose becomes stale; a clock that
 * begins anew, or wraps, costs nothing but itself. */
static void absurd(void **state)
{
    (void)state;
    host.spoil = same_again;
    begin();
    run_for(1000 * ms);
    struct fv_imu_state s = got();
    assert_true(s.counts.samples >= 999 && s.counts.samples <= 1002 && s.counts.rejected == 0);
    assert_true(s.counts.repeated >= 1990);
    fresh(NULL);
    host.spoil = stuck;
    begin();
    run_for(1000 * ms);
    s = got();
    struct fv_pose head;
    assert_true(s.counts.rejected > 700 && s.t_ns < host.now_ns - 500 * ms);
    assert_true(s.counts.stuck == s.counts.rejected && s.counts.bad == 0 && s.counts.mistimed == 0);
    for (int i = 0; i < 3; i++) assert_true(s.rate[i] == 0); /* held, not turned on */
    assert_false(fv_imu_head(&s, &(struct fv_neck){0}, true, host.now_ns, 0, &head));
    assert_false(fv_pose_sound(&head));
    fresh(NULL);
    host.ticks = (uint32_t)-(48000 * 300); /* wraps after 0.3 s */
    host.spoil = far_off;
    begin();
    run_for(1000 * ms);
    s = got();
    assert_true(s.counts.restarts == 1 && s.counts.lost == 0 && s.counts.rejected <= 1);
    assert_true(s.counts.samples >= 998 && s.t_ns > host.now_ns - 2 * ms && s.t_ns <= host.now_ns);
}

static struct fv_imu_device floats(void)
{
    struct fv_imu_device device;
    const char *text = "id -1, bytes 52, readings 1, first 0, acc 0, rate 12, counter 24, counter_bytes 4, number f32, "
                       "order little, acc_unit 1, rate_unit 1, counter_bits 32, tick_ns 1e6, hz 1000, axes 1 2 3, "
                       "acc_full inf,rate_full inf, interface 2";
    if (fv_imu_layout_read(text, &device, &error)) fail_msg("%s", error.text);
    return device;
}

static void put_floats(struct host *h)
{
    static const float odd[] = {NAN, INFINITY, -INFINITY, 3e38f, 1e-40f};
    float numbers[6] = {0.01f * (float)(h->sent % 3), 9.8f, 0, 0, 0.5f, 0};
    if (h->sent % 10 < 5) numbers[h->sent / 10 % 6] = odd[h->sent % 5];
    memset(h->report, 0, sizeof h->report);
    memcpy(h->report, numbers, sizeof numbers);
    put(h->report + 24, (uint64_t)h->sent, 4);
}

/* A device laid out by settings whose floats are none, half of the time: what is good is used. */
static void poisoned(void **state)
{
    (void)state;
    struct fv_imu_device device = floats();
    host.device = &device;
    host.spoil = put_floats;
    assert_true(device.interface == 2 && device.axes[1] == 2 && isinf(device.acc_full));
    begin();
    for (int i = 0; i < 2000; i++) {
        fv_imu_feed_step(&feed);
        got();
    }
    struct fv_imu_state s = got();
    double up[3] = {0, 1, 0};
    assert_true(s.counts.samples == 2000 && s.counts.rejected > 300 && s.counts.rejected < 1000);
    fv_quat_rotate(s.rotation, up, up);
    assert_true(up[1] > 0.99 && fabs(s.rate[1] - 0.5) < 0.1);
    const struct fv_imu_calibration none = {.acc_scale = {1, 1, 1}, .rate_scale = {1, NAN, 1}};
    fv_imu_feed_close(&feed);
    fv_imu_feed_begin(&feed, &port, &made_up);
    host.calibration = &none;
    assert_int_equal(fv_imu_feed_search(&feed, &error), -1);
    assert_false(host.open);
}

/* A device that must be told to send: at once, and as often as it asks for; told again when it comes again. */
static void told(void **state)
{
    (void)state;
    struct fv_imu_device device = fv_imu_devices[FV_IMU_VIVE];
    begin();
    run_for(20000 * ms);
    assert_int_equal(host.tells, 0);
    const double every_s[] = {8, INFINITY};
    for (int i = 0; i < 2; i++) {
        fresh(NULL);
        host.device = &device;
        device.command = (struct fv_imu_command){FV_IMU_FEATURE, 0, 5, {8}, every_s[i]};
        begin();
        run_for(20000 * ms);
        assert_int_equal(host.tells, i == 0 ? 3 : 1);
        host.plugged = false;
        host.deaf = true;
        run_for(2000 * ms);
        host.plugged = true;
        run_for(2000 * ms);
        assert_true(host.tells == (i == 0 ? 4 : 2) && got().counts.untold == 1 && got().connected);
    }
    for (int i = 0; i < FV_IMU_DEVICES; i++) {
        const struct fv_imu_command *c = &fv_imu_devices[i].command;
        assert_true(c->bytes == 0 || (c->bytes <= 64 && c->every_s > 1));
    }
}

static uint32_t dice(uint32_t *state, uint32_t sides)
{
    *state = *state * 1664525u + 1013904223u;
    return (*state >> 8) % sides;
}

static void garble(struct host *h)
{
    static uint32_t state = 5;
    h->bytes = dice(&state, 20) == 0 ? (int)dice(&state, 65) : 52;
    for (uint32_t n = dice(&state, 10) == 0 ? 1 + dice(&state, 9) : 0; n > 0; n--)
        h->report[dice(&state, 52)] = (uint8_t)dice(&state, 256);
    if (dice(&state, 500) == 0) h->ticks += dice(&state, 1u << 24) << 8;
}

static void change_something(uint32_t *state)
{
    bool *const faults[] = {&host.refuses, &host.halts, &host.mute, &host.fails, &host.forbidden, &host.silent_end,
                            &host.unstall_fails};
    uint32_t which = dice(state, 16);
    if (which < 7) *faults[which] = dice(state, 4) == 0;
    if (which == 7) host.plugged = dice(state, 3) > 0;
    if (which == 8)
        for (int i = 0; i < 7; i++) *faults[i] = false;
    if (which == 9) host.now_ns += (int64_t)dice(state, 3000) * ms;
}

/* Whatever happens in whatever order: no transfer is forgotten or twice in flight, nothing that is given out is insane,
 * and once all is well the stream goes on. */
static void chaos(void **state)
{
    (void)state;
    int errors = dup(STDERR_FILENO), null = open("/dev/null", O_WRONLY);
    dup2(null, STDERR_FILENO);
    for (uint32_t seed = 1; seed <= 40; seed++) {
        uint32_t dealt = seed;
        fresh(NULL);
        host.spoil = garble;
        for (int i = 0; i < 5000; i++) {
            if (dice(&dealt, 40) == 0) change_something(&dealt);
            fv_imu_feed_step(&feed);
            struct fv_imu_state s = got();
            int flying = 0, idle = 0;
            for (int k = 0; k < FV_IMU_TRANSFERS; k++) flying += feed.flying[k], idle += feed.idle[k];
            assert_true(fabs(s.rotation[0] * s.rotation[0] + s.rotation[1] * s.rotation[1] +
                             s.rotation[2] * s.rotation[2] + s.rotation[3] * s.rotation[3] - 1) < 1e-9);
            assert_true(host.open == (feed.phase != FV_IMU_SEARCHING) && flying == host.queued);
            if (feed.phase == FV_IMU_STREAMING && !feed.gone) assert_int_equal(flying + idle, FV_IMU_TRANSFERS);
            assert_true(s.good + s.counts.rejected == s.counts.samples && s.counts.connects - host.closes == host.open);
        }
        struct host well = {.plugged = true, .bytes = 52, .device = host.device, .error = host.error, .feed = &feed};
        well.now_ns = host.now_ns, well.open = host.open, well.queued = host.queued, well.sent = host.sent;
        well.ticks = host.ticks, well.rate_deg_s = 20, well.halted = host.halted;
        memcpy(well.queue, host.queue, sizeof well.queue);
        memcpy(well.cancelled, host.cancelled, sizeof well.cancelled);
        host = well;
        run_for(8000 * ms);
        assert_true(got().connected && got().arrival_ns > host.now_ns - 5 * ms);
        assert_true(got().t_ns <= host.now_ns + 20 * ms); /* a clock map's step */
        assert_int_equal(host.queued, FV_IMU_TRANSFERS);
    }
    dup2(errors, STDERR_FILENO);
    close(errors), close(null);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(streams, fresh),   cmocka_unit_test_setup(searches, fresh),
        cmocka_unit_test_setup(unplugged, fresh), cmocka_unit_test_setup(stalls, fresh),
        cmocka_unit_test_setup(silent, fresh),    cmocka_unit_test_setup(refused, fresh),
        cmocka_unit_test_setup(fails, fresh),     cmocka_unit_test_setup(odd_reports, fresh),
        cmocka_unit_test_setup(absurd, fresh),    cmocka_unit_test_setup(poisoned, fresh),
        cmocka_unit_test_setup(told, fresh),      cmocka_unit_test_setup(chaos, fresh),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
