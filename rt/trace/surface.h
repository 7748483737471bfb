/* surface: what a packet's hits look like: records gathered, textures fetched, normals bent.
 * For kernels only; light.h says how it is lit. */
#ifndef FV_TRACE_SURFACE_H
#define FV_TRACE_SURFACE_H

#include "rt/trace/field_surface.h"

/* Which texels a lane's bilinear fetch reads (of the scene's one array), and their weights. */
struct texel_place {
    vi upper, lower; /* the left ones of two rows; the right ones stand behind them */
    vf fx, fy;
};

/* Interpolated vertex data of a packet. */
struct interpolated {
    vf u, v, uv_per_metre;
    vf3 normal, tangent;
    vf bitangent_sign;
};

enum { FV_SURFACE_PARTS = 0x4000 };

struct surface {
    vi hit;            /* mask */
    vi own;            /* of struct packet_hit; set where the kernel shows fields */
    vi flags;          /* enum fv_material_flags; any: of all lanes together */
    uint32_t any;
    vf3 point;         /* world */
    vf offset;         /* distance along `geometric` that clears the surface's own rounding */
    vf3 geometric;     /* unit, towards the viewer */
    vf3 normal;        /* shading normal, unit, towards the viewer; bent by surface_fetch */
    vi flat;           /* mask: a mirror whose normals are all the triangle's own */
    vi outside;        /* mask: seen from the side that the triangle's winding faces */
    vf footprint;      /* m: the ray cone's width here */
    vf3 diffuse, specular, emission, mirror, transmission;
    vf shininess, ior;
    vi shadows;        /* lights that something hides, counted where surfaces are told apart */
    vi of;             /* material, or part of the fields behind FV_SURFACE_PARTS: what it is of */
    /* Kept from surface_set for surface_fetch. */
    struct interpolated in;
    struct texel_place base, bump;
    vf bump_scale;
};

/* Rows of W 32-bit words, one a lane, become words of W lanes. */
static inline void transpose(vi a[FV_WIDTH])
{
#pragma GCC unroll 4
    for (int stage = 1; stage < FV_WIDTH; stage *= 2) {
        vi b[FV_WIDTH];
#pragma GCC unroll 8
        for (int i = 0; i < FV_WIDTH / 2; i++) {
            vi p = a[i], q = a[i + FV_WIDTH / 2];
            b[2 * i] = vi_zip_first(p, q);
            b[2 * i + 1] = vi_zip_second(p, q);
        }
#pragma GCC unroll 16
        for (int i = 0; i < FV_WIDTH; i++) a[i] = b[i];
    }
}

/* The 16 words of each lane's triangle record: whole cache lines and shuffles, which beat gathers. */
static inline void load_records(const struct fv_triangle *triangle, vi index, vi word[16])
{
    VI_INDICES(at, index);
#pragma GCC unroll 4
    for (int part = 0; part < 16; part += FV_WIDTH) {
        vi rows[FV_WIDTH];
#pragma GCC unroll 16
        for (int lane = 0; lane < FV_WIDTH; lane++)
            rows[lane] = vi_load((const int32_t *)(triangle + at[lane]) + part);
        transpose(rows);
#pragma GCC unroll 16
        for (int i = 0; i < FV_WIDTH; i++) word[part + i] = rows[i];
    }
}

static inline vf low16(vi word)
{
    return vf_from((word << 16) >> 16);
}

static inline vf high16(vi word)
{
    return vf_from(word >> 16);
}

/* Coordinates wrap; the level is the nearest to one texel a footprint (in uv). uv of any finite size. */
static inline struct texel_place place_texels(const struct fv_texture *t, vf u, vf v, vf footprint)
{
    vf texels = footprint * __builtin_sqrtf((float)t->width * (float)t->height);
    vf levels = vf_clamp(vf_log2(vf_clamp(texels, 1, 1e6f)) + 0.5f, 0, (float)(t->levels - 1));
    vi level = vi_from(levels);
    vi offset = vi_table16(t->offset, level);
    vi width = vi_of(t->width) >> level, height = vi_of(t->height) >> level;
    width = vi_select(width > 1, width, vi_of(1));
    height = vi_select(height > 1, height, vi_of(1));
    vf x = (u - vf_floor(u)) * vf_from(width) - 0.5f, y = (v - vf_floor(v)) * vf_from(height) - 0.5f;
    vf x0 = vf_floor(x), y0 = vf_floor(y);
    vi ix = vi_from(x0), iy = vi_from(y0), mx = width - 1, my = height - 1;
    offset += ix & mx;
    width += 1;
    return (struct texel_place){offset + (iy & my) * width, offset + ((iy + 1) & my) * width, x - x0, y - y0};
}

