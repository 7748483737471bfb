/* atrous_light: light in 32 bits (rt/pass/atrous.h) by the vector, for kernels. */
#ifndef FV_PASS_ATROUS_LIGHT_H
#define FV_PASS_ATROUS_LIGHT_H

#include "rt/pass/atrous.h"
#include "rt/trace/simd.h"

/* As fv_light_pack, to the bit, of channels in [0, FV_LIGHT_MAX (1 + 2^-10)]. */
static inline vi light_pack_sound(vf3 c)
{
    vf most = vf_max(vf_max(c.x, c.y), vf_max(c.z, vf_of(0x1p-16f)));
    vi field = ((vi)most + 0x4000) & 0x7f800000;
    vf scale = (vf)(vi)((vu)vi_of(0) + (262u << 23) - (vu)field);
    vi r = vi_from(c.x * scale + 0.5f), g = vi_from(c.y * scale + 0.5f), b = vi_from(c.z * scale + 0.5f);
    return r | (g << 9) | (b << 18) | (vi)((vu)(field - (111 << 23)) << 4);
}

/* Of any. */
static inline vi light_pack(vf3 c)
{
    return light_pack_sound((vf3){vf_clamp(c.x, 0, FV_LIGHT_MAX), vf_clamp(c.y, 0, FV_LIGHT_MAX), vf_clamp(c.z, 0, FV_LIGHT_MAX)});
}

static inline vi light_is_none(vi light)
{
    return light == -1;
}

/* None gives 0. */
static inline vf3 light_unpack(vi light)
{
    vi bits = ((light >> 4) & (31 << 23)) + (103 << 23);
    vf scale = (vf)(bits & ~light_is_none(light));
    return (vf3){vf_from(light & 511) * scale, vf_from((light >> 9) & 511) * scale, vf_from((light >> 18) & 511) * scale};
}

#endif
