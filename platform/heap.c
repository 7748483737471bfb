/* heap: a two-level segregated-fit allocator (Masmano et al. 2004, "TLSF") over chunks
 * taken from the arena: every operation in constant time, neighbours merged at once.
 *
 * A block is a header followed by its bytes; all sizes are multiples of 16. Blocks of a
 * chunk lie end to end, each knows the size of the one before it, and a chunk ends in a
 * used block of size 0. Free blocks keep their list links in their own bytes. */
#define _GNU_SOURCE
#include "platform/heap.h"

#include "platform/arena.h"
#include "platform/log.h"

#include <errno.h>
#include <stdatomic.h>
#include <malloc.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <sys/types.h>

#ifdef FV_HEAP

enum {
    ALIGN = 16,
    SPLIT_LOG2 = 4, /* second-level lists per power of two */
    SPLIT = 1 << SPLIT_LOG2,
    CLASSES = 40,
    CHUNK = 8 << 20
};

struct block {
    size_t before; /* size of the block before this one in memory, 0 at a chunk's start */
    size_t size;   /* bytes after the header; lowest bit: in use */
};

struct links {
    struct block *next, *previous;
};

static struct block *lists[CLASSES][SPLIT];
static uint64_t classes_used;
static uint32_t splits_used[CLASSES];
static char *chunk_end; /* where the newest chunk ends, so that the next may join it */
static atomic_flag busy = ATOMIC_FLAG_INIT;
static atomic_int sealed; /* 0 open, 1 counted, 2 fatal */
static atomic_llong calls, system_calls;

static void lock(void)
{
    while (atomic_flag_test_and_set_explicit(&busy, memory_order_acquire)) {
    }
}

static void unlock(void)
{
    atomic_flag_clear_explicit(&busy, memory_order_release);
}

static size_t size_of(const struct block *b)
{
    return b->size & ~(size_t)1;
}

static bool is_used(const struct block *b)
{
    return b->size & 1;
}

static char *bytes_of(struct block *b)
{
    return (char *)(b + 1);
}

static struct block *block_of(void *p)
{
    return (struct block *)p - 1;
}

static struct block *after(struct block *b)
{
    return (struct block *)(bytes_of(b) + size_of(b));
}

static struct links *links_of(struct block *b)
{
    return (struct links *)(b + 1);
}

static void list_of(size_t size, int *first, int *second)
{
    int top = 63 - __builtin_clzll(size | ALIGN);
    *first = top - 4;
    *second = (int)(size >> (top - SPLIT_LOG2)) & (SPLIT - 1);
}

static void insert(struct block *b)
{
    int i, j;
    list_of(size_of(b), &i, &j);
    links_of(b)->next = lists[i][j];
    links_of(b)->previous = NULL;
    if (lists[i][j]) links_of(lists[i][j])->previous = b;
    lists[i][j] = b;
    classes_used |= 1ull << i;
    splits_used[i] |= 1u << j;
}

static void take_out(struct block *b)
{
    int i, j;
    list_of(size_of(b), &i, &j);
    struct links *l = links_of(b);
    if (l->next) links_of(l->next)->previous = l->previous;
    if (l->previous) links_of(l->previous)->next = l->next;
    else lists[i][j] = l->next;
    if (!lists[i][j]) {
        splits_used[i] &= ~(1u << j);
        if (!splits_used[i]) classes_used &= ~(1ull << i);
    }
}

/* A free block of at least `size` bytes, or NULL: the size is rounded up to the next list,
 * so that any block of that list fits. */
static struct block *find(size_t size)
{
    int i, j, top = 63 - __builtin_clzll(size | ALIGN);
    list_of(size + (((size_t)1 << (top - SPLIT_LOG2)) - 1), &i, &j);
    uint32_t splits = splits_used[i] & (~0u << j);
    if (!splits) {
        uint64_t classes = i + 1 < CLASSES ? classes_used & (~0ull << (i + 1)) : 0;
        if (!classes) return NULL;
        i = __builtin_ctzll(classes);
        splits = splits_used[i];
    }
    return lists[i][__builtin_ctz(splits)];
}

