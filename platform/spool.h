/* spool: rows from threads that must not wait into files, by one thread that may.
 *
 * A spool is a ring of rows of one size between the one thread that puts them and the writer thread, which makes text of
 * them and writes it: neither ever waits for the other, and putting makes no system call. Where the disk does not keep
 * up until the ring is full, rows are dropped and counted; where it fails, nothing more is written, which is said
 * once, and whoever puts goes on as before. */
#ifndef FV_PLATFORM_SPOOL_H
#define FV_PLATFORM_SPOOL_H

#include "platform/error.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { FV_SPOOLS_MAX = 8 };

/* Writes a row, in the writer thread; 0, or the errno of a failure, which is for good. */
typedef int fv_spool_write(void *context, const void *row);

struct fv_spool {
    const char *name; /* for messages */
    fv_spool_write *write;
    void *context;
    char *ring; /* NULL: rows are neither taken nor counted */
    size_t bytes;
    unsigned slots;
    atomic_int *failed, own_failed;                /* errno of the first failure; spools may share one */
    _Alignas(64) atomic_uint put;                  /* rows, so far */
    atomic_llong refused;                          /* that were not put: no room, or a failure */
    _Alignas(64) atomic_uint taken;                /* rows out of the ring ... */
    atomic_llong written, lost;                    /* ... and what became of them */
};

/* ring: slots rows of `bytes` each, the caller's; slots a power of two. failed: shared by spools that end together,
 * NULL: this one ends by itself. */
void fv_spool_begin(struct fv_spool *spool, const char *name, void *ring, unsigned slots, size_t bytes,
                    fv_spool_write *write, void *context, atomic_int *failed);

/* Takes a copy of a row; from one thread only. False: it was dropped. */
bool fv_spool_put(struct fv_spool *spool, const void *row);

/* Rows that were written, and that were not: dropped for want of room, or of after a failure. From any thread. */
struct fv_spool_counts {
    int64_t rows, dropped;
};
struct fv_spool_counts fv_spool_counts(const struct fv_spool *spool);

/* Writes what waits; false: nothing did. For the writer thread, and for tests that are it. */
bool fv_spool_drain(struct fv_spool *spool);

/* The writer thread, and whose rows it writes; all zero at the start. */
struct fv_spooler {
    struct fv_spool *spool[FV_SPOOLS_MAX];
    int spools;
    atomic_bool stop, done;
    bool running;
    pthread_t thread;
};

/* Before the start, at most FV_SPOOLS_MAX. */
void fv_spooler_add(struct fv_spooler *spooler, struct fv_spool *spool);

/* Starts the thread, before the seal; nothing is done where there are no spools. 0, or -1 with the error set. */
int fv_spooler_start(struct fv_spooler *spooler, struct fv_error *error);

/* Writes what still waits, however long that takes; the thread writes no more. Files are then the caller's to close. */
void fv_spooler_stop(struct fv_spooler *spooler);

/* Of all spools together. */
struct fv_spool_counts fv_spooler_counts(const struct fv_spooler *spooler);

#endif
