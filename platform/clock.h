/* clock: time as an argument. All times are int64_t nanoseconds; names end in _ns. */
#ifndef FV_PLATFORM_CLOCK_H
#define FV_PLATFORM_CLOCK_H

#include <stdint.h>

/* A clock that a test can replace by a made-up one. */
struct fv_clock {
    int64_t (*now_ns)(void *context);
    void *context;
};

static inline int64_t fv_clock_now_ns(const struct fv_clock *clock)
{
    return clock->now_ns(clock->context);
}

/* CLOCK_MONOTONIC. */
extern const struct fv_clock fv_clock_monotonic;

/* CPU time used by the calling thread so far: preemption does not count. */
int64_t fv_clock_thread_ns(void);

#endif
