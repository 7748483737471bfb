/* lowpass: see lowpass.h. */
#include "sensors/imu/lowpass.h"

struct fv_lowpass_step fv_lowpass_step(struct fv_lowpass_clock *clock, double dt_s, double tau_s)
{
    struct fv_lowpass_step step = {.g = dt_s * M_SQRT1_2 / tau_s};
    step.gain = 1 / (1 + step.g * (step.g + M_SQRT2));
    if (clock->seen_s < tau_s) {
        clock->seen_s += dt_s;
        step.share = dt_s / clock->seen_s;
    }
    return step;
}
