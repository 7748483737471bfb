/* faults: what must not be left behind where the program is ended by a fault of its own, by abort or by SIGQUIT: a screen
 * in graphics mode. What fv_die calls (log.h) may do more; a signal's handler, hardly anything. */
#ifndef FV_PLATFORM_FAULTS_H
#define FV_PLATFORM_FAULTS_H

/* What the thread at fault calls, once: async-signal-safe, and on the lists of all threads (sandbox.h). NULL: nothing any
 * more. The program then ends as it would have, by the signal; by code 128 + signal where that was sent, not raised by the
 * processor. To be said first before system calls are given up. Nothing in builds with sanitizers, which have handlers of
 * their own. A stack that is full has no room for it. */
void fv_faults_call(void (*function)(void));

#endif
