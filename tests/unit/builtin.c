/* builtin: the procedural scenes: what they must hold, that they hold nothing broken, that surfaces
 * face outwards, and that building one twice gives the same bytes. */
#include "rt/scene/build.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* Loaded once for all tests: the arena gives nothing back. */
static struct fv_scene atrium, again, cornell, pipes, pipes_again, more_pipes, forest, forest_again;

static void load(struct fv_scene *scene, const char *name, double detail)
{
    struct fv_error error = {""};
    struct fv_build *build = fv_build_create(name);
    memset(scene, 0, sizeof *scene);
    if (fv_builtin_read(build, name, detail, &error) || fv_build_finish(build, scene, &error))
        fail_msg("%s", error.text);
}

static int load_all(void **state)
{
    (void)state;
    load(&atrium, "atrium", 1);
    load(&again, "atrium", 1);
    load(&cornell, "cornell", 1);
    load(&pipes, "pipes", 0.02);
    load(&pipes_again, "pipes", 0.02);
    load(&more_pipes, "pipes", 0.1);
    load(&forest, "forest", 0.1);
    load(&forest_again, "forest", 0.1);
    return 0;
}

static void test_unknown_name(void **state)
{
    (void)state;
    static const char *const names[] = {"", "Atrium", "atrium ", "cornell.ini", "%s%n"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        struct fv_error error = {""};
        struct fv_build *build = fv_build_create("nothing");
        assert_int_equal(fv_builtin_read(build, names[i], 1, &error), -1);
        assert_non_null(strstr(error.text, "builtin:atrium"));
        fv_build_destroy(build);
    }
}

static void test_features(void **state)
{
    (void)state;
    static const struct {
        const struct fv_scene *scene;
        uint32_t features;
        int64_t triangles_min, triangles_max, masked_min;
        int materials_min, textures_min, lights;
        float low[3], high[3]; /* bounds, to a metre */
    } rows[] = {
        {&atrium,
         FV_SCENE_TEXTURES | FV_SCENE_NORMAL_MAPS | FV_SCENE_ALPHA | FV_SCENE_SPECULAR | FV_SCENE_MIRRORS |
             FV_SCENE_GLASS | FV_SCENE_EMISSIVE | FV_SCENE_POINT_LIGHTS | FV_SCENE_AREA_LIGHTS,
         250000,
         600000,
         4000,
         15,
         9,
         2,
         {-12.5f, 0, -6.5f},
         {12.5f, 10, 6.5f}},
        {&cornell,
         FV_SCENE_MIRRORS | FV_SCENE_GLASS | FV_SCENE_EMISSIVE | FV_SCENE_AREA_LIGHTS,
         30,
         10000,
         0,
         6,
         0,
         1,
         {-1.4f, 0, -1.4f},
         {1.4f, 2.8f, 1.4f}},
        {&pipes,
         FV_SCENE_SPECULAR | FV_SCENE_MIRRORS | FV_SCENE_EMISSIVE,
         300000,
         500000,
         0,
         25,
         0,
         0,
         {-400, -0.2f, -400},
         {400, 60, 400}},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        const struct fv_scene *s = rows[i].scene;
        assert_int_equal(s->features, rows[i].features);
        assert_true(s->triangles >= rows[i].triangles_min);
        assert_true(s->triangles <= rows[i].triangles_max);
        assert_true(s->triangles - s->opaque_triangles >= rows[i].masked_min);
        assert_true(s->materials >= rows[i].materials_min);
        assert_true(s->textures >= rows[i].textures_min);
        assert_int_equal(s->lights, rows[i].lights);
        for (int k = 0; k < 3; k++) {
            assert_float_equal(s->bounds[0][k], rows[i].low[k], 1);
            assert_float_equal(s->bounds[1][k], rows[i].high[k], 1);
        }
    }
}

static void check_finite(const float *value, int64_t count)
{
    for (int64_t i = 0; i < count; i++)
        if (!isfinite(value[i])) fail_msg("value %lld of %lld is not finite", (long long)i, (long long)count);
}

