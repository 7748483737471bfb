/* gltf_material: metallic-roughness materials (section 3.9) as Phong, mirror or glass.
 *
 * What varies over a surface is its base colour, its normal and where it is cut out; metallic and
 * roughness are taken as the mean of their texture, emission too. doubleSided has nothing to
 * change: both sides of every triangle are shaded. One set of texture coordinates serves a
 * material: that of its base colour texture, or else of its normal texture. */
#include "rt/scene/gltf.h"

#include "rt/scene/texture.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct slot {      /* a textureInfo */
    int64_t image; /* -1: no texture */
    int uv_set;
    float uv[2][3];
    double scale; /* of a normal map */
};

struct reading {
    struct slot base, normal, roughness, glow;
    float colour[4], emission[3];
    double metallic, rough, transmission, cutoff;
    bool masked, blended;
};

static void read_transform(struct gltf *g, const json_t *info, struct slot *s)
{
    const json_t *t = gltf_extension(g, info, "KHR_texture_transform");
    float offset[2] = {0, 0}, scale[2] = {1, 1};
    double turn =
        gltf_number(g, t, "rotation", 0, -1e6, 1e6); /* radians, counter-clockwise seen with v downwards */
    gltf_numbers(g, t, "offset", 2, offset);
    gltf_numbers(g, t, "scale", 2, scale);
    s->uv_set = (int)gltf_number(g, t, "texCoord", s->uv_set, 0, 7);
    float c = (float)cos(turn), d = (float)sin(turn);
    float uv[2][3] = {{c * scale[0], d * scale[1], offset[0]}, {-d * scale[0], c * scale[1], offset[1]}};
    memcpy(s->uv, uv, sizeof uv);
}

/* Leaves the place at the material, so that later messages name it. */
static void read_slot(struct gltf *g, const json_t *owner, const char *key, struct slot *s)
{
    char place[sizeof g->place];
    const json_t *info = gltf_object(g, owner, key);
    *s = (struct slot){.image = -1, .uv = {{1, 0, 0}, {0, 1, 0}}};
    if (!info) return;
    int64_t index = gltf_integer(g, info, "index", -1);
    s->uv_set = (int)gltf_number(g, info, "texCoord", 0, 0, 7);
    s->scale = gltf_number(g, info, "scale", 1, -1e6, 1e6);
    read_transform(g, info, s);
    memcpy(place, g->place, sizeof place);
    const json_t *texture = gltf_element(g, "textures", index);
    s->image = gltf_integer(g, texture, "source", -1);
    if (s->image < 0) gltf_fail(g, "has no source: textures must be PNG or JPEG");
    memcpy(g->place, place, sizeof place);
}

enum { WANT_COLOUR = 1, WANT_NORMAL = 2, WANT_ALPHA = 4 };

static void take_means(struct gltf_picture *p, const uint8_t *pixels, size_t count, int channels)
{
    size_t histogram[4][256] = {{0}};
    for (size_t i = 0; i < count; i++)
        for (int c = 0; c < channels; c++) histogram[c][*pixels++]++;
    for (int c = 0; c < 3; c++) {
        double sum = 0, linear = 0;
        const size_t *h = histogram[channels < 3 ? 0 : c];
        for (int v = 0; v < 256; v++) {
            sum += (double)h[v] * v;
            linear += (double)h[v] * fv_srgb_to_linear((uint8_t)v);
        }
        p->mean[c] = (float)(sum / 255 / (double)count);
        p->mean_linear[c] = (float)(linear / (double)count);
    }
    p->least_alpha = 0;
    if (channels % 2) p->least_alpha = 255;
    else
        while (p->least_alpha < 255 && !histogram[channels - 1][p->least_alpha]) p->least_alpha++;
    p->decoded = true;
}

