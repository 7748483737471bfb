/* pixel_kernel: rows of radiances to pixels and rows of pixels to bytes. */
#include "rt/trace/pixel.h"

#define encode FV_ISA_NAME(fv_pixel_encode)
#define present FV_ISA_NAME(fv_pixel_present)

void encode(const float *red, const float *green, const float *blue, float exposure, uint32_t *pixel, int n);
void present(const uint32_t *pixel, uint8_t *rgbx, int n);

void encode(const float *red, const float *green, const float *blue, float exposure, uint32_t *pixel, int n)
{
    for (int i = 0; i < n; i += FV_WIDTH) {
        vf3 linear = {vf_load(red + i), vf_load(green + i), vf_load(blue + i)};
        vi_store(pixel + i, pixel_encode(linear, exposure));
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
