/* usb: the head from an inertial sensor on USB: the source "usb" of head poses. A thread of its own runs the feed
 * (feed.h) on a port to the device (usb_port.h); the frame loop reads the newest state from its mailbox, and never waits
 * for it. */
#ifndef FV_SENSORS_IMU_USB_H
#define FV_SENSORS_IMU_USB_H

#include "config/config.h"
#include "sensors/imu/head.h"

struct fv_imu_usb; /* in the arena */

/* Opens the device that imu.device names, or the first one of the table, and starts the thread. Before the seal. Returns
 * 0, or -1 with the error set: no device, no permission, in use, or a layout that cannot be. */
int fv_imu_usb_open(struct fv_imu_usb **usb, const struct fv_config *config, struct fv_error *error);

/* The head ahead_ns from now, as fv_imu_head; false: nothing is known of it. */
bool fv_imu_usb_head(const struct fv_imu_usb *usb, int64_t ahead_ns, struct fv_pose *head);

/* Records its raw samples into folder/imu.csv from now on (recorder.h); the end, once it is closed and the spooler stopped.
 * 0, or -1 with the error set. */
int fv_imu_usb_record(struct fv_imu_usb *usb, const char *folder, struct fv_spooler *spooler, struct fv_error *error);
int fv_imu_usb_record_end(struct fv_imu_usb *usb, int64_t session_ns, struct fv_error *error);

struct fv_imu_feed_counts fv_imu_usb_counts(const struct fv_imu_usb *usb);

/* Gives the device back to the system, and stops the thread; waits for it for three seconds at most. */
void fv_imu_usb_close(struct fv_imu_usb *usb);

#endif
