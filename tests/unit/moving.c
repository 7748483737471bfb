/* moving: scene.moving: rows that are read and those that are refused, by their messages; nodes of a file by
 * name; runs of a scene that moves: the same bytes again, nothing allocated. */
#include "rt/scene/build.h"
#include "tests/support/program.h"

#include <math.h>

static struct fv_config config;
static struct fv_moving moving[FV_MOVING_MAX];
static struct fv_scene scene;
static struct fv_error error;

static void configure(const char *rows)
{
    static char set[FV_ROWS_LONGEST + 32];
    struct fv_config_request request = {.sets = 1, .set = {set}};
    snprintf(set, sizeof set, "scene.moving=%s", rows);
    error.text[0] = 0;
    if (fv_config_load(&config, &request, &error)) fail_msg("%s", error.text);
}

static void rows_that_are_read(void **state)
{
    (void)state;
    static const struct {
        const char *rows;
        int count, ways, body;
        double size, seconds, spin;
    } table[] = {
        {"", 0, 0, 0, 0, 0, 0},
        {" , ,", 0, 0, 0, 0, 0, 0},
        {"sphere 0.5 at 0 1 2 3", 1, 1, FV_BODY_SPHERE, 0.5, 0, 0},
        {"box 1 2 3 at 0 0 0 0 at 1 1 1 90 in 4 spin 0 90 0 colour 1 0 0.5", 1, 2, FV_BODY_BOX, 3, 4, 90},
        {"sphere 1 at 0 0 0 0,\tbox 1 1 9 spin 1 -2 3 at 1e8 -1e8 0 0 in 0", 2, 1, FV_BODY_BOX, 9, 0, -2},
        {"node Door", 1, 0, FV_BODY_NODE, 0, 0, 0},
        {"node at at 1 2 3 4", 1, 1, FV_BODY_NODE, 0, 0, 0},
        {"node a, node b,, node c,", 3, 0, FV_BODY_NODE, 0, 0, 0},
    };
    for (unsigned i = 0; i < sizeof table / sizeof table[0]; i++) {
        configure(table[i].rows);
        int count = fv_moving_read(&config, moving, &error);
        if (count != table[i].count) fail_msg("'%s': %d: %s", table[i].rows, count, error.text);
        if (count == 0) continue;
        const struct fv_moving *m = &moving[count - 1];
        assert_int_equal(m->body, table[i].body);
        assert_int_equal(m->ways, table[i].ways);
        assert_true(m->size_m[m->body == FV_BODY_BOX ? 2 : 0] == table[i].size);
        assert_true(m->seconds == table[i].seconds && m->spin_deg_s[1] == table[i].spin);
    }
}

static void rows_that_are_refused(void **state)
{
    (void)state;
    static char many[40 * 16], ways[FV_ROWS_LONGEST], name[2048];
    for (int i = 0; i <= FV_MOVING_MAX; i++) snprintf(many + strlen(many), 16, "node n%d,", i);
    strcpy(ways, "sphere 1 in 1");
    for (int i = 0; i <= FV_WAYS_MAX; i++) strcat(ways, " at 1 1 1 1");
    snprintf(name, sizeof name, "%0*d", 300, 7);
    const struct {
        const char *rows, *says;
    } table[] = {
        {"ball 1", "--set: scene.moving: row 1: ball: must begin with sphere, box, light or node"},
        {"at 0 0 0 0 sphere 1", "row 1: at: must begin with"},
        {"sphere 1 at 0 0 0 0, sphere", "row 2: sphere needs 1 numbers, has 0"},
        {"light 1 1 at 0 0 0 0", "row 1: at: must be a number, behind light"},
        {"light 1 1 -1 at 0 0 0 0", "row 1: light -1: must be from 0 to 1e+09"},
        {"light 1 1 1", "row 1: says not where"},
        {"sphere x", "row 1: x: must be a number, behind sphere"},
        {"sphere 1m at 0 0 0 0", "1m: must be a number"},
        {"sphere 0 at 0 0 0 0", "row 1: sphere 0: must be from 0.001 to 1e+06"},
        {"sphere -1 at 0 0 0 0", "sphere -1: must be from"},
        {"sphere nan at 0 0 0 0", "sphere nan: must be from"},
        {"sphere inf at 0 0 0 0", "sphere inf: must be from"},
        {"box 1 1 at 0 0 0 0", "at: must be a number, behind box"},
        {"box 1 1 1 at 0 0 0", "at needs 4 numbers, has 3"},
        {"box 1 1 1 at 0 0 0 0 at 2e8 0 0 0 in 1", "at 2e8: must be from -1e+08 to 1e+08"},
        {"box 1 1 1", "row 1: says not where: needs at X Y Z YAW"},
        {"box 1 1 1 at 0 0 0 0 at 1 1 1 1", "row 1: says not in what time: needs in SECONDS"},
        {"box 1 1 1 at 0 0 0 0 in -1", "in -1: must be from 0"},
        {"box 1 1 1 at 0 0 0 0 in 1 in 2", "row 1: in is there twice"},
        {"box 1 1 1 at 0 0 0 0 colour 2 0 0", "colour 2: must be from 0 to 1"},
        {"box 1 1 1 at 0 0 0 0 spin 1 1 1e7", "spin 1e7: must be from"},
        {"box 1 1 1 at 0 0 0 0 blue", "row 1: blue: must be colour, at, in or spin"},
        {"box 1 1 1 sphere 1", "sphere: must be colour, at, in or spin"},
        {"node", "node needs a name"},
        {"node a, node b, node a", "row 3: node a moves already"},
        {many, "row 32: at most 31 rows are possible"},
        {ways, "row 1: more than 32 way points"},
        {name, "0000: must begin with"},
    };
    for (unsigned i = 0; i < sizeof table / sizeof table[0]; i++) {
        configure(table[i].rows);
        if (fv_moving_read(&config, moving, &error) >= 0) fail_msg("'%s' was read", table[i].rows);
        if (!strstr(error.text, table[i].says)) fail_msg("'%s' does not say '%s'", error.text, table[i].says);
        if (strchr(error.text, '\n')) fail_msg("more than a line: %s", error.text);
    }
}

