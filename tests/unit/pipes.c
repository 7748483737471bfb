/* pipes: the plant of pipes from the inside: ways of bundles keep to free cells and turn at right angles, and
 * a pipe's mantle has no hole at its bends and keeps its radius. */
#include "rt/scene/builtin_pipes.h"

#include "rt/scene/builtin_random.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static struct fv_pipes plant;

/* Walks a route and counts its cells; each must be the bundle's own. */
static int walk(const struct fv_pipes_route *route, int bundle)
{
    int cells = 1, axis_before = -1;
    assert_true(route->legs > 0 && route->legs <= FV_PIPES_LEGS_MAX);
    for (int leg = 0; leg < route->legs; leg++) {
        const int *from = route->corner[leg], *to = route->corner[leg + 1];
        int axis = -1, at[3] = {from[0], from[1], from[2]};
        for (int i = 0; i < 3; i++) {
            if (from[i] == to[i]) continue;
            assert_int_equal(axis, -1);
            axis = i;
        }
        assert_int_not_equal(axis, -1);
        assert_int_not_equal(axis, axis_before);
        /* Legs of two cells are long enough for the widest bends at both ends. */
        assert_true(abs(to[axis] - from[axis]) >= 2);
        for (axis_before = axis; at[axis] != to[axis]; cells++) {
            at[axis] += to[axis] > from[axis] ? 1 : -1;
            assert_int_equal(fv_pipes_at(&plant, at[0], at[1], at[2]), bundle);
        }
    }
    return cells;
}

static void test_routes(void **state)
{
    (void)state;
    int found = 0, cells[3] = {0};
    memset(&plant, 0, sizeof plant);
    fv_pipes_reserve(&plant);
    for (int i = 0; i < 200; i++) {
        uint32_t random = fv_random_stream(i);
        struct fv_pipes_route route;
        if (!fv_pipes_find_route(&plant, FV_PIPES_BUNDLE + i, &random, &route)) continue;
        cells[0] += walk(&route, FV_PIPES_BUNDLE + i);
        found++;
    }
    assert_true(found > 150);
    for (int x = 0; x < FV_PIPES_NX; x++)
        for (int y = 0; y < FV_PIPES_NY; y++)
            for (int z = 0; z < FV_PIPES_NZ; z++) {
                int what = fv_pipes_at(&plant, x, y, z);
                cells[1] += what >= FV_PIPES_BUNDLE;
                bool aisle = z / 2 == FV_PIPES_AISLE / 2 && y % FV_PIPES_STOREY < 2 && z == FV_PIPES_AISLE;
                if (aisle) assert_int_equal(what, FV_PIPES_WALKWAY);
            }
    /* No two bundles share a cell; those that found no way leave their first one. */
    assert_true(cells[1] >= cells[0] && cells[1] <= cells[0] + 200 - found);
    assert_int_equal(fv_pipes_at(&plant, -1, 0, 0), FV_PIPES_STRUCTURE);
    assert_int_equal(fv_pipes_at(&plant, 0, FV_PIPES_NY, 0), FV_PIPES_STRUCTURE);
}

/* How far p lies from the segment from a to b. */
static double distance(const float p[3], vec3s a, vec3s b)
{
    vec3s q = fv_vec(p[0], p[1], p[2]), way = glms_vec3_sub(b, a);
    float t = glms_vec3_dot(glms_vec3_sub(q, a), way) / glms_vec3_norm2(way);
    return glms_vec3_distance(q, glms_vec3_lerp(a, b, fminf(fmaxf(t, 0), 1)));
}

/* A thin pipe that turns twice, along x, up, and along z, too short for anything to sit on it. */
static void test_mantle(void **state)
{
    (void)state;
    enum { SIDES = 12, RINGS = 16, VERTICES = SIDES * RINGS };
    static unsigned char edges[VERTICES][VERTICES];
    struct fv_error error = {""};
    struct fv_scene scene = {.triangles = 0};
    struct fv_build *build = fv_build_create("pipe");
    struct fv_material grey = fv_material_default();
    struct fv_brush brush = {build, glms_mat4_identity(), fv_build_material(build, &grey), 1};
    vec3s x = fv_vec(1, 0, 0), y = fv_vec(0, 1, 0), z = fv_vec(0, 0, 1), none = fv_vec(0, 0, 0);
    const float radius = 0.04f;
    struct fv_pipes_line line = {&brush,
                                 &brush,
                                 &brush,
                                 radius,
                                 3,
                                 {{{0}}},
                                 {y, glms_vec3_negate(x), glms_vec3_negate(x)},
                                 {z, z, glms_vec3_negate(y)},
                                 {none, none, none}};
    line.knot[1] = fv_vec(0.36f, 0, 0);
    line.knot[2] = fv_vec(0.36f, 0.36f, 0);
    line.knot[3] = fv_vec(0.36f, 0.36f, 0.36f);
    uint32_t random = 1;
    fv_pipes_lay_line(&line, &random);
    assert_int_equal(fv_build_finish(build, &scene, &error), 0);

    double widest = 0, narrowest = 1;
    for (int i = 0; i < VERTICES; i++) {
        double d = 1;
        for (int leg = 0; leg < 3; leg++)
            d = fmin(d, distance(&scene.position[3 * i], line.knot[leg], line.knot[leg + 1]));
        widest = fmax(widest, d);
        narrowest = fmin(narrowest, d);
    }
    /* A bend of three radii: its inside comes to 3 - 2 sqrt(1/2) of them from the legs, its outside to 3 - 4
     * sqrt(1/2). */
    assert_true(widest < 1.6 * radius && narrowest > 0.16 * radius);
    for (int64_t i = 0; i < 3 * scene.triangles; i++) {
        uint32_t a = scene.index[i], b = scene.index[i % 3 == 2 ? i - 2 : i + 1];
        if (a < VERTICES && b < VERTICES) edges[a][b]++;
    }
    int open = 0;
    for (int a = 0; a < VERTICES; a++)
        for (int b = 0; b < VERTICES; b++) {
            assert_true(edges[a][b] <= 1);
            open += edges[a][b] && !edges[b][a];
        }
    assert_int_equal(open, 2 * SIDES);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_routes), cmocka_unit_test(test_mantle)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
