/* made_up_imu: an inertial sensor that is made up, like an HTC Vive, the host that it is plugged into, and the clock; the
 * port of a feed to it (sensors/imu/feed.h). For tests only. */
#ifndef FV_TESTS_MADE_UP_IMU_H
#define FV_TESTS_MADE_UP_IMU_H

#include "sensors/imu/feed.h"

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
    const struct fv_imu_calibration *calibration;
    const char *error;
    struct fv_imu_feed *feed; /* to whom ends are told */
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

static int open_device(void *context, const struct fv_imu_device **device,
                       const struct fv_imu_calibration **calibration, struct fv_error *why)
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
    *calibration = h->calibration;
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
            fv_imu_feed_end(h->feed, oldest(h, i), FV_IMU_CANCELLED, h->report, 0, h->now_ns);
            return true;
        }
    if (h->queued == 0) return false;
    if (!h->plugged || h->fails) {
        h->now_ns += h->fails ? ms / 8 : 0;
        fv_imu_feed_end(h->feed, oldest(h, 0), h->silent_end || h->fails ? FV_IMU_FAILED : FV_IMU_GONE, h->report, 0, h->now_ns);
        return true;
    }
    if (h->halts && !h->halted) {
        h->halted = true;
        fv_imu_feed_end(h->feed, oldest(h, 0), FV_IMU_STALLED, h->report, 0, h->now_ns);
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
    fv_imu_feed_end(h->feed, oldest(h, 0), FV_IMU_CAME, h->report, (size_t)h->bytes, h->now_ns);
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
                         .device = &fv_imu_devices[FV_IMU_VIVE], .error = "imu: none is plugged in", .feed = &feed};
    fv_imu_feed_begin(&feed, &port, &made_up);
    return 0;
}

#endif
