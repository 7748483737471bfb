/* look_feed: see the header. */
#include "sensors/eye/look_feed.h"

#include "platform/arena.h"
#include "platform/log.h"
#include "sensors/eye/camera_source.h"
#include "sensors/motion.h"

#include <math.h>
#include <string.h>

/* Simulated eyes begin to move so long after a target appeared (Carpenter 1988), and take the time of the
 * main sequence (sim.c). */
static const int64_t latency_ns = 200000000;

static void say(const char *line)
{
    fv_log("eye camera: %s", line);
}

static void looked(void *context, int eye, const struct fv_eye_look *look)
{
    struct fv_look_feed *f = context;
    if (f->calibrator) fv_calibrator_look(f->calibrator, eye, look);
}

int fv_look_feed_watch(struct fv_look_feed *f, const struct fv_watch_settings *settings,
                       const struct fv_camera_io *io, struct fv_error *error)
{
    int width, height;
    f->eyes = settings->cameras;
    memcpy(f->eye, settings->eye, sizeof settings->eye);
    if (fv_watch_open(&f->watch, settings, io, say, error)) return -1;
    f->watch->looked = looked;
    f->watch->looked_context = f;
    fv_watch_size(f->watch, 0, &f->width, &f->height);
    fv_watch_size(f->watch, f->eyes - 1, &width, &height);
    if (width == f->width && height == f->height) return 0;
    fv_watch_stop(f->watch);
    return fv_config_error(error, "eye.device_right",
                           "frames are %dx%d, the left eye's are %dx%d; a calibration is of one size", width,
                           height, f->width, f->height);
}

static int open_cameras(struct fv_look_feed *f, const struct fv_config *config, struct fv_error *error)
{
    static struct fv_watch_settings settings;
    if (fv_camera_source_settings(&settings, config, error)) return -1;
    return fv_look_feed_watch(f, &settings, &fv_camera_system, error);
}

/* Trackers and memory for frames that are not a camera's. */
static int begin_trackers(struct fv_look_feed *f, struct fv_error *error)
{
    size_t bytes = fv_pupil_scratch_bytes(f->width, f->height);
    if (bytes == 0) return fv_error_set(error, "frames of %dx%d cannot be", f->width, f->height);
    void *scratch = fv_arena_take(fv_arena(), "sensors", bytes, 64);
    f->grey = fv_arena_take(fv_arena(), "sensors", (size_t)f->width * (size_t)f->height, 64);
    for (int eye = 0; eye < f->eyes; eye++)
        fv_eye_tracker_begin(&f->tracker[eye], &f->eye[eye], scratch, bytes);
    return 0;
}

static int open_simulated(struct fv_look_feed *f, const struct fv_config *config, struct fv_error *error)
{
    f->simulated = true;
    f->eyes = 2;
    f->width = (int)config->eye_width;
    f->height = (int)config->eye_height;
    f->seed = (uint64_t)config->eye_seed;
    f->period_ns = (int64_t)(1e9 / config->eye_hz);
    if (fv_camera_source_eyes(f->eye, config, 2, error)) return -1;
    for (int eye = 0; eye < 2; eye++) {
        f->camera[eye] = fv_eye_camera_usual(f->width, f->height, f->seed + (uint64_t)eye);
        f->eye[eye].leds = f->camera[eye].leds;
    }
    return begin_trackers(f, error);
}

