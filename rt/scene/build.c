/* build: what a reader collects, checked once and laid out for the tracer; see build.h. */
#include "rt/scene/build.h"

#include "platform/arena.h"
#include "platform/log.h"
#include "rt/scene/texture.h"
#include "rt/scene/triangle.h"

#include <assert.h>
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct corners {
    uint32_t vertex[3], material : 26, object : 6;
};

/* A growing array on the heap. */
struct array {
    void *data;
    size_t count, capacity;
};

struct fv_build {
    char source[512];
    struct array vertices;  /* struct fv_vertex */
    struct array triangles; /* struct corners */
    struct array materials; /* struct fv_material */
    struct array textures;  /* struct fv_texture, texels on the heap */
    struct array texels;    /* size_t: their number, for each texture */
    struct fv_light light[FV_LIGHTS_MAX];
    int lights;
    bool too_many;
    bool bare; /* may hold no triangles */
    bool counting;
    size_t kept[2]; /* vertices and triangles before counting began */
    struct fv_moving moving[FV_MOVING_MAX];
    int objects, object;                /* object: whose the next vertices and triangles are */
    bool placed[FV_MOVING_MAX + 1];     /* a part of it was there */
};

enum { NOT_KEPT = (1 << 26) - 1, SLOTS = 2 * (FV_MOVING_MAX + 1) };

static void set_capacity(struct array *a, size_t capacity, size_t size)
{
    if (capacity <= a->capacity) return;
    void *grown = realloc(a->data, capacity * size);
    if (!grown) fv_die(2, "memory: the scene does not fit: %zu bytes asked for", capacity * size);
    a->data = grown;
    a->capacity = capacity;
}

static void *push(struct array *a, size_t size)
{
    if (a->count == a->capacity) set_capacity(a, a->capacity ? a->capacity + a->capacity / 2 : 64, size);
    return (char *)a->data + size * a->count++;
}

struct fv_build *fv_build_create(const char *source)
{
    struct fv_build *b = calloc(1, sizeof *b);
    if (!b) fv_die(2, "memory: no room to read %s", source);
    snprintf(b->source, sizeof b->source, "%s", source);
    return b;
}

void fv_build_destroy(struct fv_build *b)
{
    if (!b) return;
    struct fv_texture *texture = b->textures.data;
    for (size_t i = 0; i < b->textures.count; i++) free((void *)texture[i].texel);
    free(b->vertices.data);
    free(b->triangles.data);
    free(b->materials.data);
    free(b->textures.data);
    free(b->texels.data);
    free(b);
}

uint32_t fv_build_vertex(struct fv_build *b, const struct fv_vertex *vertex)
{
    if (b->vertices.count == FV_ELEMENTS_MAX) {
        b->too_many = true;
        return 0;
    }
    if (b->counting) return (uint32_t)b->vertices.count++;
    struct fv_vertex *v = push(&b->vertices, sizeof *v);
    *v = *vertex;
    for (int i = 0; i < 3 && b->object > 0; i++)
        v->position[i] = (float)((double)v->position[i] - b->moving[b->object - 1].origin_m[i]);
    return (uint32_t)b->vertices.count - 1;
}

void fv_build_bare(struct fv_build *b)
{
    b->bare = true;
}

uint32_t fv_build_vertices(const struct fv_build *b)
{
    return (uint32_t)b->vertices.count;
}

void fv_build_rehearse(struct fv_build *b, bool counting)
{
    assert(counting != b->counting);
    b->counting = counting;
    if (counting) {
        b->kept[0] = b->vertices.count;
        b->kept[1] = b->triangles.count;
        return;
    }
    set_capacity(&b->vertices, b->vertices.count, sizeof(struct fv_vertex));
    set_capacity(&b->triangles, b->triangles.count, sizeof(struct corners));
    b->vertices.count = b->kept[0];
    b->triangles.count = b->kept[1];
}

