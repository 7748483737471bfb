/* imu_usb: the feed of an inertial sensor on a port that is made up, on a clock that is made up: what it does when the
 * device is not there, is unplugged, fails, stalls, keeps silent, sends short, repeated or absurd reports; the head that
 * comes of it; and what surrounds it: the list of devices, the layout of unknown ones, libusb's memory, the mailbox. */
#include "platform/mailbox.h"
#include "platform/threads.h"
#include "sensors/imu/head.h"
#include "sensors/imu/layout.h"
#include "sensors/imu/usb_find.h"
#include "sensors/imu/usb_memory.h"

#include "tests/support/program.h"

#include <math.h>

static const int64_t ms = 1000000;
static const double gravity = 9.80665;

/* A device that sends a report each millisecond, turning about its y axis, and a host that it is plugged into. */
static struct host {
    int64_t now_ns;
    bool plugged, refuses, halts, mute, fails, forbidden;
    bool silent_end;  /* unplugging is told by failures, and by what a submission says, only */
    bool unstall_fails;
    int opens, closes, cancels, unstalls, submits, tells;
    bool deaf;
    bool open, halted;
    int queue[FV_IMU_TRANSFERS], queued; /* transfers in flight, oldest first */
    bool cancelled[FV_IMU_TRANSFERS];
    int64_t sent;     /* reports */
    uint32_t ticks;   /* of its clock at the first */
    double rate_deg_s;
    uint8_t report[64];
    int bytes;        /* of a report that comes */
    void (*spoil)(struct host *host);
    const struct fv_imu_device *device;
    const char *error;
} host;
static struct fv_imu_feed feed;
static struct fv_error error;

static int64_t now_ns(void *context)
{
    return ((struct host *)context)->now_ns;
}

static void sleep_until_ns(void *context, int64_t t_ns)
{
    struct host *h = context;
    if (t_ns > h->now_ns) h->now_ns = t_ns;
}

static const struct fv_clock made_up = {now_ns, now_ns, sleep_until_ns, &host};

static void put(uint8_t *at, uint64_t value, int bytes)
{
    for (int i = 0; i < bytes; i++) at[i] = (uint8_t)(value >> 8 * i);
}

/* As the Vive's; of its ring of three the newest comes last. The head's y axis is minus the device's second. */
static void make_report(struct host *h)
{
    int acc = (int)lrint(gravity / h->device->layout.acc_unit);
    int rate = (int)lrint(h->rate_deg_s * M_PI / 180 / h->device->layout.rate_unit);
    memset(h->report, 0, sizeof h->report);
    h->report[0] = 0x20;
    for (int n = 0; n < 3; n++) {
        uint8_t *at = h->report + 1 + 17 * n;
        int jitter = (int)((h->sent + n) % 3) - 1; /* no sensor is the same to the bit for long */
        put(at, (uint64_t)jitter, 2);
        put(at + 2, (uint64_t)-acc, 2);
        put(at + 6 + 2, (uint64_t)-rate, 2);
        put(at + 12, h->ticks + 48000u * (uint32_t)(h->sent + n - 2), 4);
    }
    if (h->spoil) h->spoil(h);
}

static int open_device(void *context, const struct fv_imu_device **device, struct fv_error *why)
{
    struct host *h = context;
    assert_false(h->open);
    h->opens++;
    if (!h->plugged) {
        fv_error_set(why, "%s", h->error);
        return 1;
    }
    if (h->forbidden) return fv_error_set(why, "imu: forbidden");
    h->open = true;
    h->queued = 0;
    h->halted = false;
    *device = h->device;
    return 0;
}

static enum fv_imu_submitted submit(void *context, int transfer)
{
    struct host *h = context;
    assert_true(h->open && transfer >= 0 && transfer < FV_IMU_TRANSFERS);
    for (int i = 0; i < h->queued; i++) assert_int_not_equal(h->queue[i], transfer);
    h->submits++;
    if (!h->plugged) return FV_IMU_NO_DEVICE;
    if (h->refuses) return FV_IMU_REFUSED;
    h->cancelled[transfer] = false;
    h->queue[h->queued++] = transfer;
    return FV_IMU_SUBMITTED;
}

static void cancel(void *context, int transfer)
{
    struct host *h = context;
    assert_true(h->open);
    h->cancels++;
    h->cancelled[transfer] = true;
}

