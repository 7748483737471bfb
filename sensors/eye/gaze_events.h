/* gaze_events: what the eye does while it does it: fixation, saccade, pursuit or blink, for each sample, some
 * milliseconds late.
 *
 * Velocity thresholds with hysteresis (the class of Nystrom and Holmqvist 2010): a saccade is where the speed
 * passes a peak threshold; it begins and ends at a lower one. Both rise with the noise of the recording, as
 * measured between saccades. What is no saccade is pursuit where the eye goes one way, and fixation
 * elsewhere. */
#ifndef FV_SENSORS_GAZE_EVENTS_H
#define FV_SENSORS_GAZE_EVENTS_H

#include <stdbool.h>
#include <stdint.h>

enum fv_gaze_event { FV_EVENT_NONE, FV_EVENT_FIXATION, FV_EVENT_SACCADE, FV_EVENT_PURSUIT, FV_EVENT_BLINK };

/* The answer is late by these times together, at least 3 samples: half the window of the speed, and how far
 * ahead a saccade's peak may lie of its beginning. */
#define FV_EVENT_SLOPE_NS 8000000
#define FV_EVENT_AHEAD_NS 14000000

/* Samples that are kept: 64 ms at 1000 Hz. Faster sources are answered a little sooner. */
enum { FV_EVENT_RING = 64 };

/* The caller's, all 0 at the start. */
struct fv_gaze_events {
    struct {
        int64_t t_ns;
        double x_deg, y_deg, speed; /* speed: degrees a second, < 0: not known */
        bool valid;
    } ring[FV_EVENT_RING];
    int64_t added, sloped, told; /* samples: taken, with a speed, answered */
    double noise;                /* usual speed between saccades, degrees a second */
    double peak, way[3];         /* of the saccade under way or just over; slow mean velocity and speed */
    int64_t ended_ns;
    bool moving, ever;
};

/* Takes a sample: gaze in degrees right and up; valid false: the eye was lost. Returns the event of the
 * newest sample that can be told now, and its time; FV_EVENT_NONE while there is none. Samples whose time
 * does not grow, or which are not finite, count as lost ones or are left out: never fails. */
enum fv_gaze_event fv_gaze_events_add(struct fv_gaze_events *events, int64_t t_ns, double x_deg, double y_deg,
                                      bool valid, int64_t *told_ns);

#endif
