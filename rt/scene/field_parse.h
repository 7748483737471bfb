/* field_parse: the text of a field file as nodes. Between field_parse.c and field_compile.c only. */
#ifndef FV_SCENE_FIELD_PARSE_H
#define FV_SCENE_FIELD_PARSE_H

#include "rt/scene/field.h"
#include "rt/scene/scene.h"

enum { FV_NODES_MAX = 4096, FV_SOLIDS_MAX = 256, FV_NAMED_MAX = 256, FV_WORD_MAX = 48, FV_DEPTH_MAX = 32, FV_NUMBERS_MAX = 7 };

enum fv_shape {
    FV_SHAPE_SPHERE,
    FV_SHAPE_BOX,
    FV_SHAPE_ROUND_BOX,
    FV_SHAPE_CYLINDER,
    FV_SHAPE_TORUS,
    FV_SHAPE_PLANE,
    FV_SHAPE_CAPSULE,
    FV_SHAPE_CONE,
    FV_SHAPE_UNION,
    FV_SHAPE_INTERSECTION,
    FV_SHAPE_DIFFERENCE,
    FV_SHAPE_SMOOTH_UNION,
    FV_SHAPE_TRANSLATE,
    FV_SHAPE_ROTATE,
    FV_SHAPE_SCALE,
    FV_SHAPE_REPEAT,
    FV_SHAPE_MIRROR,
    FV_SHAPE_TWIST,
    FV_SHAPE_DISPLACE,
    FV_SHAPE_NOISE,
    FV_SHAPES
};

struct fv_node {
    enum fv_shape shape;
    int line, depth;   /* depth: of the tree below, 1 for a primitive */
    int first, count;  /* its parts: child[first ..], indices of nodes that stand before this one */
    double number[FV_NUMBERS_MAX];
};

struct fv_field_material {
    char name[FV_WORD_MAX];
    struct fv_material material;
    double checker[3], checker_size;
};

struct fv_field_text {
    const char *source;
    struct fv_node node[FV_NODES_MAX];
    int nodes, child[FV_NODES_MAX], children;
    struct {
        char name[FV_WORD_MAX];
        int node;
    } named[FV_NAMED_MAX];
    int names;
    struct fv_field_material material[FV_SOLIDS_MAX];
    int materials;
    struct {
        int node, material, line;
    } solid[FV_SOLIDS_MAX];
    int solids;
};

/* How a shape is written: its name, and how many numbers and shapes are in its parentheses. */
struct fv_shape_row {
    const char *name;
    int numbers, least, most; /* shapes: least to most */
};
extern const struct fv_shape_row fv_shape_rows[FV_SHAPES];

int fv_field_parse(struct fv_field_text *out, const char *text, size_t size, const char *source,
                   struct fv_error *error);

/* "source:line: " and the message; returns -1. */
int fv_field_refuse(const struct fv_field_text *text, int line, struct fv_error *error, const char *format, ...)
    __attribute__((format(printf, 4, 5)));

/* What is wrong with a node's own numbers, where something is: 0, or -1 with the error set. */
int fv_field_check(const struct fv_field_text *text, const struct fv_node *node, struct fv_error *error);

#endif
