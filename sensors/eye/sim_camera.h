/* sim_camera: the simulated eyes (sim.c) seen by simulated cameras (image_sim.h), their frames taken the
 * whole way that those of real ones go: pupil, glints, map, both eyes, events, smoothing. For trying that way
 * where there is no camera, with the true gaze known: it costs the time that two frames take to draw,
 * whenever one is due.
 *
 * The answer depends on seed, size, rate and the frames that were due when asked alone. */
#ifndef FV_SENSORS_SIM_CAMERA_H
#define FV_SENSORS_SIM_CAMERA_H

#include "sensors/eye/binocular.h"
#include "sensors/eye/image_sim.h"

enum { FV_SIM_CAMERA_HISTORY = 8 };

struct fv_sim_camera_settings {
    uint64_t seed;
    int width, height;
    double hz;
    double settle_s;
    struct fv_eye_settings eye[2]; /* with an empty map: calibrated at the start, on 9 targets */
};

struct fv_sim_camera {
    uint64_t seed;
    int64_t period_ns, newest; /* frames up to this number have been taken */
    bool begun;
    struct fv_eye_camera camera[2];
    struct fv_eye_tracker tracker[2];
    struct fv_binocular binocular;
    uint8_t *pixels;
    int samples;
    struct fv_gaze_sample sample[FV_SIM_CAMERA_HISTORY]; /* newest last */
};

/* Takes memory from the arena ("sensors"). 0, or -1 with the error set: the camera sees too little to be
 * calibrated. */
int fv_sim_camera_open(struct fv_sim_camera *sim, const struct fv_sim_camera_settings *settings,
                       struct fv_error *error);

/* Takes the frames that were due up to t_ns, at most the newest FV_SIM_CAMERA_HISTORY; earlier times than
 * before change nothing. Returns the number of samples, the newest last in `sample`. */
int fv_sim_camera_until(struct fv_sim_camera *sim, int64_t t_ns);

#endif
