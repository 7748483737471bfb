/* usb: see usb.h. */
#include "sensors/imu/usb.h"

#include "platform/arena.h"
#include "platform/threads.h"
#include "sensors/imu/layout.h"
#include "sensors/imu/usb_port.h"

#include <string.h>
#include <unistd.h>

struct fv_imu_usb {
    struct fv_neck neck;
    bool predict;
    struct fv_imu_feed feed; /* the thread's, but for its mailbox */
    struct fv_imu_device laid_out;
    pthread_t thread;
    atomic_bool stop, stopped;
};

/* Never ends: the end of a thread gives memory back, and the heap is sealed. */
static void *run(void *context)
{
    struct fv_imu_usb *u = context;
    while (!atomic_load_explicit(&u->stop, memory_order_relaxed)) fv_imu_feed_step(&u->feed);
    fv_imu_feed_close(&u->feed);
    atomic_store_explicit(&u->stopped, true, memory_order_release);
    while (atomic_load_explicit(&u->stopped, memory_order_relaxed)) pause();
    return NULL;
}

static int make_port(struct fv_imu_usb *u, const struct fv_config *c, struct fv_usb_port **port, struct fv_error *error)
{
    struct fv_usb_wish wish;
    struct fv_error why;
    bool laid_out = c->imu_layout[0] != 0;
    if (!fv_usb_wish_read(c->imu_device, &wish))
        return fv_config_error(error, "imu.device", "longer than any serial number; must be VENDOR:PRODUCT, the name of "
                               "a known device, or a serial number");
    if (laid_out && fv_imu_layout_read(c->imu_layout, &u->laid_out, &why))
        return fv_config_error(error, "imu.layout", "%s", why.text);
    if (laid_out && !wish.vendor && !wish.serial[0])
        return fv_config_error(error, "imu.layout", "imu.device must say which device is laid out so: VENDOR:PRODUCT or "
                               "a serial number");
    return fv_usb_port_make(port, &wish, laid_out ? &u->laid_out : NULL, error);
}

int fv_imu_usb_open(struct fv_imu_usb **usb, const struct fv_config *c, struct fv_error *error)
{
    struct fv_imu_usb *u = fv_arena_take(fv_arena(), "usb", sizeof *u, 64);
    struct fv_usb_port *port;
    u->neck = (struct fv_neck){1e-3 * c->imu_neck_up_mm, 1e-3 * c->imu_neck_ahead_mm};
    u->predict = strcmp(c->imu_predict, "hold") != 0;
    if (make_port(u, c, &port, error)) return -1;
    fv_imu_feed_begin(&u->feed, fv_usb_port_for(port, &u->feed), &fv_clock_monotonic);
    if (fv_imu_feed_search(&u->feed, error)) return -1;
    if (fv_thread_start(&u->thread, "imu", FV_URGENT, run, u, error)) return -1;
    *usb = u;
    return 0;
}

bool fv_imu_usb_head(const struct fv_imu_usb *u, int64_t ahead_ns, struct fv_pose *head)
{
    struct fv_imu_state state = {0};
    fv_mailbox_get(&u->feed.box, &state, sizeof state);
    return fv_imu_head(&state, &u->neck, u->predict, fv_clock_now_ns(u->feed.clock), ahead_ns, head);
}

int fv_imu_usb_record(struct fv_imu_usb *u, const char *folder, struct fv_spooler *spooler, struct fv_error *error)
{
    struct fv_imu_recorder *recorder;
    if (fv_imu_recorder_open(&recorder, folder, spooler, error)) return -1;
    atomic_store_explicit(&u->feed.recorder, recorder, memory_order_release);
    return 0;
}

int fv_imu_usb_record_end(struct fv_imu_usb *u, int64_t session_ns, struct fv_error *error)
{
    struct fv_imu_recorder *recorder = atomic_exchange_explicit(&u->feed.recorder, NULL, memory_order_acq_rel);
    return recorder ? fv_imu_recorder_close(recorder, session_ns, error) : 0;
}

struct fv_imu_feed_counts fv_imu_usb_counts(const struct fv_imu_usb *u)
{
    struct fv_imu_state state = {0};
    fv_mailbox_get(&u->feed.box, &state, sizeof state);
    return state.counts;
}

void fv_imu_usb_close(struct fv_imu_usb *u)
{
    const struct fv_clock *clock = u->feed.clock;
    int64_t until_ns = fv_clock_now_ns(clock) + FV_IMU_WAIT_NS + 2 * FV_IMU_FAREWELL_NS;
    atomic_store_explicit(&u->stop, true, memory_order_relaxed);
    while (!atomic_load_explicit(&u->stopped, memory_order_acquire) && fv_clock_now_ns(clock) < until_ns)
        fv_clock_sleep_until_ns(clock, fv_clock_now_ns(clock) + 1000000);
}
