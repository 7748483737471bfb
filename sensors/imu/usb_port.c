/* usb_port: see usb_port.h. */
#define _GNU_SOURCE
#include "sensors/imu/usb_port.h"

#include "platform/arena.h"
#include "platform/log.h"
#include "sensors/imu/factory.h"
#include "sensors/imu/usb_memory.h"

#include <errno.h>
#include <fcntl.h>
#include <libusb.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#define RULES "config/udev/70-foveola-imu.rules"

struct slot {
    struct fv_usb_port *port;
    int number;
    struct libusb_transfer *transfer;
    bool flying;
    uint8_t bytes[FV_USB_REPORT_MAX];
};

struct fv_usb_port {
    struct fv_imu_port port;
    struct fv_imu_feed *feed;
    struct fv_usb_wish wish;
    struct fv_imu_device laid_out;
    bool is_laid_out;
    libusb_context *usb;
    libusb_device_handle *handle;
    int fd, interface, told_interface; /* claimed; -1: none */
    uint8_t endpoint;
    bool bulk;
    int length; /* of a transfer */
    bool opened; /* once: what the factory measured of that device was read, if it could be */
    char factory_serial[FV_USB_SERIAL_MAX];
    struct fv_imu_calibration factory;
    struct fv_usb_place places[FV_USB_PLACES_MAX];
    struct slot slot[FV_IMU_TRANSFERS];
};

/* Interrupt or bulk, towards the host; the interface's first setting. */
static bool find_endpoint(struct fv_usb_port *p, const struct fv_imu_device *device,
                          const struct libusb_config_descriptor *config)
{
    for (int i = 0; i < config->bNumInterfaces; i++) {
        const struct libusb_interface *of = &config->interface[i];
        if (of->num_altsetting < 1 || of->altsetting[0].bInterfaceNumber != device->interface) continue;
        for (int e = 0; e < of->altsetting[0].bNumEndpoints; e++) {
            const struct libusb_endpoint_descriptor *at = &of->altsetting[0].endpoint[e];
            int type = at->bmAttributes & 3, packet = (at->wMaxPacketSize & 0x7ff) * (1 + (at->wMaxPacketSize >> 11 & 3));
            if (!(at->bEndpointAddress & LIBUSB_ENDPOINT_IN) || packet == 0) continue;
            if (type != LIBUSB_TRANSFER_TYPE_INTERRUPT && type != LIBUSB_TRANSFER_TYPE_BULK) continue;
            p->endpoint = at->bEndpointAddress;
            p->bulk = type == LIBUSB_TRANSFER_TYPE_BULK;
            /* Room for a report, in whole packets, so that neither two reports share a transfer nor one is cut. */
            p->length = (device->layout.bytes + packet - 1) / packet * packet;
            return p->length > 0 && p->length <= FV_USB_REPORT_MAX;
        }
    }
    return false;
}

static int open_endpoint(struct fv_usb_port *p, const struct fv_imu_device *device, const char *what,
                         struct fv_error *error)
{
    struct libusb_config_descriptor *config;
    int failed = libusb_get_active_config_descriptor(libusb_get_device(p->handle), &config);
    if (failed) return fv_error_set(error, "imu: %s: no descriptor: %s", what, libusb_strerror(failed));
    bool found = find_endpoint(p, device, config);
    libusb_free_config_descriptor(config);
    if (!found)
        return fv_error_set(error, "imu: %s: interface %d has no endpoint for reports of %d bytes", what,
                            device->interface, device->layout.bytes);
    libusb_set_auto_detach_kernel_driver(p->handle, 1);
    failed = libusb_claim_interface(p->handle, device->interface);
    if (failed == LIBUSB_ERROR_BUSY)
        return fv_error_set(error, "imu: %s: interface %d is in use by another program", what, device->interface);
    if (failed)
        return fv_error_set(error, "imu: %s: interface %d cannot be claimed: %s", what, device->interface,
                            libusb_strerror(failed));
    p->interface = device->interface;
    return 0;
}