static inline void select_place(struct texel_place *to, vi lanes, const struct texel_place *from)
{
    to->upper = vi_select(lanes, from->upper, to->upper);
    to->lower = vi_select(lanes, from->lower, to->lower);
    to->fx = vf_select(lanes, from->fx, to->fx);
    to->fy = vf_select(lanes, from->fy, to->fy);
}

/* Asks for a fetch's cache lines ahead of time. */
static inline void prefetch(const uint32_t *texel, const struct texel_place *p)
{
    VI_INDICES(upper, p->upper);
    VI_INDICES(lower, p->lower);
#pragma GCC unroll 16
    for (int i = 0; i < FV_WIDTH; i++) {
        __builtin_prefetch(texel + upper[i]);
        __builtin_prefetch(texel + lower[i]);
    }
}

/* Bilinear mean of the three 10-bit channels, 0..1023. */
static inline vf3 fetch(const uint32_t *texel, const struct texel_place *p)
{
    vi a, b, c, d;
    vi_gather_pairs(texel, p->upper, &a, &b);
    vi_gather_pairs(texel, p->lower, &c, &d);
    vf w11 = p->fx * p->fy, w10 = p->fx - w11, w01 = p->fy - w11, w00 = 1.0f - p->fx - w01;
#define CHANNEL(shift)                                                                          \
    (vf_from((a >> shift) & 1023) * w00 + vf_from((b >> shift) & 1023) * w10 +                  \
     vf_from((c >> shift) & 1023) * w01 + vf_from((d >> shift) & 1023) * w11)
    return (vf3){CHANNEL(0), CHANNEL(10), CHANNEL(20)};
#undef CHANNEL
}

static inline void set_lanes(vf3 *to, vi lanes, const float value[3])
{
    *to = vf3_select(lanes, vf3_of(value), *to);
}

/* Applies one material to the lanes that have it: everything about it is uniform. Textures are only
 * placed. */
static inline void apply_material(struct surface *s, const struct fv_scene *scene, const struct fv_material *m,
                                  vi lanes, vf footprint)
{
    uint32_t flags = m->flags & FV_FEATURES;
    s->any |= flags;
    s->flags = vi_select(lanes, vi_of((int32_t)flags), s->flags);
    set_lanes(&s->diffuse, lanes, m->diffuse);
    const struct fv_texture *base = NULL;
    struct texel_place p;
    if (flags & FV_MATERIAL_TEXTURED) {
        base = &scene->texture[m->base_texture];
        p = place_texels(base, s->in.u, s->in.v, footprint);
        select_place(&s->base, lanes, &p);
    }
    if (flags & FV_MATERIAL_NORMAL_MAPPED) {
        const struct fv_texture *t = &scene->texture[m->normal_texture];
        if (base && base->width == t->width && base->height == t->height) {
            /* Textures of one size have their texels in the same places. */
            p.upper += (int32_t)(t->offset[0] - base->offset[0]);
            p.lower += (int32_t)(t->offset[0] - base->offset[0]);
        } else {
            p = place_texels(t, s->in.u, s->in.v, footprint);
        }
        select_place(&s->bump, lanes, &p);
        s->bump_scale = vf_select(lanes, vf_of(m->normal_scale), s->bump_scale);
    }
    if (flags & FV_MATERIAL_SPECULAR) {
        set_lanes(&s->specular, lanes, m->specular);
        s->shininess = vf_select(lanes, vf_of(m->shininess), s->shininess);
    }
    if (flags & FV_MATERIAL_EMISSIVE) set_lanes(&s->emission, lanes, m->emission);
    if (flags & FV_MATERIAL_MIRROR) set_lanes(&s->mirror, lanes, m->mirror);
    if (flags & FV_MATERIAL_GLASS) {
        set_lanes(&s->transmission, lanes, m->transmission);
        s->ior = vf_select(lanes, vf_of(m->ior), s->ior);
    }
}

