/* clock: the kernel's clocks behind clock.h. */
#define _GNU_SOURCE
#include "platform/clock.h"

#include <time.h>

static int64_t read_ns(clockid_t id)
{
    struct timespec t;
    clock_gettime(id, &t);
    return (int64_t)t.tv_sec * 1000000000 + t.tv_nsec;
}

static int64_t monotonic_ns(void *context)
{
    (void)context;
    return read_ns(CLOCK_MONOTONIC);
}

static int64_t thread_ns(void *context)
{
    (void)context;
    return read_ns(CLOCK_THREAD_CPUTIME_ID);
}

static void sleep_until_ns(void *context, int64_t t_ns)
{
    (void)context;
    if (t_ns <= 0) return;
    struct timespec until = {.tv_sec = t_ns / 1000000000, .tv_nsec = t_ns % 1000000000};
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, NULL);
}

const struct fv_clock fv_clock_monotonic = {monotonic_ns, thread_ns, sleep_until_ns, NULL};

int64_t fv_clock_thread_ns(void)
{
    return read_ns(CLOCK_THREAD_CPUTIME_ID);
}
