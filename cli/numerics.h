/* numerics: error against cost of the numerics that are not pictures: tracing kernels, IMU integration,
 * reprojection's depth interpolation, prediction of head pose and gaze. One table of all, in measure's report and as
 * numerics.csv. */
#ifndef FV_CLI_NUMERICS_H
#define FV_CLI_NUMERICS_H

#include "cli/cli.h"

enum { FV_NUMERICS_MAX = 128 };

/* What is varied is a method (`method`, "exact rotation") under a condition (`condition`, "285 Hz"). */
struct fv_numeric_row {
    char quantity[48], method[48], condition[64];
    double error_p50, error_p95; /* NaN where there is none */
    char error_unit[16];
    double cost;                 /* NaN where cost is not what it is judged by */
    char cost_unit[16];          /* "ns/sample", "ns/pixel", "" */
};

/* Measures all of it for the scene and sensors of the settings; a few seconds. Returns the number of
 * rows put into `row` (at most FV_NUMERICS_MAX). `stopped`: ends it early where it becomes true (NULL:
 * never). `setup`: opened and started (fv_setup_start). Memory is taken from the arena: call once. Tapes are
 * those that imu.source and eye.source read. */
int fv_numerics_measure(struct fv_setup *setup, struct fv_numeric_row *row, const volatile int *stopped);

/* numerics.csv, written and read back (measure --merge takes it over); reading returns the number of
 * rows, -1 with the error set where the file is damaged. */
int fv_numerics_write(const struct fv_numeric_row *row, int rows, const char *path, struct fv_error *error);
int fv_numerics_read(struct fv_numeric_row *row, const char *path, struct fv_error *error);

#endif
