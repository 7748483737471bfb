/* field_march: rays through the scene's fields: sphere tracing (Hart 1996), plain, over-relaxed (Keinert et al.
 * 2014, "Enhanced Sphere Tracing", section 3.1) or by the planes that two distances tell of (Balint and Valasek
 * 2018, "Accelerating Sphere Tracing"). For kernels only. */
#ifndef FV_TRACE_FIELD_MARCH_H
#define FV_TRACE_FIELD_MARCH_H

#include "rt/trace/field_way.h"

static const float field_relaxation = 1.2f, field_planar = 0.9f;

struct field_hit {
    vi hit;  /* mask */
    vi part; /* where hit */
    vf t;
};

/* What over-relaxed stepping remembers of the step before, in metres. */
struct field_steps {
    vf radius, step, relaxation;
};

/* Length of the next step (m): longer than the radius where the balls of two steps are still one, but not near what
 * counts as a hit (`met`), which a grazing ray would step over. Where they turned out apart, back to the last ball's
 * border. `back`: mask of those lanes, which must not hit here. */
static inline vf field_step(struct field_steps *s, vf radius, vf met, enum fv_stepping stepping, vi *back)
{
    *back = (s->step > s->radius) & (s->radius + radius < s->step);
    vf plain = radius, longer;
    if (stepping == FV_STEPPING_RELAXED) {
        longer = plain * s->relaxation;
        s->relaxation = vf_select(*back, vf_of(1), s->relaxation);
    } else {
        vf slope = (s->step - s->radius + radius) / vf_max(s->step + s->radius - radius, vf_of(1e-20f));
        longer = plain + plain * vf_clamp(slope * field_planar, 0, 4);
        longer = vf_select(s->step > 0.0f, longer, plain);
    }
    longer = vf_select(radius > 4.0f * met, longer, plain);
    return vf_select(*back, s->radius - s->step, longer);
}

/* The first surface of each ray: where the field is less than base + t * wide. `one`: of a single part, which no more
 * than that need be asked of. A ray that begins inside hits at once; one that takes method.march_steps steps meets nothing. */
static inline void field_march_in(const struct fv_tracer *tracer, const struct field_rays *r,
                                  const struct field_kept *kept, bool one, int64_t *rays, struct field_hit *out)
{
    const struct fv_fields *f = &tracer->data->fields;
    const struct fv_field_part *only = &f->part[kept->at[0].part];
    struct field_way w;
    struct field_steps s = {vf_of(0), vf_of(0), vf_of(field_relaxation)};
    vf inverse = 1.0f / r->length, far = one ? vf_min(r->far, kept->at[0].far) : r->far;
    int64_t steps = 0;
    int left = tracer->march_steps;
    field_begin(&w, r, kept);
    if (one) w.t = w.sure = vf_max(w.t, kept->at[0].near);
    for (; (one ? field_within(&w, far) : field_reach(&w)) && left > 0; left--) {
        vi part = vi_of(kept->at[0].part), back = vi_of(0);
        steps += __builtin_popcount(vi_bits(w.live));
        vf next = vf_of(__builtin_inff()), d;
        if (one) d = field_part(f->code + only->first, only->count, vf3_add(r->origin, vf3_scale(r->direction, w.t)));
        else d = field_nearest(&w, f, &part, &next);
        vf step = vf_max(d, vf_of(0)), met = r->base + w.t * r->wide;
        if (tracer->stepping != FV_STEPPING_PLAIN) step = field_step(&s, step, met, tracer->stepping, &back);
        vi hit = w.live & ~back & (w.t <= far) & (d < met);
        out->hit |= hit;
        out->part = vi_select(hit, part, out->part);
        out->t = vf_select(hit, w.t, out->t);
        w.live &= ~hit;
        vf t = vf_min(w.t + step * inverse, next);
        s.radius = vf_select(back, s.radius, vf_max(d, vf_of(0)));
        s.step = vf_select(back, vf_of(0), (t - w.t) * r->length);
        w.t = w.sure = t;
        if (tracer->stepping != FV_STEPPING_PLAIN) w.sure -= vf_max(s.step - s.radius, vf_of(0)) * inverse;
    }
    rays[FV_RAY_MARCH_STEPS] += steps;
    if (left == 0) rays[FV_RAY_MARCH_LIMITED] += __builtin_popcount(vi_bits(w.live));
}

static __attribute__((noinline)) void field_march(const struct fv_tracer *tracer, const struct field_rays *r,
                                                  const struct field_kept *kept, int64_t *rays, struct field_hit *out)
{
    *out = (struct field_hit){.hit = vi_of(0), .part = vi_of(0), .t = r->far};
    if (kept->count == 1) field_march_in(tracer, r, kept, true, rays, out);
    else if (kept->count > 1) field_march_in(tracer, r, kept, false, rays, out);
}

#endif
