/* v4l2: buffers and frames of a camera, and what becomes of its faults. See the header.
 *
 * Every way in which streaming can fail ends in lose(): all is closed, and opened anew after a pause that
 * grows from 0.1 to 1 s until a good frame has come. Single bad frames are counted and go back to the driver.
 */
#include "sensors/eye/v4l2.h"

#include <errno.h>
#include <linux/videodev2.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

static const int64_t pause_least_ns = 100000000, pause_most_ns = 1000000000, stall_least_ns = 1000000000;
/* Time stamps may be this far ahead of our clock, and this old. */
static const int64_t ahead_ns = 2000000, old_ns = 1000000000;
enum { FAILURES_MAX = 8 /* in a row */, BUFFERS_LEAST = 2 };

static int control(const struct fv_camera *c, unsigned long request, void *argument)
{
    return c->io->control(c->io->context, c->fd, request, argument);
}

static int64_t now(const struct fv_camera *c)
{
    return c->io->now_ns(c->io->context);
}

static struct v4l2_buffer buffer_of(uint32_t index)
{
    return (struct v4l2_buffer){
        .index = index, .type = V4L2_BUF_TYPE_VIDEO_CAPTURE, .memory = V4L2_MEMORY_MMAP};
}

/* Gives a buffer to the driver. */
static int queue(struct fv_camera *c, uint32_t index)
{
    struct v4l2_buffer b = buffer_of(index);
    int failed = control(c, VIDIOC_QBUF, &b);
    if (failed < 0) return failed;
    c->buffer[index].queued = true;
    c->queued++;
    return 0;
}

void fv_camera_close(struct fv_camera *c)
{
    if (c->fd < 0) return;
    int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    struct v4l2_requestbuffers none = {.type = V4L2_BUF_TYPE_VIDEO_CAPTURE, .memory = V4L2_MEMORY_MMAP};
    if (c->streaming) control(c, VIDIOC_STREAMOFF, &type);
    for (int i = 0; i < c->buffers; i++)
        if (c->buffer[i].at) c->io->unmap(c->io->context, c->buffer[i].at, c->buffer[i].bytes);
    if (c->buffers > 0) control(c, VIDIOC_REQBUFS, &none);
    c->io->close(c->io->context, c->fd);
    memset(c->buffer, 0, sizeof c->buffer);
    c->buffers = c->queued = 0;
    c->streaming = false;
    c->fd = -1;
}

static int map_buffers(struct fv_camera *c, struct fv_error *error)
{
    struct v4l2_requestbuffers request = {
        .count = FV_CAMERA_BUFFERS, .type = V4L2_BUF_TYPE_VIDEO_CAPTURE, .memory = V4L2_MEMORY_MMAP};
    int failed = control(c, VIDIOC_REQBUFS, &request);
    if (failed < 0)
        return fv_error_set(error, "%s: gives no buffers: %s", c->settings.path, strerror(-failed));
    if (request.count < BUFFERS_LEAST)
        return fv_error_set(error, "%s: gives %u buffers, %d are needed", c->settings.path, request.count,
                            (int)BUFFERS_LEAST);
    /* A driver may give more than asked for; what is not queued is not used. */
    int count = request.count < FV_CAMERA_BUFFERS_MAX ? (int)request.count : FV_CAMERA_BUFFERS_MAX;
    size_t bytes = fv_camera_frame_bytes(&c->layout);
    for (c->buffers = 0; c->buffers < count;) {
        struct v4l2_buffer b = buffer_of((uint32_t)c->buffers);
        failed = control(c, VIDIOC_QUERYBUF, &b);
        if (failed < 0)
            return fv_error_set(error, "%s: buffer %d: %s", c->settings.path, c->buffers, strerror(-failed));
        if (b.length < bytes)
            return fv_error_set(error, "%s: buffers of %u bytes hold no frame of %zu", c->settings.path,
                                b.length, bytes);
        void *at = c->io->map(c->io->context, c->fd, b.length, b.m.offset);
        if (!at) return fv_error_set(error, "%s: buffer %d cannot be mapped", c->settings.path, c->buffers);
        c->buffer[c->buffers].at = at;
        c->buffer[c->buffers].bytes = b.length;
        c->buffers++;
    }
    return 0;
}

