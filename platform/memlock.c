/* memlock: see memlock.h. The ranges come from /proc/self/maps, the arena's block cut short at what is taken.
 */
#define _GNU_SOURCE
#include "platform/memlock.h"

#include "platform/arena.h"
#include "platform/threads.h"

#include <errno.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#ifdef FV_HEAP

enum {
    RANGES_MAX = 64,
    STACK_LEFT = 64 << 10 /* lowest part of the first stack that stays unlocked, see add_mapping */
};

struct ranges {
    int count;
    size_t bytes;
    struct {
        uintptr_t from, to;
    } range[RANGES_MAX];
};

/* Touches the first stack as deep as a worker's, or a quarter of its limit, so that it is there to be locked.
 */
static __attribute__((noinline)) void deepen_stack(void)
{
    struct rlimit limit;
    size_t depth = FV_WORKER_STACK_BYTES;
    if (getrlimit(RLIMIT_STACK, &limit) == 0 && limit.rlim_cur / 4 < depth) depth = limit.rlim_cur / 4;
    if (depth < 4096) return;
    char room[depth];
    volatile char *touched = room;
    for (size_t at = depth; at >= 4096; at -= 4096) touched[at - 1] = 0;
}

/* Returns 0, or -1 where there are too many. */
static int add_range(struct ranges *r, uintptr_t from, uintptr_t to)
{
    if (from >= to) return 0;
    if (r->count == RANGES_MAX) return -1;
    r->range[r->count].from = from;
    r->range[r->count++].to = to;
    r->bytes += to - from;
    return 0;
}

/* A mapping, without the arena's untaken part. The lowest part of the stack is left as it is: were it locked,
 * the stack could grow only as far as the limit on locked memory lets it, and a signal would end the program
 * there. */
static int add_mapping(struct ranges *r, uintptr_t from, uintptr_t to, const char *name)
{
    const struct fv_arena *arena = fv_arena();
    uintptr_t page = (uintptr_t)sysconf(_SC_PAGESIZE), block = (uintptr_t)arena->base;
    uintptr_t untaken = (block + arena->used + page - 1) & ~(page - 1),
              end = (block + arena->built) & ~(page - 1);
    if (strcmp(name, "[stack]") == 0) from += STACK_LEFT;
    if (untaken >= end || untaken >= to || end <= from) return add_range(r, from, to);
    return add_range(r, from, untaken) || add_range(r, end > from ? end : from, to) ? -1 : 0;
}

/* What is mapped and readable, but for the kernel's own pages ("[vdso]" and the like). */
static int list_ranges(struct ranges *r)
{
    char line[512];
    int failed = 0;
    FILE *f = fopen("/proc/self/maps", "re");
    if (!f) return -1;
    while (!failed && fgets(line, sizeof line, f)) {
        unsigned long from, to;
        char rights[8], name[128] = "";
        int fields = sscanf(line, "%lx-%lx %7s %*s %*s %*s %127s", &from, &to, rights, name);
        if (fields >= 3 && rights[0] == 'r' && strncmp(name, "[v", 2) != 0)
            failed = add_mapping(r, from, to, name);
    }
    fclose(f);
    return r->bytes ? failed : -1;
}

/* Bytes that may still be taken without paging, SIZE_MAX where that is not known. */
static size_t available(const char *meminfo)
{
    char line[128];
    unsigned long long kb;
    size_t bytes = SIZE_MAX;
    FILE *f = fopen(meminfo, "re");
    while (f && fgets(line, sizeof line, f))
        if (sscanf(line, "MemAvailable: %llu kB", &kb) == 1) bytes = (size_t)kb << 10;
    if (f) fclose(f);
    return bytes;
}

/* Bytes that are in memory already. */
static size_t resident(void)
{
    unsigned long pages = 0;
    FILE *f = fopen("/proc/self/statm", "re");
    if (f && fscanf(f, "%*u %lu", &pages) != 1) pages = 0;
    if (f) fclose(f);
    return pages * (size_t)sysconf(_SC_PAGESIZE);
}

static int say_refused(int refused, size_t bytes, struct fv_error *error)
{
    struct rlimit limit;
    size_t kb = (bytes + 1023) >> 10;
    if (refused != EAGAIN && getrlimit(RLIMIT_MEMLOCK, &limit) == 0 && limit.rlim_cur < bytes)
        return fv_error_set(error, "needs RLIMIT_MEMLOCK of at least %zu MB (ulimit -l %zu), or CAP_IPC_LOCK",
                            (kb + 1023) >> 10, kb);
    return fv_error_set(error, "mlock of %zu MB: %s", kb >> 10, strerror(refused));
}

int fv_memlock(const char *meminfo, size_t *bytes, struct fv_error *error)
{
    struct ranges r = {.count = 0};
    *bytes = 0;
    deepen_stack();
    if (list_ranges(&r)) return fv_error_set(error, "what is mapped cannot be read from /proc/self/maps");
    *bytes = r.bytes;
    size_t there = resident(), more = r.bytes > there ? r.bytes - there : 0, left = available(meminfo);
    if (more > left)
        return fv_error_set(error, "%zu MB more would have to be in memory, %zu MB are available", more >> 20,
                            left >> 20);
    int locked = 0, refused = 0;
    for (; locked < r.count && !refused; locked++)
        if (mlock((void *)r.range[locked].from, r.range[locked].to - r.range[locked].from)) refused = errno;
    if (!refused) return 0;
    for (int i = 0; i < locked; i++) munlock((void *)r.range[i].from, r.range[i].to - r.range[i].from);
    return say_refused(refused, r.bytes, error);
}

#else

int fv_memlock(const char *meminfo, size_t *bytes, struct fv_error *error)
{
    (void)meminfo;
    *bytes = 0;
    return fv_error_set(error, "not in a build with sanitizers: their shadow memory would be locked too");
}

#endif
