/* obj: small files that must be read, wrong ones that must be refused by file and line, materials and
 * height maps; then the real Sibenik and the Cornell boxes. */
#include "platform/files.h"
#include "rt/scene/build.h"

#include <math.h>
#include <png.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static char folder[64] = "/tmp/foveola-obj-XXXXXX";
static struct fv_scene scene;
static struct fv_error error;

static void assert_close(double value, double wanted, double most)
{
    if (!(fabs(value - wanted) <= most)) fail_msg("%.9g, wanted %.9g +- %g", value, wanted, most);
}

static void assert_says(const char *name, const char *wanted)
{
    if (!strstr(error.text, wanted)) fail_msg("%s: message '%s' does not say '%s'", name, error.text, wanted);
}

static const char *path_of(const char *name)
{
    static char path[FV_PATH_MAX];
    assert_int_equal(fv_path_join(path, folder, name), 0);
    return path;
}

static void write_file(const char *name, const char *text)
{
    FILE *f = fopen(path_of(name), "wb");
    assert_non_null(f);
    assert_int_equal(fwrite(text, 1, strlen(text), f), strlen(text));
    fclose(f);
}

static int read_path(const char *path, double scale)
{
    struct fv_build *b = fv_build_create(path);
    memset(&scene, 0, sizeof scene);
    error.text[0] = 0;
    if (fv_obj_read(b, path, scale, &error) == 0) return fv_build_finish(b, &scene, &error);
    fv_build_destroy(b);
    return -1;
}

static int read_text(const char *text)
{
    write_file("test.obj", text);
    return read_path(path_of("test.obj"), 1);
}

#define SQUARE "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"

static void what_is_read(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        int triangles, vertices;
    } rows[] = {
        {SQUARE "f 1 2 3\n", 1, 3},
        {SQUARE "f 1 2 3 4", 2, 4},
        {SQUARE "f -4 -3 -2 -1\n", 2, 4},
        {"f 1 2 3\n" SQUARE, 1, 3}, /* pointing ahead */
        {"v 0 0 0 1\r\nv 1 0 0 1\r\nv 1 1 0 1\r\nf 1 2 3\r\n", 1, 3},
        {"v 0 0 0\rv 1 0 0\rv 1 1 0\rf 1 2 3\r", 1, 3},
        {"\xef\xbb\xbf# with a mark\n" SQUARE "f 1 2 3\n", 1, 3},
        {SQUARE "vt 0 0\nvt 1\nvn 0 0 1\nf 1/1 2/2 3/1\nf 1//1 2//1 3//1\nf 1/1/1 2/2/1 3/2/1\n", 3, 9},
        {SQUARE "f 1 2 \\\n 3\nf 1 \\\r\n 3 4\n", 2, 4},
        {"\tv 0 0 0\n  v 1. .0 -0\n v +1e0 10.E-1 0 0.5 0.5 0.5\nf   1\t2 3  \n", 1, 3},
        {SQUARE "o thing\ng a b c\ns off\nl 1 2\np 1\nvp 0 1\ncurv 0 1 2\nf 1 2 3\n# end", 1, 3},
        {SQUARE "f 1 2\nf 1 2 3\n", 1, 3},                                    /* two corners are no face */
        {"v 0 0 0\nv 4 0 0\nv 4 4 0\nv 2 1 0\nv 0 4 0\nf 1 2 3 4 5\n", 3, 5}, /* concave */
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        if (read_text(rows[i].text)) fail_msg("%s: %s", rows[i].text, error.text);
        assert_int_equal(scene.triangles, rows[i].triangles);
        assert_int_equal(scene.vertices, rows[i].vertices);
        assert_int_equal(scene.materials, 1);
        assert_close(scene.material[0].diffuse[1], 0.7, 1e-6);
    }
    double area = 0;
    for (int t = 0; t < scene.triangles; t++) {
        const float *p[3];
        for (int k = 0; k < 3; k++) p[k] = scene.position + 3 * scene.index[3 * t + k];
        area += ((p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[1][1] - p[0][1]) * (p[2][0] - p[0][0])) / 2;
    }
    assert_close(area, 16 - 6, 1e-5); /* of the concave one: no triangle outside */
    assert_int_equal(read_path(path_of("test.obj"), 0.01), 0);
    assert_close(scene.bounds[1][0], 0.04, 1e-6);
}

