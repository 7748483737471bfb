/* pyramid_contrast_kernel: where neighbouring pixels of a lower level of the pyramid differ; see pyramid.h. */
#include "rt/pass/pyramid.h"
#include "rt/trace/simd.h"

#define contrast FV_ISA_NAME(fv_pyramid_contrast)

void contrast(struct fv_contrast *c);

static inline vi least(vi a, vi b)
{
    return vi_select(a < b, a, b);
}

static inline vi greatest(vi a, vi b)
{
    return vi_select(a > b, a, b);
}

void contrast(struct fv_contrast *c)
{
    for (int y = 0; y < c->n; y++) {
        uint32_t bits = 0, faint = 0;
        for (int x = 0; x < c->n; x += FV_WIDTH) {
            const uint32_t *upper = c->pixel[y] + x, *lower = c->pixel[y + 1] + x;
            vi of[4] = {vi_load(upper), vi_load(upper + 1), vi_load(lower), vi_load(lower + 1)}, most = vi_of(0), top = vi_of(0);
            for (int shift = 0; shift < 30; shift += 10) {
                vi a = (of[0] >> shift) & 1023, b = (of[1] >> shift) & 1023;
                vi d = (of[2] >> shift) & 1023, e = (of[3] >> shift) & 1023;
                vi high = greatest(greatest(a, b), greatest(d, e)), range = high - least(least(a, b), least(d, e));
                top = greatest(top, high);
                most = greatest(most, range);
            }
            vi scale = top + 256;
            most = most << 10;
            bits |= (uint32_t)vi_bits(most > c->step * scale) << x;
            faint |= (uint32_t)vi_bits(most > c->faint * scale) << x;
        }
        c->out[y] = bits & ((1u << c->n) - 1);
        c->faintly[y] = faint & ((1u << c->n) - 1);
    }
}
