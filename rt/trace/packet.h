/* packet: one packet of rays through Embree at this instruction set's width. For kernels only. */
#ifndef FV_TRACE_PACKET_H
#define FV_TRACE_PACKET_H

#include "rt/trace/alpha.h"
#include "rt/trace/simd.h"
#include "rt/trace/tracer.h"

/* What of a scene's features (enum fv_scene_features, whose lower bits are enum fv_material_flags) this
 * compilation of the kernel can show: all of them, but in the variants (variant.h). */
#ifndef FV_FEATURES
#define FV_FEATURES ~0u
#endif

#define FV_PASTE_WIDTH(name, width) name##width
#define FV_EXPAND_WIDTH(name, width) FV_PASTE_WIDTH(name, width)
#define FV_RAY_HIT_N struct FV_EXPAND_WIDTH(RTCRayHit, FV_WIDTH)
#define FV_RAY_N struct FV_EXPAND_WIDTH(RTCRay, FV_WIDTH)

/* A hit, per lane; t and the rest mean nothing where `hit` is 0. */
struct packet_hit {
    vi hit;      /* mask */
    vi triangle; /* record number; 0 in lanes without a hit */
    vf t, u, v;
    vf3 normal; /* Embree's geometric normal, not unit */
};

static inline struct fv_ray_context packet_context(bool coherent, float base, float growth)
{
    struct fv_ray_context c;
    rtcInitIntersectContext(&c.embree);
    c.embree.flags = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    c.base = base;
    c.growth = growth;
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

static inline struct packet_hit packet_intersect(const struct fv_tracer *tracer, struct fv_ray_context *context,
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
    return h;
}

/* Mask of the lanes whose segment origin + [0, far] * direction meets something. */
static inline vi packet_occluded(const struct fv_tracer *tracer, struct fv_ray_context *context, vf3 origin,
                                 vf3 direction, vf far, vi mask)
{
    _Alignas(64) FV_RAY_N r;
    _Alignas(64) int valid[FV_WIDTH];
    packet_fill(&r, origin, direction, far);
    vi_store(valid, mask);
    FV_EXPAND_WIDTH(rtcOccluded, FV_WIDTH)(valid, tracer->scene, &context->embree, &r);
    return mask & (vf_load(r.tfar) < 0.0f);
}

#endif