/* The picture with what is wanted of it; decoded again only when something new is. NULL: failed. */
static const struct gltf_picture *use_picture(struct gltf *g, int64_t image, unsigned wanted, float cutoff)
{
    if (!gltf_element(g, "images", image)) return NULL;
    struct gltf_picture *p = &g->picture[image];
    bool have_alpha =
        p->decoded && ((p->alpha >= 0 && p->alpha_cutoff == cutoff) || p->least_alpha >= cutoff * 255);
    if (p->colour >= 0) wanted &= ~(unsigned)WANT_COLOUR;
    if (p->normal >= 0) wanted &= ~(unsigned)WANT_NORMAL;
    if (have_alpha) wanted &= ~(unsigned)WANT_ALPHA;
    if (p->decoded && !wanted) return p;

    struct gltf_bytes bytes;
    if (gltf_image_bytes(g, image, &bytes)) return NULL;
    char where[sizeof g->error->text];
    uint8_t *pixels;
    int width, height, channels;
    const char *uri = json_string_value(json_object_get(gltf_element(g, "images", image), "uri"));
    bool named = uri && strncmp(uri, "data:", 5) != 0;
    snprintf(where, sizeof where, "%.200s: %s%s%.160s", g->path, g->place, named ? " " : "",
             named ? uri : "");
    int undecodable =
        fv_image_decode(bytes.data, bytes.size, where, &pixels, &width, &height, &channels, g->error);
    free(bytes.owned);
    if (undecodable) {
        g->failed = true;
        return NULL;
    }
    take_means(p, pixels, (size_t)width * (size_t)height, channels);
    if (wanted & WANT_NORMAL && channels < 3) gltf_fail(g, "a normal map without colours");
    else if (wanted & WANT_NORMAL)
        p->normal = fv_build_texture(g->build, FV_TEXEL_NORMAL, pixels, width, height, channels, 0);
    if (wanted & WANT_COLOUR)
        p->colour = fv_build_texture(g->build, FV_TEXEL_COLOUR, pixels, width, height, channels, 0);
    if (wanted & WANT_ALPHA && p->least_alpha < cutoff * 255) {
        p->alpha = fv_build_texture(g->build, FV_TEXEL_ALPHA, pixels, width, height, channels, cutoff);
        p->alpha_cutoff = cutoff;
    }
    free(pixels);
    return g->failed ? NULL : p;
}

static void read_material(struct gltf *g, const json_t *m, struct reading *r, struct fv_material *out)
{
    const json_t *pbr = gltf_object(g, m, "pbrMetallicRoughness");
    const char *mode = gltf_text(g, m, "alphaMode");
    for (int i = 0; i < 4; i++) r->colour[i] = 1;
    gltf_numbers(g, pbr, "baseColorFactor", 4, r->colour);
    for (int i = 0; i < 4; i++) r->colour[i] = fminf(fmaxf(r->colour[i], 0), 1);
    r->metallic = gltf_number(g, pbr, "metallicFactor", 1, 0, 1);
    r->rough = gltf_number(g, pbr, "roughnessFactor", 1, 0, 1);
    r->cutoff = gltf_number(g, m, "alphaCutoff", 0.5, 0, 1e6);
    r->masked = mode && strcmp(mode, "MASK") == 0;
    r->blended = mode && strcmp(mode, "BLEND") == 0;
    if (mode && !r->masked && !r->blended && strcmp(mode, "OPAQUE") != 0)
        gltf_fail(g, "alphaMode %.20s, must be OPAQUE, MASK or BLEND", mode);
    if (r->blended) r->cutoff = 0.5;
    memset(r->emission, 0, sizeof r->emission);
    gltf_numbers(g, m, "emissiveFactor", 3, r->emission);
    const json_t *strength = gltf_extension(g, m, "KHR_materials_emissive_strength");
    const json_t *transmission = gltf_extension(g, m, "KHR_materials_transmission");
    float times = (float)gltf_number(g, strength, "emissiveStrength", 1, 0, 1e9);
    for (int i = 0; i < 3; i++) r->emission[i] = fmaxf(r->emission[i], 0) * times;
    r->transmission = gltf_number(g, transmission, "transmissionFactor", 0, 0, 1);
    out->ior = (float)fmax(gltf_number(g, gltf_extension(g, m, "KHR_materials_ior"), "ior", 1.5, 0, 100), 1);
    read_slot(g, pbr, "baseColorTexture", &r->base);
    read_slot(g, pbr, "metallicRoughnessTexture", &r->roughness);
    read_slot(g, m, "normalTexture", &r->normal);
    read_slot(g, m, "emissiveTexture", &r->glow);
}

/* Reflectance of dielectrics 0.04 (section 3.9.2); a GGX roughness as a Blinn-Phong exponent of
 * 2 / alpha^2 - 2 with alpha = roughness^2 (Karis, "Specular BRDF Reference", 2013), a fourth of it
 * for Phong, whose angle to the reflected ray is twice that to the half vector. */
