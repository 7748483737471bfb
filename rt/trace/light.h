/* light: light on a packet's surfaces: ambient and emitted, from points and suns by a shadow ray each or a
 * lookup in a map (visible.h), and what is sampled (sampled_light.h). For kernels only. */
#ifndef FV_TRACE_LIGHT_H
#define FV_TRACE_LIGHT_H

#include "rt/trace/sampled_light.h"
#include "rt/trace/visible.h"

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

/* Of the lanes of `facing`, those that the light, a point or sun, reaches: as is known, by its map, or by rays. */
static inline vi reach(const struct lit *lit, int light, vf3 way, vf far, vi facing, bool primary)
{
    const struct shading *shading = lit->shading;
    if (primary && shading->known) return facing & ((shading->lit & (int32_t)(1u << (light & 31))) != 0);
    if (primary && shading->maps && shading->maps[light].nearness)
        return mapped(lit, &shading->maps[light], way, far, facing);
    if (FV_FIELDS && primary && shading->shade) {
        struct field_rest rest;
        field_rest_of(shading->tracer, shading->shade, light, shading->packet, &rest);
        return rest.blocked ? vi_of(0) : unshadowed(lit, way, far, &rest, facing, true);
    }
    return unshadowed(lit, way, far, NULL, facing, true);
}

/* What primary rays' surfaces give apart from the rest (struct fv_samples). */
struct parted {
    vf3 albedo, light;
    vf variance; /* of paths' light */
};

/* Emission, ambient and all lights. `direction`: of the ray that came here, any length. `primary`: rays from
 * the eye, whose ambient light may be taken away. `parted`: NULL, or where sampled light goes instead of into
 * what is returned. Shadow rays to points and suns go first, while the textures' texels are on their way. */
static inline vf3 light_surface(const struct shading *shading, struct surface *s, vf3 direction, bool primary,
                                struct parted *parted)
{
    const struct fv_scene *scene = shading->tracer->data;
    const struct fv_light *light_of = shading->tracer->light;
    struct lit lit = {.shading = shading, .surface = s};
    vi reached[FV_LIGHTS_MAX];
    vf3 way, irradiance, zero = {vf_of(0), vf_of(0), vf_of(0)};
    vf far;
    lit.start = vf3_add(s->point, vf3_scale(s->geometric, s->offset));
    for (int i = 0; i < scene->lights; i++) {
        if (is(&light_of[i], FV_LIGHT_AREA, FV_SCENE_AREA_LIGHTS)) continue;
        vf3 l = towards(&lit, &light_of[i], &way, &far, &irradiance);
        vi facing = faces(s, l, vi_of(-1));
        reached[i] = reach(&lit, i, way, far, facing, primary);
        if (shading->identified) s->shadows -= facing & ~reached[i];
        if (shading->identified && primary && i < 32) shading->identified->lit |= reached[i] & (int32_t)(1u << i);
    }
    surface_fetch(s, scene);
    lit.sum = s->emission;
    lit.any_specular = (s->any & FV_FEATURES & FV_MATERIAL_SPECULAR) != 0;
    if (lit.any_specular) lit.view = vf3_normalise(vf3_scale(direction, vf_of(-1)), s->normal);
    for (int i = 0; i < scene->lights; i++) {
        if (is(&light_of[i], FV_LIGHT_AREA, FV_SCENE_AREA_LIGHTS) || !vi_any(reached[i])) continue;
        vf3 l = towards(&lit, &light_of[i], &way, &far, &irradiance);
        add_light(&lit, l, irradiance, reached[i]);
    }
    /* A little darker from below, so that vaults keep their shape where no light reaches. */
    vf sky = 0.8f + 0.2f * s->normal.y;
    if (primary && (scene->features & FV_FEATURES & FV_SCENE_AO)) sky *= unoccluded(&lit);
    vf3 light = {scene->ambient[0] * sky, scene->ambient[1] * sky, scene->ambient[2] * sky};
    for (int i = 0; i < scene->lights; i++)
        if (is(&light_of[i], FV_LIGHT_AREA, FV_SCENE_AREA_LIGHTS)) add_area(&lit, &light_of[i], &light);
    if ((FV_FEATURES & FV_SCENE_STOCHASTIC) && parted) {
        parted->albedo =
            (vf3){vf_clamp(s->diffuse.x, 0, 1), vf_clamp(s->diffuse.y, 0, 1), vf_clamp(s->diffuse.z, 0, 1)};
        parted->albedo = vf3_select(s->hit, parted->albedo, zero);
        parted->light = vf3_select(s->hit, light, zero);
    } else {
        lit.sum.x += s->diffuse.x * light.x;
        lit.sum.y += s->diffuse.y * light.y;
        lit.sum.z += s->diffuse.z * light.z;
    }
    return vf3_select(s->hit, lit.sum, zero);
}

#endif
