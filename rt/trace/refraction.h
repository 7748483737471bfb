/* refraction: what a smooth surface between two media reflects and where the rest goes on. For kernels only.
 *
 * Snell's law and Fresnel's equations in forms in which nothing cancels: at grazing incidence, as the index
 * goes to 1, and up to the critical angle. Checked against long double in tests/numeric/optics.c. */
#ifndef FV_TRACE_REFRACTION_H
#define FV_TRACE_REFRACTION_H

#include "rt/trace/simd.h"

struct refraction {
    vf reflectance; /* of unpolarised light, [0, 1]; 1 where all is reflected */
    vi through;     /* mask: something goes through; never where d is no number */
    vf3 beyond;     /* unit: where that goes */
};

/* `d`, `normal`: unit, the normal on the side that d comes from (a cosine below 1e-7 counts as 1e-7).
 * `ior`: index of the medium inside over that outside, [1, FV_IOR_MAX]; `outside`: mask of the lanes where
 * d comes from outside.
 *
 * With n1, n2 the indices here and beyond, c1, c2 the cosines, q = n1 c1 and b = n2 c2:
 * b^2 = n2^2 - n1^2 + q^2 and rs = (q - b) / (q + b) = (n1^2 - n2^2) / (q + b)^2;
 * rp = rs cos(t1 + t2) / cos(t1 - t2) = rs (c1 b - n1 s1^2) / (c1 b + n1 s1^2). */
static inline struct refraction refract(vf3 d, vf3 normal, vf ior, vi outside)
{
    struct refraction r;
    vf one = vf_of(1), here = vf_select(outside, one, ior);
    vf step = (ior - 1.0f) * (ior + 1.0f);
    step = vf_select(outside, step, -step); /* n2^2 - n1^2 */
    vf down = -vf_dot(d, normal), c = vf_clamp(down, 1e-7f, 1), q = here * c, squared = step + q * q;
    vf b = vf_sqrt(vf_max(squared, vf_of(0))), sum = q + b;
    vf along = c * b, across = here * ((1.0f - c) * (1.0f + c));
    vf rs = step / (sum * sum), turn = (along - across) / (along + across);
    r.through = (squared > 0.0f) & (down == down);
    r.reflectance = vf_select(r.through, vf_min(0.5f * rs * rs * (1.0f + turn * turn), one), one);
    vf3 beyond = vf3_sub(vf3_scale(d, here), vf3_scale(normal, step / sum));
    r.beyond = vf3_normalise(beyond, d);
    return r;
}

#endif
