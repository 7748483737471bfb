/* spool: see spool.h. */
#include "platform/spool.h"

#include "platform/log.h"
#include "platform/threads.h"

#include <assert.h>
#include <string.h>
#include <time.h>

/* The writer looks so often whether there is anything: no ring fills in that time. */
static const struct timespec nap = {.tv_nsec = 10000000};

void fv_spool_begin(struct fv_spool *s, const char *name, void *ring, unsigned slots, size_t bytes,
                    fv_spool_write *write, void *context, atomic_int *failed)
{
    assert(slots > 0 && (slots & (slots - 1)) == 0);
    memset(s, 0, sizeof *s);
    s->name = name;
    s->write = write;
    s->context = context;
    s->ring = ring;
    s->slots = slots;
    s->bytes = bytes;
    s->failed = failed ? failed : &s->own_failed;
}

static char *slot(const struct fv_spool *s, unsigned row)
{
    return s->ring + (size_t)(row & (s->slots - 1)) * s->bytes;
}

bool fv_spool_put(struct fv_spool *s, const void *row)
{
    if (!s->ring) return false;
    unsigned put = atomic_load_explicit(&s->put, memory_order_relaxed);
    bool full = put - atomic_load_explicit(&s->taken, memory_order_acquire) >= s->slots;
    if (full || atomic_load_explicit(s->failed, memory_order_relaxed) != 0) {
        atomic_fetch_add_explicit(&s->refused, 1, memory_order_relaxed);
        return false;
    }
    memcpy(slot(s, put), row, s->bytes);
    atomic_store_explicit(&s->put, put + 1, memory_order_release);
    return true;
}

static void fail(struct fv_spool *s, int failure)
{
    atomic_store_explicit(s->failed, failure, memory_order_relaxed);
    fv_log("%s: %s: recording ends here, the run goes on", s->name, strerror(failure));
}

bool fv_spool_drain(struct fv_spool *s)
{
    unsigned at = atomic_load_explicit(&s->taken, memory_order_relaxed);
    unsigned put = atomic_load_explicit(&s->put, memory_order_acquire);
    bool any = at != put;
    for (; at != put; at++) {
        bool failed = atomic_load_explicit(s->failed, memory_order_relaxed) != 0;
        int failure = failed ? 0 : s->write(s->context, slot(s, at));
        if (failure) fail(s, failure);
        atomic_fetch_add_explicit(failed || failure ? &s->lost : &s->written, 1, memory_order_relaxed);
        atomic_store_explicit(&s->taken, at + 1, memory_order_release);
    }
    return any;
}

struct fv_spool_counts fv_spool_counts(const struct fv_spool *s)
{
    return (struct fv_spool_counts){
        .rows = atomic_load_explicit(&s->written, memory_order_relaxed),
        .dropped = atomic_load_explicit(&s->refused, memory_order_relaxed) +
                   atomic_load_explicit(&s->lost, memory_order_relaxed)};
}

static bool drain_all(struct fv_spooler *of)
{
    bool any = false;
    for (int i = 0; i < of->spools; i++) any = fv_spool_drain(of->spool[i]) || any;
    return any;
}

static void *writer(void *argument)
{
    struct fv_spooler *of = argument;
    while (!atomic_load_explicit(&of->stop, memory_order_acquire))
        if (!drain_all(of)) nanosleep(&nap, NULL);
    drain_all(of);
    return fv_thread_rest(&of->done);
}

void fv_spooler_add(struct fv_spooler *of, struct fv_spool *spool)
{
    assert(of->spools < FV_SPOOLS_MAX && !of->running);
    of->spool[of->spools++] = spool;
}

int fv_spooler_start(struct fv_spooler *of, struct fv_error *error)
{
    if (of->spools == 0) return 0;
    if (fv_thread_start(&of->thread, "tape writer", FV_CAN_WAIT, writer, of, error)) return -1;
    of->running = true;
    return 0;
}

void fv_spooler_stop(struct fv_spooler *of)
{
    atomic_store_explicit(&of->stop, true, memory_order_release);
    if (of->running) fv_thread_await(&of->done, INT64_MAX);
    of->running = false;
}

struct fv_spool_counts fv_spooler_counts(const struct fv_spooler *of)
{
    struct fv_spool_counts all = {0, 0};
    for (int i = 0; i < of->spools; i++) {
        struct fv_spool_counts one = fv_spool_counts(of->spool[i]);
        all.rows += one.rows;
        all.dropped += one.dropped;
    }
    return all;
}
