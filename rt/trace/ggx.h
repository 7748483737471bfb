/* ggx: a glossy lobe of microfacets: Trowbridge and Reitz's distribution with Smith's height-correlated shadowing (Heitz 2014,
 * "Understanding the masking-shadowing function", eqs. 71, 72 and 99), drawn by the normals that are visible (Dupuy and Benyoub
 * 2023, "Sampling visible GGX normals with spherical caps"), Fresnel by Schlick 1994. For kernels only.
 *
 * Materials say how wide a lobe is by Phong's exponent n; that is a fourth of Blinn's, 2 / alpha^2 - 2, as gltf_material.c makes it,
 * so that alpha^2 = 1 / (2 n + 1). */
#ifndef FV_TRACE_GGX_H
#define FV_TRACE_GGX_H

#include "rt/trace/sampled_light.h"

/* Least cosine between the normal and the way to the viewer: a bent normal may point farther off. */
#define FV_GGX_LEAST 1e-3f

/* What a lobe, of reflectance 1 before Fresnel's law, makes of two directions. */
struct gloss {
    vf lobe;    /* per steradian, times the light's cosine */
    vf density; /* that the light's direction is drawn, per steradian */
    vf edge;    /* (1 - cosine between half vector and either)^5: 0 head-on, 1 at a grazing angle */
};

static inline vf ggx_square(vf shininess)
{
    return vf_reciprocal(2.0f * vf_clamp(shininess, 0, 1e6f) + 1.0f);
}

static inline vf fifth(vf a)
{
    return a * a * (a * a) * a;
}

/* Unit, and at FV_GGX_LEAST to the normal at least. Both are unit. */
static inline vf3 ggx_view(vf3 normal, vf3 view)
{
    vf missing = vf_max(FV_GGX_LEAST - vf_dot(normal, view), vf_of(0));
    return vf3_normalise(vf3_add(view, vf3_scale(normal, missing)), normal);
}

/* All unit, `view` as ggx_view gives it; `square`: alpha^2 in (0, 1]. Light from below gives no lobe. */
static inline struct gloss ggx(vf square, vf3 normal, vf3 view, vf3 l)
{
    vf3 sum = vf3_add(view, l), half = vf3_normalise(sum, normal), across = vf3_cross(normal, half);
    vf up = vf_dot(normal, half), v = vf_max(vf_dot(normal, view), vf_of(0.5f * FV_GGX_LEAST)), to = vf_max(vf_dot(normal, l), vf_of(0));
    /* 1 - up^2 by the cross product, which rounding leaves whole where the lobe is narrow. */
    vf spread = vf_max(vf_dot(across, across) + square * up * up, 0.5f * square);
    vf facets = square * (1 / FV_PI) / (spread * spread);
    vf masked_v = vf_root(square + (1.0f - square) * v * v), masked_l = vf_root(square + (1.0f - square) * to * to);
    vf facing = vf_clamp(0.5f * vf_root(vf_dot(sum, sum)), 0, 1);
    return (struct gloss){.lobe = 0.5f * facets * to / (v * masked_l + to * masked_v),
                          .density = vf_select(up > 0.0f, 0.5f * facets / (v + masked_v), vf_of(0)),
                          .edge = fifth(1.0f - facing)};
}

/* The direction that the viewer's way is mirrored to by a facet drawn from those it sees; a, b in [0, 1). May lie below. */
static inline vf3 ggx_way(vf square, vf3 normal, vf3 view, vf a, vf b)
{
    vf3 x, y;
    vf sine, cosine, alpha = vf_root(square);
    basis(normal, &x, &y);
    vf3 own = {alpha * vf_dot(x, view), alpha * vf_dot(y, view), vf_max(vf_dot(normal, view), vf_of(0.5f * FV_GGX_LEAST))};
    own = vf3_scale(own, vf_rsqrt(vf_dot(own, own)));
    vf height = (1.0f - a) * (1.0f + own.z) - own.z, radius = vf_root(vf_max(1.0f - height * height, vf_of(0)));
    vf_turn(b - 0.5f, &sine, &cosine);
    vf3 facet = {alpha * (radius * cosine + own.x), alpha * (radius * sine + own.y), vf_max(height + own.z, vf_of(0))};
    facet = vf3_add(vf3_add(vf3_scale(x, facet.x), vf3_scale(y, facet.y)), vf3_scale(normal, facet.z));
    facet = vf3_normalise(facet, normal);
    return vf3_normalise(vf3_sub(vf3_scale(facet, 2.0f * vf_dot(facet, view)), view), normal);
}

#endif