static inline struct interpolated interpolate(const struct packet_hit *h, const vi w[16])
{
    struct interpolated in;
    vf a = 1.0f - h->u - h->v, b = h->u, c = h->v;
    in.u = a * (vf)w[0] + b * (vf)w[2] + c * (vf)w[4];
    in.v = a * (vf)w[1] + b * (vf)w[3] + c * (vf)w[5];
    in.normal = (vf3){a * low16(w[6]) + b * high16(w[7]) + c * low16(w[9]),
                      a * high16(w[6]) + b * low16(w[8]) + c * high16(w[9]),
                      a * low16(w[7]) + b * high16(w[8]) + c * low16(w[10])};
    in.tangent = (vf3){low16(w[11]), high16(w[11]), low16(w[12])};
    in.tangent = vf3_scale(in.tangent, vf_of(1 / 32767.0f));
    in.bitangent_sign = high16(w[12]);
    in.uv_per_metre = (vf)w[13];
    return in;
}

/* Mask of the lanes whose corners have the triangle's own normal, to a milliradian. */
static inline vi flat_normals(const struct surface *s, const vi w[16])
{
    vf3 a = {low16(w[6]), high16(w[6]), low16(w[7])}, b = {high16(w[7]), low16(w[8]), high16(w[8])};
    vf3 c = {low16(w[9]), high16(w[9]), low16(w[10])}, n = s->in.normal, g = s->geometric;
    vf3 ab = vf3_sub(a, b), ac = vf3_sub(a, c);
    vf3 off = vf3_cross(n, g);
    vf most = vf_max(vf_dot(off, off), vf_max(vf_dot(ab, ab), vf_dot(ac, ac)));
    return s->hit & (most < 32.767f * 32.767f);
}

/* Everything about the packet's hits but what textures hold, whose texels are asked for: trace
 * something else before surface_fetch. `base`, `growth`: the ray cone, as in fv_ray_context. */
