/* mailbox: the newest value from one thread to others, without waiting on either side.
 *
 * One thread puts, any number get. Values alternate between two places, so that one that is being put never is the
 * one that is got: a thread that puts may be held up at any moment and nobody waits for it. A reader begins again only
 * where two values were put while it read one (a seqlock over two places: Boehm 2012, Can seqlocks get along with
 * programming language memory models?, section 4, with every word an atomic). */
#ifndef FV_PLATFORM_MAILBOX_H
#define FV_PLATFORM_MAILBOX_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { FV_MAILBOX_BYTES = 1024 };

/* All zero: empty. */
struct fv_mailbox {
    _Alignas(64) _Atomic uint64_t begun; /* values that were begun to be put ... */
    _Atomic uint64_t put;                /* ... and those that are there */
    _Atomic uint64_t word[2][FV_MAILBOX_BYTES / 8];
};

/* `bytes`: the same at each call, at most FV_MAILBOX_BYTES. */
void fv_mailbox_put(struct fv_mailbox *mailbox, const void *value, size_t bytes);

/* The newest value; false and untouched where none was put yet. */
bool fv_mailbox_get(const struct fv_mailbox *mailbox, void *value, size_t bytes);

#endif
