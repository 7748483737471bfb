/* trace_kernel: lists of samples, packet by packet: primary rays, surfaces, light, and Whitted's
 * reflections and refractions by recursion to a bounded depth. Compiled for all scenes here, and with
 * fewer FV_FEATURES (packet.h) under other names for scenes that hold less (variant.h). */
#include "rt/trace/light.h"
#include "rt/trace/refraction.h"

#ifndef FV_TRACE_SAMPLES
#define FV_TRACE_SAMPLES fv_trace_samples
#endif
#define trace_samples FV_ISA_NAME(FV_TRACE_SAMPLES)

void trace_samples(const struct fv_tracer *tracer, const struct fv_view *view, struct fv_samples *samples,
                   uint32_t seed, int64_t *rays);

/* A packet of rays under way: lanes of `mask`, each with the ray cone of fv_ray_context. */
struct rays {
    vf3 origin, direction;
    vi mask;
    vf base, growth;
    bool coherent;
};

static vf3 radiance(const struct shading *shading, const struct rays *rays, int depth, vf *t, vi *object);

/* Lanes below this weight are not followed further. */
static const float weight_min = 1 / 512.0f;

static inline vi heavy(vf3 weight)
{
    return vf_max(vf_max(weight.x, weight.y), weight.z) > weight_min;
}

/* Radiance along `direction` from the surface, times weight; only in lanes of mask. */
static vf3 follow(const struct shading *shading, const struct surface *s, vf3 direction, vf side, vf3 weight,
                  vi mask, int depth)
{
    vf3 zero = {vf_of(0), vf_of(0), vf_of(0)};
    mask &= heavy(weight);
    unsigned bits = vi_bits(mask);
    if (!bits) return zero;
    if (depth <= 0) {
        const struct fv_scene *scene = shading->tracer->data;
        vf3 rest = vf3_of(scene->ambient);
        return vf3_select(mask, (vf3){rest.x * weight.x, rest.y * weight.y, rest.z * weight.z}, zero);
    }
    struct rays next = {.origin = vf3_add(s->point, vf3_scale(s->geometric, s->offset * side)),
                        .direction = direction, .mask = mask, .base = s->footprint,
                        .growth = s->footprint * 0.1f, .coherent = true};
    shading->rays[FV_RAY_SECONDARY] += __builtin_popcount(bits);
    vf t;
    vi object;
    vf3 seen = radiance(shading, &next, depth - 1, &t, &object);
    return vf3_select(mask, (vf3){seen.x * weight.x, seen.y * weight.y, seen.z * weight.z}, zero);
}

/* Mirror direction of unit d about the shading normal, kept above the surface itself. */
static inline vf3 reflected(const struct surface *s, vf3 d)
{
    vf3 r = vf3_sub(d, vf3_scale(s->normal, 2.0f * vf_dot(d, s->normal)));
    vf above = vf_dot(r, s->geometric);
    vf3 plain = vf3_sub(d, vf3_scale(s->geometric, 2.0f * vf_dot(d, s->geometric)));
    return vf3_select(above > 0.0f, r, plain);
}

static vf3 secondary(const struct shading *shading, const struct surface *s, vf3 direction, int depth)
{
    vf3 d = vf3_normalise(direction, vf3_scale(s->normal, vf_of(-1)));
    vi mirror = s->hit & ((s->flags & FV_MATERIAL_MIRROR) != 0);
    vi glass = s->hit & ((s->flags & FV_MATERIAL_GLASS) != 0);
    vf3 weight = vf3_select(mirror, s->mirror, (vf3){vf_of(0), vf_of(0), vf_of(0)});
    vf3 sum = {vf_of(0), vf_of(0), vf_of(0)};
    if (vi_any(glass)) {
        struct refraction r = refract(d, s->normal, s->ior, s->outside);
        /* A bent normal must not send back what goes through. */
        vf3 beyond = vf3_select(vf_dot(r.beyond, s->geometric) < 0.0f, r.beyond, d);
        sum = follow(shading, s, beyond, vf_of(-1), vf3_scale(s->transmission, 1.0f - r.reflectance),
                     glass & r.through, depth);
        weight = vf3_select(glass, (vf3){r.reflectance, r.reflectance, r.reflectance}, weight);
    }
    return vf3_add(sum, follow(shading, s, reflected(s, d), vf_of(1), weight, mirror | glass, depth));
}

