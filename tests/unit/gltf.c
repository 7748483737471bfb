/* gltf: a small good file, read in each form glTF allows; then the same file with one thing wrong at a
 * time, which must be refused by a message that says what; then the real Sponza. */
#include "rt/scene/gltf.h"

#include "platform/files.h"

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

static char folder[64] = "/tmp/foveola-gltf-XXXXXX";
static struct fv_scene scene;
static struct fv_error error;

static void assert_close(double value, double wanted, double most)
{
    if (!(fabs(value - wanted) <= most)) fail_msg("%.9g, wanted %.9g +- %g", value, wanted, most);
}

static void assert_close3(const float v[3], double x, double y, double z)
{
    assert_close(v[0], x, 1e-5);
    assert_close(v[1], y, 1e-5);
    assert_close(v[2], z, 1e-5);
}

static void assert_says(const char *name, const char *wanted)
{
    if (!strstr(error.text, wanted)) fail_msg("%s: message '%s' does not say '%s'", name, error.text, wanted);
}

/* The binary part: positions and normals of a square (12 floats each), its uv (8 floats), indices of
 * its two triangles as u8, u16 and u32, and uv as normalised u16. */
enum {
    POSITIONS = 0,
    NORMALS = 48,
    UVS = 96,
    INDEX8 = 128,
    INDEX16 = 136,
    INDEX32 = 148,
    UVS16 = 172,
    BINARY = 188
};

static uint8_t binary[BINARY];

static void fill_binary(void)
{
    static const float positions[12] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
    static const float normals[12] = {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1};
    static const float uvs[8] = {0, 1, 1, 1, 1, 0, 0, 0};
    static const uint8_t index8[8] = {0, 1, 2, 0, 2, 3};
    static const uint16_t index16[6] = {0, 1, 2, 0, 2, 3},
                          uvs16[8] = {0, 65535, 65535, 65535, 65535, 0, 0, 0};
    static const uint32_t index32[6] = {0, 1, 2, 0, 2, 3};
    memcpy(binary + POSITIONS, positions, sizeof positions);
    memcpy(binary + NORMALS, normals, sizeof normals);
    memcpy(binary + UVS, uvs, sizeof uvs);
    memcpy(binary + INDEX8, index8, sizeof index8);
    memcpy(binary + INDEX16, index16, sizeof index16);
    memcpy(binary + INDEX32, index32, sizeof index32);
    memcpy(binary + UVS16, uvs16, sizeof uvs16);
}

/* Spaces only where a substitution needs a place of its own. */
static const char good[] =
    "{\"asset\":{\"version\":\"2.0\"}, \"scene\":0, \"scenes\":[{\"nodes\":[0]}],"
    "\"nodes\":[{\"mesh\":0, \"translation\":[1,2,3], \"children\":[1]}, {\"name\":\"leaf\"}],"
    "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0, \"NORMAL\":1, \"TEXCOORD_0\":2},"
    "\"indices\":4, \"mode\":4, \"material\":0}]}],"
    "\"materials\":[{\"pbrMetallicRoughness\":{\"baseColorFactor\":[0.5,0.25,1,1], \"metallicFactor\":0,"
    "\"roughnessFactor\":0.5} }],"
    "\"buffers\":[{\"byteLength\":188}],"
    "\"bufferViews\":[{\"buffer\":0, \"byteLength\":96}, {\"buffer\":0, \"byteOffset\":96, "
    "\"byteLength\":92}],"
    "\"accessors\":["
    "{\"bufferView\":0, \"componentType\":5126, \"count\":4, \"type\":\"VEC3\"},"
    "{\"bufferView\":0, \"byteOffset\":48, \"componentType\":5126, \"count\":4, \"type\":\"VEC3\"},"
    "{\"bufferView\":1, \"componentType\":5126, \"count\":4, \"type\":\"VEC2\"},"
    "{\"bufferView\":1, \"byteOffset\":32, \"componentType\":5121, \"count\":6, \"type\":\"SCALAR\"},"
    "{\"bufferView\":1, \"byteOffset\":40, \"componentType\":5123, \"count\":6, \"type\":\"SCALAR\"},"
    "{\"bufferView\":1, \"byteOffset\":52, \"componentType\":5125, \"count\":6, \"type\":\"SCALAR\"},"
    "{\"bufferView\":1, \"byteOffset\":76, \"componentType\":5123, \"normalized\":true, \"count\":4,"
    "\"type\":\"VEC2\"}]}";

/* `good` with the first `from` replaced; both may be "". */
static const char *changed(const char *from, const char *to)
{
    static char text[65536];
    const char *at = strstr(good, from);
    if (!at) fail_msg("'%s' is not in the good file", from);
    snprintf(text, sizeof text, "%.*s%s%s", (int)(at - good), good, to, at + strlen(from));
    return text;
}

static void put32(uint8_t *p, uint32_t v)
{
    for (int i = 0; i < 4; i++) p[i] = (uint8_t)(v >> 8 * i);
}

