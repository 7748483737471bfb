/* build: what a scene is checked for and how it is laid out; textures' mip chains; pictures. */
#include "rt/scene/build.h"
#include "rt/scene/texture.h"
#include "tests/support/random.h"

#include <math.h>
#include <png.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <turbojpeg.h>

#include <cmocka.h>

static void assert_close(double value, double wanted, double most)
{
    if (!(fabs(value - wanted) <= most)) fail_msg("%.9g, wanted %.9g +- %g", value, wanted, most);
}

static void assert_says(const struct fv_error *error, const char *wanted)
{
    if (!strstr(error->text, wanted)) fail_msg("message '%s' does not say '%s'", error->text, wanted);
}

static struct fv_scene scene;

/* A triangle with its own three vertices. */
static void add(struct fv_build *b, const float p[3][3], const float uv[3][2], int material)
{
    uint32_t v[3];
    for (int k = 0; k < 3; k++) {
        struct fv_vertex vertex = {.position = {p[k][0], p[k][1], p[k][2]}};
        if (uv) memcpy(vertex.uv, uv[k], sizeof vertex.uv);
        v[k] = fv_build_vertex(b, &vertex);
    }
    fv_build_triangle(b, v[0], v[1], v[2], material);
}

static const float corner_xy[3][3] = {{0, 0, 0}, {2, 0, 0}, {0, 2, 0}};

static struct fv_build *start(void)
{
    struct fv_build *b = fv_build_create("test");
    struct fv_material grey = fv_material_default();
    assert_int_equal(fv_build_material(b, &grey), 0);
    return b;
}

static void finish(struct fv_build *b)
{
    struct fv_error error;
    memset(&scene, 0, sizeof scene);
    if (fv_build_finish(b, &scene, &error)) fail_msg("%s", error.text);
}

/* What is counted is not kept; what was there before is, and stays first. */
static void rehearsed_scenes_are_the_same(void **state)
{
    (void)state;
    const float other[3][3] = {{0, 0, 1}, {3, 0, 1}, {0, 3, 1}};
    struct fv_build *b = start();
    add(b, corner_xy, NULL, 0);
    for (int pass = 0; pass < 2; pass++) {
        fv_build_rehearse(b, pass == 0);
        assert_int_equal(fv_build_vertices(b), 3);
        for (int i = 0; i < 1000; i++) add(b, other, NULL, 0);
        assert_int_equal(fv_build_vertices(b), 3003);
    }
    add(b, corner_xy, NULL, 0);
    finish(b);
    assert_int_equal(scene.triangles, 1002);
    assert_int_equal(scene.vertices, 3006);
    assert_float_equal(scene.position[3], 2, 0);
    for (int i = 1; i <= 1000; i++) assert_float_equal(scene.position[9 * i + 3], 3, 0);
    assert_float_equal(scene.position[9 * 1001 + 3], 2, 0);
}

static void rejects_what_cannot_be_traced(void **state)
{
    (void)state;
    static const struct {
        const char *name, *says;
        float p[3][3], uv[3][2];
    } bad[] = {
        {"NaN", "not finite", {{NAN, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0}}},
        {"infinite", "vertex 2", {{0, 0, 0}, {1, 0, 0}, {0, -INFINITY, 0}}, {{0}}},
        {"uv", "not finite", {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 0}, {0, NAN}, {0, 0}}},
        {"point", "no triangles", {{1, 1, 1}, {1, 1, 1}, {1, 1, 1}}, {{0}}},
        {"line", "no area", {{0, 0, 0}, {1, 1, 1}, {3, 3, 3}}, {{0}}},
    };
    struct fv_error error;
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        struct fv_build *b = start();
        add(b, bad[i].p, bad[i].uv, 0);
        assert_int_equal(fv_build_finish(b, &scene, &error), -1);
        assert_says(&error, "test: ");
        assert_says(&error, bad[i].says);
    }
    assert_int_equal(fv_build_finish(start(), &scene, &error), -1);
    assert_says(&error, "holds no triangles");

    struct fv_build *b = start();
    struct fv_material m = fv_material_default();
    m.emission[1] = INFINITY;
    add(b, corner_xy, NULL, fv_build_material(b, &m));
    assert_int_equal(fv_build_finish(b, &scene, &error), -1);
    assert_says(&error, "material 1");

    b = start();
    m = fv_material_default();
    for (int i = 0; i < FV_MATERIALS_MAX; i++) fv_build_material(b, &m);
    add(b, corner_xy, NULL, 0);
    assert_int_equal(fv_build_finish(b, &scene, &error), -1);
    assert_says(&error, "65536 materials");
}

