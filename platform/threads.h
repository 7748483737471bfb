/* threads: pinned workers that live as long as the program and run the tiles of a pass; and threads of devices.
 *
 * The calling thread is worker 0. Tile numbers are handed out one after another from a shared counter;
 * which worker gets which tile must not change any result. Between runs the workers spin for a short
 * while and then sleep on a futex. */
#ifndef FV_PLATFORM_THREADS_H
#define FV_PLATFORM_THREADS_H

#include "platform/error.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

enum { FV_WORKERS_MAX = 64, FV_DEVICE_THREADS_MAX = 8, FV_WORKER_STACK_BYTES = 2 << 20, FV_DEVICE_STACK_BYTES = 2 << 20 };

typedef void fv_worker_function(void *context, int worker);
typedef void fv_tile_function(void *context, int tile, int worker);

struct fv_workers {
    int count; /* workers, the calling thread included */
    /* The run under way. */
    fv_worker_function *function;
    void *context;
    _Alignas(64) atomic_uint generation; /* raised once a run: wakes the workers */
    _Alignas(64) atomic_int working;     /* workers that have not finished this run */
    atomic_bool stop;
};

/* Number of cores that this process may run on. */
int fv_threads_cores(void);

/* Leaves this process only the cores of the list, as in "4-7" or "0,2-3", threads that are started from now on too.
 * Returns 0, or -1 with the error set: no such list, or none of these cores may be used. */
int fv_threads_keep_to(const char *cores, struct fv_error *error);

/* Starts `count` - 1 threads (1 to FV_WORKERS_MAX), their stacks taken from the arena.
 * Denormals are off in every worker.
 * Returns the number that could be started (at least 1). */
int fv_workers_start(struct fv_workers *workers, int count);

/* Pins each worker to a core of its own, of those that the process may run on. Returns 0, or -1 with the
 * reason in `error`; then none is pinned. */
int fv_workers_pin(const struct fv_workers *workers, struct fv_error *error);

/* The thread of a worker that was started; 0 is the thread that started them. */
pthread_t fv_workers_thread(int worker);

/* Runs function(context, worker) once on every worker and returns when all are done. */
void fv_workers_each(struct fv_workers *workers, fv_worker_function *function, void *context);

/* Runs function(context, tile, worker) for every tile in [0, tiles), on all workers, and
 * returns when all are done. */
void fv_workers_run(struct fv_workers *workers, int tiles, fv_tile_function *function, void *context);

/* Ends the threads (tests; the program itself just exits). */
void fv_workers_stop(struct fv_workers *workers);

/* A thread that waits for a device is urgent: where workers are real-time, it is one more (realtime.h). One that writes
 * files can wait. */
enum fv_urgency { FV_CAN_WAIT, FV_URGENT };

/* Starts a thread beside the workers, its stack taken from the arena ("device stacks"); no signal reaches it but
 * its own faults, and it keeps to its list of system calls where that is asked for (sandbox.h). An ordinary one, whatever
 * class the caller is of. name: at most 15 characters, as the system shows it. At most
 * FV_DEVICE_THREADS_MAX urgent ones. Returns 0, or -1 with the error set. */
int fv_thread_start(pthread_t *thread, const char *name, enum fv_urgency urgency, void *(*function)(void *),
                    void *context, struct fv_error *error);

/* For the last line of such a thread's function: tells that it is done, and sleeps for good. The end of a thread gives
 * memory back, which the sealed heap takes for a fault. */
void *fv_thread_rest(atomic_bool *done);

/* Waits for that, for at most so long; false: in vain. */
bool fv_thread_await(const atomic_bool *done, int64_t most_ns);

/* The urgent ones that were started; returns their number. */
int fv_device_threads(const pthread_t **threads);

#endif
