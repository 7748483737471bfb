/* image_sim: infrared images of a simulated eye, with the true pupil: iris, pupil, sclera, lids, lashes,
 * glints, vignette, blur and noise. Pure functions of what they are given, so that a camera's whole way to a
 * gaze can be checked end to end.
 *
 * The eye is a sphere seen along its -z from the front (orthographic: a camera some centimetres off); pupil
 * and iris are discs that turn about its middle, the cornea a smaller sphere in which the LEDs are reflected.
 * Lengths in mm are those of the Le Grand eye (Le Grand and El Hage 1980), rounded. */
#ifndef FV_SENSORS_IMAGE_SIM_H
#define FV_SENSORS_IMAGE_SIM_H

#include "sensors/eye/pupil.h"

/* The camera and what does not change with time. */
struct fv_eye_camera {
    int width, height; /* >= 1 */
    double px_per_mm;  /* > 0 */
    double x, y;       /* the eye's middle, pixels */
    int leds;          /* 0 to FV_EYE_LEDS_MAX, on a ring */
    int blurs;         /* times 1-2-1 both ways, 0 to 8 */
    double noise;      /* standard deviation, levels of grey */
    double vignette;   /* share by which the corners are darker, 0 to 1 */
    uint64_t seed;     /* whose eye: lashes, iris, skin */
};
enum { FV_EYE_LEDS_MAX = 8 };

/* A headset's: the iris 0.3 of the width, 6 LEDs, 1 blur, noise of 2. */
struct fv_eye_camera fv_eye_camera_usual(int width, int height, uint64_t seed);

/* The eye at a moment. */
struct fv_eye_state {
    int64_t t_ns; /* of the noise */
    double
        direction[3]; /* gaze, unit, in the camera's axes: x right in the image, y up, -z into the camera */
    double pupil_mm;  /* diameter, 1 to 9 */
    double open;      /* of the lids: 0 closed to 1 */
};

/* The state of a simulated eye (0 left, 1 right; fv_sim_gaze of the same seed): gaze, lids, and a pupil that
 * changes between 2.5 and 6 mm within seconds. */
void fv_eye_state_at(uint64_t seed, int eye, int64_t t_ns, struct fv_eye_state *state);

/* Draws rows of `stride` bytes. truth (may be NULL): the pupil's ellipse; confidence is the share of its
 * outline that no lid hides, found whether that is at least a half. */
void fv_eye_image(const struct fv_eye_camera *camera, const struct fv_eye_state *state, uint8_t *pixels,
                  ptrdiff_t stride, struct fv_pupil *truth);

#endif