/* t and object: of what is hit; inf and 0 where nothing is. */
static vf3 radiance(const struct shading *shading, const struct rays *r, int depth, vf *t, vi *object)
{
    const struct fv_tracer *tracer = shading->tracer;
    const struct fv_scene *scene = tracer->data;
    int first = __builtin_ctz(vi_bits(r->mask));
    struct fv_ray_context context = packet_context(r->coherent, r->base[first], r->growth[first]);
    struct packet_hit hit = packet_intersect(tracer, &context, r->origin, r->direction, r->mask);
    vf3 out = vf3_of(scene->sky);
    *t = hit.t;
    *object = FV_FEATURES & FV_SCENE_MOVING ? hit.object : vi_of(0);
    if (vi_any(hit.hit)) {
        struct surface s;
        surface_set(&s, tracer, &hit, r->origin, r->direction, r->base, r->growth);
        vf3 lit = light_surface(shading, &s, r->direction);
        if (s.any & FV_FEATURES & (FV_MATERIAL_MIRROR | FV_MATERIAL_GLASS))
            lit = vf3_add(lit, secondary(shading, &s, r->direction, depth));
        out = vf3_select(hit.hit, lit, out);
    }
    return out;
}

/* Two numbers in [0, 1) from the blue-noise mask at the sample's pixel, turned by the seed. */
static inline void randomise(struct shading *shading, vf x, vf y, uint32_t seed)
{
    vi column = vi_from(x), row = vi_from(y);
    int mask = FV_NOISE_SIZE - 1;
    vf shift1 = vf_of((float)(seed * 2654435769u >> 8) * 0x1p-24f);
    vf shift2 = vf_of((float)(seed * 1566083941u >> 8) * 0x1p-24f);
    vf a = vf_gather(shading->tracer->noise, (row & mask) * FV_NOISE_SIZE + (column & mask)) + shift1;
    vf b = vf_gather(shading->tracer->noise, ((row + 23) & mask) * FV_NOISE_SIZE + ((column + 41) & mask)) + shift2;
    shading->random1 = a - vf_floor(a);
    shading->random2 = b - vf_floor(b);
}

static inline void store_samples(struct fv_samples *samples, int i, vf3 seen, vf t)
{
    vi known = (vf_abs(seen.x) <= FV_RADIANCE_MAX) & (vf_abs(seen.y) <= FV_RADIANCE_MAX) &
               (vf_abs(seen.z) <= FV_RADIANCE_MAX);
    vf zero = vf_of(0), w = vf_select(t < 1e30f, 1.0f / vf_max(t, vf_of(1 / FV_INVERSE_DEPTH_MAX)), zero);
    vf_store(samples->red + i, vf_select(known, vf_max(seen.x, zero), zero));
    vf_store(samples->green + i, vf_select(known, vf_max(seen.y, zero), zero));
    vf_store(samples->blue + i, vf_select(known, vf_max(seen.z, zero), zero));
    vf_store(samples->inverse_depth + i, vf_select(known, w, vf_of(FV_DEPTH_UNKNOWN)));
}

void trace_samples(const struct fv_tracer *tracer, const struct fv_view *view, struct fv_samples *samples,
                   uint32_t seed, int64_t *rays)
{
    struct shading shading = {.tracer = tracer, .rays = rays};
    int64_t counted = rays[FV_RAY_PRIMARY] + samples->count;
    vf3 corner = vf3_of(view->corner), dx = vf3_of(view->dx), dy = vf3_of(view->dy);
    for (int i = 0; i < samples->count; i += FV_WIDTH) {
        vf x = vf_load(samples->x + i), y = vf_load(samples->y + i);
        struct rays r = {.origin = vf3_of(view->origin),
                         .direction = vf3_add(corner, vf3_add(vf3_scale(dx, x), vf3_scale(dy, y))),
                         .mask = vi_lanes() < samples->count - i,
                         .base = vf_of(0), .growth = vf_of(view->pixel_size), .coherent = true};
        vf t;
        vi object;
        if (tracer->data->features & FV_FEATURES & FV_SCENE_AREA_LIGHTS) randomise(&shading, x, y, seed);
        vf3 seen = radiance(&shading, &r, tracer->depth, &t, &object);
        store_samples(samples, i, seen, t);
        vi_store(samples->surface + i, object);
    }
    rays[FV_RAY_PRIMARY] = counted;
}
