/* recorder: raw samples of an inertial sensor into a tape (imu_tape.h), by way of a spool: the thread that reads the
 * device never waits for a disk. */
#ifndef FV_SENSORS_IMU_RECORDER_H
#define FV_SENSORS_IMU_RECORDER_H

#include "platform/files.h"
#include "platform/spool.h"
#include "sensors/imu/devices.h"

enum { FV_IMU_RECORDER_ROWS = 8192 /* that may wait: four seconds and more */ };

struct fv_imu_recorder; /* in the arena ("sensors") */

/* Begins folder/imu.csv, to be written by `spooler`, which is not started yet. 0, or -1 with the error set. */
int fv_imu_recorder_open(struct fv_imu_recorder **recorder, const char *folder, struct fv_spooler *spooler,
                         struct fv_error *error);

/* The newest report of a stream; `connection` is another number whenever the device was opened anew. From one thread. */
void fv_imu_recorder_report(struct fv_imu_recorder *recorder, const struct fv_imu_stream *stream, int64_t connection,
                            int64_t arrival_ns);

/* Once the spooler is stopped. session_ns: the arrival time that was session time 0; INT64_MIN: not known. 0, or -1 with
 * the failure. */
int fv_imu_recorder_close(struct fv_imu_recorder *recorder, int64_t session_ns, struct fv_error *error);

#endif
