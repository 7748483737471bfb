/* packet: one packet of rays through Embree at this instruction set's width. For kernels only. */
#ifndef FV_TRACE_PACKET_H
#define FV_TRACE_PACKET_H

#include "rt/trace/alpha.h"
#include "rt/trace/field_march.h"
#include "rt/trace/instance.h"

/* What of a scene's features (enum fv_scene_features, whose lower bits are enum fv_material_flags) this
 * compilation of the kernel can show: all of them, but in the variants (variant.h). */
#ifndef FV_FEATURES
#define FV_FEATURES ~0u
#endif

/* Kernels of fields ask whether there are triangles too; those of fields alone know that there are none. */
#define FV_FIELDS (FV_FEATURES & FV_SCENE_FIELDS)
#define FV_MESHES (!FV_FIELDS || (FV_FEATURES & FV_SCENE_MIXED))

#define FV_PASTE_WIDTH(name, width) name##width
#define FV_EXPAND_WIDTH(name, width) FV_PASTE_WIDTH(name, width)
#define FV_RAY_HIT_N struct FV_EXPAND_WIDTH(RTCRayHit, FV_WIDTH)
#define FV_RAY_N struct FV_EXPAND_WIDTH(RTCRay, FV_WIDTH)

/* A hit, per lane; t and the rest mean nothing where `hit` is 0. */
struct packet_hit {
    vi hit;      /* mask */
    vi triangle; /* record number; 0 in lanes without a hit */
    vi part;     /* of the fields, -1: a triangle; set where the kernel shows fields */
    vi own;      /* the same, but -1 where rays from it outward may meet the part again */
    vi object;   /* the moving object's number, 0: it stands still; set where the kernel shows moving ones */
    vf t, u, v;
    vf3 normal; /* Embree's geometric normal, in the world, not unit */
};

static inline struct fv_ray_context packet_context(bool coherent, float base, float growth)
{
    struct fv_ray_context c;
    rtcInitIntersectContext(&c.embree);
    c.embree.flags = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    c.base = base;
    c.growth = growth;
    c.start = NULL;
    c.left = __builtin_inff();
    c.few = NULL;
    c.own = NULL;
    c.rays = NULL;
    return c;
}

static inline void packet_fill(FV_RAY_N *ray, vf3 origin, vf3 direction, vf far)
{
    vf_store(ray->org_x, origin.x);
    vf_store(ray->org_y, origin.y);
    vf_store(ray->org_z, origin.z);
    vf_store(ray->dir_x, direction.x);
    vf_store(ray->dir_y, direction.y);
    vf_store(ray->dir_z, direction.z);
    vf_store(ray->tnear, vf_of(0));
    vf_store(ray->tfar, far);
    vf_store(ray->time, vf_of(0));
    vi_store(ray->mask, vi_of(-1));
    vi_store(ray->id, vi_of(0));
    vi_store(ray->flags, vi_of(0));
}

/* The nearest hits of a hit packet, from the moving objects. */
static inline void packet_intersect_moving(const struct fv_tracer *tracer, struct fv_ray_context *context,
                                           vf3 origin, vf3 direction, vi mask, struct packet_hit *h)
{
    _Alignas(64) FV_RAY_HIT_N r;
    _Alignas(64) int valid[FV_WIDTH];
    vf scale = instance_scale(direction);
    h->object = vi_of(0);
    for (int i = 0; i < tracer->instances; i++) {
        const struct fv_instance *o = &tracer->instance[i];
        vi near = instance_near(o, origin, direction, scale, h->t, mask);
        if (o->ball[3] < 0 || !vi_any(near)) continue;
        packet_fill(&r.ray, instance_turn_back(o, vf3_sub(origin, vf3_of(o->at))), instance_turn_back(o, direction),
                    h->t);
        vi_store(r.hit.geomID, vi_of(-1));
        vi_store(r.hit.instID[0], vi_of(-1));
        vi_store(valid, near);
        FV_EXPAND_WIDTH(rtcIntersect, FV_WIDTH)(valid, o->scene, &context->embree, &r);
        vi geometry = vi_load(r.hit.geomID), hit = near & (geometry != -1);
        if (!vi_any(hit)) continue;
        vi triangle = vi_load(r.hit.primID) + o->first + ((geometry == FV_GEOMETRY_MASKED) & o->opaque);
        vf3 normal = {vf_load(r.hit.Ng_x), vf_load(r.hit.Ng_y), vf_load(r.hit.Ng_z)};
        h->hit |= hit;
        h->triangle = vi_select(hit, triangle, h->triangle);
        h->object = vi_select(hit, vi_of(i + 1), h->object);
        h->t = vf_select(hit, vf_load(r.ray.tfar), h->t);
        h->u = vf_select(hit, vf_load(r.hit.u), h->u);
        h->v = vf_select(hit, vf_load(r.hit.v), h->v);
        h->normal = vf3_select(hit, instance_turn(o, normal), h->normal);
    }
}

