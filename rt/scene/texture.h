/* texture: from 8-bit pixels to a mip chain of packed texels (enum fv_texel). */
#ifndef FV_SCENE_TEXTURE_H
#define FV_SCENE_TEXTURE_H

#include "rt/scene/scene.h"

#include <stddef.h>

enum { FV_TEXTURE_SIZE_MAX = 8192 };

/* Fills `out` from `pixels` (width x height x channels bytes, 1 to FV_TEXTURE_SIZE_MAX a side, 1 to
 * 4 channels). Its texels come from malloc; returns their number over all levels.
 *
 * The largest level has the powers of two that do not exceed width and height. COLOUR: sRGB-encoded
 * in, the first three channels or, with fewer than three, the first as grey; filtered in linear
 * light. NORMAL: three channels, 0..255 for -1..1; filtered as vectors and normalised. ALPHA: the
 * last channel of 2 or 4, the first of 1 or 3; every level but the largest is scaled so that the
 * share of texels at or above `alpha_cutoff` (0..1) stays that of the largest, as nearly as its
 * number of texels allows (Castano, "Computing Alpha Mipmaps", 2010). */
size_t fv_texture_make(struct fv_texture *out, enum fv_texel kind, const uint8_t *pixels, int width,
                       int height, int channels, float alpha_cutoff);

/* The linear value in [0, 1] of an 8-bit sRGB one (IEC 61966-2-1). */
float fv_srgb_to_linear(uint8_t value);

#endif