static void settings_over_lines(void **state)
{
    (void)state;
    static const char ini[] = "[scene]\nmoving = sphere 0.3\n   at 0 1 0 0 at 1 1 0 0\n  in 2, node x,\n  box 1 1 1 at 0 0 0 0\n";
    static char path[128], longest[FV_ROWS_LONGEST + 64];
    program_write("moving.ini", ini, strlen(ini));
    snprintf(path, sizeof path, "%s/moving.ini", program_folder());
    struct fv_config_request request = {.files = 1, .file = {path}};
    if (fv_config_load(&config, &request, &error)) fail_msg("%s", error.text);
    assert_string_equal(config.scene_moving,
                        "sphere 0.3 at 0 1 0 0 at 1 1 0 0 in 2, node x, box 1 1 1 at 0 0 0 0");
    assert_int_equal(fv_moving_read(&config, moving, &error), 3);
    memset(longest, ' ', sizeof longest - 1);
    memcpy(longest, "scene.moving=", 13);
    request = (struct fv_config_request){.sets = 1, .set = {longest}};
    assert_int_equal(fv_config_load(&config, &request, &error), -1);
    assert_non_null(strstr(error.text, "scene.moving: longer than"));
}

static void names(void **state)
{
    (void)state;
    static const struct {
        const char *row, *name;
        bool same;
    } table[] = {{"Door", "Door", true},       {"Door", "door", false},  {"Door", "Door.001", false},
                 {"Door.001", "Door", false},  {"a_b", "a b", true},     {"a_b", "a_b", true},
                 {"a_b", "a,b", true},         {"a_b", "aXb", false},    {"a_b", "a\tb", true},
                 {"\xc3\xa9", "\xc3\xa9", true}, {"\xc3\xa9", "_", false}, {"a", "", false}};
    for (unsigned i = 0; i < sizeof table / sizeof table[0]; i++) {
        struct fv_moving m = {.body = FV_BODY_NODE};
        snprintf(m.name, sizeof m.name, "%s", table[i].row);
        if (fv_moving_named(&m, table[i].name) != table[i].same) fail_msg("%s, %s", table[i].row, table[i].name);
    }
}

/* Three times one triangle: it stands; it hangs on `Door 1`, twice as large; it hangs on a child of that. */
static const char gltf[] =
    "{\"asset\":{\"version\":\"2.0\"},\"buffers\":[{\"byteLength\":36,\"uri\":\"data:application/octet-stream;base64,"
    "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA\"}],\"bufferViews\":[{\"buffer\":0,\"byteLength\":36}],"
    "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"}],"
    "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}}]}],"
    "\"nodes\":[{\"mesh\":0},{\"name\":\"Door 1\",\"mesh\":0,\"translation\":[4,5,6],\"scale\":[2,2,2],\"children\":[2]},"
    "{\"mesh\":0,\"name\":\"handle\",\"translation\":[1,0,0]},{\"name\":\"empty\"}],\"scenes\":[{\"nodes\":[0,1,3]}]}";

