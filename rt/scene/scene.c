/* scene: from the settings to a scene in memory: finds the file, lets its reader collect it, adds the
 * lights and moving bodies of the settings, and lays it all out (build.c). */
#include "rt/scene/build.h"
#include "rt/scene/builtin_shapes.h"

#include "platform/clock.h"
#include "platform/files.h"
#include "platform/log.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

typedef int reader_function(struct fv_build *build, const char *path, double scale, struct fv_error *error);

static const struct {
    const char *ending;
    reader_function *read;
} readers[] = {{".gltf", fv_gltf_read}, {".glb", fv_gltf_read}, {".obj", fv_obj_read}};

static const char builtin[] = "builtin:";

static reader_function *reader_of(const char *path)
{
    size_t length = strlen(path);
    for (size_t i = 0; i < sizeof readers / sizeof readers[0]; i++) {
        size_t n = strlen(readers[i].ending);
        if (length > n && strcasecmp(path + length - n, readers[i].ending) == 0) return readers[i].read;
    }
    return NULL;
}

/* The path itself, or under scene.library. */
static int find(const struct fv_config *c, const char *file, const char *key, char path[FV_PATH_MAX],
                struct fv_error *error)
{
    snprintf(path, FV_PATH_MAX, "%s", file);
    if (fv_file_exists(path)) return 0;
    if (c->scene_library[0] && fv_path_join(path, c->scene_library, file) == 0 && fv_file_exists(path))
        return 0;
    if (!c->scene_library[0])
        return fv_config_error(error, key,
                               "%.120s is not there: set scene.library to the folder that holds it", file);
    return fv_config_error(
        error, key,
        "%.100s is not there, nor in scene.library = %.100s: set that to the folder that holds it", file,
        c->scene_library);
}

/* A list that holds one colour. */
static int read_colour(const struct fv_list *list, const char *key, float out[3], struct fv_error *error)
{
    if (list->count != 3) return fv_config_error(error, key, "%d colours, must be one", list->count / 3);
    for (int i = 0; i < 3; i++) {
        out[i] = (float)list->value[i];
        if (!(out[i] >= 0) || !isfinite(out[i]))
            return fv_config_error(error, key, "%g: must be 0 or more", out[i]);
    }
    return 0;
}

static int add_lights(struct fv_build *build, const struct fv_list *list, const char *key,
                      enum fv_light_kind kind, struct fv_error *error)
{
    int columns = kind == FV_LIGHT_AREA ? 12 : 6;
    for (int row = 0; row + columns <= list->count; row += columns) {
        const double *v = list->value + row;
        struct fv_light light = {.kind = kind};
        struct fv_error why;
        for (int i = 0; i < 3; i++) {
            light.position[i] = (float)v[i];
            light.colour[i] = (float)v[columns - 3 + i];
            if (kind == FV_LIGHT_AREA) light.u[i] = (float)v[3 + i], light.v[i] = (float)v[6 + i];
        }
        if (fv_build_light(build, &light, &why))
            return fv_config_error(error, key, "row %d: %s", row / columns + 1, why.text);
    }
    return 0;
}

/* The bodies of scene.moving, each about its own origin. */
static int add_bodies(struct fv_build *build, const struct fv_moving *moving, int count, struct fv_error *error)
{
    const double origin[3] = {0};
    for (int i = 0; i < count; i++) {
        const struct fv_moving *m = &moving[i];
        if (m->body == FV_BODY_NODE) continue;
        fv_build_object(build, i + 1, origin, error);
        if (m->body == FV_BODY_LIGHT) continue;
        struct fv_material material = fv_material_default();
        for (int c = 0; c < 3; c++) material.diffuse[c] = (float)m->colour[c];
        struct fv_brush brush = {build, glms_mat4_identity(), fv_build_material(build, &material), 1};
        float x = (float)m->size_m[0], y = (float)m->size_m[1], z = (float)m->size_m[2];
        if (m->body == FV_BODY_SPHERE) fv_shape_sphere(&brush, fv_vec(0, 0, 0), x, 64);
        else fv_shape_box(&brush, fv_vec(-x / 2, -y / 2, -z / 2), fv_vec(x / 2, y / 2, z / 2));
    }
    fv_build_object(build, 0, NULL, error);
    const struct fv_moving *missing = fv_build_missing(build);
    return missing ? fv_config_error(error, "scene.moving", "the scene has no node %.120s",
                                     missing->name)
                   : 0;
}

