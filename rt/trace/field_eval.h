/* field_eval: a part of a scene's fields (rt/scene/field.h) at a vector of points: its codes are looked up once
 * for all lanes, and what each does has no branches but whether any lane needs it. For kernels only. */
#ifndef FV_TRACE_FIELD_EVAL_H
#define FV_TRACE_FIELD_EVAL_H

#include "rt/scene/field.h"
#include "rt/trace/simd.h"

static inline vf3 field_from(vf3 p, const float *centre)
{
    return vf3_sub(p, vf3_of(centre));
}

static inline vf field_length(vf x, vf y)
{
    return vf_root(x * x + y * y);
}

static inline vf field_box(vf3 q, const float *v)
{
    vf zero = vf_of(0);
    vf3 d = {vf_abs(q.x) - v[0], vf_abs(q.y) - v[1], vf_abs(q.z) - v[2]};
    vf3 out = {vf_max(d.x, zero), vf_max(d.y, zero), vf_max(d.z, zero)};
    return vf_root(vf_dot(out, out)) + vf_min(vf_max(d.x, vf_max(d.y, d.z)), zero) - v[3];
}

static inline vf field_cylinder(vf3 q, const float *v)
{
    vf zero = vf_of(0), across = field_length(q.x, q.z) - v[0], along = vf_abs(q.y) - v[1];
    return field_length(vf_max(across, zero), vf_max(along, zero)) + vf_min(vf_max(across, along), zero);
}

static inline vf field_capsule(vf3 q, const float *v)
{
    vf3 way = vf3_of(v);
    vf along = vf_clamp(vf_dot(q, way) * v[3], 0, 1);
    vf3 off = vf3_sub(q, vf3_scale(way, along));
    return vf_root(vf_dot(off, off)) - v[4];
}

/* In the plane through the axis: the nearer of its ends and its slope; inside, both are above and beside. */
static inline vf field_cone(vf3 q, const float *v)
{
    vf zero = vf_of(0), r = field_length(q.x, q.z), y = q.y;
    float below = v[0], above = v[1], half = v[2], slope = above - below;
    vf end = vf_select(y < 0.0f, vf_of(below), vf_of(above));
    vf ax = r - vf_min(r, end), ay = vf_abs(y) - half;
    vf along = vf_clamp(((above - r) * slope + (half - y) * (2 * half)) * v[3], 0, 1);
    vf bx = r - above + slope * along, by = y - half + 2 * half * along;
    vf d = vf_root(vf_min(ax * ax + ay * ay, bx * bx + by * by));
    return vf_select((bx < zero) & (ay < zero), -d, d);
}

static inline vf3 field_rigid(vf3 p, const float *v)
{
    return (vf3){v[0] * p.x + v[1] * p.y + v[2] * p.z + v[3], v[4] * p.x + v[5] * p.y + v[6] * p.z + v[7],
                 v[8] * p.x + v[9] * p.y + v[10] * p.z + v[11]};
}

static inline vf3 field_mirror(vf3 q, const float *v)
{
    int32_t mask[3];
    memcpy(mask, v, sizeof mask);
    return (vf3){(vf)((vi)q.x & mask[0]), (vf)((vi)q.y & mask[1]), (vf)((vi)q.z & mask[2])};
}

/* Along one axis: into the cell's own space. `next`: the distance to the nearest other cell's content, which lies
 * beyond the wall on the point's side where there is a cell, else beyond the other one. */
static inline vf field_cell(vf q, const float *v, float reach, vf *next)
{
    vf cell = vf_floor(q * v[3] + 0.5f);
    cell = vf_min(vf_max(cell, vf_of(v[6])), vf_of(v[9]));
    vf at = q - cell * v[0], side = vf_abs(at);
    vi last = ((at > 0.0f) & (cell >= v[9])) | ((at <= 0.0f) & (cell <= v[6]));
    *next = vf_min(*next, reach + vf_select(last, side, -side));
    return at;
}

