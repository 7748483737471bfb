/* eye_tape: what each frame of the eye cameras told, as a file, by way of a spool: the thread that watches the cameras
 * never waits for a disk. For looking at, and for working on what comes behind the pupil; frames themselves are
 * frame_tape.h.
 *
 *   # foveola eye 1
 *   eye,t_ns,arrival_ns,found,confidence,pupil_x_px,pupil_y_px,major_px,minor_px,angle_deg,glint,glint_x_px,
 *     glint_y_px,seen,right_deg,up_deg,error_deg,event,event_ns                              (one line)
 *   # session 0 = 81234565555 ns
 *
 * eye: left or right (left, too, where there is one camera); t_ns: middle of the exposure, arrival_ns: when the
 * frame was there, both CLOCK_MONOTONIC, of which "# session" tells what is session time 0. pupil.h has the ellipse (the
 * major axis from x towards y), found 0 or 1; glint 1 where the reflections' middle is known; seen, and where this eye
 * looks alone, before both eyes are taken together, as tracker.h. event: what the eyes did at event_ns, as far as it can
 * be told by then: none, fixation, saccade, pursuit, blink. What is not known is 0. */
#ifndef FV_SENSORS_EYE_TAPE_H
#define FV_SENSORS_EYE_TAPE_H

#include "platform/files.h"
#include "platform/spool.h"
#include "sensors/eye/gaze_events.h"
#include "sensors/eye/tracker.h"

enum { FV_EYE_RECORDER_ROWS = 2048 /* that may wait: five seconds of two cameras at 200 Hz */ };

struct fv_eye_row {
    int eye;
    int64_t arrival_ns;
    struct fv_eye_look look;
    struct fv_pupil pupil;
    enum fv_gaze_event event;
    int64_t event_ns;
};

struct fv_eye_recorder; /* in the arena ("sensors") */

/* Begins folder/eye.csv, to be written by `spooler`, which is not started yet. 0, or -1 with the error set. */
int fv_eye_recorder_open(struct fv_eye_recorder **recorder, const char *folder, struct fv_spooler *spooler,
                         struct fv_error *error);

/* From one thread. */
void fv_eye_recorder_put(struct fv_eye_recorder *recorder, const struct fv_eye_row *row);

/* Once the spooler is stopped. session_ns: INT64_MIN: not known. 0, or -1 with the failure. */
int fv_eye_recorder_close(struct fv_eye_recorder *recorder, int64_t session_ns, struct fv_error *error);

#endif
