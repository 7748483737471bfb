/* predict: see predict.h. */
#include "sensors/predict.h"

#include "sensors/tape.h"

#include <math.h>
#include <string.h>

enum { HISTORY = 64 };

/* Samples further apart say nothing about velocity; the slope's window; how fast a velocity decays
 * (after 0.2 s a turn of the head has mostly ended). */
static const int64_t apart_ns = 50000000, window_ns = 20000000;
static const double decay_s = 0.2;
/* Beyond these a difference of samples is an error of theirs, no motion (2000 and 1000 degrees a second). */
static const double head_rate_max = 35, head_speed_max_m_s = 10, gaze_rate_max = 17.5;

struct velocity {
    double rate[3];    /* rad/s, in the newest sample's axes */
    double speed[3];   /* m/s, world */
};

static double until(int64_t newest_ns, int64_t t_ns)
{
    if (t_ns <= newest_ns) return 0;
    uint64_t ahead = (uint64_t)t_ns - (uint64_t)newest_ns;
    return 1e-9 * (double)(ahead < FV_PREDICT_MAX_NS ? ahead : FV_PREDICT_MAX_NS);
}

static bool apart(int64_t newer_ns, int64_t older_ns)
{
    return (uint64_t)newer_ns - (uint64_t)older_ns > (uint64_t)apart_ns;
}

/* Good samples, newest first, as far as each is less than apart_ns older than the one after it; of equal
 * ones the first. */
static int head_history(const struct fv_head_sample *history, int count, const struct fv_head_sample **out)
{
    int n = 0;
    int64_t seen_ns = 0; /* the newest time of out[n - 1]'s pose */
    for (int i = count - 1; i >= 0 && i >= count - HISTORY; i--) {
        const struct fv_head_sample *s = &history[i];
        if (!fv_head_pose_good(&s->pose) || (n > 0 && s->t_ns >= out[n - 1]->t_ns)) continue;
        bool again = n > 0 && memcmp(&out[n - 1]->pose, &s->pose, sizeof s->pose) == 0;
        if (n > 0 && apart(again ? seen_ns : out[n - 1]->t_ns, s->t_ns)) break;
        if (!again) seen_ns = s->t_ns;
        out[again ? n - 1 : n++] = s;
    }
    return n;
}

