/* forest: what the scene promises: triangles, masked leaves and 80 point lights in the open; ground that is level along the
 * path; a path on which nobody runs into a tree; and detail that changes leaves only. */
#include "rt/scene/builtin_forest.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

static struct fv_scene forest, sparse;

static void load(struct fv_scene *scene, double detail)
{
    struct fv_error error = {""};
    struct fv_build *build = fv_build_create("forest");
    memset(scene, 0, sizeof *scene);
    if (fv_forest_read(build, detail, &error) || fv_build_finish(build, scene, &error)) fail_msg("%s", error.text);
}

static int load_both(void **state)
{
    (void)state;
    load(&forest, 1);
    load(&sparse, 0.1);
    return 0;
}

static void test_contents(void **state)
{
    (void)state;
    assert_true(forest.triangles >= 190000 && forest.triangles < 500000);
    assert_true(forest.triangles - forest.opaque_triangles > 100000);
    assert_int_equal(forest.features, FV_SCENE_TEXTURES | FV_SCENE_ALPHA | FV_SCENE_EMISSIVE | FV_SCENE_POINT_LIGHTS);
    for (int k = 0; k < 3; k += 2) {
        assert_true(forest.bounds[0][k] <= -FV_FOREST_HALF && forest.bounds[0][k] > -40);
        assert_true(forest.bounds[1][k] >= FV_FOREST_HALF && forest.bounds[1][k] < 40);
    }
    assert_true(forest.bounds[0][1] > -2 && forest.bounds[1][1] > 8 && forest.bounds[1][1] < 20);
}

/* In the open: above the ground, and not inside their own lamps. */
static void test_lights(void **state)
{
    (void)state;
    assert_int_equal(forest.lights, 80);
    for (int i = 0; i < forest.lights; i++) {
        const struct fv_light *l = &forest.light[i];
        double nearest = 1;
        assert_int_equal(l->kind, FV_LIGHT_POINT);
        assert_true(l->position[1] > fv_forest_height(l->position[0], l->position[2]) + 0.3f);
        assert_true(l->colour[0] > 0 && l->colour[1] > 0 && l->colour[2] > 0 && l->colour[0] < 5);
        for (int64_t t = 0; t < forest.opaque_triangles; t++) {
            if (!(forest.material[forest.triangle[t].material].flags & FV_MATERIAL_EMISSIVE)) continue;
            for (int k = 0; k < 3; k++) {
                const float *p = &forest.position[3 * forest.index[3 * t + k]];
                nearest = fmin(nearest, hypot(hypot((double)(p[0] - l->position[0]), (double)(p[1] - l->position[1])), (double)(p[2] - l->position[2])));
            }
        }
        assert_true(nearest > 0.015 && nearest < 0.05);
    }
}

static void test_ground(void **state)
{
    (void)state;
    double highest = 0;
    for (float z = -FV_FOREST_HALF; z <= FV_FOREST_HALF; z += 0.25f) {
        for (float x = -FV_FOREST_HALF; x <= FV_FOREST_HALF; x += 0.25f) {
            float h = fv_forest_height(x, z);
            assert_true(h > -1 && h < 8);
            assert_true(fabsf(fv_forest_height(x + 0.05f, z) - h) < 0.12f && fabsf(fv_forest_height(x, z + 0.05f) - h) < 0.12f);
            highest = fmax(highest, (double)h);
        }
        for (float aside = -1.4f; aside <= 1.4f; aside += 0.1f) assert_true(fv_forest_height(fv_forest_path_x(z) + aside, z) == 0);
    }
    assert_true(highest > 3);
}

/* Of what is solid nothing comes within half a metre of a head on the path. */
static void test_path_is_free(void **state)
{
    (void)state;
    for (int64_t t = 0; t < forest.opaque_triangles; t++)
        for (int k = 0; k < 3; k++) {
            const float *p = &forest.position[3 * forest.index[3 * t + k]];
            if (p[1] > 1.2f && p[1] < 2.1f && fabsf(p[2]) < 23 && fabsf(p[0] - fv_forest_path_x(p[2])) < 0.5f)
                fail_msg("something solid at %g %g %g", (double)p[0], (double)p[1], (double)p[2]);
        }
}

static void test_detail(void **state)
{
    (void)state;
    int64_t leaves = forest.triangles - forest.opaque_triangles, fewer = sparse.triangles - sparse.opaque_triangles;
    assert_int_equal(forest.opaque_triangles, sparse.opaque_triangles);
    assert_true(fewer > 0 && fewer < leaves / 4);
    assert_int_equal(forest.materials, sparse.materials);
    assert_int_equal(sparse.lights, 80);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_contents), cmocka_unit_test(test_lights), cmocka_unit_test(test_ground),
                                       cmocka_unit_test(test_path_is_free), cmocka_unit_test(test_detail)};
    return cmocka_run_group_tests(tests, load_both, NULL);
}
