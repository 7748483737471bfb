/* visible: what a light reaches, looked up in its map (visibility.h). For kernels only.
 *
 * Of the four nodes around a surface point's place in the map, those are in shadow whose nearest hit is
 * nearer to the light than the point by more than half a texel's width and what the point's plane comes
 * nearer from there to the node; the light reaches the point where the nodes that it reaches weigh half or
 * more, bilinearly. So planes do not shadow themselves (but in grazing light, more than 83 degrees off the
 * normal), edges of shadows are smooth lines, and light leaks behind what is in its way by half a texel, and
 * on slanted surfaces by their slant within one. Of such margins these came nearest to rays
 * (tests/bench/light_maps.c); the nearest node alone is wrong on a tenth more. Where one of the four says that
 * the map is too coarse around it, a ray tells. */
#ifndef FV_TRACE_VISIBLE_H
#define FV_TRACE_VISIBLE_H

#include "rt/trace/lit.h"
#include "rt/trace/visibility.h"

/* Places in a map: in texels from the face's first node, nearness there, and how that grows from texel to
 * texel of the surface's plane, and towards the light by as much as a texel is wide there. */
struct map_place {
    vi face;
    vf x, y, nearness, grows_x, grows_y, texel;
};

static inline struct map_place place_in_cube(const struct fv_light_map *m, vf3 at, vf3 normal)
{
    vf3 d = vf3_sub(at, vf3_of(m->at)), n = normal;
    vf ax = vf_abs(d.x), ay = vf_abs(d.y), az = vf_abs(d.z);
    vi x = ax >= vf_max(ay, az), y = ~x & (ay >= az);
    vf major = vf_select(x, d.x, vf_select(y, d.y, d.z));
    vf across = vf_select(x, d.y, vf_select(y, d.z, d.x)), along = vf_select(x, d.z, vf_select(y, d.x, d.y));
    vf n_across = vf_select(x, n.y, vf_select(y, n.z, n.x)),
       n_along = vf_select(x, n.z, vf_select(y, n.x, n.y));
    struct map_place p;
    p.face = vi_select(x, vi_of(0), vi_select(y, vi_of(2), vi_of(4))) - (major < 0.0f);
    p.nearness = 1.0f / vf_max(vf_abs(major), vf_of(1e-30f));
    float half = 0.5f * (float)m->side;
    p.x = across * p.nearness * half + half;
    p.y = along * p.nearness * half + half;
    vf scale = m->texel[0] / vf_dot(n, d);
    p.grows_x = n_across * scale;
    p.grows_y = n_along * scale;
    p.texel = p.nearness * m->texel[0];
    return p;
}

static inline struct map_place place_in_sun(const struct fv_light_map *m, vf3 at, vf3 normal)
{
    vf3 across = vf3_of(m->across), along = vf3_of(m->along), towards = vf3_of(m->at);
    vf scale = -1.0f / vf_dot(normal, towards);
    struct map_place p;
    p.face = vi_of(0);
    p.x = (vf_dot(at, across) - m->corner[0]) * (1 / m->texel[0]);
    p.y = (vf_dot(at, along) - m->corner[1]) * (1 / m->texel[1]);
    p.nearness = vf_dot(at, towards);
    p.grows_x = vf_dot(normal, across) * scale * m->texel[0];
    p.grows_y = vf_dot(normal, along) * scale * m->texel[1];
    p.texel = vf_of(m->texel[0] > m->texel[1] ? m->texel[0] : m->texel[1]);
    return p;
}

/* A plane's growth counts up to so many texels. */
#define STEEPEST 8.0f

/* Weight of a node that lies so many texels from the place, where the light reaches it. */
static inline vf lit_node(const struct map_place *p, vi held, vf dx, vf dy)
{
    vf plane = vf_min(vf_max(p->grows_x * dx + p->grows_y * dy, vf_of(0)), STEEPEST * p->texel);
    vf weight = (1.0f - vf_abs(dx)) * (1.0f - vf_abs(dy));
    return vf_select((vf)held > p->nearness + plane + 0.5f * p->texel, vf_of(0), weight);
}

/* Lanes that the light reaches by the map; `coarse`: those of which it cannot tell. What lies outside a sun's
 * bounds is lit, and NaN. */
static inline vi map_reaches(const struct fv_light_map *m, const struct map_place *p, vi *coarse)
{
    float side = (float)m->side;
    vi outside = (p->x < 0.0f) | (p->x > side) | (p->y < 0.0f) | (p->y > side);
    vf x = vf_clamp(p->x, 0, side), y = vf_clamp(p->y, 0, side);
    vf x0 = vf_min(vf_floor(x), vf_of(side - 1)), y0 = vf_min(vf_floor(y), vf_of(side - 1));
    vi row = p->face * (m->side + 1) + vi_from(y0), node = row * (m->side + 1) + vi_from(x0), a, b, c, d;
    const uint32_t *nodes = (const uint32_t *)m->nearness;
    vi_gather_pairs(nodes, node, &a, &b);
    vi_gather_pairs(nodes + m->side + 1, node, &c, &d);
    vf dx = x0 - x, dy = y0 - y;
    vf lit = lit_node(p, a, dx, dy) + lit_node(p, b, dx + 1.0f, dy) + lit_node(p, c, dx, dy + 1.0f) +
             lit_node(p, d, dx + 1.0f, dy + 1.0f);
    vi reaches = ~(lit < 0.5f);
    *coarse = ((a | b | c | d) & FV_NODE_COARSE) != 0;
    if (m->faces > 1) return reaches;
    *coarse &= ~outside;
    return reaches | outside;
}

/* As `unshadowed` of the way to a light, by its map; rays tell where it is too coarse, and of what moves. A
 * call: inlined, it takes registers from what never asks. */
static __attribute__((noinline)) vi mapped(const struct lit *lit, const struct fv_light_map *m, vf3 way,
                                           vf far, vi mask)
{
    const struct fv_tracer *tracer = lit->shading->tracer;
    if (!vi_any(mask)) return mask;
    vf3 normal = lit->surface->geometric;
    struct map_place p =
        m->faces == 1 ? place_in_sun(m, lit->start, normal) : place_in_cube(m, lit->start, normal);
    vi coarse, reached = map_reaches(m, &p, &coarse);
    vi by_ray = unshadowed(lit, way, far, NULL, mask & coarse, true);
    mask &= reached & ~coarse;
    unsigned bits = vi_bits(mask);
    if (!(FV_FEATURES & FV_SCENE_MOVING) || tracer->instances == 0 || !bits) return mask | by_ray;
    lit->shading->rays[FV_RAY_SHADOW] += __builtin_popcount(bits);
    struct fv_ray_context context = packet_context(true, lit->surface->footprint[__builtin_ctz(bits)], 0);
    return by_ray | (mask & ~packet_occluded_moving(tracer, &context, lit->start, way, far, mask));
}

#endif
