/* sensors: the table of sources, and what becomes of a sample before the loop gets it: a bad pose is
 * replaced by the last good one, a lost gaze is held for a while and then led to the centre. All of it
 * depends on nothing but the samples and the times of the latches, so that a replay gives the same. */
#include "sensors/sensors.h"

#include "platform/arena.h"
#include "platform/clock.h"
#include "sensors/eye/camera_source.h"
#include "sensors/imu/player.h"
#include "sensors/imu/usb.h"
#include "sensors/motion.h"
#include "sensors/predict.h"
#include "sensors/tape.h"

#include <math.h>
#include <string.h>

static const double return_s = 0.3; /* time of the move to the centre */
static const double lost_deg = 20;  /* uncertainty when nothing is known */
static const double ahead[3] = {0, 0, -1};
static const double pursuit_max_deg_s = 100;
/* Rates of the simulated devices: enough samples for the predictors' 20 ms. */
static const int64_t sim_head_period_ns = 1000000, sim_gaze_period_ns = 5000000;
enum { SIM_HEADS = 22, SIM_GAZES = 6 };

struct fv_sensors {
    const struct eye_source *eye;
    const struct imu_source *imu;
    struct fv_tape eye_tape, imu_tape;
    struct fv_imu_usb *imu_usb;
    struct fv_imu_player *imu_player; /* of a raw tape */
    struct fv_neck neck;
    bool predict;
    struct fv_camera_source *cameras;
    uint64_t eye_seed, imu_seed;
    double hold_s, noise_deg;
    const struct fv_head_predictor *predictor;
    struct fv_head_sample sim_head[SIM_HEADS]; /* newest last */
    struct fv_gaze_sample sim_gaze[SIM_GAZES];
    struct fv_sensors_counts counts;
    struct fv_pose pose;        /* last good one */
    struct fv_gaze_sample gaze; /* last good one; valid: there was one */
    int64_t gaze_latch_ns;      /* what time it was latched for */
    int64_t session_ns;         /* CLOCK_MONOTONIC of session time 0; INT64_MIN: nothing is latched yet */
};

/* sample: what is at a time; false: the source gives none; NULL: only what is known counts. history: the samples that
 * are known at a time, oldest first, and that time on their clock; returns their number. ahead, of a device or what it
 * measured: what will be so long after now, predicted by that; the others are NULL. */
struct eye_source {
    const char *name;
    int (*open)(struct fv_sensors *s, const struct fv_config *config, struct fv_error *error);
    bool (*sample)(const struct fv_sensors *s, int64_t t_ns, struct fv_gaze_sample *gaze);
    int (*history)(struct fv_sensors *s, int64_t t_ns, const struct fv_gaze_sample **history, int64_t *at_ns);
};

struct imu_source {
    const char *name;
    int (*open)(struct fv_sensors *s, const struct fv_config *config, struct fv_error *error);
    bool (*sample)(const struct fv_sensors *s, int64_t t_ns, struct fv_pose *head);
    int (*history)(struct fv_sensors *s, int64_t t_ns, const struct fv_head_sample **history, int64_t *at_ns);
    bool (*ahead)(struct fv_sensors *s, int64_t now_ns, int64_t ahead_ns, struct fv_pose *head);
};

static int open_nothing(struct fv_sensors *s, const struct fv_config *config, struct fv_error *error)
{
    (void)s, (void)config, (void)error;
    return 0;
}

/* Reads the tape that the key `dotted` names. */
static int open_tape(struct fv_tape *tape, const char *dotted, const char *path, struct fv_error *error)
{
    if (!path[0])
        return fv_config_error(error, dotted, "no tape is named; must be a file, as %.3s.source is tape",
                               dotted);
    return fv_tape_read(tape, path, error);
}

static int open_cameras(struct fv_sensors *s, const struct fv_config *config, struct fv_error *error)
{
    return fv_camera_source_open(&s->cameras, config, error);
}

static int eye_cameras_history(struct fv_sensors *s, int64_t t_ns, const struct fv_gaze_sample **history,
                               int64_t *at_ns)
{
    return fv_camera_source_history(s->cameras, t_ns, history, at_ns);
}

