/* schedule: in which order the workers take the tiles of each pass, and when they stop.
 *
 * A pass's tiles form one fixed queue: an array of tile numbers and one atomic word that says which is next
 * and whether the queue is closed. Nothing is locked. The first tiles must be worked at; the others are
 * taken until the deadline, less what must still follow, and then get the pass's stand-in. Tiles worked at
 * are always the queue's first ones, so that their number alone makes the same frame again.
 *
 * Orders: nearest to the gaze first (row by row where nothing will be left out); or, where samples are traced,
 * first the tiles of the fovea (FV_FOVEA_DEG), then those within r0, then the others, both by what their absence
 * would cost a ray: acuity at their eccentricity (1 / (1 + e / 2.3 degrees), cortical magnification as in Guenter et
 * al. 2012) x frames that they have waited x need (parts that no history reached count 8 times). */
#ifndef FV_FRAME_SCHEDULE_H
#define FV_FRAME_SCHEDULE_H

#include "platform/clock.h"
#include "platform/trace.h"
#include "rt/frame/control.h"
#include "rt/frame/session.h"
#include "rt/pass/pass.h"

struct fv_schedule {
    int tiles;
    float *eccentricity_deg; /* of each tile's centre */
    uint8_t *waited;         /* frames since each tile's samples were last traced, where some were wanted */
    uint8_t *bucket;         /* of each tile in the order being made */
    uint32_t *by_gaze, *by_need;
    int must; /* tiles that touch the fovea: the first ones of both orders */
    struct fv_rings rings;
    float radius_deg; /* of a tile, from above */
    const struct fv_clock *clock;
    struct fv_workers *workers;
    struct fv_trace *trace;           /* may be NULL */
    struct fv_ring (*ring)[FV_RINGS]; /* of each worker, for the session */
};

/* How long a stage may take. Costs are wall times of all workers together but where CPU time is said; 0 is a
 * cost that is not known. */
struct fv_stage_limit {
    int64_t deadline_ns; /* of `clock`: when all stages have to be done; 0: none */
    double dearer;       /* by how much the stages before took more CPU time than expected; below 1: not */
    double tile_cpu_ns;  /* CPU time of a tile of this stage, where all are alike */
    double stand_in_ns;  /* a stand-in */
    double follow_ns;    /* stages that must still follow; taken as dearer where the frame so far was */
    int done; /* exactly so many tiles are worked at, of a pass that can be cut; -1: as many as there is time
                 for */
};

/* What a stage was. */
struct fv_stage_result {
    int64_t start_ns, end_ns;
    int64_t cpu_ns, idle_ns;         /* of all workers together */
    double units[2], unit_cpu_ns[2]; /* of sparse tiles, of whole ones */
    int done, cut;                   /* tiles worked at; left to the stand-in */
    int64_t stand_in_ns;             /* their wall time, of all workers together */
    int64_t order_ns;                /* before start_ns: putting tiles in order */
};

/* Takes what a frame's tiles need from the arena. */
void fv_schedule_take(struct fv_schedule *schedule, struct fv_frame *frame, struct fv_workers *workers,
                      const struct fv_clock *clock, struct fv_trace *trace);

/* Once a frame, its views being set: eccentricities, rings and the order by gaze. */
void fv_schedule_look(struct fv_schedule *schedule, const struct fv_frame *frame);

/* Least work that makes a frame: all of every pass but those that trace samples, and of these the tiles that
 * must be worked at. `expected`: all of the pass. */
void fv_schedule_least(const struct fv_schedule *schedule, const struct fv_pass *pass,
                       const double expected[2], double least[2]);

/* Runs one pass over all tiles on all workers. */
void fv_schedule_run(struct fv_schedule *schedule, struct fv_frame *frame, const struct fv_pass *pass,
                     const struct fv_stage_limit *limit, struct fv_stage_result *result);

/* What samples cost by eccentricity, of all workers together. */
void fv_schedule_rings(const struct fv_schedule *schedule, struct fv_ring sum[FV_RINGS]);

#endif
