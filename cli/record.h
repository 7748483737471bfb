/* record: what a run leaves besides pictures: its settings and every latched sample, enough for
 * `foveola replay` to give the same pictures. Written row by row into OUT/tape. */
#ifndef FV_CLI_RECORD_H
#define FV_CLI_RECORD_H

#include "config/config.h"
#include "platform/files.h"
#include "sensors/sensors.h"

enum { FV_RECORD_BYTES = 2 * sizeof(struct fv_writer) }; /* static: what a recording takes */

/* Opens OUT/tape/head.csv and gaze.csv and writes settings.ini. */
int fv_record_open(const struct fv_config *config, const char *out, struct fv_error *error);

/* What was latched for the session time t_ns, which grows from call to call. A disk that fills ends the
 * recording, not the run: said once. */
void fv_record_latch(int64_t t_ns, const struct fv_pose *head, const struct fv_gaze *gaze);

int fv_record_close(int64_t frames, const char *out, struct fv_error *error);

#endif
