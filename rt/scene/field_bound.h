/* field_bound: what a field's surface lies within. Between field_compile.c and field_bound.c only. */
#ifndef FV_SCENE_FIELD_BOUND_H
#define FV_SCENE_FIELD_BOUND_H

#include <stdbool.h>

/* A box, and the ball around it or a smaller one. Infinite where there is no bound. `spread`: where the field is at
 * most e, a point is within e * spread of the box: 1 where it is the distance itself. */
struct fv_bound {
    double low[3], high[3], centre[3], radius, spread, lipschitz;
};

/* Turned by the rotation (rows), and moved. */
struct fv_bound fv_bound_turn(const struct fv_bound *b, const double turn[3][3], const double move[3]);

/* Around both. */
struct fv_bound fv_bound_join(const struct fv_bound *a, const struct fv_bound *b);

/* Around where the field is at most e. */
void fv_bound_grow(struct fv_bound *b, double e);

/* Of a box: its ball. */
struct fv_bound fv_bound_box(const double low[3], const double high[3]);

/* Whether one and two are finite along this axis. */
bool fv_bound_finite(const struct fv_bound *b, int axis);

/* Centre and half edges, infinite along axes without bound, where the centre is 0. */
void fv_bound_halves(const struct fv_bound *b, float centre[3], float half[3]);

#endif
