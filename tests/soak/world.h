/* world: one made-up clock for the whole program, and the threads that it starts taking turns on it.
 *
 * It stands in the place of platform/clock.c, and the linker leads fv_thread_start, nanosleep and pause here. Exactly one
 * thread runs at any time. Where it would wait - on the clock, or for a made-up device - it says until when, and the
 * thread whose time comes first goes on, at that time. So hours pass as fast as their work is done, in the same order
 * whenever they are run again with the same seed. Work takes no time but what reading the clock is made to cost. */
#ifndef FV_SOAK_WORLD_H
#define FV_SOAK_WORLD_H

#include <stdbool.h>
#include <stdint.h>

/* Begins, at 1000 s; the calling thread is the main one. */
void world_begin(void);

int64_t world_now_ns(void);

/* The running thread waits until then; a time that has been: others may go on, at the same time. */
void world_wait_ns(int64_t until_ns);

/* The thread of that name ("main", else as fv_thread_start was told) is held up for so long: from now, or from when it
 * next waits if it is the one that runs. */
void world_hold_ns(const char *name, int64_t for_ns);

/* Everything stands still for so long: a machine asleep, a process stopped. */
void world_stand_still_ns(int64_t for_ns);

/* Is called at a time and returns when next; nothing runs meanwhile. It must not wait. */
void world_fate(int64_t (*fate)(int64_t now_ns), int64_t first_ns);

#endif
