/* run: the main job: frames from sensors to the display, then the session's report. */
#include "cli/cli.h"
#include "cli/columns.h"
#include "cli/decisions.h"
#include "cli/frames_csv.h"
#include "cli/progress.h"
#include "cli/record.h"
#include "cli/report.h"

#include "display/display.h"
#include "platform/gpio.h"
#include "platform/heap.h"
#include "platform/log.h"
#include "platform/spool.h"
#include "platform/watchdog.h"
#include "sensors/sensors.h"

#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>

struct run {
    struct fv_setup setup;
    struct fv_display *display;
    struct fv_gpio gpio;
    struct fv_picture picture;
    bool pictured;                      /* `picture` holds a frame */
    int64_t frames;                     /* asked for; -1: until a signal */
    const struct fv_decision *decision; /* replay: what was decided for ... */
    int64_t decided;                    /* ... so many frames */
    int64_t shown_ns;                   /* when the progress line was last written */
    float gaze_latency_ms;              /* of the newest latch */
    struct fv_spooler spooler;          /* writes what is recorded while the loop runs */
    struct fv_spool frames_csv;
    int exit_code;
};

enum { FRAMES_CSV_ROWS = 1024 /* that may wait for the disk */ };
static struct fv_frame_record frames_csv_rows[FRAMES_CSV_ROWS];

static volatile sig_atomic_t stopped;

static void on_signal(int number)
{
    (void)number;
    stopped = 1;
}

static void latch(void *context, int64_t now_ns, int64_t show_ns, struct fv_pose *head, double gaze[2][3],
                  double *uncertainty_deg)
{
    struct run *r = context;
    struct fv_pose relative;
    struct fv_gaze g;
    fv_setup_latch(&r->setup, now_ns, show_ns, &relative, &g, head);
    fv_record_latch(show_ns, &relative, &g);
    memcpy(gaze, g.direction, sizeof g.direction);
    /* Without a sample it is of the time that is asked for. */
    r->gaze_latency_ms = now_ns >= g.t_ns ? (float)((double)(now_ns - g.t_ns) * 1e-6) : NAN;
    *uncertainty_deg = g.uncertainty_deg;
}

static void newest(void *context, int64_t now_ns, int64_t show_ns, struct fv_pose *head)
{
    struct run *r = context;
    struct fv_pose relative;
    struct fv_gaze g;
    fv_setup_latch(&r->setup, now_ns, show_ns, &relative, &g, head);
    fv_record_latch(show_ns, &relative, &g);
}

static bool wants(void *context, int64_t frame, bool last)
{
    struct run *r = context;
    return fv_display_wants(r->display, frame, last || stopped);
}

static void present(void *context, const struct fv_frame *f)
{
    struct run *r = context;
    struct fv_error error;
    r->picture = (struct fv_picture){.eyes = f->eyes,
                                     .width = f->width,
                                     .height = f->height,
                                     .stride_bytes = 4 * f->stride,
                                     .pixels = {f->buffer[FV_PICTURE][0], f->buffer[FV_PICTURE][1]}};
    r->pictured = true;
    bool failed = fv_display_present(r->display, &r->picture, f->number, &error) != 0;
    r->setup.session.pictures += !failed;
    r->setup.session.pictures_failed += failed;
    if (failed) {
        fv_log("%s: no more pictures are written, the run goes on", error.text);
        r->exit_code = FV_EXIT_NOT_HELD;
    }
    fv_gpio_strobe(&r->gpio);
}

/* Of the display; its line is nearer to what it does than the kernel's driver. */
static bool beat(void *context, struct fv_beat *of)
{
    struct run *r = context;
    *of = (struct fv_beat){.lead_ns = 0};
    bool shown = fv_display_beat(r->display, of);
    fv_gpio_poll(&r->gpio);
    return fv_gpio_beat(&r->gpio, fv_clock_now_ns(&fv_clock_monotonic), of) || shown;
}

static bool decided(void *context, int64_t frame, struct fv_decision *decision)
{
    const struct run *r = context;
    if (frame >= r->decided) return false;
    *decision = r->decision[frame];
    return true;
}

/* What the lines say and are told, once a frame. */
static void heed_lines(struct run *r, bool missed)
{
    fv_gpio_poll(&r->gpio);
    if (fv_gpio_pressed(&r->gpio)) r->setup.recentre = true;
    fv_gpio_frame(&r->gpio, missed);
    if (r->gpio.text[0]) fv_log("%s", r->gpio.text);
    r->gpio.text[0] = 0;
}