static inline vf3 field_repeat(vf3 q, const struct fv_field_code *c, vf *next)
{
    const float *v = c->value + 3, *reach = c[1].value;
    *next = vf_of(__builtin_inff());
    vf3 at = q;
    if (v[0] > 0) at.x = field_cell(q.x, v, reach[0], next);
    if (v[1] > 0) at.y = field_cell(q.y, v + 1, reach[1], next);
    if (v[2] > 0) at.z = field_cell(q.z, v + 2, reach[2], next);
    return at;
}

/* Sine and cosine of any number of turns. */
static inline void field_turns(vf turns, vf *sine, vf *cosine)
{
    vf_turn(turns - vf_floor(turns + 0.5f), sine, cosine);
}

static inline vf3 field_twist(vf3 q, const float *v)
{
    vf sine, cosine;
    field_turns(q.y * v[0], &sine, &cosine);
    return (vf3){cosine * q.x - sine * q.z, q.y, sine * q.x + cosine * q.z};
}

/* The longest way along an axis to a box of half edges v: no more than the distance. */
static inline vf field_outside(vf3 q, const float *v)
{
    return vf_max(vf_max(vf_abs(q.x) - v[0], vf_abs(q.y) - v[1]), vf_abs(q.z) - v[2]);
}

/* Divided by the greatest stretch between the point and what is twisted. */
static inline vf field_untwist(vf d, vf3 p, const float *v)
{
    vf shear = vf_max(field_length(p.x - v[6], p.z - v[7]), vf_of(v[9])) * v[8];
    vf stretch = 0.5f * (shear + vf_root(shear * shear + 4.0f));
    return vf_max(d / stretch, field_outside(field_from(p, v), v + 3));
}

static inline vf field_smooth(vf a, vf b, const float *v)
{
    vf mix = vf_max(v[0] - vf_abs(a - b), vf_of(0)) * v[1];
    return vf_min(a, b) - mix * mix * (v[0] * 0.25f);
}

static inline vf field_displace(vf d, vf3 p, const float *v)
{
    vf far = d - v[5];
    if (!vi_any(d < v[7])) return far;
    vf3 q = vf3_scale(field_from(p, v), vf_of(v[3]));
    vf x, y, z, cosine;
    field_turns(q.x, &x, &cosine);
    field_turns(q.y, &y, &cosine);
    field_turns(q.z, &z, &cosine);
    return vf_max(far, (d + x * y * z * v[4]) * v[6]);
}

/* In [-1, 1], of a lattice point whose hash along each axis is given. */
static inline vf field_lattice(vu x, vu y, vu z)
{
    vu h = x ^ y ^ z;
    h ^= h >> 15;
    h *= 0x2c1b3c6du;
    h ^= h >> 12;
    return vf_from((vi)h >> 7) * 0x1p-24f;
}

static inline vf field_mix(vf a, vf b, vf t)
{
    return a + (b - a) * t;
}

/* Value noise: random values at whole coordinates, between them smooth steps. */
static inline vf field_noise_at(vf3 q)
{
    const float most = 1e9f;
    q = (vf3){vf_clamp(q.x, -most, most), vf_clamp(q.y, -most, most), vf_clamp(q.z, -most, most)};
    vf3 low = {vf_floor(q.x), vf_floor(q.y), vf_floor(q.z)}, f = vf3_sub(q, low);
    vu x0 = (vu)vi_from(low.x) * 0x8da6b343u, y0 = (vu)vi_from(low.y) * 0xd8163841u, z0 = (vu)vi_from(low.z) * 0xcb1b78b1u;
    vu x1 = x0 + 0x8da6b343u, y1 = y0 + 0xd8163841u, z1 = z0 + 0xcb1b78b1u;
    vf3 s = {f.x * f.x * (3.0f - 2.0f * f.x), f.y * f.y * (3.0f - 2.0f * f.y), f.z * f.z * (3.0f - 2.0f * f.z)};
    vf near = field_mix(field_mix(field_lattice(x0, y0, z0), field_lattice(x1, y0, z0), s.x),
                        field_mix(field_lattice(x0, y1, z0), field_lattice(x1, y1, z0), s.x), s.y);
    vf far = field_mix(field_mix(field_lattice(x0, y0, z1), field_lattice(x1, y0, z1), s.x),
                       field_mix(field_lattice(x0, y1, z1), field_lattice(x1, y1, z1), s.x), s.y);
    return field_mix(near, far, s.z);
}

