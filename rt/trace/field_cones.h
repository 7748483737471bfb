/* field_cones: cones of rays through fields, which stop before any surface. For kernels only. */
#ifndef FV_TRACE_FIELD_CONES_H
#define FV_TRACE_FIELD_CONES_H

#include "rt/trace/field_way.h"

struct field_cones {
    vf clear;   /* the ray parameter up to which nothing is met; infinite where nothing is up to far */
    vi blocked; /* mask: farther on, but before far, all of the cone is inside a solid */
};

/* Cones stop once the distance is less than half their radius more than it: shorter steps would cost more than what
 * they save the rays. Of those that stopped, `deeper` further steps ask whether they are blocked. */
static __attribute__((noinline)) void field_cones(const struct fv_tracer *tracer, const struct field_rays *r,
                                                  const struct field_kept *kept, int deeper, int64_t *rays,
                                                  struct field_cones *out)
{
    const float share = 0.5f;
    const struct fv_fields *f = &tracer->data->fields;
    struct field_way w;
    vf inverse = 1.0f / r->length, narrower = 1.0f / (r->length + r->wide);
    vi stopped = vi_of(0), tries = vi_of(0);
    int64_t steps = 0;
    int left = tracer->march_steps;
    *out = (struct field_cones){vf_of(__builtin_inff()), vi_of(0)};
    field_begin(&w, r, kept);
    for (; field_reach(&w) && left > 0; left--) {
        vi part;
        steps += __builtin_popcount(vi_bits(w.live));
        vf next, d = field_nearest(&w, f, &part, &next), radius = r->base + w.t * r->wide;
        vi stop = w.live & ~stopped & ~(d > radius * (1 + share));
        out->clear = vf_select(stop, w.t, out->clear);
        stopped |= stop;
        vi blocked = w.live & (d < radius * -1.01f) & (w.t < r->far);
        out->blocked |= blocked;
        w.live &= ~(blocked | (stopped & (tries >= deeper)));
        tries -= stopped;
        vf step = vf_select(stopped, (vf_max(d, vf_of(0)) + radius) * inverse, (d - radius) * narrower);
        w.t = w.sure = vf_min(w.t + step, next);
    }
    rays[FV_RAY_MARCH_STEPS] += steps;
    if (left == 0) out->clear = vf_select(w.live & ~stopped, w.t, out->clear);
}

#endif
