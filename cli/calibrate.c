/* calibrate: shows targets one after another, gathers what the eye cameras see meanwhile, and fits the gaze.
 *
 *   targets and looks  sensors/eye/calibrator.h, look_feed.h
 *   the fit, judged    sensors/eye/calibrated.h
 *   pictures           calibrate_picture.c
 *   what is told       calibrate_tell.c, calibrate_page.c */
#include "cli/calibrate.h"

#include "platform/arena.h"
#include "platform/clock.h"
#include "platform/heap.h"
#include "platform/log.h"
#include "platform/sandbox.h"
#include "sensors/eye/look_feed.h"

#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>

/* More time for the first target of a person. */
static const int64_t lead_ns = 1000000000;

struct calibrate {
    struct fv_config config;
    struct fv_look_feed feed;
    struct fv_calibrator calibrator;
    struct fv_calibrated calibrated;
    struct fv_display *display; /* NULL: recorded frames, targets were shown then */
    struct fv_target_picture picture;
    bool animated, shows; /* the ring moves; the sink still takes pictures */
    int64_t pictures;     /* shown so far */
    struct fv_writer log, file;
    int exit_code;
};

static volatile sig_atomic_t stopped;

static void on_signal(int number)
{
    (void)number;
    stopped = 1;
}

/* What is recorded is closed where the user ends it, and no calibration is left. */
static void heed_signals(void)
{
    const struct sigaction action = {.sa_handler = on_signal};
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
}

/* OUT/tape: the log of targets, and frames where they are asked for. Nothing of an older recording may stand
 * beside. */
static int record(struct calibrate *c, const char *out, struct fv_error *error)
{
    char folder[FV_PATH_MAX], path[FV_PATH_MAX];
    if (fv_path_join(folder, out, "tape") || fv_path_join(path, folder, "targets.csv"))
        return fv_error_set(error, "%.100s: path too long", out);
    if (fv_folder_make(folder, error)) return -1;
    fv_file_remove(folder, "targets.csv");
    for (int eye = 0; eye < 2; eye++) fv_file_remove(folder, fv_frame_tape_name[eye]);
    if (strcmp(c->config.output_eye_frames, "on") == 0 && fv_look_feed_record(&c->feed, folder, error))
        return -1;
    if (fv_writer_open(&c->log, path, error)) return -1;
    fv_targets_begin(&c->log);
    return 0;
}

/* All that is needed; OUT is made once all that it does not hold is there. */
static int prepare(struct calibrate *c, const struct fv_arguments *a, struct fv_error *error)
{
    if (fv_config_load(&c->config, &a->request, error)) return -1;
    fv_arena_limit(fv_arena(), (size_t)c->config.budget_memory_mb << 20);
    fv_sandbox_ask(strcmp(c->config.threads_sandbox, "on") == 0);
    fv_sandbox_keep_console(strcmp(c->config.display_sink, "kms") == 0);
    if (fv_look_feed_open(&c->feed, &c->config, error)) return -1;
    struct fv_calibrator_settings settings = {
        .eyes = c->feed.eyes,
        .points = a->points,
        .reach = fv_target_reach(&c->config),
        .lead_ns = c->feed.watch ? lead_ns : 0,
        .near_px = fv_calibrator_near_px(&c->feed.eye[0].model, c->feed.width)};
    if (fv_calibrator_begin(&c->calibrator, &settings, error)) return -1;
    c->feed.calibrator = &c->calibrator;
    if (c->feed.recorded) return fv_folder_make(a->out, error);
    fv_target_picture_open(&c->picture, &c->config);
    heed_signals(); /* before a display is taken, which has to be given back */
    if (fv_display_open(&c->display, &c->config, a->out, error)) return -1;
    c->animated = strcmp(c->config.display_sink, "png") != 0;
    c->shows = true;
    if (fv_folder_make(a->out, error) == 0 && record(c, a->out, error) == 0) return 0;
    struct fv_error late;
    fv_display_close(c->display, &late);
    return -1;
}

/* As a run does, once all is open: what is left to be opened lies in OUT. */
static void give_up_rights(const struct calibrate *c, const char *out)
{
    static struct fv_workers alone;
    struct fv_error said;
    if (strcmp(c->config.threads_sandbox, "on") != 0) return;
    fv_workers_start(&alone, 1);
    if (fv_sandbox_seal(&alone, out, &said)) fv_log("threads.sandbox: refused: %s; it goes on without", said.text);
}

