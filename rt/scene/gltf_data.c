/* gltf_data: container, JSON values, buffers and accessors; every length and index is checked here,
 * in 64 bits, before anything is read through it. */
#include "rt/scene/gltf.h"

#include "platform/files.h"
#include "platform/log.h"

#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const size_t FILE_MOST = (size_t)4 << 30, IMAGE_MOST = (size_t)256 << 20;
static const int64_t INTEGER_MOST = (int64_t)1 << 40; /* sums and products of two stay in range */

int gltf_fail(struct gltf *g, const char *format, ...)
{
    char text[384];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    if (!g->failed) fv_error_set(g->error, "%s: %s%s%s", g->path, g->place, g->place[0] ? ": " : "", text);
    g->failed = true;
    return -1;
}

/* Containers. */

static uint32_t little32(const uint8_t *p)
{
    return (uint32_t)p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
}

/* Section 4.4: a header of 12 bytes, a JSON chunk, perhaps a binary one, perhaps others. */
static int open_glb(struct gltf *g, const uint8_t *bytes, size_t size, struct gltf_bytes *json)
{
    if (size < 12) return gltf_fail(g, "ends within the header of a .glb");
    uint32_t version = little32(bytes + 4), length = little32(bytes + 8);
    if (version != 2) return gltf_fail(g, "a .glb of version %u, must be 2", version);
    if (length > size) return gltf_fail(g, "cut off: its header says %u bytes, it has %zu", length, size);
    for (size_t at = 12, chunk = 0; at < length; chunk++) {
        if (length - at < 8) return gltf_fail(g, "chunk %zu is cut off", chunk);
        uint32_t room = length - (uint32_t)at - 8, bytes_in = little32(bytes + at),
                 type = little32(bytes + at + 4);
        if (bytes_in > room)
            return gltf_fail(g, "chunk %zu is cut off: says %u bytes, %u follow", chunk, bytes_in, room);
        struct gltf_bytes content = {bytes + at + 8, bytes_in, NULL};
        if (chunk == 0 && type == 0x4e4f534a) *json = content;
        if (chunk == 1 && type == 0x004e4942) g->binary = content;
        at += 8 + (size_t)bytes_in;
    }
    return json->data ? 0 : gltf_fail(g, "its first chunk is not JSON");
}

static int check_header(struct gltf *g)
{
    static const char *const known[] = {"KHR_lights_punctual",   "KHR_materials_transmission",
                                        "KHR_materials_ior",     "KHR_materials_emissive_strength",
                                        "KHR_texture_transform", "KHR_mesh_quantization"};
    const json_t *asset = gltf_object(g, g->root, "asset");
    const char *version = gltf_text(g, asset, "version"), *least = gltf_text(g, asset, "minVersion");
    if (g->failed) return -1;
    if (!version || strncmp(version, "2.", 2) != 0)
        return gltf_fail(g, "asset.version is %s, must be 2.0", version ? version : "not there");
    if (least && strcmp(least, "2.0") != 0) return gltf_fail(g, "needs glTF %s, 2.0 is read", least);
    const json_t *required = gltf_list(g, g->root, "extensionsRequired"), *extension;
    size_t i;
    json_array_foreach((json_t *)required, i, extension)
    {
        const char *name = json_string_value(extension);
        bool is_known = false;
        for (size_t k = 0; name && k < sizeof known / sizeof known[0]; k++)
            is_known |= strcmp(name, known[k]) == 0;
        if (!is_known)
            return gltf_fail(g, "needs the extension %.60s, which is not read: export without it",
                             name ? name : "?");
    }
    return g->failed ? -1 : 0;
}

static void *zeroed(struct gltf *g, size_t count, size_t size)
{
    void *memory = calloc(count ? count : 1, size);
    if (!memory) fv_die(2, "memory: %s does not fit", g->path);
    return memory;
}

int gltf_open(struct gltf *g, const uint8_t *bytes, size_t size)
{
    json_error_t wrong;
    struct gltf_bytes json = {bytes, size, NULL};
    if (size >= 4 && memcmp(bytes, "glTF", 4) == 0) {
        json.data = NULL;
        if (open_glb(g, bytes, size, &json)) return -1;
    }
    g->root = json_loadb((const char *)json.data, json.size, JSON_REJECT_DUPLICATES, &wrong);
    if (!g->root) {
        g->failed = true;
        return fv_error_set(g->error, "%s:%d: %s", g->path, wrong.line, wrong.text);
    }
    if (!json_is_object(g->root)) return gltf_fail(g, "not a JSON object");
    if (check_header(g)) return -1;
    g->buffers = gltf_count(g, "buffers");
    g->pictures = gltf_count(g, "images");
    g->materials = gltf_count(g, "materials");
    g->nodes = gltf_count(g, "nodes");
    g->buffer = zeroed(g, g->buffers, sizeof *g->buffer);
    g->picture = zeroed(g, g->pictures, sizeof *g->picture);
    g->material = zeroed(g, g->materials + 1, sizeof *g->material);
    g->node_seen = zeroed(g, g->nodes, sizeof *g->node_seen);
    for (size_t i = 0; i < g->pictures; i++)
        g->picture[i].colour = g->picture[i].normal = g->picture[i].alpha = -1;
    for (size_t i = 0; i <= g->materials; i++) g->material[i].index = -1;
    return g->failed ? -1 : 0;
}

