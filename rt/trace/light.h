/* light: direct light on a packet's surfaces: Phong, with a shadow ray to each light and several
 * to area lights. For kernels only. */
#ifndef FV_TRACE_LIGHT_H
#define FV_TRACE_LIGHT_H

#include "rt/fovea/foveal.h"
#include "rt/trace/rays.h"
#include "rt/trace/surface.h"

#define FV_PI 3.14159265f

/* What shading of one packet needs besides the surface. */
struct shading {
    const struct fv_tracer *tracer;
    vf random1, random2; /* in [0, 1), one a lane */
    int64_t *rays;       /* by enum fv_ray_kind */
};

/* Radiance towards the viewer for irradiance 1 at normal incidence from unit direction l, times the
 * cosine: Lambert plus the normalised Phong lobe. `view`: unit, towards the viewer. */
static inline vf3 phong(const struct surface *s, vf3 view, vf3 l, vf cosine, bool any_specular)
{
    vf3 out = vf3_scale(s->diffuse, cosine * (1 / FV_PI));
    if (!any_specular) return out;
    vf along = 2.0f * cosine * vf_dot(s->normal, view) - vf_dot(l, view);
    vf lobe = vf_exp2(s->shininess * vf_log2(vf_clamp(along, 1e-6f, 1)));
    lobe = vf_select(along > 1e-6f, lobe, vf_of(0)) * (s->shininess + 2.0f) * (cosine / (2 * FV_PI));
    return vf3_add(out, vf3_scale(s->specular, lobe));
}

struct lit {
    const struct shading *shading;
    const struct surface *surface;
    vf3 view, start; /* start: where shadow rays leave */
    bool any_specular;
    vf3 sum;
};

/* Lanes of `mask` that a light in unit direction l may reach by the surface's own slope. */
static inline vi faces(const struct surface *s, vf3 l, vi mask)
{
    return mask & s->hit & (vf_dot(s->geometric, l) > 0.0f) & (vf_dot(s->normal, l) > 0.0f);
}

/* Lanes of `mask` from whose start + way (up to `far` of it) nothing is in between. */
static inline vi unshadowed(const struct lit *lit, vf3 way, vf far, vi mask)
{
    unsigned bits = vi_bits(mask);
    if (!bits) return mask;
    lit->shading->rays[FV_RAY_SHADOW] += __builtin_popcount(bits);
    struct fv_ray_context context = packet_context(true, lit->surface->footprint[__builtin_ctz(bits)], 0);
    return mask & ~packet_occluded(lit->shading->tracer, &context, lit->start, way, far, mask);
}

/* Adds light from unit direction l, `irradiance` at normal incidence, in the lanes of `mask`. */
static inline void add_light(struct lit *lit, vf3 l, vf3 irradiance, vi mask)
{
    const struct surface *s = lit->surface;
    vf cosine = vf_max(vf_dot(s->normal, l), vf_of(0));
    vf3 f = phong(s, lit->view, l, cosine, lit->any_specular);
    vf3 add = {f.x * irradiance.x, f.y * irradiance.y, f.z * irradiance.z};
    lit->sum = vf3_add(lit->sum, vf3_select(mask, add, (vf3){vf_of(0), vf_of(0), vf_of(0)}));
}

/* Whether the light is of this kind, which a copy of the kernel without the feature need not ask. */
static inline bool is(const struct fv_light *light, enum fv_light_kind kind, uint32_t feature)
{
    return (FV_FEATURES & feature) && light->kind == kind;
}

/* Way and unit direction from the surface to a point or sun, and the irradiance it sends. */
static inline vf3 towards(const struct lit *lit, const struct fv_light *light, vf3 *way, vf *far, vf3 *irradiance)
{
    *irradiance = vf3_of(light->colour);
    *way = vf3_of(light->position);
    *far = vf_of(__builtin_inff());
    if (!(FV_FEATURES & FV_SCENE_POINT_LIGHTS) || is(light, FV_LIGHT_SUN, FV_SCENE_SUN)) return *way;
    *way = vf3_sub(*way, lit->start);
    *far = vf_of(0.99999f);
    vf inverse = vf_rsqrt(vf_max(vf_dot(*way, *way), vf_of(1e-12f)));
    *irradiance = vf3_scale(*irradiance, inverse * inverse);
    return vf3_scale(*way, inverse);
}

