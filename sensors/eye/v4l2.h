/* v4l2: an eye camera of the kernel (Video for Linux 2), streaming into buffers that it shares with us.
 *
 *   v4l2_format.c     bytes to grey
 *   v4l2_negotiate.c  what format, size and rate the camera is asked for, and what it gave
 *   v4l2.c            buffers, frames, faults; losing the camera and finding it again
 *   v4l2_system.c     the system calls, behind struct fv_camera_io
 *
 * The camera is a state machine that is stepped: no thread, no clock of its own, no allocation, so that tests
 * drive it by a made-up device. watch.h has the thread. Where several frames wait, the newest is taken and
 * the others go back at once; the one that is taken goes back as soon as it is decoded. A camera that fails,
 * falls silent or is unplugged is closed and opened again by the same path, again and again: name it by one
 * that stays the same
 * (/dev/v4l/by-id, by-path). */
#ifndef FV_SENSORS_V4L2_H
#define FV_SENSORS_V4L2_H

#include "platform/error.h"
#include "sensors/eye/pupil.h"
#include "sensors/eye/v4l2_format.h"

enum { FV_CAMERA_PATH_MAX = 512, FV_CAMERA_BUFFERS = 4, FV_CAMERA_BUFFERS_MAX = 16 };

enum { FV_CAMERA_READABLE = 1, FV_CAMERA_BROKEN = 2 }; /* bits of what wait() says of a device */

/* What is asked of the system. Results below 0 are -errno. */
struct fv_camera_io {
    int (*open)(void *context, const char *path);
    void (*close)(void *context, int fd);
    int (*control)(void *context, int fd, unsigned long request, void *argument); /* ioctl */
    void *(*map)(void *context, int fd, size_t bytes, uint64_t offset);           /* NULL: refused */
    void (*unmap)(void *context, void *at, size_t bytes);
    /* Until one of the devices (fd < 0: none) has something or the time is over; sets ready[]. */
    void (*wait)(void *context, const int *fd, unsigned *ready, int devices, int64_t timeout_ns);
    int64_t (*now_ns)(void *context); /* CLOCK_MONOTONIC */
    void *context;
};
extern const struct fv_camera_io fv_camera_system;

struct fv_camera_settings {
    const char *key; /* of the setting that names it, for messages */
    char path[FV_CAMERA_PATH_MAX];
    const struct fv_camera_format *format; /* NULL: any */
    int width, height;                     /* wished for */
    double hz;
    int64_t exposure_ns; /* for the middle of a frame's exposure */
};

struct fv_camera_counts {
    int64_t frames;   /* given out */
    int64_t skipped;  /* good, but a newer one was there */
    int64_t gaps;     /* that by their numbers must have been and never came */
    int64_t flagged;  /* marked as damaged by the driver */
    int64_t shorted;  /* with fewer bytes than a frame has, or none */
    int64_t corrupt;  /* with a buffer's number or size that cannot be */
    int64_t untimed;  /* whose time stamp could not be used: the time of arrival in its place */
    int64_t errors;   /* calls that failed while streaming */
    int64_t lost;     /* times the camera was lost ... */
    int64_t restarts; /* ... and gave frames again */
};

/* What a step brought. */
enum fv_camera_event {
    FV_CAMERA_NOTHING,
    FV_CAMERA_FRAME,
    FV_CAMERA_LOST, /* why: `text`; once more where it comes back and cannot be used */
    FV_CAMERA_BACK  /* with a frame; how: `text` */
};

struct fv_camera_frame {
    struct fv_eye_frame grey;
    int64_t t_ns;       /* middle of the exposure */
    int64_t arrived_ns; /* when it was taken */
};

struct fv_camera {
    struct fv_camera_settings settings;
    const struct fv_camera_io *io;
    struct fv_camera_counts counts;
    char text[512]; /* with an event: what was got, in one line; or why it was lost */
    int fd;         /* < 0: there is none */
    struct fv_camera_layout layout;
    double hz; /* as the camera says; 0: it does not */
    int buffers, queued;
    struct {
        void *at;
        size_t bytes;
        bool queued;
    } buffer[FV_CAMERA_BUFFERS_MAX];
    uint8_t *grey; /* capacity bytes, the caller's */
    size_t capacity;
    bool there, streaming, numbered; /* there: could be opened, the last time */
    bool missing, unusable; /* no frame has come since it was lost; it is there, but cannot be used: said */
    uint32_t sequence;
    int64_t newest_ns, alive_ns, retry_ns, pause_ns;
    int failures; /* in a row */
};

/* Opens the camera and begins to stream: 0, or -1 with what is wrong and what would be right. On 0
 * camera->text says what was got; then give it a buffer for a frame (fv_camera_grey_bytes) and step it. `io`
 * stays the caller's. */
int fv_camera_open(struct fv_camera *camera, const struct fv_camera_settings *settings,
                   const struct fv_camera_io *io, struct fv_error *error);
size_t fv_camera_grey_bytes(const struct fv_camera *camera);
void fv_camera_lend(struct fv_camera *camera, uint8_t *grey, size_t capacity);

/* Takes what is there; `ready` as wait() said of camera->fd. To be called at fv_camera_due_ns at the latest.
 * The frame's pixels are valid until the next step. */
enum fv_camera_event fv_camera_step(struct fv_camera *camera, unsigned ready, struct fv_camera_frame *frame);
int64_t fv_camera_due_ns(const struct fv_camera *camera);

void fv_camera_close(struct fv_camera *camera);

/* v4l2_negotiate.c: sets layout, hz and the text; the device is open and not streaming. */
int fv_camera_negotiate(struct fv_camera *camera, struct fv_error *error);

#endif