/* The target of a row as it is at a time. */
static void present(struct calibrate *c, const struct fv_target_shown *s, int64_t now_ns)
{
    struct fv_error error;
    if (!c->shows || !fv_display_wants(c->display, c->pictures, !c->animated)) return;
    double part = c->animated ? (double)(now_ns - s->t_ns) / (double)(s->from_ns - s->t_ns) : 0;
    fv_target_picture_draw(&c->picture, s->at_deg, part);
    if (fv_display_present(c->display, &c->picture.picture, c->pictures++, &error) == 0) return;
    fv_log("%s: no more targets are shown", error.text);
    c->shows = false;
    c->exit_code = FV_EXIT_NOT_HELD;
}

static void begin_row(struct calibrate *c, int row)
{
    const struct fv_target_shown *s = &c->calibrator.show[row];
    fv_look_feed_target(&c->feed, s);
    fv_targets_row(&c->log, s);
    fv_log_progress("target %d of %d%s", c->calibrator.target + 1, c->calibrator.settings.points,
                    c->calibrator.tries > 1 ? ", once more" : "");
}

/* Shows targets until all have been looked at. Simulated time goes as fast as frames are drawn, unless it is
 * to wait for flips. */
static void show_targets(struct calibrate *c)
{
    const int64_t period_ns = llround(1e9 / c->config.budget_hz),
                  begun_ns = fv_clock_now_ns(&fv_clock_monotonic);
    bool waits = c->feed.simulated && strcmp(c->config.budget_pace, "vsync") == 0;
    int64_t now_ns = fv_look_feed_now_ns(&c->feed);
    for (int row, shown = -1; !stopped && (row = fv_calibrator_step(&c->calibrator, now_ns)) >= 0;) {
        if (row != shown) begin_row(c, row);
        if (row != shown || c->animated) present(c, &c->calibrator.show[row], now_ns);
        shown = row;
        fv_look_feed_until(&c->feed, now_ns + period_ns);
        now_ns = fv_look_feed_now_ns(&c->feed);
        if (waits) fv_clock_sleep_until_ns(&fv_clock_monotonic, begun_ns + now_ns);
    }
}

/* A piece that cannot be written is said and makes the exit code 1. */
static void note(struct calibrate *c, int failed, const struct fv_error *error)
{
    if (!failed) return;
    fv_log("%s", error->text);
    c->exit_code = FV_EXIT_NOT_HELD;
}

static void gather(struct calibrate *c)
{
    struct fv_error error;
    if (c->feed.recorded) {
        fv_calibrator_replay(&c->calibrator, c->feed.shown, c->feed.rows);
        fv_look_feed_play(&c->feed);
        return;
    }
    show_targets(c);
    note(c, fv_look_feed_close(&c->feed, &error), &error);
    note(c, fv_writer_close(&c->log, &error), &error);
    note(c, fv_display_close(c->display, &error), &error);
}

static void write_results(struct calibrate *c, const char *out)
{
    char path[FV_PATH_MAX + 32], about[256];
    struct fv_error error;
    snprintf(about, sizeof about, "%d targets, frames of %dx%d from %.32s", c->calibrated.eye[0].targets,
             c->feed.width, c->feed.height, c->config.eye_source);
    fv_calibrated_tell(&c->calibrated);
    snprintf(path, sizeof path, "%s/calibration.csv", out);
    int failed = fv_calibrated_write(&c->calibrated, c->feed.width, c->feed.height, path, &c->file, &error);
    note(c, failed, &error);
    if (failed) return;
    fv_log("calibrated: run with --set eye.calibration=%s", path);
    snprintf(path, sizeof path, "%s/report.html", out);
    note(c, fv_calibrated_page(&c->calibrated, about, path, &error), &error);
}

int fv_verb_calibrate(const struct fv_arguments *a)
{
    static struct calibrate c;
    struct fv_error error;
    c.exit_code = FV_EXIT_DONE;
    if (prepare(&c, a, &error)) {
        fv_log("%s", error.text);
        return FV_EXIT_UNUSABLE;
    }
    give_up_rights(&c, a->out);
    fv_heap_seal(strcmp(c.config.threads_sealed_heap, "fatal") == 0);
    gather(&c);
    if (stopped) {
        fv_log("ended before all targets were shown: not calibrated");
        return FV_EXIT_NOT_HELD;
    }
    if (fv_calibrated_make(&c.calibrated, &c.calibrator, &error)) {
        fv_log("not calibrated: %s", error.text);
        return FV_EXIT_NOT_HELD;
    }
    write_results(&c, a->out);
    return c.exit_code;
}