static bool after(void *context, const struct fv_session *s, const struct fv_frame_record *record)
{
    struct run *r = context;
    int64_t now_ns = fv_clock_now_ns(&fv_clock_monotonic);
    fv_record_decision(&record->decision);
    fv_watchdog_feed(r->setup.config.budget_watchdog_s, now_ns);
    heed_lines(r, record->missed);
    struct fv_frame_record whole = *record;
    whole.gaze_latency_ms = r->gaze_latency_ms;
    if (s->frames <= s->capacity) s->record[s->frames - 1] = whole;
    fv_spool_put(&r->frames_csv, &whole);
    if (now_ns - r->shown_ns > 100000000) {
        r->shown_ns = now_ns;
        fv_progress_line(s, &whole, r->frames);
    }
    return !stopped;
}

static int read_decisions(struct run *r, const struct fv_arguments *a, struct fv_error *error)
{
    const struct fv_setup *s = &r->setup;
    struct fv_decisions_of of = {.stage = s->session.stage,
                                 .stages = s->plan.passes,
                                 .levels = s->plan.method->levels,
                                 .tiles = s->loop.frame.tiles,
                                 .frames = a->recorded};
    r->decided = a->recorded;
    return a->recorded > 0 ? fv_decisions_read(&r->decision, a->decisions, &of, error) : 0;
}

/* From here on a run that is told to end leaves its report; before, nothing at all. Hanging up ends it only
 * where nobody asked that it should not (nohup). Who reads the log or the pictures may go away: that ends neither. */
static void heed_signals(void)
{
    static const int ending[] = {SIGINT, SIGTERM, SIGHUP};
    struct sigaction action = {.sa_handler = on_signal};
    struct sigaction before;
    for (int i = 0; i < 3; i++)
        if (sigaction(ending[i], NULL, &before) || before.sa_handler != SIG_IGN || ending[i] != SIGHUP)
            sigaction(ending[i], &action, NULL);
    signal(SIGPIPE, SIG_IGN);
}

/* What devices give, beside what is latched. */
static int record_devices(struct run *r, const char *out, struct fv_error *error)
{
    char folder[FV_PATH_MAX];
    bool raw = strcmp(r->setup.config.output_tape, "on") == 0, frames = strcmp(r->setup.config.output_eye_frames, "on") == 0;
    if (!raw && !frames) return 0;
    if (fv_path_join(folder, out, "tape")) return fv_error_set(error, "%s: path too long", out);
    if (fv_folder_make(folder, error)) return -1;
    return fv_sensors_record(r->setup.sensors, folder, raw, frames, &r->spooler, error);
}

static int write_frames_csv(void *context, const void *row)
{
    const struct run *r = context;
    fv_frames_csv_row(&r->setup.session, row); /* says its failures itself */
    return 0;
}

static int open_frames_csv(struct run *r, const char *out, struct fv_error *error)
{
    char path[FV_PATH_MAX + 16];
    snprintf(path, sizeof path, "%s/frames.csv", out);
    if (fv_frames_csv_open(&r->setup.session, path, error)) return -1;
    fv_spool_begin(&r->frames_csv, "frames.csv", frames_csv_rows, FRAMES_CSV_ROWS, sizeof frames_csv_rows[0],
                   write_frames_csv, r, NULL);
    fv_spooler_add(&r->spooler, &r->frames_csv);
    return 0;
}

/* A display with a vertical blank has a rate of its own, whatever budget.hz says. */
static void take_rate(struct run *r)
{
    const struct fv_config *c = &r->setup.config;
    struct fv_display_counts d = fv_display_counts(r->display);
    double hz = d.hz;
    if (hz <= 0 || !d.vblank || r->decided > 0 || strcmp(c->budget_pace, "vsync") != 0) return;
    if (fabs(hz - c->budget_hz) > 0.01 * c->budget_hz)
        fv_log("the display refreshes at %.2f Hz, budget.hz says %g: frames are paced by the display", hz, c->budget_hz);
    fv_loop_period(&r->setup.loop, llround(1e9 / hz));
}

/* Lines of a GPIO chip, at the pace that the frames have by now. */
static int open_lines(struct run *r, struct fv_error *error)
{
    struct fv_gpio_settings settings;
    fv_setup_lines(&settings, &r->setup.config, r->setup.loop.period_ns);
    return fv_gpio_open(&r->gpio, &settings, &fv_gpio_system, error);
}

