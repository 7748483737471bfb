/* faults: what goes wrong in the soak, and when: a table, dealt out by a seed. In each group one fault at a time; groups
 * overlap. A fault is put right after a while; some seconds later its counter must have grown, and its group must have
 * worked again (watch.h). */
#ifndef FV_SOAK_FAULTS_H
#define FV_SOAK_FAULTS_H

#include <stdbool.h>
#include <stdint.h>

enum fault_group { FAULT_EYE, FAULT_IMU, FAULT_SCREEN, FAULT_MACHINE, FAULT_GROUPS };

/* What happens once in a session, in simulated seconds from its beginning; 0: it does not. */
struct faults_once {
    double disk_full_s, pipe_closed_s, log_closed_s, end_s;
    int end_signal;
};

/* screen: there is a display. Begins after `quiet_s`; ends in time for all to be well at the end. */
void faults_begin(uint64_t seed, bool screen, double quiet_s, const struct faults_once *once);

/* No new ones from now on, or again; whether none is under way. */
void faults_pause(bool paused);
bool faults_idle(void);

/* Faults of the soak itself: a fault that is only counted, one that is not put right. */
extern bool faults_swallow, faults_keep;

/* Prints what was dealt out. */
void faults_report(void);

/* For what waits to be done. */
extern bool faults_disk_full, faults_pipe_closed, faults_log_closed;

#endif
