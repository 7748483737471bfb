/* pixel: how a colour is kept in the frame and its history: display-encoded, 10 bits a channel.
 *
 * Bits 0-9 red, 10-19 green, 20-29 blue: sRGB-encoded tone-mapped values, 0..1023. Two bits more
 * than the display shows, so that blending over many frames does not band. The two bits above are
 * flags (pass/pass.h). */
#ifndef FV_TRACE_PIXEL_H
#define FV_TRACE_PIXEL_H

#include "rt/trace/simd.h"

/* Filmic curve of Narkowicz (2015), then the sRGB curve in square roots (error < 0.002), both of
 * [0, inf]: NaN and negative give 0, infinity gives 1. */
static inline vf pixel_encode_channel(vf linear)
{
    vf x = vf_clamp(linear, 0, 1e4f);
    vf y = x * (2.51f * x + 0.03f) / (x * (2.43f * x + 0.59f) + 0.14f);
    y = vf_clamp(y, 0, 1);
    vf s1 = vf_sqrt(y), s2 = vf_sqrt(s1), s3 = vf_sqrt(s2);
    vf curve = 0.662002687f * s1 + 0.684122060f * s2 - 0.323583601f * s3 - 0.0225411470f * y;
    return vf_clamp(vf_select(y < 0.0031308f, 12.92f * y, curve), 0, 1);
}

static inline vi pixel_pack(vf3 encoded_1023)
{
    vi r = vi_from(encoded_1023.x + 0.5f), g = vi_from(encoded_1023.y + 0.5f), b = vi_from(encoded_1023.z + 0.5f);
    return r | (g << 10) | (b << 20);
}

static inline vf3 pixel_unpack(vi pixel)
{
    return (vf3){vf_from(pixel & 1023), vf_from((pixel >> 10) & 1023), vf_from((pixel >> 20) & 1023)};
}

static inline vi pixel_encode(vf3 linear, float exposure)
{
    vf3 e = {pixel_encode_channel(linear.x * exposure) * 1023.0f,
             pixel_encode_channel(linear.y * exposure) * 1023.0f,
             pixel_encode_channel(linear.z * exposure) * 1023.0f};
    return pixel_pack(e);
}

#endif
