/* clock_map: from a device's clock to the host's. A device stamps its samples by a counter that wraps and runs a
 * little fast or slow; the host knows when a report came, which is later by a latency that jitters but never
 * is negative. So the least of (arrival - device time) is the nearest to the truth: one is kept of each second, a
 * line through those of the last 32 s is the drift, and the lowest of them carries it (the lower envelope;
 * Moon, Skelly and Towsley 1999, Estimation and removal of clock skew, by least squares in place of their
 * linear program). What remains is the least latency that a report ever had, which none can see.
 *
 * Times given out grow from sample to sample. They follow a better estimate at 2 ms a second, so that
 * a velocity is hardly wrong by it, and in one go where it is off by more than 20 ms. */
#ifndef FV_SENSORS_IMU_CLOCK_MAP_H
#define FV_SENSORS_IMU_CLOCK_MAP_H

#include <stdbool.h>
#include <stdint.h>

enum { FV_CLOCK_MAP_SECONDS = 32 };

struct fv_clock_map {
    double tick_ns, drift_max;
    int bits;              /* of the counter, 1 to 64 */
    bool begun;
    uint64_t newest;       /* as the device gave it */
    int64_t ticks;         /* newest, without wraps, from 0 at the first */
    int64_t newest_ns;     /* when it came */
    int64_t first_ns;
    double drift, offset;  /* host = first_ns + device + offset + drift device */
    double applied;        /* what is given out, of offset + drift device; at the device time applied_at */
    double applied_at;
    int64_t given_ns;
    bool given;
    int late;              /* reports in a row that came far too late */
    int64_t restarts;      /* the device's clock jumped forward by more than 20 ms or back by more than 1 s */
    int seconds;           /* of which the least is kept, in a ring */
    int64_t second;        /* the newest of them */
    double least[FV_CLOCK_MAP_SECONDS], least_at[FV_CLOCK_MAP_SECONDS];
};

/* tick_ns finite, > 0. drift_max: the most that a tick may be off, as a part of it: 1e-3 is ten times what crystals
 * are sold with. */
void fv_clock_map_begin(struct fv_clock_map *map, double tick_ns, int bits, double drift_max);

/* A counter's value without its wraps: how many ticks after the first, as near as may be to what arrival_ns says,
 * so it may have wrapped several times (reports that come within half a wrap of their time are told right).
 * Negative: before the first. Does not change the map; 0 before the first report. */
int64_t fv_clock_map_unwrap(const struct fv_clock_map *map, uint64_t counter, int64_t arrival_ns);

/* A report came whose newest sample has this counter. Those older than the newest one so far change nothing. */
void fv_clock_map_arrive(struct fv_clock_map *map, uint64_t counter, int64_t arrival_ns);

/* Host time of a sample, `ticks` after the first one (without wraps); later than all given out before. */
int64_t fv_clock_map_host_ns(struct fv_clock_map *map, int64_t ticks);

#endif
