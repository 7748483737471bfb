/* vantage: places along the viewer's path at which renderers are compared: the frames that lead to each, and
 * how far pictures of it are from one that is kept, by zone of eccentricity. For tables that judge pictures,
 * not only times.
 *
 * A place is led to by FV_VANTAGE_LEAD frames at the display's rate, the last of them at it, so that methods
 * with a history have one, of a viewer who moves. Places are spread evenly over the path; where it is too
 * short for that, or stands still, they follow one another in time. */
#ifndef FV_MEASURE_VANTAGE_H
#define FV_MEASURE_VANTAGE_H

#include "rt/measure/contest.h"

enum { FV_VANTAGE_LEAD = 12, FV_VANTAGE_PLACES_MAX = 64 };

/* Of pictures without any difference, dB: cells of tables are finite. */
#define FV_VANTAGE_SAME_DB 99.0

/* A renderer, with settings of its own that may change from picture to picture (fv_loop_settings). */
struct fv_vantage_side {
    struct fv_config config;
    struct fv_contender own;
};

struct fv_vantage {
    const struct fv_config *config;
    const struct fv_tracer *tracer;
    struct fv_workers *workers;
    const struct fv_sweep_io *io;
    int places;
    double drift_deg_s; /* the gaze goes to the right at this speed, and is straight ahead at the place; at
                           first 0 */
    struct fv_sweep_frame frame[FV_VANTAGE_LEAD];
    struct fv_metrics *metrics;
    uint8_t *kept, *zone; /* the picture that others are judged by, packed, and its pixels' zones */
};

/* Takes the memory. `places` above FV_VANTAGE_PLACES_MAX count as so many. What is handed in stays the
 * caller's. */
void fv_vantage_open(struct fv_vantage *vantage, const struct fv_config *config,
                     const struct fv_tracer *tracer, struct fv_workers *workers, const struct fv_sweep_io *io,
                     int places);

/* Takes the memory of a side, whose config is set. */
void fv_vantage_side_open(const struct fv_vantage *vantage, struct fv_vantage_side *side, const char *method);

/* The same, of the left eye alone at `spp` samples a pixel by `full`: what others are judged by. */
void fv_vantage_truth_open(const struct fv_vantage *vantage, struct fv_vantage_side *side, int spp);

/* Latches the frames that lead to the place; places in rising order, each once. */
void fv_vantage_go(struct fv_vantage *vantage, int place);

/* Frame n of the lead, 0 to FV_VANTAGE_LEAD - 1. */
void fv_vantage_render(struct fv_vantage *vantage, struct fv_vantage_side *side, int n,
                       struct fv_frame_record *record);

/* The last `frames` of the lead, 1 to FV_VANTAGE_LEAD, by its settings as they are now, from a restart on.
 * Returns the record of the last one. */
struct fv_frame_record fv_vantage_arrive(struct fv_vantage *vantage, struct fv_vantage_side *side,
                                         int frames);

/* The left eye's picture as the side rendered it last: keeps it, or judges it by the one kept,
 * FV_VANTAGE_SAME_DB where there is no difference. */
void fv_vantage_keep(struct fv_vantage *vantage, struct fv_vantage_side *side);
void fv_vantage_judge(struct fv_vantage *vantage, struct fv_vantage_side *side, struct fv_errors *errors);

#endif
