/* device: see device.h. */
#define _GNU_SOURCE
#include "platform/device.h"

#include "platform/clock.h"

#include <errno.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

int fv_device_open(void *context, const char *path)
{
    (void)context;
    int fd = open(path, O_RDWR | O_NONBLOCK | O_CLOEXEC);
    return fd < 0 ? -errno : fd;
}

void fv_device_close(void *context, int fd)
{
    (void)context;
    close(fd);
}

void *fv_device_map(void *context, int fd, size_t bytes, uint64_t offset)
{
    (void)context;
    long at = syscall(SYS_mmap, NULL, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, fd, (off_t)offset);
    return at == -1 ? NULL : (void *)(intptr_t)at;
}

void fv_device_unmap(void *context, void *at, size_t bytes)
{
    (void)context;
    syscall(SYS_munmap, at, bytes);
}

int64_t fv_device_now_ns(void *context)
{
    (void)context;
    return fv_clock_now_ns(&fv_clock_monotonic);
}
