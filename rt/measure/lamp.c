/* lamp: see lamp.h. */
#include "rt/measure/lamp.h"

#include <math.h>

static const float before_m = 0.1f;

struct fv_light fv_lamp_of_area(const struct fv_light *l)
{
    struct fv_light lamp = {.kind = FV_LIGHT_POINT};
    float normal[3] = {l->u[1] * l->v[2] - l->u[2] * l->v[1], l->u[2] * l->v[0] - l->u[0] * l->v[2],
                       l->u[0] * l->v[1] - l->u[1] * l->v[0]};
    float area = sqrtf(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
    for (int k = 0; k < 3; k++) {
        lamp.position[k] = l->position[k] + (l->u[k] + l->v[k]) / 2 + before_m * normal[k] / area;
        lamp.colour[k] = l->colour[k] * area;
    }
    return lamp;
}
