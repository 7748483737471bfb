/* field_check: what numbers the shapes of a field file may have. */
#include "rt/scene/field_parse.h"

#include <math.h>

/* Lengths of a shape, which must be positive: the first so many of its numbers, from `from` on. */
static const struct {
    int from, count;
} lengths[FV_SHAPES] = {
    [FV_SHAPE_SPHERE] = {0, 1},   [FV_SHAPE_BOX] = {0, 3},          [FV_SHAPE_ROUND_BOX] = {0, 4},
    [FV_SHAPE_CYLINDER] = {0, 2}, [FV_SHAPE_TORUS] = {0, 2},        [FV_SHAPE_CAPSULE] = {6, 1},
    [FV_SHAPE_CONE] = {2, 1},     [FV_SHAPE_SMOOTH_UNION] = {0, 1}, [FV_SHAPE_SCALE] = {0, 1},
    [FV_SHAPE_DISPLACE] = {0, 2}, [FV_SHAPE_NOISE] = {0, 2},
};

/* What else must hold; NULL where all does. */
static const char *wrong(const struct fv_node *n)
{
    const double *v = n->number;
    switch (n->shape) {
    case FV_SHAPE_ROUND_BOX:
        return 2 * v[3] > fmin(v[0], fmin(v[1], v[2])) ? "the rounding is more than half an edge" : NULL;
    case FV_SHAPE_TORUS: return v[1] > v[0] ? "the tube's radius is more than the ring's" : NULL;
    case FV_SHAPE_PLANE:
        return v[0] * v[0] + v[1] * v[1] + v[2] * v[2] < 1e-12 ? "the normal has no length" : NULL;
    case FV_SHAPE_CAPSULE:
        return hypot(v[0] - v[3], hypot(v[1] - v[4], v[2] - v[5])) < FV_FIELD_SMALLEST ? "its ends are one point: take a sphere" : NULL;
    case FV_SHAPE_CONE:
        return !(v[0] >= 0 && v[1] >= 0 && v[0] + v[1] >= FV_FIELD_SMALLEST) ? "radii must be 0 or more, one of them more" : NULL;
    case FV_SHAPE_REPEAT:
        for (int i = 0; i < 3; i++) {
            if (v[i] != 0 && !(v[i] >= FV_FIELD_SMALLEST)) return "periods must be 0 (not repeated) or 0.00001 and more";
            if (v[3 + i] != floor(v[3 + i]) || v[3 + i] < 0 || v[3 + i] > 1e6)
                return "counts must be whole numbers from 0 (endless) to 1000000";
        }
        return v[0] == 0 && v[1] == 0 && v[2] == 0 ? "it has no period" : NULL;
    case FV_SHAPE_MIRROR:
        for (int i = 0; i < 3; i++)
            if (v[i] != 0 && v[i] != 1) return "numbers must be 1 (mirrored along x, y, z) or 0";
        return NULL;
    case FV_SHAPE_NOISE:
        return !(v[2] > 0 && v[2] <= 1) ? "the gain must be more than 0 and at most 1"
               : v[3] != floor(v[3]) || v[3] < 1 || v[3] > 8 ? "octaves must be 1 to 8"
                                                             : NULL;
    default: return NULL;
    }
}

int fv_field_check(const struct fv_field_text *text, const struct fv_node *n, struct fv_error *error)
{
    const char *name = fv_shape_rows[n->shape].name;
    for (int i = 0; i < lengths[n->shape].count; i++) {
        double v = n->number[lengths[n->shape].from + i];
        if (!(v >= FV_FIELD_SMALLEST))
            return fv_field_refuse(text, n->line, error, "%s: %g: must be %g or more", name, v, FV_FIELD_SMALLEST);
    }
    const char *why = wrong(n);
    return why ? fv_field_refuse(text, n->line, error, "%s: %s", name, why) : 0;
}
