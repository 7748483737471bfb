/* camera_source: the sources of gaze that are camera frames: of cameras (eye.source=v4l2), simulated ones
 * (sim-camera), or recorded (tape, with the folder of the recording in eye.device): from settings to samples.
 */
#ifndef FV_SENSORS_CAMERA_SOURCE_H
#define FV_SENSORS_CAMERA_SOURCE_H

#include "config/config.h"
#include "sensors/eye/frame_player.h"
#include "sensors/eye/sim_camera.h"
#include "sensors/eye/watch.h"
#include "sensors/sensors.h"

struct fv_camera_source; /* opaque, in the arena */

/* How a camera at that path is to be opened by the settings; `key`: the one that names it. */
void fv_camera_settings_of(struct fv_camera_settings *camera, const struct fv_config *config, const char *key,
                          const char *path);

/* Opens the cameras of the settings and starts to watch them, or makes simulated ones. 0, or -1 with the
 * error set. */
int fv_camera_source_open(struct fv_camera_source **source, const struct fv_config *config,
                          struct fv_error *error);

/* What the settings say of the eyes, and of real cameras; calibrations ask too. 0, or -1 with the error set.
 */
int fv_camera_source_eyes(struct fv_eye_settings eye[2], const struct fv_config *config, int eyes,
                          struct fv_error *error);
int fv_camera_source_settings(struct fv_watch_settings *settings, const struct fv_config *config,
                              struct fv_error *error);

/* The samples known at t_ns (session time), oldest first, and that time on their clock: for real cameras,
 * whose samples are of CLOCK_MONOTONIC, it is now, whatever t_ns is. Returns their number. */
int fv_camera_source_history(struct fv_camera_source *source, int64_t t_ns,
                             const struct fv_gaze_sample **history, int64_t *at_ns);

/* Records the cameras' frames into the folder (frame_recorder.h), up to the end; nothing is done where they
 * are no real cameras; likewise what each frame told (eye_tape.h). 0, or -1 with the error set. The end tells
 * also how many frames were dropped, by the log; session_ns: CLOCK_MONOTONIC of session time 0, INT64_MIN:
 * not known. */
int fv_camera_source_record(struct fv_camera_source *source, const char *folder, struct fv_error *error);
int fv_camera_source_record_looks(struct fv_camera_source *source, const char *folder, struct fv_spooler *spooler,
                                  struct fv_error *error);
int fv_camera_source_record_end(struct fv_camera_source *source, int64_t session_ns, struct fv_error *error);

/* What the cameras have done so far; all 0 for simulated ones. */
void fv_camera_source_counts(struct fv_camera_source *source, struct fv_eye_camera_counts *counts);

/* Gives the cameras back; what they did can still be told, and a recording still be ended. */
void fv_camera_source_close(struct fv_camera_source *source);

#endif
