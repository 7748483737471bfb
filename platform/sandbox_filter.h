/* sandbox_filter: the lists of system calls as a program for the kernel's filter. See sandbox.h. */
#ifndef FV_PLATFORM_SANDBOX_FILTER_H
#define FV_PLATFORM_SANDBOX_FILTER_H

#include "platform/sandbox.h"

#include <linux/filter.h>

enum { FV_SANDBOX_PROGRAM_MAX = 512 };

/* Instructions of the list of a class; returns how many. */
int fv_sandbox_program(enum fv_sandbox_class of, struct sock_filter program[FV_SANDBOX_PROGRAM_MAX]);

/* The name of a system call of which one may want to know, NULL of others. */
const char *fv_sandbox_call_name(int number);

#endif
