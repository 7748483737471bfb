/* gltf: nodes, meshes and lights of a glTF 2.0 file; see gltf.h for the parts. Of a file, what its
 * default scene shows is read: triangles (list, strip, fan) with positions, normals and texture
 * coordinates, and KHR_lights_punctual. Vertices are taken over when a triangle first uses them. */
#include "rt/scene/gltf.h"

#include "platform/files.h"
#include "platform/log.h"

#include <cglm/cglm.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { DEPTH_MAX = 64 };

struct primitive {
    struct gltf_accessor position, normal, tangent, uv, index; /* data NULL: not given */
    const struct gltf_material *material;
    int mode;
    uint64_t corners;
    uint32_t *vertex;                       /* of the build, plus 1; 0: not taken over yet */
    float world[4][4], normal_matrix[3][3]; /* columns */
    bool mirrored;
};

static int open_accessors(struct gltf *g, const json_t *json, struct primitive *p)
{
    const json_t *attributes = gltf_object(g, json, "attributes");
    char uv_name[16];
    snprintf(uv_name, sizeof uv_name, "TEXCOORD_%d", p->material->uv_set);
    const struct {
        const json_t *owner;
        const char *name, *type;
        unsigned components;
        struct gltf_accessor *out;
    } wanted[] = {{attributes, "POSITION", "VEC3", GLTF_FLOAT | GLTF_SMALL, &p->position},
                  {attributes, "NORMAL", "VEC3", GLTF_FLOAT | GLTF_SMALL, &p->normal},
                  {attributes, "TANGENT", "VEC4", GLTF_FLOAT | GLTF_SMALL, &p->tangent},
                  {attributes, uv_name, "VEC2", GLTF_FLOAT | GLTF_SMALL, &p->uv},
                  {json, "indices", "SCALAR", GLTF_UNSIGNED, &p->index}};
    for (size_t i = 0; i < sizeof wanted / sizeof wanted[0]; i++) {
        int64_t index = gltf_integer(g, wanted[i].owner, wanted[i].name, -1);
        if (g->failed) return -1;
        if (i == 0 && index < 0) return gltf_fail(g, "has no POSITION");
        if (index >= 0 && gltf_accessor_open(g, index, wanted[i].type, wanted[i].components, wanted[i].out))
            return -1;
        bool attribute = wanted[i].owner == attributes;
        if (index >= 0 && attribute && wanted[i].out->count != p->position.count)
            return gltf_fail(g, "%s has %llu values for %llu positions", wanted[i].name,
                             (unsigned long long)wanted[i].out->count, (unsigned long long)p->position.count);
    }
    return 0;
}

static void transform(const struct primitive *p, const struct gltf *g, const float in[3], float out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = g->scale *
                 (p->world[0][i] * in[0] + p->world[1][i] * in[1] + p->world[2][i] * in[2] + p->world[3][i]);
}

static int take_vertex(struct gltf *g, struct primitive *p, uint64_t i, uint32_t *out)
{
    if (p->vertex[i] == 0) {
        struct fv_vertex v = {0};
        float given[4], uv[2] = {0};
        gltf_accessor_floats(&p->position, i, given);
        transform(p, g, given, v.position);
        if (p->normal.data) {
            gltf_accessor_floats(&p->normal, i, given);
            glm_mat3_mulv(p->normal_matrix, given, v.normal);
        }
        if (p->tangent.data) {
            gltf_accessor_floats(&p->tangent, i, given);
            v.bitangent_sign = p->mirrored ? -given[3] : given[3];
        }
        if (p->uv.data) gltf_accessor_floats(&p->uv, i, uv);
        for (int k = 0; k < 2; k++)
            v.uv[k] = p->material->uv[k][0] * uv[0] + p->material->uv[k][1] * uv[1] + p->material->uv[k][2];
        for (int k = 0; k < 3; k++)
            if (!isfinite(v.position[k]) || !isfinite(v.uv[k % 2]))
                return gltf_fail(g, "vertex %llu holds a number that is not finite", (unsigned long long)i);
        p->vertex[i] = fv_build_vertex(g->build, &v) + 1;
    }
    *out = p->vertex[i] - 1;
    return 0;
}

