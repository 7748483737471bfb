/* gaze_smooth: see the header. */
#include "sensors/eye/gaze_smooth.h"

#include <math.h>
#include <string.h>

/* Faster than this between two samples is no fixation; a distance so far beyond the noise, and this many
 * degrees, is none of noise. */
static const double fast_deg_s = 40, beyond = 5, jump_least_deg = 0.3;
/* Once it moves it does so until it is slower than this: landings are slow. */
static const double landing_deg_s = 10, landing_beyond = 4;
static const double noise_first = 0.1, noise_least = 0.003, noise_most = 2;
static const int64_t gap_ns = 100000000;
/* Median length of the second difference of independent measurements in two axes: sqrt(6) of each axis's
 * deviation, times the median of Rayleigh's distribution, sqrt(2 ln 2). */
static const double second_difference = 2.8842;

static double length(double x, double y)
{
    return sqrt(x * x + y * y);
}

/* Towards the median, 3 % of it each sample. The second difference knows nothing of a steady pursuit.
 */
static void learn_noise(struct fv_gaze_smooth *s, const double raw[2])
{
    double second[2];
    for (int i = 0; i < 2; i++) second[i] = raw[i] - 2 * s->raw[0][i] + s->raw[1][i];
    bool more = length(second[0], second[1]) > second_difference * s->noise;
    s->noise = fmin(fmax(s->noise * (more ? 1.03 : 1 / 1.03), noise_least), noise_most);
}

void fv_gaze_smooth_lost(struct fv_gaze_smooth *s)
{
    s->samples = 0;
}

double fv_gaze_smooth_add(struct fv_gaze_smooth *s, int64_t t_ns, const double raw[2], double out[2])
{
    bool usable = fabs(raw[0]) < 1e6 && fabs(raw[1]) < 1e6; /* not NaN either */
    double gain = 1, lag = 0;
    if (!(s->noise > 0)) s->noise = noise_first;
    if (s->samples > 0 && t_ns > s->t_ns && (uint64_t)t_ns - (uint64_t)s->t_ns > (uint64_t)gap_ns)
        s->samples = 0;
    if (!usable || (s->samples > 0 && t_ns <= s->t_ns)) {
        memcpy(out, s->at, sizeof s->at);
        return s->noise;
    }
    bool moved = s->moving;
    s->moving = s->samples == 0;
    if (s->samples > 0) {
        double dt = (double)(t_ns - s->t_ns) * 1e-9, usual = beyond * s->noise;
        double fast = moved ? fmax(landing_deg_s * dt, landing_beyond * 1.4142 * s->noise)
                            : fmax(fast_deg_s * dt, 1.4142 * usual);
        double off = length(raw[0] - s->at[0], raw[1] - s->at[1]);
        double step = length(raw[0] - s->raw[0][0], raw[1] - s->raw[0][1]);
        double jump = fmax(usual * sqrt(1 + s->share), jump_least_deg);
        s->moving = off > jump || step > fast || !(s->settle_s > 0);
        if (!s->moving) {
            double least = 1 - exp(-dt / s->settle_s), near = off / jump;
            gain = fmax(fmax(s->share / (s->share + 1), least), near * near);
            lag = fmax((1 - gain) * off - 2 * s->noise, 0);
            if (s->samples > 2) learn_noise(s, raw);
        }
    }
    for (int i = 0; i < 2; i++) {
        s->at[i] = s->moving ? raw[i] : s->at[i] + gain * (raw[i] - s->at[i]);
        s->raw[1][i] = s->raw[0][i];
        s->raw[0][i] = raw[i];
    }
    s->share = s->moving ? 1 : (1 - gain) * (1 - gain) * s->share + gain * gain;
    s->t_ns = t_ns;
    if (s->samples < 3) s->samples++;
    memcpy(out, s->at, sizeof s->at);
    return length(1.4142 * s->noise * sqrt(s->share), lag);
}
