/* flight: a fly-through: the same frames rendered by several renderers in turn, the first of them `full`, so
 * that a ratio of their times is of one moment and one pose. For tables and benches.
 *
 * Counted frames come in pieces of FV_FLIGHT_PIECE at the display's rate, spread evenly over `path_frames`
 * frames of the viewer's way: at least as many counted ones are the way as a whole. Where a piece does not
 * follow the one before, histories are dropped and FV_FLIGHT_WARM frames go before it uncounted. Full is
 * rendered beside about FV_FLIGHT_FULL of the counted frames, evenly spread: beside all, where they are fewer.
 * The gaze is straight ahead, as in Weier et al. 2016, section 4.1. Times are without presenting, which is
 * timed as a stage of its own. */
#ifndef FV_MEASURE_FLIGHT_H
#define FV_MEASURE_FLIGHT_H

#include "rt/measure/contest.h"

enum { FV_FLIGHT_SIDES = 4, FV_FLIGHT_PIECE = 50, FV_FLIGHT_WARM = 5, FV_FLIGHT_FULL = 100 };

/* A renderer. Side 0 is full. */
struct fv_flight_side {
    const char *method;
    struct fv_foveal foveal;
    struct fv_config config;
    struct fv_contender own;
    struct fv_frame_record *record; /* of the counted frames; side 0: of those that it was rendered beside */
};

struct fv_flight {
    int frames, path_frames, sides;
    struct fv_flight_side side[FV_FLIGHT_SIDES];
    int full;        /* counted frames that full is rendered beside, about; 0: FV_FLIGHT_FULL */
    int fulls;       /* records of side 0 */
    int *beside;     /* the counted frame that each of them is of */
    double *scratch; /* for order statistics */
    struct fv_workers *workers;
    const struct fv_sweep_io *io;
    /* Called after each counted frame of a side, NULL: not. */
    void (*rendered)(void *context, int side, int frame);
    void *context;
};

/* Takes all memory. The sides' methods and foveal regions, `frames` >= 1 and `path_frames` >= 1 are set;
 * `config` gives the rest of the settings, with a sink so that pictures are made. */
void fv_flight_open(struct fv_flight *flight, const struct fv_config *config, const struct fv_tracer *tracer,
                    struct fv_workers *workers, const struct fv_sweep_io *io);

/* The frame of the way, 0 to path_frames - 1 (more where there are more counted frames), of counted frame n. */
int fv_flight_at(const struct fv_flight *flight, int n);

/* Renders everything. Returns 0; 1: stopped. `what`: for io->progress. */
int fv_flight_run(struct fv_flight *flight, const char *what);

/* A number of a record. */
typedef double fv_flight_of(const struct fv_frame_record *record, int which);
double fv_flight_frame_ms(const struct fv_frame_record *record, int unused);
double fv_flight_stage_ms(const struct fv_frame_record *record, int stage);
double fv_flight_rays(const struct fv_frame_record *record, int unused);
double fv_flight_sampled(const struct fv_frame_record *record, int unused);

/* Median and quartiles, and mean, of a side's counted frames. */
struct fv_measured fv_flight_median(const struct fv_flight *flight, int side, fv_flight_of *of, int which);
double fv_flight_mean(const struct fv_flight *flight, int side, fv_flight_of *of, int which);

/* Full's time over the side's, frames of the same pose: median and quartiles of the ratios. */
struct fv_measured fv_flight_speedup(const struct fv_flight *flight, int side);

#endif
