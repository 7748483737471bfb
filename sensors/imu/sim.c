/* sim: a simulated head that looks around. Yaw, pitch and roll go from one hashed target to the
 * next by minimum-jerk moves, one a period; a little unrest and the sway of standing and breathing
 * are added. The point between the eyes swings about the neck, as sensors.h's pose requires. */
#include "sensors/motion.h"
#include "sensors/sensors.h"

#include <math.h>

/* One turn a period: the largest turn at the greatest speed (1.875 x its mean) fits into it, and a
 * small one still takes `shortest_s`. */
static const struct axis {
    double period_s, range_deg, fastest_deg_s, shortest_s;
    double unrest_deg, low_hz, high_hz;
} axes[3] = {
    [FV_MOTION_YAW] = {2.0, 60, 115, 0.4, 0.4, 0.2, 1.2},
    [FV_MOTION_PITCH] = {2.7, 14, 40, 0.4, 0.3, 0.2, 1.2},
    [FV_MOTION_ROLL] = {3.3, 4, 12, 0.5, 0.2, 0.2, 1.2},
};

/* Root mean square sway in x, y, z and its band. */
static const struct sway {
    double m, low_hz, high_hz;
} sways[3] = {{0.004, 0.1, 0.7}, {0.002, 0.2, 0.35}, {0.005, 0.1, 0.7}};

/* From the neck's joint to the point between the eyes, head upright. */
static const double neck_to_eyes_m[3] = {0, 0.075, -0.0805};

/* The first target is straight ahead. */
static double target_deg(uint64_t seed, int stream, int64_t index)
{
    return index == 0 ? 0 : axes[stream].range_deg * (2 * fv_motion_uniform(seed, stream, 2 * index) - 1);
}

static double angle_deg(uint64_t seed, int stream, int64_t t_ns)
{
    const struct axis *a = &axes[stream];
    int64_t into_ns, index = fv_motion_epoch(t_ns, (int64_t)(a->period_s * 1e9), &into_ns);
    double from = target_deg(seed, stream, index), way = target_deg(seed, stream, index + 1) - from;
    double seconds = fmax(1.875 * fabs(way) / a->fastest_deg_s, a->shortest_s);
    double start = (a->period_s - seconds) * fv_motion_uniform(seed, stream, 2 * index + 1);
    double s = ((double)into_ns * 1e-9 - start) / seconds;
    return from + way * fv_motion_minimum_jerk(s) +
           a->unrest_deg * fv_motion_noise(seed, FV_MOTION_SWAY + 3 + stream, t_ns, a->low_hz, a->high_hz);
}

void fv_sim_head(uint64_t seed, int64_t t_ns, struct fv_pose *head)
{
    double angle[3];
    for (int i = 0; i < 3; i++) angle[i] = angle_deg(seed, i, t_ns) * (M_PI / 180);
    fv_quat_from_yaw_pitch_roll(angle[FV_MOTION_YAW], angle[FV_MOTION_PITCH], angle[FV_MOTION_ROLL],
                                head->rotation);
    fv_quat_normalise(head->rotation);
    fv_quat_rotate(head->rotation, neck_to_eyes_m, head->position_m);
    for (int i = 0; i < 3; i++)
        head->position_m[i] +=
            sways[i].m * fv_motion_noise(seed, FV_MOTION_SWAY + i, t_ns, sways[i].low_hz, sways[i].high_hz) -
            neck_to_eyes_m[i];
}
