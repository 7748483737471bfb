/* scene: what is rendered, laid out for the tracer: read-only once loaded.
 *
 * Positions are metres in float, world space, y up. Colours and radiances are linear RGB.
 * Made by build.h from what gltf.c, obj.cpp or builtin.c put in. */
#ifndef FV_SCENE_SCENE_H
#define FV_SCENE_SCENE_H

#include "rt/scene/field.h"
#include "rt/scene/moving.h"

#include <assert.h>
#include <stdbool.h>
#include <stdint.h>

enum {
    FV_TEXTURE_LEVELS = 16, /* sizes to 8192 need 14; 16 offsets are one vector */
    FV_MATERIALS_MAX = 65535,
    FV_LIGHTS_MAX = 256
};

/* A mip-mapped texture; width and height are powers of two, coordinates wrap. Level l is
 * max(1, height >> l) rows of max(1, width >> l) texels at texel + offset[l], the first row at v = 0
 * (glTF's way: v grows downwards in the picture). Behind each row its first texel stands once more, so
 * that two neighbours are always one 8-byte load: rows are one texel longer than the level is wide.
 * All textures of a scene share one array of texels, so that one fetch serves several of them. */
struct fv_texture {
    int width, height, levels;
    uint32_t offset[FV_TEXTURE_LEVELS];
    const uint32_t *texel; /* see enum fv_texel */
};

/* What the 32 bits of a texel hold. */
enum fv_texel {
    FV_TEXEL_COLOUR, /* 10:10:10 from bit 0: r, g, b as square roots of linear values in [0, 1] */
    FV_TEXEL_NORMAL, /* 10:10:10 from bit 0: tangent-space x, y, z, 0..1023 for -1..1 (511.5 is 0) */
    FV_TEXEL_ALPHA   /* 8 bits from bit 0: coverage 0..255 */
};

enum fv_material_flags {
    FV_MATERIAL_TEXTURED = 1,      /* base_texture */
    FV_MATERIAL_NORMAL_MAPPED = 2, /* normal_texture */
    FV_MATERIAL_MASKED = 4,        /* alpha_texture and alpha_cutoff: tested inside traversal */
    FV_MATERIAL_SPECULAR = 8,      /* Phong lobe */
    FV_MATERIAL_MIRROR = 16,       /* Whitted reflection by `mirror` */
    FV_MATERIAL_GLASS = 32,        /* Whitted refraction by `transmission`, Fresnel reflection */
    FV_MATERIAL_EMISSIVE = 64
};

/* The shading model: Phong (normalised), plus Whitted reflection and refraction. */
struct fv_material {
    float diffuse[3];      /* albedo, multiplied with the base texture */
    float specular[3];     /* Phong reflectance */
    float shininess;       /* Phong exponent, 1 to 10000 */
    float mirror[3];       /* colour of the reflected ray's weight */
    float transmission[3]; /* colour of the refracted ray's weight */
    float ior;             /* refractive index, 1 to 100 */
    float emission[3];     /* radiance */
    float alpha_cutoff;    /* coverage below which a masked texel is not there, 0..1 */
    float normal_scale;
    uint32_t flags;        /* enum fv_material_flags */
    int32_t base_texture, normal_texture, alpha_texture; /* -1: none */
};

/* All that shading needs of a triangle, in one cache line. Normals are 16-bit signed, 32767 for 1. */
struct fv_triangle {
    float uv[3][2];
    int16_t normal[3][3]; /* of the corners, unit length, 0 0 0 never occurs */
    uint16_t material;
    int16_t tangent[3]; /* unit vector along growing u, for normal maps */
    int16_t bitangent_sign; /* 1 or -1: bitangent = sign * normal x tangent */
    float uv_per_metre; /* sqrt(area in uv / area in the world): times the texture's size gives texels a metre */
    float slack; /* m: how far off its plane rounding may put a hit, from its shape and size */
    uint32_t reserved;
};
static_assert(sizeof(struct fv_triangle) == 64, "one cache line");

enum fv_light_kind { FV_LIGHT_POINT, FV_LIGHT_AREA, FV_LIGHT_SUN };

struct fv_light {
    enum fv_light_kind kind;
    float position[3]; /* point: place; area: corner; sun: unit vector towards it */
    float u[3], v[3];  /* area: edges; shines to the side of u x v */
    float colour[3];   /* point: radiant intensity W/sr; area: radiance; sun: irradiance */
};

/* What a scene holds, so that a plan can leave out the rest. */
enum fv_scene_features {
    FV_SCENE_TEXTURES = 1,
    FV_SCENE_NORMAL_MAPS = 2,
    FV_SCENE_ALPHA = 4,
    FV_SCENE_SPECULAR = 8,
    FV_SCENE_MIRRORS = 16,
    FV_SCENE_GLASS = 32,
    FV_SCENE_EMISSIVE = 64,
    FV_SCENE_POINT_LIGHTS = 128,
    FV_SCENE_AREA_LIGHTS = 256,
    FV_SCENE_SUN = 512,
    FV_SCENE_MOVING = 1024,
    FV_SCENE_FIELDS = 4096, /* solids given by distances (field.h) */
    FV_SCENE_MIXED = 8192,  /* beside triangles */
    FV_SCENE_AO = 2048 /* ambient light, which near surfaces take away: asked for by method.ao_spp */
};

/* Features whose light is sampled by random rays. */
#define FV_SCENE_STOCHASTIC (FV_SCENE_AREA_LIGHTS | FV_SCENE_AO)

/* What moves. Its vertices are in its own space, which scene.moving's row leads from; its number, in pictures
 * and poses, is that of its place in the scene's list, from 1. */
struct fv_object {
    struct fv_moving moving;
    int64_t first, triangles, opaque_triangles; /* its triangle records, the opaque ones first */
    float centre[3], radius;                    /* of a ball around it, in its own space */
    int light;                                  /* the scene's light that it is, -1: none */
};

struct fv_scene {
    char name[64];
    uint32_t features; /* enum fv_scene_features */
    /* Triangles: first those of what stands still (still_triangles), the opaque ones (opaque_triangles) before
     * the masked ones; then those of each object. Triangle t has the corners index[3t .. 3t+2] into position
     * (3 floats a vertex, 16 readable bytes behind the last). */
    int64_t triangles, still_triangles, opaque_triangles, vertices;
    const float *position;
    const uint32_t *index;
    const struct fv_triangle *triangle;
    int materials, textures, lights;
    const struct fv_material *material;
    const struct fv_texture *texture;
    const uint32_t *texel; /* every texture's `texel` */
    struct fv_light light[FV_LIGHTS_MAX];
    float ambient[3], sky[3], exposure;
    float bounds[2][3]; /* smallest and largest corner of what stands still */
    struct fv_fields fields;
    int objects;
    struct fv_object object[FV_MOVING_MAX];
};

/* Loads the scene that the settings name, into the arena. Returns 0, or -1 with the error set
 * ("file: what is wrong, what would be right"). Prints a progress line. */
int fv_scene_load(struct fv_scene *scene, const struct fv_config *config, struct fv_error *error);

/* Whether the scene's file is where the settings say, without reading it: 0, or -1 with the error set. */
int fv_scene_find(const struct fv_config *config, struct fv_error *error);

#endif
