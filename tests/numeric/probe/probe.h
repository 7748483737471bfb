/* probe: the tracer's formulas by themselves, at each instruction set: what kernels only have inline, fed
 * with rows of inputs. For tests only. */
#ifndef FV_TESTS_PROBE_H
#define FV_TESTS_PROBE_H

#include "platform/cpu.h"
#include "rt/scene/scene.h"

/* Rows `in` of n floats, n a multiple of 16, to rows `out`. The shading normal is +y throughout.
 * `texture` is for PLACE only. */
typedef void fv_probe_function(const struct fv_texture *texture, const float *const *in, float *const *out,
                               int n);

enum fv_probe {
    PROBE_LOG2,      /* a -> log2 a */
    PROBE_EXP2,      /* a -> 2^a */
    PROBE_NORMALISE, /* x y z -> x y z; too short or long: 0 1 0 */
    PROBE_REFRACT, /* x y z of the direction, ior, outside (0 or 1) -> reflectance, through (0 or 1), x y z */
    PROBE_PHONG,   /* x y z to the viewer, x y z to the light, exponent -> radiance of a specular albedo 1 */
    PROBE_PLACE,   /* u v footprint -> mean of the four texels (red), the places of the two rows */
    PROBE_BEND,    /* texel's x y z (0..1023), scale, tangent x y z, bitangent's sign -> normal x y z */
    PROBE_SAMPLE,  /* two random numbers, number and count (the same 16 times) -> a point in the unit square */
    PROBE_TURN,    /* a in [-1/2, 1/2] -> sine and cosine of 2 pi a */
    PROBE_BASIS,   /* x y z of a normal -> x y z of two vectors across it */
    PROBE_GGX,     /* x y z to the viewer, x y z to the light, exponent -> lobe, density, edge (ggx.h) */
    PROBE_GGX_WAY, /* x y z to the viewer, exponent, two random numbers -> x y z */
    PROBES
};

extern fv_probe_function *const fv_probes_base[PROBES];
#ifdef __x86_64__
extern fv_probe_function *const fv_probes_avx2[PROBES];
extern fv_probe_function *const fv_probes_avx512[PROBES];
#endif

static inline fv_probe_function *fv_probe_of(int isa, enum fv_probe probe)
{
#ifdef __x86_64__
    if (isa == FV_ISA_AVX512) return fv_probes_avx512[probe];
    if (isa == FV_ISA_AVX2) return fv_probes_avx2[probe];
#endif
    (void)isa;
    return fv_probes_base[probe];
}

#endif
