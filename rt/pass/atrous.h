/* atrous: light filtered over its neighbours by an edge-avoiding a-trous wavelet (Dammertz et al. 2010, as Peres et al. 2023,
 * section 3.4, use it: with a mask of sampled pixels, and with steps that shrink).
 *
 * One iteration takes of each pixel the weighted mean of 5 x 5 pixels `step` apart, 1/16, 1/4, 3/8, 1/4, 1/16 across and down
 * times w_light w_normal w_position b, b: 1 where the neighbour has light, else 0. FV_ATROUS_FULL is that; FV_ATROUS_ACROSS and
 * then FV_ATROUS_DOWN are the same in two passes of 5 pixels each, far cheaper, and leave about as little noise. FV_ATROUS_FILL is a full one that
 * changes only pixels without light, where nothing weighs by its light: one of these, at step 1, comes first where samples are
 * sparse.
 *
 *   w_light     exp(-(l - l')^2 / (sigma_light^2 s s')), l = (red + 2 green + blue) / 4; s is 1, or where a variance is given
 *               its square root, 1/1024 at least (after SVGF, Schied et al. 2017). 1 where either pixel has no light.
 *   w_normal    exp(-|n - n'|^2 / sigma_normal^2)
 *   w_position  exp(-d^2 / sigma_position^2), d: how far the pixel and its neighbour lie from each other's tangent planes,
 *               mean of both, in pixels' sizes at its depth times `step`. On planes that is 0 however they are seen, and on
 *               spheres. Positions are rebuilt from depth: along a row inverse depth is linear where a surface is plane, so
 *               that with n and n' (times 2) d costs five operations (rt/pass/atrous_kernel.c).
 *
 * For exp a straight line between powers of 2 is taken: up to 6.2 % above it and never below, 0 from 88 on. d's unit is taken at the depth of the pair's upper pixel, or of
 * that to the left. Means are convex: nothing gets brighter than the brightest neighbour, but by half a step of the light's format.
 *
 * A pixel that has no light and no neighbour that weighs anything stays without; it counts as black. One that shows no
 * surface (inverse depth not above 0, or NaN) stays as it is and gives nothing. Pixels beyond the picture give nothing. */
#ifndef FV_PASS_ATROUS_H
#define FV_PASS_ATROUS_H

#include "rt/fovea/view.h"

#include <stdint.h>
#include <string.h>

/* Light without albedo, times the exposure, in 32 bits: mantissas of 9 bits, red the lowest, and in bits 27 to 31 an exponent e
 * that they share; m 2^(e - 24), the greatest mantissa from 256 on but for e = 0 (as EXT_texture_shared_exponent). To the
 * nearest: off by at most 1/511 of the greatest channel, 2^-25 where all are small. Brighter than FV_LIGHT_MAX counts as that,
 * channel by channel; negative and NaN channels as 0. All bits set: there is none. */
#define FV_LIGHT_MAX 65280.0f
#define FV_LIGHT_NONE 0xffffffffu

static inline float fv_light_channel(float x)
{
    return x > 0 ? x < FV_LIGHT_MAX ? x : FV_LIGHT_MAX : 0;
}

static inline uint32_t fv_light_pack(float red, float green, float blue)
{
    float r = fv_light_channel(red), g = fv_light_channel(green), b = fv_light_channel(blue), scale;
    float most = r > g ? r : g;
    most = most > b ? most : b;
    most = most > 0x1p-16f ? most : 0x1p-16f;
    uint32_t bits;
    memcpy(&bits, &most, 4);
    uint32_t field = (bits + 0x4000) & 0x7f800000; /* of a mantissa that would be rounded to 512, the next exponent */
    bits = (262u << 23) - field;                  /* 2^(8 - exponent) */
    memcpy(&scale, &bits, 4);
    return (uint32_t)(r * scale + 0.5f) | (uint32_t)(g * scale + 0.5f) << 9 | (uint32_t)(b * scale + 0.5f) << 18 |
           (field - (111u << 23)) << 4;
}

/* None gives 0. */
static inline void fv_light_unpack(uint32_t light, float rgb[3])
{
    uint32_t bits = (light >> 27 << 23) + (103u << 23);
    float scale;
    memcpy(&scale, &bits, 4);
    for (int c = 0; c < 3; c++) rgb[c] = light == FV_LIGHT_NONE ? 0 : (float)(light >> 9 * c & 511) * scale;
}

enum fv_atrous_taps { FV_ATROUS_ACROSS, FV_ATROUS_DOWN, FV_ATROUS_FULL, FV_ATROUS_FILL };

enum { FV_ATROUS_STEP_MAX = 64 };

/* A rectangle of a picture. Planes are the picture's, from its pixel (0, 0) on; only pixels of the rectangle are written. Full
 * rows, of ACROSS, and columns of 96 pixels and of the picture's height, of DOWN, take the least time; any will do, and give the
 * same. */
struct fv_atrous {
    enum fv_atrous_taps taps;
    int step;                      /* 1 to FV_ATROUS_STEP_MAX, also beyond the picture's size */
    int x, y, columns, rows;       /* within the picture */
    int width, height;             /* of the picture */
    int64_t stride;                /* elements from a row to the next, of all planes */
    const struct fv_view *view;    /* whose pixels they are: where surfaces lie */
    const uint32_t *light;         /* as above */
    const float *inverse_depth;    /* as struct fv_samples has it, 1/m */
    const uint32_t *facing;        /* normals as struct fv_samples has them */
    const float *variance;         /* of l, times the exposure squared; NULL: sigma_light is the same everywhere */
    uint32_t *filtered;            /* out: not `light` */
    float *filtered_variance;      /* out: of the means (weights squared); NULL where `variance` is */
    float sigma_light, sigma_normal, sigma_position; /* 0: only what is equal counts; infinite, NaN: not looked at */
    /* Pixels nearer to `centre`, in pixels (x, y), are not filtered: they stay as they are. 0: none is. Layers of the
     * picture that take fewer iterations are those within. */
    float centre[2], from_px;
};

#endif
