/* trace_kernel: lists of samples, packet by packet: primary rays, surfaces, light, and Whitted's
 * reflections and refractions by recursion to a bounded depth. Compiled for all scenes here, and with
 * fewer FV_FEATURES (packet.h) under other names for scenes that hold less (variant.h). */
#include "rt/trace/variant.h"

#ifndef FV_FEATURES
#define FV_FEATURES FV_FEATURES_EVERYTHING
#endif
#include "rt/trace/lens_ray.h"
#include "rt/trace/light.h"
#include "rt/trace/refraction.h"

#ifndef FV_TRACE_SAMPLES
#define FV_TRACE_SAMPLES fv_trace_samples
#endif
#define trace_samples FV_ISA_NAME(FV_TRACE_SAMPLES)

/* What primary rays hit is lit by paths (path.h). */
#ifndef FV_PATHS
#define FV_PATHS 0
#endif

void trace_samples(const struct fv_tracer *tracer, const struct fv_view *view, struct fv_samples *samples,
                   uint32_t seed, int64_t *rays);

/* A packet of rays under way: lanes of `mask`, each with the ray cone of fv_ray_context. */
struct rays {
    vf3 origin, direction;
    vi mask;
    vf base, growth;
    bool coherent, primary;
    const float *start; /* in fields, NULL: 0 */
};

/* What they see: of primary rays without `parted`, where that is not NULL. */
struct seen {
    vf3 radiance;
    vf depth;      /* ray parameter of the surface, or of the image behind a flat mirror; infinite: none */
    vi surface;    /* enum fv_surface, but for FV_SURFACE_GRAZING */
    vf3 geometric; /* of the surface; 0 where there is none */
};

static void look(const struct shading *shading, const struct rays *rays, int depth, struct parted *parted,
                 struct seen *seen);

/* Lanes below this weight are not followed further. */
static const float weight_min = 1 / 512.0f;

static inline vi heavy(vf3 weight)
{
    return vf_max(vf_max(weight.x, weight.y), weight.z) > weight_min;
}

/* What there is along unit `direction` from the surface, its radiance times weight; only in lanes of mask. At
 * the end of the chain that is the mean surroundings, of no known depth: 0. */
static void follow(const struct shading *shading, const struct surface *s, vf3 direction, vf side, vf3 weight,
                   vi mask, int depth, struct seen *seen)
{
    vf3 zero = {vf_of(0), vf_of(0), vf_of(0)};
    *seen = (struct seen){.radiance = zero, .depth = vf_of(0), .surface = vi_of(0)};
    mask &= heavy(weight);
    unsigned bits = vi_bits(mask);
    if (!bits) return;
    if (depth <= 0) {
        seen->radiance = vf3_of(shading->tracer->data->ambient);
        seen->surface = mask & FV_SURFACE_VIEW;
    } else {
        struct rays next = {.origin = vf3_add(s->point, vf3_scale(s->geometric, s->offset * side)),
                            .direction = direction, .mask = mask, .base = s->footprint,
                            .growth = s->footprint * 0.1f, .coherent = true};
        shading->rays[FV_RAY_SECONDARY] += __builtin_popcount(bits);
        look(shading, &next, depth - 1, NULL, seen);
        seen->surface &= mask;
        seen->depth = vf_select(mask, seen->depth, vf_of(0));
    }
    vf3 r = seen->radiance;
    seen->radiance = vf3_select(mask, (vf3){r.x * weight.x, r.y * weight.y, r.z * weight.z}, zero);
}

/* Mirror direction of unit d about the shading normal, kept above the surface itself. */
static inline vf3 reflected(const struct surface *s, vf3 d)
{
    vf3 r = vf3_sub(d, vf3_scale(s->normal, 2.0f * vf_dot(d, s->normal)));
    vf above = vf_dot(r, s->geometric);
    vf3 plain = vf3_sub(d, vf3_scale(s->geometric, 2.0f * vf_dot(d, s->geometric)));
    return vf3_select(above > 0.0f, r, plain);
}

/* Where a mirror is flat and shows more than it scatters, the depth becomes that of the image behind it: as far
 * again as what it shows is from it. Other mirrors and glass keep theirs and show what moves otherwise. A moving
 * object in a mirror, or a moving mirror, does so too. */
