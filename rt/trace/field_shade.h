/* field_shade: several packets of rays from the eye at once, a packet a lane: which parts of the fields each may meet,
 * by cones around them; and what of the way to each light is clear of fields, by cones from the light around each
 * packet's hits. Shadow rays then only march what is left, near the surface; and none where all of a cone is blocked.
 * For kernels only. */
#ifndef FV_TRACE_FIELD_SHADE_H
#define FV_TRACE_FIELD_SHADE_H

#include "rt/trace/field_cones.h"
#include "rt/trace/packet.h"

enum { FV_SHADE_MET_MAX = 512 };

/* Of up to FV_WIDTH packets. */
struct field_shade {
    _Alignas(64) float left[FV_LIGHTS_MAX][FV_WIDTH]; /* of a light's cone, from the surface on; negative: nothing */
    unsigned blocked[FV_LIGHTS_MAX];                  /* bit: packet */
    /* What the cones may meet, seen from the light; `parts` is -1 where there was no room for it. */
    int first[FV_LIGHTS_MAX], parts[FV_LIGHTS_MAX], met;
    struct field_met at[FV_SHADE_MET_MAX];
};

/* Around each packet's hits and where their shadow rays begin; radius infinite: it has none. */
struct field_balls {
    _Alignas(64) float x[FV_WIDTH], y[FV_WIDTH], z[FV_WIDTH], radius[FV_WIDTH];
    _Alignas(64) int32_t own[FV_WIDTH]; /* of all its hits, -1: they differ */
};

/* The middle of the lanes' range along each axis; and how far from there they lie at most. */
static inline float field_middle(vf3 p, vi mask, float middle[3])
{
    vf inf = vf_of(__builtin_inff());
    const vf *axis[3] = {&p.x, &p.y, &p.z};
    for (int k = 0; k < 3; k++)
        middle[k] = 0.5f * (vf_least(vf_select(mask, *axis[k], inf)) + vf_most(vf_select(mask, *axis[k], -inf)));
    vf3 off = vf3_sub(p, vf3_of(middle));
    return vf_most(vf_select(mask, vf_root(vf_dot(off, off)), vf_of(0)));
}

static inline void field_ball(struct field_balls *b, int packet, const struct packet_hit *h, vf3 origin, vf3 direction)
{
    float middle[3];
    b->radius[packet] = __builtin_inff();
    b->x[packet] = b->y[packet] = b->z[packet] = 0;
    b->own[packet] = -1;
    /* Triangles' shadow rays begin as far off as their records say. */
    if (!vi_any(h->hit) || (FV_MESHES && vi_any(h->hit & (h->part < 0)))) return;
    vf zero = vf_of(0);
    vf3 way = vf3_scale(direction, vf_select(h->hit, h->t, zero));
    vf begin = 4.0f * FV_FIELD_HIT * (1.0f + vf_root(vf_dot(way, way)));
    b->radius[packet] = field_middle(vf3_add(origin, way), h->hit, middle) + vf_most(vf_select(h->hit, begin, zero));
    b->x[packet] = middle[0], b->y[packet] = middle[1], b->z[packet] = middle[2];
    int own = h->own[__builtin_ctz(vi_bits(h->hit))];
    if (!vi_any(h->hit & (h->own != own))) b->own[packet] = own;
}

/* Around each packet's rays, all from one origin. */
struct field_beams {
    _Alignas(64) float x[FV_WIDTH], y[FV_WIDTH], z[FV_WIDTH], wide[FV_WIDTH], from[FV_WIDTH];
};

static inline void field_beam(struct field_beams *b, int packet, vf3 direction, vf from, vi mask)
{
    float middle[3];
    b->wide[packet] = field_middle(direction, mask, middle) * 1.0001f;
    b->x[packet] = middle[0], b->y[packet] = middle[1], b->z[packet] = middle[2];
    b->from[packet] = vf_least(vf_select(mask, from, vf_of(__builtin_inff())));
}

