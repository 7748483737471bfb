/* memlock: keeps the memory that the program uses from being paged out, so that no frame waits for a page.
 *
 * Used is what is mapped but for the part of the arena that nobody took, which is far larger: the program's
 * code and data, the taken part of the arena (with it the heap and the workers' stacks), and the first
 * thread's stack, made as deep as a worker's before. */
#ifndef FV_PLATFORM_MEMLOCK_H
#define FV_PLATFORM_MEMLOCK_H

#include "platform/error.h"

#include <stddef.h>

/* Locks it all, or nothing: returns 0, or -1 with the reason. `bytes`: how much it is, 0 where that could
 * not be found out. `meminfo`: the kernel's table of memory, /proc/meminfo. Not in builds with sanitizers,
 * whose shadow memory is as large as the address space. */
int fv_memlock(const char *meminfo, size_t *bytes, struct fv_error *error);

#endif
