/* clock: time as an argument. All times are int64_t nanoseconds; names end in _ns. */
#ifndef FV_PLATFORM_CLOCK_H
#define FV_PLATFORM_CLOCK_H

#include <stdint.h>

/* A clock that a test can replace by a made-up one. */
struct fv_clock {
    int64_t (*now_ns)(void *context);
    int64_t (*thread_ns)(void *context); /* CPU time used by the calling thread so far: preemption does not count */
    void (*sleep_until_ns)(void *context, int64_t t_ns); /* returns then, or earlier on a signal */
    void *context;
};

static inline int64_t fv_clock_now_ns(const struct fv_clock *clock)
{
    return clock->now_ns(clock->context);
}

static inline int64_t fv_clock_cpu_ns(const struct fv_clock *clock)
{
    return clock->thread_ns(clock->context);
}

static inline void fv_clock_sleep_until_ns(const struct fv_clock *clock, int64_t t_ns)
{
    clock->sleep_until_ns(clock->context, t_ns);
}

/* CLOCK_MONOTONIC and CLOCK_THREAD_CPUTIME_ID. */
extern const struct fv_clock fv_clock_monotonic;

/* The thread clock of fv_clock_monotonic. */
int64_t fv_clock_thread_ns(void);

#endif
