/* visibility: maps of what each light reaches, so that shadows where the eye does not look take a lookup
 * instead of a ray (Kim, Ko and Ihm 2021, section 4.2): of each point light and sun that stands still, the
 * nearest of what stands still. Neither ever changes, so that a map is made once; of what moves, rays tell
 * (visible.h). A light that moves has none, as in the paper's section 6, nor has any light of a scene with
 * fields.
 *
 * A point's map is a cube of six faces around it, a sun's one face across the bounds. A face is side x side
 * texels with a node at each corner, side + 1 rows of as many: faces of a cube share the nodes along their
 * edges. A node holds how near to the light its ray's first hit is, as a number that is linear across the
 * face for all points of a plane: of a point 1 / z (1/m), z along the face's axis, 0 where nothing is; of a
 * sun the place along the way to it (m), FV_SUN_NOTHING where nothing is. Masked texels are there or not as to a
 * ray cone as wide as the map's texels.
 *
 * What is thinner than a texel is met by as many nodes' rays as chance has it, and missed by the others: there
 * a map is wrong on as many of the surfaces behind. It shows where it is so: a node that is met alone is nearer
 * to the light than those on either side of it in its row or column, by more than two texels' widths, and one
 * that alone goes through is farther. A slanted or bent surface and the edge of what is wider go one way. Where
 * more than one in 10 nodes of a block of 32 x 32 stand out so, all of the block's say so in their last bit, and
 * shadows there are taken from rays: nearly everywhere in a plant of pipes, at a few leaves in a hall. */
#ifndef FV_TRACE_VISIBILITY_H
#define FV_TRACE_VISIBILITY_H

#include "platform/threads.h"
#include "rt/scene/scene.h"

struct fv_tracer;

enum { FV_CUBE_FACES = 6, FV_MAP_SIDE_MAX = 4096 };

/* Bit of a node's word: around it the map is too coarse. Worth next to nothing in its number. */
enum { FV_NODE_COARSE = 1 };

/* How near to a sun nothing is, m: farther than everything, and no number that a last bit makes none. */
#define FV_SUN_NOTHING -0x1p100f

struct fv_light_map {
    const float *nearness; /* of the nodes, face by face, row by row; NULL: shadow rays */
    int side, faces;       /* faces: FV_CUBE_FACES of a point, in the order +x -x +y -y +z -z; 1 of a sun */
    float at[3];           /* of a point; of a sun, towards it: unit */
    float across[3], along[3]; /* of a sun: unit vectors along rows and columns, both across `at` */
    /* First node and a texel's width and height: of a sun in m, of a point at z = 1. */
    float corner[2], texel[2];
    float coarse; /* share of the map's blocks whose nodes say FV_NODE_COARSE, in [0, 1] */
    float begin; /* m: where rays begin: so far from a point, at this place along the way to a sun */
};

struct fv_visibility {
    int side;                  /* texels, 0: not made yet */
    struct fv_light_map map[]; /* of each light of the scene */
};

/* Whether a scene's light can have a map: a point or sun that stands still, in a scene with triangles that
 * stand still and without fields; a point no farther from the middle of their bounds than twice the
 * bounds' diagonal, since texels grow with the distance. */
bool fv_light_mappable(const struct fv_scene *scene, int light);

/* Of all the scene's maps. */
int64_t fv_visibility_bytes(const struct fv_scene *scene, int side);

/* Of that tracer's scene, from the arena, without maps; NULL where no light can have one. */
struct fv_visibility *fv_visibility_take(const struct fv_scene *scene);

/* Traces one row of nodes: fv_kernels' `map_row`. */
typedef void fv_map_row(const struct fv_tracer *tracer, const struct fv_light_map *map, int face, int row,
                        float *nearness);

/* Makes the maps of tracer->visibility, from the arena, on all workers; `side` 1 to FV_MAP_SIDE_MAX, those of
 * this side are kept where they are there already. Prints a progress line, and one on what was made. Not while frames are rendered. */
void fv_visibility_make(const struct fv_tracer *tracer, int side, fv_map_row *row,
                        struct fv_workers *workers);

#endif