/* What stands in OUT while a run goes on. */
static int prepare_out(struct run *r, const struct fv_arguments *a, struct fv_error *error)
{
    struct fv_config *c = &r->setup.config;
    take_rate(r);
    if (open_lines(r, error)) return -1;
    if (fv_folder_make(a->out, error)) return -1;
    if (strcmp(c->output_tape, "on") == 0 &&
        fv_record_open(c, r->setup.session.stage, r->setup.plan.passes, r->setup.plan.turns, a->out, &r->spooler, error))
        return -1;
    if (record_devices(r, a->out, error)) return -1;
    if (open_frames_csv(r, a->out, error) || fv_spooler_start(&r->spooler, error)) return -1;
    fv_setup_realtime(&r->setup, true);
    fv_setup_seal(&r->setup, a->out);
    return 0;
}

/* Whether OUT/tape, which a recording begins by emptying, holds a tape that is played. */
static int records_over_tape(const struct fv_config *c, const char *out, struct fv_error *error)
{
    const struct {
        const char *key, *source, *path;
        bool file;
    } tape[] = {{"eye.tape", c->eye_source, c->eye_tape, true},
                {"eye.device", c->eye_source, c->eye_device, false},
                {"imu.tape", c->imu_source, c->imu_tape, true}};
    char folder[FV_PATH_MAX], of[FV_PATH_MAX];
    if (strcmp(c->output_tape, "on") != 0 || fv_path_join(folder, out, "tape")) return 0;
    for (int i = 0; i < 3; i++) {
        if (strcmp(tape[i].source, "tape") != 0 || !tape[i].path[0]) continue;
        snprintf(of, sizeof of, "%s", tape[i].path);
        char *slash = strrchr(of, '/');
        if (tape[i].file && slash) slash[slash == of] = 0;
        else if (tape[i].file) strcpy(of, ".");
        if (fv_same_folder(folder, of))
            return fv_config_error(error, tape[i].key, "%.400s lies in %.400s, which this run records anew: name another --out",
                                   tape[i].path, folder);
    }
    return 0;
}

/* All that a run needs before the first frame; OUT is made once all that it does not hold is there. */
static int prepare(struct run *r, const struct fv_arguments *a, struct fv_error *error)
{
    struct fv_config *c = &r->setup.config;
    if (fv_setup_open(&r->setup, &a->request, error)) return -1;
    r->frames = a->frames;
    if (records_over_tape(c, a->out, error)) return -1;
    heed_signals();
    if (fv_setup_take(&r->setup, r->frames, error)) return -1;
    if (read_decisions(r, a, error)) return -1;
    if (fv_display_open(&r->display, c, a->out, error)) return -1;
    fv_watchdog_open();
    if (prepare_out(r, a, error)) {
        struct fv_error late;
        fv_display_close(r->display, &late);
        return -1;
    }
    return 0;
}

static double percentile(const struct fv_session *s, enum fv_column_name column, double percent)
{
    return fv_column_percentile(s, &fv_columns[column], 0, fv_recorded(s), percent);
}

static void fill_devices(struct run *r)
{
    struct fv_display_counts d = fv_display_counts(r->display);
    struct fv_session_display *out = &r->setup.session.display;
    memcpy(out->mode, d.mode, sizeof out->mode);
    out->hz = d.hz;
    out->measured_hz = d.measured_hz;
    out->atomic = d.atomic;
    out->vblank = d.vblank;
    out->flips = d.flips;
    out->skipped = d.skipped;
    out->dropped = d.dropped;
    out->busy = d.busy;
    out->odd = d.odd;
    out->lost = d.lost;
    out->back = d.back;
    out->bytes = d.bytes;
    out->copy_ms_mean = d.copy_ms_mean;
    out->copy_ms_most = d.copy_ms_most;
    const struct fv_gpio *g = &r->gpio;
    double hz = g->vsync.count > 0 ? 1e9 / g->vsync.period_ns : 0;
    r->setup.session.gpio = (struct fv_session_gpio){g->lines, g->counts.vsyncs, g->vsync.odd, g->counts.strobes,
                                                     g->counts.presses, g->counts.errors, hz};
}

