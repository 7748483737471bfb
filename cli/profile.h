/* profile: the profile of a session, by stage and by eccentricity, as its reports and `run` itself show it.
 */
#ifndef FV_CLI_PROFILE_H
#define FV_CLI_PROFILE_H

#include "rt/frame/session.h"

/* Wall times in ms of the recorded frames; NaN where there is none. */
struct fv_stage_row {
    const char *name;
    double rate_hz;                /* how often it ran, a second of the run (fv_stage_seconds) */
    double p50_ms, p99_ms, max_ms; /* of all frames: 0 in those in which it did not run */
    double share;                  /* of the mean frame time */
    int64_t late;                  /* frames in which it ended after the deadline; -1: not a stage */
};

/* Seconds that the recorded frames took: of session time, or of their frame times together where that is
 * longer, as it is where the display does not pace the run. 0 where there is no frame. */
double fv_stage_seconds(const struct fv_session *session);

/* The session's stages in their order; behind them, where they were measured: "control"; "idle", what a
 * worker waited for others within the stages, on average of the workers, which the stages' times hold, too;
 * "in no stage", what is left of the frame time. Returns the number of rows. */
enum { FV_STAGE_ROWS_MAX = FV_STAGES_MAX + 3 };
int fv_stage_rows(const struct fv_session *session, struct fv_stage_row row[FV_STAGE_ROWS_MAX]);

/* The part of the workers' frame time that they waited for each other; NaN where it is not known. */
double fv_idle_share(const struct fv_session *session);

/* Rings of eccentricity up to the last one in which anything was done, and what a unit of work cost in one
 * (CPU ns; NaN where none was done). */
int fv_rings(const struct fv_session *session);
double fv_ring_ns_per_unit(const struct fv_ring *ring);

#endif
