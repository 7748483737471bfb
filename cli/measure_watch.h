/* measure_watch: what every measurement goes by: heads from the settings' sensors, signals that end it, a line
 * of progress. */
#ifndef FV_CLI_MEASURE_WATCH_H
#define FV_CLI_MEASURE_WATCH_H

#include "cli/cli.h"
#include "rt/measure/sweep.h"

struct fv_measure_watch {
    struct fv_setup *setup;
    int64_t stage_ns;  /* when what is under way began; 0: begin anew */
    double stage_from; /* its part that was done then */
};

/* The watch as its functions; it stays the caller's. */
struct fv_sweep_io fv_measure_io(struct fv_measure_watch *watch);

/* From now on SIGINT and SIGTERM set the number that is pointed at, which is 0 before. */
const volatile int *fv_measure_heed_signals(void);

#endif