static double length3(const double v[3])
{
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

/* Least-squares slope over the newest n samples: of position, and of the rotation vector from the newest
 * one; no motion where there is none to be had. Two samples: their difference quotient. */
static struct velocity slope(const struct fv_head_sample *const *s, int n)
{
    double time[HISTORY], value[HISTORY][6], mean_t = 0, mean[6] = {0}, along[6] = {0}, spread = 0;
    struct velocity v = {0};
    if (n < 2) return v;
    for (int i = 0; i < n; i++) {
        time[i] = -1e-9 * (double)(s[0]->t_ns - s[i]->t_ns);
        fv_quat_between(s[0]->pose.rotation, s[i]->pose.rotation, value[i]);
        for (int k = 0; k < 3; k++) value[i][3 + k] = s[i]->pose.position_m[k] - s[0]->pose.position_m[k];
        mean_t += time[i] / n;
        for (int k = 0; k < 6; k++) mean[k] += value[i][k] / n;
    }
    for (int i = 0; i < n; i++) {
        spread += (time[i] - mean_t) * (time[i] - mean_t);
        for (int k = 0; k < 6; k++) along[k] += (time[i] - mean_t) * (value[i][k] - mean[k]);
    }
    for (int k = 0; k < 3; k++) {
        v.rate[k] = along[k] / spread;
        v.speed[k] = along[3 + k] / spread;
    }
    if (!(length3(v.rate) <= head_rate_max)) memset(v.rate, 0, sizeof v.rate);
    if (!(length3(v.speed) <= head_speed_max_m_s)) memset(v.speed, 0, sizeof v.speed);
    return v;
}

/* The newest pose, moved on for `seconds` at a constant velocity. */
static void move_on(const struct fv_pose *from, const struct velocity *v, double seconds, struct fv_pose *out)
{
    double turn[3], step[4];
    for (int i = 0; i < 3; i++) {
        turn[i] = v->rate[i] * seconds;
        out->position_m[i] = from->position_m[i] + v->speed[i] * seconds;
    }
    fv_quat_from_vector(turn, step);
    fv_quat_multiply(from->rotation, step, out->rotation);
    fv_quat_normalise(out->rotation);
}

/* The newest pose, moved on at the slope over the last `window` (at least two samples), the velocity
 * falling by 1/e in `fall_s`. */
static void head_at(const struct fv_head_sample *history, int count, int64_t t_ns, int64_t window,
                    double fall_s, struct fv_pose *head)
{
    const struct fv_head_sample *s[HISTORY];
    int n = head_history(history, count, s), used = n < 2 ? n : 2;
    *head = (struct fv_pose){.rotation = {1, 0, 0, 0}};
    if (n == 0) return;
    while (used < n && s[0]->t_ns - s[used]->t_ns <= window) used++;
    struct velocity v = slope(s, used);
    double seconds = until(s[0]->t_ns, t_ns);
    if (fall_s < INFINITY) seconds = -fall_s * expm1(-seconds / fall_s);
    move_on(&s[0]->pose, &v, seconds, head);
    if (!fv_head_pose_good(head)) *head = s[0]->pose;
}

static void head_hold(const struct fv_head_sample *history, int count, int64_t t_ns, struct fv_pose *head)
{
    const struct fv_head_sample *s[HISTORY];
    (void)t_ns;
    *head = head_history(history, count, s) ? s[0]->pose : (struct fv_pose){.rotation = {1, 0, 0, 0}};
}

static void head_two(const struct fv_head_sample *history, int count, int64_t t_ns, struct fv_pose *head)
{
    head_at(history, count, t_ns, 0, INFINITY, head);
}

static void head_slope(const struct fv_head_sample *history, int count, int64_t t_ns, struct fv_pose *head)
{
    head_at(history, count, t_ns, window_ns, INFINITY, head);
}

static void head_decay(const struct fv_head_sample *history, int count, int64_t t_ns, struct fv_pose *head)
{
    head_at(history, count, t_ns, window_ns, decay_s, head);
}

const struct fv_head_predictor fv_head_predictors[FV_HEAD_PREDICTORS] = {
    [FV_PREDICT_HEAD_HOLD] = {"hold", "hold", head_hold},
    [FV_PREDICT_HEAD_TWO] = {"two", "velocity of the last two", head_two},
    [FV_PREDICT_HEAD_SLOPE] = {"slope", "velocity over 20 ms", head_slope},
    [FV_PREDICT_HEAD_DECAY] = {"decay", "velocity that decays", head_decay},
};

/* The newest good samples, newest first, at most `most`. */
static int gaze_history(const struct fv_gaze_sample *history, int count, int most,
                        const struct fv_gaze_sample **out)
{
    int n = 0;
    for (int i = count - 1; i >= 0 && i >= count - HISTORY && n < most; i--) {
        const struct fv_gaze_sample *s = &history[i];
        bool good = fv_gaze_direction_good(s->direction[0]) && fv_gaze_direction_good(s->direction[1]);
        if (s->valid && good && (n == 0 || s->t_ns < out[n - 1]->t_ns)) out[n++] = s;
    }
    return n;
}

static double between_rad(const double a[3], const double b[3])
{
    double axis[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    return atan2(length3(axis), a[0] * b[0] + a[1] * b[1] + a[2] * b[2]);
}

double fv_gaze_speed_deg_s(const struct fv_gaze_sample *history, int count, double noise_deg)
{
    const struct fv_gaze_sample *s[HISTORY];
    int n = gaze_history(history, count, HISTORY, s), from = 1;
    if (n < 2 || apart(s[0]->t_ns, s[1]->t_ns)) return INFINITY;
    while (from + 1 < n && (uint64_t)s[0]->t_ns - (uint64_t)s[from + 1]->t_ns <= (uint64_t)window_ns) from++;
    double seconds = 1e-9 * (double)(s[0]->t_ns - s[from]->t_ns);
    double way = fmax(between_rad(s[from]->direction[0], s[0]->direction[0]),
                      between_rad(s[from]->direction[1], s[0]->direction[1]));
    return fmax(way * (180 / M_PI) - noise_deg, 0) / seconds;
}

/* `to`, turned on about the axis that took `from` to it: `factor` times as far. False where that is too
 * fast for an eye or leaves the face. */
static bool turn_on(const double from[3], const double to[3], double factor, double seconds, double out[3])
{
    double axis[3] = {from[1] * to[2] - from[2] * to[1], from[2] * to[0] - from[0] * to[2],
                      from[0] * to[1] - from[1] * to[0]};
    double sine = length3(axis), cosine = from[0] * to[0] + from[1] * to[1] + from[2] * to[2];
    double angle = atan2(sine, cosine), turn[3], rotation[4];
    if (!(angle <= gaze_rate_max * seconds)) return false;
    double scale = sine > 1e-12 ? factor * angle / sine : 0;
    for (int i = 0; i < 3; i++) turn[i] = axis[i] * scale;
    fv_quat_from_vector(turn, rotation);
    fv_quat_rotate(rotation, to, out);
    return fv_gaze_direction_good(out);
}

static void gaze_hold(const struct fv_gaze_sample *history, int count, int64_t t_ns, double direction[2][3])
{
    static const double ahead[2][3] = {{0, 0, -1}, {0, 0, -1}};
    const struct fv_gaze_sample *s[1];
    (void)t_ns;
    memcpy(direction, gaze_history(history, count, 1, s) ? s[0]->direction : ahead, sizeof ahead);
}

static void gaze_velocity(const struct fv_gaze_sample *history, int count, int64_t t_ns,
                          double direction[2][3])
{
    const struct fv_gaze_sample *s[2];
    gaze_hold(history, count, t_ns, direction);
    if (gaze_history(history, count, 2, s) < 2 || apart(s[0]->t_ns, s[1]->t_ns)) return;
    double seconds = 1e-9 * (double)(s[0]->t_ns - s[1]->t_ns), turned[2][3];
    double factor = until(s[0]->t_ns, t_ns) / seconds;
    for (int eye = 0; eye < 2; eye++)
        if (!turn_on(s[1]->direction[eye], s[0]->direction[eye], factor, seconds, turned[eye])) return;
    memcpy(direction, turned, sizeof turned);
}

const struct fv_gaze_predictor fv_gaze_predictors[FV_GAZE_PREDICTORS] = {
    [FV_PREDICT_GAZE_HOLD] = {"hold", gaze_hold},
    [FV_PREDICT_GAZE_VELOCITY] = {"velocity of the last two", gaze_velocity},
};