static void check_records(const struct fv_scene *s)
{
    check_finite(s->position, 3 * s->vertices);
    for (int64_t i = 0; i < 3 * s->triangles; i++) assert_true(s->index[i] < s->vertices);
    for (int64_t i = 0; i < s->triangles; i++) {
        const struct fv_triangle *t = &s->triangle[i];
        check_finite(&t->uv[0][0], 6);
        check_finite(&t->uv_per_metre, 1);
        assert_true(t->material < s->materials);
        assert_int_equal(i >= s->opaque_triangles, !!(s->material[t->material].flags & FV_MATERIAL_MASKED));
    }
    for (int i = 0; i < s->materials; i++) {
        const struct fv_material *m = &s->material[i];
        for (int k = 0; k < 3; k++) {
            assert_true(m->diffuse[k] >= 0 && m->mirror[k] >= 0 && m->transmission[k] >= 0 &&
                        m->emission[k] >= 0);
            /* No surface gives back more than it gets; a leaf's tint lightens a dark texture. */
            float reflected = m->mirror[k] + m->transmission[k] + m->specular[k];
            if (!(m->flags & FV_MATERIAL_TEXTURED)) reflected += m->diffuse[k];
            assert_true(reflected <= 1.4f);
        }
        assert_true(m->base_texture < s->textures && m->normal_texture < s->textures &&
                    m->alpha_texture < s->textures);
    }
    for (int i = 0; i < s->lights; i++)
        for (int k = 0; k < 3; k++) assert_true(isfinite(s->light[i].colour[k]) && s->light[i].colour[k] > 0);
}

static void test_records(void **state)
{
    (void)state;
    check_records(&atrium);
    check_records(&cornell);
    check_records(&pipes);
    check_records(&forest);
}

static void corners(const struct fv_scene *s, int64_t triangle, double p[3][3])
{
    for (int k = 0; k < 3; k++)
        for (int j = 0; j < 3; j++) p[k][j] = s->position[3 * s->index[3 * triangle + k] + j];
}

/* Twice the triangle's area along its normal. */
static void area_vector(double p[3][3], double out[3])
{
    for (int j = 0; j < 3; j++) {
        int a = (j + 1) % 3, b = (j + 2) % 3;
        out[j] = (p[1][a] - p[0][a]) * (p[2][b] - p[0][b]) - (p[1][b] - p[0][b]) * (p[2][a] - p[0][a]);
    }
}

/* Shading normals lie on the side that the triangle's winding says is outside. */
static void check_facing(const struct fv_scene *s)
{
    int64_t wrong = 0;
    for (int64_t i = 0; i < s->triangles; i++) {
        double p[3][3], n[3];
        corners(s, i, p);
        area_vector(p, n);
        for (int k = 0; k < 3; k++) {
            const int16_t *given = s->triangle[i].normal[k];
            wrong += n[0] * given[0] + n[1] * given[1] + n[2] * given[2] < 0;
        }
    }
    if (wrong > s->triangles / 1000) fail_msg("%lld corners face inwards", (long long)wrong);
}

static void test_facing(void **state)
{
    (void)state;
    check_facing(&atrium);
    check_facing(&cornell);
    check_facing(&pipes);
    check_facing(&forest);
}

/* Of the plant: curved surfaces are smooth, so that at every corner the normal, of unit length, lies near the
 * triangle's own; and no triangle is a sliver thinner than a tenth of a millimetre. */
static void test_smooth(void **state)
{
    (void)state;
    for (int64_t i = 0; i < pipes.triangles; i++) {
        double p[3][3], n[3], longest = 0;
        corners(&pipes, i, p);
        area_vector(p, n);
        double area = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        for (int k = 0; k < 3; k++) {
            const int16_t *g = pipes.triangle[i].normal[k];
            double length = sqrt((double)g[0] * g[0] + (double)g[1] * g[1] + (double)g[2] * g[2]);
            assert_true(fabs(length - 32767) < 2);
            assert_true(n[0] * g[0] + n[1] * g[1] + n[2] * g[2] > 0.75 * length * area);
            double edge = 0;
            for (int j = 0; j < 3; j++) edge += (p[(k + 1) % 3][j] - p[k][j]) * (p[(k + 1) % 3][j] - p[k][j]);
            longest = fmax(longest, sqrt(edge));
        }
        assert_true(area > 1e-4 * longest);
    }
}

/* Detail adds pipes, and leaves the site as it is. */
static void test_detail(void **state)
{
    (void)state;
    assert_true(more_pipes.triangles > pipes.triangles + 200000);
    assert_memory_equal(pipes.bounds, more_pipes.bounds, sizeof pipes.bounds);
    assert_int_equal(pipes.materials, more_pipes.materials);
}

/* Glass must enclose a volume: a ray that goes in must come out. Summed over a closed surface the
 * area vectors vanish, and the volume is positive when they point outwards. */