static int add_triangles(struct gltf *g, struct primitive *p)
{
    uint64_t triangles = p->mode == 4 ? p->corners / 3 : p->corners < 3 ? 0 : p->corners - 2;
    for (uint64_t t = 0; t < triangles; t++) {
        /* Every other triangle of a strip is turned round; a fan's share their first corner. */
        uint64_t corner[3] = {t, t + 1 + t % 2, t + 2 - t % 2};
        if (p->mode == 4) corner[0] = 3 * t, corner[1] = 3 * t + 1, corner[2] = 3 * t + 2;
        if (p->mode == 6) corner[0] = 0, corner[1] = t + 1, corner[2] = t + 2;
        uint32_t v[3];
        for (int k = 0; k < 3; k++) {
            uint64_t i = p->index.data ? gltf_accessor_index(&p->index, corner[k]) : corner[k];
            if (i >= p->position.count)
                return gltf_fail(g, "index %llu, but there are %llu positions", (unsigned long long)i,
                                 (unsigned long long)p->position.count);
            if (take_vertex(g, p, i, &v[k])) return -1;
        }
        fv_build_triangle(g->build, v[0], v[p->mirrored ? 2 : 1], v[p->mirrored ? 1 : 2], p->material->index);
    }
    return 0;
}

/* Normals go with the matrix of cofactors: the inverse transpose but for a factor, and defined for
 * flattening matrices too; the factor's sign is the determinant's. */
static void set_matrices(struct primitive *p, mat4 world)
{
    memcpy(p->world, world, sizeof p->world);
    for (int i = 0; i < 3; i++) glm_vec3_cross(world[(i + 1) % 3], world[(i + 2) % 3], p->normal_matrix[i]);
    p->mirrored = glm_vec3_dot(world[0], p->normal_matrix[0]) < 0;
    if (p->mirrored)
        for (int i = 0; i < 3; i++) glm_vec3_negate(p->normal_matrix[i]);
}

static void name_place(struct gltf *g, int64_t mesh, int64_t primitive)
{
    snprintf(g->place, sizeof g->place, "meshes[%lld].primitives[%lld]", (long long)mesh,
             (long long)primitive);
}

static int read_primitive(struct gltf *g, const json_t *json, int64_t mesh, int64_t number, mat4 world)
{
    struct primitive p = {0};
    int64_t mode = gltf_integer(g, json, "mode", 4), material = gltf_integer(g, json, "material", -1);
    if (mode > 6) return gltf_fail(g, "mode %lld, must be from 0 to 6", (long long)mode);
    if (mode < 4) return 0; /* points and lines have no surface */
    p.mode = (int)mode;
    p.material = gltf_material_use(g, material);
    name_place(g, mesh, number);
    if (!p.material || open_accessors(g, json, &p)) return -1;
    name_place(g, mesh, number);
    p.corners = p.index.data ? p.index.count : p.position.count;
    if (p.mode == 4 && p.corners % 3)
        return gltf_fail(g, "%llu corners are no whole triangles", (unsigned long long)p.corners);
    g->elements += p.position.count + p.corners;
    if (g->elements > (uint64_t)FV_ELEMENTS_MAX * 4)
        return gltf_fail(g, "more than %d vertices and indices", FV_ELEMENTS_MAX * 4);
    if (p.material->hidden) return 0;
    set_matrices(&p, world);
    p.vertex = calloc(p.position.count, sizeof *p.vertex);
    if (!p.vertex) fv_die(2, "memory: %s does not fit", g->path);
    int result = add_triangles(g, &p);
    free(p.vertex);
    return result;
}