static int open_node(const struct fv_usb_place *place, const char *what, struct fv_error *error)
{
    char node[64];
    snprintf(node, sizeof node, "/dev/bus/usb/%03d/%03d", place->bus, place->number);
    int fd = open(node, O_RDWR | O_CLOEXEC);
    if (fd >= 0) return fd;
    if (errno == EACCES || errno == EPERM)
        return fv_error_set(error,
                            "imu: %s is there, but %s may not be opened: copy " RULES " to /etc/udev/rules.d, run "
                            "'udevadm control --reload' and plug it in again",
                            what, node);
    return fv_error_set(error, "imu: %s is there, but %s cannot be opened: %s", what, node, strerror(errno));
}

/* A transfer that never ended is libusb's for good, and refused by it: the slot gets another. Where there is no memory for
 * one, the old one goes on being refused, as a failed transfer is. */
static void forget_flying(struct fv_usb_port *p)
{
    for (int i = 0; i < FV_IMU_TRANSFERS; i++) {
        struct libusb_transfer *another = p->slot[i].flying ? libusb_alloc_transfer(0) : NULL;
        if (another) p->slot[i].transfer = another;
        p->slot[i].flying = false;
    }
}

static void close_device(void *context)
{
    struct fv_usb_port *p = context;
    if (p->handle) {
        if (p->told_interface >= 0) libusb_release_interface(p->handle, p->told_interface);
        if (p->interface >= 0) libusb_release_interface(p->handle, p->interface);
        libusb_close(p->handle);
        forget_flying(p);
    }
    if (p->fd >= 0) close(p->fd);
    p->handle = NULL;
    p->fd = p->interface = p->told_interface = -1;
}

static int open_place(struct fv_usb_port *p, const struct fv_usb_place *place, const struct fv_imu_device *device,
                      struct fv_error *error)
{
    char what[80];
    snprintf(what, sizeof what, "%04x:%04x (%s)", place->vendor, place->product, device->name);
    p->fd = open_node(place, what, error);
    if (p->fd < 0) return -1;
    int failed = libusb_wrap_sys_device(p->usb, p->fd, &p->handle);
    if (failed) fv_error_set(error, "imu: %s cannot be opened: %s", what, libusb_strerror(failed));
    if (!failed) failed = open_endpoint(p, device, what, error);
    if (failed) close_device(p);
    return failed ? -1 : 0;
}

static void no_device(const struct fv_usb_port *p, struct fv_error *error)
{
    char known[256] = "";
    for (int i = 0; i < FV_IMU_DEVICES; i++) {
        const struct fv_imu_device *d = &fv_imu_devices[i];
        size_t used = strlen(known);
        if (d->vendor) snprintf(known + used, sizeof known - used, " %04x:%04x (%s)", d->vendor, d->product, d->name);
    }
    if (p->wish.vendor)
        fv_error_set(error, "imu: no USB device %04x:%04x is plugged in", p->wish.vendor, p->wish.product);
    else if (p->wish.serial[0])
        fv_error_set(error, "imu: no USB device of serial number '%s' is plugged in", p->wish.serial);
    else
        fv_error_set(error, "imu: no inertial sensor is plugged in; known are%s, any other by imu.device and imu.layout",
                     known);
}

enum { TO_INTERFACE = LIBUSB_REQUEST_TYPE_CLASS | LIBUSB_RECIPIENT_INTERFACE, FEATURE = 3, OUTPUT = 2, TIMEOUT_MS = 100 };

/* A feature report (HID 1.11, section 7.2.1); a headset that is busy stalls. Bytes, or less than 0. */
static int get_feature(struct fv_usb_port *p, int id, uint8_t *report, uint16_t bytes)
{
    enum { GET_REPORT = 1, TRIES = 50 };
    int got = LIBUSB_ERROR_PIPE;
    for (int i = 0; i < TRIES && (got == LIBUSB_ERROR_PIPE || got == 0); i++) {
        if (i > 0) fv_clock_sleep_until_ns(p->feed->clock, fv_clock_now_ns(p->feed->clock) + 5000000);
        got = libusb_control_transfer(p->handle, LIBUSB_ENDPOINT_IN | TO_INTERFACE, GET_REPORT,
                                      (uint16_t)(FEATURE << 8 | id), (uint16_t)p->interface, report, bytes, TIMEOUT_MS);
    }
    return got;
}