static void check_glass(const struct fv_scene *s, double volume_min)
{
    double sum[3] = {0}, area = 0, volume = 0;
    for (int64_t i = 0; i < s->triangles; i++) {
        if (!(s->material[s->triangle[i].material].flags & FV_MATERIAL_GLASS)) continue;
        double p[3][3], n[3];
        corners(s, i, p);
        area_vector(p, n);
        area += sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        for (int j = 0; j < 3; j++) {
            sum[j] += n[j];
            volume += p[0][j] * n[j] / 6;
        }
    }
    assert_true(area > 0);
    for (int j = 0; j < 3; j++) assert_true(fabs(sum[j]) < 1e-5 * area);
    assert_true(volume > volume_min);
}

static void test_glass_closed(void **state)
{
    (void)state;
    check_glass(&atrium, 0.11); /* a sphere of 0.3 m has 0.113 m3 */
    check_glass(&cornell, 0.14);
}

/* Texels a metre over the opaque textured surface, weighted by area. */
static void test_texel_density(void **state)
{
    (void)state;
    double inside = 0, all = 0;
    for (int64_t i = 0; i < atrium.opaque_triangles; i++) {
        const struct fv_material *m = &atrium.material[atrium.triangle[i].material];
        if (!(m->flags & FV_MATERIAL_TEXTURED)) continue;
        double p[3][3], n[3],
            density = atrium.triangle[i].uv_per_metre * atrium.texture[m->base_texture].width;
        corners(&atrium, i, p);
        area_vector(p, n);
        double area = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        all += area;
        if (density > 150 && density < 600) inside += area;
    }
    assert_true(all > 0);
    assert_true(inside / all > 0.95);
}

/* The leaves' mask has holes and leaves, and colours differ within every texture. */
static void test_textures(void **state)
{
    (void)state;
    for (int i = 0; i < atrium.materials; i++) {
        const struct fv_material *m = &atrium.material[i];
        if (m->flags & FV_MATERIAL_MASKED) {
            const struct fv_texture *t = &atrium.texture[m->alpha_texture];
            int texels = t->width * t->height, there = 0;
            for (int k = 0; k < texels; k++) there += (t->texel[k] & 255) >= 255 * m->alpha_cutoff;
            assert_true(there > texels / 5 && there < texels * 4 / 5);
        }
    }
    for (int i = 0; i < atrium.textures; i++) {
        const struct fv_texture *t = &atrium.texture[i];
        int same = 0, texels = t->width * t->height;
        for (int k = 1; k < texels; k++) same += t->texel[k] == t->texel[0];
        assert_true(same < texels * 9 / 10);
    }
}

/* FNV-1a. */
static uint64_t hash(uint64_t h, const void *bytes, size_t size)
{
    for (size_t i = 0; i < size; i++) h = (h ^ ((const uint8_t *)bytes)[i]) * 0x100000001b3u;
    return h;
}

static uint64_t hash_scene(const struct fv_scene *s)
{
    uint64_t h = hash(0xcbf29ce484222325u, s->position, (size_t)s->vertices * 12);
    h = hash(h, s->index, (size_t)s->triangles * 12);
    h = hash(h, s->triangle, (size_t)s->triangles * sizeof *s->triangle);
    h = hash(h, s->material, (size_t)s->materials * sizeof *s->material);
    h = hash(h, s->light, (size_t)s->lights * sizeof *s->light);
    for (int i = 0; i < s->textures; i++)
        h = hash(h, s->texture[i].texel, (size_t)s->texture[i].width * (size_t)s->texture[i].height * 4);
    return h;
}

static void test_repeatable(void **state)
{
    (void)state;
    assert_true(hash_scene(&atrium) == hash_scene(&again));
    assert_true(hash_scene(&pipes) == hash_scene(&pipes_again));
    assert_true(hash_scene(&forest) == hash_scene(&forest_again));
    assert_false(hash_scene(&atrium) == hash_scene(&cornell));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_unknown_name), cmocka_unit_test(test_features),
        cmocka_unit_test(test_records),      cmocka_unit_test(test_facing),
        cmocka_unit_test(test_glass_closed), cmocka_unit_test(test_texel_density),
        cmocka_unit_test(test_textures),     cmocka_unit_test(test_repeatable),
        cmocka_unit_test(test_smooth),       cmocka_unit_test(test_detail),
    };
    return cmocka_run_group_tests(tests, load_all, NULL);
}