static void merge_and_insert(struct block *b)
{
    struct block *next = after(b);
    if (!is_used(next)) {
        take_out(next);
        b->size += sizeof *next + size_of(next);
    }
    if (b->before) {
        struct block *previous = (struct block *)((char *)b - b->before) - 1;
        if (!is_used(previous)) {
            take_out(previous);
            previous->size += sizeof *b + size_of(b);
            b = previous;
        }
    }
    after(b)->before = size_of(b);
    insert(b);
}

/* Adds a chunk that can hold `size` bytes; the end marker of an adjacent chunk becomes its head. */
static bool grow(size_t size)
{
    size_t bytes = size + 4 * sizeof(struct block);
    bytes = bytes < CHUNK ? CHUNK : (bytes + 4095) & ~(size_t)4095;
    char *chunk = fv_arena_try(fv_arena(), "heap", bytes, ALIGN);
    if (!chunk) {
        bytes = (size + 4 * sizeof(struct block) + 4095) & ~(size_t)4095;
        chunk = fv_arena_try(fv_arena(), "heap", bytes, ALIGN);
        if (!chunk) return false;
    }
    struct block *b = (struct block *)chunk;
    size_t before = 0;
    if (chunk == chunk_end) {
        b -= 1;
        before = b->before;
        bytes += sizeof *b;
    }
    b->before = before;
    b->size = bytes - 2 * sizeof *b;
    struct block *end = after(b);
    end->before = size_of(b);
    end->size = 1;
    chunk_end = chunk + (bytes - (chunk == chunk_end ? sizeof *b : 0));
    merge_and_insert(b);
    return true;
}

/* Cuts a used block down to `size`, giving the rest back. */
static void trim(struct block *b, size_t size)
{
    size_t rest = size_of(b) - size;
    if (rest < sizeof *b + 2 * ALIGN) return;
    b->size = size | 1;
    struct block *r = after(b);
    r->before = size;
    r->size = rest - sizeof *r;
    after(r)->before = size_of(r);
    merge_and_insert(r);
}

static void *take(size_t wanted, size_t align)
{
    if (wanted > (size_t)1 << 40) return NULL;
    size_t size = (wanted + ALIGN - 1) & ~(size_t)(ALIGN - 1);
    if (size < 2 * ALIGN) size = 2 * ALIGN;
    size_t search = align > ALIGN ? size + align + sizeof(struct block) + 2 * ALIGN : size;
    struct block *b = find(search);
    if (!b) {
        if (!grow(search + search / SPLIT + ALIGN)) return NULL;
        b = find(search);
        if (!b) return NULL;
    }
    take_out(b);
    b->size |= 1;
    char *p = bytes_of(b);
    if ((uintptr_t)p & (align - 1)) {
        /* Leave a free block in front, large enough to stand by itself. */
        char *q = (char *)(((uintptr_t)p + sizeof *b + 2 * ALIGN + align - 1) & ~(uintptr_t)(align - 1));
        struct block *aligned = block_of(q);
        size_t front = (size_t)((char *)aligned - p);
        aligned->before = front;
        aligned->size = (size_of(b) - front - sizeof *b) | 1;
        b->size = front;
        after(aligned)->before = size_of(aligned);
        merge_and_insert(b);
        b = aligned;
    }
    trim(b, size);
    return bytes_of(b);
}

static void count(const char *what)
{
    int state = atomic_load_explicit(&sealed, memory_order_relaxed);
    if (!state) return;
    atomic_fetch_add(&calls, 1);
    if (state == 2) fv_die(1, "heap: %s after the seal", what);
}

static void *serve(const char *what, size_t size, size_t align)
{
    count(what);
    lock();
    void *p = take(size, align < ALIGN ? ALIGN : align);
    unlock();
    if (!p && !atomic_load(&sealed) && size < (size_t)1 << 40) fv_arena_exhausted(fv_arena(), "heap", size);
    if (!p) errno = ENOMEM;
    return p;
}

