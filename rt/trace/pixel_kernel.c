/* pixel_kernel: rows of radiances, light and albedo to pixels, these together, and rows of pixels to bytes. */
#include "rt/trace/pixel.h"

#define encode FV_ISA_NAME(fv_pixel_encode)
#define encode_light FV_ISA_NAME(fv_pixel_encode_light)
#define encode_albedo FV_ISA_NAME(fv_pixel_encode_albedo)
#define compose FV_ISA_NAME(fv_pixel_compose)
#define present FV_ISA_NAME(fv_pixel_present)

void encode(const float *red, const float *green, const float *blue, float exposure, uint32_t *pixel, int n);
void encode_light(const float *red, const float *green, const float *blue, float exposure, uint32_t *pixel, int n);
void encode_albedo(const float *red, const float *green, const float *blue, uint32_t *pixel, int n);
void compose(const uint32_t *base, const uint32_t *albedo, const uint32_t *light, uint32_t *pixel, int n);
void present(const uint32_t *pixel, uint8_t *rgbx, int n);

void encode(const float *red, const float *green, const float *blue, float exposure, uint32_t *pixel, int n)
{
    for (int i = 0; i < n; i += FV_WIDTH) {
        vf3 linear = {vf_load(red + i), vf_load(green + i), vf_load(blue + i)};
        vi_store(pixel + i, pixel_encode(linear, exposure));
    }
}

void encode_light(const float *red, const float *green, const float *blue, float exposure, uint32_t *pixel, int n)
{
    for (int i = 0; i < n; i += FV_WIDTH) {
        vf3 e = {pixel_encode_light(vf_load(red + i) * exposure), pixel_encode_light(vf_load(green + i) * exposure),
                 pixel_encode_light(vf_load(blue + i) * exposure)};
        vi_store(pixel + i, pixel_pack(vf3_scale(e, vf_of(1023))));
    }
}

void encode_albedo(const float *red, const float *green, const float *blue, uint32_t *pixel, int n)
{
    for (int i = 0; i < n; i += FV_WIDTH) {
        vf3 e = {vf_sqrt(vf_clamp(vf_load(red + i), 0, 1)), vf_sqrt(vf_clamp(vf_load(green + i), 0, 1)),
                 vf_sqrt(vf_clamp(vf_load(blue + i), 0, 1))};
        vi_store(pixel + i, pixel_pack(vf3_scale(e, vf_of(1023))));
    }
}

void compose(const uint32_t *base, const uint32_t *albedo, const uint32_t *light, uint32_t *pixel, int n)
{
    for (int i = 0; i < n; i += FV_WIDTH) {
        vi packed = vi_load(base + i);
        vi_store(pixel + i, pixel_lit(packed, vi_load(albedo + i), vi_load(light + i)) | (packed & ~0x3fffffff));
    }
}

void present(const uint32_t *pixel, uint8_t *rgbx, int n)
{
    for (int i = 0; i < n; i += FV_WIDTH) {
        vi p = vi_load(pixel + i);
        vf3 v = pixel_unpack(p);
        vi r = vi_from(v.x * (255.0f / 1023.0f) + 0.5f), g = vi_from(v.y * (255.0f / 1023.0f) + 0.5f),
           b = vi_from(v.z * (255.0f / 1023.0f) + 0.5f);
        vi_store(rgbx + 4 * i, r | (g << 8) | (b << 16) | vi_of((int32_t)0xff000000));
    }
}
