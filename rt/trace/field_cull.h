/* field_cull: which parts of the fields a packet of rays can meet, and between where: balls against a cone around
 * the packet, FV_WIDTH parts at a time, then boxes against each ray. What is left out is farther from every ray
 * than what counts as a hit. For kernels only. */
#ifndef FV_TRACE_FIELD_CULL_H
#define FV_TRACE_FIELD_CULL_H

#include "rt/trace/simd.h"
#include "rt/trace/tracer.h"

/* Rays origin + t * direction, t from `from` to `far`, in lanes of `mask`. What lies within `base` + t * `wide` (m) of
 * them is met: of rays what counts as a hit, of cones their radius with it. Never negative up to far. `own`: a part that the lane
 * does not meet, -1: none. */
struct field_rays {
    vf3 origin, direction;
    vf from, far, base, wide, length; /* length: of the direction, not 0 */
    vi mask, own;
};

/* A part that a packet may meet: t in [near, far] of each ray (near is infinite where it does not), [enter, exit] of
 * any. */
struct field_met {
    vf near, far;
    int part;
    float enter, exit;
};

/* Those of a packet, by where it first meets them. */
struct field_kept {
    int count;
    struct field_met at[FV_FIELD_PARTS_MAX];
};

/* Parts that are all that a packet may meet. */
struct field_few {
    int count;
    int16_t part[FV_FIELD_PARTS_MAX];
};

/* Of those that cones meet, one lane's, where they are not behind `from`. */
static inline void field_few_of(const struct field_met *met, int count, int lane, float from, struct field_few *few)
{
    few->count = 0;
    for (int i = 0; i < count; i++) {
        float near = met[i].near[lane], far = met[i].far[lane];
        if (near <= far && far >= from) few->part[few->count++] = (int16_t)met[i].part;
    }
}

/* A cone around the packet: of rays within `base` + `growth` * s of the axis at the length s along it. */
struct field_cone {
    float apex[3], axis[3], base, growth, reach;
    bool any; /* false: the rays go anywhere */
};

static inline struct field_cone field_cone_of(const struct field_rays *r)
{
    struct field_cone c;
    int first = __builtin_ctz(vi_bits(r->mask));
    float inverse = 1 / r->length[first];
    const vf3 *o = &r->origin, *d = &r->direction;
    float apex[3] = {o->x[first], o->y[first], o->z[first]};
    float axis[3] = {d->x[first] * inverse, d->y[first] * inverse, d->z[first] * inverse};
    vf zero = vf_of(0), along = vf_dot(*d, vf3_of(axis));
    vf3 aside = vf3_sub(*d, vf3_scale(vf3_of(axis), along)), off = vf3_sub(*o, vf3_of(apex));
    vf ahead = along - r->wide;
    c.any = !vi_any(r->mask & ~(ahead > 0.2f * r->length));
    if (!c.any) return c;
    vf growth = (vf_root(vf_dot(aside, aside)) * 1.00001f + r->wide) / ahead;
    c.growth = vf_most(vf_select(r->mask, vf_max(growth, zero), zero));
    c.base = vf_most(vf_select(r->mask, vf_root(vf_dot(off, off)) + r->base, zero));
    c.base *= 1 + c.growth; /* those that begin behind the apex */
    c.reach = vf_most(vf_select(r->mask, r->far * r->length, zero));
    memcpy(c.apex, apex, sizeof apex);
    memcpy(c.axis, axis, sizeof axis);
    return c;
}

/* Bits of the parts first, first + 1, ... whose balls the cone meets. */
static inline unsigned field_meets(const struct fv_fields *f, int first, const struct field_cone *c)
{
    vf radius = vf_load(f->radius + first);
    vf3 way = {vf_load(f->x + first) - c->apex[0], vf_load(f->y + first) - c->apex[1], vf_load(f->z + first) - c->apex[2]};
    vf d2 = vf_dot(way, way), distance = vf_root(d2), along = vf_dot(way, vf3_of(c->axis));
    vf aside = vf_root(vf_max(d2 - along * along, vf_of(0)));
    /* Rounding of `aside` is within 2e-3 of the way where that is near the axis: of it all, 1e-6 in the square. */
    radius *= 1.0002f;
    vf widest = c->base + c->growth * vf_max(along + radius, vf_of(0)) + distance * 1e-3f;
    vi meets = (aside <= radius + widest) & (along >= -radius - c->base) & (distance - radius - widest <= c->reach);
    return vi_bits(meets | (vf_load(f->radius + first) > 1e30f));
}

/* A ray's way through a part's box, whose faces move outward with t as fast as rays widen. */
struct field_slabs {
    vf3 low_start, high_start;     /* face - start over rate is where the ray passes it */
    vf3 low_rate, high_rate;       /* inverse */
};