void *malloc(size_t size)
{
    return serve("malloc", size, ALIGN);
}

void free(void *p)
{
    if (!p) return;
    count("free");
    lock();
    struct block *b = block_of(p);
    b->size &= ~(size_t)1;
    merge_and_insert(b);
    unlock();
}

void *calloc(size_t n, size_t size)
{
    size_t bytes;
    if (__builtin_mul_overflow(n, size, &bytes)) {
        errno = ENOMEM;
        return NULL;
    }
    void *p = serve("calloc", bytes, ALIGN);
    return p ? memset(p, 0, bytes) : NULL;
}

void *realloc(void *p, size_t size)
{
    if (!p) return malloc(size);
    size_t had = size_of(block_of(p));
    if (size <= had && size >= had / 2) {
        count("realloc");
        return p;
    }
    void *q = serve("realloc", size, ALIGN);
    if (!q) return NULL;
    memcpy(q, p, size < had ? size : had);
    free(p);
    return q;
}

void *memalign(size_t align, size_t size)
{
    return serve("memalign", size, align);
}

void *aligned_alloc(size_t align, size_t size)
{
    return serve("aligned_alloc", size, align);
}

int posix_memalign(void **out, size_t align, size_t size)
{
    if (align < sizeof(void *) || (align & (align - 1))) return EINVAL;
    void *p = serve("posix_memalign", size, align);
    if (!p) return ENOMEM;
    *out = p;
    return 0;
}

void *valloc(size_t size)
{
    return serve("valloc", size, 4096);
}

void *pvalloc(size_t size)
{
    return serve("pvalloc", (size + 4095) & ~(size_t)4095, 4096);
}

size_t malloc_usable_size(void *p)
{
    return p ? size_of(block_of(p)) : 0;
}

/* Libraries' own calls of mmap for anonymous memory become heap blocks. Parts of a block are
 * never given back (Embree trims the ends of what it maps), whole blocks are. */
void *__wrap_mmap(void *at, size_t length, int protection, int flags, int fd, off_t offset);
int __wrap_munmap(void *at, size_t length);
int __wrap_madvise(void *at, size_t length, int advice);

enum { MAPPED_MAX = 512 };
static struct {
    void *at;
    size_t length;
} mapped[MAPPED_MAX];

static void count_system_call(void)
{
    if (atomic_load_explicit(&sealed, memory_order_relaxed)) atomic_fetch_add(&system_calls, 1);
}

void *__wrap_mmap(void *at, size_t length, int protection, int flags, int fd, off_t offset)
{
    (void)at, (void)protection, (void)flags, (void)offset;
    count_system_call();
    if (fd != -1) return errno = ENOSYS, (void *)-1;
    void *p = serve("mmap", length, 4096);
    if (!p) return (void *)-1;
    lock();
    for (int i = 0; i < MAPPED_MAX; i++) {
        if (!mapped[i].at) {
            mapped[i].at = p;
            mapped[i].length = length;
            break;
        }
    }
    unlock();
    return memset(p, 0, length);
}

int __wrap_munmap(void *at, size_t length)
{
    count_system_call();
    bool whole = false;
    lock();
    for (int i = 0; i < MAPPED_MAX && !whole; i++) {
        whole = mapped[i].at == at && mapped[i].length == length;
        if (whole) mapped[i].at = NULL;
    }
    unlock();
    if (whole) free(at);
    return 0;
}

int __wrap_madvise(void *at, size_t length, int advice)
{
    (void)at, (void)length, (void)advice;
    return 0;
}

void fv_heap_seal(bool fatal)
{
    atomic_store(&sealed, fatal ? 2 : 1);
}

int64_t fv_heap_calls(void)
{
    return atomic_load(&calls);
}

int64_t fv_heap_system_calls(void)
{
    return atomic_load(&system_calls);
}

#else

void fv_heap_seal(bool fatal)
{
    (void)fatal;
}

int64_t fv_heap_calls(void)
{
    return 0;
}

int64_t fv_heap_system_calls(void)
{
    return 0;
}

#endif