static void shade(struct fv_material *m, const struct reading *r, const float mean[3])
{
    double r4 = r->rough * r->rough * r->rough * r->rough;
    double exponent = r4 > 0 ? (2 / r4 - 2) / 4 : FV_SHININESS_MAX;
    bool mirror = r->metallic >= 0.9 && r->rough <= 0.1;
    m->shininess = (float)fmin(fmax(exponent, 1), FV_SHININESS_MAX);
    for (int i = 0; i < 3; i++) {
        float reflected = (float)(0.04 + (mean[i] - 0.04) * r->metallic);
        m->transmission[i] = (float)(mean[i] * r->transmission * (1 - r->metallic));
        m->diffuse[i] = mirror ? 0 : (float)(r->colour[i] * (1 - r->metallic) * (1 - r->transmission));
        m->mirror[i] = mirror ? reflected : 0;
        /* The widest lobe of what is no metal cannot be told from its diffuse light. */
        m->specular[i] = mirror || (r->metallic < 0.5 && exponent <= 1) ? 0 : reflected;
        m->emission[i] = r->emission[i];
    }
}

/* An even alpha that is blended is a thin pane: it lets through, unbent, what it does not reflect. */
static void shade_pane(struct fv_material *m, float alpha)
{
    m->ior = 1;
    for (int i = 0; i < 3; i++) {
        m->transmission[i] = fminf(m->transmission[i] + 1 - alpha, 1);
        m->diffuse[i] *= alpha;
    }
}

static void make_material(struct gltf *g, const json_t *json, struct gltf_material *made)
{
    struct reading r;
    struct fv_material m = fv_material_default();
    const struct gltf_picture *p;
    float mean[3];
    read_material(g, json, &r, &m);
    if (g->failed) return;
    if (r.roughness.image >= 0) {
        if (!(p = use_picture(g, r.roughness.image, 0, 0))) return;
        r.rough *= p->mean[1];
        r.metallic *= p->mean[2];
    }
    if (r.glow.image >= 0) {
        if (!(p = use_picture(g, r.glow.image, 0, 0))) return;
        for (int i = 0; i < 3; i++) r.emission[i] *= p->mean_linear[i];
    }
    for (int i = 0; i < 3; i++) mean[i] = r.colour[i];
    shade(&m, &r, mean);
    m.alpha_cutoff = r.colour[3] > 0 ? (float)fmin(r.cutoff / r.colour[3], 2) : 2;
    if (r.base.image >= 0) {
        bool coloured = m.diffuse[0] > 0 || m.diffuse[1] > 0 || m.diffuse[2] > 0;
        bool cut = (r.masked || r.blended) && m.alpha_cutoff <= 1;
        unsigned wanted = (coloured ? WANT_COLOUR : 0) | (cut ? WANT_ALPHA : 0);
        if (!(p = use_picture(g, r.base.image, wanted, m.alpha_cutoff))) return;
        for (int i = 0; i < 3; i++) mean[i] = r.colour[i] * p->mean_linear[i];
        shade(&m, &r, mean);
        m.base_texture = coloured ? p->colour : -1;
        m.alpha_texture = cut && p->least_alpha < m.alpha_cutoff * 255 ? p->alpha : -1;
    }
    if (r.blended && m.alpha_texture < 0 && r.colour[3] < 1) shade_pane(&m, r.colour[3]);
    else made->hidden = (r.masked || r.blended) && m.alpha_cutoff > 1;
    if (r.normal.image >= 0) {
        if (!(p = use_picture(g, r.normal.image, WANT_NORMAL, 0))) return;
        m.normal_texture = p->normal;
        m.normal_scale = (float)r.normal.scale;
    }
    const struct slot *uv = r.base.image >= 0 ? &r.base : &r.normal;
    made->uv_set = uv->uv_set;
    memcpy(made->uv, uv->uv, sizeof made->uv);
    made->index = fv_build_material(g->build, &m);
}

const struct gltf_material *gltf_material_use(struct gltf *g, int64_t index)
{
    if (index >= 0 && !gltf_element(g, "materials", index)) return NULL;
    struct gltf_material *made = &g->material[index >= 0 ? (size_t)index : g->materials];
    if (made->index >= 0) return made;
    if (index >= 0) make_material(g, gltf_element(g, "materials", index), made);
    else {
        struct fv_material grey = fv_material_default();
        *made =
            (struct gltf_material){.index = fv_build_material(g->build, &grey), .uv = {{1, 0, 0}, {0, 1, 0}}};
    }
    return g->failed ? NULL : made;
}
