/* lit: what shading a packet's surfaces starts from: Phong's model and shadow rays. For kernels only; light.h
 * puts it together. */
#ifndef FV_TRACE_LIT_H
#define FV_TRACE_LIT_H

#include "rt/fovea/foveal.h"
#include "rt/trace/field_shade.h"
#include "rt/trace/rays.h"
#include "rt/trace/surface.h"

#define FV_PI 3.14159265f

/* As in struct fv_samples, of a packet. */
struct identified {
    vi identity, facing, second_identity, second_facing, triangle, lit;
};

/* What shading of one packet needs besides the surface. */
struct shading {
    const struct fv_tracer *tracer;
    vf random1, random2; /* in [0, 1), one a lane */
    int fewer;           /* struct fv_samples */
    int64_t *rays;       /* by enum fv_ray_kind */
    const struct field_shade *shade; /* of primary rays' hits in fields, NULL: none */
    int packet;                      /* of shade */
    struct identified *identified;   /* NULL: nobody asks */
    bool known;                      /* primary rays' surfaces are lit by the lights `lit` (struct fv_samples) */
    vi lit;
    const struct fv_light_map *maps; /* of the lights, NULL: shadow rays to all */
    /* Of kernels that follow paths (path.h): the list, the packet's first sample and the frame's seed. */
    const struct fv_samples *samples;
    int at;
    uint32_t seed;
};

/* The normalised Phong lobe towards the viewer for light from unit direction l, times the cosine.
 * `view`: unit, towards the viewer. */
static inline vf phong_lobe(const struct surface *s, vf3 view, vf3 l, vf cosine)
{
    vf along = 2.0f * cosine * vf_dot(s->normal, view) - vf_dot(l, view);
    vf lobe = vf_exp2(s->shininess * vf_log2(vf_clamp(along, 1e-6f, 1)));
    return vf_select(along > 1e-6f, lobe, vf_of(0)) * (s->shininess + 2.0f) * (cosine / (2 * FV_PI));
}

/* Radiance towards the viewer for irradiance 1 at normal incidence from l, times the cosine: Lambert plus
 * the lobe. */
static inline vf3 phong(const struct surface *s, vf3 view, vf3 l, vf cosine, bool any_specular)
{
    vf3 out = vf3_scale(s->diffuse, cosine * (1 / FV_PI));
    if (!any_specular) return out;
    return vf3_add(out, vf3_scale(s->specular, phong_lobe(s, view, l, cosine)));
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

/* Lanes of `mask` from whose start + way (up to `far` of it) nothing is in between. `rest`: what of that there is to
 * do in fields, NULL: all. `coherent`: a hint. */
static inline vi unshadowed(const struct lit *lit, vf3 way, vf far, const struct field_rest *rest, vi mask, bool coherent)
{
    unsigned bits = vi_bits(mask);
    if (!bits) return mask;
    lit->shading->rays[FV_RAY_SHADOW] += __builtin_popcount(bits);
    struct fv_ray_context context = packet_context(coherent, lit->surface->footprint[__builtin_ctz(bits)], 0);
    context.rays = lit->shading->rays;
    if (FV_FIELDS) context.own = (const int32_t *)&lit->surface->own;
    if (FV_FIELDS && rest) {
        context.left = rest->left;
        context.few = rest->known ? &rest->few : NULL;
    }
    return mask & ~packet_occluded(lit->shading->tracer, &context, lit->start, way, far, mask);
}

#endif