static const struct eye_source eye_frames = {"tape", open_cameras, NULL, eye_cameras_history};

static int open_eye_tape(struct fv_sensors *s, const struct fv_config *config, struct fv_error *error)
{
    /* A folder of recorded frames. */
    if (!config->eye_tape[0] && config->eye_device[0]) {
        s->eye = &eye_frames;
        return open_cameras(s, config, error);
    }
    if (open_tape(&s->eye_tape, "eye.tape", config->eye_tape, error)) return -1;
    if (s->eye_tape.gazes == 0)
        return fv_config_error(error, "eye.tape", "%s holds head poses but no gaze", config->eye_tape);
    s->counts.gaze_lost = s->eye_tape.rejected;
    return 0;
}

static bool imu_raw(struct fv_sensors *s, int64_t now_ns, int64_t ahead_ns, struct fv_pose *head)
{
    return fv_imu_player_head(s->imu_player, &s->neck, s->predict, now_ns, ahead_ns, head);
}

static const struct imu_source imu_raw_tape = {"tape", NULL, NULL, NULL, imu_raw};

/* A tape of an inertial sensor's raw samples; 1: it is none. */
static int open_imu_raw(struct fv_sensors *s, const struct fv_config *config, struct fv_error *error)
{
    static struct fv_imu_player player;
    if (!config->imu_tape[0]) return 1;
    int result = fv_imu_player_open(&player, config->imu_tape, error);
    if (result) return result;
    s->imu = &imu_raw_tape;
    s->imu_player = &player;
    s->neck = (struct fv_neck){1e-3 * config->imu_neck_up_mm, 1e-3 * config->imu_neck_ahead_mm};
    s->predict = strcmp(config->imu_predict, "hold") != 0;
    s->counts.imu_rejected = player.tape.rejected;
    return 0;
}

static int open_imu_tape(struct fv_sensors *s, const struct fv_config *config, struct fv_error *error)
{
    int raw = open_imu_raw(s, config, error);
    if (raw <= 0) return raw;
    if (open_tape(&s->imu_tape, "imu.tape", config->imu_tape, error)) return -1;
    if (s->imu_tape.heads == 0)
        return fv_config_error(error, "imu.tape", "%s holds no good head pose", config->imu_tape);
    s->counts.imu_rejected = s->imu_tape.rejected;
    return 0;
}

static bool eye_sim(const struct fv_sensors *s, int64_t t_ns, struct fv_gaze_sample *gaze)
{
    fv_sim_gaze(s->eye_seed, t_ns, gaze);
    return true;
}

static int eye_sim_history(struct fv_sensors *s, int64_t t_ns, const struct fv_gaze_sample **history,
                           int64_t *at_ns)
{
    int64_t into_ns, newest = fv_motion_epoch(t_ns, sim_gaze_period_ns, &into_ns);
    for (int i = 0; i < SIM_GAZES; i++)
        fv_sim_gaze(s->eye_seed, (newest - (SIM_GAZES - 1) + i) * sim_gaze_period_ns, &s->sim_gaze[i]);
    *history = s->sim_gaze;
    *at_ns = newest * sim_gaze_period_ns + into_ns;
    return SIM_GAZES;
}

static bool eye_tape(const struct fv_sensors *s, int64_t t_ns, struct fv_gaze_sample *gaze)
{
    fv_tape_gaze_at(&s->eye_tape, t_ns, gaze);
    return true;
}

static int eye_tape_history(struct fv_sensors *s, int64_t t_ns, const struct fv_gaze_sample **history,
                            int64_t *at_ns)
{
    return fv_tape_gaze_history(&s->eye_tape, t_ns, history, at_ns);
}

static bool eye_none(const struct fv_sensors *s, int64_t t_ns, struct fv_gaze_sample *gaze)
{
    (void)s;
    *gaze = (struct fv_gaze_sample){.t_ns = t_ns, .direction = {{0, 0, -1}, {0, 0, -1}}, .valid = true};
    return false;
}

static bool imu_sim(const struct fv_sensors *s, int64_t t_ns, struct fv_pose *head)
{
    fv_sim_head(s->imu_seed, t_ns, head);
    return true;
}

