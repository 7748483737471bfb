/* mailbox: see mailbox.h. Words are stored with release and loaded with acquire: who reads a word of a newer value also
 * reads that it was begun. */
#include "platform/mailbox.h"

#include <assert.h>
#include <string.h>

void fv_mailbox_put(struct fv_mailbox *m, const void *value, size_t bytes)
{
    uint64_t n = atomic_load_explicit(&m->put, memory_order_relaxed) + 1;
    assert(bytes <= FV_MAILBOX_BYTES);
    atomic_store_explicit(&m->begun, n, memory_order_relaxed);
    for (size_t at = 0; at < bytes; at += 8) {
        uint64_t word = 0;
        memcpy(&word, (const char *)value + at, bytes - at < 8 ? bytes - at : 8);
        atomic_store_explicit(&m->word[n & 1][at / 8], word, memory_order_release);
    }
    atomic_store_explicit(&m->put, n, memory_order_release);
}

bool fv_mailbox_get(const struct fv_mailbox *m, void *value, size_t bytes)
{
    uint64_t word[FV_MAILBOX_BYTES / 8], n;
    assert(bytes <= FV_MAILBOX_BYTES);
    do {
        n = atomic_load_explicit(&m->put, memory_order_acquire);
        if (n == 0) return false;
        for (size_t at = 0; at < bytes; at += 8)
            word[at / 8] = atomic_load_explicit(&m->word[n & 1][at / 8], memory_order_acquire);
    } while (atomic_load_explicit(&m->begun, memory_order_relaxed) >= n + 2);
    memcpy(value, word, bytes);
    return true;
}