/* The lights among them, where they are at time 0: the scene's last ones. */
static int add_moving_lights(struct fv_build *build, const struct fv_moving *moving, int count, struct fv_error *error)
{
    for (int i = 0; i < count; i++) {
        struct fv_light light = {.kind = FV_LIGHT_POINT};
        struct fv_error why;
        struct fv_pose pose;
        if (moving[i].body != FV_BODY_LIGHT) continue;
        fv_moving_pose(&moving[i], 0, &pose);
        for (int c = 0; c < 3; c++) {
            light.position[c] = (float)pose.position_m[c];
            light.colour[c] = (float)moving[i].intensity[c];
        }
        if (fv_build_light(build, &light, &why)) return fv_config_error(error, "scene.moving", "row %d: %s", i + 1, why.text);
    }
    return 0;
}

static void name_moving_lights(struct fv_scene *scene)
{
    int light = scene->lights;
    for (int i = scene->objects - 1; i >= 0; i--)
        if (scene->object[i].moving.body == FV_BODY_LIGHT) scene->object[i].light = --light;
}

static int read_settings(struct fv_build *build, struct fv_scene *scene, const struct fv_config *c,
                         struct fv_error *error)
{
    scene->exposure = (float)c->scene_exposure;
    return read_colour(&c->scene_ambient, "scene.ambient", scene->ambient, error) ||
                   read_colour(&c->scene_sky, "scene.sky", scene->sky, error) ||
                   add_lights(build, &c->scene_point_lights, "scene.point_lights", FV_LIGHT_POINT, error) ||
                   add_lights(build, &c->scene_area_lights, "scene.area_lights", FV_LIGHT_AREA, error) ||
                   add_lights(build, &c->scene_sun, "scene.sun", FV_LIGHT_SUN, error)
               ? -1
               : 0;
}

/* Reads what scene.fields names: a file, or one that the program holds. */
static int read_fields(struct fv_build *build, struct fv_scene *scene, const struct fv_config *c, struct fv_error *error)
{
    const char *name = c->scene_fields;
    char path[FV_PATH_MAX], *bytes;
    size_t size;
    if (!name[0]) return 0;
    fv_build_bare(build);
    if (strncmp(name, builtin, sizeof builtin - 1) == 0) {
        const char *text = fv_preset_text("fields", name + sizeof builtin - 1);
        if (!text)
            return fv_config_error(error, "scene.fields", "%.80s: not known, must be builtin: and one of the scenes of fields", name);
        snprintf(path, sizeof path, "config/scenes/%.80s.field", name + sizeof builtin - 1);
        return fv_fields_read(&scene->fields, build, text, strlen(text), path, 1, error);
    }
    size_t length = strlen(name);
    if (length < 6 || strcmp(name + length - 6, ".field") != 0)
        return fv_config_error(error, "scene.fields", "%.120s: must end in .field, or be builtin: and a name", name);
    if (find(c, name, "scene.fields", path, error) || fv_file_read(path, 1 << 24, &bytes, &size, error)) return -1;
    int result = fv_fields_read(&scene->fields, build, bytes, size, path, c->scene_scale, error);
    free(bytes);
    return result;
}

/* The preset's name where one was asked for; else that of the file, without folder and ending. */
static void name_scene(struct fv_scene *scene, const struct fv_config *c)
{
    const char *key = c->scene_file[0] ? "scene.file" : "scene.fields";
    bool preset = strncmp(fv_config_origin(key), "config/scenes/", 14) == 0;
    const char *name = c->scene_file[0] ? c->scene_file : c->scene_fields, *slash = strrchr(name, '/');
    if (slash) name = slash + 1;
    if (strncmp(name, builtin, sizeof builtin - 1) == 0) name += sizeof builtin - 1;
    const char *dot = strrchr(name, '.');
    int length = dot && dot > name ? (int)(dot - name) : (int)strlen(name);
    if (preset || strcmp(fv_config_origin("scene.name"), "default") != 0)
        snprintf(scene->name, sizeof scene->name, "%.63s", c->scene_name);
    else snprintf(scene->name, sizeof scene->name, "%.*s", length < 63 ? length : 63, name);
}