static int read_pieces(struct fv_usb_port *p, struct fv_factory_pieces *pieces, struct fv_error *error)
{
    uint8_t report[FV_FACTORY_PIECE_MAX];
    int more = 1, got = get_feature(p, FV_FACTORY_BEGIN, report, sizeof report);
    while (got >= 0 && more > 0) {
        got = get_feature(p, FV_FACTORY_PIECE, report, sizeof report);
        if (got >= 0) more = fv_factory_piece(pieces, report, (size_t)got, error);
    }
    return got < 0 ? fv_error_set(error, "%s", libusb_strerror(got)) : more;
}

/* Of the first device that is opened, for its reading allocates; kept for when that one comes again. */
static const struct fv_imu_calibration *calibration_of(struct fv_usb_port *p, const struct fv_usb_place *place,
                                                       const struct fv_imu_device *device)
{
    static struct fv_factory_pieces pieces;
    struct fv_error why;
    bool first = !p->opened;
    p->opened = true;
    if (!device->factory) return NULL;
    if (!first) return p->factory_serial[0] && strcmp(p->factory_serial, place->serial) == 0 ? &p->factory : NULL;
    if (read_pieces(p, &pieces, &why) || fv_factory_read(pieces.packed, pieces.bytes, &p->factory, &why)) {
        fv_log("imu: %s: no calibration of the factory's: %s; its readings are taken as they are", device->name, why.text);
        return NULL;
    }
    strcpy(p->factory_serial, place->serial);
    return &p->factory;
}

static int open_device(void *context, const struct fv_imu_device **device,
                       const struct fv_imu_calibration **calibration, struct fv_error *error)
{
    struct fv_usb_port *p = context;
    int count = fv_usb_list("", p->places);
    if (count < 0) return fv_error_set(error, "imu: no USB here: /sys/bus/usb/devices is not there");
    const struct fv_usb_place *place = fv_usb_choose(&p->wish, p->places, count);
    if (!place) {
        no_device(p, error);
        return 1;
    }
    *device = p->is_laid_out ? &p->laid_out : fv_imu_device_find(place->vendor, place->product);
    if (!*device)
        return fv_error_set(error, "imu: %04x:%04x is not known; imu.layout must say how its reports are laid out",
                            place->vendor, place->product);
    if (open_place(p, place, *device, error)) return -1;
    *calibration = calibration_of(p, place, *device);
    return 0;
}

static enum fv_imu_end end_of(enum libusb_transfer_status status)
{
    switch (status) {
    case LIBUSB_TRANSFER_COMPLETED: return FV_IMU_CAME;
    case LIBUSB_TRANSFER_STALL: return FV_IMU_STALLED;
    case LIBUSB_TRANSFER_OVERFLOW: return FV_IMU_TOO_LONG;
    case LIBUSB_TRANSFER_CANCELLED: return FV_IMU_CANCELLED;
    case LIBUSB_TRANSFER_NO_DEVICE: return FV_IMU_GONE;
    case LIBUSB_TRANSFER_ERROR:
    case LIBUSB_TRANSFER_TIMED_OUT: break;
    }
    return FV_IMU_FAILED;
}

static void LIBUSB_CALL ended(struct libusb_transfer *transfer)
{
    struct slot *s = transfer->user_data;
    s->flying = false;
    struct fv_imu_feed *feed = s->port->feed;
    size_t length = transfer->actual_length > 0 ? (size_t)transfer->actual_length : 0;
    fv_imu_feed_end(feed, s->number, end_of(transfer->status), s->bytes, length, fv_clock_now_ns(feed->clock));
}

