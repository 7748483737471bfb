/* vsync: the beat of a display, from the times of its refreshes: page flips of the kernel (display/kms.h) or edges
 * of a line (gpio.h). Pure bookkeeping: times are arguments. */
#ifndef FV_PLATFORM_VSYNC_H
#define FV_PLATFORM_VSYNC_H

#include <stdbool.h>
#include <stdint.h>

/* What a loop that follows a display has to know. */
struct fv_beat {
    int64_t flip_ns;   /* of a refresh that has been, CLOCK_MONOTONIC: its scan-out begins */
    int64_t period_ns; /* > 0 */
    int64_t lead_ns;   /* >= 0: so long before a refresh its picture has to be handed over */
};

struct fv_vsync {
    int64_t nominal_ns; /* > 0: what the period is said to be */
    double period_ns;   /* as measured: within a quarter of the nominal one */
    int64_t t_ns;       /* of the newest refresh, where `known` */
    bool known;
    int64_t count, odd; /* refreshes that were taken; times that could not be */
    int odd_in_row;
};

void fv_vsync_begin(struct fv_vsync *vsync, int64_t nominal_ns);

/* A refresh at t_ns, `steps` >= 1 after the one before; 0: as many as the time between says. A time that is not after
 * the last one, or whose steps are more than a quarter off the nominal period, is odd: counted and passed over, but
 * after eight in a row (a mode was set, a clock jumped) it is where the beat begins again. The measured period is the
 * mean of the first 32, then moves by 1/32 of the difference. */
void fv_vsync_saw(struct fv_vsync *vsync, int64_t t_ns, int64_t steps);

/* The newest beat, lead_ns left alone; false where none is known, or the newest refresh is older than a second at
 * now_ns: the display has stopped. */
bool fv_vsync_beat(const struct fv_vsync *vsync, int64_t now_ns, struct fv_beat *beat);

#endif
