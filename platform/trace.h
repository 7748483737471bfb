/* trace: where the time went, as spans in a fixed ring; written as Chrome trace events,
 * which Perfetto opens. One ring a worker, so that nothing is shared while running. */
#ifndef FV_PLATFORM_TRACE_H
#define FV_PLATFORM_TRACE_H

#include "platform/error.h"

#include <stdbool.h>
#include <stdint.h>

enum { FV_TRACE_SPANS = 1 << 14 }; /* a worker; the oldest are overwritten */

struct fv_span {
    const char *name; /* static string */
    int64_t start_ns, end_ns;
    int64_t frame;
};

struct fv_trace; /* opaque, in the arena */

/* Takes the rings of `workers` workers from the arena ("trace"). */
struct fv_trace *fv_trace_create(int workers);

/* Records one span of one worker; NULL trace is allowed and records nothing. */
void fv_trace_add(struct fv_trace *trace, int worker, const char *name, int64_t frame, int64_t start_ns,
                  int64_t end_ns);

/* Numbers of each frame, drawn as curves above the spans: each is written where the frame's first span of
 * worker 0 begins, for the frames of which that worker's ring still holds spans. */
enum { FV_COUNTERS_MAX = 8 };
struct fv_counters {
    int count;                         /* 0 to FV_COUNTERS_MAX */
    const char *name[FV_COUNTERS_MAX]; /* their unit last */
    /* A frame's numbers; what is not finite is left out. False: the frame has none. */
    bool (*read)(const void *context, int64_t frame, double value[FV_COUNTERS_MAX]);
    const void *context;
};

/* Writes `path`, with `counters` unless NULL; 0 or -1 with the error set. Allocates nothing. */
int fv_trace_write(const struct fv_trace *trace, const struct fv_counters *counters, const char *path,
                   struct fv_error *error);

#endif
