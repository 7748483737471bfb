/* imu_device: the inertial sensor (tests/support/made_up_imu.h), a report each millisecond. See devices.h. */
#define _GNU_SOURCE
#include "sensors/imu/usb_port.h"
#include "tests/soak/devices.h"
#include "tests/soak/world.h"
#include "tests/support/made_up_imu.h"

#include <unistd.h>

struct imu_faults imu_faults;
struct fv_imu_feed *imu_feed;
static int descriptor = -1;
static int64_t next_ns;

void imu_device_plug(void)
{
    fresh(NULL);
    error.text[0] = 0;
    memset(&imu_faults, 0, sizeof imu_faults);
}

bool imu_device_open(void)
{
    return host.open;
}

static void spoil_report(struct host *h)
{
    if (imu_faults.stuck)
        for (int n = 0; n < 3; n++) memset(h->report + 1 + 17 * n, 7, 12);
    if (imu_faults.garbled > 0) {
        imu_faults.garbled--;
        h->bytes = 17;
    } else {
        h->bytes = 52;
    }
}

/* What is wrong, as the made-up host has it. */
static void set_host(void)
{
    host.now_ns = world_now_ns();
    host.plugged = !imu_faults.gone;
    host.silent_end = !imu_faults.says_so;
    host.mute = imu_faults.mute;
    host.fails = imu_faults.fails;
    host.refuses = imu_faults.refuses;
    host.forbidden = imu_faults.forbidden;
    host.unstall_fails = imu_faults.jammed;
    host.spoil = spoil_report;
    host.rate_deg_s = 40 * sin(1e-9 * (double)(host.now_ns % 60000000000) * M_PI / 30);
    if (imu_faults.halts > 0 && !host.halted) {
        imu_faults.halts--;
        host.halts = true;
    }
    if (imu_faults.skips > 0) {
        imu_faults.skips--;
        host.ticks += 3000000000u;
    }
}

static int imu_open(void *context, const struct fv_imu_device **device, const struct fv_imu_calibration **calibration,
                    struct fv_error *why)
{
    set_host();
    int failed = open_device(context, device, calibration, why);
    if (failed) return failed;
    descriptor = device_descriptor();
    next_ns = host.now_ns + ms;
    return 0;
}

static enum fv_imu_submitted imu_submit(void *context, int transfer)
{
    set_host();
    return submit(context, transfer);
}

static void imu_close(void *context)
{
    close_device(context);
    close(descriptor);
    descriptor = -1;
}

/* Reports that nobody was there to take are lost, as those that do not come. */
static void lose_reports(int64_t reports)
{
    host.sent += reports;
    next_ns += reports * ms;
}

static void imu_wait(void *context, int64_t until_ns)
{
    (void)context;
    set_host();
    bool told = tell_one(&host), quiet = host.queued == 0 || host.mute || host.halted;
    if (told || quiet) {
        world_wait_ns(told ? host.now_ns : until_ns);
        while (next_ns <= world_now_ns()) lose_reports(1);
        return;
    }
    world_wait_ns(next_ns < until_ns ? next_ns : until_ns);
    set_host();
    int64_t waiting = next_ns <= host.now_ns ? (host.now_ns - next_ns) / ms + 1 : 0;
    if (waiting > FV_IMU_TRANSFERS) lose_reports(waiting - FV_IMU_TRANSFERS);
    if (imu_faults.dropped > 0 && waiting > 0) {
        lose_reports(imu_faults.dropped);
        imu_faults.dropped = 0;
    }
    for (; next_ns <= host.now_ns && host.queued > 0 && host.plugged && !host.mute; next_ns += ms) {
        make_report(&host);
        host.sent++;
        fv_imu_feed_end(host.feed, oldest(&host, 0), FV_IMU_CAME, host.report, (size_t)host.bytes, host.now_ns);
    }
}

/* In the place of usb_port.c's. */
int fv_usb_port_make(struct fv_usb_port **made, const struct fv_usb_wish *wish, const struct fv_imu_device *laid_out,
                     struct fv_error *why)
{
    (void)wish, (void)laid_out, (void)why;
    *made = NULL;
    return 0;
}

const struct fv_imu_port *fv_usb_port_for(struct fv_usb_port *made, struct fv_imu_feed *of)
{
    (void)made;
    static struct fv_imu_port soak_port;
    host.feed = imu_feed = of;
    soak_port = port; /* but for what waits, or holds a descriptor */
    soak_port.open = imu_open, soak_port.submit = imu_submit, soak_port.wait = imu_wait, soak_port.close = imu_close;
    return &soak_port;
}