static void fill_session(struct run *r)
{
    struct fv_session *s = &r->setup.session;
    struct fv_sensors_counts counts = fv_sensors_counts(r->setup.sensors);
    s->gaze_samples = counts.gaze_samples;
    s->gaze_lost = counts.gaze_lost;
    s->imu_samples = counts.imu_samples;
    s->imu_rejected = counts.imu_rejected;
    s->imu_readings = counts.imu_readings;
    s->imu_lost = counts.imu_lost;
    s->imu_reconnects = counts.imu_reconnects;
    s->imu_repeated = counts.imu.repeated;
    s->imu_clock_restarts = counts.imu.clock_restarts;
    s->imu_mistimed = counts.imu.mistimed;
    s->imu_bad = counts.imu.bad;
    s->imu_stuck = counts.imu.stuck;
    s->imu_saturated = counts.imu.saturated;
    s->cameras = counts.camera.cameras;
    s->camera_frames = counts.camera.frames;
    s->camera_skipped = counts.camera.skipped;
    s->camera_gaps = counts.camera.gaps;
    s->camera_rejected = counts.camera.rejected;
    s->camera_untimed = counts.camera.untimed;
    s->camera_errors = counts.camera.errors;
    s->camera_lost = counts.camera.lost;
    s->camera_restarts = counts.camera.restarts;
    s->eye_no_pupil = counts.camera.no_pupil;
    s->eye_unsure = counts.camera.unsure;
    s->eye_blinks = counts.camera.blinks;
    s->camera_ms_mean = counts.camera.latency_ms_mean;
    s->camera_ms_most = counts.camera.latency_ms_most;
    fill_devices(r);
    s->gaze_latency_ms_p50 = percentile(s, FV_COLUMN_GAZE_LATENCY, 50);
    struct fv_spool_counts written = fv_spooler_counts(&r->spooler), frames = fv_spool_counts(&r->frames_csv);
    s->tape_rows = written.rows - frames.rows;
    s->tape_dropped = written.dropped - frames.dropped;
    if (frames.dropped > 0)
        fv_log("frames.csv: %lld rows are missing, as the disk did not keep up", (long long)frames.dropped);
    s->heap_calls = fv_heap_calls();
    s->memory_syscalls = fv_heap_system_calls();
}

/* A piece that cannot be written is said and makes the exit code 1; the others are written all the same. */
static void note(struct run *r, int failed, const struct fv_error *error)
{
    if (!failed) return;
    fv_log("%s", error->text);
    r->exit_code = FV_EXIT_NOT_HELD;
}

/* Curves beside the spans of trace.json. */
static bool read_counters(const void *context, int64_t frame, double value[FV_COUNTERS_MAX])
{
    const struct fv_session *s = context;
    if (frame < 0 || frame >= fv_recorded(s) || s->record[frame].frame != frame) return false;
    value[0] = s->record[frame].level;
    value[1] = 100.0 * (double)s->record[frame].sampled_fraction;
    value[2] = s->record[frame].cut_tiles;
    return true;
}

static void write_reports(struct run *r, const char *out)
{
    const struct fv_session *s = &r->setup.session;
    const struct fv_config *c = &r->setup.config;
    char path[FV_PATH_MAX + 16];
    struct fv_error error;
    int cut = fv_record_close(s->frames, out, &error);
    note(r, cut, &error);
    r->setup.session.tape_cut = cut != 0;
    cut = fv_sensors_record_end(r->setup.sensors, &error);
    note(r, cut, &error);
    r->setup.session.tape_cut += cut != 0;
    snprintf(path, sizeof path, "%s/report.json", out);
    note(r, fv_report_json(s, c, path, &error), &error);
    note(r, fv_frames_csv_close(&error), &error);
    snprintf(path, sizeof path, "%s/report.html", out);
    note(r, fv_report_html(s, c, r->pictured ? &r->picture : NULL, r->setup.png, path, &error), &error);
    snprintf(path, sizeof path, "%s/trace.json", out);
    const struct fv_counters counters = {3, {"level", "sampled %", "cut tiles"}, read_counters, s};
    note(r, fv_trace_write(r->setup.loop.trace, &counters, path, &error), &error);
}

int fv_verb_run(const struct fv_arguments *a)
{
    static struct run r;
    struct fv_error error;
    r.exit_code = FV_EXIT_DONE;
    if (prepare(&r, a, &error)) {
        fv_log("%s", error.text);
        return FV_EXIT_UNUSABLE;
    }
    struct fv_loop_io io = {&r, latch, wants, present, r.decided > 0 ? decided : NULL, after, beat, newest};
    fv_heap_seal(strcmp(r.setup.config.threads_sealed_heap, "fatal") == 0);
    fv_watchdog_feed(r.setup.config.budget_watchdog_s, fv_clock_now_ns(&fv_clock_monotonic));
    fv_loop_run(&r.setup.loop, &io, r.frames);
    fv_watchdog_feed(0, 0);
    note(&r, fv_display_close(r.display, &error), &error); /* counts the flip that was under way */
    fv_sensors_close(r.setup.sensors);
    fv_spooler_stop(&r.spooler);
    fill_session(&r);
    fv_gpio_close(&r.gpio);
    write_reports(&r, a->out);
    fv_progress_close(&r.setup.session, &r.setup.config,
                      &(struct fv_hints){r.setup.plan.method->levels > 1, r.decided > 0}, a->out);
    return r.exit_code;
}
