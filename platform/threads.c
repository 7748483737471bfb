/* threads: see threads.h. A run is published by raising `generation`; the last worker to
 * finish wakes the caller by bringing `working` to zero. */
#define _GNU_SOURCE
#include "platform/threads.h"

#include "platform/arena.h"
#include "platform/sandbox.h"

#include <assert.h>
#include <errno.h>
#include <linux/futex.h>
#include <sched.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>
#ifdef __SSE2__
#include <xmmintrin.h>
#endif

enum { SPINS = 20000 };

struct start {
    struct fv_workers *workers;
    int worker;
};

static struct start starts[FV_WORKERS_MAX];
static pthread_t handles[FV_WORKERS_MAX];
static pthread_t devices[FV_DEVICE_THREADS_MAX];
struct device_start {
    void *(*function)(void *);
    void *context;
};
static int device_count;

int fv_threads_cores(void)
{
    cpu_set_t set;
    if (sched_getaffinity(0, sizeof set, &set) != 0) return 1;
    int cores = CPU_COUNT(&set);
    return cores < 1 ? 1 : cores > FV_WORKERS_MAX ? FV_WORKERS_MAX : cores;
}

int fv_threads_keep_to(const char *cores, struct fv_error *error)
{
    cpu_set_t set;
    const char *at = cores;
    CPU_ZERO(&set);
    for (bool more = true; more; at++) {
        char *end;
        long first = strtol(at, &end, 10), last = first;
        if (end == at || first < 0) return fv_error_set(error, "'%.60s': must be numbers of cores, as in 4-7 or 0,2-3", cores);
        if (*end == '-') {
            at = end + 1;
            last = strtol(at, &end, 10);
            if (end == at) last = -1;
        }
        if (last < first || last >= CPU_SETSIZE || (*end && *end != ','))
            return fv_error_set(error, "'%.60s': must be numbers of cores, as in 4-7 or 0,2-3", cores);
        for (long core = first; core <= last; core++) CPU_SET((int)core, &set);
        at = end;
        more = *end == ',';
    }
    if (sched_setaffinity(0, sizeof set, &set) == 0) return 0;
    return fv_error_set(error, "%.60s: none of these cores may be used here (%s)", cores, strerror(errno));
}

static void relax(void)
{
#ifdef __SSE2__
    _mm_pause();
#else
    __asm__ volatile("yield");
#endif
}

static void denormals_off(void)
{
#ifdef __SSE2__
    _mm_setcsr(_mm_getcsr() | 0x8040); /* flush to zero, denormals are zero */
#elif defined(__aarch64__)
    uint64_t control;
    __asm__ volatile("mrs %0, fpcr" : "=r"(control));
    __asm__ volatile("msr fpcr, %0" : : "r"(control | (1u << 24)));
#endif
}

/* Waits until *word differs from `value`. */
static void wait_change(atomic_uint *word, unsigned value)
{
    for (int i = 0; i < SPINS; i++) {
        if (atomic_load_explicit(word, memory_order_acquire) != value) return;
        relax();
    }
    while (atomic_load_explicit(word, memory_order_acquire) == value)
        syscall(SYS_futex, word, FUTEX_WAIT_PRIVATE, value, NULL, NULL, 0);
}

static void *worker_main(void *argument)
{
    struct start *s = argument;
    struct fv_workers *w = s->workers;
    denormals_off();
    unsigned seen = 0;
    for (;;) {
        wait_change(&w->generation, seen);
        seen++;
        if (atomic_load_explicit(&w->stop, memory_order_relaxed)) return NULL;
        w->function(w->context, s->worker);
        atomic_fetch_sub_explicit(&w->working, 1, memory_order_release);
    }
}

pthread_t fv_workers_thread(int worker)
{
    return handles[worker];
}

int fv_workers_pin(const struct fv_workers *w, struct fv_error *error)
{
    cpu_set_t allowed, one;
    if (sched_getaffinity(0, sizeof allowed, &allowed) != 0) return fv_error_set(error, "%s", strerror(errno));
    int cores = CPU_COUNT(&allowed), worker = 0, refused = 0;
    if (w->count > cores)
        return fv_error_set(error, "%d workers on %d cores: not one for each", w->count, cores);
    for (int core = 0; core < CPU_SETSIZE && worker < w->count && !refused; core++) {
        if (!CPU_ISSET(core, &allowed)) continue;
        CPU_ZERO(&one);
        CPU_SET(core, &one);
        refused = pthread_setaffinity_np(handles[worker], sizeof one, &one);
        if (!refused) worker++;
    }
    if (!refused) return 0;
    for (int i = 0; i < worker; i++) pthread_setaffinity_np(handles[i], sizeof allowed, &allowed);
    return fv_error_set(error, "worker %d: %s", worker, strerror(refused));
}

