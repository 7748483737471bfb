/* usb_memory: see usb_memory.h. */
#include "sensors/imu/usb_memory.h"

#include "platform/arena.h"

#include <errno.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

enum { LEAST_LOG2 = 6, MOST_LOG2 = 16, SIZES = MOST_LOG2 - LEAST_LOG2 + 1 };

/* In front of the bytes, which begin 16 later. */
struct block {
    _Alignas(16) int size;      /* its bytes with this: 2^(LEAST_LOG2 + size) */
    struct block *next;         /* of the free ones */
};

static char *piece;
static struct block *unused[SIZES];
static struct fv_usb_memory_counts counts;
static atomic_flag busy = ATOMIC_FLAG_INIT;

static void lock(void)
{
    while (atomic_flag_test_and_set_explicit(&busy, memory_order_acquire)) {
    }
}

static void unlock(void)
{
    atomic_flag_clear_explicit(&busy, memory_order_release);
}

void fv_usb_memory_open(void)
{
    if (!piece) piece = fv_arena_take(fv_arena(), "usb", FV_USB_MEMORY_BYTES, 64);
}

struct fv_usb_memory_counts fv_usb_memory_counts(void)
{
    lock();
    struct fv_usb_memory_counts now = counts;
    unlock();
    return now;
}

static size_t room(const struct block *b)
{
    return ((size_t)1 << (LEAST_LOG2 + b->size)) - sizeof *b;
}

static struct block *take(int size)
{
    struct block *b = unused[size];
    int64_t bytes = (int64_t)1 << (LEAST_LOG2 + size);
    if (b) {
        unused[size] = b->next;
        return b;
    }
    if (!piece || counts.bytes + bytes > FV_USB_MEMORY_BYTES) return NULL;
    b = (struct block *)(piece + counts.bytes);
    counts.bytes += bytes;
    b->size = size;
    return b;
}

void *fv_usb_malloc(size_t bytes)
{
    int size = 0;
    struct block *b = NULL;
    while (size < SIZES && ((size_t)1 << (LEAST_LOG2 + size)) - sizeof *b < bytes) size++;
    lock();
    if (size < SIZES) b = take(size);
    if (b) counts.taken++;
    else counts.refused++;
    unlock();
    if (!b) errno = ENOMEM;
    return b ? b + 1 : NULL;
}

void fv_usb_free(void *p)
{
    if (!p) return;
    struct block *b = (struct block *)p - 1;
    lock();
    b->next = unused[b->size];
    unused[b->size] = b;
    counts.given++;
    unlock();
}

void *fv_usb_calloc(size_t n, size_t bytes)
{
    size_t all;
    if (__builtin_mul_overflow(n, bytes, &all)) all = SIZE_MAX;
    void *p = fv_usb_malloc(all);
    return p ? memset(p, 0, all) : NULL;
}

void *fv_usb_realloc(void *p, size_t bytes)
{
    if (!p) return fv_usb_malloc(bytes);
    size_t had = room((struct block *)p - 1);
    if (bytes <= had) return p;
    void *q = fv_usb_malloc(bytes);
    if (!q) return NULL;
    memcpy(q, p, had);
    fv_usb_free(p);
    return q;
}

char *fv_usb_strdup(const char *text)
{
    size_t bytes = strlen(text) + 1;
    char *copy = fv_usb_malloc(bytes);
    return copy ? memcpy(copy, text, bytes) : NULL;
}

int fv_usb_asprintf(char **text, const char *format, ...)
{
    char line[512];
    va_list arguments;
    va_start(arguments, format);
    int length = vsnprintf(line, sizeof line, format, arguments);
    va_end(arguments);
    *text = length >= 0 && (size_t)length < sizeof line ? fv_usb_strdup(line) : NULL;
    return *text ? length : -1;
}