void fv_build_triangle(struct fv_build *b, uint32_t v0, uint32_t v1, uint32_t v2, int material)
{
    assert(v0 < b->vertices.count && v1 < b->vertices.count && v2 < b->vertices.count);
    assert(material >= 0 && (size_t)material < b->materials.count);
    if (b->triangles.count == FV_ELEMENTS_MAX) b->too_many = true;
    if (b->too_many) return;
    if (b->counting) {
        b->triangles.count++;
        return;
    }
    struct corners *t = push(&b->triangles, sizeof *t);
    *t = (struct corners){{v0, v1, v2}, (uint32_t)material, (uint32_t)b->object & 63};
}

void fv_build_moving(struct fv_build *b, const struct fv_moving *moving, int count)
{
    assert(count >= 0 && count <= FV_MOVING_MAX);
    memcpy(b->moving, moving, (size_t)count * sizeof *moving);
    b->objects = count;
}

int fv_build_named(const struct fv_build *b, const char *name)
{
    for (int i = 0; i < b->objects && name; i++)
        if (fv_moving_named(&b->moving[i], name)) return i + 1;
    return 0;
}

int fv_build_object(struct fv_build *b, int object, const double origin_m[3], struct fv_error *error)
{
    int before = b->object;
    assert(object >= 0 && object <= b->objects);
    for (int i = 0; i < 3 && origin_m && !b->placed[object]; i++) {
        if (!(fabs(origin_m[i]) <= FV_WAY_LARGEST))
            return fv_error_set(error, "%s: the origin of %.100s, which moves, lies farther out than %g m", b->source,
                                b->moving[object - 1].name, FV_WAY_LARGEST);
        b->moving[object - 1].origin_m[i] = origin_m[i];
    }
    b->placed[object] = true;
    b->object = object;
    return before;
}

const struct fv_moving *fv_build_missing(const struct fv_build *b)
{
    for (int i = 0; i < b->objects; i++)
        if (!b->placed[i + 1]) return &b->moving[i];
    return NULL;
}

int fv_build_texture(struct fv_build *b, enum fv_texel kind, const uint8_t *pixels, int width, int height,
                     int channels, float alpha_cutoff)
{
    struct fv_texture *texture = push(&b->textures, sizeof *texture);
    *(size_t *)push(&b->texels, sizeof(size_t)) =
        fv_texture_make(texture, kind, pixels, width, height, channels, alpha_cutoff);
    return (int)b->textures.count - 1;
}

static bool any_positive(const float colour[3])
{
    return colour[0] > 0 || colour[1] > 0 || colour[2] > 0;
}

struct fv_material fv_material_default(void)
{
    return (struct fv_material){
        .diffuse = {0.7f, 0.7f, 0.7f},
        .shininess = 1,
        .ior = 1,
        .alpha_cutoff = 0.5f,
        .normal_scale = 1,
        .base_texture = -1,
        .normal_texture = -1,
        .alpha_texture = -1,
    };
}

int fv_build_material(struct fv_build *b, const struct fv_material *material)
{
    struct fv_material *m = push(&b->materials, sizeof *m);
    *m = *material;
    m->shininess = fminf(fmaxf(m->shininess, 1), FV_SHININESS_MAX);
    m->ior = fminf(fmaxf(m->ior, 1), FV_IOR_MAX);
    m->alpha_cutoff = fminf(fmaxf(m->alpha_cutoff, 0), 1);
    m->flags = (m->base_texture >= 0 ? FV_MATERIAL_TEXTURED : 0) |
               (m->normal_texture >= 0 ? FV_MATERIAL_NORMAL_MAPPED : 0) |
               (m->alpha_texture >= 0 ? FV_MATERIAL_MASKED : 0) |
               (any_positive(m->specular) ? FV_MATERIAL_SPECULAR : 0) |
               (any_positive(m->mirror) ? FV_MATERIAL_MIRROR : 0) |
               (any_positive(m->transmission) ? FV_MATERIAL_GLASS : 0) |
               (any_positive(m->emission) ? FV_MATERIAL_EMISSIVE : 0);
    return (int)b->materials.count - 1;
}