static int imu_sim_history(struct fv_sensors *s, int64_t t_ns, const struct fv_head_sample **history,
                           int64_t *at_ns)
{
    int64_t into_ns, newest = fv_motion_epoch(t_ns, sim_head_period_ns, &into_ns);
    for (int i = 0; i < SIM_HEADS; i++) {
        s->sim_head[i].t_ns = (newest - (SIM_HEADS - 1) + i) * sim_head_period_ns;
        fv_sim_head(s->imu_seed, s->sim_head[i].t_ns, &s->sim_head[i].pose);
    }
    *history = s->sim_head;
    *at_ns = newest * sim_head_period_ns + into_ns;
    return SIM_HEADS;
}

static bool imu_tape(const struct fv_sensors *s, int64_t t_ns, struct fv_pose *head)
{
    fv_tape_head_at(&s->imu_tape, t_ns, head);
    return true;
}

static int imu_tape_history(struct fv_sensors *s, int64_t t_ns, const struct fv_head_sample **history,
                            int64_t *at_ns)
{
    return fv_tape_head_history(&s->imu_tape, t_ns, history, at_ns);
}

static bool imu_none(const struct fv_sensors *s, int64_t t_ns, struct fv_pose *head)
{
    (void)s, (void)t_ns;
    *head = (struct fv_pose){.rotation = {1, 0, 0, 0}};
    return false;
}

static int open_imu_usb(struct fv_sensors *s, const struct fv_config *config, struct fv_error *error)
{
    return fv_imu_usb_open(&s->imu_usb, config, error);
}

static bool imu_usb(struct fv_sensors *s, int64_t now_ns, int64_t ahead_ns, struct fv_pose *head)
{
    (void)now_ns; /* of the clock */
    return fv_imu_usb_head(s->imu_usb, ahead_ns, head);
}

/* A source without a history is as it is at any time. */
static const struct eye_source eye_sources[] = {{"sim", open_nothing, eye_sim, eye_sim_history},
                                                {"tape", open_eye_tape, eye_tape, eye_tape_history},
                                                {"v4l2", open_cameras, NULL, eye_cameras_history},
                                                {"sim-camera", open_cameras, NULL, eye_cameras_history},
                                                {"none", open_nothing, eye_none, NULL}};
static const struct imu_source imu_sources[] = {{"sim", open_nothing, imu_sim, imu_sim_history, NULL},
                                                {"tape", open_imu_tape, imu_tape, imu_tape_history, NULL},
                                                {"usb", open_imu_usb, NULL, NULL, imu_usb},
                                                {"none", open_nothing, imu_none, NULL, NULL}};

int fv_sensors_open(struct fv_sensors **sensors, const struct fv_config *config, struct fv_error *error)
{
    struct fv_sensors *s = fv_arena_take(fv_arena(), "sensors", sizeof *s, 64);
    *s = (struct fv_sensors){.eye_seed = (uint64_t)config->eye_seed,
                             .imu_seed = (uint64_t)config->imu_seed,
                             .hold_s = config->eye_hold_ms * 1e-3,
                             .noise_deg = config->eye_noise_deg,
                             .pose = {.rotation = {1, 0, 0, 0}},
                             .session_ns = INT64_MIN};
    for (unsigned i = 0; i < sizeof eye_sources / sizeof eye_sources[0]; i++)
        if (strcmp(config->eye_source, eye_sources[i].name) == 0) s->eye = &eye_sources[i];
    for (unsigned i = 0; i < sizeof imu_sources / sizeof imu_sources[0]; i++)
        if (strcmp(config->imu_source, imu_sources[i].name) == 0) s->imu = &imu_sources[i];
    for (int i = 0; i < FV_HEAD_PREDICTORS; i++)
        if (strcmp(config->imu_predict, fv_head_predictors[i].name) == 0)
            s->predictor = &fv_head_predictors[i];
    if (!s->eye) return fv_config_error(error, "eye.source", "'%s' is no source of gaze", config->eye_source);
    if (!s->imu)
        return fv_config_error(error, "imu.source", "'%s' is no source of head poses", config->imu_source);
    if (!s->predictor)
        return fv_config_error(error, "imu.predict", "'%s' is no way to predict", config->imu_predict);
    if (s->eye->open(s, config, error) || s->imu->open(s, config, error)) return -1;
    *sensors = s;
    return 0;
}

