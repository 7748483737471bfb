/* arena: a bump pointer over one static block, and a table of who took how much. */
#include "platform/arena.h"

#include "platform/log.h"

#include <assert.h>
#include <stdatomic.h>
#include <stdint.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

#ifndef FV_ARENA_MB
#define FV_ARENA_MB 1536
#endif

static _Alignas(4096) char block[(size_t)FV_ARENA_MB << 20];

static struct fv_arena the_arena = {.base = block, .built = sizeof block, .capacity = sizeof block};
static atomic_flag busy = ATOMIC_FLAG_INIT;

/* In pages of 2 MB where the kernel has them: rays find their way through far more memory than a processor's
 * translations of 4 KB pages span. Where there are none nothing changes. By number, as heap.c takes libraries'
 * calls by name. */
static __attribute__((constructor(101))) void ask_for_large_pages(void)
{
    size_t page = (size_t)sysconf(_SC_PAGESIZE), skipped = (size_t)(-(uintptr_t)block & (page - 1));
    syscall(SYS_madvise, block + skipped, (sizeof block - skipped) & ~(page - 1), MADV_HUGEPAGE);
}

struct fv_arena *fv_arena(void)
{
    return &the_arena;
}

void fv_arena_limit(struct fv_arena *arena, size_t bytes)
{
    assert(bytes > 0);
    if (bytes < arena->capacity) arena->capacity = bytes;
}

static void book(struct fv_arena *arena, const char *name, size_t bytes)
{
    for (int i = 0; i < arena->rows; i++) {
        if (strcmp(arena->row[i].name, name) == 0) {
            arena->row[i].bytes += bytes;
            return;
        }
    }
    assert(arena->rows < FV_ARENA_NAMES_MAX);
    arena->row[arena->rows++] = (struct fv_arena_row){name, bytes};
}

void *fv_arena_try(struct fv_arena *arena, const char *name, size_t bytes, size_t align)
{
    assert(align > 0 && (align & (align - 1)) == 0);
    while (atomic_flag_test_and_set_explicit(&busy, memory_order_acquire)) {
    }
    uintptr_t top = (uintptr_t)arena->base + arena->used;
    size_t padding = (size_t)(-top & (align - 1));
    void *taken = NULL;
    size_t room = arena->capacity > arena->used ? arena->capacity - arena->used : 0;
    if (room >= padding && room - padding >= bytes) {
        taken = arena->base + arena->used + padding;
        arena->used += padding + bytes;
        book(arena, name, padding + bytes);
    }
    atomic_flag_clear_explicit(&busy, memory_order_release);
    return taken;
}

size_t fv_arena_bytes(const struct fv_arena *arena, const char *name)
{
    for (int i = 0; i < arena->rows; i++)
        if (strcmp(arena->row[i].name, name) == 0) return arena->row[i].bytes;
    return 0;
}

void fv_arena_exhausted(const struct fv_arena *arena, const char *name, size_t bytes)
{
    size_t needed_mb = (arena->used + bytes + (arena->used + bytes) / 8 + (1u << 20)) >> 20;
    size_t built_mb = FV_ARENA_MB;
    if (needed_mb > built_mb)
        fv_die(2, "memory: %s asked for %zu bytes, %zu of %zu MB are in use: build with -DFV_ARENA_MB=%zu or more",
               name, bytes, arena->used >> 20, arena->capacity >> 20, needed_mb);
    fv_die(2, "memory: %s asked for %zu bytes, %zu of %zu MB are in use: set budget.memory_mb=%zu or more",
           name, bytes, arena->used >> 20, arena->capacity >> 20, needed_mb);
}

void *fv_arena_take(struct fv_arena *arena, const char *name, size_t bytes, size_t align)
{
    void *taken = fv_arena_try(arena, name, bytes, align);
    if (!taken) fv_arena_exhausted(arena, name, bytes);
    return taken;
}
