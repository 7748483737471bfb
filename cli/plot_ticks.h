/* plot_ticks: where an axis has its ticks, at round numbers, and what stands beside them. */
#ifndef FV_CLI_PLOT_TICKS_H
#define FV_CLI_PLOT_TICKS_H

#include "cli/markup.h"
#include "cli/plot.h"

enum { FV_TICKS_MAX = 24 };

struct fv_ticks {
    int count;
    double value[FV_TICKS_MAX];
    double step;  /* between ticks, 0 where it differs */
    int decimals; /* that tell them apart; with a step only */
};

/* At most about `most` (3 to 12) ticks, rising. */
void fv_ticks_of(const struct fv_axis *axis, int most, struct fv_ticks *ticks);

struct fv_shown fv_tick_text(const struct fv_ticks *ticks, int which);

#endif