/* From a path to a stream; on failure all is closed again. */
static int start(struct fv_camera *c, struct fv_error *error)
{
    int type = V4L2_BUF_TYPE_VIDEO_CAPTURE, failed = 0;
    c->fd = c->io->open(c->io->context, c->settings.path);
    c->there = c->fd >= 0;
    if (!c->there) return fv_error_set(error, "%s: %s", c->settings.path, strerror(-c->fd));
    if (fv_camera_negotiate(c, error)) goto failure;
    if (c->grey && fv_camera_grey_bytes(c) > c->capacity) {
        fv_error_set(error, "%s: came back with larger frames (%dx%d), for which no memory was taken",
                     c->settings.path, c->layout.width, c->layout.height);
        goto failure;
    }
    if (map_buffers(c, error)) goto failure;
    for (int i = 0; i < c->buffers && failed >= 0; i++) failed = queue(c, (uint32_t)i);
    if (failed >= 0) failed = control(c, VIDIOC_STREAMON, &type);
    if (failed < 0) {
        fv_error_set(error, "%s: does not begin to stream: %s", c->settings.path, strerror(-failed));
        goto failure;
    }
    c->streaming = true;
    c->numbered = false;
    c->failures = 0;
    c->alive_ns = now(c);
    return 0;
failure:
    fv_camera_close(c);
    c->fd = -1;
    return -1;
}

int fv_camera_open(struct fv_camera *c, const struct fv_camera_settings *settings,
                   const struct fv_camera_io *io, struct fv_error *error)
{
    *c = (struct fv_camera){.settings = *settings, .io = io, .fd = -1, .pause_ns = pause_least_ns};
    c->newest_ns = INT64_MIN;
    return start(c, error);
}

size_t fv_camera_grey_bytes(const struct fv_camera *c)
{
    return (size_t)c->layout.width * (size_t)c->layout.height;
}

void fv_camera_lend(struct fv_camera *c, uint8_t *grey, size_t capacity)
{
    c->grey = grey;
    c->capacity = capacity;
}

static int64_t stall_ns(const struct fv_camera *c)
{
    double slow = c->hz > 0 ? 8e9 / c->hz : 0; /* time lapse cameras */
    return slow > (double)stall_least_ns ? (int64_t)fmin(slow, 60e9) : stall_least_ns;
}

int64_t fv_camera_due_ns(const struct fv_camera *c)
{
    return c->fd < 0 ? c->retry_ns : c->alive_ns + stall_ns(c);
}

