/* acuity: what the method selective takes from eccentricity alone: the region that a pixel lies in, how
 * tolerant of contrast it is, and how much a new picture weighs over the ones before it
 * (Kim, Ko and Ihm 2021, sections 4.1, 4.6 and 4.7).
 *
 * Eccentricities are degrees. Everywhere here one below 0, and NaN, counts as 0. */
#ifndef FV_FOVEA_ACUITY_H
#define FV_FOVEA_ACUITY_H

/* The central regions, and what lies beyond the near periphery. */
enum fv_region { FV_REGION_FOVEA, FV_REGION_PARA, FV_REGION_PERI, FV_REGION_NEAR, FV_REGION_FAR, FV_REGIONS };

/* Where each region ends: e_f, e_p, e_m, e_np, e_max; the limit belongs to the inner region. 0 or more,
 * finite, none less than the one before; a region that ends where it begins is empty. Set by
 * fv_regions_set alone. */
struct fv_regions {
    float upper_deg[FV_REGIONS];
};

/* A limit less than the one before (or than 0), and NaN, is raised to it; no limit is beyond 180. */
void fv_regions_set(struct fv_regions *regions, const double upper_deg[FV_REGIONS]);

/* FV_REGION_FAR also beyond e_max. */
int fv_region_at(const struct fv_regions *regions, float eccentricity_deg);

/* One half of the curve of tolerance: a quadratic Bezier seen from its flat end (0 or e_np) towards the
 * joint at e_f. In degrees from the flat end, its control points lie at 0, `flat_to_middle` and
 * flat_to_middle + middle_to_joint; in tolerance at `flat`, `flat` and `joint`. */
struct fv_tolerance_half {
    double flat_deg, flat_to_middle, middle_to_joint;
    double flat, joint;
};

/* tau_fov(e), the factor on thresholds of contrast. Set by fv_tolerance_set alone. */
struct fv_tolerance {
    float joint_deg, end_deg; /* e_f, e_np */
    struct fv_tolerance_half half[2];
};

/* `shape`: tau_0, tau_f, tau'_f, tau_np, the tolerances at 0, e_f and e_np, and the slope a degree at e_f;
 * tolerances finite, 0 or more. The curve has slope 0 at 0 and at e_np, and tau'_f on both sides of e_f, by
 * middle points where the tangents of each half's ends meet. Where they do not meet within the half (tau'_f
 * is less than the half's mean slope, 0, of the other sign, or NaN), eccentricity would not grow along the
 * curve: the half is the straight line instead, to which the curve tends as tau'_f falls to the mean slope.
 * So each half goes one way between the tolerances of its ends. An infinite tau'_f is a vertical tangent. */
void fv_tolerance_set(struct fv_tolerance *tolerance, const struct fv_regions *regions,
                      const double shape[4]);

/* tau_0 at 0 (where e_f is 0, too), tau_f at e_f, tau_np from e_np on; where e_np = e_f that is a step beyond
 * e_f. The nearest float, but for about 1e-15 of the largest tolerance. */
float fv_tolerance_at(const struct fv_tolerance *tolerance, float eccentricity_deg);

/* alpha(e), the share of the newest picture in temporal smoothing, piecewise linear: alpha[0] at 0, alpha[i]
 * at the i-th limit, alpha[FV_REGIONS] beyond e_max. Where limits coincide it steps: at them it is the first
 * one's value, beyond them the last one's. Values within [0, 1] give a value within [0, 1].
 * A mean by weights alpha (1 - alpha)^i is one by weights (1 - alpha)^i, which is sound at 0, too, where all
 * frames weigh the same; at 1 the newest alone does. */
float fv_smoothing_at(const struct fv_regions *regions, const double alpha[FV_REGIONS + 1],
                      float eccentricity_deg);

#endif