static int read_mesh(struct gltf *g, int64_t index, mat4 world)
{
    const json_t *list = gltf_list(g, gltf_element(g, "meshes", index), "primitives"), *primitive;
    size_t i;
    json_array_foreach((json_t *)list, i, primitive)
    {
        name_place(g, index, (int64_t)i);
        if (g->failed || read_primitive(g, primitive, index, (int64_t)i, world)) return -1;
    }
    return g->failed ? -1 : 0;
}

/* KHR_lights_punctual. Candela and lux are taken as W/sr and W/m2: only their ratio to each other
 * can be seen, scene.exposure does the rest. A spot shines in all directions. */
static int read_light(struct gltf *g, int64_t index, mat4 world)
{
    const json_t *all = gltf_list(g, gltf_extension(g, g->root, "KHR_lights_punctual"), "lights");
    if (g->failed || index < 0) return g->failed ? -1 : 0;
    snprintf(g->place, sizeof g->place, "lights[%lld]", (long long)index);
    const json_t *json = json_array_get(all, (size_t)index);
    if (!json) return gltf_fail(g, "is not there, there are %zu", json_array_size(all));
    const char *type = gltf_text(g, json, "type");
    float colour[3] = {1, 1, 1}, intensity = (float)gltf_number(g, json, "intensity", 1, 0, 1e30);
    gltf_numbers(g, json, "color", 3, colour);
    if (g->failed) return -1;
    struct fv_light light = {.kind = FV_LIGHT_POINT};
    if (type && strcmp(type, "directional") == 0) light.kind = FV_LIGHT_SUN;
    else if (!type || (strcmp(type, "point") != 0 && strcmp(type, "spot") != 0))
        return gltf_fail(g, "type %.20s, must be point, spot or directional", type ? type : "missing");
    for (int i = 0; i < 3; i++) {
        light.position[i] = light.kind == FV_LIGHT_SUN ? world[2][i] : world[3][i] * g->scale;
        light.colour[i] = colour[i] * intensity;
    }
    struct fv_error why;
    return fv_build_light(g->build, &light, &why) ? gltf_fail(g, "%.200s", why.text) : 0;
}

static int read_transform(struct gltf *g, const json_t *node, mat4 out)
{
    float t[3] = {0}, r[4] = {0, 0, 0, 1}, s[3] = {1, 1, 1}, m[16];
    vec4 turn;
    glm_mat4_identity(out);
    memcpy(m, out, sizeof m);
    gltf_numbers(g, node, "matrix", 16, m);
    gltf_numbers(g, node, "translation", 3, t);
    gltf_numbers(g, node, "rotation", 4, r);
    gltf_numbers(g, node, "scale", 3, s);
    if (g->failed) return -1;
    memcpy(out, m, sizeof m);
    if (json_object_get(node, "matrix")) return 0;
    memcpy(turn, r, sizeof turn);
    glm_quat_normalize(turn);
    glm_quat_mat4(turn, out);
    for (int i = 0; i < 3; i++) {
        glm_vec4_scale(out[i], s[i], out[i]);
        out[3][i] = t[i];
    }
    return 0;
}

static int read_node(struct gltf *g, int64_t index, mat4 parent, int depth);

/* What a node holds, and what hangs on it. */
static int read_below(struct gltf *g, int64_t index, const json_t *node, mat4 world, int depth)
{
    int64_t mesh = gltf_integer(g, node, "mesh", -1);
    int64_t light = gltf_integer(g, gltf_extension(g, node, "KHR_lights_punctual"), "light", -1);
    const json_t *children = gltf_list(g, node, "children"), *child;
    if (g->failed || (mesh >= 0 && read_mesh(g, mesh, world)) || read_light(g, light, world)) return -1;
    size_t i;
    json_array_foreach((json_t *)children, i, child)
    {
        if (!json_is_integer(child))
            return gltf_fail(g, "a child of nodes[%lld] is no index", (long long)index);
        if (read_node(g, json_integer_value(child), world, depth + 1)) return -1;
    }
    return 0;
}

