/* tracker: from a frame of one eye to where it looks: pupil, glints, map.
 *
 *   frame -> pupil.h -> glint.h -> gaze_map.h -> struct fv_eye_look -> binocular.h -> struct fv_gaze_sample
 *
 * Without a calibration a model takes the map's place: the pupil turns about the middle of a sphere seen
 * along its axis (orthographic), x = middle - R sin(right), y = middle - R sin(up), with the middle at 0.5 of
 * the width and 0.55 of the height, and R 0.245 of the width unless the settings say otherwise: an iris that
 * takes 0.3 of the width, with the pupil 9.8 mm in front of the eye's middle (Le Grand and El Hage 1980). It
 * is as good as the camera's place is known: 5 degrees are told as its uncertainty. Calibrate. */
#ifndef FV_SENSORS_TRACKER_H
#define FV_SENSORS_TRACKER_H

#include "sensors/eye/gaze_map.h"
#include "sensors/eye/glint.h"
#include "sensors/eye/pupil.h"

/* Shares: of the width, the height, the width; radius < 0: the image is mirrored. */
struct fv_eye_model {
    double middle_x, middle_y, radius;
};
#define FV_EYE_MODEL_USUAL ((struct fv_eye_model){0.5, 0.55, 0.245})
#define FV_EYE_MODEL_ERROR_DEG 5.0

struct fv_eye_settings {
    struct fv_gaze_map map; /* empty: the model */
    int width, height;      /* of the frames that the map is of: others are not seen; 0: any */
    struct fv_eye_model model;
    double confidence; /* pupils of less are not seen; at least FV_PUPIL_CONFIDENT */
    int leds;          /* reflections; 0: glints are not looked for */
};

/* Where an eye looks, as one frame tells. */
struct fv_eye_look {
    int64_t t_ns;
    bool seen;        /* else all below is 0 but the confidence */
    double at_deg[2]; /* right and up; the length is the angle from straight ahead */
    double error_deg; /* the map's, more where the pupil is seen poorly or a lid cuts it */
    double confidence;
    struct fv_gaze_feature feature; /* for calibrations */
};

/* The caller's; begun by fv_eye_tracker_begin. */
struct fv_eye_tracker {
    struct fv_eye_settings settings;
    struct fv_pupil_track track;
    struct fv_glint_ring ring;
    struct fv_pupil pupil; /* of the newest frame */
    double usual;          /* width of the pupil, pixels; 0: not known */
    double ratio;          /* minor axis over major one, as usual; 0: not known */
    int64_t narrow_ns;     /* since when it has been much narrower; 0: it is not */
    int64_t frames, seen, with_glint, narrow;
    void *scratch;
    size_t bytes;
};

/* scratch: fv_pupil_scratch_bytes of the largest frame, 64-byte aligned, the caller's. */
void fv_eye_tracker_begin(struct fv_eye_tracker *tracker, const struct fv_eye_settings *settings,
                          void *scratch, size_t bytes);

/* t_ns grows from frame to frame. Frames for which the scratch memory does not do are not seen. Never NaN. */
void fv_eye_tracker_frame(struct fv_eye_tracker *tracker, const struct fv_eye_frame *frame, int64_t t_ns,
                          struct fv_eye_look *look);

/* Degrees right and up, with the angle from straight ahead as length, to a unit vector in head space (x
 * right, y up, -z ahead), and back. Beyond 80 degrees, which no eye reaches, 80. */
void fv_gaze_vector(const double at_deg[2], double direction[3]);
void fv_gaze_degrees(const double direction[3], double at_deg[2]);

#endif
