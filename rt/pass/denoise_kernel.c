/* denoise_kernel: pixels of what is emitted and of albedo x light; see denoise.h. */
#include "rt/trace/pixel.h"

#define light_up FV_ISA_NAME(fv_light_up)

void light_up(const uint32_t *base, const uint32_t *albedo, const float *red, const float *green, const float *blue,
              uint32_t *pixel, int n);

static inline vf channel(vf base, vf albedo, vf light)
{
    vf root = albedo * (1 / 1023.0f);
    return pixel_decode_channel(base * (1 / 1023.0f)) + root * root * light;
}

void light_up(const uint32_t *base, const uint32_t *albedo, const float *red, const float *green, const float *blue,
              uint32_t *pixel, int n)
{
    for (int i = 0; i < n; i += FV_WIDTH) {
        vf3 b = pixel_unpack(vi_load(base + i)), a = pixel_unpack(vi_load(albedo + i));
        vf3 sum = {channel(b.x, a.x, vf_load(red + i)), channel(b.y, a.y, vf_load(green + i)), channel(b.z, a.z, vf_load(blue + i))};
        vi_store(pixel + i, pixel_encode(sum, 1));
    }
}
