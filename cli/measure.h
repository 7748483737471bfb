/* measure: what the verb `measure` leaves in its folder, read back and put together. */
#ifndef FV_CLI_MEASURE_H
#define FV_CLI_MEASURE_H

#include "cli/cli.h"

/* 0 where all that lies in OUT is whole and its rows of the scene have the key, or there are none; -1 with
 * the error set otherwise. */
int fv_measure_check(const char *out, const char *scene, const char *key, struct fv_error *error);

/* Reads all rows that lie in OUT and writes measure.csv and, where there is a row, report.html; *rows is
 * their number, *missing how many more a whole sweep of their scenes has. Returns 0, or -1 with the error
 * set, which it also is where two rows of a scene were measured with different settings. */
int fv_measure_write(const char *out, int *rows, int *missing, struct fv_error *error);

/* Copies what each folder's measure left into OUT; what is there already stays. Returns 0, or -1 with the
 * error set. */
int fv_measure_merge(const char *const *folder, int folders, const char *out, struct fv_error *error);

#endif
