/* builtin_forest: a wood at dusk lit by many small lamps, for what path tracing with few samples finds hard: 80 point lights, and
 * leaves cut out of cards by their coverage. Of the character of the Forest scene of Peres et al. 2023 (190,000 triangles, 80
 * point lights).
 *
 * 70 x 70 m of ground about the origin, flat (y = 0) along a path that winds along z, hilly beside it, rising towards the rim.
 * builtin_forest.c has materials, ground and lamps, builtin_forest_trees.c what grows. */
#ifndef FV_SCENE_BUILTIN_FOREST_H
#define FV_SCENE_BUILTIN_FOREST_H

#include "rt/scene/builtin_shapes.h"

enum fv_forest_material {
    FV_FOREST_GROUND,
    FV_FOREST_PATH,
    FV_FOREST_BARK,
    FV_FOREST_BIRCH,
    FV_FOREST_LEAVES,
    FV_FOREST_LEAVES_PALE,
    FV_FOREST_FERN,
    FV_FOREST_STONE,
    FV_FOREST_POST,
    FV_FOREST_LAMP,
    FV_FOREST_GLOW,
    FV_FOREST_MATERIALS
};

enum { FV_FOREST_LIGHTS = 80 };
#define FV_FOREST_HALF 35.0f /* of the ground's side, m */
#define FV_FOREST_CLEAR 1.5f /* half the path's width, m */

struct fv_forest {
    struct fv_brush brush[FV_FOREST_MATERIALS];
    float detail; /* factor on the number of twigs and ferns */
};

int fv_forest_read(struct fv_build *build, double detail, struct fv_error *error);

/* Where the middle of the path is, and how high the ground lies, m. */
float fv_forest_path_x(float z);
float fv_forest_height(float x, float z);

/* Trees, bushes and ferns. */
void fv_forest_grow(const struct fv_forest *forest);

#endif