/* out = direction, turned the fraction `part` of its angle to straight ahead. */
static void turn_ahead(const double direction[3], double part, double out[3])
{
    double sine = hypot(direction[0], direction[1]), angle = atan2(sine, -direction[2]), rotation[4];
    double scale = sine > 1e-12 ? part * angle / sine : 0;
    double vector[3] = {-direction[1] * scale, direction[0] * scale, 0}; /* about direction x ahead */
    fv_quat_from_vector(vector, rotation);
    fv_quat_rotate(rotation, direction, out);
}

/* What the gaze is taken to be when it is lost. */
static void hold(const struct fv_sensors *s, int64_t t_ns, struct fv_gaze *gaze)
{
    double seconds = ((double)t_ns - (double)s->gaze_latch_ns) * 1e-9;
    double gone = s->gaze.valid ? fv_motion_minimum_jerk((seconds - s->hold_s) / return_s) : 1;
    double lost = !s->gaze.valid || seconds >= s->hold_s ? 1 : seconds > 0 ? seconds / s->hold_s : 0;
    double known_deg = s->gaze.valid ? s->gaze.uncertainty_deg : s->noise_deg;
    for (int eye = 0; eye < 2; eye++) {
        if (gone <= 0) memcpy(gaze->direction[eye], s->gaze.direction[eye], sizeof gaze->direction[eye]);
        else if (gone >= 1) memcpy(gaze->direction[eye], ahead, sizeof ahead);
        else turn_ahead(s->gaze.direction[eye], gone, gaze->direction[eye]);
    }
    gaze->t_ns = s->gaze.valid ? s->gaze.t_ns : t_ns;
    gaze->uncertainty_deg = known_deg + fmax(lost_deg - known_deg, 0) * lost;
    gaze->held = true;
}

/* How far show_ns lies behind now_ns, at most what is predicted. */
static int64_t horizon_ns(int64_t now_ns, int64_t show_ns)
{
    uint64_t ns = (uint64_t)show_ns - (uint64_t)now_ns;
    return ns < FV_PREDICT_MAX_NS ? (int64_t)ns : FV_PREDICT_MAX_NS;
}

/* The pose at show_ns, predicted from what is known at now_ns where that is earlier; false: the source
 * gives none. */
static bool head_for(struct fv_sensors *s, int64_t now_ns, int64_t show_ns, struct fv_pose *head)
{
    const struct fv_head_sample *history;
    int64_t at_ns;
    if (s->imu->ahead)
        return now_ns < show_ns ? s->imu->ahead(s, now_ns, horizon_ns(now_ns, show_ns), head)
                                : s->imu->ahead(s, show_ns, 0, head);
    if (now_ns >= show_ns || !s->imu->history) return s->imu->sample(s, show_ns, head);
    int count = s->imu->history(s, now_ns, &history, &at_ns);
    s->predictor->predict(history, count, at_ns + horizon_ns(now_ns, show_ns), head);
    return true;
}

/* The gaze at show_ns, or the newest that is known at now_ns where that is earlier, with the uncertainty that
 * it has at show_ns; false: the source gives none. */
static bool gaze_for(struct fv_sensors *s, int64_t now_ns, int64_t show_ns, struct fv_gaze_sample *gaze)
{
    const struct fv_gaze_sample *history;
    int64_t at_ns, age_ns;
    bool late = (now_ns < show_ns || !s->eye->sample) && s->eye->history;
    if (!late) {
        bool any = s->eye->sample(s, show_ns, gaze);
        if (!(gaze->uncertainty_deg > 0)) gaze->uncertainty_deg = s->noise_deg;
        return any;
    }
    if (now_ns > show_ns) now_ns = show_ns;
    int count = s->eye->history(s, now_ns, &history, &at_ns);
    *gaze = count > 0 ? history[count - 1] : (struct fv_gaze_sample){.t_ns = at_ns};
    age_ns = at_ns > gaze->t_ns ? at_ns - gaze->t_ns : 0;
    gaze->t_ns = now_ns < INT64_MIN + age_ns ? INT64_MIN : now_ns - age_ns;
    gaze->valid = gaze->valid && age_ns <= FV_TAPE_STALE_NS;
    double known_deg = gaze->uncertainty_deg > 0 ? gaze->uncertainty_deg : s->noise_deg;
    double speed_deg_s = fmin(fv_gaze_speed_deg_s(history, count, known_deg), pursuit_max_deg_s);
    double moved_deg = speed_deg_s * 1e-9 * (double)(age_ns + horizon_ns(now_ns, show_ns));
    gaze->uncertainty_deg = fmin(known_deg + moved_deg, fmax(known_deg, lost_deg));
    return true;
}

