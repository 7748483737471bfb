/* record: what a run leaves besides pictures: its settings, every latched sample and what was decided for
 * each frame, enough for `foveola replay` to give the same pictures. Rows go through spools (platform/spool.h) into
 * OUT/tape, so that the frame loop waits for no disk. */
#ifndef FV_CLI_RECORD_H
#define FV_CLI_RECORD_H

#include "config/config.h"
#include "platform/files.h"
#include "platform/spool.h"
#include "rt/frame/session.h"
#include "sensors/sensors.h"

enum { FV_RECORD_FILES = 3, FV_RECORD_ROWS = 4096 /* that may wait for the disk */ };

struct fv_record_latched {
    struct fv_head_sample head;
    struct fv_gaze_sample gaze;
};

enum {
    FV_RECORD_BYTES = FV_RECORD_FILES * sizeof(struct fv_writer) + /* static: what a recording takes */
                      FV_RECORD_ROWS * (sizeof(struct fv_record_latched) + sizeof(struct fv_decision))
};

/* Opens OUT/tape/head.csv, gaze.csv and decisions.csv, to be written by `spooler`, which is not started yet, and writes
 * settings.ini. `stage`: the names of the stages that may be cut. `late`: late pictures are turned. */
int fv_record_open(const struct fv_config *config, const char *const *stage, int stages, bool late, const char *out,
                   struct fv_spooler *spooler, struct fv_error *error);

/* What was latched for the session time t_ns, for a frame or to turn its late picture, which grows from call to call. A disk that fills ends the
 * recording, not the run: said once. One that does not keep up loses rows: said at the end. */
void fv_record_latch(int64_t t_ns, const struct fv_pose *head, const struct fv_gaze *gaze);

/* After each frame. */
void fv_record_decision(const struct fv_decision *decision);

/* Once the spooler is stopped. A recording with rows missing is a tape still, but cannot be replayed: told as an error. */
int fv_record_close(int64_t frames, const char *out, struct fv_error *error);

#endif