static inline vf field_rate(vf rate)
{
    vf least = vf_of(1e-20f);
    return 1.0f / vf_select(vf_abs(rate) > least, rate, least);
}

static inline struct field_slabs field_slabs_of(const struct field_rays *r)
{
    vf hit = 1.01f * r->base, grow = vf_max(1.01f * r->wide, r->wide);
    const vf3 *o = &r->origin, *d = &r->direction;
    return (struct field_slabs){
        .low_start = {o->x + hit, o->y + hit, o->z + hit}, .high_start = {o->x - hit, o->y - hit, o->z - hit},
        .low_rate = {field_rate(d->x + grow), field_rate(d->y + grow), field_rate(d->z + grow)},
        .high_rate = {field_rate(d->x - grow), field_rate(d->y - grow), field_rate(d->z - grow)}};
}

/* Narrows [near, far] to where the ray is above the lower face and below the upper one. */
static inline void field_slab(vf low, vf high, vf low_rate, vf high_rate, vf *near, vf *far)
{
    vf in = low * low_rate, out = high * high_rate, inf = vf_of(__builtin_inff());
    *near = vf_max(vf_select(low_rate > 0.0f, in, *near), *near);
    *far = vf_min(vf_select(low_rate > 0.0f, *far, in), *far);
    *near = vf_max(vf_select(high_rate > 0.0f, -inf, out), *near);
    *far = vf_min(vf_select(high_rate > 0.0f, out, inf), *far);
}

static inline void field_keep(const struct field_rays *r, const struct field_slabs *s, const struct fv_field_part *p,
                              int part, struct field_kept *kept)
{
    vf near = r->from, far = r->far, inf = vf_of(__builtin_inff());
    field_slab(p->low[0] - s->low_start.x, p->high[0] - s->high_start.x, s->low_rate.x, s->high_rate.x, &near, &far);
    field_slab(p->low[1] - s->low_start.y, p->high[1] - s->high_start.y, s->low_rate.y, s->high_rate.y, &near, &far);
    field_slab(p->low[2] - s->low_start.z, p->high[2] - s->high_start.z, s->low_rate.z, s->high_rate.z, &near, &far);
    near *= 1.0f - 1e-5f;
    far *= 1.0f + 1e-5f;
    vi meets = r->mask & (near <= far) & (r->own != part);
    if (!vi_any(meets)) return;
    near = vf_select(meets, near, inf);
    far = vf_select(meets, far, -inf);
    struct field_met met = {near, far, part, vf_least(near), vf_most(far)};
    int i = kept->count++;
    for (; i > 0 && kept->at[i - 1].enter > met.enter; i--) kept->at[i] = kept->at[i - 1];
    kept->at[i] = met;
}

static inline void field_cull(const struct fv_fields *f, const struct field_rays *r, const struct field_slabs *slabs,
                              struct field_kept *kept)
{
    struct field_cone cone = field_cone_of(r);
    for (int first = 0; first < f->parts; first += FV_WIDTH) {
        unsigned all = f->parts - first < FV_WIDTH ? (1u << (f->parts - first)) - 1 : ~0u >> (32 - FV_WIDTH);
        unsigned bits = cone.any ? field_meets(f, first, &cone) & all : all;
        for (; bits; bits &= bits - 1) {
            int part = first + __builtin_ctz(bits);
            field_keep(r, slabs, &f->part[part], part, kept);
        }
    }
}

/* With method.culling off: all parts, everywhere. */
static inline void field_keep_all(const struct fv_fields *f, const struct field_rays *r, struct field_kept *kept)
{
    float inf = __builtin_inff();
    kept->count = f->parts;
    for (int i = 0; i < kept->count; i++) {
        vf near = vf_select(r->own == i, vf_of(inf), vf_of(-inf));
        kept->at[i] = (struct field_met){near, -near, i, -inf, inf};
    }
}

/* What the rays may meet. `few`: all of it that is in question; NULL: any part. */
static inline void field_find(const struct fv_tracer *tracer, const struct field_rays *r, const struct field_few *few,
                              struct field_kept *kept)
{
    const struct fv_fields *f = &tracer->data->fields;
    kept->count = 0;
    if (!tracer->culling) field_keep_all(f, r, kept);
    else if (vi_any(r->mask)) {
        struct field_slabs slabs = field_slabs_of(r);
        if (!few) field_cull(f, r, &slabs, kept);
        else
            for (int i = 0; i < few->count; i++) field_keep(r, &slabs, &f->part[few->part[i]], few->part[i], kept);
    }
}

#endif
