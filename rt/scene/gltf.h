/* gltf: what the three files of the glTF 2.0 reader share: gltf.c walks the nodes and reads meshes
 * and lights, gltf_material.c turns materials into ours, gltf_data.c opens the container and gives
 * checked access to JSON values, buffers and accessors.
 *
 * The first error sticks in `failed`; later ones are dropped, so that a few values may be read
 * before it is looked at. Section numbers in comments are those of the glTF 2.0 specification. */
#ifndef FV_SCENE_GLTF_H
#define FV_SCENE_GLTF_H

#include "rt/scene/build.h"

#include <jansson.h>

struct gltf_bytes {
    const uint8_t *data; /* NULL: not loaded yet */
    size_t size;
    char *owned; /* to be freed, or NULL */
};

/* What became of a picture: indices of textures in the build, -1 where not made yet. */
struct gltf_picture {
    int colour, normal, alpha;
    float alpha_cutoff;            /* that `alpha` was made for */
    bool decoded;                  /* the rest is known */
    uint8_t least_alpha;           /* 255 where there is no alpha channel */
    float mean[3], mean_linear[3]; /* of the bytes as they are, 0..1, and of colours in linear light */
};

struct gltf_material {
    int index;      /* in the build, -1 while not made yet */
    bool hidden;    /* below its alpha cutoff everywhere: triangles are left out */
    int uv_set;     /* n of TEXCOORD_n */
    float uv[2][3]; /* rows: texture coordinates become uv * (u, v, 1) (KHR_texture_transform) */
};

struct gltf {
    struct fv_build *build;
    const char *path;   /* in messages */
    const char *folder; /* of files it refers to; NULL: they are refused */
    float scale;
    json_t *root;
    struct gltf_bytes binary; /* of a .glb */
    struct gltf_bytes *buffer;
    struct gltf_picture *picture;
    struct gltf_material *material; /* one more than the file has: the last is the default */
    bool *node_seen;
    size_t buffers, pictures, materials, nodes;
    uint64_t elements; /* vertices and indices read so far */
    char place[64];    /* what is being read: "accessors[3]" */
    bool failed;
    struct fv_error *error;
};

struct gltf_accessor {
    const uint8_t *data;
    uint64_t count, stride;
    int component; /* glTF's componentType */
    int components;
    bool normalised;
};

/* As fv_gltf_read, from memory; `path` is for messages. `folder` holds the files it refers to, NULL
 * refuses these. */
int fv_gltf_read_memory(struct fv_build *build, const uint8_t *bytes, size_t size, const char *path,
                        const char *folder, double scale, struct fv_error *error);

/* gltf_data.c. Functions that return int: 0, or -1 with the error set. */

int gltf_fail(struct gltf *g, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* Parses .gltf or .glb into g->root and g->binary; checks version and required extensions. */
int gltf_open(struct gltf *g, const uint8_t *bytes, size_t size);
void gltf_close(struct gltf *g);

/* Number of elements of a top-level array, 0 where there is none. */
size_t gltf_count(struct gltf *g, const char *array);
/* One of these; NULL with the error set where it is not there or no object. Notes the place. */
const json_t *gltf_element(struct gltf *g, const char *array, int64_t index);

/* Members of an object (NULL: has none); where absent, `otherwise`, NULL or out unchanged. */
double gltf_number(struct gltf *g, const json_t *object, const char *key, double otherwise, double min,
                   double max);
int64_t gltf_integer(struct gltf *g, const json_t *object, const char *key, int64_t otherwise);
const char *gltf_text(struct gltf *g, const json_t *object, const char *key);
const json_t *gltf_object(struct gltf *g, const json_t *object, const char *key);
const json_t *gltf_list(struct gltf *g, const json_t *object, const char *key);
void gltf_numbers(struct gltf *g, const json_t *object, const char *key, size_t count, float *out);
const json_t *gltf_extension(struct gltf *g, const json_t *object, const char *name);

/* The bytes behind images[index]; to be freed with free(out->owned). */
int gltf_image_bytes(struct gltf *g, int64_t index, struct gltf_bytes *out);

/* Opens an accessor of the given type ("VEC3") and checks that all of it lies in its buffer.
 * `components`: bit n allows componentType 5120 + n. */
enum { GLTF_FLOAT = 1 << 6, GLTF_SMALL = 15, GLTF_UNSIGNED = 1 << 1 | 1 << 3 | 1 << 5 };
int gltf_accessor_open(struct gltf *g, int64_t index, const char *type, unsigned components,
                       struct gltf_accessor *out);
void gltf_accessor_floats(const struct gltf_accessor *a, uint64_t i, float *out);
uint32_t gltf_accessor_index(const struct gltf_accessor *a, uint64_t i);

/* gltf_material.c: materials[index], made when first used; index -1 is the default material. */
const struct gltf_material *gltf_material_use(struct gltf *g, int64_t index);

#endif
