/* mailbox: see the header. */
#include "sensors/mailbox.h"

#include <assert.h>
#include <string.h>

enum { TRIES = 1000 };

void fv_mailbox_put(struct fv_mailbox *m, const void *content, size_t bytes)
{
    assert(bytes <= FV_MAILBOX_BYTES);
    unsigned turn = atomic_load_explicit(&m->turn, memory_order_relaxed);
    atomic_store_explicit(&m->turn, turn + 1, memory_order_relaxed);
    /* Nothing below may be seen before the turn is odd. */
    atomic_thread_fence(memory_order_release);
    for (size_t at = 0; at < bytes; at += 8) {
        uint64_t word = 0;
        memcpy(&word, (const char *)content + at, bytes - at < 8 ? bytes - at : 8);
        atomic_store_explicit(&m->word[at / 8], word, memory_order_relaxed);
    }
    /* 0 stands for never: it is left out when the count wraps. */
    atomic_store_explicit(&m->turn, turn + 2 ? turn + 2 : 2, memory_order_release);
}

bool fv_mailbox_get(struct fv_mailbox *m, void *content, size_t bytes)
{
    uint64_t copy[FV_MAILBOX_BYTES / 8];
    assert(bytes <= FV_MAILBOX_BYTES);
    for (int i = 0; i < TRIES; i++) {
        unsigned turn = atomic_load_explicit(&m->turn, memory_order_acquire);
        if (turn == 0) return false;
        if (turn & 1) continue;
        for (size_t at = 0; at < bytes; at += 8)
            copy[at / 8] = atomic_load_explicit(&m->word[at / 8], memory_order_relaxed);
        atomic_thread_fence(memory_order_acquire);
        if (atomic_load_explicit(&m->turn, memory_order_relaxed) != turn) continue;
        memcpy(content, copy, bytes);
        return true;
    }
    return false;
}
