/* realtime: a table of extras, a row each; see realtime.h, and memlock.h for the locking of memory. */
#define _GNU_SOURCE
#include "platform/realtime.h"

#include "platform/files.h"
#include "platform/log.h"
#include "platform/memlock.h"

#include <assert.h>
#include <errno.h>
#include <fcntl.h>
#include <sched.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/sysinfo.h>
#include <unistd.h>

static bool pin_is_asked(const struct fv_realtime_request *r)
{
    return r->pin;
}

static bool fifo_is_asked(const struct fv_realtime_request *r)
{
    return r->fifo_priority > 0;
}

static bool lock_is_asked(const struct fv_realtime_request *r)
{
    return r->lock_memory;
}

static bool latency_is_asked(const struct fv_realtime_request *r)
{
    return r->cpu_latency_us >= 0;
}

static int pin(const struct fv_realtime_request *r, const struct fv_workers *w, struct fv_error *said)
{
    (void)r;
    if (fv_workers_pin(w, said)) return -1;
    fv_error_set(said, "%d workers, each on a core of its own", w->count);
    return 0;
}

/* Milliseconds of each second that the kernel lets real-time threads have, -1 where it does not bound them. A
 * kernel that does not say has its own default. */
static int fifo_bound_ms(const struct fv_realtime_request *r)
{
    char path[FV_PATH_MAX];
    long long runtime_us = 950000, period_us = 1000000;
    const struct {
        const char *file;
        long long *value;
    } files[] = {{"sched_rt_runtime_us", &runtime_us}, {"sched_rt_period_us", &period_us}};
    for (int i = 0; i < 2; i++) {
        snprintf(path, sizeof path, "%s/proc/sys/kernel/%s", r->root, files[i].file);
        FILE *f = fopen(path, "re");
        if (f && fscanf(f, "%lld", files[i].value) != 1) *files[i].value = -1;
        if (f) fclose(f);
    }
    return runtime_us < 0 || period_us <= 0 ? -1 : (int)(1000 * runtime_us / period_us);
}

static int say_fifo_refused(int refused, int priority, struct fv_error *said)
{
    struct rlimit limit = {0, 0};
    if (refused != EPERM) return fv_error_set(said, "SCHED_FIFO %d: %s", priority, strerror(refused));
    getrlimit(RLIMIT_RTPRIO, &limit);
    if (limit.rlim_cur >= (rlim_t)priority || geteuid() == 0)
        return fv_error_set(said,
                            "not permitted: CAP_SYS_NICE is missing, or the control group has no real-time "
                            "share (cpu.rt_runtime_us)");
    return fv_error_set(said,
                        "not permitted: needs CAP_SYS_NICE or an rtprio limit of %d (ulimit -r), now %llu",
                        priority, (unsigned long long)limit.rlim_cur);
}

/* Above the workers, who would keep a device waiting for whole frames: it takes a few microseconds of a millisecond. Where
 * only the workers' priority is permitted that, between their runs. Returns the priority that all of them got, 0: none. */
static int set_devices_fifo(int worker_priority)
{
    const pthread_t *thread;
    int threads = fv_device_threads(&thread), least = threads > 0 ? worker_priority + 1 : 0;
    for (int i = 0; i < threads; i++) {
        int priority = worker_priority + 1;
        struct sched_param fifo = {.sched_priority = priority};
        while (priority > 0 && pthread_setschedparam(thread[i], SCHED_FIFO | SCHED_RESET_ON_FORK, &fifo)) {
            priority = priority > worker_priority ? worker_priority : 0;
            fifo.sched_priority = priority;
        }
        if (priority < least) least = priority;
    }
    return least;
}

