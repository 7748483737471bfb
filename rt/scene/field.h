/* field: signed distance fields as scene content: solids made of primitives and operations, as small programs
 * that the tracer evaluates for a packet of points at a time (rt/trace/field_eval.h).
 *
 * A solid's field is negative inside; outside it is never more than the distance to the solid, whatever the
 * solid is made of: what stretches space (twist, displace, noise) is divided by its Lipschitz constant where it
 * is applied, and what is repeated is bounded by the cells next to a point. So a ball of the field's value
 * around a point is empty. The union of all parts is the scene's.
 *
 * Files: field_parse.c reads the text into nodes, field_compile.c turns these into parts. The language stands
 * in README, "Fields". */
#ifndef FV_SCENE_FIELD_H
#define FV_SCENE_FIELD_H

#include "platform/error.h"

#include <assert.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum {
    FV_FIELD_PARTS_MAX = 256,
    FV_FIELD_CODES_MAX = 4096,
    FV_FIELD_REGISTERS = 8,   /* points, and distances, that a part holds at once */
    FV_FIELD_LANES = 16       /* arrays of parts are padded to this */
};

/* Sizes, places and their sums lie within this of 0 (m); sizes are at least the other. */
#define FV_FIELD_LARGEST 1e7
#define FV_FIELD_SMALLEST 1e-5

/* The hit threshold of every ray: metres a metre of its way, and where it starts. */
#define FV_FIELD_HIT 1e-4f

/* Register machine: P and D are the registers of points and distances, p is P[point], v the values. */
enum fv_field_op {
    /* D[to] = distance of p */
    FV_FIELD_SPHERE,   /* centre, radius */
    FV_FIELD_BOX,      /* centre, half edges without the rounding, rounding */
    FV_FIELD_CYLINDER, /* centre, radius, half height; about y, as all that turns about an axis */
    FV_FIELD_TORUS,    /* centre, both radii */
    FV_FIELD_PLANE,    /* unit normal, height: solid below */
    FV_FIELD_CAPSULE,  /* end, way to the other end, its inverse squared length, radius */
    FV_FIELD_CONE,     /* centre, radius below and above, half height, 1 / squared length of the slope */
    /* P[to] = of p */
    FV_FIELD_RIGID,    /* three rows of a rotation and what is added */
    FV_FIELD_MIRROR,   /* centre, three masks of bits that stay */
    FV_FIELD_REPEAT,   /* centre, periods, inverse periods, lowest and highest cell; FV_FIELD_DATA follows: D[from]
                        * = distance to the next cell's content: half period and gap along each axis */
    FV_FIELD_DATA,
    FV_FIELD_TWIST,    /* centre, turns a metre */
    /* D[to] = of D[to] and D[from] */
    FV_FIELD_UNION,
    FV_FIELD_INTERSECT,
    FV_FIELD_SUBTRACT,
    FV_FIELD_SMOOTH,   /* width, its inverse */
    /* D[to] = of D[to] and p */
    FV_FIELD_NEXT_CELL, /* centre and half edges of a box around all cells; D[to] as FV_FIELD_REPEAT left it, D[from]:
                         * of what is in the point's own cell */
    FV_FIELD_UNTWIST,   /* centre and half edges of a box around it all; axis x z, radians a metre, radius */
    FV_FIELD_DISPLACE,  /* place, turns a metre, amplitude, the most there is, 1 / Lipschitz, distance beyond which
                         * the most there is stands for it */
    FV_FIELD_NOISE,     /* the same with cells a metre, then gain and octaves */
    FV_FIELD_OPS
};

struct fv_field_code {
    uint8_t op, to, from, point;
    float value[15];
};
static_assert(sizeof(struct fv_field_code) == 64, "one cache line");

/* A solid, or one of those that it is the plain union of. */
struct fv_field_part {
    int32_t first, count; /* its codes; the result is D[0], the point it is asked for P[0] */
    int32_t material;     /* of the scene */
    float checker_size;   /* m, 0: none; squares in x and z, of the material's diffuse and this colour in turn */
    float checker[3];
    float lipschitz;      /* that its field was divided by, the greatest on any branch */
    float low[3], high[3]; /* box around it, infinite where it is unbounded */
    bool convex;           /* solid and field: what leaves its surface never comes back to it */
};

/* Read-only once loaded, in the arena. */
struct fv_fields {
    int parts, codes;
    const struct fv_field_part *part;
    const struct fv_field_code *code;
    /* Balls around the parts, padded by such as nothing meets (radius -inf): centre, radius; inf: unbounded. */
    const float *x, *y, *z, *radius;
};

struct fv_build;

/* Reads the text (`size` bytes, `source` names it in messages) and puts the fields into the arena and their
 * materials into the build. Lengths are multiplied by `scale`. At least one solid. Returns 0, or -1 with the error
 * set ("source:line: what is wrong, what would be right"). */
int fv_fields_read(struct fv_fields *fields, struct fv_build *build, const char *text, size_t size,
                   const char *source, double scale, struct fv_error *error);

/* The arena's bytes of them. */
int64_t fv_fields_bytes(const struct fv_fields *fields);

#endif
