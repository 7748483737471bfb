/* field_shade: what of the way to each light is clear for several packets of hits at once, as far as fields go: by cones
 * from the light around each packet's hits, a packet a lane. Shadow rays then only march what is left, near the
 * surface; and none where all of a cone is blocked. For kernels only. */
#ifndef FV_TRACE_FIELD_SHADE_H
#define FV_TRACE_FIELD_SHADE_H

#include "rt/trace/field_cones.h"
#include "rt/trace/packet.h"

/* Of up to FV_WIDTH packets. */
struct field_shade {
    _Alignas(64) float left[FV_LIGHTS_MAX][FV_WIDTH]; /* of the way from the surface; as `far` of shadow rays */
    unsigned blocked[FV_LIGHTS_MAX];                  /* bit: packet */
};

/* A ball around a packet's hits and where their shadow rays begin; radius infinite: it has none. */
struct field_ball {
    float centre[3], radius;
};

static inline struct field_ball field_ball_of(const struct packet_hit *h, vf3 origin, vf3 direction)
{
    struct field_ball ball = {.radius = __builtin_inff()};
    if (!vi_any(h->hit)) return ball;
    vf inf = vf_of(__builtin_inff()), zero = vf_of(0);
    vf3 way = vf3_scale(direction, vf_select(h->hit, h->t, zero)), p = vf3_add(origin, way);
    const vf *axis[3] = {&p.x, &p.y, &p.z};
    for (int k = 0; k < 3; k++)
        ball.centre[k] = 0.5f * (vf_least(vf_select(h->hit, *axis[k], inf)) + vf_most(vf_select(h->hit, *axis[k], -inf)));
    vf3 off = vf3_sub(p, vf3_of(ball.centre));
    vf begin = 4.0f * FV_FIELD_HIT * (1.0f + vf_root(vf_dot(way, way)));
    ball.radius = vf_most(vf_select(h->hit, vf_root(vf_dot(off, off)) + begin, zero));
    return ball;
}

/* What counts as a hit grows on the way back to the light. */
static inline void field_shade_light(const struct fv_tracer *tracer, const struct fv_light *light, vf3 centre, vf radius,
                                     int64_t *rays, float left[FV_WIDTH], unsigned *blocked)
{
    enum { DEEPER = 6 };
    bool sun = light->kind == FV_LIGHT_SUN;
    vf3 way = vf3_of(light->position), origin = way;
    if (sun) {
        way = vf3_scale(way, vf_of(-tracer->march_far));
        origin = vf3_sub(centre, way);
    } else {
        way = vf3_sub(centre, way);
    }
    struct field_cones cones;
    struct field_rays r = field_rays_of(origin, way, radius < 1e30f);
    if (!sun) r.mask &= r.length > 4.0f * radius;
    vf hit = r.length * FV_FIELD_HIT, zero = vf_of(0);
    r.far = vf_of(1);
    r.base = FV_FIELD_HIT + hit + vf_select(sun ? vi_of(-1) : vi_of(0), radius, zero);
    r.wide = vf_select(sun ? vi_of(-1) : vi_of(0), zero, radius) - hit;
    field_cones(tracer, &r, DEEPER, rays, &cones);
    vf rest = vf_select(cones.clear < 1.0f, (1.0f - cones.clear) * 1.0001f + 1e-5f, vf_of(-1));
    vf_store(left, vf_select(r.mask, sun ? rest * tracer->march_far : rest, vf_of(__builtin_inff())));
    *blocked = vi_bits(cones.blocked);
}

static inline void field_shade_find(const struct fv_tracer *tracer, const struct field_ball *ball, int packets, int64_t *rays,
                             struct field_shade *out)
{
    const struct fv_scene *scene = tracer->data;
    _Alignas(64) float at[4][FV_WIDTH];
    for (int i = 0; i < FV_WIDTH; i++) {
        const struct field_ball *b = &ball[i < packets ? i : 0];
        for (int k = 0; k < 3; k++) at[k][i] = b->centre[k];
        at[3][i] = i < packets ? b->radius : __builtin_inff();
    }
    vf3 centre = {vf_load(at[0]), vf_load(at[1]), vf_load(at[2])};
    vf radius = vf_load(at[3]);
    for (int i = 0; i < scene->lights; i++)
        if (tracer->light[i].kind != FV_LIGHT_AREA)
            field_shade_light(tracer, &tracer->light[i], centre, radius, rays, out->left[i], &out->blocked[i]);
}

#endif