void gltf_close(struct gltf *g)
{
    for (size_t i = 0; g->buffer && i < g->buffers; i++) free(g->buffer[i].owned);
    free(g->buffer);
    free(g->picture);
    free(g->material);
    free(g->node_seen);
    json_decref(g->root);
}

/* JSON values. */

size_t gltf_count(struct gltf *g, const char *array)
{
    return json_array_size(gltf_list(g, g->root, array));
}

const json_t *gltf_element(struct gltf *g, const char *array, int64_t index)
{
    const json_t *all = gltf_list(g, g->root, array);
    if (g->failed) return NULL;
    size_t count = json_array_size(all);
    if (index < 0 || (uint64_t)index >= count) {
        gltf_fail(g, "refers to %s[%lld], there are %zu", array, (long long)index, count);
        return NULL;
    }
    const json_t *element = json_array_get(all, (size_t)index);
    snprintf(g->place, sizeof g->place, "%s[%lld]", array, (long long)index);
    if (json_is_object(element)) return element;
    gltf_fail(g, "is not an object");
    return NULL;
}

double gltf_number(struct gltf *g, const json_t *object, const char *key, double otherwise, double min,
                   double max)
{
    const json_t *value = json_object_get(object, key);
    if (!value) return otherwise;
    if (json_is_number(value) && json_number_value(value) >= min && json_number_value(value) <= max)
        return json_number_value(value);
    if (json_is_number(value))
        gltf_fail(g, "%s = %g is out of range: from %g to %g", key, json_number_value(value), min, max);
    else gltf_fail(g, "%s is not a number", key);
    return otherwise;
}

int64_t gltf_integer(struct gltf *g, const json_t *object, const char *key, int64_t otherwise)
{
    double value = gltf_number(g, object, key, (double)otherwise, 0, (double)INTEGER_MOST);
    if (value != floor(value)) gltf_fail(g, "%s = %g is not a whole number", key, value);
    return (int64_t)value;
}

static const json_t *member(struct gltf *g, const json_t *object, const char *key, json_type type,
                            const char *what)
{
    const json_t *value = json_object_get(object, key);
    if (!value || json_typeof(value) == type) return value;
    gltf_fail(g, "%s is not %s", key, what);
    return NULL;
}

const char *gltf_text(struct gltf *g, const json_t *object, const char *key)
{
    return json_string_value(member(g, object, key, JSON_STRING, "a text"));
}

const json_t *gltf_object(struct gltf *g, const json_t *object, const char *key)
{
    return member(g, object, key, JSON_OBJECT, "an object");
}

const json_t *gltf_list(struct gltf *g, const json_t *object, const char *key)
{
    return member(g, object, key, JSON_ARRAY, "a list");
}

void gltf_numbers(struct gltf *g, const json_t *object, const char *key, size_t count, float *out)
{
    const json_t *list = gltf_list(g, object, key);
    if (!list) return;
    if (json_array_size(list) != count) {
        gltf_fail(g, "%s has %zu values, needs %zu", key, json_array_size(list), count);
        return;
    }
    for (size_t i = 0; i < count; i++) {
        const json_t *value = json_array_get(list, i);
        if (!json_is_number(value) || fabs(json_number_value(value)) > FLT_MAX)
            gltf_fail(g, "%s[%zu] is not a number of normal size", key, i);
        out[i] = g->failed ? 0 : (float)json_number_value(value);
    }
}

const json_t *gltf_extension(struct gltf *g, const json_t *object, const char *name)
{
    return gltf_object(g, gltf_object(g, object, "extensions"), name);
}

/* Buffers. */

static int base64_value(char c)
{
    if (c >= 'A' && c <= 'Z') return c - 'A';
    if (c >= 'a' && c <= 'z') return c - 'a' + 26;
    if (c >= '0' && c <= '9') return c - '0' + 52;
    return c == '+' ? 62 : c == '/' ? 63 : -1;
}

