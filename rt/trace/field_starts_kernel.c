/* field_starts_kernel: cones of rays through fields, for starts that lie before any surface (kernels.h). A cone
 * stops once the distance is no longer more than its own radius; then every ray in it may go on from there. */
#include "rt/trace/field_way.h"

#define field_starts FV_ISA_NAME(fv_field_starts)

void field_starts(const struct fv_tracer *tracer, const struct fv_view *view, struct fv_samples *samples,
                  float radius_px, int64_t *rays);

/* How far cones of rays may go: to `t` where no surface, nor what counts as a hit, lies nearer within the radius
 * t * wide of the axis at the same t. Stops where a step would be less than a share of the radius. Infinite where
 * there is nothing up to far. */
static void march_cones(const struct fv_tracer *tracer, const struct field_rays *r,
                        int64_t *rays, vf *t)
{
    const float share = 0.5f;
    const struct fv_fields *f = &tracer->data->fields;
    struct field_way w;
    vf inverse = 1.0f / (r->length * (1 + FV_FIELD_HIT) + r->wide), stopped = r->far;
    vi done = vi_of(0);
    int64_t steps = 0;
    int left = tracer->march_steps;
    field_begin(&w, tracer, r);
    for (; field_reach(&w) && left > 0; left--) {
        vi part;
        steps += __builtin_popcount(vi_bits(w.live));
        vf next, radius = w.t * r->wide, clear = field_nearest(&w, f, &part, &next) - radius - (w.t * r->length + 1.0f) * FV_FIELD_HIT;
        vi stop = w.live & ~(clear > radius * share + FV_FIELD_HIT);
        stopped = vf_select(stop, w.t, stopped);
        done |= stop;
        w.live &= ~stop;
        w.t = w.sure = vf_min(w.t + vf_max(clear, vf_of(0)) * inverse, next);
    }
    rays[FV_RAY_MARCH_STEPS] += steps;
    stopped = vf_select(left == 0 ? w.live & ~done : vi_of(0), w.t, stopped);
    done |= left == 0 ? w.live : vi_of(0);
    *t = vf_select(done, stopped, vf_of(__builtin_inff()));
}

void field_starts(const struct fv_tracer *tracer, const struct fv_view *view, struct fv_samples *samples,
                  float radius_px, int64_t *rays)
{
    vf3 corner = vf3_of(view->corner), dx = vf3_of(view->dx), dy = vf3_of(view->dy);
    float across = __builtin_sqrtf(view->dx[0] * view->dx[0] + view->dx[1] * view->dx[1] + view->dx[2] * view->dx[2]);
    float along = __builtin_sqrtf(view->dy[0] * view->dy[0] + view->dy[1] * view->dy[1] + view->dy[2] * view->dy[2]);
    float wide = radius_px * (across > along ? across : along);
    for (int i = 0; i < samples->count; i += FV_WIDTH) {
        vf x = vf_load(samples->x + i), y = vf_load(samples->y + i), t;
        vf3 direction = vf3_add(corner, vf3_add(vf3_scale(dx, x), vf3_scale(dy, y)));
        struct field_rays r = field_rays_of(vf3_of(view->origin), direction, vi_lanes() < samples->count - i);
        r.far = tracer->march_far / r.length;
        r.wide = vf_of(wide);
        if (samples->started) r.from = vf_load(samples->start + i);
        march_cones(tracer, &r, rays, &t);
        vf_store(samples->start + i, t);
    }
    samples->started = true;
}