static inline struct packet_hit packet_intersect_meshes(const struct fv_tracer *tracer, struct fv_ray_context *context,
                                                 vf3 origin, vf3 direction, vi mask)
{
    _Alignas(64) FV_RAY_HIT_N r;
    _Alignas(64) int valid[FV_WIDTH];
    packet_fill(&r.ray, origin, direction, vf_of(__builtin_inff()));
    vi_store(r.hit.geomID, vi_of(-1));
    vi_store(r.hit.instID[0], vi_of(-1));
    vi_store(valid, mask);
    FV_EXPAND_WIDTH(rtcIntersect, FV_WIDTH)(valid, tracer->scene, &context->embree, &r);
    struct packet_hit h;
    vi geometry = vi_load(r.hit.geomID);
    h.hit = mask & (geometry != -1);
    h.triangle = vi_load(r.hit.primID);
    if (FV_FEATURES & FV_SCENE_ALPHA)
        h.triangle += (geometry == FV_GEOMETRY_MASKED) & (int32_t)tracer->data->opaque_triangles;
    h.triangle &= h.hit;
    h.t = vf_load(r.ray.tfar);
    h.u = vf_load(r.hit.u);
    h.v = vf_load(r.hit.v);
    h.normal = (vf3){vf_load(r.hit.Ng_x), vf_load(r.hit.Ng_y), vf_load(r.hit.Ng_z)};
    if (FV_FEATURES & FV_SCENE_MOVING) packet_intersect_moving(tracer, context, origin, direction, mask, &h);
    return h;
}

/* Not inlined: `kept` would take 48 KiB of stack for each level of a chain of mirrors. */
static __attribute__((noinline)) void packet_march(const struct fv_tracer *tracer,
                                                   const struct fv_ray_context *context, const struct field_rays *r,
                                                   struct field_hit *hit)
{
    struct field_kept kept;
    field_find(tracer, r, context->few, &kept);
    field_march(tracer, r, &kept, context->rays, hit);
}

/* Convex parts, which were met from outside. */
static inline vi packet_own(const struct fv_fields *f, const struct field_hit *h)
{
    vi own = vi_of(-1), outside = h->hit & (h->t > 0.0f);
    for (unsigned pending = vi_bits(outside); pending;) {
        int id = h->part[__builtin_ctz(pending)];
        vi lanes = outside & (h->part == id);
        pending &= ~vi_bits(lanes);
        if (f->part[id].convex) own = vi_select(lanes, vi_of(id), own);
    }
    return own;
}

/* Nearer hits, of the fields. */
static inline void packet_intersect_fields(const struct fv_tracer *tracer, const struct fv_ray_context *context,
                                           vf3 origin, vf3 direction, vi mask, struct packet_hit *h)
{
    struct field_hit f;
    struct field_rays r = field_rays_of(origin, direction, mask);
    r.far = vf_min(h->t, tracer->march_far / r.length);
    if (context->start) r.from = vf_load(context->start);
    packet_march(tracer, context, &r, &f);
    h->hit |= f.hit;
    h->part = vi_select(f.hit, f.part, vi_of(-1));
    h->own = packet_own(&tracer->data->fields, &f);
    h->t = vf_select(f.hit, f.t, h->t);
    h->triangle = vi_select(f.hit, vi_of(0), h->triangle);
    h->object = vi_select(f.hit, vi_of(0), h->object);
}

