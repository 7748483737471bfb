/* watch: see the header. */
#include "sensors/eye/watch.h"

#include "config/config.h"
#include "platform/arena.h"
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
    bool blinked = w->binocular.event == FV_EVENT_BLINK;
    if (!fv_binocular_add(&w->binocular, left, right, &sample)) return;
    w->unseen.blinks += w->binocular.event == FV_EVENT_BLINK && !blinked;
    publish(w, &sample);
    int64_t took_ns = w->io->now_ns(w->io->context) - arrived_ns;
    w->latency.frames++;
    w->latency.sum_ns += took_ns;
    if (took_ns > w->latency.most_ns) w->latency.most_ns = took_ns;
}

/* What each new frame told, and what the eyes do, as it can be told now. */
static void record_looks(struct fv_watch *w, const bool any[FV_WATCH_CAMERAS], const struct fv_eye_look *look,
                         const int64_t *arrived_ns)
{
    struct fv_eye_recorder *recorder = atomic_load_explicit(&w->looks, memory_order_acquire);
    for (int i = 0; recorder && i < w->cameras; i++) {
        if (!any[i]) continue;
        struct fv_eye_row row = {.eye = i, .arrival_ns = arrived_ns[i], .look = look[i], .pupil = w->tracker[i].pupil,
                                 .event = w->binocular.event, .event_ns = w->binocular.event_ns};
        fv_eye_recorder_put(recorder, &row);
    }
}

void fv_watch_round(struct fv_watch *w, int64_t timeout_ns)
{
    unsigned ready[FV_WATCH_CAMERAS] = {0};
    struct fv_eye_look look[FV_WATCH_CAMERAS];
    bool any[FV_WATCH_CAMERAS] = {false, false}, changed = false;
    int64_t arrived_ns = INT64_MAX, arrival_ns[FV_WATCH_CAMERAS] = {0, 0};
    await(w, timeout_ns, ready);
    for (int i = 0; i < w->cameras; i++) {
        struct fv_camera_frame frame;
        enum fv_camera_event event = fv_camera_step(&w->camera[i], ready[i], &frame);
        if (event == FV_CAMERA_LOST || event == FV_CAMERA_BACK) w->say(w->camera[i].text);
        changed = changed || event != FV_CAMERA_NOTHING;
        if (event != FV_CAMERA_FRAME && event != FV_CAMERA_BACK) continue;
        fv_eye_tracker_frame(&w->tracker[i], &frame.grey, frame.t_ns, &look[i]);
        bool pupil = look[i].confidence >= FV_PUPIL_CONFIDENT;
        w->unseen.no_pupil += !pupil;
        w->unseen.unsure += pupil && !look[i].seen;
        struct fv_frame_recorder *recorder = atomic_load_explicit(&w->recorder, memory_order_acquire);
        if (recorder) fv_frame_recorder_put(recorder, i, frame.t_ns, &frame.grey);
        if (w->looked) w->looked(w->looked_context, i, &look[i]);
        any[i] = true;
        arrival_ns[i] = frame.arrived_ns;
        if (frame.arrived_ns < arrived_ns) arrived_ns = frame.arrived_ns;
    }
    if (any[0] || any[1]) combine(w, any[0] ? &look[0] : NULL, any[1] ? &look[1] : NULL, arrived_ns);
    record_looks(w, any, look, arrival_ns);
    if (!changed) return;
    struct fv_watch_tally tally = {.latency = w->latency, .unseen = w->unseen};
    for (int i = 0; i < w->cameras; i++) tally.camera[i] = w->camera[i].counts;
    fv_mailbox_put(&w->tally, &tally, sizeof tally);
}

static void *watch_thread(void *argument)
{
    struct fv_watch *w = argument;
    while (!atomic_load_explicit(&w->stop, memory_order_relaxed)) fv_watch_round(w, longest_ns);
    return fv_thread_rest(&w->done);
}

int fv_watch_start(struct fv_watch *w, struct fv_error *error)
{
    if (fv_thread_start(&w->thread, "eye cameras", FV_URGENT, watch_thread, w, error)) return -1;
    w->running = true;
    return 0;
}

bool fv_watch_stop(struct fv_watch *w)
{
    atomic_store(&w->stop, true);
    if (w->running && !fv_thread_await(&w->done, longest_ns + 1000000000)) return false;
    w->running = false;
    for (int i = 0; i < w->cameras; i++) fv_camera_close(&w->camera[i]);
    return true;
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