static void extreme_sizes_are_kept(void **state)
{
    (void)state;
    static const float sizes[] = {1e-19f, 1e-6f, 1, 1e6f, 1e18f, 3e38f};
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        float s = sizes[i], p[3][3] = {{0, 0, 0}, {s, 0, 0}, {0, s, 0}};
        const float uv[3][2] = {{-1e6f, 1e6f}, {1e6f, 1e6f}, {-1e6f, -1e6f}};
        struct fv_build *b = start();
        add(b, p, uv, 0);
        finish(b);
        assert_int_equal(scene.triangles, 1);
        assert_true(isfinite(scene.triangle[0].uv_per_metre));
        assert_int_equal(scene.triangle[0].normal[0][2], 32767);
        assert_int_equal(scene.triangle[0].tangent[0], 32767);
        assert_close(scene.bounds[1][1], s, 0);
    }
}

static void opaque_first_order_kept(void **state)
{
    (void)state;
    struct fv_build *b = start();
    struct fv_material m = fv_material_default();
    const uint8_t pixel = 100;
    m.alpha_texture = fv_build_texture(b, FV_TEXEL_ALPHA, &pixel, 1, 1, 1, 0.5f);
    int masked = fv_build_material(b, &m);
    const int order[] = {masked, 0, masked, 0, 0};
    for (int i = 0; i < 5; i++) {
        float z = (float)i, p[3][3] = {{0, 0, z}, {1, 0, z}, {0, 1, z}},
              line[3][3] = {{0, 0, z}, {0, 0, z}, {0, 1, 50}};
        add(b, p, NULL, order[i]);
        add(b, line, NULL, order[i]);
    }
    finish(b);
    assert_int_equal(scene.triangles, 5);
    assert_int_equal(scene.opaque_triangles, 3);
    const float z[] = {1, 3, 4, 0, 2};
    for (int i = 0; i < 5; i++) {
        assert_close(scene.position[3 * scene.index[3 * i] + 2], z[i], 0);
        assert_int_equal(scene.triangle[i].material, i < 3 ? 0 : masked);
    }
    assert_close(scene.bounds[1][2], 4, 0); /* what was dropped does not count */
    assert_int_equal(scene.features, FV_SCENE_ALPHA);
    assert_int_equal(scene.material[masked].flags, FV_MATERIAL_MASKED);
}

