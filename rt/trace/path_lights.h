/* path_lights: one light of many, for paths (path.h): choosing it, what it brings, and what it stands for. For kernels only.
 *
 * What shines and lies at a light is what that light stands for: paths that meet it take nothing from it, or it would count twice,
 * and the second time by rare paths, as lone bright pixels. Of an area light that is what lies nearer than a twentieth of its size;
 * of a point light of intensity I, what shines with radiance L and lies in the ball that would send as much, pi r^2 L = I. */
#ifndef FV_TRACE_PATH_LIGHTS_H
#define FV_TRACE_PATH_LIGHTS_H

#include "rt/trace/ggx.h"
#include "rt/trace/light.h"

static inline float brightness(const float colour[3])
{
    return 0.25f * (colour[0] + 2 * colour[1] + colour[2]);
}

/* About what a light sends to where it is not shadowed, 0 only where it can send nothing at all. */
static inline vf worth(const struct lit *lit, const struct fv_light *light)
{
    const struct surface *s = lit->surface;
    vf bright = vf_of(brightness(light->colour)), zero = vf_of(0);
    vf3 way = vf3_of(light->position);
    if (is(light, FV_LIGHT_SUN, FV_SCENE_SUN)) {
        vf cosine = vf_select(vf_dot(s->geometric, way) > 0.0f, vf_max(vf_dot(s->normal, way), zero), zero);
        return bright * cosine;
    }
    if (is(light, FV_LIGHT_AREA, FV_SCENE_AREA_LIGHTS)) {
        vf3 u = vf3_of(light->u), v = vf3_of(light->v), face = vf3_cross(u, v);
        way = vf3_sub(vf3_add(way, vf3_scale(vf3_add(u, v), vf_of(0.5f))), lit->start);
        vf square = vf_max(vf_dot(way, way), vf_of(1e-12f)), inverse = vf_rsqrt(square);
        vf area = vf_root(vf_dot(face, face)), slant = -vf_dot(face, way) * inverse;
        vf cosine = vf_max(vf_dot(s->normal, way) * inverse, vf_of(0.1f));
        vf power = bright * vf_max(slant, 0.1f * area) * cosine * vf_reciprocal(vf_clamp(square + 0.25f * area, 1e-12f, 1e30f));
        return vf_select(slant > 0.0f, power, zero);
    }
    way = vf3_sub(way, lit->start);
    vf square = vf_clamp(vf_dot(way, way), 1e-12f, 1e30f), inverse = vf_rsqrt(square);
    vf cosine = vf_select(vf_dot(s->geometric, way) > 0.0f, vf_max(vf_dot(s->normal, way), zero), zero);
    return bright * cosine * inverse * inverse * inverse;
}

/* Draws one by what they are worth: its number, and by how much it counts for all, 0 where none sends anything. The lights
 * come by one after another, each taking the place of those before by its share; what of the number says so is given
 * back whole. */
static inline vi choose_light(const struct lit *lit, vf random, vf *times)
{
    const struct fv_tracer *tracer = lit->shading->tracer;
    vf sum = vf_of(0), of_chosen = vf_of(0);
    vi chosen = vi_of(0);
    for (int i = 0; i < tracer->data->lights; i++) {
        vf w = vf_clamp(worth(lit, &tracer->light[i]), 0, 1e30f);
        sum += w;
        vf share = w / vf_max(sum, vf_of(1e-37f));
        vi taken = (random < share) & (w > 0.0f);
        random = vf_select(taken, random, random - share) / vf_max(vf_select(taken, share, 1.0f - share), vf_of(1e-7f));
        random = vf_clamp(random, 0, 0.9999999f);
        chosen = vi_select(taken, vi_of(i), chosen);
        of_chosen = vf_select(taken, w, of_chosen);
    }
    *times = vf_select(of_chosen > 0.0f, sum / vf_max(of_chosen, vf_of(1e-37f)), vf_of(0));
    return chosen;
}

static inline vf3 gather3(const float *base, vi index)
{
    return (vf3){vf_gather(base, index), vf_gather(base, index + 1), vf_gather(base, index + 2)};
}

static inline vf3 product(vf3 a, vf3 b)
{
    return (vf3){a.x * b.x, a.y * b.y, a.z * b.z};
}

/* The first surface's lobe, as denoise.specular has it. */
static inline struct gloss gloss_of(const struct lit *lit, vf3 l, vf cosine)
{
    const struct surface *s = lit->surface;
    struct gloss g = {.edge = vf_of(0)};
    if (lit->shading->tracer->phong) {
        g.lobe = phong_lobe(s, lit->view, l, cosine);
        g.density = g.lobe / vf_max(cosine, vf_of(1e-6f)) * ((s->shininess + 1.0f) / (s->shininess + 2.0f));
        return g;
    }
    g = ggx(ggx_square(s->shininess), s->normal, lit->view, l);
    g.edge = vf_select((s->flags & FV_MATERIAL_SPECULAR) != 0, g.edge, vf_of(0));
    return g;
}

/* Fresnel's law by Schlick: how much more than head-on a lobe reflects, by channel. At a grazing angle that is all, or fifty times
 * as much where that is less: less than 0.02 is no material's reflectance head-on, but none at all. The matt part has what is left
 * of it, 1 - edge, so that both together never reflect more than all. */
static inline vf3 risen(const struct surface *s, vf edge)
{
    vf3 r = s->specular;
    return (vf3){1.0f + edge * (vf_reciprocal(vf_clamp(r.x, 0.02f, 1e6f)) - 1.0f), 1.0f + edge * (vf_reciprocal(vf_clamp(r.y, 0.02f, 1e6f)) - 1.0f),
                 1.0f + edge * (vf_reciprocal(vf_clamp(r.z, 0.02f, 1e6f)) - 1.0f)};
}