static inline struct packet_hit packet_intersect(const struct fv_tracer *tracer, struct fv_ray_context *context,
                                                 vf3 origin, vf3 direction, vi mask)
{
    if (!FV_FIELDS) return packet_intersect_meshes(tracer, context, origin, direction, mask);
    vi none = vi_of(0);
    vf zero = vf_of(0);
    struct packet_hit h = {none, none, none, none, none, vf_of(__builtin_inff()), zero, zero, {zero, zero, zero}};
    if (FV_MESHES && tracer->data->triangles > 0) {
        h = packet_intersect_meshes(tracer, context, origin, direction, mask);
        if (!(FV_FEATURES & FV_SCENE_MOVING)) h.object = none;
    }
    h.part = h.own = vi_of(-1);
    if (tracer->data->fields.parts > 0) packet_intersect_fields(tracer, context, origin, direction, mask, &h);
    return h;
}

/* Of the lanes of mask, those that meet a moving object. */
static inline vi packet_occluded_moving(const struct fv_tracer *tracer, struct fv_ray_context *context, vf3 origin,
                                        vf3 direction, vf far, vi mask)
{
    _Alignas(64) FV_RAY_N r;
    _Alignas(64) int valid[FV_WIDTH];
    vi occluded = vi_of(0);
    vf scale = instance_scale(direction);
    for (int i = 0; i < tracer->instances; i++) {
        const struct fv_instance *o = &tracer->instance[i];
        vi near = instance_near(o, origin, direction, scale, far, mask & ~occluded);
        if (o->ball[3] < 0 || !vi_any(near)) continue;
        packet_fill(&r, instance_turn_back(o, vf3_sub(origin, vf3_of(o->at))), instance_turn_back(o, direction), far);
        vi_store(valid, near);
        FV_EXPAND_WIDTH(rtcOccluded, FV_WIDTH)(valid, o->scene, &context->embree, &r);
        occluded |= near & (vf_load(r.tfar) < 0.0f);
    }
    return occluded;
}

/* Mask of the lanes whose segment origin + [0, far] * direction meets a triangle. */
static inline vi packet_occluded_meshes(const struct fv_tracer *tracer, struct fv_ray_context *context, vf3 origin,
                                 vf3 direction, vf far, vi mask)
{
    _Alignas(64) FV_RAY_N r;
    _Alignas(64) int valid[FV_WIDTH];
    packet_fill(&r, origin, direction, far);
    vi_store(valid, mask);
    FV_EXPAND_WIDTH(rtcOccluded, FV_WIDTH)(valid, tracer->scene, &context->embree, &r);
    vi occluded = mask & (vf_load(r.tfar) < 0.0f);
    if (FV_FEATURES & FV_SCENE_MOVING)
        occluded |= packet_occluded_moving(tracer, context, origin, direction, far, mask & ~occluded);
    return occluded;
}

/* The same of all that the scene holds. */
static inline vi packet_occluded(const struct fv_tracer *tracer, struct fv_ray_context *context, vf3 origin,
                                 vf3 direction, vf far, vi mask)
{
    if (!FV_FIELDS) return packet_occluded_meshes(tracer, context, origin, direction, far, mask);
    vi occluded = vi_of(0);
    if (FV_MESHES && tracer->data->triangles > 0)
        occluded = packet_occluded_meshes(tracer, context, origin, direction, far, mask);
    if (tracer->data->fields.parts == 0 || context->left < 0 || !vi_any(mask & ~occluded)) return occluded;
    struct field_hit f;
    struct field_rays r = field_rays_of(origin, direction, mask & ~occluded);
    r.far = vf_min(vf_min(far, vf_of(context->left)), tracer->march_far / r.length);
    if (context->own) r.own = vi_load(context->own);
    packet_march(tracer, context, &r, &f);
    return occluded | f.hit;
}

#endif