static void normals_and_tangents(void **state)
{
    (void)state;
    /* Positions are corner_xy, normal +z. Upright picture: u to the right, v down. */
    static const struct {
        float uv[3][2];
        int tangent[3], sign; /* tangent 0 0 0: any at right angles to z */
        float per_metre;
    } rows[] = {
        {{{0, 1}, {1, 1}, {0, 0}}, {1, 0, 0}, 1, 0.5f},
        {{{0, 0}, {1, 0}, {0, 1}}, {1, 0, 0}, -1, 0.5f},  /* upside down */
        {{{1, 1}, {0, 1}, {1, 0}}, {-1, 0, 0}, -1, 0.5f}, /* mirrored */
        {{{0, 0}, {0, 8}, {8, 0}}, {0, 1, 0}, 1, 4},
        {{{5, 5}, {5, 5}, {5, 5}}, {0, 0, 0}, 1, 0},
        {{{0, 0}, {1, 1}, {2, 2}}, {0, 0, 0}, 1, 0},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        struct fv_build *b = start();
        add(b, corner_xy, rows[i].uv, 0);
        finish(b);
        const struct fv_triangle *t = scene.triangle;
        bool any = !rows[i].tangent[0] && !rows[i].tangent[1];
        for (int k = 0; k < 3; k++) {
            if (!any) assert_int_equal(t->tangent[k], 32767 * rows[i].tangent[k]);
            assert_memory_equal(t->uv[k], rows[i].uv[k], sizeof t->uv[k]);
        }
        assert_int_equal(t->tangent[2], 0);
        assert_close(hypot(t->tangent[0], t->tangent[1]), 32767, 1);
        assert_int_equal(t->bitangent_sign, rows[i].sign);
        assert_close(t->uv_per_metre, rows[i].per_metre, 1e-6);
    }
    struct fv_build *b = start();
    const float given[3][3] = {{0, 30, 40}, {NAN, 0, 1}, {0, 0, 0}};
    for (int k = 0; k < 3; k++) {
        struct fv_vertex v = {.position = {corner_xy[k][0], corner_xy[k][1], 0}};
        memcpy(v.normal, given[k], sizeof v.normal);
        fv_build_vertex(b, &v);
    }
    fv_build_triangle(b, 0, 2, 1, 0); /* turned round: its own normal is -z */
    finish(b);
    const int16_t(*n)[3] = scene.triangle[0].normal;
    assert_int_equal(n[0][1], 19660);
    assert_int_equal(n[0][2], 26214);
    assert_int_equal(n[1][2], -32767);
    assert_int_equal(n[2][2], -32767);
}

static void flags_follow_the_fields(void **state)
{
    (void)state;
    struct fv_build *b = start();
    struct fv_material m = fv_material_default();
    m.flags = 0xffff;
    m.specular[2] = 0.1f, m.mirror[0] = 0.2f, m.transmission[1] = 1, m.emission[0] = 9;
    m.shininess = INFINITY, m.ior = 0, m.alpha_cutoff = 7;
    add(b, corner_xy, NULL, fv_build_material(b, &m));
    struct fv_error error;
    const struct fv_light sun = {.kind = FV_LIGHT_SUN, .position = {0, 3, 4}, .colour = {1, 1, 1}};
    assert_int_equal(fv_build_light(b, &sun, &error), 0);
    finish(b);
    const struct fv_material *made = &scene.material[1];
    assert_int_equal(made->flags,
                     FV_MATERIAL_SPECULAR | FV_MATERIAL_MIRROR | FV_MATERIAL_GLASS | FV_MATERIAL_EMISSIVE);
    assert_int_equal(scene.features, made->flags | FV_SCENE_SUN);
    assert_close(made->shininess, FV_SHININESS_MAX, 0);
    assert_close(made->ior, 1, 0);
    assert_close(made->alpha_cutoff, 1, 0);
    assert_close(scene.light[0].position[1], 0.6, 1e-7);
}

static void bad_lights(void **state)
{
    (void)state;
    static const struct {
        struct fv_light light;
        const char *says;
    } rows[] = {
        {{FV_LIGHT_POINT, {NAN, 0, 0}, {0}, {0}, {1, 1, 1}}, "not finite"},
        {{FV_LIGHT_POINT, {0, 0, 0}, {0}, {0}, {1, INFINITY, 1}}, "not finite"},
        {{FV_LIGHT_POINT, {0, 0, 0}, {0}, {0}, {1, -1, 1}}, "negative"},
        {{FV_LIGHT_SUN, {0, 0, 0}, {0}, {0}, {1, 1, 1}}, "no length"},
        {{FV_LIGHT_AREA, {0, 0, 0}, {1, 1, 0}, {2, 2, 0}, {1, 1, 1}}, "no area"},
    };
    struct fv_build *b = start();
    struct fv_error error;
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        assert_int_equal(fv_build_light(b, &rows[i].light, &error), -1);
        assert_says(&error, rows[i].says);
    }
    const struct fv_light good = {.colour = {1, 1, 1}};
    for (int i = 0; i < FV_LIGHTS_MAX; i++) assert_int_equal(fv_build_light(b, &good, &error), 0);
    assert_int_equal(fv_build_light(b, &good, &error), -1);
    assert_says(&error, "more than 256");
    fv_build_destroy(b);
}