static int load_gltf(const char *rows)
{
    static char file[128], set[256];
    struct fv_config_request request = {.sets = 3, .set = {file, set, "scene.scale=10"}};
    program_write("door.gltf", gltf, strlen(gltf));
    snprintf(file, sizeof file, "scene.file=%s/door.gltf", program_folder());
    snprintf(set, sizeof set, "scene.moving=%s", rows);
    if (fv_config_load(&config, &request, &error)) fail_msg("%s", error.text);
    return fv_scene_load(&scene, &config, &error);
}

static void nodes_by_name(void **state)
{
    (void)state;
    if (load_gltf("node Door_1 at 0 0 0 90")) fail_msg("%s", error.text);
    const struct fv_object *o = &scene.object[0];
    assert_true(scene.objects == 1 && scene.triangles == 3 && scene.still_triangles == 1 && o->triangles == 2);
    assert_true(scene.features & FV_SCENE_MOVING);
    assert_true(o->moving.origin_m[0] == 40 && o->moving.origin_m[1] == 50 && o->moving.origin_m[2] == 60);
    float low = 1e30f, high = -1e30f;
    for (int64_t i = 3 * o->first; i < 3 * (o->first + o->triangles); i++) {
        float x = scene.position[3 * scene.index[i]];
        low = fminf(low, x), high = fmaxf(high, x);
    }
    assert_true(fabsf(low) < 1e-5f && fabsf(high - 40) < 1e-4f);
    assert_true(o->centre[0] == 20 && o->radius > 20);

    /* What hangs on a moving node moves by its own row where it has one. */
    if (load_gltf("node handle, node Door_1")) fail_msg("%s", error.text);
    assert_true(scene.objects == 2 && scene.object[0].triangles == 1 && scene.object[1].triangles == 1);
    assert_true(scene.object[0].moving.origin_m[0] == 60 && scene.object[1].moving.origin_m[0] == 40);
    if (load_gltf("node empty")) fail_msg("%s", error.text); /* nothing to see, nothing to trace */
    assert_true(scene.objects == 1 && scene.object[0].triangles == 0 && !(scene.features & FV_SCENE_MOVING));
    assert_int_equal(load_gltf("node gate"), -1);
    assert_non_null(strstr(error.text, "scene.moving: the scene has no node gate"));
}

static void bad_rows_end_the_program(void **state)
{
    (void)state;
    static const char *const bad[] = {"sphere 0 at 0 0 0 0", "node gate", "cone 1"};
    for (unsigned i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        struct program_result r = program("run --set scene.name=cornell --set 'scene.moving=%s' --frames 1", bad[i]);
        assert_int_equal(r.code, 2);
        assert_non_null(strstr(r.errors, "scene.moving: "));
    }
}

#define BODIES                                                                                                   \
    "--set 'scene.moving=sphere 0.2 at -1 1 0 0 at 1 1 0 0 in 0.2, box 0.3 0.4 0.5 at 0 2 -0.5 0 spin 90 400 0' "

static void runs_again_and_allocates_nothing(void **state)
{
    (void)state;
    static const char *const methods[] = {"full", "reproject"};
    for (int m = 0; m < 2; m++) {
        char command[512];
        struct program_result r = program("run --set scene.name=cornell " BODIES "--set display.headset=small "
                                          "--set threads.sealed_heap=fatal --set method.name=%s --frames 6 --out %s",
                                          methods[m], methods[m]);
        if (r.code) fail_msg("exit %d: %s", r.code, r.errors);
        r = program("replay %s --out again", methods[m]);
        if (r.code) fail_msg("exit %d: %s", r.code, r.errors);
        snprintf(command, sizeof command,
                 "cd %s && grep -q '\"heap_calls\":0' %s/report.json && ! cmp -s %s/left-00002.png %s/left-00003.png && "
                 "for f in %s/*.png; do cmp $f again/${f#*/} || exit 1; done",
                 program_folder(), methods[m], methods[m], methods[m], methods[m]);
        if (system(command)) fail_msg("%s", command);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rows_that_are_read),       cmocka_unit_test(rows_that_are_refused),
        cmocka_unit_test(settings_over_lines),      cmocka_unit_test(names),
        cmocka_unit_test(nodes_by_name),            cmocka_unit_test(bad_rows_end_the_program),
        cmocka_unit_test(runs_again_and_allocates_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