static bool finite3(const float v[3])
{
    return isfinite(v[0]) && isfinite(v[1]) && isfinite(v[2]);
}

int fv_build_light(struct fv_build *b, const struct fv_light *light, struct fv_error *error)
{
    struct fv_light l = *light;
    if (b->lights == FV_LIGHTS_MAX) return fv_error_set(error, "more than %d lights", FV_LIGHTS_MAX);
    if (!finite3(l.position) || !finite3(l.u) || !finite3(l.v) || !finite3(l.colour))
        return fv_error_set(error, "a light holds a number that is not finite");
    if (l.colour[0] < 0 || l.colour[1] < 0 || l.colour[2] < 0)
        return fv_error_set(error, "a light's colour is negative: %g %g %g", l.colour[0], l.colour[1],
                            l.colour[2]);
    double p[3], u[3], v[3], n[3];
    for (int i = 0; i < 3; i++) p[i] = l.position[i], u[i] = l.u[i], v[i] = l.v[i];
    fv_cross(u, v, n);
    if (l.kind == FV_LIGHT_AREA && !fv_normalise(n))
        return fv_error_set(error, "an area light's edges span no area");
    if (l.kind == FV_LIGHT_SUN) {
        if (!fv_normalise(p)) return fv_error_set(error, "a sun's direction has no length");
        for (int i = 0; i < 3; i++) l.position[i] = (float)p[i];
    }
    b->light[b->lights++] = l;
    return 0;
}

static bool material_finite(const struct fv_material *m)
{
    return finite3(m->diffuse) && finite3(m->specular) && finite3(m->mirror) && finite3(m->transmission) &&
           finite3(m->emission) && isfinite(m->normal_scale);
}

static int check(const struct fv_build *b, struct fv_error *error)
{
    if (b->too_many)
        return fv_error_set(error, "%s: more than %d vertices or triangles", b->source, FV_ELEMENTS_MAX);
    if (b->materials.count > FV_MATERIALS_MAX)
        return fv_error_set(error, "%s: %zu materials, at most %d are possible", b->source,
                            b->materials.count, FV_MATERIALS_MAX);
    if (b->triangles.count == 0 && !b->bare) return fv_error_set(error, "%s: holds no triangles", b->source);
    const size_t *texels = b->texels.data;
    size_t all = 0;
    for (size_t i = 0; i < b->textures.count; i++) all += texels[i];
    if (all > INT32_MAX)
        return fv_error_set(error, "%s: textures of %zu texels in all, at most %d are possible", b->source, all, INT32_MAX);
    const struct fv_vertex *v = b->vertices.data;
    for (size_t i = 0; i < b->vertices.count; i++)
        if (!finite3(v[i].position) || !isfinite(v[i].uv[0]) || !isfinite(v[i].uv[1]))
            return fv_error_set(error,
                                "%s: vertex %zu holds a number that is not finite, once scaled to metres",
                                b->source, i);
    const struct fv_material *m = b->materials.data;
    for (size_t i = 0; i < b->materials.count; i++)
        if (!material_finite(&m[i]))
            return fv_error_set(error, "%s: material %zu holds a number that is not finite", b->source, i);
    return 0;
}

/* Where a triangle goes: those of what stands still, then each object's; opaque ones, then masked ones. */
static int slot_of(const struct corners *t, const struct fv_material *material)
{
    return (int)(2 * t->object) + ((material[t->material].flags & FV_MATERIAL_MASKED) != 0);
}

/* Marks the triangles without area; returns how many stay, and of these how many go to each slot. */
static size_t sort_out(const struct fv_build *b, size_t slot[SLOTS])
{
    const struct fv_material *material = b->materials.data;
    struct corners *t = b->triangles.data;
    size_t kept = 0;
    memset(slot, 0, SLOTS * sizeof *slot);
    for (size_t i = 0; i < b->triangles.count; i++) {
        if (!fv_triangle_has_area(b->vertices.data, t[i].vertex)) {
            t[i].material = NOT_KEPT;
            continue;
        }
        kept++;
        slot[slot_of(&t[i], material)]++;
    }
    return kept;
}

