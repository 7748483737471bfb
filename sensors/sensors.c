/* sensors: the table of sources, and what becomes of a sample before the loop gets it: a bad pose is
 * replaced by the last good one, a lost gaze is held for a while and then led to the centre. All of it
 * depends on nothing but the samples and the times of the latches, so that a replay gives the same. */
#include "sensors/sensors.h"

#include "platform/arena.h"
#include "sensors/motion.h"
#include "sensors/tape.h"

#include <math.h>
#include <string.h>

static const double return_s = 0.3; /* time of the move to the centre */
static const double lost_deg = 20;  /* uncertainty when nothing is known */
static const double ahead[3] = {0, 0, -1};

struct fv_sensors {
    const struct eye_source *eye;
    const struct imu_source *imu;
    struct fv_tape eye_tape, imu_tape;
    uint64_t eye_seed, imu_seed;
    double hold_s, noise_deg;
    struct fv_sensors_counts counts;
    struct fv_pose pose;        /* last good one */
    struct fv_gaze_sample gaze; /* last good one; valid: there was one */
    int64_t gaze_latch_ns;      /* when it was latched */
};

struct eye_source {
    const char *name;
    int (*open)(struct fv_sensors *s, const struct fv_config *config, struct fv_error *error);
    bool (*sample)(const struct fv_sensors *s, int64_t t_ns, struct fv_gaze_sample *gaze); /* false: none */
};

struct imu_source {
    const char *name;
    int (*open)(struct fv_sensors *s, const struct fv_config *config, struct fv_error *error);
    bool (*sample)(const struct fv_sensors *s, int64_t t_ns, struct fv_pose *head); /* false: none */
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

static int open_eye_tape(struct fv_sensors *s, const struct fv_config *config, struct fv_error *error)
{
    if (open_tape(&s->eye_tape, "eye.tape", config->eye_tape, error)) return -1;
    if (s->eye_tape.gazes == 0)
        return fv_config_error(error, "eye.tape", "%s holds head poses but no gaze", config->eye_tape);
    s->counts.gaze_lost = s->eye_tape.rejected;
    return 0;
}

static int open_imu_tape(struct fv_sensors *s, const struct fv_config *config, struct fv_error *error)
{
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

static bool eye_tape(const struct fv_sensors *s, int64_t t_ns, struct fv_gaze_sample *gaze)
{
    fv_tape_gaze_at(&s->eye_tape, t_ns, gaze);
    return true;
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

static bool imu_tape(const struct fv_sensors *s, int64_t t_ns, struct fv_pose *head)
{
    fv_tape_head_at(&s->imu_tape, t_ns, head);
    return true;
}

static bool imu_none(const struct fv_sensors *s, int64_t t_ns, struct fv_pose *head)
{
    (void)s, (void)t_ns;
    *head = (struct fv_pose){.rotation = {1, 0, 0, 0}};
    return false;
}

static const struct eye_source eye_sources[] = {
    {"sim", open_nothing, eye_sim}, {"tape", open_eye_tape, eye_tape}, {"none", open_nothing, eye_none}};
static const struct imu_source imu_sources[] = {
    {"sim", open_nothing, imu_sim}, {"tape", open_imu_tape, imu_tape}, {"none", open_nothing, imu_none}};

int fv_sensors_open(struct fv_sensors **sensors, const struct fv_config *config, struct fv_error *error)
{
    struct fv_sensors *s = fv_arena_take(fv_arena(), "sensors", sizeof *s, 64);
    *s = (struct fv_sensors){.eye_seed = (uint64_t)config->eye_seed,
                             .imu_seed = (uint64_t)config->imu_seed,
                             .hold_s = config->eye_hold_ms * 1e-3,
                             .noise_deg = config->eye_noise_deg,
                             .pose = {.rotation = {1, 0, 0, 0}}};
    for (unsigned i = 0; i < sizeof eye_sources / sizeof eye_sources[0]; i++)
        if (strcmp(config->eye_source, eye_sources[i].name) == 0) s->eye = &eye_sources[i];
    for (unsigned i = 0; i < sizeof imu_sources / sizeof imu_sources[0]; i++)
        if (strcmp(config->imu_source, imu_sources[i].name) == 0) s->imu = &imu_sources[i];
    if (!s->eye) return fv_config_error(error, "eye.source", "'%s' is no source of gaze", config->eye_source);
    if (!s->imu)
        return fv_config_error(error, "imu.source", "'%s' is no source of head poses", config->imu_source);
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
    for (int eye = 0; eye < 2; eye++) {
        if (gone <= 0) memcpy(gaze->direction[eye], s->gaze.direction[eye], sizeof gaze->direction[eye]);
        else if (gone >= 1) memcpy(gaze->direction[eye], ahead, sizeof ahead);
        else turn_ahead(s->gaze.direction[eye], gone, gaze->direction[eye]);
    }
    gaze->t_ns = s->gaze.valid ? s->gaze.t_ns : t_ns;
    gaze->uncertainty_deg = s->noise_deg + fmax(lost_deg - s->noise_deg, 0) * lost;
    gaze->held = true;
}

void fv_sensors_latch(struct fv_sensors *s, int64_t t_ns, struct fv_pose *head, struct fv_gaze *gaze)
{
    struct fv_gaze_sample sample;
    struct fv_pose pose;
    s->counts.imu_samples += s->imu->sample(s, t_ns, &pose);
    if (fv_head_pose_good(&pose)) s->pose = pose;
    else s->counts.imu_rejected++;
    *head = s->pose;
    s->counts.gaze_samples += s->eye->sample(s, t_ns, &sample);
    if (sample.valid && fv_gaze_direction_good(sample.direction[0]) &&
        fv_gaze_direction_good(sample.direction[1])) {
        s->gaze = sample;
        s->gaze_latch_ns = t_ns;
        *gaze = (struct fv_gaze){.t_ns = sample.t_ns, .uncertainty_deg = s->noise_deg};
        memcpy(gaze->direction, sample.direction, sizeof gaze->direction);
    } else {
        s->counts.gaze_lost++;
        hold(s, t_ns, gaze);
    }
}

struct fv_sensors_counts fv_sensors_counts(const struct fv_sensors *s)
{
    return s->counts;
}

const struct fv_tape *fv_sensors_eye_tape(const struct fv_sensors *s)
{
    return s->eye_tape.gazes > 0 ? &s->eye_tape : NULL;
}

const struct fv_tape *fv_sensors_imu_tape(const struct fv_sensors *s)
{
    return s->imu_tape.heads > 0 ? &s->imu_tape : NULL;
}
