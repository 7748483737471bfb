/* tape: recorded heads and gazes, read whole before the first frame, and the rows of our own format
 * as they are recorded.
 *
 * Our own format is a line with its version, a line of column names with units, then rows:
 *
 *   # foveola head 1
 *   t_ns,position_x_m,position_y_m,position_z_m,rotation_w,rotation_x,rotation_y,rotation_z
 *
 *   # foveola gaze 1
 *   t_ns,left_x,left_y,left_z,right_x,right_y,right_z,valid,uncertainty_deg
 *
 * with the axes and meanings of sensors.h and session time, the last column of gazes being free to lack;
 * values are printed so that they read back to the same bits. A session is recorded with one row a latch:
 * t_ns is the time that was latched for, the pose as predicted for it, valid is !held; played back at
 * those times, known and shown at once, it gives the same poses, gazes and uncertainties. tape.c says
 * which formats of others are read. */
#ifndef FV_SENSORS_TAPE_H
#define FV_SENSORS_TAPE_H

#include "platform/error.h"
#include "platform/files.h"
#include "sensors/sensors.h"

#include <stddef.h>
#include <stdint.h>

enum {
    FV_TAPE_LINE_MAX = 4096,      /* bytes of a line; longer ones are rejected */
    FV_TAPE_BYTES_MAX = 256 << 20 /* of a file */
};

/* Older gaze samples count as lost: eye trackers also leave out rows while the eye is shut. */
#define FV_TAPE_STALE_NS INT64_C(100000000)

struct fv_tape {
    int64_t heads, gazes;            /* samples of each; 0 where the format has none */
    int64_t rejected;                /* rows that were dropped, or whose head pose was */
    int64_t first_ns, last_ns, rows; /* times of the first and last row kept, and their number */
    const struct fv_head_sample *head;
    const struct fv_gaze_sample *gaze;
};

/* Reads the text of a tape, `size` bytes followed by a zero byte; `name` is for messages. Writes
 * samples to `head` and `gaze`; NULL only counts, so that a first call tells how many there will be.
 * A row that is short, long, not numbers, not finite, not later than the one before or not a rotation
 * is rejected and counted; a gaze that is not a unit vector (to 1e-3) in front of the face is a
 * lost one. -1 with "name:line: ..." when the format is not known, no row is good, or more rows are
 * bad than good. */
int fv_tape_parse(struct fv_tape *tape, const char *name, const char *text, size_t size,
                  struct fv_head_sample *head, struct fv_gaze_sample *gaze, struct fv_error *error);

/* Reads a file into the arena ("sensors"). Before the seal only. */
int fv_tape_read(struct fv_tape *tape, const char *path, struct fv_error *error);

/* The pose at a session time: a sample's own bits at its time, interpolated between two (slerp), the
 * first before the first; some time after the last the tape starts again. heads > 0. */
void fv_tape_head_at(const struct fv_tape *tape, int64_t t_ns, struct fv_pose *head);

/* The newest sample at a session time; not valid before the first and when it is stale. gazes > 0. */
void fv_tape_gaze_at(const struct fv_tape *tape, int64_t t_ns, struct fv_gaze_sample *gaze);

/* The samples that are known at a session time: the newest FV_TAPE_HISTORY of those up to then since the
 * tape's start or its newest one. Returns their number. *at_ns: t_ns on the samples' clock. */
enum { FV_TAPE_HISTORY = 64 };
int fv_tape_head_history(const struct fv_tape *tape, int64_t t_ns, const struct fv_head_sample **history,
                         int64_t *at_ns);
int fv_tape_gaze_history(const struct fv_tape *tape, int64_t t_ns, const struct fv_gaze_sample **history,
                         int64_t *at_ns);

/* True when `direction` is finite, of unit length (to 1e-3) and in front of the face. */
bool fv_gaze_direction_good(const double direction[3]);

/* True when the pose is finite and its rotation of unit length (to 1e-3). */
bool fv_head_pose_good(const struct fv_pose *pose);

/* Recording; nothing is allocated. Each file begins with its two lines, then rows with growing t_ns. */
void fv_tape_begin_head(struct fv_writer *writer);
void fv_tape_begin_gaze(struct fv_writer *writer);
void fv_tape_write_head(struct fv_writer *writer, const struct fv_head_sample *sample);
void fv_tape_write_gaze(struct fv_writer *writer, const struct fv_gaze_sample *sample);

#endif