static inline vf field_noise(vf d, vf3 p, const float *v)
{
    vf far = d - v[5], sum = vf_of(0);
    if (!vi_any(d < v[7])) return far;
    vf3 q = vf3_scale(field_from(p, v), vf_of(v[3]));
    float amplitude = v[4];
    for (int i = 0; i < (int)v[9]; i++, amplitude *= v[8]) {
        sum += amplitude * field_noise_at(q);
        /* Another corner of the lattice for each octave, lest all have a point in common. */
        q = (vf3){q.x * 2.0f + 17.3f, q.y * 2.0f + 31.7f, q.z * 2.0f + 7.1f};
    }
    return vf_max(far, (d + sum) * v[6]);
}

/* The part's field at p, see rt/scene/field.h. Finite where p is. */
static __attribute__((noinline)) vf field_part(const struct fv_field_code *c, int count, vf3 at)
{
    vf3 point[FV_FIELD_REGISTERS];
    vf distance[FV_FIELD_REGISTERS];
    point[0] = at;
    for (const struct fv_field_code *end = c + count; c < end; c++) {
        const float *v = c->value;
        vf3 p = point[c->point];
        vf *d = &distance[c->to], *other = &distance[c->from];
        switch ((enum fv_field_op)c->op) {
        case FV_FIELD_SPHERE: {
            vf3 q = field_from(p, v);
            *d = vf_root(vf_dot(q, q)) - v[3];
            break;
        }
        case FV_FIELD_BOX: *d = field_box(field_from(p, v), v + 3); break;
        case FV_FIELD_CYLINDER: *d = field_cylinder(field_from(p, v), v + 3); break;
        case FV_FIELD_TORUS: {
            vf3 q = field_from(p, v);
            *d = field_length(field_length(q.x, q.z) - v[3], q.y) - v[4];
            break;
        }
        case FV_FIELD_PLANE: *d = vf_dot(p, vf3_of(v)) - v[3]; break;
        case FV_FIELD_CAPSULE: *d = field_capsule(field_from(p, v), v + 3); break;
        case FV_FIELD_CONE: *d = field_cone(field_from(p, v), v + 3); break;
        case FV_FIELD_RIGID: point[c->to] = field_rigid(p, v); break;
        case FV_FIELD_MIRROR: point[c->to] = field_mirror(field_from(p, v), v + 3); break;
        case FV_FIELD_REPEAT: point[c->to] = field_repeat(field_from(p, v), c, &distance[c->from]); break;
        case FV_FIELD_DATA: break;
        case FV_FIELD_TWIST: point[c->to] = field_twist(field_from(p, v), v + 3); break;
        case FV_FIELD_UNION: *d = vf_min(*d, *other); break;
        case FV_FIELD_INTERSECT: *d = vf_max(*d, *other); break;
        case FV_FIELD_SUBTRACT: *d = vf_max(*d, -*other); break;
        case FV_FIELD_SMOOTH: *d = field_smooth(*d, *other, v); break;
        case FV_FIELD_NEXT_CELL: *d = vf_max(vf_min(*d, *other), field_outside(field_from(p, v), v + 3)); break;
        case FV_FIELD_UNTWIST: *d = field_untwist(*d, p, v); break;
        case FV_FIELD_DISPLACE: *d = field_displace(*d, p, v); break;
        case FV_FIELD_NOISE: *d = field_noise(*d, p, v); break;
        case FV_FIELD_OPS: __builtin_unreachable();
        }
    }
    return distance[0];
}

#endif
