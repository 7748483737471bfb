/* camera_source: see the header. */
#include "sensors/eye/camera_source.h"

#include "platform/arena.h"
#include "platform/clock.h"
#include "platform/log.h"
#include "sensors/eye/calibration.h"
#include "sensors/motion.h"

#include <stdio.h>
#include <string.h>

struct fv_camera_source {
    struct fv_watch *watch; /* NULL: simulated, or recorded */
    bool recorded;
    struct fv_watch_news news;
    struct fv_sim_camera sim;
    struct fv_frame_player player;
    struct fv_frame_recorder *recorder;
    struct fv_eye_recorder *looks;
};

static void say(const char *line)
{
    fv_log("eye camera: %s", line);
}

int fv_camera_source_eyes(struct fv_eye_settings eye[2], const struct fv_config *config, int eyes,
                          struct fv_error *error)
{
    static const char *const name[2] = {"left", "right"};
    struct fv_calibration calibration = {0};
    struct fv_error why;
    const double *model = config->eye_model.value;
    if (config->eye_model.count != 3)
        return fv_config_error(error, "eye.model", "must be three numbers: middle x, middle y, radius");
    if (!(model[2] >= 0.01 && model[2] <= 10) && !(model[2] <= -0.01 && model[2] >= -10))
        return fv_config_error(error, "eye.model", "a radius of %g; must be 0.01 to 10, or minus that",
                               model[2]);
    if (config->eye_calibration[0] && fv_calibration_read(&calibration, config->eye_calibration, &why))
        return fv_config_error(error, "eye.calibration", "%s", why.text);
    for (int i = 0; i < eyes; i++) {
        if (config->eye_calibration[0] && calibration.rows[i] == 0)
            return fv_config_error(error, "eye.calibration", "%s holds nothing of the %s eye",
                                   config->eye_calibration, name[i]);
        eye[i] = (struct fv_eye_settings){.map = calibration.map[i],
                                          .width = calibration.width,
                                          .height = calibration.height,
                                          .model = {model[0], model[1], model[2]},
                                          .confidence = config->eye_confidence,
                                          .leds = (int)config->eye_leds};
    }
    return 0;
}

void fv_camera_settings_of(struct fv_camera_settings *camera, const struct fv_config *config, const char *key,
                           const char *path)
{
    *camera = (struct fv_camera_settings){.key = key,
                                          .format = fv_camera_format_named(config->eye_format),
                                          .width = (int)config->eye_width,
                                          .height = (int)config->eye_height,
                                          .hz = config->eye_hz,
                                          .exposure_ns = (int64_t)(config->eye_exposure_ms * 1e6)};
    snprintf(camera->path, sizeof camera->path, "%s", path);
}

int fv_camera_source_settings(struct fv_watch_settings *settings, const struct fv_config *config,
                              struct fv_error *error)
{
    if (!config->eye_device[0])
        return fv_config_error(
            error, "eye.device",
            "no camera is named; must be a path such as /dev/v4l/by-id/..., as eye.source is v4l2");
    *settings = (struct fv_watch_settings){.cameras = config->eye_device_right[0] ? 2 : 1,
                                           .settle_s = config->eye_settle_ms * 1e-3};
    if (fv_camera_source_eyes(settings->eye, config, settings->cameras, error)) return -1;
    fv_camera_settings_of(&settings->camera[0], config, "eye.device", config->eye_device);
    fv_camera_settings_of(&settings->camera[1], config, "eye.device_right", config->eye_device_right);
    return 0;
}

static int open_cameras(struct fv_camera_source *s, const struct fv_config *config, struct fv_error *error)
{
    static struct fv_watch_settings settings;
    if (fv_camera_source_settings(&settings, config, error)) return -1;
    if (!config->eye_calibration[0])
        fv_log("eye camera: eye.calibration is not set: gaze by eye.model, some %g degrees off",
               FV_EYE_MODEL_ERROR_DEG);
    if (fv_watch_open(&s->watch, &settings, &fv_camera_system, say, error)) return -1;
    return fv_watch_start(s->watch, error);
}

static int open_simulated(struct fv_camera_source *s, const struct fv_config *config, struct fv_error *error)
{
    struct fv_sim_camera_settings settings = {.seed = (uint64_t)config->eye_seed,
                                              .width = (int)config->eye_width,
                                              .height = (int)config->eye_height,
                                              .hz = config->eye_hz,
                                              .settle_s = config->eye_settle_ms * 1e-3};
    struct fv_error why;
    if (fv_camera_source_eyes(settings.eye, config, 2, error)) return -1;
    if (config->eye_calibration[0] &&
        (settings.eye[0].width != settings.width || settings.eye[0].height != settings.height))
        return fv_config_error(error, "eye.calibration",
                               "%s is of frames of %dx%d, eye.width and eye.height are %dx%d",
                               config->eye_calibration, settings.eye[0].width, settings.eye[0].height,
                               settings.width, settings.height);
    if (fv_sim_camera_open(&s->sim, &settings, &why))
        return fv_config_error(error, "eye.width", "%s", why.text);
    return 0;
}