static void uv_and_normals(void **state)
{
    (void)state;
    assert_int_equal(read_text(SQUARE "vt 0.25 0.125\nvn 0 3 4\nf 1/1/1 2/1/1 3/1/1\n"), 0);
    assert_close(scene.triangle[0].uv[0][0], 0.25, 0);
    assert_close(scene.triangle[0].uv[0][1], 0.875, 0); /* OBJ's v grows upwards */
    assert_int_equal(scene.triangle[0].normal[0][1], 19660);
    /* A roof of two slopes: smooth within a group, flat without, and not smooth across groups. */
    static const char roof[] = "v 0 0 0\nv 0 0 -1\nv 1 1 0\nv 1 1 -1\nv 2 0 0\nv 2 0 -1\n";
    static const struct {
        const char *faces;
        double left[2], right[2]; /* normals' x and y at the ridge, of the first and last triangle */
    } rows[] = {
        {"f 1 3 4 2\nf 3 5 6 4\n", {-0.7071, 0.7071}, {0.7071, 0.7071}},
        {"s 1\nf 1 3 4 2\nf 3 5 6 4\n", {0, 1}, {0, 1}},
        {"s 1\nf 1 3 4 2\ns 2\nf 3 5 6 4\n", {-0.7071, 0.7071}, {0.7071, 0.7071}},
        {"s 1\nf 1 3 4 2\ns off\nf 3 5 6 4\n", {-0.7071, 0.7071}, {0.7071, 0.7071}},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        char text[512];
        snprintf(text, sizeof text, "%s%s", roof, rows[i].faces);
        assert_int_equal(read_text(text), 0);
        assert_int_equal(scene.triangles, 4);
        for (int side = 0; side < 2; side++) {
            const double *wanted = side ? rows[i].right : rows[i].left;
            for (int t = 2 * side; t < 2 * side + 2; t++) {
                for (int k = 0; k < 3; k++) {
                    if (scene.position[3 * scene.index[3 * t + k] + 1] != 1) continue;
                    /* The two corners of the ridge touch one or two triangles of each side. */
                    assert_close(scene.triangle[t].normal[k][0] / 32767.0, wanted[0],
                                 wanted[0] == 0 ? 0.4 : 1e-3);
                    assert_close(scene.triangle[t].normal[k][1] / 32767.0, wanted[1],
                                 wanted[0] == 0 ? 0.1 : 1e-3);
                }
            }
        }
    }
}

