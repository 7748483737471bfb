/* scene: from the settings to a scene in memory: finds the file, lets its reader collect it, adds the
 * lights and moving bodies of the settings, and lays it all out (build.c). */
#include "rt/scene/build.h"
#include "rt/scene/builtin_shapes.h"

#include "platform/clock.h"
#include "platform/files.h"
#include "platform/log.h"

#include <math.h>
#include <stdio.h>
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
static int find(const struct fv_config *c, char path[FV_PATH_MAX], struct fv_error *error)
{
    const char *file = c->scene_file;
    snprintf(path, FV_PATH_MAX, "%s", file);
    if (fv_file_exists(path)) return 0;
    if (c->scene_library[0] && fv_path_join(path, c->scene_library, file) == 0 && fv_file_exists(path))
        return 0;
    if (!c->scene_library[0])
        return fv_config_error(error, "scene.file",
                               "%.120s is not there: set scene.library to the folder that holds it", file);
    return fv_config_error(
        error, "scene.file",
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
        struct fv_material material = fv_material_default();
        for (int c = 0; c < 3; c++) material.diffuse[c] = (float)m->colour[c];
        struct fv_brush brush = {build, glms_mat4_identity(), fv_build_material(build, &material), 1};
        float x = (float)m->size_m[0], y = (float)m->size_m[1], z = (float)m->size_m[2];
        fv_build_object(build, i + 1, origin, error);
        if (m->body == FV_BODY_SPHERE) fv_shape_sphere(&brush, fv_vec(0, 0, 0), x, 64);
        else fv_shape_box(&brush, fv_vec(-x / 2, -y / 2, -z / 2), fv_vec(x / 2, y / 2, z / 2));
    }
    fv_build_object(build, 0, NULL, error);
    const struct fv_moving *missing = fv_build_missing(build);
    return missing ? fv_config_error(error, "scene.moving", "the scene has no node %.120s",
                                     missing->name)
                   : 0;
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

/* The preset's name where one was asked for; else that of the file, without folder and ending. */
static void name_scene(struct fv_scene *scene, const struct fv_config *c)
{
    bool preset = strncmp(fv_config_origin("scene.file"), "config/scenes/", 14) == 0;
    const char *name = c->scene_file, *slash = strrchr(name, '/');
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
    if (strncmp(path, builtin, sizeof builtin - 1) == 0)
        return fv_builtin_read(build, path + sizeof builtin - 1, error);
    reader_function *read = reader_of(path);
    if (!read) return fv_config_error(error, "scene.file", "%.120s: must end in .gltf, .glb or .obj", path);
    fv_log_progress("reading %s", path);
    return read(build, path, c->scene_scale, error);
}

int fv_scene_find(const struct fv_config *config, struct fv_error *error)
{
    char path[FV_PATH_MAX];
    return strncmp(config->scene_file, builtin, sizeof builtin - 1) == 0 ? 0 : find(config, path, error);
}

int fv_scene_load(struct fv_scene *scene, const struct fv_config *config, struct fv_error *error)
{
    char path[FV_PATH_MAX];
    int64_t start_ns = fv_clock_now_ns(&fv_clock_monotonic);
    memset(scene, 0, sizeof *scene);
    if (!config->scene_file[0])
        return fv_config_error(error, "scene.file",
                               "is empty: name a .gltf, .glb or .obj file, or builtin:atrium");
    snprintf(path, sizeof path, "%s", config->scene_file);
    if (strncmp(path, builtin, sizeof builtin - 1) != 0 && find(config, path, error)) return -1;
    name_scene(scene, config);
    static struct fv_moving moving[FV_MOVING_MAX];
    int count = fv_moving_read(config, moving, error);
    if (count < 0) return -1;
    struct fv_build *build = fv_build_create(path);
    fv_build_moving(build, moving, count);
    if (read_file(build, config, path, error) || add_bodies(build, moving, count, error) || read_settings(build, scene, config, error)) {
        fv_build_destroy(build);
        return -1;
    }
    fv_log_progress("building %s", scene->name);
    if (fv_build_finish(build, scene, error)) return -1;
    if (config->method_ao_spp > 0 && (scene->ambient[0] > 0 || scene->ambient[1] > 0 || scene->ambient[2] > 0))
        scene->features |= FV_SCENE_AO;
    fv_log("scene %s: %lld triangles, %d materials, %d textures, read in %.2f s", scene->name,
           (long long)scene->triangles, scene->materials, scene->textures,
           (double)(fv_clock_now_ns(&fv_clock_monotonic) - start_ns) * 1e-9);
    return 0;
}
