/* pixel: how a colour is kept in the frame and its history: 10 bits a channel, 0..1023.
 *
 * Bits 0-9 red, 10-19 green, 20-29 blue. Colours: sRGB-encoded tone-mapped values, two bits more than the
 * display shows, so that blending over many frames does not band. The two bits above are flags (pass/pass.h).
 * Light that is kept apart (trace/tracer.h), times the exposure: sqrt(x / (1 + x)). Albedo: sqrt(x). */
#ifndef FV_TRACE_PIXEL_H
#define FV_TRACE_PIXEL_H

#include "rt/trace/simd.h"

/* What the highest code stands for, and all that is brighter. */
#define PIXEL_BRIGHTEST 7.2416f

/* Filmic curve of Narkowicz (2015), then the sRGB curve in square roots (error < 0.002), both of
 * [0, inf]: NaN and negative give 0, infinity gives 1. */
static inline vf pixel_encode_channel(vf linear)
{
    vf x = vf_clamp(linear, 0, 1e4f);
    vf y = x * (2.51f * x + 0.03f) * vf_reciprocal(x * (2.43f * x + 0.59f) + 0.14f);
    y = vf_clamp(y, 0, 1);
    vf s1 = vf_root(y), s2 = vf_root(s1), s3 = vf_root(s2);
    vf curve = 0.662002687f * s1 + 0.684122060f * s2 - 0.323583601f * s3 - 0.0225411470f * y;
    return vf_clamp(vf_select(y < 0.0031308f, 12.92f * y, curve), 0, 1);
}

/* The inverse: of a code / 1023 in [0, 1], the linear value that it stands for, in [0, 7.3]; the polynomial
 * gives the code back to a five-hundredth of it. */
static inline vf pixel_decode_channel(vf e)
{
    vf high = -1.04960701f + e * (1.27307758f + e * (-1.08365033f + e * (0.544748715f - e * 0.119199337f)));
    vf y = 0.000768023574f + e * (0.0357659515f + e * (0.47738825f + e * (0.92070549f + e * high)));
    y = vf_select(e < 41.5f / 1023, e * (1 / 12.92f), vf_clamp(y, 0.0031309f, 1));
    /* x of y = x (2.51 x + 0.03) / (x (2.43 x + 0.59) + 0.14); as a quotient, since the sum cancels where y is small. */
    vf a = 2.51f - 2.43f * y, b = 0.59f * y - 0.03f, c = 0.14f * y, root = vf_root(b * b + 4.0f * a * c);
    return vf_select(b > 0.0f, root + b, 2.0f * c) * vf_reciprocal(vf_select(b > 0.0f, 2.0f * a, root - b));
}

/* The linear colours of codes 0..1023. */
static inline vf3 pixel_decode(vf3 code)
{
    const float unit = 1 / 1023.0f;
    return (vf3){pixel_decode_channel(code.x * unit), pixel_decode_channel(code.y * unit), pixel_decode_channel(code.z * unit)};
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

/* Light in [0, inf]: NaN and negative give 0, infinity 1. */
static inline vf pixel_encode_light(vf x)
{
    x = vf_clamp(x, 0, 1e6f);
    return vf_sqrt(x / (1.0f + x));
}

/* Of a code / 1023 in [0, 1], in [0, 2046]: the highest code stands for all that is brighter. */
static inline vf pixel_decode_light(vf e)
{
    vf square = vf_min(e * e, vf_of(1 - 0.5f / 1023));
    return square / (1.0f - square);
}

/* One channel of base + albedo * light, all as codes 0..1023. */
static inline vf pixel_lit_channel(vf base, vf albedo, vf light)
{
    const float unit = 1 / 1023.0f;
    vf root = albedo * unit;
    return pixel_decode_channel(base * unit) + root * root * pixel_decode_light(light * unit);
}

/* The colour of base + albedo * light. */
static inline vi pixel_lit(vi base, vi albedo, vi light)
{
    vf3 b = pixel_unpack(base), a = pixel_unpack(albedo), l = pixel_unpack(light);
    vf3 sum = {pixel_lit_channel(b.x, a.x, l.x), pixel_lit_channel(b.y, a.y, l.y), pixel_lit_channel(b.z, a.z, l.z)};
    return pixel_encode(sum, 1);
}

#endif
