/* v4l2_system: the system calls behind struct fv_camera_io. Buffers are the driver's memory, not ours: they
 * are mapped past the heap, which knows none but its own, also when a camera comes back after the seal. */
#define _GNU_SOURCE
#include "sensors/eye/v4l2.h"

#include "platform/clock.h"

#include <assert.h>
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdint.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

enum { DEVICES_MAX = 4 };

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
    while (result < 0 && errno == EINTR);
    return result < 0 ? -errno : result;
}

static void *system_map(void *context, int fd, size_t bytes, uint32_t offset)
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

static void system_wait(void *context, const int *fd, unsigned *ready, int devices, int64_t timeout_ns)
{
    struct pollfd poll_fd[DEVICES_MAX];
    (void)context;
    assert(devices <= DEVICES_MAX);
    if (timeout_ns < 0) timeout_ns = 0;
    struct timespec timeout = {timeout_ns / 1000000000, timeout_ns % 1000000000};
    for (int i = 0; i < devices; i++) {
        poll_fd[i] = (struct pollfd){.fd = fd[i], .events = POLLIN};
        ready[i] = 0;
    }
    if (ppoll(poll_fd, (nfds_t)devices, &timeout, NULL) <= 0) return;
    for (int i = 0; i < devices; i++) {
        if (poll_fd[i].revents & (POLLIN | POLLPRI)) ready[i] |= FV_CAMERA_READABLE;
        if (poll_fd[i].revents & (POLLERR | POLLHUP | POLLNVAL)) ready[i] |= FV_CAMERA_BROKEN;
    }
}

static int64_t system_now_ns(void *context)
{
    (void)context;
    return fv_clock_now_ns(&fv_clock_monotonic);
}

const struct fv_camera_io fv_camera_system = {system_open,  system_close, system_control, system_map,
                                              system_unmap, system_wait,  system_now_ns,  NULL};
