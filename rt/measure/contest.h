/* contest: one row of a sweep measured: a method at a level against the full renderer, frame by frame
 * in turn, and its pictures judged. See sweep.h for what a row is. */
#ifndef FV_MEASURE_CONTEST_H
#define FV_MEASURE_CONTEST_H

#include "rt/measure/sweep.h"

enum { FV_SWEEP_FRAMES = FV_SWEEP_WARM + FV_SWEEP_TIMED };
enum { FV_CONTEST_SHOWN = FV_SWEEP_SEGMENTS / 2 }; /* the segment whose pictures are kept */

/* A method with its frame loop. */
struct fv_contender {
    struct fv_plan plan;
    struct fv_session session;
    struct fv_loop loop;
};

struct fv_contest {
    struct fv_sweep_frame frame[FV_SWEEP_SEGMENTS][FV_SWEEP_FRAMES];
    struct fv_config plain; /* one sample a pixel, no pictures: the full renderer's */
    struct fv_contender full;
    struct fv_reference *reference;
    struct fv_metrics *metrics;
    double ppd;      /* pixels a degree at the picture's centre */
    uint8_t *before; /* the row's picture before the last one, packed */
    struct fv_workers *workers;
    const struct fv_sweep_io *io;
    const char *what;          /* for io->progress */
    double done_from, done_to; /* the parts of the sweep between which the row lies */
};

/* Decides what the method needs; takes no memory. */
void fv_contender_plan(struct fv_contender *contender, const struct fv_method *method,
                       const struct fv_config *config, const struct fv_tracer *tracer);

/* Takes its memory, once. */
void fv_contender_open(struct fv_contender *contender, const struct fv_config *config,
                       const struct fv_tracer *tracer, struct fv_workers *workers);

/* Takes the memory of what all rows share. */
void fv_contest_open(struct fv_contest *contest, struct fv_reference *reference,
                     const struct fv_config *config, const struct fv_tracer *tracer,
                     struct fv_workers *workers, const struct fv_sweep_io *io);

/* Seconds that a full frame takes, and the judging of one row's pictures. */
void fv_contest_calibrate(struct fv_contest *contest, double *full, double *judging);

/* Seconds that a frame of the contender at a level takes, from a few frames where it has a history; otherwise
 * from that of the full renderer. */
double fv_contest_guess(struct fv_contest *contest, struct fv_contender *contender, int level, double full);

/* How much of a row is measured. */
struct fv_contest_effort {
    int repeats; /* times through all segments */
    int timed;   /* frames timed in each, 2 to FV_SWEEP_TIMED */
    int full; /* how many of those with a full frame beside it, 1 to `timed`; the others take the last one's
               */
};

/* Fills in what is measured of `row`, whose level is set, and writes a picture and its FLIP map. Returns 0;
 * 1: stopped; -1 with the error set. */
int fv_contest_run(struct fv_contest *contest, struct fv_contender *contender,
                   const struct fv_contest_effort *effort, struct fv_measure_row *row, const char *picture,
                   const char *difference, struct fv_error *error);

#endif