static int unstall(void *context)
{
    struct host *h = context;
    assert_int_equal(h->queued, 0);
    h->unstalls++;
    if (!h->unstall_fails) h->halted = h->halts = false;
    return h->unstall_fails ? -1 : 0;
}

static int tell(void *context, const struct fv_imu_command *command)
{
    struct host *h = context;
    assert_true(h->open && command->bytes > 0 && command->bytes <= 64);
    h->tells++;
    return h->deaf ? -1 : 0;
}

static int oldest(struct host *h, int at)
{
    int transfer = h->queue[at];
    h->queued--;
    memmove(&h->queue[at], &h->queue[at + 1], (size_t)(h->queued - at) * sizeof h->queue[0]);
    return transfer;
}

/* One end of a transfer, if any is to be had now. */
static bool tell_one(struct host *h)
{
    for (int i = 0; i < h->queued; i++)
        if (h->cancelled[h->queue[i]]) {
            fv_imu_feed_end(&feed, oldest(h, i), FV_IMU_CANCELLED, h->report, 0, h->now_ns);
            return true;
        }
    if (h->queued == 0) return false;
    if (!h->plugged || h->fails) {
        h->now_ns += h->fails ? ms / 8 : 0;
        fv_imu_feed_end(&feed, oldest(h, 0), h->silent_end || h->fails ? FV_IMU_FAILED : FV_IMU_GONE, h->report, 0, h->now_ns);
        return true;
    }
    if (h->halts && !h->halted) {
        h->halted = true;
        fv_imu_feed_end(&feed, oldest(h, 0), FV_IMU_STALLED, h->report, 0, h->now_ns);
        return true;
    }
    return false;
}

/* Events are told as they come; a report each millisecond. */
static void wait_until(void *context, int64_t until_ns)
{
    struct host *h = context;
    assert_true(h->open);
    if (tell_one(h)) return;
    if (h->queued == 0 || h->mute || h->halted) {
        h->now_ns = until_ns;
        return;
    }
    h->now_ns += ms;
    make_report(h);
    h->sent++;
    fv_imu_feed_end(&feed, oldest(h, 0), FV_IMU_CAME, h->report, (size_t)h->bytes, h->now_ns);
}

static void close_device(void *context)
{
    struct host *h = context;
    assert_true(h->open);
    h->open = false;
    h->queued = 0;
    h->closes++;
}

static const struct fv_imu_port port = {open_device, submit, cancel, unstall, tell, wait_until, close_device, &host};

static int fresh(void **state)
{
    (void)state;
    host = (struct host){.now_ns = 1000 * ms, .plugged = true, .ticks = 5, .rate_deg_s = 90, .bytes = 52,
                         .device = &fv_imu_devices[FV_IMU_VIVE], .error = "imu: none is plugged in"};
    fv_imu_feed_begin(&feed, &port, &made_up, NULL);
    return 0;
}

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
    run_for(3000 * ms);
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
    fv_imu_feed_begin(&feed, &port, &made_up, &none);
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
        struct host well = {.plugged = true, .bytes = 52, .device = host.device, .error = host.error};
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

static void heads(void **state)
{
    (void)state;
    const struct fv_neck neck = {0.075, 0.08};
    struct fv_imu_state s = {.good = 1, .t_ns = 1000 * ms, .arrival_ns = 1000 * ms, .rotation = {1, 0, 0, 0}, .rate = {0, 1, 0}};
    struct fv_pose head;
    double turn[3];
    assert_true(fv_imu_head(&s, &neck, true, 1010 * ms, 20 * ms, &head));
    fv_quat_to_vector(head.rotation, turn);
    assert_true(fabs(turn[1] - 0.03) < 1e-12);
    assert_true(fv_imu_head(&s, &neck, false, 1010 * ms, 20 * ms, &head));
    assert_true(head.rotation[0] == 1 && head.position_m[2] == 0);
    assert_true(fv_imu_head(&s, &neck, true, 1100 * ms, 1000 * ms, &head)); /* no further than 0.1 s */
    fv_quat_to_vector(head.rotation, turn);
    assert_true(fabs(turn[1] - 0.1) < 1e-12);
    assert_false(fv_imu_head(&s, &neck, true, 1100 * ms + 1, 0, &head));
    assert_false(fv_imu_head(&s, &neck, true, INT64_MAX, 0, &head));
    s.t_ns = INT64_MIN; /* a device whose clock is no clock */
    assert_true(fv_imu_head(&s, &neck, true, 1000 * ms, 0, &head));
    fv_quat_to_vector(head.rotation, turn);
    assert_true(fabs(turn[1] - 0.1) < 1e-12);
    s.t_ns = INT64_MAX;
    assert_true(fv_imu_head(&s, &neck, true, INT64_MIN, 0, &head) && head.rotation[0] == 1);
    s.good = 0;
    assert_false(fv_imu_head(&s, &neck, true, 1000 * ms, 0, &head));
}

