/* plot_ticks: see plot_ticks.h. Linear axes: 1, 2 or 5 times a power of ten. Logarithmic ones: some of
 * the multiples of each power of ten, or of every n-th power; those too short for that as linear ones. */
#include "cli/plot_ticks.h"

#include <math.h>
#include <stdio.h>

static void linear_ticks(const struct fv_axis *axis, int most, struct fv_ticks *ticks)
{
    static const double factors[] = {1, 2, 5, 10};
    double low = fmin(axis->low, axis->high), high = fmax(axis->low, axis->high);
    double least = (high - low) / most, power = pow(10, floor(log10(least)));
    int k = 0;
    while (k < 3 && factors[k] * power < least * (1 - 1e-9)) k++;
    double step = factors[k] * power;
    ticks->step = step;
    ticks->decimals = (int)fmin(fmax(-floor(log10(step) + 1e-9), 0), 9);
    ticks->count = 0;
    /* Adding 0 turns -0 into 0. */
    for (double i = ceil(low / step - 1e-9) + 0.0; i * step <= high + 1e-9 * step; i++)
        if (ticks->count < FV_TICKS_MAX) ticks->value[ticks->count++] = i * step;
}

/* `factor` times every `powers`-th power of ten. Returns their number, which may be more than were kept. */
static int log_ticks(const struct fv_axis *axis, int factors, const double *factor, int powers,
                     struct fv_ticks *ticks)
{
    int count = 0, first = (int)floor(log10(axis->low) - 1e-9), last = (int)ceil(log10(axis->high));
    for (int power = first; power <= last; power++) {
        if (power % powers) continue;
        for (int k = 0; k < factors; k++) {
            double value = factor[k] * pow(10, power);
            if (value < axis->low * (1 - 1e-9) || value > axis->high * (1 + 1e-9)) continue;
            if (count < FV_TICKS_MAX) ticks->value[count] = value;
            count++;
        }
    }
    ticks->count = count < FV_TICKS_MAX ? count : FV_TICKS_MAX;
    ticks->step = 0;
    return count;
}

void fv_ticks_of(const struct fv_axis *axis, int most, struct fv_ticks *ticks)
{
    static const struct {
        int factors;
        double factor[4];
        int powers;
    } sets[] = {{4, {1, 2, 3, 5}, 1}, {3, {1, 2, 5}, 1}, {2, {1, 3}, 1}, {1, {1}, 1}, {1, {1}, 2},
                {1, {1}, 5},          {1, {1}, 10},      {1, {1}, 20},   {1, {1}, 50}};
    enum { SETS = sizeof sets / sizeof sets[0] };
    if (!axis->log) {
        linear_ticks(axis, most, ticks);
        return;
    }
    for (int i = 0; i < SETS; i++) {
        int count = log_ticks(axis, sets[i].factors, sets[i].factor, sets[i].powers, ticks);
        if (i == 0 && count < 3) break;
        if (count <= most) return;
    }
    linear_ticks(axis, most, ticks);
}

struct fv_shown fv_tick_text(const struct fv_ticks *ticks, int which)
{
    struct fv_shown out;
    double value = ticks->value[which], size = fabs(value);
    if (size >= 1e5 || ticks->step >= 1000) return fv_shown_count(value);
    if (ticks->step > 0) return fv_shown_fixed(value, ticks->decimals);
    if (size >= 1e-4) snprintf(out.text, sizeof out.text, size >= 1e4 ? "%.0f" : "%.4g", value);
    else
        snprintf(out.text, sizeof out.text, "%.0fe%.0f", value / pow(10, floor(log10(value) + 1e-9)),
                 floor(log10(value) + 1e-9));
    return out;
}
