/* triangle: from three vertices to the record that shading takes (scene.h), in double. */
#ifndef FV_SCENE_TRIANGLE_H
#define FV_SCENE_TRIANGLE_H

#include "rt/scene/build.h"

void fv_cross(const double a[3], const double b[3], double out[3]);

/* To unit length; false and unchanged where there is none. */
bool fv_normalise(double v[3]);

/* `corner`: numbers of vertices. */
bool fv_triangle_has_area(const struct fv_vertex *vertex, const uint32_t corner[3]);

/* One that has area. Turns its corners where Embree's plane would be imprecise. */
void fv_triangle_fill(struct fv_triangle *triangle, const struct fv_vertex *vertex, uint32_t corner[3],
                      uint16_t material);

#endif
