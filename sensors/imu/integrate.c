/* integrate: see integrate.h. */
#include "sensors/imu/integrate.h"

#include "platform/pose.h"

#include <math.h>
#include <string.h>

/* out = q + dt / 2 * q w. */
static void add_rate(const double q[4], const double at[4], const double rate[3], double dt_s, double out[4])
{
    double w[4] = {0, 0.5 * dt_s * rate[0], 0.5 * dt_s * rate[1], 0.5 * dt_s * rate[2]}, change[4];
    fv_quat_multiply(at, w, change);
    for (int i = 0; i < 4; i++) out[i] = q[i] + change[i];
    fv_quat_normalise(out);
}

static void mean_of(const double a[3], const double b[3], double out[3])
{
    for (int i = 0; i < 3; i++) out[i] = 0.5 * (a[i] + b[i]);
}

static void euler(double q[4], const double before[3], const double now[3], double dt_s)
{
    (void)before;
    add_rate(q, q, now, dt_s, q);
}

static void midpoint(double q[4], const double before[3], const double now[3], double dt_s)
{
    double mean[3], half[4];
    mean_of(before, now, mean);
    add_rate(q, q, before, 0.5 * dt_s, half);
    add_rate(q, half, mean, dt_s, q);
}

static void exact(double q[4], const double before[3], const double now[3], double dt_s)
{
    double turn[3], step[4];
    mean_of(before, now, turn);
    for (int i = 0; i < 3; i++) turn[i] *= dt_s;
    fv_quat_from_vector(turn, step);
    fv_quat_multiply(q, step, q);
    fv_quat_normalise(q);
}

const struct fv_integrator fv_integrators[FV_INTEGRATORS] = {
    [FV_INTEGRATE_EULER] = {"Euler", euler},
    [FV_INTEGRATE_MIDPOINT] = {"midpoint", midpoint},
    [FV_INTEGRATE_EXACT] = {"exact rotation", exact},
};

/* False for NaN too. */
static int good_rate(const double rate[3])
{
    return rate[0] * rate[0] + rate[1] * rate[1] + rate[2] * rate[2] <= FV_RATE_MAX_RAD_S * FV_RATE_MAX_RAD_S;
}

void fv_attitude_begin(struct fv_attitude *a, const double rotation[4], const double rate[3])
{
    *a = (struct fv_attitude){.rotation = {1, 0, 0, 0}};
    if (rotation) memcpy(a->rotation, rotation, sizeof a->rotation);
    fv_quat_normalise(a->rotation);
    if (rate && good_rate(rate)) memcpy(a->rate, rate, sizeof a->rate);
}

void fv_attitude_add(const struct fv_integrator *integrator, struct fv_attitude *a, const double rate[3],
                     double dt_s)
{
    a->samples++;
    if (!(dt_s > 0) || isinf(dt_s)) {
        a->rejected++;
        return;
    }
    double since_s = a->missing_s + dt_s;
    if (!good_rate(rate)) {
        a->rejected++;
        a->missing_s = since_s;
        return;
    }
    if (since_s <= FV_RATE_GAP_S) integrator->step(a->rotation, a->rate, rate, since_s);
    else a->gaps++;
    a->missing_s = 0;
    memcpy(a->rate, rate, sizeof a->rate);
}
