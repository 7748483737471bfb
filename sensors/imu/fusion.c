/* fusion: see fusion.h. */
#include "sensors/imu/fusion.h"

#include "platform/pose.h"
#include "sensors/imu/integrate.h"

#include <math.h>
#include <string.h>

#define DEGREE (M_PI / 180)

enum { SAME_SAMPLES = 16 };
static const double first_s = 0.01; /* the most that the first sample counts for: nothing was before it */

const struct fv_fusion_settings fv_fusion_usual = {
    .tilt_s = 4,
    .turn_rate = 400 * DEGREE,
    .bias_start = 0.5 * DEGREE,
    .bias_forget_s = 100,
    .bias_max = 2 * DEGREE,
    .bias_motion = 0.1 * DEGREE,
    .bias_vertical = 1e-4,
    .bias_rest = 0.03 * DEGREE,
    .rest_s = 1.5,
    .rest_filter_s = 0.5,
    .rest_rate = 2 * DEGREE,
    .rest_acc = 0.5,
    .rate_full = INFINITY,
    .acc_full = INFINITY,
};

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static double clamp(double x, double most)
{
    return fmin(fmax(x, -most), most);
}

static bool at_full(const double v[3], double full)
{
    return !(fabs(v[0]) < full && fabs(v[1]) < full && fabs(v[2]) < full);
}

/* False for NaN too. */
static bool good_rate(const double rate[3])
{
    return dot(rate, rate) <= FV_RATE_MAX_RAD_S * FV_RATE_MAX_RAD_S;
}

/* The rows of q's matrix. */
static void matrix(const double q[4], double m[3][3])
{
    double w = q[0], x = q[1], y = q[2], z = q[3];
    m[0][0] = 1 - 2 * (y * y + z * z), m[0][1] = 2 * (x * y - w * z), m[0][2] = 2 * (x * z + w * y);
    m[1][0] = 2 * (x * y + w * z), m[1][1] = 1 - 2 * (x * x + z * z), m[1][2] = 2 * (y * z - w * x);
    m[2][0] = 2 * (x * z - w * y), m[2][1] = 2 * (y * z + w * x), m[2][2] = 1 - 2 * (x * x + y * y);
}

void fv_fusion_begin(struct fv_fusion *f, const struct fv_fusion_settings *settings)
{
    *f = (struct fv_fusion){.turned = {1, 0, 0, 0}, .tilt = {1, 0, 0, 0}, .rotation = {1, 0, 0, 0}};
    f->settings = settings ? *settings : fv_fusion_usual;
    for (int i = 0; i < 3; i++) f->spread[i][i] = f->settings.bias_start * f->settings.bias_start;
}

static void add_three(struct fv_lowpass lowpass[3], const struct fv_lowpass_step *step, const double in[3],
                      double out[3])
{
    for (int i = 0; i < 3; i++) out[i] = fv_lowpass_add(&lowpass[i], step, in[i]);
}

/* Whether the head has been quiet for long enough (section 3.4.2); `mean` is the rate's low-pass. */
static void detect_rest(struct fv_fusion *f, const double rate[3], const double acc[3], double dt_s, double mean[3])
{
    const struct fv_fusion_settings *s = &f->settings;
    struct fv_lowpass_step step = fv_lowpass_step(&f->rest_clock, dt_s, s->rest_filter_s);
    double still[3], off = 0, off_acc = 0;
    add_three(f->rest_rate, &step, rate, mean);
    add_three(f->rest_acc, &step, acc, still);
    for (int i = 0; i < 3; i++) {
        off += (rate[i] - mean[i]) * (rate[i] - mean[i]);
        off_acc += (acc[i] - still[i]) * (acc[i] - still[i]);
    }
    bool quiet = off < s->rest_rate * s->rest_rate && off_acc < s->rest_acc * s->rest_acc && !at_full(mean, s->bias_max);
    f->quiet_s = quiet ? f->quiet_s + dt_s : 0;
    f->resting = f->quiet_s >= s->rest_s;
}

/* One measured row of the Kalman filter: `seen` is what along . bias differs by, of variance `noise`. As the
 * noises of the three rows are apart, one row after another is the same as all at once, and needs no inverse. */
static void learn_row(struct fv_fusion *f, const double along[3], double seen, double noise)
{
    double way[3], gain;
    for (int i = 0; i < 3; i++) way[i] = dot(f->spread[i], along);
    gain = 1 / (noise + dot(along, way));
    for (int i = 0; i < 3; i++) f->bias[i] += way[i] * gain * seen;
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) f->spread[i][k] -= way[i] * gain * way[k];
}