static int decode_base64(struct gltf *g, const char *text, struct gltf_bytes *out)
{
    size_t length = strlen(text), n = 0;
    while (length > 0 && text[length - 1] == '=') length--;
    uint8_t *bytes = zeroed(g, length / 4 * 3 + 3, 1);
    uint32_t bits = 0;
    for (size_t i = 0; i < length; i++) {
        int value = base64_value(text[i]);
        if (value < 0) {
            free(bytes);
            return gltf_fail(g, "its data: URI is not base64 at character %zu", i);
        }
        bits = bits << 6 | (uint32_t)value;
        if (i % 4 != 0) bytes[n++] = (uint8_t)(bits >> (6 - 2 * (i % 4)));
    }
    *out = (struct gltf_bytes){bytes, n, (char *)bytes};
    return 0;
}

static int hex_value(char c)
{
    const char *digits = "0123456789abcdef", *at = c ? strchr(digits, c | 0x20) : NULL;
    return at ? (int)(at - digits) : -1;
}

/* RFC 3986, 2.1: %20 and its like. */
static void decode_percent(const char *uri, char *out, size_t size)
{
    size_t n = 0;
    for (; *uri && n + 1 < size; uri++) {
        if (uri[0] == '%' && hex_value(uri[1]) >= 0 && hex_value(uri[2]) >= 0) {
            out[n++] = (char)(hex_value(uri[1]) * 16 + hex_value(uri[2]));
            uri += 2;
        } else out[n++] = *uri;
    }
    out[n] = 0;
}

static int load_uri(struct gltf *g, const char *uri, size_t most, struct gltf_bytes *out)
{
    if (strncmp(uri, "data:", 5) == 0) {
        const char *comma = strchr(uri, ',');
        if (!comma || comma - uri < 12 || strncmp(comma - 7, ";base64", 7) != 0)
            return gltf_fail(g, "its data: URI is not base64");
        return decode_base64(g, comma + 1, out);
    }
    if (strstr(uri, "://")) return gltf_fail(g, "%.100s: only files beside it and data: URIs are read", uri);
    if (!g->folder) return gltf_fail(g, "%.100s: other files are not read here", uri);
    char name[FV_PATH_MAX], path[FV_PATH_MAX];
    struct fv_error why;
    decode_percent(uri, name, sizeof name);
    if (strlen(uri) >= sizeof name || fv_path_join(path, g->folder, name))
        return gltf_fail(g, "%.100s...: longer than %d characters", uri, FV_PATH_MAX - 1);
    if (fv_file_read(path, most, &out->owned, &out->size, &why)) return gltf_fail(g, "%.300s", why.text);
    out->data = (const uint8_t *)out->owned;
    return 0;
}

static int load_buffer(struct gltf *g, int64_t index, struct gltf_bytes *out)
{
    const json_t *buffer = gltf_element(g, "buffers", index);
    int64_t length = gltf_integer(g, buffer, "byteLength", -1);
    const char *uri = gltf_text(g, buffer, "uri");
    if (g->failed) return -1;
    struct gltf_bytes *held = &g->buffer[index];
    if (!held->data) {
        if (length < 1) return gltf_fail(g, "has no byteLength");
        if (uri && load_uri(g, uri, FILE_MOST, held)) return -1;
        if (!uri && index == 0) *held = g->binary;
        if (!held->data) return gltf_fail(g, "has neither a uri nor the binary chunk of a .glb");
        if ((uint64_t)length > held->size)
            return gltf_fail(g, "byteLength = %lld, but there are %zu bytes", (long long)length, held->size);
        held->size = (size_t)length;
    }
    *out = *held;
    return 0;
}

/* The bytes of a bufferView, still owned by their buffer, and the stride it asks for (0: none). */
static int load_view(struct gltf *g, int64_t index, struct gltf_bytes *out, int64_t *stride)
{
    const json_t *view = gltf_element(g, "bufferViews", index);
    int64_t buffer = gltf_integer(g, view, "buffer", -1), offset = gltf_integer(g, view, "byteOffset", 0);
    int64_t length = gltf_integer(g, view, "byteLength", 0);
    *stride = gltf_integer(g, view, "byteStride", 0);
    if (*stride != 0 && (*stride < 4 || *stride > 252 || *stride % 4))
        gltf_fail(g, "byteStride = %lld, must be a multiple of 4 from 4 to 252", (long long)*stride);
    if (g->failed || load_buffer(g, buffer, out)) return -1;
    if ((uint64_t)(offset + length) > out->size) {
        snprintf(g->place, sizeof g->place, "bufferViews[%lld]", (long long)index);
        return gltf_fail(g, "ends at byte %lld of a buffer of %zu", (long long)(offset + length), out->size);
    }
    *out = (struct gltf_bytes){out->data + offset, (size_t)length, NULL};
    return 0;
}

