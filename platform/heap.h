/* heap: malloc and its kin, served from the arena, so that libraries are bound by it too.
 *
 * The program defines malloc, calloc, realloc, free, memalign, aligned_alloc,
 * posix_memalign, valloc, pvalloc and malloc_usable_size, and the linker turns mmap,
 * munmap and madvise into calls here (-Wl,--wrap). After start-up the heap is sealed:
 * it goes on working, but every call is counted, or fatal where that is asked for.
 * In sanitizer builds (FV_HEAP off) the C library's heap is used and nothing is counted. */
#ifndef FV_PLATFORM_HEAP_H
#define FV_PLATFORM_HEAP_H

#include <stdbool.h>
#include <stdint.h>

/* Seals the heap. `fatal`: any later call ends the program with code 1 and a message. */
void fv_heap_seal(bool fatal);

/* Calls of malloc and its kin since the seal; and of memory system calls made through libraries. */
int64_t fv_heap_calls(void);
int64_t fv_heap_system_calls(void);

#endif