/* The Kalman filter of the bias (section 3.4). `rows` times the bias was off by `seen`; what it may change in
 * dt_s is added first, and the noise is such that the uncertainty settles at `settle`. */
static void learn(struct fv_fusion *f, const double rows[3][3], const double seen[3], const double settle[3],
                  const double weight[3], double dt_s)
{
    const struct fv_fusion_settings *s = &f->settings;
    double change = 0.1 * DEGREE * (0.1 * DEGREE) * dt_s / s->bias_forget_s, before[3];
    double most = s->bias_start * s->bias_start;
    memcpy(before, f->bias, sizeof before);
    for (int i = 0; i < 3; i++)
        if (f->spread[i][i] < most) f->spread[i][i] += change;
    for (int i = 0; i < 3; i++) {
        double moved[3], p = settle[i] * settle[i];
        for (int k = 0; k < 3; k++) moved[k] = f->bias[k] - before[k];
        learn_row(f, rows[i], clamp(seen[i], s->bias_max) - dot(rows[i], moved), (p * p / change + p) / weight[i]);
    }
    for (int i = 0; i < 3; i++) f->bias[i] = clamp(f->bias[i], s->bias_max);
}

/* Tilts the frame so that the low-passed acceleration points up, by the shortest way; returns by how much, as a
 * rotation vector in the world, of which y is 0. */
static bool correct_tilt(struct fv_fusion *f, const double acc[3], const struct fv_lowpass_step *step, double by[3])
{
    double up[3], length, rotation[4];
    fv_quat_rotate(f->turned, acc, up);
    add_three(f->down, step, up, up);
    fv_quat_rotate(f->tilt, up, up);
    length = sqrt(dot(up, up));
    memset(by, 0, 3 * sizeof by[0]);
    if (!(length >= FV_FUSION_FALL)) return false;
    for (int i = 0; i < 3; i++) up[i] /= length;
    /* Half the angle between up and y; straight down: half a turn about x. */
    double w = sqrt(fmax(0, (1 + up[1]) / 2));
    if (w > 1e-9) rotation[0] = w, rotation[1] = -0.5 * up[2] / w, rotation[3] = 0.5 * up[0] / w;
    else rotation[0] = 0, rotation[1] = 1, rotation[3] = 0;
    rotation[2] = 0;
    fv_quat_normalise(rotation);
    by[0] = -up[2];
    by[2] = up[0];
    fv_quat_multiply(rotation, f->tilt, f->tilt);
    fv_quat_normalise(f->tilt);
    return true;
}

/* The bias by the tilt that had to be corrected (section 3.4.1): what the low-pass of the device's axes lets through
 * of it would have tilted the frame by as much. */
static void learn_in_motion(struct fv_fusion *f, const double axes[3][3], const double by[3],
                            const struct fv_lowpass_step *step, bool known, double dt_s)
{
    const struct fv_fusion_settings *s = &f->settings;
    double rows[3][3], seen[3];
    for (int i = 0; i < 3; i++) {
        add_three(f->axes[i], step, axes[i], rows[i]);
        seen[i] = -dot(rows[i], f->bias);
        if (i != 1) seen[i] += fv_lowpass_add(&f->level[i / 2], step, dot(axes[i], f->bias)) - by[i] / dt_s;
    }
    if (!known) return;
    learn(f, (const double(*)[3])rows, seen, (double[3]){s->bias_motion, s->bias_motion, s->bias_motion},
          (double[3]){1, s->bias_vertical, 1}, dt_s);
}