int fv_workers_start(struct fv_workers *w, int count)
{
    assert(count >= 1 && count <= FV_WORKERS_MAX);
    *w = (struct fv_workers){.count = 1};
    handles[0] = pthread_self();
    denormals_off();
    for (int i = 1; i < count; i++) {
        pthread_attr_t attributes;
        pthread_attr_init(&attributes);
        char *stack = fv_arena_take(fv_arena(), "worker stacks", FV_WORKER_STACK_BYTES, 4096);
        pthread_attr_setstack(&attributes, stack, FV_WORKER_STACK_BYTES);
        starts[i] = (struct start){w, i};
        int failed = pthread_create(&handles[i], &attributes, worker_main, &starts[i]);
        pthread_attr_destroy(&attributes);
        if (failed) break;
        w->count++;
    }
    return w->count;
}

void fv_workers_each(struct fv_workers *w, fv_worker_function *function, void *context)
{
    w->function = function;
    w->context = context;
    atomic_store_explicit(&w->working, w->count - 1, memory_order_relaxed);
    if (w->count > 1) {
        atomic_fetch_add_explicit(&w->generation, 1, memory_order_release);
        syscall(SYS_futex, &w->generation, FUTEX_WAKE_PRIVATE, FV_WORKERS_MAX, NULL, NULL, 0);
    }
    function(context, 0);
    int spins = 0;
    while (atomic_load_explicit(&w->working, memory_order_acquire) > 0) {
        if (++spins < SPINS) relax();
        else sched_yield();
    }
}

struct queue {
    fv_tile_function *function;
    void *context;
    int tiles;
    _Alignas(64) atomic_int next;
};

static void run_queue(void *context, int worker)
{
    struct queue *q = context;
    for (;;) {
        int tile = atomic_fetch_add_explicit(&q->next, 1, memory_order_relaxed);
        if (tile >= q->tiles) return;
        q->function(q->context, tile, worker);
    }
}

void fv_workers_run(struct fv_workers *w, int tiles, fv_tile_function *function, void *context)
{
    struct queue queue = {.function = function, .context = context, .tiles = tiles};
    fv_workers_each(w, run_queue, &queue);
}

void fv_workers_stop(struct fv_workers *w)
{
    atomic_store(&w->stop, true);
    atomic_fetch_add_explicit(&w->generation, 1, memory_order_release);
    syscall(SYS_futex, &w->generation, FUTEX_WAKE_PRIVATE, FV_WORKERS_MAX, NULL, NULL, 0);
    for (int i = 1; i < w->count; i++) pthread_join(handles[i], NULL);
    w->count = 1;
}

/* What it is to run lies at the low end of its stack. */
static void *device_main(void *argument)
{
    struct device_start start = *(struct device_start *)argument;
    fv_sandbox_enter_device();
    return start.function(start.context);
}

int fv_thread_start(pthread_t *thread, const char *name, enum fv_urgency urgency, void *(*function)(void *),
                    void *context, struct fv_error *error)
{
    static const int faults[] = {SIGSEGV, SIGBUS, SIGFPE, SIGILL}; /* while blocked they end the program past their handlers */
    pthread_attr_t attributes;
    sigset_t all, before;
    assert(urgency != FV_URGENT || device_count < FV_DEVICE_THREADS_MAX);
    sigfillset(&all);
    for (size_t i = 0; i < sizeof faults / sizeof faults[0]; i++) sigdelset(&all, faults[i]);
    pthread_attr_init(&attributes);
    char *stack = fv_arena_take(fv_arena(), "device stacks", FV_DEVICE_STACK_BYTES, 4096);
    *(struct device_start *)stack = (struct device_start){function, context};
    pthread_attr_setstack(&attributes, stack, FV_DEVICE_STACK_BYTES);
    if (sched_getscheduler(0) != SCHED_OTHER) pthread_attr_setinheritsched(&attributes, PTHREAD_EXPLICIT_SCHED);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    int failed = pthread_create(thread, &attributes, device_main, stack);
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    pthread_attr_destroy(&attributes);
    if (failed) return fv_error_set(error, "thread %s: %s", name, strerror(failed));
    pthread_setname_np(*thread, name);
    if (urgency == FV_URGENT) devices[device_count++] = *thread;
    return 0;
}

void *fv_thread_rest(atomic_bool *done)
{
    atomic_store_explicit(done, true, memory_order_release);
    for (;;) pause();
}

bool fv_thread_await(const atomic_bool *done, int64_t most_ns)
{
    const struct timespec nap = {.tv_nsec = 1000000};
    for (; most_ns > 0 && !atomic_load_explicit(done, memory_order_acquire); most_ns -= nap.tv_nsec) nanosleep(&nap, NULL);
    return atomic_load_explicit(done, memory_order_acquire);
}

int fv_device_threads(const pthread_t **threads)
{
    *threads = devices;
    return device_count;
}
