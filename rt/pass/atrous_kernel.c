/* atrous_kernel: see atrous.h. */
#include "rt/pass/atrous_light.h"

#define atrous FV_ISA_NAME(fv_atrous)
#define pack_light FV_ISA_NAME(fv_pack_light)
#define unpack_light FV_ISA_NAME(fv_unpack_light)

void atrous(const struct fv_atrous *a);
void pack_light(const float *red, const float *green, const float *blue, float scale, uint32_t *light, int n);
void unpack_light(const uint32_t *light, float *red, float *green, float *blue, int n);

void pack_light(const float *red, const float *green, const float *blue, float scale, uint32_t *light, int n)
{
    for (int i = 0; i < n; i += FV_WIDTH)
        vi_store(light + i, light_pack((vf3){vf_load(red + i) * scale, vf_load(green + i) * scale, vf_load(blue + i) * scale}));
}

void unpack_light(const uint32_t *light, float *red, float *green, float *blue, int n)
{
    for (int i = 0; i < n; i += FV_WIDTH) {
        vf3 c = light_unpack(vi_load(light + i));
        vf_store(red + i, c.x), vf_store(green + i, c.y), vf_store(blue + i, c.z);
    }
}

/* Not there yet: light stays as it is. */
void atrous(const struct fv_atrous *a)
{
    for (int y = a->y; y < a->y + a->rows; y++)
        for (int x = a->x; x < a->x + a->columns; x++) a->filtered[y * a->stride + x] = a->light[y * a->stride + x];
}
