/* fixation: of the looks while a target was shown, those in which the eye rested on it.
 *
 * The eye rests where the pupil was found most often: the densest place, within which a fixation's drift and
 * tremor stay. What is elsewhere (saccades, glances aside, half-closed lids, another dark spot) is left out
 * without the means having to be near: half of the looks and more may be wrong. Of the rest, what is further
 * from the median than 3 standard deviations, known from the median absolute deviation (Hampel 1974), is left
 * out too; and a glint that lies elsewhere than the others' counts as not seen. */
#ifndef FV_SENSORS_FIXATION_H
#define FV_SENSORS_FIXATION_H

#include "sensors/eye/gaze_map.h"

#include <stdint.h>

enum { FV_FIXATION_LOOKS_MAX = 1024 };

/* What one frame tells, in which the pupil was found. */
struct fv_fixation_look {
    int64_t t_ns;
    struct fv_gaze_feature feature;
    double weight;
};

struct fv_fixation {
    int looks;         /* that were chosen */
    int64_t length_ns; /* from the first to the last of them */
    double pupil[2];   /* their median */
    double spread_px;  /* standard deviation of the pupil, from median absolute deviations, the larger axis */
};

/* Chooses from n <= FV_FIXATION_LOOKS_MAX looks, oldest first; chosen[i] says whether the i-th is of the
 * fixation, and its glint may be marked as not seen. near_px > 0: a fixation stays within this of its middle.
 * Looks that are not finite are never chosen. */
void fv_fixation_choose(struct fv_fixation_look *look, int n, double near_px, bool *chosen,
                        struct fv_fixation *fixation);

/* The median of n >= 1 numbers, whose order is lost; of an even number, the mean of both. None is NaN. */
double fv_fixation_median(double *value, int n);

#endif
