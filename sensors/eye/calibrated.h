/* calibrated: what comes of a calibration (calibrator.h): the maps of both eyes, how good they are, and the
 * file that eye.calibration reads; or why there is none.
 *
 * Of the frames of each target, up to FV_CALIBRATED_FRAMES that are evenly spread are kept, so that all
 * targets weigh about the same. How good: by how much the fitted gaze is off each target, which flatters, as
 * the fit was made from it; and by how much it is off where a target is left out of the fit (cross
 * validation), which is too strict at the corners, as the fit must then reach beyond its targets. */
#ifndef FV_SENSORS_CALIBRATED_H
#define FV_SENSORS_CALIBRATED_H

#include "sensors/eye/calibrator.h"

enum { FV_CALIBRATED_FRAMES = FV_GAZE_TARGETS_MAX / FV_SHOWN_MAX };

/* Degrees. */
struct fv_off {
    double mean, median, worst;
};

struct fv_calibrated_target {
    double at_deg[2];
    int shown;              /* how often */
    int first, frames;      /* in the eye's rows; 0 frames: missed */
    double spread_px;       /* of the pupil */
    double gaze_deg[2];     /* the mean of what the map makes of its frames; NaN: missed ... */
    double left_out_deg[2]; /* ... of what a map without it makes of them; NaN: there is none */
    double off_deg, left_out_off_deg;
    double rest_error_deg; /* root mean square of the map without it, over the others; NaN: there is none */
};

struct fv_calibrated_eye {
    int targets, seen; /* all; of them, those that were not missed */
    struct fv_calibrated_target target[FV_SHOWN_MAX];
    int rows;
    struct fv_gaze_target row[FV_GAZE_TARGETS_MAX];
    struct fv_gaze_map map;
    struct fv_off fit, left_out; /* over the targets seen; NaN where there is none */
};

struct fv_calibrated {
    int eyes;
    struct fv_calibrated_eye eye[2];
};

/* Fits the maps. 0; or -1 with why there is none in one line: then all else is as far as it was known. */
int fv_calibrated_make(struct fv_calibrated *calibrated, struct fv_calibrator *calibrator,
                       struct fv_error *error);

/* Writes the file whole, or leaves nothing and what was there before as it was. `writer`: the caller's. */
int fv_calibrated_write(const struct fv_calibrated *calibrated, int width, int height, const char *path,
                        struct fv_writer *writer, struct fv_error *error);

#endif
