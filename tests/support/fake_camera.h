/* fake_camera: a made-up camera behind struct fv_camera_io, on a made-up clock: what it offers, gives and
 * does wrong is set by the test. For tests only. */
#ifndef FV_TESTS_FAKE_CAMERA_H
#define FV_TESTS_FAKE_CAMERA_H

#include "sensors/eye/v4l2.h"
#include "tests/support/program.h"

#include <errno.h>
#include <linux/videodev2.h>

enum { FAKE_SIDE = 64, FAKE_BUFFER = 4 * FAKE_SIDE * FAKE_SIDE };

/* The device: what it offers, what it does wrong, and what it was asked. */
static struct fake {
    bool plugged;
    uint32_t offered[8], given, buffers, capabilities, width, height, stride, image;
    double hz[4];
    int64_t t_ns;
    uint8_t memory[FV_CAMERA_BUFFERS_MAX][FAKE_BUFFER];
    bool queued[FV_CAMERA_BUFFERS_MAX], streaming, busy, broken;
    int opened, mapped, fail_dequeue, fail_queue, fail_start; /* errno to give; 0: none */
    struct v4l2_buffer waiting[FV_CAMERA_BUFFERS_MAX];
    int waits;
    uint32_t sequence, rate; /* rate: of the last S_PARM */
} fake;

static inline int fake_open(void *context, const char *path)
{
    struct fake *f = context;
    assert_string_equal(path, "/dev/eye");
    if (!f->plugged) return -ENOENT;
    f->opened++;
    return 7;
}

static inline void fake_close(void *context, int fd)
{
    struct fake *f = context;
    assert_int_equal(fd, 7);
    f->opened--;
    f->streaming = false;
    f->waits = 0;
    memset(f->queued, 0, sizeof f->queued);
}

static inline void fill(const struct fake *f, struct v4l2_pix_format *pix)
{
    if (f->width) pix->width = f->width, pix->height = f->height;
    if (f->given) pix->pixelformat = f->given;
    const struct fv_camera_format *format = fv_camera_format_of(pix->pixelformat);
    pix->bytesperline = f->stride ? f->stride : pix->width * (uint32_t)(format ? format->step : 1);
    pix->sizeimage =
        f->image ? f->image : pix->bytesperline * pix->height * (format && format->halves ? 3 : 2) / 2;
}

static inline int enum_rate(const struct fake *f, struct v4l2_frmivalenum *e)
{
    if (e->index >= 4 || f->hz[e->index] == 0) return -EINVAL;
    e->type = V4L2_FRMIVAL_TYPE_DISCRETE;
    e->discrete = (struct v4l2_fract){1000, (uint32_t)(1000 * f->hz[e->index])};
    return 0;
}

static inline int dequeue(struct fake *f, struct v4l2_buffer *b)
{
    if (f->fail_dequeue) return -f->fail_dequeue;
    if (f->waits == 0) return -EAGAIN;
    *b = f->waiting[0];
    if (b->index < f->buffers) f->queued[b->index] = false;
    memmove(f->waiting, f->waiting + 1, sizeof f->waiting[0] * (size_t)--f->waits);
    return 0;
}

static inline int queue(struct fake *f, const struct v4l2_buffer *b)
{
    if (f->fail_queue) return -f->fail_queue;
    assert_true(b->index < f->buffers && !f->queued[b->index]);
    f->queued[b->index] = true;
    return 0;
}

static inline int request_buffers(struct fake *f, struct v4l2_requestbuffers *r)
{
    if (f->busy && r->count) return -EBUSY;
    if (r->count) r->count = f->buffers;
    else assert_int_equal(f->mapped, 0);
    return 0;
}

static inline int query_buffer(const struct fake *f, struct v4l2_buffer *b)
{
    if (b->index >= f->buffers) return -EINVAL;
    b->length = FAKE_BUFFER;
    b->m.offset = b->index * FAKE_BUFFER;
    return 0;
}

