/* stripped: takes rights and limits away from a process before it is tried. For tests only. */
#ifndef FV_TESTS_STRIPPED_H
#define FV_TESTS_STRIPPED_H

#include "tests/support/program.h"

#include <grp.h>
#include <stdbool.h>
#include <sys/resource.h>

enum { NOBODY = 65534 };

/* Both limits, soft and hard; false where that is not permitted. */
static inline bool limit(int resource, rlim_t value)
{
    struct rlimit l = {value, value};
    return setrlimit(resource, &l) == 0;
}

/* Nobody's rights, where there were more; false where they cannot be taken away. */
static inline bool become_nobody(void)
{
    if (geteuid() != 0) return true;
    return setgroups(0, NULL) == 0 && setgid(NOBODY) == 0 && setuid(NOBODY) == 0;
}

/* What sanitizers stand in the way of: locked memory, and a list of system calls without theirs. */
static inline void skip_without_own_heap(void)
{
#ifndef FV_HEAP
    print_message("not in a build with sanitizers: skipped\n");
    skip();
#endif
}

#endif