static inline void field_find_beams(const struct fv_tracer *tracer, const struct field_beams *b, int packets, vf3 origin,
                                    struct field_kept *kept)
{
    vf3 direction = {vf_load(b->x), vf_load(b->y), vf_load(b->z)};
    struct field_rays r = field_rays_of(origin, direction, vi_lanes() < packets);
    vf wide = vf_load(b->wide);
    r.far = tracer->march_far / vf_max(r.length - wide, r.length * 0.1f);
    r.from = vf_load(b->from);
    r.wide = wide + (r.length + wide) * FV_FIELD_HIT;
    field_find(tracer, &r, NULL, kept);
}

/* What counts as a hit grows on the way back to the light. */
static inline void field_shade_light(const struct fv_tracer *tracer, int light, vf3 centre, vf radius, vi own,
                                     int64_t *rays, struct field_shade *out)
{
    enum { DEEPER = 6 };
    bool sun = tracer->light[light].kind == FV_LIGHT_SUN;
    vf3 way = vf3_of(tracer->light[light].position), origin = way;
    if (sun) {
        way = vf3_scale(way, vf_of(-tracer->march_far));
        origin = vf3_sub(centre, way);
    } else {
        way = vf3_sub(centre, way);
    }
    struct field_cones cones;
    struct field_kept kept;
    struct field_rays r = field_rays_of(origin, way, radius < 1e30f);
    /* Rays to a light farther off than where they end do not see what is beyond that. */
    if (!sun) r.mask &= (r.length > 4.0f * radius) & (r.length + radius <= tracer->march_far);
    vf hit = (r.length + radius) * FV_FIELD_HIT;
    r.far = vf_of(1);
    r.base = sun ? radius + hit + FV_FIELD_HIT : hit + FV_FIELD_HIT;
    r.wide = sun ? -hit : radius - hit;
    r.own = own;
    r.base += 5e-7f * (r.length + vf_root(vf_dot(origin, origin))); /* rounding of points along it */
    field_find(tracer, &r, NULL, &kept);
    field_cones(tracer, &r, &kept, DEEPER, rays, &cones);
    vf rest = vf_select(cones.clear < 1.0f, (1.0f - cones.clear) * 1.0001f + 1e-5f, vf_of(-1));
    vf_store(out->left[light], vf_select(r.mask, rest, vf_of(__builtin_inff())));
    out->blocked[light] = vi_bits(cones.blocked);
    out->parts[light] = kept.count <= FV_SHADE_MET_MAX - out->met ? kept.count : -1;
    out->first[light] = out->met;
    for (int i = 0; i < out->parts[light]; i++) out->at[out->met++] = kept.at[i];
}

static inline void field_shade_find(const struct fv_tracer *tracer, const struct field_balls *b, int packets,
                                    int64_t *rays, struct field_shade *out)
{
    const struct fv_scene *scene = tracer->data;
    vf3 centre = {vf_load(b->x), vf_load(b->y), vf_load(b->z)};
    vf radius = vf_select(vi_lanes() < packets, vf_load(b->radius), vf_of(__builtin_inff()));
    out->met = 0;
    for (int i = 0; i < scene->lights; i++)
        if (tracer->light[i].kind != FV_LIGHT_AREA) field_shade_light(tracer, i, centre, radius, vi_load(b->own), rays, out);
}

/* What is left to be marched of the way from a packet's surfaces to a light. */
struct field_rest {
    float left;          /* as `far` of shadow rays */
    bool blocked, known; /* known: `few` is all that may be met */
    struct field_few few;
};

static inline void field_rest_of(const struct fv_tracer *tracer, const struct field_shade *shade, int light, int packet,
                                 struct field_rest *rest)
{
    float left = shade->left[light][packet];
    rest->left = tracer->light[light].kind == FV_LIGHT_SUN ? left * tracer->march_far : left;
    rest->blocked = shade->blocked[light] >> packet & 1;
    rest->known = shade->parts[light] >= 0 && left <= 1.1f;
    if (rest->known)
        field_few_of(shade->at + shade->first[light], shade->parts[light], packet, 1 - left, &rest->few);
}

#endif