/* A .glb of the JSON text and `binary`; malloc'ed to its very size. */
static uint8_t *make_glb(const char *json, size_t *size)
{
    size_t length = (strlen(json) + 3) / 4 * 4;
    *size = 12 + 8 + length + 8 + BINARY;
    uint8_t *glb = malloc(*size), *p = glb + 20;
    memcpy(glb, "glTF", 4);
    put32(glb + 4, 2);
    put32(glb + 8, (uint32_t)*size);
    put32(glb + 12, (uint32_t)length);
    memcpy(glb + 16, "JSON", 4);
    memset(p, ' ', length);
    memcpy(p, json, strlen(json));
    put32(p + length, BINARY);
    memcpy(p + length + 4, "BIN", 4);
    memcpy(p + length + 8, binary, BINARY);
    return glb;
}

static int read_bytes(const uint8_t *bytes, size_t size, const char *where)
{
    struct fv_build *b = fv_build_create("test.glb");
    memset(&scene, 0, sizeof scene);
    error.text[0] = 0;
    if (fv_gltf_read_memory(b, bytes, size, "test.glb", where, 1, &error) == 0)
        return fv_build_finish(b, &scene, &error);
    fv_build_destroy(b);
    return -1;
}

static int read_json(const char *json)
{
    size_t size;
    uint8_t *glb = make_glb(json, &size);
    int result = read_bytes(glb, size, folder);
    free(glb);
    return result;
}

static void read_good(const char *from, const char *to)
{
    if (read_json(changed(from, to))) fail_msg("'%s' -> '%s': %s", from, to, error.text);
}

static void write_file(const char *name, const void *bytes, size_t size)
{
    char path[FV_PATH_MAX];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    assert_int_equal(fwrite(bytes, 1, size, f), size);
    fclose(f);
}

static int read_file(const char *name)
{
    char path[FV_PATH_MAX];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    struct fv_build *b = fv_build_create(path);
    if (fv_gltf_read(b, path, 1, &error) == 0) return fv_build_finish(b, &scene, &error);
    fv_build_destroy(b);
    return -1;
}

static void assert_square(void)
{
    assert_int_equal(scene.triangles, 2);
    assert_int_equal(scene.vertices, 4);
    assert_close3(scene.bounds[0], 1, 2, 3);
    assert_close3(scene.bounds[1], 2, 3, 3);
    for (int t = 0; t < 2; t++) {
        assert_int_equal(scene.triangle[t].normal[0][2], 32767);
        assert_int_equal(scene.triangle[t].tangent[0], 32767);
        assert_int_equal(scene.triangle[t].bitangent_sign, 1);
        assert_close(scene.triangle[t].uv_per_metre, 1, 1e-5);
    }
}

static void the_same_square_in_many_forms(void **state)
{
    (void)state;
    static const char *const forms[][2] = {
        {"", ""},
        {"\"indices\":4", "\"indices\":3"},
        {"\"indices\":4", "\"indices\":5"},
        {"\"TEXCOORD_0\":2", "\"TEXCOORD_0\":6"},
        {"\"NORMAL\":1, ", ""},
        {", \"scene\":0", ""},
        {", \"scene\":0, \"scenes\":[{\"nodes\":[0]}]", ""},
        {"\"indices\":4, \"mode\":4", "\"mode\":6"}, /* a fan of four corners */
        {"\"translation\":[1,2,3]", "\"matrix\":[1,0,0,0, 0,1,0,0, 0,0,1,0, 1,2,3,1]"},
        {"{\"asset\"",
         "{\"extensionsRequired\":[\"KHR_texture_transform\",\"KHR_lights_punctual\"],\"asset\""},
        {"\"mode\":4", "\"mode\":4, \"extras\":{\"any\":[null,true]}"},
    };
    for (size_t i = 0; i < sizeof forms / sizeof forms[0]; i++) {
        read_good(forms[i][0], forms[i][1]);
        assert_square();
    }
    /* A strip of the corners as they lie crosses itself: 0 1 2, then 1 3 2 turned round. */
    read_good("\"indices\":4, \"mode\":4", "\"mode\":5");
    assert_int_equal(scene.triangles, 2);
    const uint32_t strip[] = {0, 1, 2, 1, 3, 2};
    for (int i = 0; i < 6; i++) {
        const float *p = scene.position + 3 * scene.index[i];
        const float *wanted = (const float *)(const void *)(binary + POSITIONS) + 3 * strip[i];
        assert_close3(p, wanted[0] + 1, wanted[1] + 2, wanted[2] + 3);
    }
    /* Points have no surface. */
    assert_int_equal(read_json(changed("\"mode\":4", "\"mode\":0")), -1);
    assert_says("points", "holds no triangles");
}