/* Rows may have spare texels at their end: how long they are follows from where the next level begins. */
static uint32_t texel(const struct fv_texture *t, int level, int x, int y)
{
    int height = t->height >> level > 1 ? t->height >> level : 1;
    uint32_t row = level + 1 < t->levels ? (t->offset[level + 1] - t->offset[level]) / (uint32_t)height : 1;
    return t->texel[t->offset[level] + (uint32_t)y * row + (uint32_t)x];
}

static uint32_t grey10(uint32_t value)
{
    return value | value << 10 | value << 20;
}

static void colours_are_filtered_in_linear_light(void **state)
{
    (void)state;
    struct fv_texture t;
    uint8_t board[8 * 4 * 3];
    for (int i = 0; i < 32; i++) memset(board + 3 * i, (i + i / 8) % 2 ? 255 : 0, 3);
    assert_true(fv_texture_make(&t, FV_TEXEL_COLOUR, board, 8, 4, 3, 0) >= 32 + 8 + 2 + 1);
    assert_int_equal(t.levels, 4);
    assert_int_equal(texel(&t, 0, 0, 0), 0);
    assert_int_equal(texel(&t, 0, 1, 0), grey10(1023));
    for (int l = 1; l < 4; l++) assert_int_equal(texel(&t, l, 0, 0), grey10(723)); /* sqrt(1/2) * 1023 */
    free((void *)t.texel);

    /* An even colour stays the same on all levels, whatever the size. */
    static const int sizes[][2] = {{1, 1}, {8192, 1}, {1, 3}, {5, 9}, {640, 480}, {64, 64}};
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        size_t bytes = (size_t)sizes[i][0] * (size_t)sizes[i][1] * 2;
        uint8_t *pixels = malloc(bytes);
        memset(pixels, 188, bytes);
        size_t count = fv_texture_make(&t, FV_TEXEL_COLOUR, pixels, sizes[i][0], sizes[i][1], 2, 0);
        assert_true(t.width <= sizes[i][0] && t.width * 2 > sizes[i][0]);
        assert_true(t.height <= sizes[i][1] && t.height * 2 > sizes[i][1]);
        uint32_t wanted = (uint32_t)lrint(sqrt(pow((188 / 255.0 + 0.055) / 1.055, 2.4)) * 1023);
        for (size_t k = 0; k < count; k++) assert_int_equal(t.texel[k], grey10(wanted));
        free(pixels);
        free((void *)t.texel);
    }
    /* 3 pixels to 2: the middle one goes half to each side. */
    const uint8_t three[] = {0, 255, 0};
    fv_texture_make(&t, FV_TEXEL_COLOUR, three, 3, 1, 1, 0);
    assert_int_equal(t.width, 2);
    assert_int_equal(texel(&t, 0, 0, 0), grey10((uint32_t)lrint(sqrt(1 / 3.0) * 1023)));
    assert_int_equal(texel(&t, 0, 0, 0), texel(&t, 0, 1, 0));
    free((void *)t.texel);
}

static void normals_stay_unit_vectors(void **state)
{
    (void)state;
    struct fv_texture t;
    const uint8_t rows[][12] = {
        {255, 128, 128, 128, 255, 128, 255, 128, 128, 128, 255, 128}, /* x and y: the diagonal */
        {255, 128, 128, 0, 128, 128, 128, 255, 128, 128, 0, 128},     /* they cancel: straight up */
    };
    const double wanted[][3] = {{0.7071, 0.7071, 0}, {0, 0, 1}};
    for (int i = 0; i < 2; i++) {
        fv_texture_make(&t, FV_TEXEL_NORMAL, rows[i], 2, 2, 3, 0);
        for (int k = 0; k < 3; k++)
            assert_close((texel(&t, 1, 0, 0) >> 10 * k & 1023) / 511.5 - 1, wanted[i][k], 0.02);
        free((void *)t.texel);
    }
}

