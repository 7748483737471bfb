/* binocular: what both eyes' frames tell, as one stream of gaze samples, with events, smoothing and
 * uncertainty.
 *
 * Both eyes turn together (version) but for what makes their lines meet (vergence), which changes slowly.
 * Frames of the same moment give both: version is the eyes' mean, weighted by how well each is known,
 * vergence their difference. Where one eye alone is seen, or the cameras take turns, the other is where it
 * was last in relation to it. Version and vergence are smoothed (gaze_smooth.h), events told from the version
 * as measured (gaze_events.h). */
#ifndef FV_SENSORS_BINOCULAR_H
#define FV_SENSORS_BINOCULAR_H

#include "sensors/eye/gaze_events.h"
#include "sensors/eye/gaze_smooth.h"
#include "sensors/eye/tracker.h"
#include "sensors/sensors.h"

/* Frames this close are of one moment. */
#define FV_BINOCULAR_MOMENT_NS 4000000

/* The caller's; begun by fv_binocular_begin. */
struct fv_binocular {
    struct fv_eye_look newest[2]; /* of each eye */
    bool ever[2];
    double speed_deg_s[2];
    struct fv_gaze_events events;
    struct fv_gaze_smooth version, vergence;
    double apart[2]; /* vergence: left minus right, degrees */
    bool apart_known;
    int disagreed;            /* moments in a row in which the eyes were too far apart to be both right */
    enum fv_gaze_event event; /* of the newest sample that can be told, and its time */
    int64_t event_ns, t_ns;
    int64_t both, single, lost, disagreements;
};

void fv_binocular_begin(struct fv_binocular *binocular, double settle_s);

/* New looks of the eyes (left, right; NULL: nothing new). True: a sample came of them, its time later than
 * the one before. False: none, as nothing new was given, or an eye was lost while the other was seen a moment
 * ago. */
bool fv_binocular_add(struct fv_binocular *binocular, const struct fv_eye_look *left,
                      const struct fv_eye_look *right, struct fv_gaze_sample *sample);

#endif
