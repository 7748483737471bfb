/* watchdog: ends a program whose frames have stopped, so that what started it can start it again. By the kernel's
 * interval timer of real time: it needs no thread, and no other program to talk to. */
#ifndef FV_PLATFORM_WATCHDOG_H
#define FV_PLATFORM_WATCHDOG_H

#include <stdint.h>

enum { FV_WATCHDOG_EXIT = 3 };

/* Once, before system calls are given up (sandbox.h). */
void fv_watchdog_open(void);

/* From now on, and until fed with 0 seconds or again: no call for `seconds`, at most a quarter more, ends the program
 * with code 3 and a line.
 * Cheap: the timer is set again only when a quarter of that time is over. now_ns: of CLOCK_MONOTONIC. */
void fv_watchdog_feed(double seconds, int64_t now_ns);

#endif