int gltf_image_bytes(struct gltf *g, int64_t index, struct gltf_bytes *out)
{
    const json_t *image = gltf_element(g, "images", index);
    const char *uri = gltf_text(g, image, "uri");
    int64_t stride, view = gltf_integer(g, image, "bufferView", -1);
    if (g->failed) return -1;
    *out = (struct gltf_bytes){0};
    if (uri) return load_uri(g, uri, IMAGE_MOST, out);
    if (view < 0) return gltf_fail(g, "has neither a uri nor a bufferView");
    return load_view(g, view, out, &stride);
}

/* Accessors, section 3.6.2. */

static const struct {
    int bytes;
    float most; /* that an integer stands for 1 at, when normalised */
} component_types[] = {{1, 127}, {1, 255}, {2, 32767}, {2, 65535}, {0, 0}, {4, 0}, {4, 0}};

int gltf_accessor_open(struct gltf *g, int64_t index, const char *type, unsigned components,
                       struct gltf_accessor *out)
{
    char place[sizeof g->place];
    const json_t *a = gltf_element(g, "accessors", index);
    memcpy(place, g->place, sizeof place);
    int64_t view = gltf_integer(g, a, "bufferView", -1), offset = gltf_integer(g, a, "byteOffset", 0);
    int64_t count = gltf_integer(g, a, "count", 0), component = gltf_integer(g, a, "componentType", 0),
            stride;
    const char *its_type = gltf_text(g, a, "type");
    const json_t *normalised = json_object_get(a, "normalized");
    if (g->failed) return -1;
    if (json_object_get(a, "sparse")) return gltf_fail(g, "is sparse, which is not read: export without it");
    if (!its_type || strcmp(its_type, type) != 0)
        return gltf_fail(g, "its type is %.20s, must be %s", its_type ? its_type : "missing", type);
    if (component < 5120 || component > 5126 || !(components >> (component - 5120) & 1))
        return gltf_fail(g, "componentType %lld is not possible for this use", (long long)component);
    if (count < 1) return gltf_fail(g, "its count is 0");
    if (count > FV_ELEMENTS_MAX)
        return gltf_fail(g, "%lld elements, at most %d are read", (long long)count, FV_ELEMENTS_MAX);
    if (view < 0) return gltf_fail(g, "has no bufferView");
    struct gltf_bytes bytes;
    if (load_view(g, view, &bytes, &stride)) return -1;
    memcpy(g->place, place, sizeof place);
    out->components = strcmp(type, "SCALAR") == 0 ? 1 : type[3] - '0';
    int64_t element = component_types[component - 5120].bytes * out->components;
    if (stride == 0) stride = element;
    if (stride < element)
        return gltf_fail(g, "elements of %lld bytes do not fit into byteStride = %lld", (long long)element,
                         (long long)stride);
    if ((uint64_t)(offset + stride * (count - 1) + element) > bytes.size)
        return gltf_fail(g, "ends at byte %lld of a bufferView of %zu",
                         (long long)(offset + stride * (count - 1) + element), bytes.size);
    out->data = bytes.data + offset;
    out->count = (uint64_t)count;
    out->stride = (uint64_t)stride;
    out->component = (int)component;
    out->normalised = json_is_true(normalised);
    return 0;
}

void gltf_accessor_floats(const struct gltf_accessor *a, uint64_t i, float *out)
{
    const uint8_t *p = a->data + i * a->stride;
    int type = a->component - 5120, bytes = component_types[type].bytes;
    for (int k = 0; k < a->components; k++, p += bytes) {
        uint16_t half = (uint16_t)(p[0] | (bytes > 1 ? p[1] << 8 : 0));
        switch (type) {
        case 0: out[k] = (int8_t)p[0]; break;
        case 1: out[k] = p[0]; break;
        case 2: out[k] = (int16_t)half; break;
        case 3: out[k] = half; break;
        default: memcpy(&out[k], p, sizeof out[k]);
        }
        if (a->normalised && type < 4) out[k] = fmaxf(out[k] / component_types[type].most, -1);
    }
}

uint32_t gltf_accessor_index(const struct gltf_accessor *a, uint64_t i)
{
    const uint8_t *p = a->data + i * a->stride;
    switch (component_types[a->component - 5120].bytes) {
    case 1: return p[0];
    case 2: return (uint32_t)(p[0] | p[1] << 8);
    default: return little32(p);
    }
}
