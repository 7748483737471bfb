/* builtin_shapes: the solids that the procedural scenes are put together from.
 *
 * All lengths are metres. A brush says where a shape goes and of what; shapes wind their
 * triangles counter-clockwise as seen from outside and give smooth normals on whatever is
 * curved. Flat faces take their texture coordinates from world space, so that neighbouring
 * faces in one plane continue each other's pattern. */
#ifndef FV_SCENE_BUILTIN_SHAPES_H
#define FV_SCENE_BUILTIN_SHAPES_H

#include "rt/scene/build.h"

#include <cglm/struct.h>

struct fv_brush {
    struct fv_build *build;
    mat4s place; /* shape to world: rotation and translation */
    int material;
    float repeats; /* texture repeats a metre */
};

/* A corner of a profile in the plane, and how the way to the next corner bends: bulge is the
 * tangent of a quarter of the arc's angle, positive for arcs that turn left, 0 for a straight line.
 * The solid lies to the left of the profile: one that goes up has its outside at larger x. */
struct fv_corner {
    float x, y, bulge;
};

/* A surface point for s and t in [0, 1]. The outside is where dp/ds x dp/dt points. */
typedef vec3s fv_surface(const void *context, float s, float t);

static inline vec3s fv_vec(float x, float y, float z)
{
    return (vec3s){{x, y, z}};
}

/* The same brush moved to a place inside its own, turned by `yaw` radians about y. */
struct fv_brush fv_brush_at(const struct fv_brush *brush, float x, float y, float z, float yaw);

/* The same brush with another material. */
struct fv_brush fv_brush_of(const struct fv_brush *brush, int material, float repeats);

/* A parallelogram, outside along u x v. */
void fv_shape_quad(const struct fv_brush *brush, vec3s corner, vec3s u, vec3s v);

/* A parallelogram that shows the whole texture once, its picture upright along v. */
void fv_shape_card(const struct fv_brush *brush, vec3s corner, vec3s u, vec3s v);

/* A box between two opposite corners. */
void fv_shape_box(const struct fv_brush *brush, vec3s low, vec3s high);

/* A curved sheet of columns x rows cells, `width` x `height` metres of texture. */
void fv_shape_sheet(const struct fv_brush *brush, fv_surface *surface, const void *context, int columns,
                    int rows, float width, float height);

/* The profile turned about the y axis, x being the radius. Corners under 40 degrees are smoothed. */
void fv_shape_lathe(const struct fv_brush *brush, const struct fv_corner *profile, int corners, int segments);

/* The profile drawn along a straight line from `from` to `to`; profile x goes along `x`, y along `y`. */
void fv_shape_moulding(const struct fv_brush *brush, const struct fv_corner *profile, int corners, vec3s from,
                       vec3s to, vec3s x, vec3s y);

/* The profile drawn along a half circle in the xy plane about the origin, from +x over +y to -x;
 * profile y is the radius, x goes along +z. */
void fv_shape_archivolt(const struct fv_brush *brush, const struct fv_corner *profile, int corners,
                        int segments);

/* A wall in the xy plane, `width` about x = 0, from y = 0 to `height`, `thickness` about z = 0,
 * with a round arch of `radius` cut out about the origin. Sides and top are left open. */
void fv_shape_arch(const struct fv_brush *brush, float width, float height, float thickness, float radius,
                   int segments);

/* A tube of `segments` sides from a to b, its radius going from ra to rb, open at both ends. */
void fv_shape_tube(const struct fv_brush *brush, vec3s a, vec3s b, float ra, float rb, int segments);

/* A sphere about `centre`. */
void fv_shape_sphere(const struct fv_brush *brush, vec3s centre, float radius, int segments);

#endif
