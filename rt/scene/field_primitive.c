/* field_primitive: numbers of a file's primitives as those of the code that evaluates them. */
#include "rt/scene/field_primitive.h"

#include <math.h>

void fv_field_put(float *value, const double *v, int count)
{
    for (int i = 0; i < count; i++) value[i] = (float)v[i];
}

void fv_space_place(const struct fv_space *s, const double own[3], double out[3])
{
    for (int r = 0; r < 3; r++) {
        out[r] = s->move[r];
        for (int i = 0; i < 3; i++) out[r] += s->turn[r][i] * own[i] * s->scale;
    }
}

enum fv_field_op fv_primitive_op(const struct fv_node *n)
{
    static const enum fv_field_op op[] = {
        [FV_SHAPE_SPHERE] = FV_FIELD_SPHERE,       [FV_SHAPE_BOX] = FV_FIELD_BOX,
        [FV_SHAPE_ROUND_BOX] = FV_FIELD_BOX,       [FV_SHAPE_CYLINDER] = FV_FIELD_CYLINDER,
        [FV_SHAPE_TORUS] = FV_FIELD_TORUS,         [FV_SHAPE_PLANE] = FV_FIELD_PLANE,
        [FV_SHAPE_CAPSULE] = FV_FIELD_CAPSULE,     [FV_SHAPE_CONE] = FV_FIELD_CONE};
    return op[n->shape];
}

/* Half edges of the box around a primitive about its centre, of the number v of the file. */
static void half_of(const struct fv_node *n, double half[3])
{
    const double *v = n->number;
    switch (n->shape) {
    case FV_SHAPE_SPHERE: half[0] = half[1] = half[2] = v[0]; break;
    case FV_SHAPE_CYLINDER: half[0] = half[2] = v[0], half[1] = v[1] / 2; break;
    case FV_SHAPE_TORUS: half[0] = half[2] = v[0] + v[1], half[1] = v[1]; break;
    case FV_SHAPE_CONE: half[0] = half[2] = fmax(v[0], v[1]), half[1] = v[2] / 2; break;
    default:
        for (int i = 0; i < 3; i++) half[i] = v[i] / 2;
    }
}

static void plane(const struct fv_node *n, const struct fv_space *s, float value[4], struct fv_bound *bound)
{
    const double *v = n->number;
    double length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]), normal[3], height = v[3] * s->scale;
    double low[3] = {-INFINITY, -INFINITY, -INFINITY}, high[3] = {INFINITY, INFINITY, INFINITY};
    for (int r = 0; r < 3; r++) {
        normal[r] = 0;
        for (int i = 0; i < 3; i++) normal[r] += s->turn[r][i] * v[i] / length;
        height += normal[r] * s->move[r];
    }
    for (int r = 0; r < 3; r++) {
        if (normal[r] > 1 - 1e-15) high[r] = height;
        if (normal[r] < -1 + 1e-15) low[r] = -height;
    }
    fv_field_put(value, normal, 3);
    value[3] = (float)height;
    *bound = fv_bound_box(low, high);
}

static void capsule(const struct fv_node *n, const struct fv_space *s, float value[8], struct fv_bound *bound)
{
    const double *v = n->number;
    double end[2][3], way[3], low[3], high[3], r = v[6] * s->scale, d2 = 0;
    fv_space_place(s, v, end[0]);
    fv_space_place(s, v + 3, end[1]);
    for (int i = 0; i < 3; i++) {
        way[i] = end[1][i] - end[0][i];
        d2 += way[i] * way[i];
        low[i] = fmin(end[0][i], end[1][i]) - r;
        high[i] = fmax(end[0][i], end[1][i]) + r;
    }
    fv_field_put(value, end[0], 3);
    fv_field_put(value + 3, way, 3);
    value[6] = (float)(1 / d2);
    value[7] = (float)r;
    *bound = fv_bound_box(low, high);
}

static void sizes(const struct fv_node *n, double k, float *value)
{
    const double *v = n->number;
    switch (n->shape) {
    case FV_SHAPE_BOX:
    case FV_SHAPE_ROUND_BOX:
        for (int i = 0; i < 3; i++) value[i] = (float)(k * (v[i] / 2 - v[3]));
        value[3] = (float)(k * v[3]);
        break;
    case FV_SHAPE_CYLINDER: value[0] = (float)(k * v[0]), value[1] = (float)(k * v[1] / 2); break;
    case FV_SHAPE_CONE: {
        double slope = v[1] - v[0];
        for (int i = 0; i < 2; i++) value[i] = (float)(k * v[i]);
        value[2] = (float)(k * v[2] / 2);
        value[3] = (float)(1 / (k * k * (slope * slope + v[2] * v[2])));
        break;
    }
    default:
        for (int i = 0; i < 2; i++) value[i] = (float)(k * v[i]);
    }
}

void fv_primitive_put(const struct fv_node *n, const struct fv_space *own, float *value, struct fv_bound *bound)
{
    const double origin[3] = {0};
    double at[3], half[3], low[3], high[3];
    if (n->shape == FV_SHAPE_PLANE) {
        plane(n, own, value, bound);
        return;
    }
    if (n->shape == FV_SHAPE_CAPSULE) {
        capsule(n, own, value, bound);
        return;
    }
    fv_space_place(own, origin, at);
    half_of(n, half);
    for (int i = 0; i < 3; i++) {
        low[i] = at[i] - half[i] * own->scale;
        high[i] = at[i] + half[i] * own->scale;
    }
    fv_field_put(value, at, 3);
    sizes(n, own->scale, value + 3);
    *bound = fv_bound_box(low, high);
    if (n->shape == FV_SHAPE_SPHERE) bound->radius = half[0] * own->scale;
}
