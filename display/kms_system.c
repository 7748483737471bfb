/* kms_system: the system calls behind struct fv_kms_io. Buffers are the driver's memory, not ours: they are mapped past
 * the heap, which knows none but its own, also when a display comes back after the seal.
 *
 * The console: in graphics mode the kernel's text console does not draw over us and does not switch to another one;
 * where there is none, or it may not be opened, nothing is lost but that. It is given back as text: where it was in graphics
 * mode before, whoever drew there is gone, most likely killed, for the display could be taken. It stays open: giving it back
 * is the one call that each thread may make (platform/sandbox_filter.c), and a signal's handler (platform/faults.h). */
#define _GNU_SOURCE
#include "display/kms.h"

#include "platform/clock.h"

#include <errno.h>
#include <fcntl.h>
#include <linux/kd.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

static int system_open(void *context, const char *path)
{
    (void)context;
    int fd = open(path, O_RDWR | O_NONBLOCK | O_CLOEXEC);
    return fd < 0 ? -errno : fd;
}

static void system_close(void *context, int fd)
{
    (void)context;
    close(fd);
}

static int system_control(void *context, int fd, unsigned long request, void *argument)
{
    int result;
    (void)context;
    do result = ioctl(fd, request, argument);
    while (result < 0 && (errno == EINTR || errno == EAGAIN));
    return result < 0 ? -errno : result;
}

static void *system_map(void *context, int fd, size_t bytes, uint64_t offset)
{
    (void)context;
    long at = syscall(SYS_mmap, NULL, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, fd, (off_t)offset);
    return at == -1 ? NULL : (void *)(intptr_t)at;
}

static void system_unmap(void *context, void *at, size_t bytes)
{
    (void)context;
    syscall(SYS_munmap, at, bytes);
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

static int64_t system_now_ns(void *context)
{
    (void)context;
    return fv_clock_now_ns(&fv_clock_monotonic);
}

const struct fv_kms_io fv_kms_system = {system_open,  system_close, system_control, system_map,    system_unmap,
                                        system_read,  system_wait,  system_console, system_now_ns, NULL};
