/* device: device files by system calls, in the form that the ports of displays and cameras take them (display/kms.h,
 * sensors/eye/v4l2.h); `context` is not used. From any thread. */
#ifndef FV_PLATFORM_DEVICE_H
#define FV_PLATFORM_DEVICE_H

#include <stddef.h>
#include <stdint.h>

/* For reading and writing, without waiting. Below 0: -errno. */
int fv_device_open(void *context, const char *path);
void fv_device_close(void *context, int fd);

/* The driver's memory, not ours: past the heap, which knows none but its own, also when a device comes back after the
 * seal. NULL: refused. */
void *fv_device_map(void *context, int fd, size_t bytes, uint64_t offset);
void fv_device_unmap(void *context, void *at, size_t bytes);

/* Of the monotonic clock. */
int64_t fv_device_now_ns(void *context);

#endif
