/* eye_device: the camera (tests/support/fake_camera.h) of an eye that looks about. See devices.h. */
#define _GNU_SOURCE
#include "sensors/eye/image_sim.h"
#include "sensors/eye/tracker.h"
#include "tests/soak/devices.h"
#include "tests/soak/world.h"
#include "tests/support/fake_camera.h"

#include <fcntl.h>
#include <math.h>
#include <unistd.h>

enum { LOOKS = 64, PERIOD_NS = 1000000000 / EYE_HZ };

struct eye_faults eye_faults;
bool devices_leak;
static uint8_t look[LOOKS + 1][EYE_SIDE * EYE_SIDE]; /* the last: the lid is down */
static int64_t next_ns, frames;

int device_descriptor(void)
{
    return open("/dev/null", O_RDONLY | O_CLOEXEC);
}

/* The eye goes round, and comes back to where it was. */
static void draw(void)
{
    for (int i = 0; i <= LOOKS; i++) {
        struct fv_eye_camera camera = fv_eye_camera_usual(EYE_SIDE, EYE_SIDE, 1);
        struct fv_eye_state state = {.t_ns = i, .pupil_mm = 5.5, .open = i < LOOKS ? 1 : 0};
        double turn = 2 * M_PI * i / LOOKS, at_deg[2] = {6 * sin(turn), 4 * cos(turn)};
        camera.px_per_mm = 3;
        camera.leds = 0;
        fv_gaze_vector(at_deg, state.direction);
        state.direction[0] = -state.direction[0];
        fv_eye_image(&camera, &state, look[i], EYE_SIDE, NULL);
    }
}

void eye_device_plug(void)
{
    plug();
    assert_ptr_equal(fake_io.context, &fake);
    draw();
    memset(&eye_faults, 0, sizeof eye_faults);
}

int eye_device_opened(void)
{
    return fake.opened;
}

int eye_device_mapped(void)
{
    return fake.mapped;
}

static void spoil(struct v4l2_buffer *b)
{
    if (eye_faults.flagged > 0) eye_faults.flagged--, b->flags |= V4L2_BUF_FLAG_ERROR;
    else if (eye_faults.shorted > 0) eye_faults.shorted--, b->bytesused /= 2;
    else if (eye_faults.untimed > 0) eye_faults.untimed--, b->timestamp.tv_sec += 1700000000;
    else if (eye_faults.odd > 0) {
        /* A stray event beside a sound one: the buffer itself comes as well. */
        eye_faults.odd--;
        fake.waiting[fake.waits] = *b;
        fake.waiting[fake.waits++].index = 77;
    }
}

/* What the driver has filled until now. */
static void fill_until(int64_t now)
{
    for (; fake.streaming && next_ns <= now; next_ns += PERIOD_NS, frames++) {
        if (eye_faults.silent || eye_faults.gone) continue;
        if (eye_faults.dropped > 0) {
            eye_faults.dropped--;
            fake.sequence++;
            continue;
        }
        if (fake.waits + 1 >= FV_CAMERA_BUFFERS_MAX) continue;
        struct v4l2_buffer *b = fills(0, next_ns, V4L2_BUF_FLAG_TSTAMP_SRC_SOE);
        if (!b) {
            fake.sequence++;
            continue;
        }
        memcpy(fake.memory[b->index], look[eye_faults.shut ? LOOKS : frames % LOOKS], sizeof look[0]);
        spoil(b);
    }
}

static int eye_open(void *context, const char *path)
{
    fake.t_ns = world_now_ns();
    fake.plugged = !eye_faults.gone;
    int fd = fake_open(context, path);
    return fd < 0 ? fd : device_descriptor();
}

static void eye_close(void *context, int fd)
{
    fake_close(context, 7);
    if (!devices_leak) close(fd);
}

static int eye_control(void *context, int fd, unsigned long request, void *argument)
{
    (void)fd;
    fake.t_ns = world_now_ns();
    fake.plugged = !eye_faults.gone;
    fake.width = fake.height = eye_faults.larger ? 2 * EYE_SIDE : 0; /* 0: as is asked for */
    if (request == VIDIOC_DQBUF && eye_faults.failing > 0 && fake.plugged) {
        eye_faults.failing--;
        return -EIO;
    }
    int result = fake_control(context, 7, request, argument);
    if (request == VIDIOC_STREAMON && result >= 0) next_ns = fake.t_ns + PERIOD_NS;
    return result;
}

static void *eye_map(void *context, int fd, size_t bytes, uint64_t offset)
{
    (void)fd;
    return fake_map(context, 7, bytes, offset);
}

static void eye_wait(void *context, const int *fd, unsigned *ready, int devices, int64_t timeout_ns)
{
    int64_t now = world_now_ns(), until_ns = now + timeout_ns;
    bool streams = fd[0] >= 0 && fake.streaming;
    (void)context;
    assert_int_equal(devices, 1);
    if (streams && next_ns < until_ns) until_ns = next_ns;
    if (streams && (fake.waits > 0 || eye_faults.gone)) until_ns = now;
    world_wait_ns(until_ns > now ? until_ns : now + 1000);
    fill_until(world_now_ns());
    ready[0] = 0;
    if (fd[0] < 0) return;
    if (eye_faults.gone) ready[0] = FV_CAMERA_BROKEN;
    else if (fake.waits > 0) ready[0] = FV_CAMERA_READABLE;
}

static int64_t eye_now_ns(void *context)
{
    (void)context;
    return world_now_ns();
}

/* In the place of v4l2_system.c's. */
const struct fv_camera_io fv_camera_system = {eye_open, eye_close, eye_control, eye_map, fake_unmap, eye_wait, eye_now_ns, &fake};