static void files_and_uris(void **state)
{
    (void)state;
    static const char base64[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    char uri[512], *p = uri + sprintf(uri, "\"uri\":\"data:application/octet-stream;base64,");
    for (int i = 0; i < BINARY; i += 3) {
        uint32_t bits = (uint32_t)binary[i] << 16 | (i + 1 < BINARY ? (uint32_t)binary[i + 1] << 8 : 0) |
                        (i + 2 < BINARY ? binary[i + 2] : 0);
        for (int k = 0; k < 4; k++) *p++ = i + k > BINARY ? '=' : base64[bits >> (18 - 6 * k) & 63];
    }
    strcpy(p, "\",\"byteLength\":188");
    const char *json = changed("\"byteLength\":188", uri);
    write_file("data.gltf", json, strlen(json));
    if (read_file("data.gltf")) fail_msg("%s", error.text);
    assert_square();

    json = changed("\"byteLength\":188", "\"uri\":\"my%20square.bin\",\"byteLength\":188");
    write_file("outside.gltf", json, strlen(json));
    assert_int_equal(read_file("outside.gltf"), -1);
    assert_says("missing buffer", "my square.bin: No such file");
    write_file("my square.bin", binary, BINARY - 1);
    assert_int_equal(read_file("outside.gltf"), -1);
    assert_says("short buffer", "outside.gltf: buffers[0]: byteLength = 188, but there are 187");
    write_file("my square.bin", binary, BINARY);
    if (read_file("outside.gltf")) fail_msg("%s", error.text);
    assert_square();

    assert_int_equal(read_bytes((const uint8_t *)json, strlen(json), NULL), -1);
    assert_says("no folder", "other files are not read here");
    assert_int_equal(read_file("nowhere.gltf"), -1);
    assert_says("missing", "nowhere.gltf: No such file");
    write_file("broken.gltf", "{\n\"asset\":\n}", 13);
    assert_int_equal(read_file("broken.gltf"), -1);
    assert_says("syntax", "broken.gltf:3: ");
}

static void nodes_move_their_meshes(void **state)
{
    (void)state;
    static const struct {
        const char *node;
        double low[3], high[3];
        int normal[3]; /* of the square, in units of 32767 */
    } rows[] = {
        {"\"rotation\":[0,0.70710678,0,0.70710678]", {0, 0, -1}, {0, 1, 0}, {1, 0, 0}},
        {"\"rotation\":[0,7.0710678,0,7.0710678]", {0, 0, -1}, {0, 1, 0}, {1, 0, 0}},
        {"\"scale\":[2,3,0.5],\"translation\":[-1,0,0]", {-1, 0, 0}, {1, 3, 0}, {0, 0, 1}},
        {"\"scale\":[-1,1,1]", {-1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
        {"\"scale\":[-1,-1,-1]", {-1, -1, 0}, {0, 0, 0}, {0, 0, -1}},
        {"\"scale\":[1,1,0]", {0, 0, 0}, {1, 1, 0}, {0, 0, 1}},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        read_good("\"translation\":[1,2,3]", rows[i].node);
        for (int k = 0; k < 3; k++) {
            assert_close(scene.bounds[0][k], rows[i].low[k], 1e-6);
            assert_close(scene.bounds[1][k], rows[i].high[k], 1e-6);
            for (int t = 0; t < 2; t++)
                assert_close(scene.triangle[t].normal[0][k], rows[i].normal[k] * 32767, 1);
        }
        /* Without given normals those of the winding must be the same: mirrored nodes turn it round. */
        char flat[8192];
        strcpy(flat, changed("\"translation\":[1,2,3]", rows[i].node));
        memset(strstr(flat, "\"NORMAL\":1, "), ' ', strlen("\"NORMAL\":1, "));
        assert_int_equal(read_json(flat), 0);
        for (int k = 0; k < 3; k++)
            assert_close(scene.triangle[0].normal[0][k], rows[i].normal[k] * 32767, 1);
    }
    /* A child is moved by its parent too. */
    read_good("{\"name\":\"leaf\"}", "{\"mesh\":0,\"translation\":[10,0,0]}");
    assert_int_equal(scene.triangles, 4);
    assert_close3(scene.bounds[1], 12, 3, 3);
}

/* Materials: what a substitution in the material gives. */
static void materials_become_phong(void **state)
{
    (void)state;
    static const char pbr[] = "\"metallicFactor\":0,\"roughnessFactor\":0.5} }";
    static const struct {
        const char *to;
        double diffuse, specular, shininess, mirror, transmission, ior, emission; /* red ones */
    } rows[] = {
        {"\"metallicFactor\":0,\"roughnessFactor\":0.5} }", 0.5, 0.04, 7.5, 0, 0, 1.5, 0},
        {"\"metallicFactor\":0,\"roughnessFactor\":1} }", 0.5, 0, 1, 0, 0, 1.5, 0},
        {"\"metallicFactor\":0,\"roughnessFactor\":0} }", 0.5, 0.04, 10000, 0, 0, 1.5, 0},
        {"\"metallicFactor\":1,\"roughnessFactor\":0.5} }", 0, 0.5, 7.5, 0, 0, 1.5, 0},
        {"\"metallicFactor\":0.5,\"roughnessFactor\":0.5} }", 0.25, 0.27, 7.5, 0, 0, 1.5, 0},
        {"\"metallicFactor\":1,\"roughnessFactor\":0.05} }", 0, 0, 10000, 0.5, 0, 1.5, 0},
        {"\"metallicFactor\":0,\"roughnessFactor\":0}, \"extensions\":{\"KHR_materials_transmission\":"
         "{\"transmissionFactor\":0.8},\"KHR_materials_ior\":{\"ior\":1.33}} }",
         0.1, 0.04, 10000, 0, 0.4, 1.33, 0},
        {"\"metallicFactor\":0}, "
         "\"emissiveFactor\":[0.5,0,0],\"extensions\":{\"KHR_materials_emissive_strength\":"
         "{\"emissiveStrength\":20}} }",
         0.5, 0, 1, 0, 0, 1.5, 10},
        {"\"metallicFactor\":0},\"doubleSided\":true,\"extensions\":{\"KHR_materials_unlit\":{}} }", 0.5, 0,
         1, 0, 0, 1.5, 0},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        read_good(pbr, rows[i].to);
        const struct fv_material *m = scene.material;
        assert_close(m->diffuse[0], rows[i].diffuse, 1e-6);
        assert_close(m->specular[0], rows[i].specular, 1e-6);
        assert_close(m->shininess, rows[i].shininess, 1e-2);
        assert_close(m->mirror[0], rows[i].mirror, 1e-6);
        assert_close(m->transmission[0], rows[i].transmission, 1e-6);
        assert_close(m->ior, rows[i].ior, 1e-6);
        assert_close(m->emission[0], rows[i].emission, 1e-5);
    }
    read_good(", \"material\":0", "");
    assert_close(scene.material[0].diffuse[0], 0.7, 1e-6);

    /* A pane: even alpha that is blended. And what lies below its cutoff everywhere is not there. */
    read_good("0.25,1,1]",
              "0.25,1,0.25], \"metallicFactor\":0},\"alphaMode\":\"BLEND\",\"extras\":{\"was\":1");
    assert_close(scene.material[0].transmission[1], 0.75, 1e-6);
    assert_close(scene.material[0].diffuse[0], 0.125, 1e-6);
    assert_close(scene.material[0].ior, 1, 0);
    assert_int_equal(
        read_json(changed("0.25,1,1]", "0.25,1,0.25]},\"alphaMode\":\"MASK\",\"extras\":{\"was\":1")), -1);
    assert_says("hidden", "holds no triangles");
}

static void lights(void **state)
{
    (void)state;
    static const char root[] =
        "{\"extensions\":{\"KHR_lights_punctual\":{\"lights\":["
        "{\"type\":\"point\",\"color\":[1,0.5,0],\"intensity\":8},"
        "{\"type\":\"directional\",\"intensity\":3},{\"type\":\"spot\",\"spot\":{}}]}},\"asset\"";
    char json[8192];
    for (int i = 0; i < 4; i++) {
        char node[256];
        const char *at = changed("{\"asset\"", root);
        const char *leaf = strstr(at, "\"name\":\"leaf\"");
        snprintf(node, sizeof node,
                 "\"rotation\":[0.70710678,0,0,0.70710678],\"extensions\":{\"KHR_lights_punctual\":{"
                 "\"light\":%d}}",
                 i);
        snprintf(json, sizeof json, "%.*s%s%s", (int)(leaf - at), at, node,
                 leaf + strlen("\"name\":\"leaf\""));
        int result = read_json(json);
        if (i == 3) {
            assert_int_equal(result, -1);
            assert_says("light", "lights[3]: is not there, there are 3");
            break;
        }
        if (result) fail_msg("%s", error.text);
        assert_int_equal(scene.lights, 1);
        assert_int_equal(scene.light[0].kind, i == 1 ? FV_LIGHT_SUN : FV_LIGHT_POINT);
        if (i == 0) assert_close3(scene.light[0].position, 1, 2, 3);
        if (i == 0) assert_close3(scene.light[0].colour, 8, 4, 0);
        if (i == 1) assert_close3(scene.light[0].position, 0, -1, 0); /* +z of the node, turned about x */
        if (i == 1) assert_close3(scene.light[0].colour, 3, 3, 3);
        assert_true(scene.features & (i == 1 ? FV_SCENE_SUN : FV_SCENE_POINT_LIGHTS));
    }
}

static void write_png(const char *name, int format, const uint8_t *pixels, int width, int height)
{
    char path[FV_PATH_MAX];
    png_image image = {.version = PNG_IMAGE_VERSION,
                       .width = (png_uint_32)width,
                       .height = (png_uint_32)height,
                       .format = (png_uint_32)format};
    snprintf(path, sizeof path, "%s/%s", folder, name);
    if (!png_image_write_to_file(&image, path, 0, pixels, 0, NULL)) fail_msg("%s", image.message);
}

/* Replaces the material by one with textures 0 base.png, 1 bent.png (normals), 2 rough.png; what is left
 * of the old one becomes extras. */
static const char *textured(const char *material)
{
    static char text[4096];
    snprintf(text, sizeof text,
             "%s}],\"textures\":[{\"source\":0},{\"source\":1},{\"source\":2},{\"sampler\":0}],"
             "\"images\":[{\"uri\":\"base.png\"},{\"uri\":\"bent.png\"},{\"uri\":\"rough.png\"}],"
             "\"extras\":[{\"was\":{\"a\":1",
             material);
    return changed("\"pbrMetallicRoughness\":{\"baseColorFactor\":[0.5,0.25,1,1]", text);
}

static void textures(void **state)
{
    (void)state;
    static const uint8_t base[] = {255, 0, 0, 255, 255, 0, 0, 0, 255, 0, 0, 200, 255, 0, 0, 10};
    static const uint8_t bent[] = {128, 128, 255}, rough[] = {0, 51, 0, 0, 153, 102};
    write_png("base.png", PNG_FORMAT_RGBA, base, 2, 2);
    write_png("bent.png", PNG_FORMAT_RGB, bent, 1, 1);
    write_png("rough.png", PNG_FORMAT_RGB, rough, 2, 1);

    static const char mask[] =
        "\"alphaMode\":\"MASK\",\"alphaCutoff\":0.9,\"normalTexture\":{\"index\":1,\"scale\":0.5},"
        "\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":0},"
        "\"metallicRoughnessTexture\":{\"index\":2},\"baseColorFactor\":[1,1,1,1]}";
    if (read_json(textured(mask))) fail_msg("%s", error.text);
    const struct fv_material *m = scene.material;
    assert_int_equal(scene.textures, 3);
    assert_true(m->base_texture >= 0 && m->normal_texture >= 0 && m->alpha_texture >= 0);
    assert_close(m->alpha_cutoff, 0.9, 1e-6);
    assert_close(m->normal_scale, 0.5, 1e-6);
    assert_close(m->diffuse[0], 0.8, 1e-5);                /* metallic: mean of blue, 51/255 */
    assert_close(m->specular[0], 0.04 + 0.96 * 0.2, 1e-5); /* of mean base colour */
    assert_close(m->specular[1], 0.04 - 0.04 * 0.2, 1e-5);
    assert_close(m->shininess, (2 / pow(0.4, 4) - 2) / 4, 1e-2); /* roughness: mean of green, 102/255 */
    assert_int_equal(scene.opaque_triangles, 0);
    assert_int_equal(scene.features & 7, FV_SCENE_TEXTURES | FV_SCENE_NORMAL_MAPS | FV_SCENE_ALPHA);
    const struct fv_texture *alpha = &scene.texture[m->alpha_texture];
    assert_int_equal(alpha->texel[alpha->offset[0]], 255);
    assert_int_equal(alpha->texel[alpha->offset[0] + 1], 0);
    const struct fv_texture *base_colour = &scene.texture[m->base_texture];
    assert_int_equal(base_colour->texel[base_colour->offset[0] + 1], 1023);

    /* Opaque: alpha is not looked at. Alpha above the cutoff everywhere: no mask. */
    if (read_json(
            textured("\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":0}, \"metallicFactor\":0}")))
        fail_msg("%s", error.text);
    assert_int_equal(scene.features & FV_SCENE_ALPHA, 0);
    assert_int_equal(scene.textures, 1);
    if (read_json(textured(
            "\"alphaMode\":\"MASK\",\"alphaCutoff\":0,\"pbrMetallicRoughness\":{\"baseColorTexture\":"
            "{\"index\":0}}")))
        fail_msg("%s", error.text);
    assert_int_equal(scene.features & FV_SCENE_ALPHA, 0);

    /* A turn by a quarter, then offset and scale: (u, v) becomes (scale v + offset, -u). */
    if (read_json(textured("\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":0,\"extensions\":"
                           "{\"KHR_texture_transform\":{\"offset\":[0.25,0],\"scale\":[1,2],"
                           "\"rotation\":1.5707963267948966}}}}")))
        fail_msg("%s", error.text);
    assert_close(scene.triangle[0].uv[1][0], 2.25, 1e-5);
    assert_close(scene.triangle[0].uv[1][1], -1, 1e-5);

    static const struct {
        const char *material, *says;
    } bad[] = {
        {"\"normalTexture\":{\"index\":9}", "materials[0]: refers to textures[9], there are 4"},
        {"\"normalTexture\":{\"index\":3}", "has no source: textures must be PNG or JPEG"},
        {"\"normalTexture\":{}", "refers to textures[-1]"},
        {"\"normalTexture\":7", "normalTexture is not an object"},
        {"\"alphaMode\":\"maybe\"", "alphaMode maybe, must be OPAQUE, MASK or BLEND"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        assert_int_equal(read_json(textured(bad[i].material)), -1);
        assert_says(bad[i].material, bad[i].says);
    }
    write_file("bent.png", "\x89PNG\r\n\x1a\n1234", 12);
    assert_int_equal(read_json(textured(mask)), -1);
    assert_says("damaged", "test.glb: images[1] bent.png: damaged PNG: ");
    write_file("bent.png", "RIFF....WEBP", 12);
    assert_int_equal(read_json(textured(mask)), -1);
    assert_says("webp", "bent.png: neither PNG nor JPEG");
    write_png("bent.png", PNG_FORMAT_GRAY, bent, 1, 1);
    assert_int_equal(read_json(textured(mask)), -1);
    assert_says("grey", "images[1]: a normal map without colours");
}

static void what_is_wrong_is_said(void **state)
{
    (void)state;
    static const struct {
        const char *from, *to, *says;
    } rows[] = {
        {"\"version\":\"2.0\"", "\"version\":\"1.0\"", "asset.version is 1.0, must be 2.0"},
        {"\"asset\":{\"version\":\"2.0\"},", "", "asset.version is not there"},
        {"\"version\":\"2.0\"", "\"version\":\"2.1\",\"minVersion\":\"2.1\"", "needs glTF 2.1"},
        {"{\"asset\"", "{\"extensionsRequired\":[\"KHR_draco_mesh_compression\"],\"asset\"",
         "KHR_draco_mesh_compression"},
        {"{\"asset\"", "{\"extensionsRequired\":[7],\"asset\"", "needs the extension ?"},
        {"\"scene\":0", "\"scene\":3", "refers to scenes[3], there are 1"},
        {"\"scene\":0", "\"scene\":\"main\"", "scene is not a number"},
        {"\"scenes\":[{\"nodes\":[0]}]", "\"scenes\":[{\"nodes\":[5]}]", "refers to nodes[5], there are 2"},
        {"\"scenes\":[{\"nodes\":[0]}]", "\"scenes\":[{\"nodes\":[-1]}]", "refers to nodes[-1]"},
        {"\"scenes\":[{\"nodes\":[0]}]", "\"scenes\":[{\"nodes\":[\"a\"]}]", "no index"},
        {"\"scenes\":[{\"nodes\":[0]}]", "\"scenes\":[{\"nodes\":7}]", "nodes is not a list"},
        {"\"scenes\":[{\"nodes\":[0]}]", "\"scenes\":[{}]", "holds no triangles"},
        {"\"children\":[1]", "\"children\":[0]", "nodes[0]: is reached twice"},
        {"\"children\":[1]", "\"children\":[1,1]", "nodes[1]: is reached twice"},
        {"{\"name\":\"leaf\"}", "{\"children\":[0]}", "nodes[0]: is reached twice"},
        {"\"translation\":[1,2,3]", "\"translation\":[1,2]", "translation has 2 values, needs 3"},
        {"\"translation\":[1,2,3]", "\"translation\":[1,2,1e39]",
         "translation[2] is not a number of normal size"},
        {"\"translation\":[1,2,3]", "\"translation\":[1,2,null]", "translation[2] is not a number"},
        {"\"translation\":[1,2,3]", "\"scale\":[3e38,1,1],\"translation\":[3e38,0,0]",
         "vertex 1 holds a number that is not finite"},
        {"{\"name\":\"leaf\"}",
         "{\"translation\":[3e38,0,0],\"scale\":[3e38,1,1],\"children\":[2]},{\"scale\":[3e38,1,1]}",
         "nodes[2]: its transform is not finite"},
        {"\"mesh\":0", "\"mesh\":1", "refers to meshes[1]"},
        {"\"mesh\":0", "\"mesh\":0.5", "mesh = 0.5 is not a whole number"},
        {"\"mesh\":0", "\"mesh\":-2", "mesh = -2 is out of range"},
        {"\"mode\":4", "\"mode\":7", "mode 7, must be from 0 to 6"},
        {"\"material\":0", "\"material\":2", "refers to materials[2]"},
        {"\"POSITION\":0, ", "", "meshes[0].primitives[0]: has no POSITION"},
        {"\"POSITION\":0", "\"POSITION\":7", "refers to accessors[7], there are 7"},
        {"\"POSITION\":0", "\"POSITION\":2", "accessors[2]: its type is VEC2, must be VEC3"},
        {"\"NORMAL\":1", "\"NORMAL\":0, \"TANGENT\":1", "its type is VEC3, must be VEC4"},
        {"\"indices\":4", "\"indices\":0", "its type is VEC3, must be SCALAR"},
        {"\"mode\":4", "\"mode\":4, \"attributes\":{}", "duplicate"},
        {"\"count\":4", "\"count\":3", "for 3 positions"},
        {"\"count\":4", "\"count\":0", "accessors[0]: its count is 0"},
        {"\"count\":4", "\"count\":9", "accessors[0]: ends at byte 108 of a bufferView of 96"},
        {"\"count\":4", "\"count\":100000001", "100000001 elements, at most 100000000 are read"},
        {"\"count\":4", "\"count\":1e300", "count = 1e+300 is out of range"},
        {"\"count\":4", "\"count\":4,\"byteOffset\":1099511627776",
         "accessors[0]: ends at byte 1099511627824"},
        {"\"count\":4", "\"count\":4,\"sparse\":{}", "sparse"},
        {"\"bufferView\":0, ", "", "accessors[0]: has no bufferView"},
        {"\"bufferView\":0", "\"bufferView\":2", "refers to bufferViews[2]"},
        {"\"componentType\":5126", "\"componentType\":5124", "componentType 5124 is not possible"},
        {"\"componentType\":5126", "\"componentType\":5125", "componentType 5125 is not possible"},
        {"\"componentType\":5126, ", "", "componentType 0 is not possible"},
        {"\"byteLength\":96}", "\"byteLength\":96,\"byteStride\":8}",
         "elements of 12 bytes do not fit into byteStride = 8"},
        {"\"byteLength\":96}", "\"byteLength\":96,\"byteStride\":13}",
         "byteStride = 13, must be a multiple of 4"},
        {"\"byteLength\":96}", "\"byteLength\":189}", "bufferViews[0]: ends at byte 189 of a buffer of 188"},
        {"\"byteLength\":96}", "\"byteLength\":96,\"byteOffset\":1099511627776}",
         "ends at byte 1099511627872"},
        {"{\"buffer\":0", "{\"buffer\":1", "refers to buffers[1]"},
        {"\"byteLength\":188", "\"byteLength\":189", "byteLength = 189, but there are 188"},
        {"\"byteLength\":188", "\"byteOffset\":0", "has no byteLength"},
        {"\"byteLength\":188", "\"byteLength\":4,\"uri\":\"data:text/plain,abcd\"", "not base64"},
        {"\"byteLength\":188", "\"byteLength\":4,\"uri\":\"data:a/b;base64,ab*d\"",
         "not base64 at character 2"},
        {"\"byteLength\":188", "\"byteLength\":4,\"uri\":\"http://example.org/a.bin\"",
         "only files beside it"},
        {"\"metallicFactor\":0", "\"metallicFactor\":2", "metallicFactor = 2 is out of range: from 0 to 1"},
        {"[0.5,0.25,1,1]", "[0.5,0.25,1]", "baseColorFactor has 3 values, needs 4"},
        {"[0.5,0.25,1,1]", "[1e999,0.25,1,1]", "real number overflow"},
        {"\"indices\":4", "\"indices\":4,", "test.glb:1: "},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        if (read_json(changed(rows[i].from, rows[i].to)) == 0) fail_msg("'%s' was read", rows[i].to);
        assert_says(rows[i].to, rows[i].says);
        assert_says(rows[i].to, "test.glb");
    }
}

static void bad_numbers_in_the_binary(void **state)
{
    (void)state;
    static const struct {
        int at;
        uint8_t bytes[4];
        int count;
        const char *says;
    } rows[] = {
        {POSITIONS + 12,
         {0, 0, 0xc0, 0x7f},
         4,
         "meshes[0].primitives[0]: vertex 1 holds a number that is not finite"},
        {POSITIONS + 24, {0, 0, 0x80, 0xff}, 4, "vertex 2"},
        {UVS, {0, 0, 0xc0, 0x7f}, 4, "vertex 0"},
        {INDEX16 + 4, {4, 0}, 2, "index 4, but there are 4 positions"},
        {INDEX16, {255, 255}, 2, "index 65535"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        memcpy(binary + rows[i].at, rows[i].bytes, (size_t)rows[i].count);
        assert_int_equal(read_json(good), -1);
        assert_says("binary", rows[i].says);
        fill_binary();
    }
    /* A normal that is none is made up for. */
    memset(binary + NORMALS, 0xff, 12);
    assert_int_equal(read_json(good), 0);
    assert_square();
    fill_binary();
}

static void containers(void **state)
{
    (void)state;
    size_t size;
    uint8_t *glb = make_glb(good, &size);
    /* Cut off anywhere it is refused. */
    for (size_t cut = 0; cut < size; cut += cut < 40 ? 1 : 13) {
        uint8_t *part = malloc(cut + 1);
        memcpy(part, glb, cut);
        assert_int_equal(read_bytes(part, cut, NULL), -1);
        assert_says("cut", "test.glb");
        free(part);
    }
    static const struct {
        int at;
        uint32_t value;
        const char *says;
    } rows[] = {
        {4, 1, "a .glb of version 1, must be 2"}, {8, 0xffffffff, "cut off: its header says 4294967295"},
        {12, 0xfffffff0, "chunk 0 is cut off"},   {16, 7, "first chunk is not JSON"},
        {8, 12, "first chunk is not JSON"},       {12, 4, "test.glb"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        uint8_t kept[4];
        memcpy(kept, glb + rows[i].at, 4);
        put32(glb + rows[i].at, rows[i].value);
        assert_int_equal(read_bytes(glb, size, NULL), -1);
        assert_says("container", rows[i].says);
        memcpy(glb + rows[i].at, kept, 4);
    }
    assert_int_equal(read_bytes(glb, size, NULL), 0);
    free(glb);
    assert_int_equal(read_bytes((const uint8_t *)"[]", 2, NULL), -1);
    assert_says("list", "not a JSON object");
}

static void deep_trees(void **state)
{
    (void)state;
    for (int depth = 64; depth <= 65; depth++) {
        char nodes[4096], *p = nodes;
        for (int i = 2; i < depth; i++) p += sprintf(p, "{\"children\":[%d]},", i == depth - 1 ? 1 : i + 1);
        p[-1] = 0; /* nodes 0, 2, 3, ... then 1 */
        char json[16384], with[4200];
        snprintf(with, sizeof with, "{\"name\":\"leaf\"},%s", nodes);
        strcpy(json, changed("{\"name\":\"leaf\"}", with));
        memcpy(strstr(json, "\"children\":[1]"), "\"children\":[2]", 14);
        assert_int_equal(read_json(json), depth == 64 ? 0 : -1);
        if (depth == 65) assert_says("deep", "lies more than 64 nodes deep");
    }
}

/* The sign of bitangents in the file is kept, and turned round by mirroring nodes. The tangents take the
 * place of normals and uv in the binary. */
static void tangents_and_mirrors(void **state)
{
    (void)state;
    static const float tangents[16] = {1, 0, 0, -1, 1, 0, 0, -1, 1, 0, 0, -1, 1, 0, 0, -1};
    static const char *const nodes[] = {"\"translation\":[1,2,3]", "\"scale\":[-1,1,1]"};
    for (int i = 0; i < 2; i++) {
        char json[8192];
        memcpy(binary + NORMALS, tangents, sizeof tangents);
        strcpy(json, changed("\"byteOffset\":48, \"componentType\":5126, \"count\":4, \"type\":\"VEC3\"",
                             "\"byteOffset\":48, \"componentType\":5126, \"count\":3, \"type\":\"VEC4\""));
        /* Three corners are enough: 48 bytes of positions hold four, 48 bytes three tangents. */
        char *count = strstr(json, "\"count\":4");
        memcpy(count, "\"count\":3", 9);
        memcpy(strstr(json, "\"NORMAL\":1, \"TEXCOORD_0\":2"), "\"TANGENT\":1               ", 26);
        memcpy(strstr(json, "\"indices\":4, "), "             ", 13);
        char *translation = strstr(json, nodes[0]);
        if (i == 1)
            memset(translation, ' ', strlen(nodes[0])), memcpy(translation, nodes[1], strlen(nodes[1]));
        if (read_json(json)) fail_msg("%s", error.text);
        assert_int_equal(scene.triangles, 1);
        assert_int_equal(scene.triangle[0].bitangent_sign, i == 0 ? -1 : 1);
        fill_binary();
    }
}

static void sponza(void **state)
{
    (void)state;
    static const char path[] = FV_SOURCE_DIR "/../shared/data/scenes/sponza/sponza.gltf";
    if (!fv_file_exists(path)) {
        print_message("sponza: %s is not there, skipped\n", path);
        skip();
    }
    struct fv_build *b = fv_build_create(path);
    if (fv_gltf_read(b, path, 1, &error) || fv_build_finish(b, &scene, &error)) fail_msg("%s", error.text);
    assert_int_equal(scene.triangles, 262267 - 1); /* one has no area */
    assert_int_equal(scene.materials, 25);
    assert_int_equal(scene.triangles - scene.opaque_triangles, 34940);
    for (int t = 0; t < scene.triangles; t++) {
        const struct fv_material *m = &scene.material[scene.triangle[t].material];
        assert_int_equal((m->flags & FV_MATERIAL_MASKED) != 0, t >= scene.opaque_triangles);
        assert_true(isfinite(scene.triangle[t].uv_per_metre));
    }
    assert_int_equal(scene.features,
                     FV_SCENE_TEXTURES | FV_SCENE_NORMAL_MAPS | FV_SCENE_ALPHA | FV_SCENE_SPECULAR);
    assert_close(scene.bounds[1][0] - scene.bounds[0][0], 29.767, 0.01);
}

static int set_up(void **state)
{
    (void)state;
    fill_binary();
    return mkdtemp(folder) ? 0 : -1;
}

static int tear_down(void **state)
{
    (void)state;
    static const char *const names[] = {"data.gltf", "outside.gltf", "my square.bin", "broken.gltf",
                                        "base.png",  "bent.png",     "rough.png"};
    char path[FV_PATH_MAX];
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        snprintf(path, sizeof path, "%s/%s", folder, names[i]);
        unlink(path);
    }
    return rmdir(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_same_square_in_many_forms),
        cmocka_unit_test(files_and_uris),
        cmocka_unit_test(nodes_move_their_meshes),
        cmocka_unit_test(materials_become_phong),
        cmocka_unit_test(lights),
        cmocka_unit_test(textures),
        cmocka_unit_test(what_is_wrong_is_said),
        cmocka_unit_test(bad_numbers_in_the_binary),
        cmocka_unit_test(containers),
        cmocka_unit_test(deep_trees),
        cmocka_unit_test(tangents_and_mirrors),
        cmocka_unit_test(sponza),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