static int read_file(struct fv_build *build, const struct fv_config *c, const char *path,
                     struct fv_error *error)
{
    if (!path[0]) return 0;
    if (strncmp(path, builtin, sizeof builtin - 1) == 0)
        return fv_builtin_read(build, path + sizeof builtin - 1, c->scene_detail, error);
    reader_function *read = reader_of(path);
    if (!read) return fv_config_error(error, "scene.file", "%.120s: must end in .gltf, .glb or .obj", path);
    fv_log_progress("reading %s", path);
    return read(build, path, c->scene_scale, error);
}

int fv_scene_find(const struct fv_config *config, struct fv_error *error)
{
    char path[FV_PATH_MAX];
    const char *fields = config->scene_fields;
    if (fields[0] && strncmp(fields, builtin, sizeof builtin - 1) != 0 && find(config, fields, "scene.fields", path, error)) return -1;
    if (fields[0] && !config->scene_file[0]) return 0;
    return strncmp(config->scene_file, builtin, sizeof builtin - 1) == 0 ? 0 : find(config, config->scene_file, "scene.file", path, error);
}

/* What the fields' materials ask for, besides what triangles do. */
static uint32_t field_features(const struct fv_scene *s)
{
    uint32_t features = FV_SCENE_FIELDS | (s->triangles > 0 ? FV_SCENE_MIXED : 0);
    for (int i = 0; i < s->fields.parts; i++) features |= s->material[s->fields.part[i].material].flags;
    return features;
}

int fv_scene_load(struct fv_scene *scene, const struct fv_config *config, struct fv_error *error)
{
    char path[FV_PATH_MAX];
    int64_t start_ns = fv_clock_now_ns(&fv_clock_monotonic);
    memset(scene, 0, sizeof *scene);
    if (!config->scene_file[0] && !config->scene_fields[0])
        return fv_config_error(error, "scene.file",
                               "is empty: name a .gltf, .glb or .obj file, or builtin:atrium");
    snprintf(path, sizeof path, "%s", config->scene_file);
    if (path[0] && strncmp(path, builtin, sizeof builtin - 1) != 0 && find(config, config->scene_file, "scene.file", path, error)) return -1;
    name_scene(scene, config);
    static struct fv_moving moving[FV_MOVING_MAX];
    int count = fv_moving_read(config, moving, error);
    if (count < 0) return -1;
    struct fv_build *build = fv_build_create(path[0] ? path : config->scene_fields);
    fv_build_moving(build, moving, count);
    if (read_file(build, config, path, error) || add_bodies(build, moving, count, error) || read_settings(build, scene, config, error) ||
        add_moving_lights(build, moving, count, error) || read_fields(build, scene, config, error)) {
        fv_build_destroy(build);
        return -1;
    }
    fv_log_progress("building %s", scene->name);
    if (fv_build_finish(build, scene, error)) return -1;
    name_moving_lights(scene);
    if (scene->fields.parts > 0) scene->features |= field_features(scene);
    if (config->method_ao_spp > 0 && (scene->ambient[0] > 0 || scene->ambient[1] > 0 || scene->ambient[2] > 0))
        scene->features |= FV_SCENE_AO;
    if (scene->fields.parts > 0)
        fv_log("scene %s: fields of %d parts, %d instructions", scene->name, scene->fields.parts, scene->fields.codes);
    fv_log("scene %s: %lld triangles, %d materials, %d textures, read in %.2f s", scene->name,
           (long long)scene->triangles, scene->materials, scene->textures,
           (double)(fv_clock_now_ns(&fv_clock_monotonic) - start_ns) * 1e-9);
    return 0;
}
