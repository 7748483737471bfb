/* sweep: error against run time of one scene: every method that can show it, at every level.
 *
 * The viewer's path is seen at FV_SWEEP_SEGMENTS places, FV_SWEEP_FRAMES frames at each, at the
 * display's rate. A row (a method at a level) runs through each segment's frames; the last ones are
 * timed, all or some of them with the full renderer before or after at the same pose, so that speed-ups
 * are ratios of one moment. The left eye's last picture of each segment is judged against the
 * reference (reference.h), at two of them the last two together for flicker. Times are of all eyes.
 *
 * Everything is kept in a folder as soon as it is there: reference/ (reference.h), rows/ (row.h),
 * pictures/ (JPEG, for the report). What is there already is taken, not measured again. */
#ifndef FV_MEASURE_SWEEP_H
#define FV_MEASURE_SWEEP_H

#include "rt/measure/reference.h"
#include "rt/measure/row.h"

enum { FV_SWEEP_WARM = 6, FV_SWEEP_TIMED = 6, FV_SWEEP_REPEATS_MAX = 100, FV_SWEEP_SECONDS = 480 };

struct fv_sweep_io {
    void *context;
    /* As in struct fv_loop_io; times grow from call to call. */
    void (*latch)(void *context, int64_t t_ns, struct fv_pose *head, double gaze[2][3],
                  double *uncertainty_deg);
    /* True when the user wants it to end: the row under way is given up. */
    bool (*stopped)(void *context);
    /* What is being done, and the part of the whole that is done, 0 to 1. */
    void (*progress)(void *context, const char *what, double done);
};

/* Which rows; what they may take. */
struct fv_sweep_choice {
    const char *method; /* NULL: all */
    int level;          /* -1: all */
    int shard, shards;  /* every shards-th row from row shard (0-based) on */
    double seconds;     /* for everything together, about; usually FV_SWEEP_SECONDS */
};

struct fv_sweep; /* opaque, in the arena */

/* Decides what is measured and takes all memory. `tracer`, `workers`, `io` and `out` stay the caller's.
 * Returns 0, or -1 with the error set: no such row, or `out` holds the reference of another scene, version or
 * settings. Its rows are read when their turn comes (fv_sweep_row). */
int fv_sweep_open(struct fv_sweep **sweep, const struct fv_config *config, const struct fv_tracer *tracer,
                  struct fv_workers *workers, const struct fv_sweep_io *io,
                  const struct fv_sweep_choice *choice, const char *out, struct fv_error *error);

/* Rows of this choice, fewer once it is prepared: those left out would take too long for the time given. */
int fv_sweep_left_out(const struct fv_sweep *sweep);

/* Rows of this choice; the scene's name as it stands in rows, and the key that they have. */
int fv_sweep_rows(const struct fv_sweep *sweep);
const char *fv_sweep_scene(const struct fv_sweep *sweep);
const char *fv_sweep_key(const struct fv_sweep *sweep);

/* Makes or loads the reference, and shares the time out among the rows. Returns 0; 1: stopped; -1 with
 * the error set. */
int fv_sweep_prepare(struct fv_sweep *sweep, struct fv_error *error);

/* Row n: from its file where it is there (*measured false), else measured and written. Returns as above. */
int fv_sweep_row(struct fv_sweep *sweep, int n, struct fv_measure_row *row, bool *measured,
                 struct fv_error *error);

#endif
