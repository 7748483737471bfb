/* instance: what moves, as rays meet it: each object has an acceleration structure of its own, in its own
 * space, and packets are turned into that. Nothing is built or refitted in a frame. For kernels only.
 *
 * Embree's instances would do that too, but their top level is committed anew in each frame, which takes 30
 * heap calls, and what stands still costs 11 % more behind one (16-wide primary rays, Sponza). A test of each
 * object's ball costs less than 1 % an object. */
#ifndef FV_TRACE_INSTANCE_H
#define FV_TRACE_INSTANCE_H

#include "rt/trace/simd.h"
#include "rt/trace/tracer.h"

/* From an object's space to the world's axes. */
static inline vf3 instance_turn(const struct fv_instance *o, vf3 v)
{
    const float(*m)[3] = o->turn;
    return (vf3){m[0][0] * v.x + m[0][1] * v.y + m[0][2] * v.z, m[1][0] * v.x + m[1][1] * v.y + m[1][2] * v.z,
                 m[2][0] * v.x + m[2][1] * v.y + m[2][2] * v.z};
}

/* And back. */
static inline vf3 instance_turn_back(const struct fv_instance *o, vf3 v)
{
    const float(*m)[3] = o->turn;
    return (vf3){m[0][0] * v.x + m[1][0] * v.y + m[2][0] * v.z, m[0][1] * v.x + m[1][1] * v.y + m[2][1] * v.z,
                 m[0][2] * v.x + m[1][2] * v.y + m[2][2] * v.z};
}

/* What instance_near takes of the direction: its inverse squared length. */
static inline vf instance_scale(vf3 direction)
{
    return 1.0f / vf_max(vf_dot(direction, direction), vf_of(1e-30f));
}

/* Lanes of mask whose segment origin + [0, far] * direction may come into the object's ball. What cannot be told
 * (numbers that overflow) may. */
static inline vi instance_near(const struct fv_instance *o, vf3 origin, vf3 direction, vf scale, vf far, vi mask)
{
    vf3 way = vf3_sub(vf3_of(o->ball), origin);
    vf t = vf_dot(way, direction) * scale;
    vf3 off = vf3_sub(way, vf3_scale(direction, vf_min(vf_max(t, vf_of(0)), far)));
    /* Rounding puts `off` at most 1e-5 of the way wrong: (r + 1e-5 w)^2 <= 1.01 r^2 + 1.01e-8 w^2. */
    vf reach = o->ball[3] * o->ball[3] * 1.01f + vf_dot(way, way) * 1.01e-8f;
    return mask & ~(vf_dot(off, off) > reach);
}

/* Turns into the world's axes what records hold in objects' own. */
static inline void instance_turn_lanes(const struct fv_tracer *tracer, vi object, vf3 *normal, vf3 *tangent)
{
    for (unsigned pending = vi_bits(object > 0); pending;) {
        int id = object[__builtin_ctz(pending)];
        vi lanes = object == id;
        const struct fv_instance *o = &tracer->instance[id - 1];
        pending &= ~vi_bits(lanes);
        *normal = vf3_select(lanes, instance_turn(o, *normal), *normal);
        *tangent = vf3_select(lanes, instance_turn(o, *tangent), *tangent);
    }
}

#endif
