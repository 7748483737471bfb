/* scene: what fv_scene_load makes of the settings: where it looks for files, whose name and lights a
 * scene gets, and which settings it refuses, naming the key. */
#include "rt/scene/scene.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static char folder[64] = "/tmp/foveola-scene-XXXXXX";
static struct fv_config config;
static struct fv_scene scene;
static struct fv_error error;

/* Loads with these --set assignments, up to the first NULL; `library` is set to the folder. */
static int load(const char *const sets[4])
{
    char library[128];
    struct fv_config_request request = {.sets = 1, .set = {library}};
    snprintf(library, sizeof library, "scene.library=%s", folder);
    for (int i = 0; i < 4 && sets[i]; i++) request.set[request.sets++] = sets[i];
    error.text[0] = 0;
    if (fv_config_load(&config, &request, &error)) fail_msg("%s", error.text);
    return fv_scene_load(&scene, &config, &error);
}

static void scenes_and_their_lights(void **state)
{
    (void)state;
    static const struct {
        const char *set[4];
        const char *name;
        int triangles, lights;
        uint32_t features;
    } rows[] = {
        {{"scene.file=one.obj"}, "one", 1, 0, 0},
        {{"scene.file=ONE.OBJ"}, "ONE", 1, 0, 0},
        {{"scene.file=one.obj", "scene.name=mine"}, "mine", 1, 0, 0},
        {{"scene.file=one.obj", "scene.point_lights=1 2 3 4 5 6, 1 1 1 1 1 1", "scene.sun=0 2 0 1 1 1"},
         "one",
         1,
         3,
         FV_SCENE_POINT_LIGHTS | FV_SCENE_SUN},
        {{"scene.file=one.obj", "scene.area_lights=0 3 0 1 0 0 0 0 1 9 9 9"},
         "one",
         1,
         1,
         FV_SCENE_AREA_LIGHTS},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        if (load(rows[i].set)) fail_msg("%s: %s", rows[i].set[0], error.text);
        assert_string_equal(scene.name, rows[i].name);
        assert_int_equal(scene.triangles, rows[i].triangles);
        assert_int_equal(scene.lights, rows[i].lights);
        assert_int_equal(scene.features, rows[i].features);
    }
    assert_true(scene.light[0].colour[0] == 9 && scene.light[0].position[1] == 3 && scene.light[0].v[2] == 1);

    const char *const set[4] = {"scene.file=one.obj", "scene.scale=100", "scene.ambient=1 2 3",
                                "scene.sky=4 5 6"};
    assert_int_equal(load(set), 0);
    assert_true(scene.bounds[1][0] == 100 && scene.ambient[1] == 2 && scene.sky[2] == 6 &&
                scene.exposure == 1);
    const char *const preset[4] = {"scene.name=cornell"};
    assert_int_equal(load(preset), 0);
    assert_string_equal(scene.name, "cornell");
    assert_true(scene.triangles > 10 && scene.lights > 0);
}

static void settings_that_are_refused(void **state)
{
    (void)state;
    static const struct {
        const char *set[4];
        const char *says;
    } rows[] = {
        {{"scene.file="}, "scene.file: is empty"},
        {{"scene.file=gone.glb"}, "gone.glb is not there, nor in scene.library = /tmp/foveola-scene-"},
        {{"scene.file=gone.glb", "scene.library="}, "gone.glb is not there: set scene.library"},
        {{"scene.file=one.ply"}, "one.ply: must end in .gltf, .glb or .obj"},
        {{"scene.file=broken.obj"}, "broken.obj:2: vertex index 9"},
        {{"scene.file=one.obj", "scene.ambient=1 1 1, 2 2 2"}, "scene.ambient: 2 colours, must be one"},
        {{"scene.file=one.obj", "scene.sky=-1 0 0"}, "scene.sky: -1: must be 0 or more"},
        {{"scene.file=one.obj", "scene.sun=0 1 0 1 1 1, 0 0 0 1 1 1"}, "scene.sun: row 2: a sun's direction"},
        {{"scene.file=one.obj", "scene.point_lights=0 0 0 1 1 -1"},
         "scene.point_lights: row 1: a light's colour"},
        {{"scene.file=one.obj", "scene.area_lights=0 0 0 1 0 0 2 0 0 1 1 1"},
         "scene.area_lights: row 1: an area"},
        {{"scene.file=builtin:nothing"}, "nothing"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        if (load(rows[i].set) == 0) fail_msg("'%s' '%s' was loaded", rows[i].set[0], rows[i].set[1]);
        if (!strstr(error.text, rows[i].says)) fail_msg("'%s' does not say '%s'", error.text, rows[i].says);
    }
}

static const struct {
    const char *name, *text;
} files[] = {
    {"one.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"},
    {"ONE.OBJ", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"},
    {"one.ply", "ply\n"},
    {"broken.obj", "v 0 0 0\nf 1 1 9\n"},
};

static int for_all_files(int write)
{
    for (size_t i = 0; i < sizeof files / sizeof files[0]; i++) {
        char path[128];
        snprintf(path, sizeof path, "%s/%s", folder, files[i].name);
        FILE *f = write ? fopen(path, "w") : NULL;
        if (write && (!f || fputs(files[i].text, f) < 0 || fclose(f))) return -1;
        if (!write) unlink(path);
    }
    return 0;
}

static int set_up(void **state)
{
    (void)state;
    return mkdtemp(folder) ? for_all_files(1) : -1;
}

static int tear_down(void **state)
{
    (void)state;
    for_all_files(0);
    return rmdir(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(scenes_and_their_lights),
        cmocka_unit_test(settings_that_are_refused),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