static void coverage_is_kept(void **state)
{
    (void)state;
    static uint8_t pixels[256 * 256 * 4];
    for (int wanted = 5; wanted <= 100; wanted += 19) {
        uint64_t random = 1;
        for (size_t i = 0; i < sizeof pixels; i++) {
            uint64_t bits = random_bits(&random);
            pixels[i] = i % 4 != 3 ? 7 : bits % 100 < (uint64_t)wanted ? 255 : (bits >> 32) % 100;
        }
        struct fv_texture t;
        fv_texture_make(&t, FV_TEXEL_ALPHA, pixels, 256, 256, 4, 0.5f);
        for (int l = 0; l < t.levels; l++) {
            int size = 256 >> l, covered = 0;
            for (int y = 0; y < size; y++) {
                for (int x = 0; x < size; x++) {
                    assert_true(texel(&t, l, x, y) <= 255);
                    covered += texel(&t, l, x, y) >= 128;
                }
            }
            /* Up to half a texel; equal texels cross the cutoff together. */
            assert_close(covered / (double)(size * size), wanted / 100.0, 0.02 + 0.5 / (size * size));
        }
        free((void *)t.texel);
    }
}

/* Pictures. */

static size_t make_png(png_uint_32 format, int width, int height, const void *pixels, const void *colours,
                       uint8_t *out, size_t room)
{
    png_image image = {.version = PNG_IMAGE_VERSION,
                       .width = (png_uint_32)width,
                       .height = (png_uint_32)height,
                       .format = format,
                       .colormap_entries = colours ? 2 : 0};
    png_alloc_size_t size = room;
    if (!png_image_write_to_memory(&image, out, &size, 0, pixels, 0, colours)) fail_msg("%s", image.message);
    return size;
}

static void pictures_of_all_kinds(void **state)
{
    (void)state;
    static uint8_t file[65536];
    static const uint8_t bytes[] = {10, 20, 30, 40, 50, 60, 70, 80};
    static const uint8_t indices[] = {1, 0}, palette[] = {1, 2, 3, 4, 5, 6},
                         clear_palette[] = {1, 2, 3, 0, 4, 5, 6, 255};
    static const struct {
        png_uint_32 format;
        const void *pixels, *colours;
        int channels;
        uint8_t first[4];
    } rows[] = {
        {PNG_FORMAT_GRAY, bytes, NULL, 1, {10}},
        {PNG_FORMAT_GA, bytes, NULL, 2, {10, 20}},
        {PNG_FORMAT_RGB, bytes, NULL, 3, {10, 20, 30}},
        {PNG_FORMAT_RGBA, bytes, NULL, 4, {10, 20, 30, 40}},
        {PNG_FORMAT_RGB_COLORMAP, indices, palette, 3, {4, 5, 6}},
        {PNG_FORMAT_RGBA_COLORMAP, indices, clear_palette, 4, {4, 5, 6, 255}},
    };
    uint8_t *pixels;
    int width, height, channels;
    struct fv_error error;
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        size_t size = make_png(rows[i].format, 2, 1, rows[i].pixels, rows[i].colours, file, sizeof file);
        if (fv_image_decode(file, size, "picture", &pixels, &width, &height, &channels, &error))
            fail_msg("%s", error.text);
        assert_int_equal(width, 2);
        assert_int_equal(height, 1);
        assert_int_equal(channels, rows[i].channels);
        assert_memory_equal(pixels, rows[i].first, (size_t)channels);
        free(pixels);
        /* Cut off anywhere it is refused, and nothing is read behind its end. */
        for (size_t cut = 0; cut < size; cut++) {
            uint8_t *part = malloc(cut + 1);
            memcpy(part, file, cut);
            assert_int_equal(
                fv_image_decode(part, cut, "picture", &pixels, &width, &height, &channels, &error), -1);
            assert_says(&error, "picture: ");
            free(part);
        }
    }
    const uint16_t deep[] = {0xffff, 0, 0x8080, 0, 0, 0};
    size_t size = make_png(PNG_FORMAT_LINEAR_RGB, 2, 1, deep, NULL, file, sizeof file);
    assert_int_equal(fv_image_decode(file, size, "deep", &pixels, &width, &height, &channels, &error), 0);
    assert_int_equal(pixels[0], 255);
    assert_int_equal(pixels[2], 128);
    free(pixels);
}

