/* numerics_integration: the IMU integrators on motions that are known exactly: the angle by which they
 * are off after 10 s, and what a sample costs. */
#include "cli/experiments.h"

#include "platform/arena.h"
#include "platform/clock.h"
#include "sensors/imu/integrate.h"

#include <math.h>
#include <stdio.h>

enum { RUNS = 10, SAMPLES_MAX = 10000 };

static const double degree = M_PI / 180, seconds = 10;

/* A run's rotation (device to world) and angular rate (rad/s, device axes) at a time. */
typedef void motion(int run, int64_t t_ns, double rotation[4], double rate[3]);

/* 2000 degrees a second, each run about another axis. */
static void spin(int run, int64_t t_ns, double rotation[4], double rate[3])
{
    double height = (2 * run + 1.0) / RUNS - 1, across = sqrt(1 - height * height), turn[3];
    double axis[3] = {across * cos(2.4 * run), height, across * sin(2.4 * run)};
    for (int i = 0; i < 3; i++) {
        rate[i] = 2000 * degree * axis[i];
        turn[i] = axis[i] * fmod(2000 * degree * 1e-9 * (double)t_ns, 4 * M_PI);
    }
    fv_quat_from_vector(turn, rotation);
}

/* Coning (Savage 1998): an axis runs 10 times a second round a cone of half-angle 5 degrees, each run
 * from another phase. */
static void cone(int run, int64_t t_ns, double rotation[4], double rate[3])
{
    const double half = 5 * degree, speed = 2 * M_PI * 10;
    double phase = fmod(speed * 1e-9 * (double)t_ns, 2 * M_PI) + 2 * M_PI * run / RUNS;
    rotation[0] = cos(half / 2);
    rotation[1] = sin(half / 2) * cos(phase);
    rotation[2] = sin(half / 2) * sin(phase);
    rotation[3] = 0;
    rate[0] = -speed * sin(half) * sin(phase);
    rate[1] = speed * sin(half) * cos(phase);
    rate[2] = -2 * speed * sin(half / 2) * sin(half / 2);
}

/* The simulated head; its rate is the central difference, exact to 1e-8 rad/s. */
static void head(int run, int64_t t_ns, double rotation[4], double rate[3])
{
    const int64_t step_ns = 20000;
    struct fv_pose before, now, after;
    fv_sim_head((uint64_t)run + 1, t_ns - step_ns, &before);
    fv_sim_head((uint64_t)run + 1, t_ns, &now);
    fv_sim_head((uint64_t)run + 1, t_ns + step_ns, &after);
    fv_quat_between(before.rotation, after.rotation, rate);
    for (int i = 0; i < 3; i++) rate[i] /= 2e-9 * (double)step_ns;
    for (int i = 0; i < 4; i++) rotation[i] = now.rotation[i];
}

static const struct {
    const char *name;
    motion *at;
} motions[] = {{"2000 deg/s", spin}, {"10 Hz coning", cone}, {"simulated head", head}};

static const struct {
    const char *name;
    int64_t period_ns;
} rates[] = {{"1000 Hz", 1000000}, {"285.7 Hz", 3500000}, {"100 Hz", 10000000}};

/* Errors of each integrator in each run, and the least cost of a sample. */
static void run_all(motion *at, int64_t period_ns, double (*rate)[3], double error[][RUNS], double *ns)
{
    int samples = (int)(1e9 * seconds / (double)period_ns);
    for (int m = 0; m < FV_INTEGRATORS; m++) ns[m] = INFINITY;
    for (int run = 0; run < RUNS; run++) {
        double start[4], end[4];
        at(run, 0, start, rate[0]);
        for (int i = 1; i <= samples; i++) at(run, i * period_ns, end, rate[i]);
        for (int m = 0; m < FV_INTEGRATORS; m++) {
            struct fv_attitude a;
            fv_attitude_begin(&a, start, rate[0]);
            int64_t start_ns = fv_clock_thread_ns();
            for (int i = 1; i <= samples; i++)
                fv_attitude_add(&fv_integrators[m], &a, rate[i], 1e-9 * (double)period_ns);
            ns[m] = fmin(ns[m], (double)(fv_clock_thread_ns() - start_ns) / samples);
            error[m][run] = fv_quat_angle(end, a.rotation) / degree;
        }
    }
}

void fv_experiment_integration(struct fv_setup *setup, struct fv_numerics *n)
{
    double(*rate)[3] = fv_arena_take(fv_arena(), "numerics", (SAMPLES_MAX + 1) * sizeof *rate, 64);
    (void)setup;
    for (unsigned k = 0; k < sizeof motions / sizeof motions[0]; k++)
        for (unsigned r = 0; r < sizeof rates / sizeof rates[0]; r++) {
            double error[FV_INTEGRATORS][RUNS], ns[FV_INTEGRATORS];
            if (fv_numerics_stopped(n)) return;
            run_all(motions[k].at, rates[r].period_ns, rate, error, ns);
            for (int m = 0; m < FV_INTEGRATORS; m++) {
                struct fv_numeric_row *row =
                    fv_numerics_add(n, "IMU integration", fv_integrators[m].name, "deg after 10 s",
                                    "%s at %s", motions[k].name, rates[r].name);
                fv_numerics_errors(row, error[m], RUNS);
                row->cost = ns[m];
                snprintf(row->cost_unit, sizeof row->cost_unit, "ns/sample");
            }
        }
}