static int open_recorded(struct fv_look_feed *f, const struct fv_config *config, struct fv_error *error)
{
    char path[FV_PATH_MAX];
    struct fv_error why;
    f->recorded = true;
    if (config->eye_tape[0] || !config->eye_device[0])
        return fv_config_error(
            error, config->eye_tape[0] ? "eye.tape" : "eye.device",
            "a calibration is made of frames; eye.device must name their folder, and eye.tape "
            "be empty");
    if (fv_path_join(path, config->eye_device, "targets.csv"))
        return fv_config_error(error, "eye.device", "path too long");
    f->rows = fv_targets_read(f->shown, path, &why);
    if (f->rows < 0) return fv_config_error(error, "eye.device", "%s", why.text);
    for (int eye = 0; eye < 2; eye++) {
        const struct fv_camera_layout *l = &f->tape[eye].layout;
        if (fv_path_join(path, config->eye_device, fv_frame_tape_name[eye]))
            return fv_config_error(error, "eye.device", "path too long");
        if (eye == 1 && !fv_file_exists(path)) break;
        if (fv_frame_tape_read(&f->tape[eye], path, &why))
            return fv_config_error(error, "eye.device", "%s", why.text);
        if (eye == 1 && (l->width != f->width || l->height != f->height))
            return fv_config_error(
                error, "eye.device",
                "%s: frames are %dx%d, the left eye's are %dx%d; a calibration is of one size", path,
                l->width, l->height, f->width, f->height);
        f->width = l->width;
        f->height = l->height;
        f->eyes++;
    }
    if (fv_camera_source_eyes(f->eye, config, f->eyes, error)) return -1;
    return begin_trackers(f, error);
}

int fv_look_feed_open(struct fv_look_feed *f, const struct fv_config *config, struct fv_error *error)
{
    static const struct {
        const char *source;
        int (*open)(struct fv_look_feed *f, const struct fv_config *config, struct fv_error *error);
    } kind[] = {{"v4l2", open_cameras}, {"sim-camera", open_simulated}, {"tape", open_recorded}};
    static struct fv_config fresh;
    fresh = *config;
    fresh.eye_calibration[0] = 0;
    memset(f, 0, sizeof *f);
    for (unsigned i = 0; i < sizeof kind / sizeof kind[0]; i++)
        if (strcmp(config->eye_source, kind[i].source) == 0) return kind[i].open(f, &fresh, error);
    return fv_config_error(error, "eye.source",
                           "'%s' has no cameras to calibrate; there are: v4l2 sim-camera tape",
                           config->eye_source);
}

int fv_look_feed_record(struct fv_look_feed *f, const char *folder, struct fv_error *error)
{
    const int width[2] = {f->width, f->width}, height[2] = {f->height, f->height};
    char path[FV_PATH_MAX];
    if (f->watch) {
        if (fv_frame_recorder_open(&f->recorder, folder, f->eyes, width, height, error)) return -1;
        atomic_store_explicit(&f->watch->recorder, f->recorder, memory_order_release);
        return 0;
    }
    /* Simulated frames can wait for the disk. */
    struct fv_camera_layout layout = {fv_camera_format_named("GREY"), f->width, f->height, (size_t)f->width};
    f->tape_out = fv_arena_take(fv_arena(), "sensors", 2 * sizeof *f->tape_out, 64);
    for (int eye = 0; eye < f->eyes; eye++) {
        if (fv_path_join(path, folder, fv_frame_tape_name[eye]))
            return fv_error_set(error, "%.100s: path too long", folder);
        if (fv_writer_open(&f->tape_out[eye], path, error)) return -1;
        fv_frame_tape_begin(&f->tape_out[eye], &layout);
    }
    return 0;
}

int64_t fv_look_feed_now_ns(const struct fv_look_feed *f)
{
    return f->watch ? f->watch->io->now_ns(f->watch->io->context) : f->now_ns;
}

/* Where simulated eyes look, without their unrest. */
static void gaze_at(const struct fv_look_feed *f, int64_t t_ns, double at_deg[2])
{
    double way = hypot(f->to_deg[0] - f->from_deg[0], f->to_deg[1] - f->from_deg[1]),
           lasts_s = 0.0022 * way + 0.021, since_s = (double)(t_ns - f->since_ns - latency_ns) * 1e-9,
           done = fv_motion_minimum_jerk(since_s / lasts_s);
    for (int i = 0; i < 2; i++) at_deg[i] = f->from_deg[i] + done * (f->to_deg[i] - f->from_deg[i]);
}

