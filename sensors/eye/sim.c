/* sim: simulated eyes. Time is cut into periods; in each, at a hashed moment, a saccade goes to a
 * hashed place, and until the next one the eyes fixate there or pursue something moving. Small
 * unrest is added, both eyes are turned to meet at a point, and blinks hide them now and then.
 *
 * Saccades keep the main sequence: duration 2.2 ms a degree + 21 ms, so that the peak velocity
 * saturates with growing amplitude (Bahill, Clark and Stark 1975). Gaze is a vector in degrees
 * (right, up) whose length is the angle from straight ahead, and whose third number is the nearness
 * of the point looked at, in dioptres. */
#include "sensors/motion.h"
#include "sensors/sensors.h"

#include <math.h>

/* A saccade starts in the first JITTER of each PERIOD: 250 to 650 ms lie between two. Vergence is
 * slower than the saccade but done before the next. */
static const int64_t period_ns = 450000000, jitter_ns = 200000000, vergence_ns = 200000000;
static const int64_t blink_period_ns = 4000000000, blink_jitter_ns = 2000000000, blink_first_ns = 1000000000;
static const double blink_shortest_s = 0.1, blink_longest_s = 0.3;
static const double pursuit_share = 0.15, pursuit_slow_deg_s = 5, pursuit_fast_deg_s = 30,
                    pursuit_rise_s = 0.1;
static const double half_ipd_m = 0.0315, near_m = 0.5, far_m = 5;
/* Regions of interest are looked at with REGION saccades each; reach of both in degrees. */
enum { REGION = 4 };
static const double region_deg[2] = {18, 12}, around_deg[2] = {5, 4};

enum draw {
    START,
    REGION_X,
    REGION_Y,
    REGION_NEAR,
    AROUND_X,
    AROUND_Y,
    PURSUIT,
    PURSUIT_SPEED,
    PURSUIT_TILT
};

static double draw(uint64_t seed, enum draw what, int64_t index)
{
    return fv_motion_uniform(seed, FV_MOTION_GAZE + (int)what, index);
}

/* In (-1, 1), more often near 0: the mean of two. */
static double spread(uint64_t seed, enum draw what, int64_t index)
{
    return draw(seed, what, 2 * index) + draw(seed, what, 2 * index + 1) - 1;
}

/* Where the index-th saccade ends. */
static void target(uint64_t seed, int64_t index, double out[3])
{
    int64_t ignored, region = fv_motion_epoch(index, REGION, &ignored);
    out[0] = region_deg[0] * spread(seed, REGION_X, region) + around_deg[0] * spread(seed, AROUND_X, index);
    out[1] = region_deg[1] * spread(seed, REGION_Y, region) + around_deg[1] * spread(seed, AROUND_Y, index);
    out[2] = 1 / far_m + (1 / near_m - 1 / far_m) * draw(seed, REGION_NEAR, region);
}

/* When the index-th saccade starts. */
static int64_t start_ns(uint64_t seed, int64_t index)
{
    return index * period_ns + (int64_t)((double)jitter_ns * draw(seed, START, index));
}

/* How far a pursuit has gone `seconds` after the index-th saccade's start, towards and past the
 * middle; nothing in a fixation. */
static void pursue(uint64_t seed, int64_t index, const double from[3], double seconds, double out[2])
{
    out[0] = out[1] = 0;
    if (draw(seed, PURSUIT, index) >= pursuit_share || !(seconds > 0)) return;
    double speed =
        pursuit_slow_deg_s + (pursuit_fast_deg_s - pursuit_slow_deg_s) * draw(seed, PURSUIT_SPEED, index);
    double tilt = M_PI / 4 * spread(seed, PURSUIT_TILT, index);
    double way =
        seconds < pursuit_rise_s ? 0.5 * seconds * seconds / pursuit_rise_s : seconds - 0.5 * pursuit_rise_s;
    out[0] = (from[0] > 0 ? -speed : speed) * way * cos(tilt);
    out[1] = speed * way * sin(tilt);
}

/* Gaze (degrees right and up, dioptres) without its unrest. */
static void gaze_at(uint64_t seed, int64_t t_ns, double out[3])
{
    int64_t into_ns, index = fv_motion_epoch(t_ns, period_ns, &into_ns);
    t_ns = index * period_ns + into_ns;
    if (t_ns < start_ns(seed, index)) index--;
    int64_t started_ns = start_ns(seed, index);
    double from[3], to[3], pursued[2];
    /* From where the period before left off ... */
    target(seed, index - 1, from);
    pursue(seed, index - 1, from, (double)(started_ns - start_ns(seed, index - 1)) * 1e-9, pursued);
    for (int i = 0; i < 2; i++) from[i] += pursued[i];
    /* ... to this one's target. */
    target(seed, index, to);
    double amplitude_deg = hypot(to[0] - from[0], to[1] - from[1]);
    double saccade_s = 0.0022 * amplitude_deg + 0.021, since_s = (double)(t_ns - started_ns) * 1e-9;
    double done = fv_motion_minimum_jerk(since_s / saccade_s);
    pursue(seed, index, to, since_s, pursued);
    for (int i = 0; i < 2; i++) out[i] = from[i] + (to[i] - from[i]) * done + pursued[i] * done;
    out[2] = from[2] + (to[2] - from[2]) * fv_motion_minimum_jerk(since_s / ((double)vergence_ns * 1e-9));
}

static bool blinking(uint64_t seed, int64_t t_ns)
{
    int64_t into_ns, index = fv_motion_epoch(t_ns, blink_period_ns, &into_ns);
    double since_s = (double)(into_ns - blink_first_ns) * 1e-9 -
                     (double)blink_jitter_ns * 1e-9 * fv_motion_uniform(seed, FV_MOTION_BLINK, 2 * index);
    double lasts_s = blink_shortest_s + (blink_longest_s - blink_shortest_s) *
                                            fv_motion_uniform(seed, FV_MOTION_BLINK, 2 * index + 1);
    return since_s >= 0 && since_s < lasts_s;
}

void fv_sim_gaze(uint64_t seed, int64_t t_ns, struct fv_gaze_sample *gaze)
{
    double at[3];
    gaze_at(seed, t_ns, at);
    for (int i = 0; i < 2; i++) /* drift, and tremor of some seconds of arc */
        at[i] += 0.06 * fv_motion_noise(seed, FV_MOTION_DRIFT + i, t_ns, 0.3, 5) +
                 0.002 * fv_motion_noise(seed, FV_MOTION_DRIFT + 2 + i, t_ns, 60, 100);
    double angle = hypot(at[0], at[1]) * (M_PI / 180), distance_m = 1 / at[2];
    double scale = angle > 1e-9 ? sin(angle) / angle : 1;
    double point[3] = {distance_m * scale * at[0] * (M_PI / 180), distance_m * scale * at[1] * (M_PI / 180),
                       -distance_m * cos(angle)};
    for (int eye = 0; eye < 2; eye++) {
        double v[3] = {point[0] + (eye == 0 ? half_ipd_m : -half_ipd_m), point[1], point[2]};
        double length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
        for (int i = 0; i < 3; i++) gaze->direction[eye][i] = v[i] / length;
    }
    gaze->t_ns = t_ns;
    gaze->valid = !blinking(seed, t_ns);
    gaze->uncertainty_deg = 0;
}
