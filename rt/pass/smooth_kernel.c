/* smooth_kernel: a row of pixels smoothed over the frames before; see smooth.h. */
#include "rt/pass/backproject_history.h"
#include "rt/pass/smooth.h"

#define smooth FV_ISA_NAME(fv_smooth)

void smooth(const struct fv_smooth *s);

/* Frames that weigh no more are not looked at. */
#define LEAST (1 / 256.0f)

void smooth(const struct fv_smooth *s)
{
    struct source past[FV_PAST_MAX];
    for (int k = 0; k < s->pasts; k++) past[k] = source_before(&s->past[k], s->past[k].colour);
    for (int i = 0; i < s->row.count; i += FV_WIDTH) {
        struct pixels p;
        bool moves;
        vi own = vi_load(s->row.colour + i), known = take_pixels(&s->row, i, &p, &moves);
        vf rest = vf_load(s->rest + i), weight = vf_select(known, vf_load(s->share + i), vf_of(0)), total = vf_of(1);
        vf3 sum = pixel_decode(pixel_unpack(own));
        for (int k = 0; k < s->pasts; k++) {
            vf3 colour;
            weight *= rest;
            vi counts = weight > LEAST;
            if (!vi_any(counts)) break;
            struct where at = project(&s->past[k], &p, moves);
            vf found = vf_select(counts, weight, vf_of(0)) * mean_around(&past[k], &at, p.moving, &colour);
            sum = vf3_add(sum, vf3_scale(pixel_decode(colour), found));
            total += found;
        }
        vi mean = pixel_encode(vf3_scale(sum, 1.0f / total), 1);
        vi_store(s->smoothed + i, vi_select(total > 1.0f, mean | (own & (int32_t)~FV_PIXEL_COLOUR), own));
    }
}