static enum fv_imu_submitted submit(void *context, int transfer)
{
    struct fv_usb_port *p = context;
    struct slot *s = &p->slot[transfer];
    if (p->bulk)
        libusb_fill_bulk_transfer(s->transfer, p->handle, p->endpoint, s->bytes, p->length, ended, s, 0);
    else libusb_fill_interrupt_transfer(s->transfer, p->handle, p->endpoint, s->bytes, p->length, ended, s, 0);
    s->flying = true;
    int failed = libusb_submit_transfer(s->transfer);
    if (failed == 0) return FV_IMU_SUBMITTED;
    s->flying = false;
    return failed == LIBUSB_ERROR_NO_DEVICE ? FV_IMU_NO_DEVICE : FV_IMU_REFUSED;
}

static void cancel(void *context, int transfer)
{
    struct fv_usb_port *p = context;
    libusb_cancel_transfer(p->slot[transfer].transfer);
}

static int unstall(void *context)
{
    struct fv_usb_port *p = context;
    return libusb_clear_halt(p->handle, p->endpoint) ? -1 : 0;
}

/* As a class request to the interface, which every device takes whether it has an endpoint for output or not (HID 1.11,
 * section 7.2.2). What ends meanwhile is told as ever. */
static int tell(void *context, const struct fv_imu_command *c)
{
    enum { SET_REPORT = 9 };
    struct fv_usb_port *p = context;
    uint8_t report[FV_USB_REPORT_MAX] = {0};
    if (c->interface != p->interface && c->interface != p->told_interface) {
        if (libusb_claim_interface(p->handle, c->interface)) return -1;
        p->told_interface = c->interface;
    }
    memcpy(report, c->report, sizeof c->report);
    int value = (c->kind == FV_IMU_FEATURE ? FEATURE : OUTPUT) << 8 | c->report[0];
    int sent = libusb_control_transfer(p->handle, TO_INTERFACE, SET_REPORT, (uint16_t)value, (uint16_t)c->interface,
                                       report, (uint16_t)c->bytes, TIMEOUT_MS);
    return sent == c->bytes ? 0 : -1;
}

static void wait(void *context, int64_t until_ns)
{
    struct fv_usb_port *p = context;
    int64_t left_ns = until_ns - fv_clock_now_ns(p->feed->clock);
    if (left_ns < 0) left_ns = 0;
    struct timeval most = {.tv_sec = left_ns / 1000000000, .tv_usec = left_ns % 1000000000 / 1000};
    /* Signals and the like end it early; what does so for good must not make a busy loop. */
    if (libusb_handle_events_timeout_completed(p->usb, &most, NULL) < 0)
        fv_clock_sleep_until_ns(p->feed->clock, fv_clock_now_ns(p->feed->clock) + 10000000);
}

static int make_libusb(struct fv_usb_port *p, struct fv_error *error)
{
    fv_usb_memory_open();
    libusb_set_option(NULL, LIBUSB_OPTION_NO_DEVICE_DISCOVERY);
    int failed = libusb_init(&p->usb);
    if (failed)
        return fv_error_set(error, "imu: no USB here: libusb says '%s'%s", libusb_strerror(failed),
                            access("/dev/bus/usb", F_OK) ? ", and there is no /dev/bus/usb" : "");
    for (int i = 0; i < FV_IMU_TRANSFERS; i++) {
        p->slot[i].port = p;
        p->slot[i].number = i;
        p->slot[i].transfer = libusb_alloc_transfer(0);
        if (!p->slot[i].transfer) return fv_error_set(error, "imu: libusb has no memory for its transfers");
    }
    return 0;
}

int fv_usb_port_make(struct fv_usb_port **port, const struct fv_usb_wish *wish, const struct fv_imu_device *laid_out,
                     struct fv_error *error)
{
    struct fv_usb_port *p = fv_arena_take(fv_arena(), "usb", sizeof *p, 64);
    p->wish = *wish;
    p->is_laid_out = laid_out != NULL;
    if (laid_out) p->laid_out = *laid_out;
    p->fd = p->interface = p->told_interface = -1;
    p->port = (struct fv_imu_port){open_device, submit, cancel, unstall, tell, wait, close_device, p};
    if (make_libusb(p, error)) return -1;
    *port = p;
    return 0;
}

const struct fv_imu_port *fv_usb_port_for(struct fv_usb_port *p, struct fv_imu_feed *feed)
{
    p->feed = feed;
    return &p->port;
}