void fv_look_feed_target(struct fv_look_feed *f, const struct fv_target_shown *shown)
{
    double at_deg[2];
    gaze_at(f, shown->t_ns, at_deg);
    memcpy(f->from_deg, at_deg, sizeof at_deg);
    memcpy(f->to_deg, shown->at_deg, sizeof f->to_deg);
    f->since_ns = shown->t_ns;
}

/* A frame of a simulated eye: lids and pupil as ever (fv_eye_state_at), the gaze at the target, with a
 * fixation's drift. */
static void simulate(struct fv_look_feed *f, int eye, int64_t t_ns)
{
    struct fv_eye_state state;
    struct fv_eye_look look;
    struct fv_eye_frame frame = {f->grey, f->width, f->height, f->width};
    double at_deg[2];
    gaze_at(f, t_ns, at_deg);
    for (int i = 0; i < 2; i++)
        at_deg[i] += 0.06 * fv_motion_noise(f->seed, FV_MOTION_DRIFT + i, t_ns, 0.3, 5);
    fv_eye_state_at(f->seed, eye, t_ns, &state);
    fv_gaze_vector(at_deg, state.direction);
    state.direction[0] = -state.direction[0]; /* the camera faces the eye */
    fv_eye_image(&f->camera[eye], &state, f->grey, f->width, NULL);
    if (f->tape_out)
        fv_frame_tape_write(&f->tape_out[eye], t_ns, f->grey, (size_t)f->width * (size_t)f->height);
    fv_eye_tracker_frame(&f->tracker[eye], &frame, t_ns, &look);
    looked(f, eye, &look);
}

void fv_look_feed_until(struct fv_look_feed *f, int64_t t_ns)
{
    if (f->watch)
        for (int64_t now_ns; (now_ns = fv_look_feed_now_ns(f)) < t_ns;)
            fv_watch_round(f->watch, t_ns - now_ns);
    if (!f->simulated) return;
    for (; f->next * f->period_ns <= t_ns; f->next++)
        for (int eye = 0; eye < f->eyes; eye++) simulate(f, eye, f->next * f->period_ns);
    f->now_ns = t_ns;
}

void fv_look_feed_play(struct fv_look_feed *f)
{
    for (int eye = 0; eye < f->eyes; eye++) {
        const struct fv_frame_tape *tape = &f->tape[eye];
        const struct fv_camera_layout *l = &tape->layout;
        struct fv_eye_frame frame = {f->grey, l->width, l->height, l->width};
        const uint8_t *bytes;
        size_t at = tape->begin;
        int64_t t_ns = INT64_MIN;
        while ((bytes = fv_frame_tape_next(tape, &at, t_ns, &t_ns))) {
            struct fv_eye_look look;
            /* A whole frame of a layout that was checked: this cannot fail. */
            fv_camera_decode(l, bytes, fv_camera_frame_bytes(l), f->grey, (size_t)l->width);
            fv_eye_tracker_frame(&f->tracker[eye], &frame, t_ns, &look);
            looked(f, eye, &look);
        }
    }
}

int fv_look_feed_close(struct fv_look_feed *f, struct fv_error *error)
{
    int failed = 0;
    struct fv_error why;
    if (f->watch) {
        atomic_store_explicit(&f->watch->recorder, NULL, memory_order_release);
        fv_watch_stop(f->watch);
    }
    if (f->recorder) {
        if (fv_frame_recorder_close(f->recorder, &why)) failed = fv_error_set(error, "%s", why.text);
        if (atomic_load(&f->recorder->dropped) > 0) fv_log("eye camera: the tape gives another calibration");
    }
    for (int eye = 0; f->tape_out && eye < f->eyes; eye++)
        if (fv_writer_close_cut(&f->tape_out[eye], &why) && !failed) failed = fv_error_set(error, "%s", why.text);
    return failed;
}