/* Closes, and says so the first time. */
static enum fv_camera_event lose(struct fv_camera *c, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
static enum fv_camera_event lose(struct fv_camera *c, const char *format, ...)
{
    bool first = !c->missing;
    fv_camera_close(c);
    c->retry_ns = now(c) + c->pause_ns;
    c->pause_ns = c->pause_ns < pause_most_ns / 2 ? 2 * c->pause_ns : pause_most_ns;
    c->missing = true;
    if (!first) return FV_CAMERA_NOTHING;
    c->counts.lost++;
    char why[160];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(why, sizeof why, format, arguments);
    va_end(arguments);
    snprintf(c->text, sizeof c->text, "%.200s: lost (%s); looked for again until it is back",
             c->settings.path, why);
    return FV_CAMERA_LOST;
}

/* Opens a camera that was lost; one that is there but cannot be used is said once. */
static enum fv_camera_event look_again(struct fv_camera *c)
{
    struct fv_error error;
    int64_t begun_ns = now(c);
    if (start(c, &error) == 0) return FV_CAMERA_NOTHING;
    int64_t took_ns = now(c) - begun_ns;
    lose(c, "%s", error.text);
    /* One that answers late must not keep the other eye's camera waiting for more than a twentieth of the time. */
    if (took_ns > 0 && took_ns < INT64_MAX / 40 && 20 * took_ns > c->retry_ns - now(c)) c->retry_ns = now(c) + 20 * took_ns;
    if (!c->there || c->unusable) return FV_CAMERA_NOTHING;
    c->unusable = true;
    snprintf(c->text, sizeof c->text, "%s", error.text);
    return FV_CAMERA_LOST;
}

/* The middle of the exposure, by the kernel's time stamp where it is one of our clock. */
static int64_t middle_ns(struct fv_camera *c, const struct v4l2_buffer *b, int64_t now_ns)
{
    int64_t half = c->settings.exposure_ns / 2;
    /* A driver that does not say which clock it is gives this one or the time of day, which the range rules out. */
    bool ours = (b->flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) != V4L2_BUF_FLAG_TIMESTAMP_COPY;
    bool sane = b->timestamp.tv_sec >= 0 && b->timestamp.tv_sec < INT64_C(4000000000) &&
                b->timestamp.tv_usec >= 0 && b->timestamp.tv_usec < 1000000;
    if (ours && sane) {
        int64_t stamp_ns = (int64_t)b->timestamp.tv_sec * 1000000000 + (int64_t)b->timestamp.tv_usec * 1000;
        bool begun = (b->flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
        int64_t t_ns = begun ? stamp_ns + half : stamp_ns - half;
        if (stamp_ns <= now_ns + ahead_ns && stamp_ns >= now_ns - old_ns && t_ns > c->newest_ns)
            return t_ns < now_ns ? t_ns : now_ns;
    }
    c->counts.untimed++;
    return now_ns - half;
}

/* Whether a frame is whole; counts what is wrong with it. */
static bool is_good(struct fv_camera *c, const struct v4l2_buffer *b)
{
    if (b->flags & V4L2_BUF_FLAG_ERROR) c->counts.flagged++;
    else if (b->bytesused > c->buffer[b->index].bytes) c->counts.corrupt++;
    else if (b->bytesused < fv_camera_frame_bytes(&c->layout)) c->counts.shorted++;
    else return true;
    return false;
}

/* Gives the driver what it has refused before: a refusal may be of that moment. */
static void give_back(struct fv_camera *c)
{
    for (int i = 0; c->queued < c->buffers && i < c->buffers; i++)
        if (!c->buffer[i].queued && queue(c, (uint32_t)i) < 0) c->counts.errors++;
}

/* Frames that never came, by the numbers; numbers that go back are a new count. */
static void count_gap(struct fv_camera *c, uint32_t sequence)
{
    uint32_t gap = sequence - c->sequence - 1;
    if (c->numbered && gap < 1u << 16) c->counts.gaps += gap;
    c->sequence = sequence;
    c->numbered = true;
}

/* Takes all that waits. Returns the newest good one in `newest`, not yet given back; < 0: -errno of what
 * ended it. */
static int drain(struct fv_camera *c, struct v4l2_buffer *newest, bool *any)
{
    *any = false;
    for (int i = 0; i < 2 * FV_CAMERA_BUFFERS_MAX; i++) {
        struct v4l2_buffer b = buffer_of(0);
        int failed = control(c, VIDIOC_DQBUF, &b);
        if (failed < 0) return failed;
        if (b.index >= (uint32_t)c->buffers || !c->buffer[b.index].queued) {
            c->counts.corrupt++;
            if (++c->failures >= FAILURES_MAX) return -EIO;
            continue;
        }
        c->buffer[b.index].queued = false;
        c->queued--;
        count_gap(c, b.sequence);
        uint32_t back = b.index;
        if (is_good(c, &b)) {
            if (*any) c->counts.skipped++;
            back = newest->index;
            bool first = !*any;
            *newest = b;
            *any = true;
            if (first) continue;
        }
        if ((failed = queue(c, back)) < 0) c->counts.errors++;
    }
    return -EAGAIN;
}

static enum fv_camera_event give_out(struct fv_camera *c, const struct v4l2_buffer *b, int64_t now_ns,
                                     struct fv_camera_frame *frame)
{
    enum fv_camera_event event = c->missing ? FV_CAMERA_BACK : FV_CAMERA_FRAME;
    size_t width = (size_t)c->layout.width;
    /* Buffers are as large as negotiated and the frame is whole: this cannot fail. */
    bool done = fv_camera_decode(&c->layout, c->buffer[b->index].at, b->bytesused, c->grey, width);
    if (queue(c, b->index) < 0) c->counts.errors++;
    if (!done) return FV_CAMERA_NOTHING;
    frame->grey = (struct fv_eye_frame){c->grey, c->layout.width, c->layout.height, (ptrdiff_t)width};
    frame->t_ns = middle_ns(c, b, now_ns);
    if (frame->t_ns <= c->newest_ns) frame->t_ns = c->newest_ns + 1;
    frame->arrived_ns = now_ns;
    c->newest_ns = frame->t_ns;
    c->alive_ns = now_ns;
    c->failures = 0;
    c->pause_ns = pause_least_ns;
    c->missing = c->unusable = false;
    c->counts.frames++;
    c->counts.restarts += event == FV_CAMERA_BACK;
    return event;
}

enum fv_camera_event fv_camera_step(struct fv_camera *c, unsigned ready, struct fv_camera_frame *frame)
{
    int64_t now_ns = now(c);
    struct v4l2_buffer newest = {0};
    bool any = false;
    if (c->fd < 0) return now_ns >= c->retry_ns ? look_again(c) : FV_CAMERA_NOTHING;
    give_back(c);
    int failed = ready ? drain(c, &newest, &any) : -EAGAIN;
    bool broken = ready & FV_CAMERA_BROKEN && !any;
    enum fv_camera_event event = any ? give_out(c, &newest, now_ns, frame) : FV_CAMERA_NOTHING;
    if (failed != -EAGAIN) {
        c->counts.errors++;
        /* The driver may go on after EIO, a lost signal; it does not after the others. A frame that came with
         * it is given out; the next step meets the error again. */
        if (any || (failed == -EIO && ++c->failures < FAILURES_MAX)) return event;
        return lose(c, "%s", strerror(-failed));
    }
    if (any) return event;
    if (broken) return lose(c, "the stream broke");
    if (c->queued == 0) return lose(c, "no buffer is left to it");
    if (now_ns - c->alive_ns >= stall_ns(c))
        return lose(c, "no good frame for %d ms", (int)((now_ns - c->alive_ns) / 1000000));
    return FV_CAMERA_NOTHING;
}
