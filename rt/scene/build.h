/* build: collects a scene while it is being read, checks it, and lays it out as scene.h wants.
 *
 * Everything collected lives on the heap until fv_build_finish, which moves it into the arena
 * and frees the rest. Readers check indices and values as they add them; fv_build_finish checks
 * what is common: NaN, absurd sizes, counts. Normals and tangents that a file lacks are made
 * there (area- and angle-weighted vertex normals are not: faces without normals are flat). */
#ifndef FV_SCENE_BUILD_H
#define FV_SCENE_BUILD_H

#include "rt/scene/scene.h"

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { FV_ELEMENTS_MAX = 100000000, FV_SHININESS_MAX = 10000, FV_IOR_MAX = 100 };

struct fv_vertex {
    float position[3];
    float normal[3]; /* any length; 0 0 0 or not finite: none given, the triangle's own is taken */
    float uv[2];
    float bitangent_sign; /* 1 or -1 where the file gives it; 0: from uv, normal maps with y up */
};

struct fv_build; /* opaque */

/* `source` names the file in messages. Never NULL: out of memory ends the program (heap.h). */
struct fv_build *fv_build_create(const char *source);
void fv_build_destroy(struct fv_build *build);

/* Each returns the new element's index. Past FV_ELEMENTS_MAX vertices or triangles nothing more is
 * kept, and fv_build_finish says so. */
uint32_t fv_build_vertex(struct fv_build *build, const struct fv_vertex *vertex);
/* `flags` are set here, from the other fields; shininess, ior and alpha_cutoff are brought into range. */
int fv_build_material(struct fv_build *build, const struct fv_material *material);

/* Adds a texture from 8-bit pixels, `channels` 1 to 4, row by row, colours sRGB-encoded. Sizes
 * that are no powers of two are resampled to the next smaller ones; mip levels are filtered in
 * linear light (ALPHA: coverage at the cutoff is kept from level to level). */
int fv_build_texture(struct fv_build *build, enum fv_texel kind, const uint8_t *pixels, int width,
                     int height, int channels, float alpha_cutoff);

/* Counter-clockwise seen from the front; material as fv_build_material returned it. */
void fv_build_triangle(struct fv_build *build, uint32_t a, uint32_t b, uint32_t c, int material);
/* A sun's direction need not have unit length. -1 where a number is not finite or negative, an area
 * or a direction is none, or there are too many. */
int fv_build_light(struct fv_build *build, const struct fv_light *light, struct fv_error *error);
/* The scene may hold no triangles: it has fields. */
void fv_build_bare(struct fv_build *build);
uint32_t fv_build_vertices(const struct fv_build *build);
/* true: from here on vertices and triangles are only counted. false: room for exactly so many more is taken, and
 * the reader gives them all once more, this time to be kept. Spares large scenes what growing arrays leave over. */
void fv_build_rehearse(struct fv_build *build, bool counting);

/* What moves: fv_build_finish gives it to the scene. At most FV_MOVING_MAX. */
void fv_build_moving(struct fv_build *build, const struct fv_moving *moving, int count);
/* The number of the object that a node of this name (NULL: it has none) is, 0 where it stands still. */
int fv_build_named(const struct fv_build *build, const char *name);
/* From here on all vertices and triangles, still given where they are in the scene, belong to this object, or
 * to what stands still: 0. `origin_m` (NULL: 0) is the object's own origin there, where it is the first part of
 * it. Returns the object before, which goes on where the part ends. -1 with the error set where the origin
 * cannot be one. */
int fv_build_object(struct fv_build *build, int object, const double origin_m[3], struct fv_error *error);
/* The first of what moves that no part of the file was, NULL where there is none. */
const struct fv_moving *fv_build_missing(const struct fv_build *build);

/* A material that is grey, matt and has no textures. */
struct fv_material fv_material_default(void);

/* Checks, lays out, and fills `scene` (geometry, materials, textures, lights, features, bounds).
 * Degenerate triangles are dropped and counted in a message. The build is destroyed either way. */
int fv_build_finish(struct fv_build *build, struct fv_scene *scene, struct fv_error *error);

/* The readers. `scale` turns the file's units into metres. */
int fv_gltf_read(struct fv_build *build, const char *path, double scale, struct fv_error *error);
int fv_obj_read(struct fv_build *build, const char *path, double scale, struct fv_error *error);
/* name: "atrium", "cornell", "forest" or "pipes"; -1 where it is another. detail: more than 0; factor on the number of
 * pipes, of the forest's twigs and ferns; the other scenes have none. */
int fv_builtin_read(struct fv_build *build, const char *name, double detail, struct fv_error *error);

/* image.c: decodes PNG or JPEG bytes to 8-bit pixels (malloc'ed, the caller frees). `where` names
 * it in messages. Sizes over 8192 are refused before they are decoded. */
int fv_image_decode(const uint8_t *bytes, size_t size, const char *where, uint8_t **pixels, int *width,
                    int *height, int *channels, struct fv_error *error);

#ifdef __cplusplus
}
#endif

#endif
