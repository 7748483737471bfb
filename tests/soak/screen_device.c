/* screen_device: the display (tests/support/fake_drm.h). See devices.h. */
#define _GNU_SOURCE
#include "tests/soak/devices.h"
#include "tests/soak/world.h"
#include "tests/support/fake_drm.h"

#include <unistd.h>

void screen_device_plug(void)
{
    fake_plug();
    assert_ptr_equal(fake_io.control, fake_control);
    fake.modes = 1;
    fake.mode[0] = fake_mode(64, 32, SCREEN_HZ, DRM_MODE_TYPE_PREFERRED);
    /* As the mode's own numbers have it. */
    fake.period_ns = 1000000 * (int64_t)fake.mode[0].htotal * fake.mode[0].vtotal / fake.mode[0].clock;
    fake.crtc[0].mode = fake.mode[0];
    fake.t_ns = fake.begun_ns = world_now_ns();
}

void screen_device_held(struct devices_held *held)
{
    held->screen_open = fake.opened;
    held->screen_mapped = fake.mapped;
    held->screen_blobs = fake.blobs;
}

void screen_lose(enum screen_loss how)
{
    fake.card = how != SCREEN_CARD_GONE;
    fake.connected[0] = fake.connected[1] = how != SCREEN_UNPLUGGED;
    fake.silent = how == SCREEN_SILENT;
    fake.master = how == SCREEN_TAKEN ? EBUSY : 0;
    fake.flip_fails = how == SCREEN_CARD_GONE ? ENODEV : how == SCREEN_TAKEN ? EACCES : how == SCREEN_REFUSES ? EINVAL : 0;
    fake.read_fails = how == SCREEN_CARD_GONE ? ENODEV : how == SCREEN_UNREADABLE ? EIO : 0;
    fake.open_fails = how == SCREEN_UNREADABLE ? EIO : 0;
    fake.mode_fails = how == SCREEN_REFUSES ? EIO : 0;
}

void screen_busy(int times)
{
    fake.busy = times;
}

static int screen_open(void *context, const char *path)
{
    fake.t_ns = world_now_ns();
    int fd = fake_open(context, path);
    return fd < 0 ? fd : device_descriptor();
}

static void screen_close(void *context, int fd)
{
    fake_close(context, 7);
    close(fd);
}

static int screen_control(void *context, int fd, unsigned long request, void *argument)
{
    (void)fd;
    fake.t_ns = world_now_ns();
    return fake_control(context, 7, request, argument);
}

static int screen_read(void *context, int fd, void *bytes, size_t size)
{
    fake.t_ns = world_now_ns();
    return fake_read(context, fd, bytes, size);
}

static void screen_wait(void *context, int fd, int64_t timeout_ns)
{
    int64_t until_ns = world_now_ns() + timeout_ns;
    (void)context, (void)fd;
    if (fake.events && fake.event[0].due_ns < until_ns) until_ns = fake.event[0].due_ns;
    world_wait_ns(until_ns);
}

static int64_t screen_now_ns(void *context)
{
    (void)context;
    return world_now_ns();
}

/* In the place of kms_system.c's. */
const struct fv_kms_io fv_kms_system = {screen_open, screen_close, screen_control, fake_map,      fake_unmap,
                                        screen_read, screen_wait,  fake_console,   screen_now_ns, NULL};

void devices_plug(void)
{
    eye_device_plug();
    imu_device_plug();
    screen_device_plug();
}

struct devices_held devices_held(void)
{
    struct devices_held held = {.eye_open = eye_device_opened(), .eye_mapped = eye_device_mapped(), .imu_open = imu_device_open()};
    screen_device_held(&held);
    return held;
}