static void what_is_wrong_is_said(void **state)
{
    (void)state;
    static const struct {
        const char *text, *says;
    } rows[] = {
        {"", "holds no triangles"},
        {SQUARE, "holds no triangles"},
        {SQUARE "f 1 2\n", "holds no triangles"},
        {SQUARE "f 1 1 2\n", "no area"},
        {SQUARE "\nf 1 2 0\n", "test.obj:6: index 0, they count from 1"},
        {SQUARE "f 1 2 5\nf 1 2 3\n", "test.obj:5: vertex index 5, but there are 4"},
        {SQUARE "f 1 2 99999999999999999999\n", "test.obj:5: vertex index"},
        {SQUARE "f -5 2 3\n", "test.obj:5: vertex index -5, but there are 4 before it"},
        {"v 0 0 0\nf -1 -2 -3\nv 1 0 0\nv 0 1 0\n", "test.obj:2: vertex index -2, but there are 1 before it"},
        {SQUARE "f 1/1 2/1 3/1\n", "test.obj:5: texture coordinate index 1, but there are 0"},
        {SQUARE "vt 0 0\nf 1/0 2/1 3/1\n", "test.obj:6: index 0"},
        {SQUARE "f 1//7 2//1 3//1\n", "test.obj:5: normal index 7, but there are 0"},
        {SQUARE "f 1 2 three\n", "test.obj:5: 'three' is no corner"},
        {SQUARE "f 1/ 2/ 3/\n", "test.obj:5: '1/ 2/ 3/' is no corner"},
        {SQUARE "vt 0 0\nf 1/1/ 2 3\n", "test.obj:6: '1/1/ 2 3' is no corner"},
        {SQUARE "f 1/1/1/1 2 3\n", "test.obj:5: "},
        {SQUARE "f 1.5 2 3\n", "test.obj:5: '1.5 2 3' is no corner"},
        {"v 0 0 nan\n", "test.obj:1: 'nan' is not a finite number"},
        {"# one\n\nv 0 inf 0\n", "test.obj:3: 'inf' is not a finite number"},
        {"v 1e39 0 0\n", "test.obj:1: '1e39' is not a finite number"},
        {"v 0 0x1p3 0\n", "test.obj:1: '0x1p3' is not a finite number"},
        {"v 0 1e 0\n", "test.obj:1: '1e' is not a finite number"},
        {"v 0 0\n", "test.obj:1: a vertex of 2 numbers, needs 3"},
        {"v\n", "test.obj:1: a vertex of 0 numbers, needs 3"},
        {"vt\n", "test.obj:1: a texture coordinate of 0 numbers"},
        {"v 0 0 \\\n\\\n 0\nvn 1 0\n", "test.obj:4: a normal of 2 numbers, needs 3"},
        {"# a comment\rv 1 2 x\r", "test.obj:2: 'x' is not a finite number"},
        {SQUARE "f 1 2 3\\", "is no corner"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        if (read_text(rows[i].text) == 0) fail_msg("'%s' was read", rows[i].text);
        assert_says(rows[i].text, rows[i].says);
        assert_says(rows[i].text, "test.obj");
    }
    assert_int_equal(read_path(path_of("nowhere.obj"), 1), -1);
    assert_says("missing", "nowhere.obj: No such file");
    assert_int_equal(read_text(SQUARE "f 1 2 3\n"), 0);
    assert_int_equal(read_path(path_of("test.obj"), 1e39), -1);
    assert_says("scale", "not finite");
    FILE *f = fopen(path_of("test.obj"), "wb");
    fwrite("v 0 0 0\0\nf 1 2 3\n", 1, 18, f);
    fclose(f);
    assert_int_equal(read_path(path_of("test.obj"), 1), -1);
    assert_says("zero byte", "not a text file");
    char *round = malloc(100000), *p = round + sprintf(round, SQUARE "f");
    for (int i = 0; i < 1001; i++) p += sprintf(p, " %d", i % 4 + 1);
    assert_int_equal(read_text(round), -1);
    assert_says("polygon", "test.obj:5: a polygon of 1001 corners");
    free(round);
}

static void write_png(const char *name, int format, const uint8_t *pixels, int width, int height)
{
    png_image image = {.version = PNG_IMAGE_VERSION,
                       .width = (png_uint_32)width,
                       .height = (png_uint_32)height,
                       .format = (png_uint_32)format};
    if (!png_image_write_to_file(&image, path_of(name), 0, pixels, 0, NULL)) fail_msg("%s", image.message);
}

static int read_material(const char *mtl)
{
    char text[1024];
    snprintf(text, sizeof text, "newmtl other\nKd 1 1 1\nnewmtl my own\n%s", mtl);
    write_file("test.mtl", text);
    return read_text("mtllib test.mtl\n" SQUARE "usemtl my own \nf 1 2 3\n");
}

static void materials(void **state)
{
    (void)state;
    static const struct {
        const char *mtl;
        double diffuse, specular, mirror, transmission, ior, emission; /* the red ones */
    } rows[] = {
        {"Kd 0.5 0.4 0.3\nKs 0 0 0\n", 0.5, 0, 0, 0, 1, 0},
        {"Kd 0.5 0.4 0.3\nKs 0.25 0 0\nNs 30\nillum 2\n", 0.5, 0.25, 0, 0, 1, 0},
        {"Kd 0.01 0 0\nKs 0.95 0.95 0.95\nNs 1000\nillum 5\n", 0.01, 0, 0.95, 0, 1, 0},
        {"Kd 0.5 0 0\nKs 0.25 0 0\nillum 3\n", 0.5, 0.25, 0, 0, 1, 0},
        {"Kd 0.5 0.5 0.5\nKe 17 12 4\n", 0.5, 0, 0, 0, 1, 17},
        {"Kd 0.5 0.5 0.5\nd 0.25\n", 0.125, 0, 0, 0.75, 1, 0},
        {"Kd 0.5 0.5 0.5\nTr 0.75\n", 0.125, 0, 0, 0.75, 1, 0},
        {"Kd 0.2 0.1 0\nd 0.9\nTf 0.9 0.9 0.9\n", 0.18, 0, 0, 0.1, 1, 0},          /* takes on Kd's hue */
        {"Kd 0.1 0.1 0.1\nillum 4\nTf 0.8 0.2 0\nNi 1.5\n", 0.1, 0, 0, 0.8, 1, 0}, /* a coloured pane */
        {"Kd 0.1 0.1 0.1\nKs 1 1 1\nNs 256\nillum 4\nTf 0.8 0.2 0\n", 0.1, 0.04, 0, 0.8, 1, 0},
        {"Kd 0.1 0.1 0.1\nillum 6\nTf 0.8 0.2 0\nNi 1.5\n", 0.1, 0, 0, 0.8, 1.5, 0},
        {"Kd 0.5 0.5 0.5\nillum 4\nTf 1 1 1\nNi 1\n", 0.5, 0, 0, 0, 1, 0}, /* Maya's opaque */
        {"Kd 0 0 0\nillum 7\nTf 1 1 1\nNi 1.33\n", 0, 0, 0, 1, 1.33, 0},
        {"Kd 0.01 0.01 0.01\nillum 7\nTf 0.1 0.1 0.1\nNi 2.5\n", 0.01, 0, 0, 0.9, 2.5, 0},
        {"Kd -1 2 0\nKs 0 0 0\nd 7\nKe -5 0 0\n", 0, 0, 0, 0, 1, 0},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        if (read_material(rows[i].mtl)) fail_msg("%s: %s", rows[i].mtl, error.text);
        assert_int_equal(scene.materials, 1);
        const struct fv_material *m = scene.material;
        assert_close(m->diffuse[0], rows[i].diffuse, 1e-6);
        assert_close(m->specular[0], rows[i].specular, 1e-6);
        assert_close(m->mirror[0], rows[i].mirror, 1e-6);
        assert_close(m->transmission[0], rows[i].transmission, 1e-6);
        assert_close(m->ior, rows[i].ior, 1e-6);
        assert_close(m->emission[0], rows[i].emission, 1e-5);
        for (int k = 0; k < 3; k++)
            assert_true(m->diffuse[k] >= 0 && m->diffuse[k] + m->transmission[k] <= 1.000001f);
    }
    assert_int_equal(read_material("Kd 1e999 0 0\n"), -1);
    assert_says("colour", "material my_own holds a number that is not finite");
    assert_int_equal(read_text("mtllib gone.mtl\n" SQUARE "usemtl stone\nf 1 2 3\n"), 0);
    assert_close(scene.material[0].diffuse[0], 0.7, 1e-6);
    assert_int_equal(read_text(SQUARE "usemtl stone\nf 1 2 3\nusemtl\nf 1 3 4\n"), 0);
}

/* The i-th texel of the first row. */
static uint32_t texel(int texture, int i)
{
    const struct fv_texture *t = &scene.texture[texture];
    return t->texel[t->offset[0] + (uint32_t)i];
}

static void textures(void **state)
{
    (void)state;
    static const uint8_t colours[] = {255, 0, 0, 0, 255, 0}, mask[] = {0, 255};
    uint8_t ramp[16], grey_ramp[48];
    for (int i = 0; i < 16; i++)
        ramp[i] = (uint8_t)(100 + 10 * (i % 4)), memset(grey_ramp + 3 * i, ramp[i], 3);
    write_png("colour.png", PNG_FORMAT_RGB, colours, 2, 1);
    write_png("mask.png", PNG_FORMAT_GRAY, mask, 2, 1);
    write_png("height.png", PNG_FORMAT_GRAY, ramp, 4, 4);
    write_png("height3.png", PNG_FORMAT_RGB, grey_ramp, 4, 4);

    assert_int_equal(
        read_material("Kd 1 1 1\nmap_Kd .\\colour.png\nmap_d mask.png\nmap_bump -bm 1 height.png\n"), 0);
    const struct fv_material *m = scene.material;
    assert_int_equal(m->flags, FV_MATERIAL_TEXTURED | FV_MATERIAL_MASKED | FV_MATERIAL_NORMAL_MAPPED);
    assert_int_equal(scene.textures, 3);
    assert_int_equal(texel(m->base_texture, 0), 1023);
    assert_int_equal(texel(m->alpha_texture, 1), 255);
    assert_int_equal(scene.opaque_triangles, 0);
    /* Grey grows to the right by 10 a pixel: 10/255 of 0.01 widths, the slope in pixels 0.00157. */
    static const char *const heights[] = {"bump -bm 100 height.png\n", "map_Bump -bm 100 height3.png\n"};
    for (int i = 0; i < 2; i++) {
        assert_int_equal(read_material(heights[i]), 0);
        uint32_t bent = texel(scene.material[0].normal_texture, 1);
        double n[3], slope = 10 / 255.0 * 4;
        for (int k = 0; k < 3; k++) n[k] = (bent >> 10 * k & 1023) / 511.5 - 1;
        assert_close(n[0], -slope / sqrt(1 + slope * slope), 0.01);
        assert_close(n[1], 0, 0.01);
        assert_close(n[2], 1 / sqrt(1 + slope * slope), 0.01);
    }
    assert_int_equal(read_material("norm colour.png\n"), 0); /* in colours: a normal map already */
    assert_true((texel(scene.material[0].normal_texture, 0) & 1023) > 700);

    assert_int_equal(read_material("map_Kd gone.png\n"), -1);
    assert_says("missing", "test.obj: material my_own: ");
    assert_says("missing", "gone.png: No such file");
    write_file("colour.png", "not a picture");
    assert_int_equal(read_material("map_Kd colour.png\n"), -1);
    assert_says("undecodable", "colour.png: neither PNG nor JPEG");
}

static void real_models(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        int triangles, materials;
        uint32_t features;
    } rows[] = {
        /* 9 of Sibenik's triangles have no area. */
        {"sibenik/sibenik.obj", 75284 - 9, 15,
         FV_SCENE_TEXTURES | FV_SCENE_NORMAL_MAPS | FV_SCENE_SPECULAR | FV_SCENE_GLASS},
        {"cornell/CornellBox-Original.obj", 36, 8, FV_SCENE_EMISSIVE},
        {"cornell/CornellBox-Mirror.obj", 36, 8, FV_SCENE_EMISSIVE | FV_SCENE_MIRRORS},
        {"cornell/CornellBox-Sphere.obj", 2188, 8,
         FV_SCENE_EMISSIVE | FV_SCENE_MIRRORS | FV_SCENE_GLASS | FV_SCENE_SPECULAR},
        {"cornell/CornellBox-Water.obj", 7088, 9,
         FV_SCENE_EMISSIVE | FV_SCENE_MIRRORS | FV_SCENE_GLASS | FV_SCENE_SPECULAR},
        {"cornell/water.obj", 4900, 1, FV_SCENE_GLASS | FV_SCENE_SPECULAR},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        char path[FV_PATH_MAX];
        snprintf(path, sizeof path, "%s/../shared/data/scenes/%s", FV_SOURCE_DIR, rows[i].name);
        if (!fv_file_exists(path)) {
            print_message("%s is not there, skipped\n", path);
            continue;
        }
        if (read_path(path, 1)) fail_msg("%s", error.text);
        assert_int_equal(scene.triangles, rows[i].triangles);
        assert_int_equal(scene.materials, rows[i].materials);
        assert_int_equal(scene.features, rows[i].features);
    }
}

static int set_up(void **state)
{
    (void)state;
    return mkdtemp(folder) ? 0 : -1;
}

static int tear_down(void **state)
{
    (void)state;
    static const char *const names[] = {"test.obj", "test.mtl",   "colour.png",
                                        "mask.png", "height.png", "height3.png"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) unlink(path_of(names[i]));
    return rmdir(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_read),
        cmocka_unit_test(uv_and_normals),
        cmocka_unit_test(what_is_wrong_is_said),
        cmocka_unit_test(materials),
        cmocka_unit_test(textures),
        cmocka_unit_test(real_models),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
