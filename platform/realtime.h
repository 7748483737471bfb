/* realtime: what a board may ask of the machine beyond what every program gets: a core for each worker, the
 * real-time class, locked memory, short wake-ups of idle cores.
 *
 * Nothing is asked for by default. What is refused is said with the reason, and the program goes on without;
 * what is granted lasts until the program ends. */
#ifndef FV_PLATFORM_REALTIME_H
#define FV_PLATFORM_REALTIME_H

#include "platform/threads.h"

#include <stdbool.h>

enum fv_realtime_extra {
    FV_REALTIME_PIN,     /* each worker on a core of its own */
    FV_REALTIME_FIFO,    /* SCHED_FIFO for every worker, and one above it for devices' threads */
    FV_REALTIME_LOCK,    /* what is used of the arena, the program and the first stack stays in memory */
    FV_REALTIME_LATENCY, /* idle cores wake within a time: /dev/cpu_dma_latency */
    FV_REALTIME_EXTRAS
};

/* Low, so that the kernel's own real-time threads (50 and above) go first. */
enum { FV_FIFO_PRIORITY_MAX = 10 };

struct fv_realtime_request {
    bool pin;
    int fifo_priority; /* of workers, 1 to FV_FIFO_PRIORITY_MAX; 0: not asked for */
    bool lock_memory;
    int cpu_latency_us; /* 0 and above; -1: not asked for */
    const char *root;   /* folder in whose place / is: "" but in tests */
};

struct fv_realtime_row {
    const char *what, *key; /* its name, and the setting that asks for it */
    bool asked, granted;
    char reason[112]; /* what was got, or why not */
};

/* What is asked for, without asking: fills FV_REALTIME_EXTRAS rows. */
void fv_realtime_ask(const struct fv_realtime_request *request, struct fv_realtime_row *row);

/* Asks the system, once, when the workers run and all memory is taken (what is taken later is not locked), but
 * before the heap is sealed; the
 * calling thread is worker 0. Fills FV_REALTIME_EXTRAS rows, and logs a line for each that is refused.
 * - SCHED_FIFO is also refused where busy workers could take every core for good: where the kernel does not
 *   bound real-time threads (sched_rt_runtime_us of -1) and no core is left. Threads started later are
 *   ordinary ones (SCHED_RESET_ON_FORK).
 * - Memory is locked all or none, and not where it would need more than is available. */
void fv_realtime_apply(const struct fv_realtime_request *request, const struct fv_workers *workers,
                       struct fv_realtime_row *row);

#endif