static int read_node(struct gltf *g, int64_t index, mat4 parent, int depth)
{
    mat4 local, world;
    const json_t *node = gltf_element(g, "nodes", index);
    if (!node) return -1;
    if (g->node_seen[index]) return gltf_fail(g, "is reached twice: nodes must be trees, without cycles");
    if (depth == DEPTH_MAX) return gltf_fail(g, "lies more than %d nodes deep", DEPTH_MAX);
    g->node_seen[index] = true;
    if (read_transform(g, node, local)) return -1;
    glm_mat4_mul(parent, local, world);
    for (int i = 0; i < 16; i++)
        if (!isfinite(world[i / 4][i % 4])) return gltf_fail(g, "its transform is not finite");
    int object = fv_build_named(g->build, json_string_value(json_object_get(node, "name")));
    if (!object) return read_below(g, index, node, world, depth);
    double origin[3];
    struct fv_error why;
    for (int i = 0; i < 3; i++) origin[i] = (double)g->scale * world[3][i];
    int before = fv_build_object(g->build, object, origin, &why);
    if (before < 0) return gltf_fail(g, "%.200s", why.text);
    int result = read_below(g, index, node, world, depth);
    fv_build_object(g->build, before, NULL, &why);
    return result;
}

/* The roots: of the default scene, of the first where none is the default, or all nodes that are
 * nobody's child where there are no scenes. */
static int read_scene(struct gltf *g)
{
    mat4 identity = GLM_MAT4_IDENTITY_INIT;
    int64_t scene = gltf_integer(g, g->root, "scene", 0);
    const json_t *root;
    size_t i;
    if (g->failed) return -1;
    if (gltf_count(g, "scenes") > 0) {
        const json_t *roots = gltf_list(g, gltf_element(g, "scenes", scene), "nodes");
        json_array_foreach((json_t *)roots, i, root)
        {
            if (!json_is_integer(root)) return gltf_fail(g, "a node of it is no index");
            if (read_node(g, json_integer_value(root), identity, 0)) return -1;
        }
        return g->failed ? -1 : 0;
    }
    bool *is_child = calloc(g->nodes ? g->nodes : 1, sizeof *is_child);
    if (!is_child) fv_die(2, "memory: %s does not fit", g->path);
    for (size_t n = 0; n < g->nodes; n++) {
        const json_t *children = gltf_list(g, gltf_element(g, "nodes", (int64_t)n), "children"), *child;
        json_array_foreach((json_t *)children, i, child)
        {
            json_int_t c = json_integer_value(child);
            if (c >= 0 && (size_t)c < g->nodes) is_child[c] = true;
        }
    }
    for (size_t n = 0; n < g->nodes && !g->failed; n++)
        if (!is_child[n]) read_node(g, (int64_t)n, identity, 0);
    free(is_child);
    return g->failed ? -1 : 0;
}

int fv_gltf_read_memory(struct fv_build *build, const uint8_t *bytes, size_t size, const char *path,
                        const char *folder, double scale, struct fv_error *error)
{
    struct gltf g = {.build = build, .path = path, .folder = folder, .scale = (float)scale, .error = error};
    int result = gltf_open(&g, bytes, size) || read_scene(&g) ? -1 : 0;
    gltf_close(&g);
    return result;
}

int fv_gltf_read(struct fv_build *build, const char *path, double scale, struct fv_error *error)
{
    char folder[FV_PATH_MAX], *bytes;
    size_t size;
    if (fv_file_read(path, (size_t)4 << 30, &bytes, &size, error)) return -1;
    fv_path_folder(folder, path);
    int result = fv_gltf_read_memory(build, (const uint8_t *)bytes, size, path, folder, scale, error);
    free(bytes);
    return result;
}