static int set_fifo(const struct fv_realtime_request *r, const struct fv_workers *w, struct fv_error *said)
{
    struct sched_param fifo = {.sched_priority = r->fifo_priority}, ordinary = {.sched_priority = 0};
    struct rlimit limit;
    int bound_ms = fifo_bound_ms(r), cores = get_nprocs();
    assert(r->fifo_priority <= FV_FIFO_PRIORITY_MAX);
    if (bound_ms < 0 && w->count >= cores)
        return fv_error_set(said,
                            "sched_rt_runtime_us is -1: %d busy workers could take all %d cores for good",
                            w->count, cores);
    if (getrlimit(RLIMIT_RTTIME, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY)
        return fv_error_set(said, "RLIMIT_RTTIME is %llu us: a busy worker would be killed; needs unlimited",
                            (unsigned long long)limit.rlim_cur);
    for (int i = 0; i < w->count; i++) {
        int refused = pthread_setschedparam(fv_workers_thread(i), SCHED_FIFO | SCHED_RESET_ON_FORK, &fifo);
        if (!refused) continue;
        /* Some in the class and some not would wait for each other. */
        while (i-- > 0)
            pthread_setschedparam(fv_workers_thread(i), SCHED_OTHER | SCHED_RESET_ON_FORK, &ordinary);
        return say_fifo_refused(refused, r->fifo_priority, said);
    }
    char of_devices[32] = "";
    int device_priority = set_devices_fifo(r->fifo_priority);
    if (device_priority > 0) snprintf(of_devices, sizeof of_devices, ", devices' at %d", device_priority);
    if (bound_ms < 0) fv_error_set(said, "%d workers at priority %d%s", w->count, r->fifo_priority, of_devices);
    else
        fv_error_set(said, "%d workers at priority %d%s; at most %d ms of a second (sched_rt_runtime_us)",
                     w->count, r->fifo_priority, of_devices, bound_ms);
    return 0;
}

static int lock_memory(const struct fv_realtime_request *r, const struct fv_workers *w, struct fv_error *said)
{
    char meminfo[FV_PATH_MAX];
    size_t bytes;
    (void)w;
    snprintf(meminfo, sizeof meminfo, "%s/proc/meminfo", r->root);
    if (fv_memlock(meminfo, &bytes, said)) return -1;
    fv_error_set(said, "%zu MB: what is taken of the arena, the program, the first stack", bytes >> 20);
    return 0;
}

/* Documentation/power/pm_qos_interface.rst of Linux: microseconds as a binary 32-bit number; the request
 * holds while the file is open, here until the program ends. Reading gives the least of all requests. */
static int hold_latency(const struct fv_realtime_request *r, const struct fv_workers *w,
                        struct fv_error *said)
{
    char path[FV_PATH_MAX];
    int32_t asked_us = r->cpu_latency_us, least_us = asked_us;
    (void)w;
    snprintf(path, sizeof path, "%s/dev/cpu_dma_latency", r->root);
    int fd = open(path, O_RDWR | O_CLOEXEC);
    if (fd < 0 && errno == ENOENT) return fv_error_set(said, "no /dev/cpu_dma_latency on this kernel");
    if (fd < 0 && (errno == EACCES || errno == EPERM))
        return fv_error_set(
            said, "not permitted: needs write access to /dev/cpu_dma_latency (a udev rule, or root)");
    if (fd < 0) return fv_error_set(said, "/dev/cpu_dma_latency: %s", strerror(errno));
    ssize_t written = write(fd, &asked_us, sizeof asked_us);
    if (written != sizeof asked_us) {
        fv_error_set(said, "/dev/cpu_dma_latency: %s",
                     written < 0 ? strerror(errno) : "not all bytes were taken");
        close(fd);
        return -1;
    }
    if (pread(fd, &least_us, sizeof least_us, 0) == sizeof least_us && least_us < asked_us)
        fv_error_set(said, "idle cores wake within %d us, as another program asks", (int)least_us);
    else fv_error_set(said, "idle cores wake within %d us", (int)asked_us);
    return 0;
}

/* apply: 0, or -1 where it is refused; `said` is what was got, or why not. */
static const struct {
    const char *what, *key, *off; /* off: what the key says where it asks for nothing */
    bool (*is_asked)(const struct fv_realtime_request *r);
    int (*apply)(const struct fv_realtime_request *r, const struct fv_workers *w, struct fv_error *said);
} extras[FV_REALTIME_EXTRAS] = {
    [FV_REALTIME_PIN] = {"pinned workers", "threads.pin", "off", pin_is_asked, pin},
    [FV_REALTIME_FIFO] = {"real-time class", "threads.fifo", "0", fifo_is_asked, set_fifo},
    [FV_REALTIME_LOCK] = {"locked memory", "threads.lock_memory", "off", lock_is_asked, lock_memory},
    [FV_REALTIME_LATENCY] = {"short wake-up", "threads.cpu_latency_us", "-1", latency_is_asked, hold_latency},
};

void fv_realtime_ask(const struct fv_realtime_request *r, struct fv_realtime_row *row)
{
    for (int i = 0; i < FV_REALTIME_EXTRAS; i++) {
        bool asked = extras[i].is_asked(r);
        row[i] = (struct fv_realtime_row){.what = extras[i].what, .key = extras[i].key, .asked = asked};
        if (asked) snprintf(row[i].reason, sizeof row[i].reason, "%s asks for it", extras[i].key);
        else snprintf(row[i].reason, sizeof row[i].reason, "%s is %s", extras[i].key, extras[i].off);
    }
}

void fv_realtime_apply(const struct fv_realtime_request *r, const struct fv_workers *workers,
                       struct fv_realtime_row *row)
{
    struct fv_error said;
    fv_realtime_ask(r, row);
    for (int i = 0; i < FV_REALTIME_EXTRAS; i++) {
        if (!row[i].asked) continue;
        row[i].granted = extras[i].apply(r, workers, &said) == 0;
        snprintf(row[i].reason, sizeof row[i].reason, "%.111s", said.text);
        if (!row[i].granted) fv_log("%s: refused: %s; it goes on without", row[i].key, row[i].reason);
    }
}
