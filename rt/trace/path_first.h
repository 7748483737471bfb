/* path_first: how paths (path.h) leave the surfaces that they meet: by the cosine, and the first one by its lobe too. For kernels
 * only. */
#ifndef FV_TRACE_PATH_FIRST_H
#define FV_TRACE_PATH_FIRST_H

#include "rt/trace/path_lights.h"

/* Unit, about the unit vector `about`: at this cosine to it. */
static inline vf3 around(vf3 about, vf height, vf turn)
{
    vf3 across, along;
    vf sine, cosine, radius = vf_sqrt(vf_max(1.0f - height * height, vf_of(0)));
    basis(about, &across, &along);
    vf_turn(turn - 0.5f, &sine, &cosine);
    return vf3_add(vf3_add(vf3_scale(across, radius * cosine), vf3_scale(along, radius * sine)), vf3_scale(about, height));
}

/* Spread by the cosine about the shading normal; below the surface itself their reflections at it count. */
static inline vf3 matt_way(const struct surface *s, vf a, vf b)
{
    vf3 way = around(s->normal, vf_sqrt(vf_max(1.0f - a, vf_of(0))), b);
    vf below = vf_min(vf_dot(way, s->geometric), vf_of(0));
    return vf3_sub(way, vf3_scale(s->geometric, 2.0f * below));
}

/* What share of the first surface's reflectance is its lobe's, by channel. */
static inline vf share_of(vf diffuse, vf specular)
{
    vf sum = diffuse + specular;
    return vf_select(sum > 0.0f, specular / vf_max(sum, vf_of(1e-20f)), vf_of(0));
}

struct first {
    vf3 lobe;   /* its share head-on, by channel */
    vf chance;  /* that a path leaves by the lobe */
    bool glossy;
};

/* Of a glossy surface, seen from lit->view. */
static inline void first_set(struct first *f, const struct lit *lit)
{
    const struct surface *s = lit->surface;
    f->glossy = true;
    f->lobe = (vf3){share_of(s->diffuse.x, s->specular.x), share_of(s->diffuse.y, s->specular.y), share_of(s->diffuse.z, s->specular.z)};
    vf share = (f->lobe.x + 2.0f * f->lobe.y + f->lobe.z) * 0.25f;
    if (!lit->shading->tracer->phong) {
        vf edge = fifth(1.0f - vf_clamp(vf_dot(s->normal, lit->view), 0, 1));
        vf3 more = product(f->lobe, risen(s, edge));
        vf lobe = vf_max((more.x + 2.0f * more.y + more.z) * 0.25f, vf_of(0)), matt = vf_max((1.0f - share) * (1.0f - edge), vf_of(0));
        share = share_of(matt, lobe);
    }
    f->chance = vf_clamp(share, 0, 0.9f);
}

/* Drawn by the lobe. */
static inline vf3 lobe_way(const struct lit *lit, vf a, vf b)
{
    const struct surface *s = lit->surface;
    if (!lit->shading->tracer->phong) return ggx_way(ggx_square(s->shininess), s->normal, lit->view, a, b);
    vf3 mirrored = vf3_sub(vf3_scale(s->normal, 2.0f * vf_dot(s->normal, lit->view)), lit->view);
    vf height = vf_exp2(vf_log2(vf_max(1.0f - a, vf_of(1e-7f))) / (s->shininess + 1.0f));
    return around(mirrored, vf_min(height, vf_of(1)), b);
}

/* Where a path leaves the first surface, and its weight: of matt ones 1, else as the lobe and the cosine weigh the two ways that
 * the direction could have been drawn. */
static inline vf3 first_way(const struct lit *lit, const struct first *f, vf a, vf b, vf3 *weight, vi *mask)
{
    const struct surface *s = lit->surface;
    vf one = vf_of(1), zero = vf_of(0);
    *weight = (vf3){one, one, one};
    if (!f->glossy) return matt_way(s, a, b);
    vi by_lobe = a < f->chance;
    a = vf_select(by_lobe, a, a - f->chance) / vf_max(vf_select(by_lobe, f->chance, 1.0f - f->chance), vf_of(1e-7f));
    a = vf_clamp(a, 0, 0.9999999f);
    vf3 way = vf3_select(by_lobe, lobe_way(lit, a, b), matt_way(s, a, b));
    vf cosine = vf_max(vf_dot(way, s->normal), zero), matt = cosine * (1 / FV_PI);
    struct gloss g = gloss_of(lit, way, cosine);
    vf density = vf_max((1.0f - f->chance) * matt + f->chance * g.density, vf_of(1e-10f));
    vf of_lobe = g.lobe / density, of_matt = matt * (1.0f - g.edge) / density;
    vf3 more = vf3_scale(risen(s, g.edge), of_lobe);
    *weight = (vf3){of_matt + f->lobe.x * (more.x - of_matt), of_matt + f->lobe.y * (more.y - of_matt),
                    of_matt + f->lobe.z * (more.z - of_matt)};
    *mask &= (vf_dot(way, s->geometric) > 0.0f) & (cosine > 0.0f);
    return way;
}

#endif