static void jpegs(void **state)
{
    (void)state;
    uint8_t colours[16 * 16 * 3], *pixels;
    int width, height, channels;
    struct fv_error error;
    for (int i = 0; i < 256; i++) memcpy(colours + 3 * i, (uint8_t[]){200, 100, 50}, 3);
    for (int grey = 0; grey < 2; grey++) {
        unsigned char *file = NULL;
        unsigned long size = 0;
        tjhandle jpeg = tjInitCompress();
        assert_int_equal(tjCompress2(jpeg, colours, 16, 48, 16, TJPF_RGB, &file, &size,
                                     grey ? TJSAMP_GRAY : TJSAMP_444, 95, 0),
                         0);
        tjDestroy(jpeg);
        assert_int_equal(fv_image_decode(file, size, "jpeg", &pixels, &width, &height, &channels, &error), 0);
        assert_int_equal(width, 16);
        assert_int_equal(channels, grey ? 1 : 3);
        assert_close(pixels[0], grey ? 124 : 200, 4);
        free(pixels);
        for (unsigned long cut = 0; cut < size - 2; cut += 7) {
            assert_int_equal(fv_image_decode(file, cut, "jpeg", &pixels, &width, &height, &channels, &error),
                             -1);
            assert_says(&error, "jpeg: ");
        }
        tjFree(file);
    }
}

static void absurd_pictures(void **state)
{
    (void)state;
    static uint8_t row[8193], file[65536];
    uint8_t *pixels;
    int width, height, channels;
    struct fv_error error;
    size_t size = make_png(PNG_FORMAT_GRAY, 8193, 1, row, NULL, file, sizeof file);
    assert_int_equal(fv_image_decode(file, size, "wide", &pixels, &width, &height, &channels, &error), -1);
    assert_says(&error, "wide: a picture of 8193 x 1");
    size = make_png(PNG_FORMAT_GRAY, 8192, 1, row, NULL, file, sizeof file);
    assert_int_equal(fv_image_decode(file, size, "wide", &pixels, &width, &height, &channels, &error), 0);
    free(pixels);
    assert_int_equal(
        fv_image_decode((const uint8_t *)"GIF89a", 6, "gif", &pixels, &width, &height, &channels, &error),
        -1);
    assert_says(&error, "gif: neither PNG nor JPEG");
    assert_int_equal(
        fv_image_decode((const uint8_t *)"", 0, "none", &pixels, &width, &height, &channels, &error), -1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rehearsed_scenes_are_the_same),
        cmocka_unit_test(rejects_what_cannot_be_traced),
        cmocka_unit_test(extreme_sizes_are_kept),
        cmocka_unit_test(opaque_first_order_kept),
        cmocka_unit_test(normals_and_tangents),
        cmocka_unit_test(flags_follow_the_fields),
        cmocka_unit_test(bad_lights),
        cmocka_unit_test(colours_are_filtered_in_linear_light),
        cmocka_unit_test(normals_stay_unit_vectors),
        cmocka_unit_test(coverage_is_kept),
        cmocka_unit_test(pictures_of_all_kinds),
        cmocka_unit_test(jpegs),
        cmocka_unit_test(absurd_pictures),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
