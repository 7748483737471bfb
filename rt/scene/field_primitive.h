/* field_primitive: the primitives of field files. Between field_compile.c and field_primitive.c only. */
#ifndef FV_SCENE_FIELD_PRIMITIVE_H
#define FV_SCENE_FIELD_PRIMITIVE_H

#include "rt/scene/field_bound.h"
#include "rt/scene/field_parse.h"

/* Where a node's own space lies in that of the point register: point = turn * own * scale + move. */
struct fv_space {
    double turn[3][3], move[3], scale;
    bool turned;
    int point; /* register */
};

/* From the node's own space to the register's. */
void fv_space_place(const struct fv_space *space, const double own[3], double out[3]);

void fv_field_put(float *value, const double *v, int count);

/* What evaluates a primitive. */
enum fv_field_op fv_primitive_op(const struct fv_node *node);

/* Its numbers, in a space whose axes are the register's (any, for spheres, planes and capsules), and what it lies
 * within. */
void fv_primitive_put(const struct fv_node *node, const struct fv_space *space, float *value, struct fv_bound *bound);

#endif
