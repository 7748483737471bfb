/* watch: see the header. */
#include "sensors/eye/watch.h"

#include "config/config.h"
#include "platform/arena.h"
#include "platform/clock.h"
#include "platform/threads.h"

#include <string.h>

/* The thread looks at least so often whether it is to end. */
static const int64_t longest_ns = 100000000;

static int open_camera(struct fv_watch *w, int i, const struct fv_watch_settings *settings,
                       struct fv_error *error)
{
    struct fv_camera *c = &w->camera[i];
    struct fv_error why;
    if (fv_camera_open(c, &settings->camera[i], w->io, &why))
        return fv_config_error(error, settings->camera[i].key, "%s", why.text);
    const struct fv_eye_settings *eye = &settings->eye[i];
    if (eye->width > 0 && (eye->width != c->layout.width || eye->height != c->layout.height)) {
        fv_config_error(error, settings->camera[i].key,
                        "frames are %dx%d, calibrated were %dx%d; calibrate again or ask for that size",
                        c->layout.width, c->layout.height, eye->width, eye->height);
        fv_camera_close(c);
        return -1;
    }
    size_t bytes = fv_camera_grey_bytes(c),
           scratch = fv_pupil_scratch_bytes(c->layout.width, c->layout.height);
    fv_camera_lend(c, fv_arena_take(fv_arena(), "sensors", bytes, 64), bytes);
    fv_eye_tracker_begin(&w->tracker[i], eye, fv_arena_take(fv_arena(), "sensors", scratch, 64), scratch);
    w->width[i] = c->layout.width;
    w->height[i] = c->layout.height;
    w->say(c->text);
    return 0;
}

int fv_watch_open(struct fv_watch **watch, const struct fv_watch_settings *settings,
                  const struct fv_camera_io *io, void (*say)(const char *line), struct fv_error *error)
{
    struct fv_watch *w = fv_arena_take(fv_arena(), "sensors", sizeof *w, 64);
    memset(w, 0, sizeof *w);
    w->io = io;
    w->say = say;
    fv_binocular_begin(&w->binocular, settings->settle_s);
    for (int i = 0; i < settings->cameras; i++) {
        if (open_camera(w, i, settings, error)) {
            for (int k = 0; k < i; k++) fv_camera_close(&w->camera[k]);
            return -1;
        }
        w->cameras++;
    }
    *watch = w;
    return 0;
}

static void publish(struct fv_watch *w, const struct fv_gaze_sample *sample)
{
    struct fv_watch_news *n = &w->news;
    if (n->samples == FV_WATCH_HISTORY)
        memmove(n->sample, n->sample + 1, sizeof n->sample - sizeof n->sample[0]);
    else n->samples++;
    n->sample[n->samples - 1] = *sample;
    fv_mailbox_put(&w->mailbox, n, sizeof *n);
}

/* Waits until a camera has something, or is to be looked at in any case. */
static void await(struct fv_watch *w, int64_t timeout_ns, unsigned ready[FV_WATCH_CAMERAS])
{
    int fd[FV_WATCH_CAMERAS];
    int64_t now_ns = w->io->now_ns(w->io->context);
    for (int i = 0; i < w->cameras; i++) {
        fd[i] = w->camera[i].fd;
        int64_t due_ns = fv_camera_due_ns(&w->camera[i]) - now_ns;
        if (due_ns < timeout_ns) timeout_ns = due_ns;
    }
    w->io->wait(w->io->context, fd, ready, w->cameras, timeout_ns > 0 ? timeout_ns : 0);
}

/* From looks to a sample in the mailbox. */
static void combine(struct fv_watch *w, const struct fv_eye_look *left, const struct fv_eye_look *right,
                    int64_t arrived_ns)
{
    struct fv_gaze_sample sample;
    if (!fv_binocular_add(&w->binocular, left, right, &sample)) return;
    publish(w, &sample);
    int64_t took_ns = w->io->now_ns(w->io->context) - arrived_ns;
    w->latency.frames++;
    w->latency.sum_ns += took_ns;
    if (took_ns > w->latency.most_ns) w->latency.most_ns = took_ns;
}

void fv_watch_round(struct fv_watch *w, int64_t timeout_ns)
{
    unsigned ready[FV_WATCH_CAMERAS] = {0};
    struct fv_eye_look look[FV_WATCH_CAMERAS];
    bool any[FV_WATCH_CAMERAS] = {false, false}, changed = false;
    int64_t arrived_ns = INT64_MAX;
    await(w, timeout_ns, ready);
    for (int i = 0; i < w->cameras; i++) {
        struct fv_camera_frame frame;
        enum fv_camera_event event = fv_camera_step(&w->camera[i], ready[i], &frame);
        if (event == FV_CAMERA_LOST || event == FV_CAMERA_BACK) w->say(w->camera[i].text);
        changed = changed || event != FV_CAMERA_NOTHING;
        if (event != FV_CAMERA_FRAME && event != FV_CAMERA_BACK) continue;
        fv_eye_tracker_frame(&w->tracker[i], &frame.grey, frame.t_ns, &look[i]);
        struct fv_frame_recorder *recorder = atomic_load_explicit(&w->recorder, memory_order_acquire);
        if (recorder) fv_frame_recorder_put(recorder, i, frame.t_ns, &frame.grey);
        any[i] = true;
        if (frame.arrived_ns < arrived_ns) arrived_ns = frame.arrived_ns;
    }
    if (any[0] || any[1]) combine(w, any[0] ? &look[0] : NULL, any[1] ? &look[1] : NULL, arrived_ns);
    if (!changed) return;
    struct fv_watch_tally tally = {.latency = w->latency};
    for (int i = 0; i < w->cameras; i++) tally.camera[i] = w->camera[i].counts;
    fv_mailbox_put(&w->tally, &tally, sizeof tally);
}

static void *watch_thread(void *argument)
{
    struct fv_watch *w = argument;
    while (!atomic_load_explicit(&w->stop, memory_order_relaxed)) fv_watch_round(w, longest_ns);
    atomic_store_explicit(&w->left, true, memory_order_release);
    return NULL;
}

int fv_watch_start(struct fv_watch *w, struct fv_error *error)
{
    if (fv_thread_start(&w->thread, "eye cameras", FV_URGENT, watch_thread, w, error)) return -1;
    w->running = true;
    return 0;
}

bool fv_watch_end(struct fv_watch *w)
{
    const struct fv_clock *clock = &fv_clock_monotonic;
    int64_t until_ns = fv_clock_now_ns(clock) + longest_ns + 1000000000;
    atomic_store(&w->stop, true);
    while (w->running && !atomic_load_explicit(&w->left, memory_order_acquire)) {
        if (fv_clock_now_ns(clock) >= until_ns) return false;
        fv_clock_sleep_until_ns(clock, fv_clock_now_ns(clock) + 1000000);
    }
    for (int i = 0; i < w->cameras; i++) fv_camera_close(&w->camera[i]);
    return true;
}

void fv_watch_stop(struct fv_watch *w)
{
    atomic_store(&w->stop, true);
    if (w->running) pthread_join(w->thread, NULL);
    w->running = false;
    fv_watch_end(w);
}

bool fv_watch_read(struct fv_watch *w, struct fv_watch_news *news)
{
    return fv_mailbox_get(&w->mailbox, news, sizeof *news);
}

bool fv_watch_count(struct fv_watch *w, struct fv_watch_tally *tally)
{
    return fv_mailbox_get(&w->tally, tally, sizeof *tally);
}

void fv_watch_size(const struct fv_watch *w, int camera, int *width, int *height)
{
    *width = w->width[camera];
    *height = w->height[camera];
}