static void layouts(void **state)
{
    (void)state;
    static const char *const bad[][2] = {
        {"bytes", "bytes: ''; must be a whole number from 1 to 1024"},
        {"bytes 52.5", "must be a whole number"},
        {"bytes 0", "bytes: ' 0'; must be"},
        {"bytes 50", "readings end at byte 51 of a report of 50"},
        {"hertz 5", "'hertz 5' is no field of a layout; there are interface, id"},
        {"axes 1 2", "axes:"},
        {"axes 1 2 -3", "left-handed"},
        {"number f16", "number: 'f16'; must be one of i16, i32, f32"},
        {"order little big", "order: ' big' is too much"},
        {"hz nan", "hz: ' nan'; must be"},
        {"acc_unit 0", "acc_unit"},
        {"hz 1000 2", "is too much"},
        {"hz 1000,, id 3", "'' is no field"},
    };
    struct fv_imu_device device;
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        assert_int_equal(fv_imu_layout_read(bad[i][0], &device, &error), -1);
        if (!strstr(error.text, bad[i][1])) fail_msg("%s: %s", bad[i][0], error.text);
    }
    assert_int_equal(fv_imu_layout_read("", &device, &error), 0);
    assert_memory_equal(&device.layout, &fv_imu_devices[FV_IMU_GENERIC].layout, sizeof device.layout);
}

static void plug(const char *at, const char *vendor, const char *product, int bus, int number, const char *serial)
{
    char command[1024];
    snprintf(command, sizeof command,
             "d=%s/sys/bus/usb/devices/%s; mkdir -p $d && echo %s >$d/idVendor && echo %s >$d/idProduct && "
             "echo %d >$d/busnum && echo %d >$d/devnum && if [ -n '%s' ]; then echo '%s' >$d/serial; fi",
             program_folder(), at, vendor, product, bus, number, serial, serial);
    assert_int_equal(system(command), 0);
}

static const struct fv_usb_place *choose(const char *wish_text, struct fv_usb_place *places, int count)
{
    struct fv_usb_wish wish;
    assert_true(fv_usb_wish_read(wish_text, &wish));
    return fv_usb_choose(&wish, places, count);
}

static void finds(void **state)
{
    (void)state;
    static struct fv_usb_place places[FV_USB_PLACES_MAX];
    struct fv_usb_wish wish;
    char longer[200];
    assert_int_equal(fv_usb_list(program_folder(), places), -1);
    plug("1-2", "2833", "0021", 1, 12, "");
    plug("usb1", "1d6b", "0002", 1, 1, "0000:00:14.0");
    plug("1-1.4", "28DE", "2000", 1, 7, "LHR-1234");
    plug("3-1", "28de", "2000", 3, 2, "LHR-99");
    plug("1-2:1.0", "28de", "2000", 1, 5, "");
    plug("2-1", "28de", "", 2, 4, "");
    plug("2-2", "1234", "abcd", 2, 5, "X Y");
    int count = fv_usb_list(program_folder(), places);
    assert_int_equal(count, 5);
    for (int i = 1; i < count; i++)
        assert_true(places[i - 1].bus < places[i].bus || places[i - 1].number < places[i].number);
    assert_ptr_equal(choose("", places, count), &places[1]); /* in the table's order, then by bus */
    assert_ptr_equal(choose("rift-dk2", places, count), &places[2]);
    assert_ptr_equal(choose("2833:0021", places, count), &places[2]);
    assert_ptr_equal(choose("LHR-99", places, count), &places[4]);
    assert_ptr_equal(choose("X Y", places, count), &places[3]);
    assert_ptr_equal(choose("1234:ABCD", places, count), &places[3]);
    assert_null(choose("psvr", places, count));
    assert_null(choose("LHR-9", places, count));
    assert_null(choose("", places, 0));
    memset(longer, 'a', sizeof longer - 1);
    longer[sizeof longer - 1] = 0;
    assert_false(fv_usb_wish_read(longer, &wish));
}

