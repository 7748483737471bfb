/* field_starts_kernel: where all rays in a cone around each sample may begin in fields (kernels.h). */
#include "rt/trace/field_cones.h"
#include "rt/trace/lens_ray.h"

#define field_starts FV_ISA_NAME(fv_field_starts)

void field_starts(const struct fv_tracer *tracer, const struct fv_view *view, struct fv_samples *samples,
                  float radius_px, int64_t *rays);

void field_starts(const struct fv_tracer *tracer, const struct fv_view *view, struct fv_samples *samples,
                  float radius_px, int64_t *rays)
{
    vf3 corner = vf3_of(view->corner), dx = vf3_of(view->dx), dy = vf3_of(view->dy);
    float across = __builtin_sqrtf(view->dx[0] * view->dx[0] + view->dx[1] * view->dx[1] + view->dx[2] * view->dx[2]);
    float along = __builtin_sqrtf(view->dy[0] * view->dy[0] + view->dy[1] * view->dy[1] + view->dy[2] * view->dy[2]);
    float wide = radius_px * (across > along ? across : along);
    if (view->bend.on) wide *= view->bend.widest;
    for (int i = 0; i < samples->count; i += FV_WIDTH) {
        struct field_cones cones;
        struct field_kept kept;
        vf x = vf_load(samples->x + i), y = vf_load(samples->y + i);
        if (view->bend.on) lens_straighten(&view->bend, &x, &y);
        vf3 direction = vf3_add(corner, vf3_add(vf3_scale(dx, x), vf3_scale(dy, y)));
        struct field_rays r = field_rays_of(vf3_of(view->origin), direction, vi_lanes() < samples->count - i);
        r.far = tracer->march_far / r.length;
        r.wide += wide;
        if (samples->started) r.from = vf_load(samples->start + i);
        field_find(tracer, &r, NULL, &kept);
        field_cones(tracer, &r, &kept, 0, rays, &cones);
        vf_store(samples->start + i, cones.clear);
    }
    samples->started = true;
}
