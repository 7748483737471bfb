/* acuity: regions, tolerance and smoothing by eccentricity; see acuity.h. */
#include "rt/fovea/acuity.h"

#include <math.h>

void fv_regions_set(struct fv_regions *regions, const double upper_deg[FV_REGIONS])
{
    float least = 0;
    for (int i = 0; i < FV_REGIONS; i++) {
        if (upper_deg[i] > (double)least) least = (float)fmin(upper_deg[i], 180);
        regions->upper_deg[i] = least;
    }
}

int fv_region_at(const struct fv_regions *regions, float e)
{
    int region = 0;
    for (int i = 0; i < FV_REGION_FAR; i++) region += e > regions->upper_deg[i];
    return region;
}

/* The tangents at the flat end and at the joint meet where the joint's reaches `flat`. */
static struct fv_tolerance_half half_of(double flat_deg, double joint_deg, double flat, double joint,
                                        double slope)
{
    double width = fabs(joint_deg - flat_deg), outward = joint_deg > flat_deg ? 1 : -1;
    double to_joint = outward * (joint - flat) / slope;
    if (!(to_joint >= 0 && to_joint <= width)) to_joint = width;
    return (struct fv_tolerance_half){flat_deg, width - to_joint, to_joint, flat, joint};
}

void fv_tolerance_set(struct fv_tolerance *t, const struct fv_regions *regions, const double shape[4])
{
    t->joint_deg = regions->upper_deg[FV_REGION_FOVEA];
    t->end_deg = regions->upper_deg[FV_REGION_NEAR];
    t->half[0] = half_of(0, (double)t->joint_deg, shape[0], shape[1], shape[2]);
    t->half[1] = half_of((double)t->end_deg, (double)t->joint_deg, shape[3], shape[1], shape[2]);
}

/* With m and n the distances of the middle point from the flat end and the joint, x at the parameter s is
 * 2 m s + (n - m) s^2, so that s = x / (m + sqrt(m^2 + (n - m) x)). What is under the root is also
 * n^2 + (m - n) (m + n - x): one of the two is a sum of positive terms. */
float fv_tolerance_at(const struct fv_tolerance *t, float e)
{
    if (!(e > 0)) return (float)t->half[0].flat;
    if (e >= t->end_deg && e > t->joint_deg) return (float)t->half[1].flat;
    const struct fv_tolerance_half *half = &t->half[e > t->joint_deg];
    double m = half->flat_to_middle, n = half->middle_to_joint, x = fabs((double)e - half->flat_deg);
    double square = m < n ? m * m + (n - m) * x : n * n + (m - n) * (m + n - x);
    double s = fmin(x / (m + sqrt(fmax(square, 0))), 1); /* beyond by rounding only */
    return (float)((1 - s * s) * half->flat + s * s * half->joint);
}

float fv_smoothing_at(const struct fv_regions *regions, const double alpha[FV_REGIONS + 1], float e)
{
    if (!(e > 0)) return (float)alpha[0];
    int region = fv_region_at(regions, e);
    float from = region > 0 ? regions->upper_deg[region - 1] : 0, to = regions->upper_deg[region];
    if (region == FV_REGION_FAR && e >= to) return (float)alpha[FV_REGIONS];
    double share = ((double)e - (double)from) / ((double)to - (double)from);
    return (float)((1 - share) * alpha[region] + share * alpha[region + 1]);
}
