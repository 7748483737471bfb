/* kms_system: the system calls behind struct fv_kms_io.
 *
 * The console: in graphics mode the kernel's text console does not draw over us and does not switch to another one;
 * where there is none, or it may not be opened, nothing is lost but that. It is given back as text: where it was in graphics
 * mode before, whoever drew there is gone, most likely killed, for the display could be taken. It stays open: giving it back
 * is the one call that each thread may make (platform/sandbox_filter.c), and a signal's handler (platform/faults.h). */
#define _GNU_SOURCE
#include "display/kms.h"

#include "platform/device.h"

#include <errno.h>
#include <fcntl.h>
#include <linux/kd.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <time.h>
#include <unistd.h>

static int system_control(void *context, int fd, unsigned long request, void *argument)
{
    int result;
    (void)context;
    do result = ioctl(fd, request, argument);
    while (result < 0 && (errno == EINTR || errno == EAGAIN));
    return result < 0 ? -errno : result;
}

static int system_read(void *context, int fd, void *bytes, size_t size)
{
    (void)context;
    ssize_t n = read(fd, bytes, size);
    return n < 0 ? (errno == EINTR ? -EAGAIN : -errno) : (int)n;
}

static void system_wait(void *context, int fd, int64_t timeout_ns)
{
    (void)context;
    if (timeout_ns < 0) timeout_ns = 0;
    struct timespec timeout = {timeout_ns / 1000000000, timeout_ns % 1000000000};
    struct pollfd readable = {.fd = fd, .events = POLLIN};
    ppoll(&readable, 1, &timeout, NULL);
}

static void system_console(void *context, bool graphics)
{
    static int tty = -1;
    (void)context;
    if (!graphics && tty >= 0) ioctl(tty, KDSETMODE, KD_TEXT);
    if (!graphics) return;
    if (tty < 0) tty = open("/dev/tty0", O_RDWR | O_NOCTTY | O_CLOEXEC);
    if (tty < 0 || ioctl(tty, KDSETMODE, KD_GRAPHICS) == 0) return;
    close(tty);
    tty = -1;
}

const struct fv_kms_io fv_kms_system = {fv_device_open, fv_device_close, system_control, fv_device_map,    fv_device_unmap,
                                        system_read,    system_wait,     system_console, fv_device_now_ns, NULL};
