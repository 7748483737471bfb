/* mailbox: the newest of what one thread writes, for another that reads and must never wait: a sequence lock
 * (Lameter 2005) over words that are atomic each, so that a torn copy is seen and taken again, and no access
 * is a race. */
#ifndef FV_SENSORS_MAILBOX_H
#define FV_SENSORS_MAILBOX_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { FV_MAILBOX_BYTES = 1024 };

/* All 0 at the start: empty. */
struct fv_mailbox {
    _Alignas(64) atomic_uint turn; /* odd: being written */
    _Atomic uint64_t word[FV_MAILBOX_BYTES / 8];
};

/* One writer only. bytes <= FV_MAILBOX_BYTES, always the same number. */
void fv_mailbox_put(struct fv_mailbox *mailbox, const void *content, size_t bytes);

/* Any number of readers. False, and content as it was, where nothing was ever put or the writer was
 * interrupted in its midst and does not go on: keep what was read before. */
bool fv_mailbox_get(struct fv_mailbox *mailbox, void *content, size_t bytes);

#endif