/* A ball around what a box holds. */
static void set_ball(struct fv_object *o, const float low[3], const float high[3])
{
    double r2 = 0;
    if (o->triangles == 0) return;
    for (int i = 0; i < 3; i++) {
        o->centre[i] = (float)(0.5 * ((double)low[i] + high[i]));
        double half = fmax((double)high[i] - o->centre[i], o->centre[i] - (double)low[i]);
        r2 += half * half;
    }
    o->radius = (float)fmin(sqrt(r2) * (1 + 1e-6), FLT_MAX);
}

/* Which records are whose. */
static void lay_out_objects(const struct fv_build *b, struct fv_scene *scene, const size_t slot[SLOTS],
                            size_t next[SLOTS])
{
    size_t first = 0;
    for (int s = 0; s < SLOTS; first += slot[s++]) next[s] = first;
    scene->opaque_triangles = (int64_t)slot[0];
    scene->still_triangles = (int64_t)(slot[0] + slot[1]);
    scene->objects = b->objects;
    for (int o = 0; o < b->objects; o++) {
        const size_t *own = &slot[2 * (o + 1)];
        scene->object[o] = (struct fv_object){.moving = b->moving[o],
                                              .first = (int64_t)next[2 * (o + 1)],
                                              .triangles = (int64_t)(own[0] + own[1]),
                                              .opaque_triangles = (int64_t)own[0],
                                              .light = -1};
        if (own[0] + own[1] > 0) scene->features |= FV_SCENE_MOVING;
    }
}

static void lay_out_triangles(const struct fv_build *b, struct fv_scene *scene, size_t kept,
                              const size_t slot[SLOTS])
{
    const struct fv_material *material = b->materials.data;
    struct corners *c = b->triangles.data;
    const struct fv_vertex *v = b->vertices.data;
    size_t room = kept > 0 ? kept : 1;
    uint32_t *index = fv_arena_take(fv_arena(), "scene indices", room * 3 * sizeof *index, 64);
    struct fv_triangle *triangle = fv_arena_take(fv_arena(), "scene triangles", room * sizeof *triangle, 64);
    size_t next[SLOTS];
    float box[FV_MOVING_MAX + 1][2][3];
    lay_out_objects(b, scene, slot, next);
    for (int i = 0; i < 3 * (FV_MOVING_MAX + 1); i++) box[i / 3][0][i % 3] = INFINITY, box[i / 3][1][i % 3] = -INFINITY;
    for (size_t i = 0; i < b->triangles.count; i++) {
        if (c[i].material == NOT_KEPT) continue;
        size_t at = next[slot_of(&c[i], material)]++;
        fv_triangle_fill(&triangle[at], v, c[i].vertex, (uint16_t)c[i].material);
        memcpy(index + 3 * at, c[i].vertex, sizeof c[i].vertex);
        scene->features |=
            material[c[i].material].flags; /* the two enums share these bits' order, see below */
        for (int k = 0; k < 3; k++) {
            const float *p = v[c[i].vertex[k]].position;
            for (int j = 0; j < 3; j++) {
                box[c[i].object][0][j] = fminf(box[c[i].object][0][j], p[j]);
                box[c[i].object][1][j] = fmaxf(box[c[i].object][1][j], p[j]);
            }
        }
    }
    assert(next[0] == slot[0] && next[SLOTS - 1] == kept);
    memcpy(scene->bounds, box[0], sizeof scene->bounds);
    for (int o = 0; o < scene->objects; o++) set_ball(&scene->object[o], box[o + 1][0], box[o + 1][1]);
    scene->triangles = (int64_t)kept;
    scene->index = index;
    scene->triangle = triangle;
}