/* What udev is told are the table's devices, for who sits there and nobody else. */
static void rules(void **state)
{
    (void)state;
    static char text[8192];
    char row[256];
    program_slurp(FV_SOURCE_DIR "/config/udev/70-foveola-imu.rules", text, sizeof text);
    assert_null(strstr(text, "MODE"));
    for (int i = 0; i < FV_IMU_DEVICES; i++) {
        const struct fv_imu_device *d = &fv_imu_devices[i];
        if (!d->vendor) continue;
        snprintf(row, sizeof row, "ATTR{idVendor}==\"%04x\", ATTR{idProduct}==\"%04x\", TAG+=\"uaccess\"\n", d->vendor,
                 d->product);
        if (!strstr(text, row)) fail_msg("no rule for %s: %s", d->name, row);
        assert_true(d->layout.bytes > 0 && d->layout.bytes <= 1024);
    }
}

/* The same takings for ever need no more than once; too much is refused, and nothing is lost by it. */
static void memory(void **state)
{
    (void)state;
    void *block[40];
    assert_null(fv_usb_malloc(10));
    fv_usb_memory_open();
    int64_t used = 0;
    for (int round = 0; round < 1000; round++) {
        for (int i = 0; i < 40; i++) {
            block[i] = fv_usb_calloc(1, (size_t)(1 + 97 * i));
            assert_non_null(block[i]);
            assert_true((uintptr_t)block[i] % 16 == 0);
            for (int k = 0; k < 1 + 97 * i; k++) assert_int_equal(((char *)block[i])[k], 0);
            memset(block[i], i, (size_t)(1 + 97 * i));
        }
        for (int i = 0; i < 40; i++)
            for (int k = 0; k < 1 + 97 * i; k++) assert_int_equal(((char *)block[i])[k], i);
        for (int i = 0; i < 40; i++) fv_usb_free(block[i]);
        if (round == 0) used = fv_usb_memory_counts().bytes;
    }
    assert_int_equal(fv_usb_memory_counts().bytes, used);
    char *grown = fv_usb_realloc(NULL, 10);
    strcpy(grown, "nine text");
    grown = fv_usb_realloc(grown, 5000);
    assert_string_equal(grown, "nine text");
    assert_ptr_equal(fv_usb_realloc(grown, 20), grown);
    assert_null(fv_usb_realloc(grown, FV_USB_BLOCK_MAX + 1));
    assert_string_equal(grown, "nine text");
    fv_usb_free(grown);
    fv_usb_free(NULL);
    assert_null(fv_usb_calloc(SIZE_MAX / 2, 3));
    int large = 0;
    while (large < 40 && (block[large] = fv_usb_malloc(30000))) large++;
    assert_true(large > 0 && large < 40 && fv_usb_memory_counts().refused >= 4);
    while (large > 0) fv_usb_free(block[--large]);
    assert_non_null(fv_usb_malloc(30000));
}

struct letter {
    uint64_t word[40];
};
static struct fv_mailbox box;
static atomic_bool over;

static void *write_letters(void *context)
{
    (void)context;
    for (uint64_t n = 1; !atomic_load(&over); n++) {
        struct letter l;
        for (int i = 0; i < 40; i++) l.word[i] = n * 1000 + (uint64_t)i;
        fv_mailbox_put(&box, &l, sizeof l);
    }
    return NULL;
}

/* No letter is ever half of one and half of another, and none is older than the one before. */
static void letters(void **state)
{
    (void)state;
    pthread_t writer;
    struct letter l = {.word = {7}};
    assert_false(fv_mailbox_get(&box, &l, sizeof l));
    assert_int_equal(l.word[0], 7);
    assert_int_equal(fv_thread_start(&writer, "writer", write_letters, NULL, &error), 0);
    uint64_t last = 0;
    for (int i = 0; i < 200000; i++) {
        if (!fv_mailbox_get(&box, &l, sizeof l)) continue;
        assert_true(l.word[0] % 1000 == 0 && l.word[0] >= last);
        for (int k = 1; k < 40; k++) assert_int_equal(l.word[k], l.word[0] + (uint64_t)k);
        last = l.word[0];
    }
    atomic_store(&over, true);
    pthread_join(writer, NULL);
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
        cmocka_unit_test(heads),
        cmocka_unit_test(layouts),                cmocka_unit_test(finds),
        cmocka_unit_test(rules),                  cmocka_unit_test(memory),
        cmocka_unit_test(letters),
    };
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
