/* builtin_pipes: a process plant of millions of thin pipes, for what foveated methods find hardest: detail
 * far finer than a pixel, everywhere in view. Of the character of the Power Plant scene of Kim et al. 2021.
 *
 * An open steel structure, 72 x 14.4 x 24 m, its long axis along x, ground at y = 0. It is filled by cells
 * of 1.2 m: bundles of pipes find their ways through free cells (builtin_pipes_route.c), so that nothing
 * runs into anything else. An aisle along x stays free on the ground and on two storeys, where its floor is
 * a grating; on the first, two walkways cross it.
 *
 * builtin_pipes.c has materials and the order of work, builtin_pipes_line.c one pipe with its bends, flanges
 * and valves, builtin_pipes_bundle.c what a bundle is made of, builtin_pipes_steel.c structure, floors and
 * railings, builtin_pipes_vessel.c vessels, exchangers and what stands around the structure. */
#ifndef FV_SCENE_BUILTIN_PIPES_H
#define FV_SCENE_BUILTIN_PIPES_H

#include "rt/scene/builtin_shapes.h"

enum fv_pipes_material {
    /* Of pipes. */
    FV_PIPES_GALVANISED,
    FV_PIPES_CLADDING,
    FV_PIPES_INSULATION,
    FV_PIPES_CREAM,
    FV_PIPES_RED,
    FV_PIPES_ORANGE,
    FV_PIPES_YELLOW,
    FV_PIPES_GREEN,
    FV_PIPES_TEAL,
    FV_PIPES_BLUE,
    FV_PIPES_VIOLET,
    FV_PIPES_BROWN,
    FV_PIPES_RUST,
    FV_PIPES_BLACK,
    FV_PIPES_STAINLESS, /* mirrors a little */
    FV_PIPES_COPPER,    /* the same */
    FV_PIPES_PAINTS,
    /* Of all else. */
    FV_PIPES_STEEL = FV_PIPES_PAINTS,
    FV_PIPES_RACK,
    FV_PIPES_BOLTS,
    FV_PIPES_WHEELS,
    FV_PIPES_GRATING,
    FV_PIPES_RAILING,
    FV_PIPES_VESSEL,
    FV_PIPES_POLISHED, /* vessels that mirror */
    FV_PIPES_TANK,
    FV_PIPES_CONCRETE,
    FV_PIPES_SLAB, /* of the ground, lighter and darker ones in turn */
    FV_PIPES_SLAB_DARK,
    FV_PIPES_GRAVEL,
    FV_PIPES_LAMP,
    FV_PIPES_MATERIALS
};

#define FV_PIPES_CELL 1.2f
#define FV_PIPES_PIPE_MAX 0.42f /* how far from a bundle's middle its outermost pipes lie, m */
enum {
    FV_PIPES_NX = 60,
    FV_PIPES_NY = 12,
    FV_PIPES_NZ = 20,
    FV_PIPES_STOREY = 4, /* cells */
    FV_PIPES_STOREYS = 3,
    FV_PIPES_BAY = 5,        /* cells from column to column */
    FV_PIPES_BAY_COLUMN = 2, /* which of them holds the column */
    FV_PIPES_AISLE = 9,      /* the first of its two cells across z */
    FV_PIPES_LEGS_MAX = 24
};

/* What a cell holds; from FV_PIPES_BUNDLE on the number of a bundle. */
enum { FV_PIPES_FREE, FV_PIPES_STRUCTURE, FV_PIPES_WALKWAY, FV_PIPES_EQUIPMENT, FV_PIPES_BUNDLE };

struct fv_pipes {
    struct fv_brush brush[FV_PIPES_MATERIALS];
    float detail;
    uint16_t cell[FV_PIPES_NX][FV_PIPES_NY][FV_PIPES_NZ];
};

/* A way through cells: from corner[0] in straight legs to corner[legs], each at right angles to the next. */
struct fv_pipes_route {
    int legs;
    int corner[FV_PIPES_LEGS_MAX + 1][3];
};

int fv_pipes_read(struct fv_build *build, double detail, struct fv_error *error);

/* The middle of a cell, m. */
vec3s fv_pipes_middle(const int cell[3]);

/* What the cell holds; FV_PIPES_STRUCTURE outside. */
int fv_pipes_at(const struct fv_pipes *pipes, int x, int y, int z);
bool fv_pipes_all_free(const struct fv_pipes *pipes, const int low[3], const int cells[3]);
void fv_pipes_claim(struct fv_pipes *pipes, const int low[3], const int cells[3], int what);

/* Finds a way and claims its cells for bundle number `bundle`. False where none was long enough. */
bool fv_pipes_find_route(struct fv_pipes *pipes, int bundle, uint32_t *random, struct fv_pipes_route *route);

/* All pipes of the bundle that takes this way, and the racks that carry them. */
void fv_pipes_lay_bundle(const struct fv_pipes *pipes, const struct fv_pipes_route *route, uint32_t *random);

/* Marks the cells that columns, beams, walkways and ladders need, before anything is routed. */
void fv_pipes_reserve(struct fv_pipes *pipes);
/* Builds what was reserved, and gratings wherever no pipe goes through a storey's floor. */
void fv_pipes_erect(const struct fv_pipes *pipes);

/* Finds room for vessels and exchangers, and builds them. */
void fv_pipes_equip(struct fv_pipes *pipes);
/* Ground, tanks, chimneys and a cooling tower around the structure. */
void fv_pipes_surround(const struct fv_pipes *pipes);

/* A brush whose y axis goes along the unit vector `axis` from `origin`. */
struct fv_brush fv_pipes_along(const struct fv_brush *brush, vec3s origin, vec3s axis);

/* A ladder with its foot at the brush's origin, climbed looking along -z, with a cage from 2.2 m on. */
void fv_pipes_ladder(const struct fv_brush *brush, float height);
/* Posts, two rails and a toe plate from `from` to `to`, 1.1 m high. */
void fv_pipes_railing(const struct fv_brush *brush, vec3s from, vec3s to);

/* One pipe: a polyline of right angles with rounded bends. */
enum { FV_PIPES_KNOTS_MAX = FV_PIPES_LEGS_MAX + 1 };
struct fv_pipes_line {
    const struct fv_brush *paint, *bolts, *wheels;
    float radius;
    int legs;
    vec3s knot[FV_PIPES_KNOTS_MAX]; /* legs + 1 */
    vec3s x[FV_PIPES_KNOTS_MAX];    /* of each leg: unit vectors at right angles to it, x cross y along it, */
    vec3s y[FV_PIPES_KNOTS_MAX];    /* turned with the bends */
    vec3s outwards[FV_PIPES_KNOTS_MAX]; /* of each leg: where a valve's wheel has room, 0 0 0 where nowhere */
};

/* The pipe, closed at both ends; its flanges, couplings, bands and valves follow from `random`. */
void fv_pipes_lay_line(const struct fv_pipes_line *line, uint32_t *random);

#endif