static void use_acceleration(struct fv_fusion *f, const double rate[3], const double acc[3], bool saturated,
                             double dt_s)
{
    static const double unit[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const struct fv_fusion_settings *s = &f->settings;
    double mean[3], axes[3][3], by[3];
    detect_rest(f, rate, acc, dt_s, mean);
    matrix(f->rotation, axes);
    f->speed += (sqrt(dot(f->rate, f->rate)) - f->speed) * dt_s / (s->tilt_s + dt_s);
    struct fv_lowpass_step step = fv_lowpass_step(&f->down_clock, dt_s, s->tilt_s / (1 + f->speed / s->turn_rate));
    bool known = correct_tilt(f, acc, &step, by) && !saturated;
    /* While the low-pass is still a mean, the tilt is corrected for the start's sake. */
    learn_in_motion(f, (const double(*)[3])axes, by, &step, known && !f->resting && step.share == 0, dt_s);
    if (!known || !f->resting) return;
    for (int i = 0; i < 3; i++) mean[i] -= f->bias[i];
    learn(f, unit, mean, (double[3]){s->bias_rest, s->bias_rest, s->bias_rest}, (double[3]){1, 1, 1}, dt_s);
}

/* Counts how long the very same sample has come. */
static bool is_stuck(struct fv_fusion *f, const double rate[3], const double acc[3], double dt_s)
{
    bool same = f->begun && memcmp(rate, f->last_rate, sizeof f->last_rate) == 0 &&
                memcmp(acc, f->last_acc, sizeof f->last_acc) == 0;
    f->same = same ? f->same + (f->same < SAME_SAMPLES) : 0;
    f->same_s = same ? f->same_s + dt_s : 0;
    memcpy(f->last_rate, rate, sizeof f->last_rate);
    memcpy(f->last_acc, acc, sizeof f->last_acc);
    return f->same >= SAME_SAMPLES && f->same_s >= FV_FUSION_STUCK_S;
}

/* After a gap little is known of the motion: what was filtered over it begins anew. Bias and rotation stay; down is
 * believed as if it had been seen for a quarter of a second, lest a single push turns the world. */
static void begin_anew(struct fv_fusion *f)
{
    f->down_clock.seen_s = fmin(f->down_clock.seen_s, 0.25);
    f->rest_clock.seen_s = 0;
    f->quiet_s = 0;
    f->resting = false;
}

/* The sane ones: dropped samples keep rotation and rate, or the rate is 0 where it is not known. */
static bool take(struct fv_fusion *f, const double rate[3], const double acc[3], double dt_s, double *since_s)
{
    f->counts.samples++;
    if (!(dt_s > 0) || isinf(dt_s)) {
        f->counts.mistimed++;
        return false;
    }
    *since_s = f->missing_s + dt_s;
    f->missing_s = *since_s;
    if (!good_rate(rate)) {
        f->counts.bad++;
        return false;
    }
    if (is_stuck(f, rate, acc, dt_s)) {
        f->counts.stuck++;
        f->missing_s = 0;
        memset(f->rate, 0, sizeof f->rate);
        f->resting = false;
        return false;
    }
    f->missing_s = 0;
    return true;
}

void fv_fusion_add(struct fv_fusion *f, const double rate[3], const double acc[3], double dt_s)
{
    double since_s, now[3];
    if (!take(f, rate, acc, dt_s, &since_s)) return;
    bool gap = f->begun && since_s > FV_RATE_GAP_S;
    bool saturated = at_full(rate, f->settings.rate_full), falls = !(dot(acc, acc) >= FV_FUSION_FALL * FV_FUSION_FALL);
    bool no_down = falls || at_full(acc, fmin(f->settings.acc_full, 1e6));
    for (int i = 0; i < 3; i++) now[i] = rate[i] - f->bias[i];
    /* A sample is the mean over the time since the one before, as a sensor's decimation makes it: no mean of two. */
    if (gap) begin_anew(f);
    else if (f->begun) fv_integrators[FV_INTEGRATE_EXACT].step(f->turned, now, now, since_s);
    else since_s = fmin(since_s, first_s);
    memcpy(f->rate, now, sizeof now);
    f->begun = true;
    f->counts.gaps += gap;
    f->counts.saturated += saturated && !gap;
    f->counts.no_down += no_down && !saturated && !gap;
    fv_quat_multiply(f->tilt, f->turned, f->rotation);
    if (no_down) {
        f->quiet_s = 0;
        f->resting = false;
    } else if (!gap) { /* its time is no weight */
        use_acceleration(f, rate, acc, saturated, since_s);
        fv_quat_multiply(f->tilt, f->turned, f->rotation);
    }
    fv_quat_normalise(f->rotation);
}

void fv_fusion_turn(const double rotation[4], const double rate[3], double ahead_s, double turned[4])
{
    double turn[3], step[4];
    for (int i = 0; i < 3; i++) turn[i] = rate[i] * (ahead_s > 0 ? fmin(ahead_s, FV_FUSION_AHEAD_S) : 0);
    fv_quat_from_vector(turn, step);
    fv_quat_multiply(rotation, step, turned);
    fv_quat_normalise(turned);
}

void fv_fusion_predict(const struct fv_fusion *f, double ahead_s, double rotation[4])
{
    double ahead = f->missing_s + fmax(ahead_s, 0);
    if (!(ahead <= FV_FUSION_AHEAD_S)) ahead = f->missing_s < FV_FUSION_AHEAD_S ? FV_FUSION_AHEAD_S : 0;
    fv_fusion_turn(f->rotation, f->rate, ahead, rotation);
}
