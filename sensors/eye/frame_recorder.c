/* frame_recorder: see the header. A ring of frames between one thread that puts and one that writes. */
#include "sensors/eye/frame_recorder.h"

#include "platform/arena.h"
#include "platform/log.h"
#include "platform/threads.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

/* False: the frame does not fit, which is said; what does is kept. */
static bool write_frame(struct fv_frame_recorder *r, int eye, int64_t t_ns, const uint8_t *bytes)
{
    struct fv_writer *w = &r->writer[eye];
    size_t size = r->size[eye] + FV_FRAME_TAPE_HEAD_BYTES + r->bytes[eye];
    bool full = size > FV_FRAME_TAPE_BYTES_MAX - FV_FRAME_TAPE_LINE_MAX;
    if (!full) fv_frame_tape_write(w, t_ns, bytes, r->bytes[eye]);
    if (full || w->failed) {
        fv_log("eye camera: %s: %s: recording of frames ends here, the run goes on", w->path,
               full ? "as large as a tape of frames may be" : strerror(w->failed));
        atomic_fetch_add_explicit(&r->dropped, 1, memory_order_relaxed);
        return false;
    }
    r->size[eye] = size;
    return true;
}

static void write_one(struct fv_frame_recorder *r)
{
    unsigned at = atomic_load_explicit(&r->written, memory_order_relaxed);
    if (at == atomic_load_explicit(&r->put, memory_order_acquire)) return;
    int i = (int)(at % FV_RECORDER_SLOTS), eye = r->slot[i].eye;
    if (r->ended[eye]) atomic_fetch_add_explicit(&r->dropped, 1, memory_order_relaxed);
    else if (!write_frame(r, eye, r->slot[i].t_ns, r->slot[i].bytes)) r->ended[eye] = true;
    atomic_store_explicit(&r->written, at + 1, memory_order_release);
}

static void *recorder_thread(void *argument)
{
    struct fv_frame_recorder *r = argument;
    while (!atomic_load_explicit(&r->stop, memory_order_acquire)) {
        while (sem_wait(&r->waiting) != 0 && errno == EINTR) {
        }
        write_one(r);
    }
    while (atomic_load_explicit(&r->written, memory_order_relaxed) !=
           atomic_load_explicit(&r->put, memory_order_acquire))
        write_one(r);
    return fv_thread_rest(&r->done);
}

int fv_frame_recorder_open(struct fv_frame_recorder **recorder, const char *folder, int eyes,
                           const int width[2], const int height[2], struct fv_error *error)
{
    struct fv_frame_recorder *r = fv_arena_take(fv_arena(), "sensors", sizeof *r, 64);
    char path[FV_PATH_MAX];
    size_t most = 0;
    memset(r, 0, sizeof *r);
    for (int eye = 0; eye < eyes; eye++) {
        struct fv_camera_layout layout = {fv_camera_format_named("GREY"), width[eye], height[eye],
                                          (size_t)width[eye]};
        r->bytes[eye] = fv_camera_frame_bytes(&layout);
        if (fv_path_join(path, folder, fv_frame_tape_name[eye]))
            return fv_error_set(error, "%.100s: path too long", folder);
        if (fv_writer_open(&r->writer[eye], path, error)) return -1;
        fv_frame_tape_begin(&r->writer[eye], &layout);
        if (r->bytes[eye] > most) most = r->bytes[eye];
        r->eyes++;
    }
    for (int i = 0; i < FV_RECORDER_SLOTS; i++)
        r->slot[i].bytes = fv_arena_take(fv_arena(), "sensors", most, 64);
    sem_init(&r->waiting, 0, 0);
    *recorder = r;
    if (fv_thread_start(&r->thread, "frame recorder", FV_CAN_WAIT, recorder_thread, r, error)) return -1;
    r->running = true;
    return 0;
}

void fv_frame_recorder_put(struct fv_frame_recorder *r, int eye, int64_t t_ns,
                           const struct fv_eye_frame *frame)
{
    unsigned put = atomic_load_explicit(&r->put, memory_order_relaxed);
    unsigned waits = put - atomic_load_explicit(&r->written, memory_order_acquire);
    size_t width = (size_t)frame->width;
    if (eye >= r->eyes || waits >= FV_RECORDER_SLOTS || width * (size_t)frame->height != r->bytes[eye]) {
        atomic_fetch_add_explicit(&r->dropped, 1, memory_order_relaxed);
        return;
    }
    int i = (int)(put % FV_RECORDER_SLOTS);
    r->slot[i].eye = eye;
    r->slot[i].t_ns = t_ns;
    for (int y = 0; y < frame->height; y++)
        memcpy(r->slot[i].bytes + (size_t)y * width, frame->pixels + y * frame->stride, width);
    atomic_store_explicit(&r->put, put + 1, memory_order_release);
    sem_post(&r->waiting);
}

int fv_frame_recorder_close(struct fv_frame_recorder *r, struct fv_error *error)
{
    int failed = 0;
    atomic_store_explicit(&r->stop, true, memory_order_release);
    sem_post(&r->waiting);
    if (r->running) fv_thread_await(&r->done, INT64_MAX);
    r->running = false;
    long long dropped = atomic_load(&r->dropped);
    if (dropped > 0) fv_log("eye camera: %lld frames were not recorded", dropped);
    for (int eye = 0; eye < r->eyes; eye++) {
        struct fv_error why;
        if (fv_writer_close_cut(&r->writer[eye], &why) && !failed) failed = fv_error_set(error, "%s", why.text);
    }
    return failed;
}