static inline void place_image(const struct surface *s, vf3 direction, vi mirror, vi glass, vf3 weight,
                               const struct seen *image, struct seen *seen)
{
    vf scattered = vf_max(vf_max(s->diffuse.x, s->diffuse.y), s->diffuse.z);
    vf mirrored = vf_max(vf_max(weight.x, weight.y), weight.z);
    vi clear = mirror & s->flat & (mirrored > scattered);
    vi other = (mirror & heavy(weight) & ~clear) | glass;
    vi moving = clear & (((image->surface | seen->surface) & FV_SURFACE_OBJECT) != 0);
    vf inverse = vf_rsqrt(vf_max(vf_dot(direction, direction), vf_of(1e-30f)));
    seen->depth += vf_select(clear, image->depth * inverse, vf_of(0));
    seen->surface |= (clear & image->surface & FV_SURFACE_VIEW) | ((other | moving) & FV_SURFACE_VIEW);
}

/* Adds what the surface mirrors and lets through. */
static void secondary(const struct shading *shading, const struct surface *s, vf3 direction, int depth,
                      struct seen *seen)
{
    vf3 d = vf3_normalise(direction, vf3_scale(s->normal, vf_of(-1)));
    vi mirror = s->hit & ((s->flags & FV_MATERIAL_MIRROR) != 0);
    vi glass = s->hit & ((s->flags & FV_MATERIAL_GLASS) != 0);
    vf3 weight = vf3_select(mirror, s->mirror, (vf3){vf_of(0), vf_of(0), vf_of(0)});
    struct seen other;
    if (vi_any(glass)) {
        struct refraction r = refract(d, s->normal, s->ior, s->outside);
        /* A bent normal must not send back what goes through. */
        vf3 beyond = vf3_select(vf_dot(r.beyond, s->geometric) < 0.0f, r.beyond, d);
        follow(shading, s, beyond, vf_of(-1), vf3_scale(s->transmission, 1.0f - r.reflectance),
               glass & r.through, depth, &other);
        seen->radiance = vf3_add(seen->radiance, other.radiance);
        weight = vf3_select(glass, (vf3){r.reflectance, r.reflectance, r.reflectance}, weight);
    }
    follow(shading, s, reflected(s, d), vf_of(1), weight, mirror | glass, depth, &other);
    seen->radiance = vf3_add(seen->radiance, other.radiance);
    place_image(s, direction, mirror & ~glass, glass, weight, &other, seen);
}

/* `few`: what of the fields they may meet, NULL: anything. */
static inline struct packet_hit meet(const struct shading *shading, const struct rays *r, const struct field_few *few)
{
    int first = __builtin_ctz(vi_bits(r->mask));
    struct fv_ray_context context = packet_context(r->coherent, r->base[first], r->growth[first]);
    context.start = r->start;
    context.rays = shading->rays;
    context.few = few;
    return packet_intersect(shading->tracer, &context, r->origin, r->direction, r->mask);
}

#if FV_PATHS
#include "rt/trace/path.h"
#endif

/* Light on what is seen, as struct parted says where that is asked for. */
static inline vf3 light_seen(const struct shading *shading, struct surface *s, const struct rays *r, struct parted *parted)
{
#if FV_PATHS
    if (r->primary) return path_surface(shading, s, r->direction, parted);
#endif
    return light_surface(shading, s, r->direction, r->primary, parted);
}

static inline vi facing_of(vf3 n)
{
    vi x = vi_from((n.x + 1.0f) * 511.0f + 0.5f), y = vi_from((n.y + 1.0f) * 511.0f + 0.5f);
    return x | (y << 10) | (vi_from((n.z + 1.0f) * 511.0f + 0.5f) << 20);
}

/* A surface that was lit, of the primary rays or of those that go on from there; `facing`: its normal, not bent. */
static inline void identify(struct identified *to, const struct surface *s, vi object, vi facing, bool primary)
{
    vi shadows = vi_select(s->shadows < 31, s->shadows, vi_of(31)) << FV_IDENTITY_SHADOWS_SHIFT;
    vi textured = vi_select((s->flags & FV_MATERIAL_TEXTURED) != 0, vi_of(FV_IDENTITY_TEXTURED), vi_of(0));
    vi identity = s->hit & (((s->of + 1) & 0xffff) | (object << 16) | shadows | textured);
    facing &= s->hit;
    if (primary) {
        to->identity = identity;
        to->facing = facing;
        return;
    }
    vi first = to->second_identity == 0;
    to->second_identity |= first & identity;
    to->second_facing |= first & facing;
}

