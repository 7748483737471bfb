/* pupil_ellipse: ellipses fitted to points by least squares. */
#ifndef FV_SENSORS_PUPIL_ELLIPSE_H
#define FV_SENSORS_PUPIL_ELLIPSE_H

#include <stdbool.h>

/* Centre, half axes a >= b > 0, direction of a as cosine and sine. */
struct fv_ellipse {
    double x, y, a, b, c, s;
};

/* A point with its weight; 0 leaves it out. */
struct fv_outline_point {
    double x, y, weight;
};

/* Points that a fit takes at most. */
enum { FV_OUTLINE_POINTS = 128 };

/* The ellipse of least algebraic distance (Fitzgibbon, Pilu and Fisher 1999, in the numerically stable form
 * of Halir and Flusser 1998), of points normalised to their mean and spread. False where fewer than 6 points
 * weigh anything or they lie on no ellipse (a line, a point, a parabola). */
bool fv_ellipse_fit(const struct fv_outline_point *point, int n, struct fv_ellipse *ellipse);

/* An ellipse that fits most of the points, in order around it: fv_ellipse_fit of all, or, where 2 in 5 of
 * them lie further off than `near`, of those without one of 12 thirds: the one of the least such distance (as
 * least median of squares, Rousseeuw 1984). A lid cuts pupils along a chord, which is such a part. */
bool fv_ellipse_fit_parts(const struct fv_outline_point *point, int n, double near,
                          struct fv_ellipse *ellipse);

/* Fits twice, each time without the points that lie further off `ellipse` than 2.5 times what is usual (by
 * the median of distances) and than `near`; their weights become 0. */
bool fv_ellipse_trim(struct fv_outline_point *point, int n, double near, struct fv_ellipse *ellipse);

/* fv_ellipse_fit, then fv_ellipse_trim. */
bool fv_ellipse_fit_robust(struct fv_outline_point *point, int n, double near, struct fv_ellipse *ellipse);

/* Distance of a point from the outline, first order (Sampson 1982); < 0 inside. */
double fv_ellipse_distance(const struct fv_ellipse *ellipse, double x, double y);

/* The outline's point at parameter angle (cosine, sine) in the ellipse's own axes, with its outward unit
 * normal. */
void fv_ellipse_outline(const struct fv_ellipse *ellipse, double cosine, double sine, double at[2],
                        double normal[2]);

/* The number of that rank, from 0, of n numbers; changes their order (Hoare 1961). */
double fv_outline_rank(double *value, int n, int rank);

#endif
