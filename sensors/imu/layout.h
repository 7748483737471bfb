/* layout: a device that no row of the table knows, from the setting imu.layout: words that stand for the fields of
 * struct fv_imu_device and struct fv_imu_layout, a row each: `id 32, bytes 52, readings 3, axes 1 -2 -3`. What is not
 * said is as in the row `generic`. */
#ifndef FV_SENSORS_IMU_LAYOUT_H
#define FV_SENSORS_IMU_LAYOUT_H

#include "sensors/imu/devices.h"

/* 0, or -1 with what is wrong and what would be right; a device that is given out can begin a stream. */
int fv_imu_layout_read(const char *text, struct fv_imu_device *device, struct fv_error *error);

#endif