/* What is seen of what the rays met. */
static inline void look_at(const struct shading *shading, const struct rays *r, const struct packet_hit *hit, int depth,
                           struct parted *parted, struct seen *seen)
{
    const struct fv_tracer *tracer = shading->tracer;
    const struct fv_scene *scene = tracer->data;
    vf3 sky = vf3_of(scene->sky), zero = {vf_of(0), vf_of(0), vf_of(0)};
    vi object = FV_FEATURES & FV_SCENE_MOVING ? hit->object : vi_of(0);
    *seen = (struct seen){.radiance = sky, .depth = hit->t, .surface = object, .geometric = zero};
    if (!vi_any(hit->hit)) return;
    struct surface s;
    surface_set(&s, tracer, hit, r->origin, r->direction, r->base, r->growth);
    seen->geometric = s.geometric;
    vi facing = shading->identified ? facing_of(s.normal) : vi_of(0);
    seen->radiance = light_seen(shading, &s, r, parted);
    if (FV_PATHS && shading->identified) facing = facing_of(s.normal);
    if (shading->identified && (r->primary || depth == shading->tracer->depth - 1))
        identify(shading->identified, &s, object, facing, r->primary);
    if (s.any & FV_FEATURES & (FV_MATERIAL_MIRROR | FV_MATERIAL_GLASS))
        secondary(shading, &s, r->direction, depth, seen);
    seen->radiance = vf3_select(hit->hit, seen->radiance, sky);
    seen->geometric = vf3_select(hit->hit, s.geometric, zero);
}