static inline int fake_control(void *context, int fd, unsigned long request, void *argument)
{
    struct fake *f = context;
    assert_int_equal(fd, 7);
    if (!f->plugged) return -ENODEV;
    switch (request) {
    case VIDIOC_QUERYCAP:
        ((struct v4l2_capability *)argument)->capabilities = f->capabilities;
        strcpy((char *)((struct v4l2_capability *)argument)->card, "made up");
        return 0;
    case VIDIOC_ENUM_FMT: {
        struct v4l2_fmtdesc *d = argument;
        if (d->index >= 8 || !f->offered[d->index]) return -EINVAL;
        d->pixelformat = f->offered[d->index];
        return 0;
    }
    case VIDIOC_TRY_FMT:
    case VIDIOC_S_FMT:
        if (f->busy && request == VIDIOC_S_FMT) return -EBUSY;
        fill(f, &((struct v4l2_format *)argument)->fmt.pix);
        return 0;
    case VIDIOC_ENUM_FRAMEINTERVALS: return enum_rate(f, argument);
    case VIDIOC_S_PARM: {
        const struct v4l2_fract *t = &((struct v4l2_streamparm *)argument)->parm.capture.timeperframe;
        f->rate = t->denominator / t->numerator;
        return 0;
    }
    case VIDIOC_REQBUFS: return request_buffers(f, argument);
    case VIDIOC_QUERYBUF: return query_buffer(f, argument);
    case VIDIOC_QBUF: return queue(f, argument);
    case VIDIOC_DQBUF: return dequeue(f, argument);
    case VIDIOC_STREAMON: f->streaming = true; return -f->fail_start;
    case VIDIOC_STREAMOFF: f->streaming = false; return 0;
    default: return -ENOTTY;
    }
}

static inline void *fake_map(void *context, int fd, size_t bytes, uint64_t offset)
{
    struct fake *f = context;
    (void)fd;
    assert_int_equal(bytes, FAKE_BUFFER);
    f->mapped++;
    return f->memory[offset / FAKE_BUFFER];
}

static inline void fake_unmap(void *context, void *at, size_t bytes)
{
    struct fake *f = context;
    (void)at, (void)bytes;
    f->mapped--;
}

static inline int64_t fake_now(void *context)
{
    return ((struct fake *)context)->t_ns;
}

static const struct fv_camera_io fake_io = {fake_open,  fake_close, fake_control, fake_map,
                                            fake_unmap, NULL,       fake_now,     &fake};
/* A sound camera: GREY, 64x64, 120 Hz. */
static inline void plug(void)
{
    memset(&fake, 0, sizeof fake);
    fake.plugged = true;
    fake.offered[0] = V4L2_PIX_FMT_MJPEG;
    fake.offered[1] = V4L2_PIX_FMT_GREY;
    fake.hz[0] = 30, fake.hz[1] = 120, fake.hz[2] = 60;
    fake.buffers = FV_CAMERA_BUFFERS;
    fake.capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
    fake.t_ns = 5000000000;
}

/* The driver fills a buffer with `value`; NULL where none is queued. */
static inline struct v4l2_buffer *fills(int value, int64_t stamp_ns, uint32_t source)
{
    for (uint32_t i = 0; i < fake.buffers; i++) {
        if (!fake.queued[i]) continue;
        struct v4l2_buffer *b = &fake.waiting[fake.waits++];
        fake.queued[i] = false;
        memset(fake.memory[i], value, FAKE_BUFFER);
        *b =
            (struct v4l2_buffer){.index = i, .bytesused = FAKE_SIDE * FAKE_SIDE, .sequence = fake.sequence++};
        b->flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | source;
        b->timestamp.tv_sec = stamp_ns / 1000000000;
        b->timestamp.tv_usec = stamp_ns % 1000000000 / 1000;
        return b;
    }
    return NULL;
}

#endif
