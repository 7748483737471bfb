/* lowpass: a second-order Butterworth low-pass over several values at once, for samples at measured times.
 *
 * The filter is the differential equation y'' = w^2 (x - y) - sqrt(2) w y' (Butterworth 1930), integrated by
 * the trapezoidal rule with the time that each sample took; so it is stable for any dt, and a dt that
 * changes changes nothing but the step. Its state is y and y', not the filter's own words: no jump where
 * the rate of samples changes. The corner w = sqrt(2) / tau makes it follow a step in about tau (Laidig and
 * Seel 2023, section 3.2). As there, the first tau of time gives the mean of what has come, with which the
 * filter then begins. */
#ifndef FV_SENSORS_IMU_LOWPASS_H
#define FV_SENSORS_IMU_LOWPASS_H

#include <math.h>

/* The time that the mean has seen; 0: begins with the next sample. Set back, the mean goes on with that weight. */
struct fv_lowpass_clock {
    double seen_s;
};

/* One value. */
struct fv_lowpass {
    double value, slope, push; /* y; y' / w; what w times the former is pushed by */
};

/* A sample's step, the same for all values that it brings. */
struct fv_lowpass_step {
    double g, gain; /* w dt / 2; of the implicit equation */
    double share;   /* of the newest sample in the mean; 0: the filter runs */
};

/* dt_s > 0, tau_s > 0, both finite. Moves the clock on. */
struct fv_lowpass_step fv_lowpass_step(struct fv_lowpass_clock *clock, double dt_s, double tau_s);

/* The filter's value with x, which must be finite, taken in. */
static inline double fv_lowpass_add(struct fv_lowpass *l, const struct fv_lowpass_step *step, double x)
{
    if (step->share > 0) {
        double before = step->share < 1 ? l->value : 0;
        *l = (struct fv_lowpass){.value = before + (x - before) * step->share};
        return l->value;
    }
    /* Trapezoidal: slope = a + g push, value = b + g slope, push = x - value - sqrt(2) slope. */
    double a = l->slope + step->g * l->push, b = l->value + step->g * l->slope;
    l->slope = step->gain * (a + step->g * (x - b));
    l->value = b + step->g * l->slope;
    l->push = x - l->value - M_SQRT2 * l->slope;
    return l->value;
}

#endif