void fv_sensors_latch(struct fv_sensors *s, int64_t now_ns, int64_t show_ns, struct fv_pose *head,
                      struct fv_gaze *gaze)
{
    struct fv_gaze_sample sample;
    struct fv_pose pose;
    if (s->session_ns == INT64_MIN)
        s->session_ns = (int64_t)((uint64_t)fv_clock_now_ns(&fv_clock_monotonic) - (uint64_t)now_ns);
    s->counts.imu_samples += head_for(s, now_ns, show_ns, &pose);
    if (fv_head_pose_good(&pose)) s->pose = pose;
    else s->counts.imu_rejected++;
    *head = s->pose;
    s->counts.gaze_samples += gaze_for(s, now_ns, show_ns, &sample);
    if (sample.valid && fv_gaze_direction_good(sample.direction[0]) &&
        fv_gaze_direction_good(sample.direction[1])) {
        s->gaze = sample;
        s->gaze_latch_ns = show_ns;
        *gaze = (struct fv_gaze){.t_ns = sample.t_ns, .uncertainty_deg = sample.uncertainty_deg};
        memcpy(gaze->direction, sample.direction, sizeof gaze->direction);
    } else {
        s->counts.gaze_lost++;
        hold(s, show_ns, gaze);
    }
}

struct fv_sensors_counts fv_sensors_counts(const struct fv_sensors *s)
{
    struct fv_sensors_counts counts = s->counts;
    if (s->cameras) fv_camera_source_counts(s->cameras, &counts.camera);
    if (!s->imu_usb && !s->imu_player) return counts;
    struct fv_imu_feed_counts of = s->imu_usb ? fv_imu_usb_counts(s->imu_usb) : s->imu_player->feed.state.counts;
    if (of.connects == 0) return counts;
    counts.imu_rejected += of.rejected + of.foreign + of.too_long;
    counts.imu_readings = of.samples;
    counts.imu_lost = of.lost;
    counts.imu_reconnects = of.connects - 1;
    counts.imu = (struct fv_imu_insane){of.repeated, of.restarts, of.mistimed, of.bad, of.stuck, of.saturated};
    return counts;
}

void fv_sensors_close(struct fv_sensors *s)
{
    if (s->cameras) fv_camera_source_close(s->cameras);
    if (s->imu_usb) fv_imu_usb_close(s->imu_usb);
}

const struct fv_tape *fv_sensors_eye_tape(const struct fv_sensors *s)
{
    return s->eye_tape.gazes > 0 ? &s->eye_tape : NULL;
}

const struct fv_tape *fv_sensors_imu_tape(const struct fv_sensors *s)
{
    return s->imu_tape.heads > 0 ? &s->imu_tape : NULL;
}

int fv_sensors_record(struct fv_sensors *s, const char *folder, bool raw, bool frames, struct fv_spooler *spooler,
                      struct fv_error *error)
{
    if (raw && s->imu_usb && fv_imu_usb_record(s->imu_usb, folder, spooler, error)) return -1;
    if (raw && s->cameras && fv_camera_source_record_looks(s->cameras, folder, spooler, error)) return -1;
    return frames && s->cameras ? fv_camera_source_record(s->cameras, folder, error) : 0;
}

int fv_sensors_record_end(struct fv_sensors *s, struct fv_error *error)
{
    struct fv_error later;
    int failed = s->imu_usb ? fv_imu_usb_record_end(s->imu_usb, s->session_ns, error) : 0;
    if (s->cameras && fv_camera_source_record_end(s->cameras, s->session_ns, failed ? &later : error)) failed = -1;
    return failed;
}