static void look(const struct shading *shading, const struct rays *r, int depth, struct parted *parted,
                 struct seen *seen)
{
    struct packet_hit hit = meet(shading, r, NULL);
    look_at(shading, r, &hit, depth, parted, seen);
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

/* Further on for each sample of a pixel, evenly spread (Roberts' R2 sequence). */
static inline void randomise_further(struct shading *shading, vi number)
{
    vf a = shading->random1 + vf_from(number) * 0.754877666f, b = shading->random2 + vf_from(number) * 0.569840291f;
    shading->random1 = a - vf_floor(a);
    shading->random2 = b - vf_floor(b);
}

static inline vi sound(vf3 radiance)
{
    return (vf_abs(radiance.x) <= FV_RADIANCE_MAX) & (vf_abs(radiance.y) <= FV_RADIANCE_MAX) &
           (vf_abs(radiance.z) <= FV_RADIANCE_MAX);
}

static inline void store_samples(struct fv_samples *samples, int i, const struct seen *seen, vi known, vf3 axis,
                                 float epsilon_grazing)
{
    vf t = seen->depth, zero = vf_of(0);
    vf w = vf_select(t < 1e30f, 1.0f / vf_max(t, vf_of(1 / FV_INVERSE_DEPTH_MAX)), zero);
    vi hit = vf_dot(seen->geometric, seen->geometric) > 0.0f;
    vi grazing = hit & (vf_max(-vf_dot(seen->geometric, axis), zero) < epsilon_grazing);
    vf_store(samples->red + i, vf_select(known, vf_max(seen->radiance.x, zero), zero));
    vf_store(samples->green + i, vf_select(known, vf_max(seen->radiance.y, zero), zero));
    vf_store(samples->blue + i, vf_select(known, vf_max(seen->radiance.z, zero), zero));
    vf_store(samples->inverse_depth + i, vf_select(known, w, vf_of(FV_DEPTH_UNKNOWN)));
    vi_store(samples->surface + i, seen->surface | (grazing & FV_SURFACE_GRAZING));
}

static inline void store_parted(struct fv_samples *samples, int i, const struct parted *p, vi known)
{
    vf zero = vf_of(0);
    vf_store(samples->albedo_red + i, p->albedo.x);
    vf_store(samples->albedo_green + i, p->albedo.y);
    vf_store(samples->albedo_blue + i, p->albedo.z);
    vf_store(samples->light_red + i, vf_select(known, vf_max(p->light.x, zero), zero));
    vf_store(samples->light_green + i, vf_select(known, vf_max(p->light.y, zero), zero));
    vf_store(samples->light_blue + i, vf_select(known, vf_max(p->light.z, zero), zero));
    if (FV_PATHS) vf_store(samples->variance + i, vf_select(known, vf_max(p->variance, zero), zero));
}

static inline void store_identified(struct fv_samples *samples, int i, const struct identified *of)
{
    vi_store(samples->identity + i, of->identity);
    vi_store(samples->facing + i, of->facing);
    vi_store(samples->triangle + i, of->triangle);
    vi_store(samples->lit + i, of->lit);
    if (!(FV_FEATURES & (FV_SCENE_MIRRORS | FV_SCENE_GLASS))) return;
    vi_store(samples->second_identity + i, of->second_identity);
    vi_store(samples->second_facing + i, of->second_facing);
}

/* The view's optical axis, unit. */
static vf3 axis_of(const struct fv_view *view)
{
    double ahead[3] = {0, 0, -1};
    fv_quat_rotate(view->pose.rotation, ahead, ahead);
    return vf3_of((float[3]){(float)ahead[0], (float)ahead[1], (float)ahead[2]});
}

static inline struct rays rays_of(const struct fv_view *view, const struct fv_samples *samples, int i)
{
    vf x = vf_load(samples->x + i), y = vf_load(samples->y + i), size = vf_of(view->pixel_size);
    if (view->bend.on) size *= lens_straighten(&view->bend, &x, &y);
    vf3 across = vf3_scale(vf3_of(view->dx), x), along = vf3_scale(vf3_of(view->dy), y);
    return (struct rays){.origin = vf3_of(view->origin),
                         .direction = vf3_add(vf3_of(view->corner), vf3_add(across, along)),
                         .mask = vi_lanes() < samples->count - i,
                         .base = vf_of(0), .growth = size, .coherent = true, .primary = true,
                         .start = samples->started ? samples->start + i : NULL};
}

/* The samples' list under way. */
struct list {
    struct fv_samples *samples;
    uint32_t seed;
    bool sampled, split;
    vf3 axis;
};

/* Of what was met, the triangles that neither move nor are masked, -1 elsewhere. */
static inline vi opaque_triangles(const struct fv_tracer *tracer, const struct packet_hit *h)
{
    vi of = h->hit & (h->triangle < (int32_t)tracer->data->opaque_triangles);
    if (FV_FEATURES & FV_SCENE_MOVING) of &= h->object == 0;
    if (FV_FIELDS) of &= h->part < 0;
    return vi_select(of, h->triangle, vi_of(-1));
}

/* What the rays meet of the planes of the triangles that samples i and on are known to show; by tracing where they run
 * along these. */
static inline struct packet_hit known_hit(const struct shading *shading, const struct fv_samples *samples, int i,
                                          const struct rays *r)
{
    const struct fv_scene *scene = shading->tracer->data;
    vi triangle = vi_load(samples->triangle + i) & r->mask;
    vf3 corner[3];
    for (int k = 0; k < 3; k++) {
        vi at = 3 * vi_gather(scene->index, 3 * triangle + k);
        corner[k] = (vf3){vf_gather(scene->position, at), vf_gather(scene->position, at + 1), vf_gather(scene->position, at + 2)};
    }
    vf3 ab = vf3_sub(corner[1], corner[0]), ac = vf3_sub(corner[2], corner[0]);
    vf3 normal = vf3_cross(ab, ac);
    vf t = vf_dot(normal, vf3_sub(corner[0], r->origin)) / vf_dot(normal, r->direction);
    vf3 from = vf3_sub(vf3_add(r->origin, vf3_scale(r->direction, t)), corner[0]);
    vf area = 1.0f / vf_dot(normal, normal);
    vf u = vf_dot(vf3_cross(from, ac), normal) * area, v = vf_dot(vf3_cross(ab, from), normal) * area;
    vi near = r->mask & (t > 0.0f) & (vf_abs(u) < 8.0f) & (vf_abs(v) < 8.0f);
    struct packet_hit h = {.hit = near, .triangle = triangle, .object = vi_of(0), .part = vi_of(-1), .t = t, .u = u,
                           .v = v, .normal = normal};
    struct rays other = *r;
    other.mask &= ~near;
    if (!vi_any(other.mask)) return h;
    struct packet_hit met = meet(shading, &other, NULL);
    h.hit |= met.hit;
    h.triangle = vi_select(near, triangle, met.triangle);
    if (FV_FEATURES & FV_SCENE_MOVING) h.object = vi_select(near, h.object, met.object);
    if (FV_FIELDS) h.part = vi_select(near, h.part, met.part);
    h.t = vf_select(near, t, met.t);
    h.u = vf_select(near, u, met.u);
    h.v = vf_select(near, v, met.v);
    h.normal = vf3_select(near, normal, met.normal);
    return h;
}

/* The packet from sample i on, and what it met. */
static inline void trace_packet(struct shading *shading, const struct list *list, int i, const struct rays *r,
                                const struct packet_hit *met)
{
    const struct fv_tracer *tracer = shading->tracer;
    struct fv_samples *samples = list->samples;
    struct parted parted = {0};
    struct identified identified = {.identity = vi_of(0)};
    struct seen seen;
    shading->identified = samples->identified ? &identified : NULL;
    shading->at = i;
    if (samples->identified) identified.triangle = opaque_triangles(tracer, met);
    if (samples->known) shading->lit = vi_load(samples->lit + i);
    if (list->sampled) randomise(shading, vf_load(samples->x + i), vf_load(samples->y + i), list->seed);
    if (list->sampled && samples->numbered) randomise_further(shading, vi_load(samples->number + i));
    look_at(shading, r, met, tracer->depth, list->split ? &parted : NULL, &seen);
    vi known = sound(seen.radiance);
    if (list->split) known &= sound(parted.light);
    store_samples(samples, i, &seen, known, list->axis, tracer->epsilon_grazing);
    if (list->split) store_parted(samples, i, &parted, known);
    if (samples->identified) store_identified(samples, i, &identified);
    if (FV_FIELDS && samples->started) vi_store(samples->part + i, vi_select(met->hit, met->part, vi_of(-1)));
}

/* As many packets as one has lanes. */
struct group {
    int count, at[FV_WIDTH]; /* their first samples */
    struct rays rays[FV_WIDTH];
    struct packet_hit met[FV_WIDTH];
};

/* All at once: what they met first, then what shades it. */
static void trace_group(const struct shading *of, const struct list *list, struct group *g)
{
    struct field_shade shade;
    struct shading shading = *of;
    struct field_beams beams;
    struct field_balls balls;
    struct field_kept all;
    struct field_few few;
    shading.shade = &shade;
    for (int k = 0; k < g->count; k++) {
        const struct rays *r = &g->rays[k];
        field_beam(&beams, k, r->direction, vf_load(r->start), r->mask);
    }
    field_find_beams(shading.tracer, &beams, g->count, g->rays[0].origin, &all);
    for (int k = 0; k < g->count; k++) {
        field_few_of(all.at, all.count, k, 0, &few);
        g->met[k] = meet(&shading, &g->rays[k], &few);
        field_ball(&balls, k, &g->met[k], g->rays[k].origin, g->rays[k].direction);
    }
    field_shade_find(shading.tracer, &balls, g->count, shading.rays, &shade);
    for (shading.packet = 0; shading.packet < g->count; shading.packet++)
        trace_packet(&shading, list, g->at[shading.packet], &g->rays[shading.packet], &g->met[shading.packet]);
    g->count = 0;
}

/* Rays whose starts tell that they meet nothing. */
static inline void store_sky(const struct shading *shading, const struct list *list, int i)
{
    vf3 zero = {vf_of(0), vf_of(0), vf_of(0)};
    struct parted parted = {0};
    struct seen seen = {vf3_of(shading->tracer->data->sky), vf_of(__builtin_inff()), vi_of(0), zero};
    store_samples(list->samples, i, &seen, sound(seen.radiance), list->axis, 0);
    if (list->split) store_parted(list->samples, i, &parted, vi_of(-1));
}

static void trace_started(const struct shading *shading, const struct fv_view *view, const struct list *list)
{
    const struct fv_samples *samples = list->samples;
    bool meshes = FV_MESHES && shading->tracer->data->triangles > 0;
    struct group group;
    group.count = 0;
    for (int i = 0; i < samples->count; i += FV_WIDTH) {
        vi begin = (vf_load(samples->start + i) < __builtin_inff()) & (vi_lanes() < samples->count - i);
        if (!meshes && !vi_any(begin)) {
            store_sky(shading, list, i);
            continue;
        }
        group.rays[group.count] = rays_of(view, samples, i);
        group.at[group.count++] = i;
        if (group.count == FV_WIDTH) trace_group(shading, list, &group);
    }
    if (group.count > 0) trace_group(shading, list, &group);
}

void trace_samples(const struct fv_tracer *tracer, const struct fv_view *view, struct fv_samples *samples,
                   uint32_t seed, int64_t *rays)
{
    struct shading shading = {.tracer = tracer, .rays = rays, .fewer = samples->fewer, .known = samples->known,
                              .samples = samples, .seed = seed};
    if (samples->mapped && tracer->visibility) shading.maps = tracer->visibility->map;
    int64_t counted = rays[FV_RAY_PRIMARY] + (samples->known ? 0 : samples->count);
    bool sampled = (tracer->data->features & FV_FEATURES & FV_SCENE_STOCHASTIC) != 0;
    struct list list = {samples, seed, sampled, FV_PATHS || (sampled && samples->split), axis_of(view)};
    if (FV_FIELDS && samples->started && tracer->data->fields.parts > 0) {
        trace_started(&shading, view, &list);
    } else {
        for (int i = 0; i < samples->count; i += FV_WIDTH) {
            struct rays r = rays_of(view, samples, i);
            struct packet_hit met = samples->known ? known_hit(&shading, samples, i, &r) : meet(&shading, &r, NULL);
            trace_packet(&shading, &list, i, &r, &met);
        }
    }
    rays[FV_RAY_PRIMARY] = counted;
}
