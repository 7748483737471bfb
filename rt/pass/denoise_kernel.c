/* denoise_kernel: pixels of what is emitted and of albedo x light, and variances of a tile evened out; see denoise.h. */
#include "rt/pass/denoise.h"
#include "rt/trace/pixel.h"

#define light_up FV_ISA_NAME(fv_light_up)
#define even_out FV_ISA_NAME(fv_even_out)

void light_up(const uint32_t *base, const uint32_t *albedo, const float *red, const float *green, const float *blue,
              uint32_t *pixel, int n);
void even_out(struct fv_variances *v);

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

/* Sums of a row's pixels, 2 FV_VARIANCE_REACH + 1 each. */
static inline void sum_across(const float *row, float *sum)
{
    for (int x = 0; x < FV_TILE; x += FV_WIDTH) {
        vf s = vf_of(0);
        for (int k = -FV_VARIANCE_REACH; k <= FV_VARIANCE_REACH; k++) s += vf_load(row + FV_VARIANCE_EDGE + x + k);
        vf_store(sum + x, s);
    }
}

void even_out(struct fv_variances *v)
{
    float sum[FV_TILE][FV_TILE], count[FV_TILE][FV_TILE];
    for (int y = 0; y < FV_TILE; y++) sum_across(v->variance[y], sum[y]), sum_across(v->counts[y], count[y]);
    for (int y = 0; y < FV_TILE; y++) {
        int first = y > FV_VARIANCE_REACH ? y - FV_VARIANCE_REACH : 0, last = y + FV_VARIANCE_REACH < FV_TILE ? y + FV_VARIANCE_REACH : FV_TILE - 1;
        for (int x = 0; x < FV_TILE; x += FV_WIDTH) {
            vf s = vf_of(0), n = s;
            for (int k = first; k <= last; k++) s += vf_load(sum[k] + x), n += vf_load(count[k] + x);
            vf_store(v->variance[y] + FV_VARIANCE_EDGE + x, s / vf_max(n, vf_of(1)));
        }
    }
}