static int open_recorded(struct fv_camera_source *s, const struct fv_config *config, struct fv_error *error)
{
    struct fv_eye_settings eye[2];
    struct fv_error why;
    char right[FV_PATH_MAX];
    bool both = fv_path_join(right, config->eye_device, fv_frame_tape_name[1]) == 0 && fv_file_exists(right);
    memset(eye, 0, sizeof eye);
    if (fv_camera_source_eyes(eye, config, both ? 2 : 1, error)) return -1;
    s->recorded = true;
    if (fv_frame_player_open(&s->player, config->eye_device, eye, config->eye_settle_ms * 1e-3, &why))
        return fv_config_error(error, "eye.device", "%s", why.text);
    return 0;
}

int fv_camera_source_open(struct fv_camera_source **source, const struct fv_config *config,
                          struct fv_error *error)
{
    struct fv_camera_source *s = fv_arena_take(fv_arena(), "sensors", sizeof *s, 64);
    memset(s, 0, sizeof *s);
    static const struct {
        const char *source;
        int (*open)(struct fv_camera_source *s, const struct fv_config *config, struct fv_error *error);
    } kind[] = {{"v4l2", open_cameras}, {"sim-camera", open_simulated}, {"tape", open_recorded}};
    for (unsigned i = 0; i < sizeof kind / sizeof kind[0]; i++)
        if (strcmp(config->eye_source, kind[i].source) == 0 && kind[i].open(s, config, error)) return -1;
    *source = s;
    return 0;
}

int fv_camera_source_history(struct fv_camera_source *s, int64_t t_ns, const struct fv_gaze_sample **history,
                             int64_t *at_ns)
{
    if (s->watch) {
        fv_watch_read(s->watch, &s->news);
        *history = s->news.sample;
        *at_ns = fv_clock_now_ns(&fv_clock_monotonic);
        return s->news.samples;
    }
    int64_t into_ns, period_ns = s->recorded ? s->player.length_ns : s->sim.period_ns,
                     epoch = fv_motion_epoch(t_ns, period_ns, &into_ns);
    *at_ns = epoch * period_ns + into_ns; /* t_ns, but for times that are out of range */
    *history = s->recorded ? s->player.sample : s->sim.sample;
    return s->recorded ? fv_frame_player_until(&s->player, *at_ns) : fv_sim_camera_until(&s->sim, *at_ns);
}

void fv_camera_source_counts(struct fv_camera_source *s, struct fv_eye_camera_counts *counts)
{
    struct fv_watch_tally tally;
    memset(counts, 0, sizeof *counts);
    if (!s->watch || !fv_watch_count(s->watch, &tally)) return;
    counts->cameras = s->watch->cameras;
    for (int i = 0; i < counts->cameras; i++) {
        const struct fv_camera_counts *c = &tally.camera[i];
        counts->frames += c->frames;
        counts->skipped += c->skipped;
        counts->gaps += c->gaps;
        counts->rejected += c->flagged + c->shorted + c->corrupt;
        counts->untimed += c->untimed;
        counts->errors += c->errors;
        counts->lost += c->lost;
        counts->restarts += c->restarts;
    }
    counts->no_pupil = tally.unseen.no_pupil;
    counts->unsure = tally.unseen.unsure;
    counts->blinks = tally.unseen.blinks;
    if (tally.latency.frames > 0)
        counts->latency_ms_mean = 1e-6 * (double)tally.latency.sum_ns / (double)tally.latency.frames;
    counts->latency_ms_most = 1e-6 * (double)tally.latency.most_ns;
}

int fv_camera_source_record(struct fv_camera_source *s, const char *folder, struct fv_error *error)
{
    int width[2] = {0, 0}, height[2] = {0, 0};
    if (!s->watch) return 0;
    for (int i = 0; i < s->watch->cameras; i++) fv_watch_size(s->watch, i, &width[i], &height[i]);
    if (fv_frame_recorder_open(&s->recorder, folder, s->watch->cameras, width, height, error)) return -1;
    atomic_store_explicit(&s->watch->recorder, s->recorder, memory_order_release);
    return 0;
}

int fv_camera_source_record_looks(struct fv_camera_source *s, const char *folder, struct fv_spooler *spooler,
                                  struct fv_error *error)
{
    if (!s->watch) return 0;
    if (fv_eye_recorder_open(&s->looks, folder, spooler, error)) return -1;
    atomic_store_explicit(&s->watch->looks, s->looks, memory_order_release);
    return 0;
}

static int end_frames(struct fv_camera_source *s, struct fv_error *error)
{
    struct fv_frame_recorder *r = s->recorder;
    if (!r) return 0;
    s->recorder = NULL;
    atomic_store_explicit(&s->watch->recorder, NULL, memory_order_release);
    return fv_frame_recorder_close(r, error);
}

int fv_camera_source_record_end(struct fv_camera_source *s, int64_t session_ns, struct fv_error *error)
{
    struct fv_error later;
    int failed = 0;
    if (s->looks) {
        atomic_store_explicit(&s->watch->looks, NULL, memory_order_release);
        failed = fv_eye_recorder_close(s->looks, session_ns, error);
    }
    s->looks = NULL;
    if (end_frames(s, failed ? &later : error)) failed = -1;
    return failed;
}

void fv_camera_source_close(struct fv_camera_source *s)
{
    if (s->watch && !fv_watch_stop(s->watch)) fv_log("eye camera: does not answer; it is given back by the end of the program");
}
