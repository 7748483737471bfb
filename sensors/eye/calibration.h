/* calibration: what a calibration saw, as a file, and the maps that are fitted to it (gaze_map.h).
 *
 *   # foveola calibration 1, 640x400
 *   eye,pupil_x_px,pupil_y_px,glint_x_px,glint_y_px,right_deg,up_deg,weight
 *   left,312.4,208.9,318.0,211.2,-15,10,0.97
 *
 * The first line holds the version and the size of the frames. A row is one frame while a target was looked
 * at: what the tracker found (glint: nan,nan where none was seen), the target's direction (degrees right and
 * up, whose length is the angle from straight ahead), the pupil's confidence. Rows of one eye alone will do
 * for one camera. */
#ifndef FV_SENSORS_CALIBRATION_H
#define FV_SENSORS_CALIBRATION_H

#include "platform/error.h"
#include "platform/files.h"
#include "sensors/eye/gaze_map.h"

#include <stddef.h>

struct fv_calibration {
    int width, height;
    int rows[2];               /* of each eye */
    struct fv_gaze_map map[2]; /* empty where there are no rows */
};

/* Fits both eyes' maps to the text of a file, `size` bytes followed by a zero byte. 0, or -1 with "name:line:
 * ..." for a row that is none, or "name: ..." and why the map of an eye is refused. Before the seal only. */
int fv_calibration_parse(struct fv_calibration *calibration, const char *name, const char *text, size_t size,
                         struct fv_error *error);

/* Writing: the two lines of the head, then rows. Numbers read back to the same bits. */
void fv_calibration_begin(struct fv_writer *writer, int width, int height);
void fv_calibration_row(struct fv_writer *writer, int eye, const struct fv_gaze_target *target);

int fv_calibration_read(struct fv_calibration *calibration, const char *path, struct fv_error *error);

#endif