/* Whether the lanes of `mask` have the same number. */
static inline bool same_in(vi number, vi mask)
{
    unsigned bits = vi_bits(mask);
    return !bits || !vi_any(mask & (number != number[__builtin_ctz(bits)]));
}

/* Irradiance / pi from one light, counted so many times, at the place (a, b) of it, in the lanes of mask; and, where asked for,
 * what reaches the viewer through the first surface's lobe, for a reflectance of 1 head-on, of which the matt part then lacks what
 * Fresnel's law gives the lobe. `coherent`: a hint that holds where all look at the same light: else it costs a seventh of a frame
 * with 80 lights. */
static __attribute__((noinline)) vf3 light_of_one(const struct lit *lit, vi chosen, vf times, vf a, vf b, vi mask, bool coherent,
                                                  vf3 *gloss)
{
    const struct surface *s = lit->surface;
    const struct fv_light *first = lit->shading->tracer->light;
    vf zero = vf_of(0);
    vi at = chosen * (int)(sizeof *first / sizeof(float));
    vi kind = vi_gather(&first->kind, at);
    vi sun = kind == FV_LIGHT_SUN, area = kind == FV_LIGHT_AREA;
    vf3 way = gather3(first->position, at), colour = gather3(first->colour, at), face = {zero, zero, zero};
    if ((FV_FEATURES & FV_SCENE_AREA_LIGHTS) && vi_any(area)) {
        vf3 u = gather3(first->u, at), v = gather3(first->v, at);
        face = vf3_cross(u, v);
        way = vf3_select(area, vf3_add(way, vf3_add(vf3_scale(u, a), vf3_scale(v, b))), way);
    }
    way = vf3_select(sun, way, vf3_sub(way, lit->start));
    vf square = vf_clamp(vf_dot(way, way), 1e-12f, 1e36f), inverse = vf_rsqrt(square);
    vf3 l = vf3_select(sun, way, vf3_scale(way, inverse));
    vf fall = vf_select(sun, vf_of(1), inverse * inverse);
    fall = vf_select(area, fall * vf_max(-vf_dot(face, l), zero), fall) * times;
    vf far = vf_select(sun, vf_of(__builtin_inff()), vf_select(area, vf_of(0.999f), vf_of(0.99999f)));
    vi free = unshadowed(lit, way, far, NULL, faces(s, l, mask & (fall > 0.0f)), coherent && same_in(chosen, mask));
    vf cosine = vf_max(vf_dot(s->normal, l), zero);
    fall = vf_select(free, fall, zero);
    if (gloss) {
        struct gloss g = gloss_of(lit, l, cosine);
        *gloss = product(vf3_scale(colour, fall * g.lobe), risen(s, g.edge));
        cosine *= 1.0f - g.edge;
    }
    return vf3_scale(colour, fall * cosine * (1 / FV_PI));
}

/* Of the rays, up to the parameter t, those that pass an area light's front on their way. */
static vi behind_lights(const struct fv_tracer *tracer, vf3 origin, vf3 direction, vf t)
{
    vi behind = vi_of(0);
    for (int i = 0; i < tracer->data->lights; i++) {
        const struct fv_light *light = &tracer->light[i];
        if (!is(light, FV_LIGHT_AREA, FV_SCENE_AREA_LIGHTS)) continue;
        vf3 u = vf3_of(light->u), v = vf3_of(light->v), face = vf3_cross(u, v);
        vf towards_it = vf_dot(face, direction);
        vf3 from = vf3_sub(origin, vf3_of(light->position));
        vf at = -vf_dot(face, from) / towards_it;
        vf3 place = vf3_add(from, vf3_scale(direction, at));
        vf whole = vf_dot(face, face);
        vf a = vf_dot(vf3_cross(place, v), face), b = vf_dot(vf3_cross(u, place), face);
        behind |= (towards_it < 0.0f) & (at > 0.0f) & (at <= t) & (a >= 0.0f) & (a <= whole) & (b >= 0.0f) & (b <= whole);
    }
    return behind;
}

/* Of the points, which shine, those that lie so near to a light that it stands for them. */
static vi near_lights(const struct fv_tracer *tracer, vf3 point, vf3 emission)
{
    vi near = vi_of(0);
    vf bright = (emission.x + 2.0f * emission.y + emission.z) * (0.25f * FV_PI);
    for (int i = 0; i < tracer->data->lights; i++) {
        const struct fv_light *light = &tracer->light[i];
        if (is(light, FV_LIGHT_POINT, FV_SCENE_POINT_LIGHTS)) {
            vf3 way = vf3_sub(point, vf3_of(light->position));
            near |= bright * vf_dot(way, way) <= brightness(light->colour);
        }
        if (!is(light, FV_LIGHT_AREA, FV_SCENE_AREA_LIGHTS)) continue;
        vf3 u = vf3_of(light->u), v = vf3_of(light->v), face = vf3_cross(u, v), place = vf3_sub(point, vf3_of(light->position));
        vf whole = vf_dot(face, face), height = vf_dot(face, place), margin = vf_of(0.05f);
        vf a = vf_dot(vf3_cross(place, v), face), b = vf_dot(vf3_cross(u, place), face);
        vi within = (a >= -margin * whole) & (a <= (1.0f + margin) * whole) & (b >= -margin * whole) & (b <= (1.0f + margin) * whole);
        near |= within & (height * height <= margin * margin * whole * vf_root(whole));
    }
    return near;
}

#endif
