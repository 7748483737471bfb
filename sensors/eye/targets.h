/* targets: what a calibration shows: where, and the log of what was shown when.
 *
 *   # foveola targets 1
 *   t_ns,from_ns,until_ns,right_deg,up_deg
 *   1500000000,2000000000,2700000000,-18,12
 *
 * A row is a target shown: it appeared at t_ns; frames from from_ns on and before until_ns (the middle of
 * their exposure) are of an eye that looks at it. Its direction is in degrees right and up of straight ahead,
 * whose length is the angle. Times are of the clock of the frames beside it (frame_tape.h), rows grow: a
 * target appears when the one before is over. Values read back to the same bits. A target that was shown
 * again has another row. */
#ifndef FV_SENSORS_TARGETS_H
#define FV_SENSORS_TARGETS_H

#include "platform/error.h"
#include "platform/files.h"

#include <stdbool.h>
#include <stdint.h>

enum { FV_TARGETS_MAX = 13, FV_SHOWN_MAX = 64 };

struct fv_target_shown {
    int64_t t_ns, from_ns, until_ns;
    double at_deg[2];
};

/* The places of 5, 9 or 13 targets, in the order in which they are shown: the middle, corners, sides, and
 * between them; `reach`: how far they go right and left, up, and down, degrees. False: another number. */
struct fv_target_reach {
    double side, up, down;
};
bool fv_targets_place(int points, const struct fv_target_reach *reach, double place_deg[FV_TARGETS_MAX][2]);

/* Whether two directions are one target: less than half a degree apart. */
bool fv_targets_same(const double a_deg[2], const double b_deg[2]);

/* Reads the text of a log, `size` bytes followed by a zero byte, into shown[FV_SHOWN_MAX]. Returns the number
 * of rows, at least 1; or -1 with "name:line: ..." for a row that is none, or "name: ...". */
int fv_targets_parse(struct fv_target_shown *shown, const char *name, const char *text, size_t size,
                     struct fv_error *error);

/* Before the seal only. */
int fv_targets_read(struct fv_target_shown *shown, const char *path, struct fv_error *error);

/* Recording. */
void fv_targets_begin(struct fv_writer *writer);
void fv_targets_row(struct fv_writer *writer, const struct fv_target_shown *shown);

#endif
