/* mailbox: see mailbox.h. Words are stored with release and loaded with acquire: who reads a word of a newer value also
 * reads that it was begun. */
#include "platform/mailbox.h"

#include <assert.h>
#include <string.h>

void fv_mailbox_put(struct fv_mailbox *m, const void *value, size_t bytes)
{
    uint64_t word[FV_MAILBOX_WORDS] = {0}, n = atomic_load_explicit(&m->put, memory_order_relaxed) + 1;
    assert(bytes <= sizeof word);
    memcpy(word, value, bytes);
    atomic_store_explicit(&m->begun, n, memory_order_relaxed);
    for (size_t i = 0; 8 * i < bytes; i++) atomic_store_explicit(&m->word[n & 1][i], word[i], memory_order_release);
    atomic_store_explicit(&m->put, n, memory_order_release);
}

bool fv_mailbox_get(const struct fv_mailbox *m, void *value, size_t bytes)
{
    uint64_t word[FV_MAILBOX_WORDS], n;
    assert(bytes <= sizeof word);
    do {
        n = atomic_load_explicit(&m->put, memory_order_acquire);
        if (n == 0) return false;
        for (size_t i = 0; 8 * i < bytes; i++) word[i] = atomic_load_explicit(&m->word[n & 1][i], memory_order_acquire);
    } while (atomic_load_explicit(&m->begun, memory_order_relaxed) >= n + 2);
    memcpy(value, word, bytes);
    return true;
}
