/* lamp: point lights in the place of area lights, for tables of papers whose light is such. */
#ifndef FV_MEASURE_LAMP_H
#define FV_MEASURE_LAMP_H

#include "rt/scene/scene.h"

/* A point light 0.1 m in front of the middle of an area light, as bright along its axis: of radiant intensity
 * radiance times area. */
struct fv_light fv_lamp_of_area(const struct fv_light *area);

#endif