/* Stratified by a rank-1 sequence (Roberts' R2) shifted by the lane's random numbers. A call: inlined, it
 * takes registers from scenes without area lights. */
static __attribute__((noinline)) void add_area(struct lit *lit, const struct fv_light *light)
{
    int n = lit->shading->tracer->area_spp;
    vf3 u = vf3_of(light->u), v = vf3_of(light->v), corner = vf3_of(light->position);
    vf3 face = {u.y * v.z - u.z * v.y, u.z * v.x - u.x * v.z, u.x * v.y - u.y * v.x}; /* length: area */
    for (int i = 0; i < n; i++) {
        vf a = lit->shading->random1 + (float)i * 0.75487766f, b = lit->shading->random2 + (float)i * 0.56984029f;
        a -= vf_floor(a);
        b -= vf_floor(b);
        vf3 at = vf3_add(corner, vf3_add(vf3_scale(u, a), vf3_scale(v, b)));
        vf3 way = vf3_sub(at, lit->start);
        vf inverse = vf_rsqrt(vf_max(vf_dot(way, way), vf_of(1e-6f)));
        vf3 l = vf3_scale(way, inverse);
        vf emitted = vf_max(-vf_dot(face, l), vf_of(0)) * inverse * inverse / (float)n;
        vi free = unshadowed(lit, way, vf_of(0.999f), faces(lit->surface, l, emitted > 0.0f));
        if (vi_any(free)) add_light(lit, l, vf3_scale(vf3_of(light->colour), emitted), free);
    }
}

/* Emission, ambient and all lights. `direction`: of the ray that came here, any length. Shadow rays to
 * points and suns go first, while the textures' texels are on their way. */
static inline vf3 light_surface(const struct shading *shading, struct surface *s, vf3 direction)
{
    const struct fv_scene *scene = shading->tracer->data;
    struct lit lit = {.shading = shading, .surface = s};
    vi reached[FV_LIGHTS_MAX];
    vf3 way, irradiance, zero = {vf_of(0), vf_of(0), vf_of(0)};
    vf far;
    lit.start = vf3_add(s->point, vf3_scale(s->geometric, s->offset));
    for (int i = 0; i < scene->lights; i++) {
        if (is(&scene->light[i], FV_LIGHT_AREA, FV_SCENE_AREA_LIGHTS)) continue;
        vf3 l = towards(&lit, &scene->light[i], &way, &far, &irradiance);
        reached[i] = unshadowed(&lit, way, far, faces(s, l, vi_of(-1)));
    }
    surface_fetch(s, scene);
    /* A little darker from below, so that vaults keep their shape where no light reaches. */
    vf sky = 0.8f + 0.2f * s->normal.y;
    lit.sum = (vf3){s->emission.x + scene->ambient[0] * s->diffuse.x * sky,
                    s->emission.y + scene->ambient[1] * s->diffuse.y * sky,
                    s->emission.z + scene->ambient[2] * s->diffuse.z * sky};
    lit.any_specular = (s->any & FV_FEATURES & FV_MATERIAL_SPECULAR) != 0;
    if (lit.any_specular) lit.view = vf3_normalise(vf3_scale(direction, vf_of(-1)), s->normal);
    for (int i = 0; i < scene->lights; i++) {
        if (is(&scene->light[i], FV_LIGHT_AREA, FV_SCENE_AREA_LIGHTS)) {
            add_area(&lit, &scene->light[i]);
        } else if (vi_any(reached[i])) {
            vf3 l = towards(&lit, &scene->light[i], &way, &far, &irradiance);
            add_light(&lit, l, irradiance, reached[i]);
        }
    }
    return vf3_select(s->hit, lit.sum, zero);
}

#endif