static inline void surface_set(struct surface *s, const struct fv_tracer *tracer, const struct packet_hit *h,
                               vf3 origin, vf3 direction, vf base, vf growth)
{
    const struct fv_scene *scene = tracer->data;
    vi w[16] = {vi_of(0)};
    if (FV_MESHES && (!FV_FIELDS || scene->triangles > 0)) load_records(scene->triangle, h->triangle, w);
    s->in = interpolate(h, w);
    if (FV_FEATURES & FV_SCENE_MOVING) instance_turn_lanes(tracer, h->object, &s->in.normal, &s->in.tangent);
    vf3 zero = {vf_of(0), vf_of(0), vf_of(0)}, up = {vf_of(0), vf_of(1), vf_of(0)};
    vf t = vf_select(h->hit, h->t, vf_of(0));
    s->hit = h->hit;
    s->point = vf3_add(origin, vf3_scale(direction, t));
    s->footprint = base + t * growth;
    /* A hit's rounding error grows with its coordinates, the way there, and the triangle's length. */
    vf reach = vf_max(vf_max(vf_abs(s->point.x), vf_abs(s->point.y)), vf_abs(s->point.z));
    vf3 way = vf3_sub(s->point, origin);
    reach = vf_max(reach, vf_max(vf_max(vf_abs(way.x), vf_abs(way.y)), vf_abs(way.z)));
    s->offset = vf_max(reach * 2e-6f, (vf)w[14]);
    vf3 geometric = vf3_normalise(h->normal, up);
    vi solid = FV_FIELDS ? h->hit & (h->part >= 0) : vi_of(0);
    if (FV_FIELDS && vi_any(solid)) {
        vf3 slope = field_normal(&scene->fields, h, s->point, direction, s->footprint);
        geometric = vf3_select(solid, slope, geometric);
        s->in.normal = vf3_select(solid, slope, s->in.normal);
        /* Shadow rays begin farther out than what counts as a hit where they begin and where this one was. */
        vf hit = 2.0f * FV_FIELD_HIT * (1.0f + t * vf_root(vf_dot(direction, direction)));
        s->offset = vf_select(solid, vf_max(reach * 2e-6f, hit + FV_FIELD_HIT), s->offset);
    }
    if (FV_FIELDS) s->own = h->own;
    vf facing = vf_dot(geometric, direction);
    s->outside = facing < 0.0f;
    s->geometric = vf3_select(s->outside, geometric, vf3_scale(geometric, vf_of(-1)));
    vf3 normal = vf3_normalise(s->in.normal, s->geometric);
    /* The file's normals may point either way; shading wants them on the viewer's side. */
    vi same_side = vf_dot(normal, s->geometric) >= 0.0f;
    s->normal = vf3_select(same_side, normal, vf3_scale(normal, vf_of(-1)));
    s->diffuse = s->specular = s->emission = s->mirror = s->transmission = zero;
    s->shininess = s->ior = vf_of(1);
    s->flags = s->base.upper = s->base.lower = s->bump.upper = s->bump.lower = vi_of(0);
    s->base.fx = s->base.fy = s->bump.fx = s->bump.fy = s->bump_scale = vf_of(0);
    s->any = 0;
    vf cosine = vf_abs(facing) * vf_rsqrt(vf_max(vf_dot(direction, direction), vf_of(1e-30f)));
    /* In texture coordinates, between its sizes along and across the slope. */
    vf footprint = s->footprint * s->in.uv_per_metre * vf_rsqrt(vf_max(cosine, vf_of(0.05f)));
    vi material = (w[10] >> 16) & 0xffff;
    s->shadows = vi_of(0);
    s->of = FV_FIELDS ? vi_select(solid, (h->part & (FV_SURFACE_PARTS - 1)) | FV_SURFACE_PARTS, material) : material;
    if (FV_FIELDS) material = field_materials(&scene->fields, h, material);
    unsigned pending = vi_bits(h->hit);
    while (pending) {
        int id = material[__builtin_ctz(pending)];
        vi lanes = h->hit & (material == id);
        pending &= ~vi_bits(lanes);
        apply_material(s, scene, &scene->material[id], lanes, footprint);
    }
    if (FV_FIELDS) field_paint(&scene->fields, h, s->point, direction, s->geometric, s->footprint, &s->diffuse);
    s->flat = vi_of(0);
    if (s->any & FV_FEATURES & FV_MATERIAL_MIRROR)
        s->flat = flat_normals(s, w) & ~solid & ((s->flags & FV_MATERIAL_NORMAL_MAPPED) == 0);
    if (s->any & FV_FEATURES & FV_MATERIAL_TEXTURED) prefetch(scene->texel, &s->base);
    if (s->any & FV_FEATURES & FV_MATERIAL_NORMAL_MAPPED) prefetch(scene->texel, &s->bump);
}

static inline void bend_normal(struct surface *s, vf3 texel)
{
    vf scale = s->bump_scale * (1 / 511.5f);
    vf3 n = {(texel.x - 511.5f) * scale, (texel.y - 511.5f) * scale, (texel.z - 511.5f) * (1 / 511.5f)};
    vf3 t = s->in.tangent, a = s->normal;
    vf3 b = vf3_scale(vf3_cross(a, t), s->in.bitangent_sign);
    vf3 bent = vf3_add(vf3_add(vf3_scale(t, n.x), vf3_scale(b, n.y)), vf3_scale(a, n.z));
    vi lanes = (s->flags & FV_MATERIAL_NORMAL_MAPPED) != 0;
    s->normal = vf3_select(lanes, vf3_normalise(bent, a), a);
}

/* Textures into diffuse and normal: one fetch each for all materials of the packet. */
static inline void surface_fetch(struct surface *s, const struct fv_scene *scene)
{
    if (s->any & FV_FEATURES & FV_MATERIAL_TEXTURED) {
        vf3 c = vf3_scale(fetch(scene->texel, &s->base), vf_of(1 / 1023.0f));
        vi lanes = (s->flags & FV_MATERIAL_TEXTURED) != 0;
        vf3 textured = {s->diffuse.x * c.x * c.x, s->diffuse.y * c.y * c.y, s->diffuse.z * c.z * c.z};
        s->diffuse = vf3_select(lanes, textured, s->diffuse);
    }
    if (s->any & FV_FEATURES & FV_MATERIAL_NORMAL_MAPPED) bend_normal(s, fetch(scene->texel, &s->bump));
}

#endif