_Static_assert((int)FV_SCENE_TEXTURES == FV_MATERIAL_TEXTURED &&
                   (int)FV_SCENE_NORMAL_MAPS == FV_MATERIAL_NORMAL_MAPPED &&
                   (int)FV_SCENE_ALPHA == FV_MATERIAL_MASKED &&
                   (int)FV_SCENE_SPECULAR == FV_MATERIAL_SPECULAR &&
                   (int)FV_SCENE_MIRRORS == FV_MATERIAL_MIRROR && (int)FV_SCENE_GLASS == FV_MATERIAL_GLASS &&
                   (int)FV_SCENE_EMISSIVE == FV_MATERIAL_EMISSIVE,
               "a scene has the features of its materials");

/* Frees the collected vertices and triangles as soon as the arena has them. */
static void lay_out_geometry(struct fv_build *b, struct fv_scene *scene, size_t kept, const size_t slot[SLOTS])
{
    lay_out_triangles(b, scene, kept, slot);
    free(b->triangles.data);
    b->triangles = (struct array){0};
    size_t count = b->vertices.count;
    const struct fv_vertex *v = b->vertices.data;
    float *position = fv_arena_take(fv_arena(), "scene vertices", count * 3 * sizeof *position + 16, 64);
    for (size_t i = 0; i < count; i++) memcpy(position + 3 * i, v[i].position, sizeof v[i].position);
    scene->vertices = (int64_t)count;
    scene->position = position;
    free(b->vertices.data);
    b->vertices = (struct array){0};
}

static void lay_out_textures(struct fv_build *b, struct fv_scene *scene)
{
    struct fv_texture *from = b->textures.data;
    const size_t *texels = b->texels.data;
    size_t count = b->textures.count;
    size_t all = 0, at = 0;
    for (size_t i = 0; i < count; i++) all += texels[i];
    if (count == 0) return;
    struct fv_texture *texture = fv_arena_take(fv_arena(), "scene textures", count * sizeof *texture, 64);
    uint32_t *texel = fv_arena_take(fv_arena(), "scene textures", all * sizeof *texel, 64);
    for (size_t i = 0; i < count; at += texels[i++]) {
        memcpy(texel + at, from[i].texel, texels[i] * sizeof *texel);
        free((void *)from[i].texel);
        texture[i] = from[i];
        texture[i].texel = texel;
        for (int l = 0; l < texture[i].levels; l++) texture[i].offset[l] += (uint32_t)at;
    }
    b->textures.count = 0;
    scene->textures = (int)count;
    scene->texture = texture;
    scene->texel = texel;
}

int fv_build_finish(struct fv_build *b, struct fv_scene *scene, struct fv_error *error)
{
    size_t slot[SLOTS], kept;
    if (check(b, error)) {
        fv_build_destroy(b);
        return -1;
    }
    kept = sort_out(b, slot);
    if (kept == 0 && !b->bare) {
        fv_error_set(error, "%s: holds no triangles: all %zu have no area", b->source, b->triangles.count);
        fv_build_destroy(b);
        return -1;
    }
    if (kept < b->triangles.count)
        fv_log("%s: %zu of %zu triangles have no area and are left out", b->source, b->triangles.count - kept,
               b->triangles.count);
    scene->features = 0;
    lay_out_geometry(b, scene, kept, slot);
    lay_out_textures(b, scene);
    size_t materials = b->materials.count;
    struct fv_material *material =
        fv_arena_take(fv_arena(), "scene materials", materials * sizeof *material, 64);
    memcpy(material, b->materials.data, materials * sizeof *material);
    scene->materials = (int)materials;
    scene->material = material;
    static const uint32_t light_feature[] = {[FV_LIGHT_POINT] = FV_SCENE_POINT_LIGHTS,
                                             [FV_LIGHT_AREA] = FV_SCENE_AREA_LIGHTS,
                                             [FV_LIGHT_SUN] = FV_SCENE_SUN};
    scene->lights = b->lights;
    memcpy(scene->light, b->light, sizeof scene->light);
    for (int i = 0; i < b->lights; i++) scene->features |= light_feature[b->light[i].kind];
    fv_build_destroy(b);
    return 0;
}
