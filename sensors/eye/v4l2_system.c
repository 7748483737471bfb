/* v4l2_system: the system calls behind struct fv_camera_io. */
#define _GNU_SOURCE
#include "sensors/eye/v4l2.h"

#include "platform/device.h"

#include <assert.h>
#include <errno.h>
#include <poll.h>
#include <stdint.h>
#include <sys/ioctl.h>
#include <time.h>

enum { DEVICES_MAX = 4 };

static int system_control(void *context, int fd, unsigned long request, void *argument)
{
    int result;
    (void)context;
    do result = ioctl(fd, request, argument);
    while (result < 0 && errno == EINTR);
    return result < 0 ? -errno : result;
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

const struct fv_camera_io fv_camera_system = {fv_device_open,  fv_device_close, system_control,   fv_device_map,
                                              fv_device_unmap, system_wait,     fv_device_now_ns, NULL};
