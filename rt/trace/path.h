/* path: what light reaches a packet's surfaces by paths of a few bounces, a Monte Carlo estimate (Kajiya 1986; next
 * event estimation as in Peres et al. 2023, section 3.3). For kernels only; the samples' `paths` say how many paths
 * each takes.
 *
 * At each surface of a path one light is drawn, by what it would send there if nothing were in the way, and one
 * shadow ray goes to a place of it. At the first surface, where there are no more lights than the pixel has paths,
 * these share them out instead: one ray goes to each point and sun, which tells all, and the others to area lights,
 * so that choosing adds no noise. Then the path goes on in a direction drawn by the cosine. What is returned is
 * irradiance / pi, without the first surface's albedo, so that light and albedo stay apart for the filter. Where the
 * first surface has a lobe (ggx.h, or Phong's: denoise.specular), light is (diffuse E + specular S) / (diffuse +
 * specular), E by the cosine and S by the lobe, and albedo diffuse + specular: their product is what leaves it. Later surfaces are matt, of all that they
 * reflect, mirrors and glass among them; what the first one mirrors or lets through is Whitted's (trace_kernel.c).
 *
 * Where a path leaves the scene it takes the sky's radiance, where it meets what shines that one's, but not behind
 * the front of an area light, nor of what lies at a light that stands for it (path_lights.h), and is drawn. The last surface takes the scene's ambient light, which stands for all bounces that are not followed.
 * From the second bounce on paths end by chance, less likely the brighter they are (roulette), the others counting
 * for them.
 *
 * Random numbers: of the first surface blue noise over pixels, shifted by rank-1 sequences over frames (powers of 1 /
 * g, g^6 = g + 1: Roberts 2018), in cells that a pixel's paths share out among them, the same for all lanes, which
 * keeps packets together; of later ones Sobol's points with hashed Owen scrambling (Burley 2020), padded two by two. */
#ifndef FV_TRACE_PATH_H
#define FV_TRACE_PATH_H

#include "rt/trace/path_first.h"

enum { PATH_NUMBERS = 5, PATH_SHARED = 16 };
enum path_number { PATH_ACROSS, PATH_ALONG, PATH_LIGHT, PATH_PLACE_U, PATH_PLACE_V };

/* A packet's paths. */
struct path {
    const struct shading *shading;
    vf number[PATH_NUMBERS]; /* of the first surface, this frame's, in [0, 1) */
    vu pixel;                /* hashed */
    uint32_t frame;
    int bounces;
    /* Lights of all, where they are no more than PATH_SHARED: points and suns, and behind them area lights. */
    int lights, points, order[PATH_SHARED];
};

static inline vf fraction(vf a)
{
    return a - vf_floor(a);
}

/* ---- random numbers ---- */

static inline vu hashed(vu x)
{
    x ^= x >> 16;
    x *= 0x7feb352du;
    x ^= x >> 15;
    x *= 0x846ca68bu;
    return x ^ x >> 16;
}

static inline vu turned(vu x)
{
    x = (x >> 1 & 0x55555555u) | (x & 0x55555555u) << 1;
    x = (x >> 2 & 0x33333333u) | (x & 0x33333333u) << 2;
    x = (x >> 4 & 0x0f0f0f0fu) | (x & 0x0f0f0f0fu) << 4;
    x = (x >> 8 & 0x00ff00ffu) | (x & 0x00ff00ffu) << 8;
    return x >> 16 | x << 16;
}

/* Owen's scrambling of turned bits (Laine and Karras 2011, as Burley 2020 has it: by Vegdahl's constants). */
static inline vu scrambled(vu x, vu seed)
{
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= (seed >> 16) | 1u;
    x ^= x * 0x05526c56u;
    return x ^ x * 0x53a22864u;
}

static inline vf unit_of(vu x)
{
    return vf_from((vi)(x >> 8)) * 0x1p-24f;
}

/* Two numbers of path `n` of a pixel, of those of this seed. */
static inline void draw(vu seed, uint32_t n, vf *a, vf *b)
{
    vu index = turned(scrambled(turned(n - (vu){0}), seed)), second = index;
    second ^= second >> 1 & 0x55555555u;
    second ^= second >> 2 & 0x33333333u;
    second ^= second >> 4 & 0x0f0f0f0fu;
    second ^= second >> 8 & 0x00ff00ffu;
    second ^= second >> 16;
    *a = unit_of(turned(scrambled(index, hashed(seed + 1u))));
    *b = unit_of(turned(scrambled(second, hashed(seed + 2u))));
}

/* Of the first surface: the mask at five places, and how far it is shifted in this frame. */
static inline void path_begin(struct path *p, const float *noise, vf x, vf y, uint32_t frame)
{
    static const uint32_t step[PATH_NUMBERS] = {3785032107u, 3335640777u, 2939605023u, 2590590015u, 2283013049u};
    static const int at[PATH_NUMBERS][2] = {{0, 0}, {41, 23}, {17, 53}, {29, 11}, {5, 37}};
    vi column = vi_from(x), row = vi_from(y);
    int mask = FV_NOISE_SIZE - 1;
    for (int i = 0; i < PATH_NUMBERS; i++) {
        float shift = (float)(frame * step[i] >> 8) * 0x1p-24f;
        vi place = ((row + at[i][1]) & mask) * FV_NOISE_SIZE + ((column + at[i][0]) & mask);
        p->number[i] = fraction(vf_gather(noise, place) + shift);
    }
    p->pixel = hashed((vu)column * 0x9e3779b1u + (vu)row * 0x85ebca77u + 1u);
    p->frame = frame;
}

static inline void path_lights(struct path *p, const struct fv_tracer *tracer)
{
    p->lights = tracer->data->lights;
    if (p->lights > PATH_SHARED) return;
    int n = 0;
    for (int area = 0; area < 2; area++) {
        for (int i = 0; i < p->lights; i++)
            if ((tracer->light[i].kind == FV_LIGHT_AREA) == area) p->order[n++] = i;
        if (!area) p->points = n;
    }
}

/* ---- paths ---- */

static inline void add_lanes(vf3 *sum, vi mask, vf3 add)
{
    *sum = vf3_add(*sum, vf3_select(mask, add, (vf3){vf_of(0), vf_of(0), vf_of(0)}));
}

/* All that a later surface reflects, as if it were matt. */
static inline vf3 reflectance(const struct surface *s)
{
    vf3 sum = vf3_add(vf3_add(s->diffuse, s->specular), vf3_add(s->mirror, s->transmission));
    return (vf3){vf_clamp(sum.x, 0, 1), vf_clamp(sum.y, 0, 1), vf_clamp(sum.z, 0, 1)};
}

/* Ends some of the paths; the rest weigh as much more. */
static inline vi roulette(vf3 *weight, vf random, vi mask)
{
    vf stays = vf_clamp(vf_max(vf_max(weight->x, weight->y), weight->z), 0.05f, 1);
    *weight = vf3_scale(*weight, 1.0f / stays);
    return mask & (random < stays);
}

static inline vf3 ambient_at(const struct fv_scene *scene, const struct surface *s)
{
    return vf3_scale(vf3_of(scene->ambient), 0.8f + 0.2f * s->normal.y);
}

/* What light path n brings to where it leaves `from` by `way`. */
static __attribute__((noinline)) vf3 follow_path(const struct path *p, const struct surface *from, vf3 way, vf3 weight, vi mask,
                                                 uint32_t n)
{
    const struct fv_scene *scene = p->shading->tracer->data;
    vf3 light = {vf_of(0), vf_of(0), vf_of(0)};
    struct surface s;
    struct lit lit = {.shading = p->shading, .surface = &s};
    struct rays rays = {.origin = vf3_add(from->point, vf3_scale(from->geometric, from->offset)), .direction = way,
                        .base = from->footprint, .growth = vf_of(0.2f)};
    for (int depth = 1;; depth++) {
        if (!vi_any(mask)) return light;
        rays.mask = mask;
        p->shading->rays[FV_RAY_SECONDARY] += __builtin_popcount(vi_bits(mask));
        struct packet_hit hit = meet(p->shading, &rays, NULL);
        vi behind = vi_of(0);
        if (FV_FEATURES & FV_SCENE_AREA_LIGHTS)
            behind = behind_lights(p->shading->tracer, rays.origin, rays.direction, vf_select(hit.hit, hit.t, vf_of(__builtin_inff())));
        add_lanes(&light, mask & ~hit.hit & ~behind, product(weight, vf3_of(scene->sky)));
        mask &= hit.hit;
        if (!vi_any(mask)) return light;
        surface_set(&s, p->shading->tracer, &hit, rays.origin, rays.direction, rays.base, rays.growth);
        surface_fetch(&s, scene);
        if (s.any & FV_FEATURES & FV_MATERIAL_EMISSIVE)
            add_lanes(&light, mask & ~(behind | near_lights(p->shading->tracer, s.point, s.emission)), product(weight, s.emission));
        weight = product(weight, reflectance(&s));
        vu seed = hashed(p->pixel + (uint32_t)depth * 0x632be5abu);
        vf which, stay, a, b, times;
        lit.start = vf3_add(s.point, vf3_scale(s.geometric, s.offset));
        draw(seed, n, &which, &stay);
        draw(hashed(seed ^ 0x68bc21ebu), n, &a, &b);
        vi chosen = choose_light(&lit, which, &times);
        add_lanes(&light, mask, product(weight, light_of_one(&lit, chosen, times, a, b, mask, false, NULL)));
        if (depth >= p->bounces) {
            add_lanes(&light, mask, product(weight, ambient_at(scene, &s)));
            return light;
        }
        mask = roulette(&weight, stay, mask);
        draw(hashed(seed ^ 0x02e5be93u), n, &a, &b);
        rays.origin = lit.start;
        rays.direction = matt_way(&s, a, b);
        rays.base = s.footprint;
    }
}

/* Whether lights are few enough for n paths to share them out: point lights and suns then take a ray each, which tells all. */
static inline bool shared_out(const struct path *p, int n)
{
    return p->lights <= n && p->lights <= PATH_SHARED;
}

/* One light's share of what leaves the first surface by both of its lobes (struct parted). */
static inline vf3 by_lobes(const struct lit *lit, const struct first *f, vi chosen, vf times, vf a, vf b, vi mask)
{
    vf3 gloss, light = light_of_one(lit, chosen, times, a, b, mask, true, f->glossy ? &gloss : NULL);
    return f->glossy ? vf3_add(light, product(f->lobe, vf3_sub(gloss, light))) : light;
}

/* Of points and suns that are shared out: chance has no part in it. */
static inline vf3 steady_light(const struct path *p, const struct lit *lit, const struct first *f, vi mask)
{
    vf3 light = {vf_of(0), vf_of(0), vf_of(0)};
    for (int i = 0; i < p->points; i++) light = vf3_add(light, by_lobes(lit, f, vi_of(p->order[i]), vf_of(1), vf_of(0), vf_of(0), mask));
    return light;
}

/* What path i of n adds of light that reaches the first surface at once; false: nothing, as its share is a light that is steady. */
static inline bool drawn_light(const struct path *p, const struct lit *lit, const struct first *f, int i, int n, vi mask, vf3 *light)
{
    /* Places are not shared out as lights are: each light would get its own part of every other. */
    vf a = fraction(p->number[PATH_PLACE_U] + (float)i * 0.754877666f), b = fraction(p->number[PATH_PLACE_V] + (float)i * 0.569840291f);
    vf times = vf_of((float)n);
    vi chosen;
    if (shared_out(p, n)) {
        int areas = p->lights - p->points, rest = n - p->points, k = i - p->points;
        if (k < 0 || areas == 0) return false;
        chosen = vi_of(p->order[p->points + k % areas]);
        times = times / (float)(rest / areas + (k % areas < rest % areas));
    } else {
        chosen = choose_light(lit, (p->number[PATH_LIGHT] + (float)i) * (1 / (float)n), &times);
    }
    *light = by_lobes(lit, f, chosen, times, a, b, mask);
    return true;
}

static inline vf luma_of(vf3 light)
{
    return 0.25f * (light.x + light.z) + 0.5f * light.y;
}

/* What drawn numbers tell of how much their mean varies. */
struct spread {
    vf sum, squares;
    int count;
};

static inline void spread_add(struct spread *s, vf number)
{
    s->sum += number;
    s->squares += number * number;
    s->count++;
}

/* Of a single one nothing is known: its square. */
static inline vf spread_of_mean(const struct spread *s)
{
    float n = (float)s->count;
    if (s->count < 2) return s->squares;
    return vf_max(s->squares - s->sum * s->sum * (1 / n), vf_of(0)) * (1 / (n * (n - 1)));
}

/* How the drawn parts of a pixel's light vary: what reaches its surface at once, and by paths. */
struct spreads {
    struct spread direct, bounced;
};

/* Light of path i of n, in the lanes of mask. */
static inline vf3 light_of_path(const struct path *p, const struct lit *lit, const struct first *f, int i, int n, vi mask, struct spreads *of)
{
    const struct fv_scene *scene = p->shading->tracer->data;
    const struct surface *s = lit->surface;
    vf3 weight, light = {vf_of(0), vf_of(0), vf_of(0)};
    vf a, b;
    /* Where lights are shared out, only some paths go to those that are drawn, and count for all. */
    float counts = shared_out(p, n) ? (float)(n - p->points) / (float)n : 1;
    if (drawn_light(p, lit, f, i, n, mask, &light)) spread_add(&of->direct, vf_min(luma_of(light) * counts, vf_of(FV_RADIANCE_MAX)));
    if (p->bounces == 0) return vf3_add(light, ambient_at(scene, s));
    place_in(p->number[PATH_ACROSS], p->number[PATH_ALONG], i, n, &a, &b);
    vf3 way = first_way(lit, f, a, b, &weight, &mask);
    vf3 bounced = follow_path(p, s, way, weight, mask, p->frame * (uint32_t)n + (uint32_t)i);
    spread_add(&of->bounced, vf_min(luma_of(bounced), vf_of(FV_RADIANCE_MAX)));
    return vf3_add(light, bounced);
}

static inline vf3 sound_light(vf3 light)
{
    return (vf3){vf_clamp(light.x, 0, FV_RADIANCE_MAX), vf_clamp(light.y, 0, FV_RADIANCE_MAX), vf_clamp(light.z, 0, FV_RADIANCE_MAX)};
}

/* The mean of each lane's paths, into parted->light; what is steady of it is returned instead where it is to be kept apart, and there
 * also of lanes that want -n paths: none, but as if they took n. What overflows counts as FV_RADIANCE_MAX, what is no number as 0. In
 * parted->variance how much its brightness varies, paths being taken for independent. */
static vf3 path_light(struct path *p, const struct lit *lit, const struct first *f, vi wanted, bool apart, struct parted *parted)
{
    vf3 zero = {vf_of(0), vf_of(0), vf_of(0)}, steady = zero;
    vi some = wanted >= p->lights;
    if (apart) some |= wanted <= -p->lights;
    some &= lit->surface->hit & (wanted != 0);
    if (p->lights <= PATH_SHARED && p->points > 0 && vi_any(some)) steady = sound_light(steady_light(p, lit, f, some));
    parted->light = apart ? zero : steady;
    parted->variance = vf_of(0);
    for (vi left = lit->surface->hit & (wanted > 0); vi_any(left);) {
        int n = wanted[__builtin_ctz(vi_bits(left))];
        vi mask = left & (wanted == n);
        vf3 sum = zero;
        struct spreads of = {{vf_of(0), vf_of(0), 0}, {vf_of(0), vf_of(0), 0}};
        left &= ~mask;
        for (int i = 0; i < n; i++) {
            vf3 light = light_of_path(p, lit, f, i, n, mask, &of);
            sum = vf3_add(sum, vf3_scale(sound_light(light), vf_of(1 / (float)n)));
        }
        parted->light = vf3_select(mask, vf3_add(parted->light, sum), parted->light);
        parted->variance = vf_select(mask, spread_of_mean(&of.direct) + spread_of_mean(&of.bounced), parted->variance);
    }
    return steady;
}

/* In the place of light_surface for what primary rays hit: emission is returned, albedo and light are kept apart. */
static vf3 path_surface(const struct shading *shading, struct surface *s, vf3 direction, struct parted *parted)
{
    const struct fv_samples *samples = shading->samples;
    struct path p = {.shading = shading, .bounces = samples->bounces};
    struct lit lit = {.shading = shading, .surface = s};
    struct first first = {.glossy = false};
    vf3 zero = {vf_of(0), vf_of(0), vf_of(0)}, albedo;
    surface_fetch(s, shading->tracer->data);
    path_begin(&p, samples->noise, vf_load(samples->x + shading->at), vf_load(samples->y + shading->at), shading->seed);
    path_lights(&p, shading->tracer);
    lit.start = vf3_add(s->point, vf3_scale(s->geometric, s->offset));
    albedo = s->diffuse;
    if (s->any & FV_FEATURES & FV_MATERIAL_SPECULAR) {
        lit.view = vf3_normalise(vf3_scale(direction, vf_of(-1)), s->normal);
        if (!shading->tracer->phong) lit.view = ggx_view(s->normal, lit.view);
        first_set(&first, &lit);
        albedo = vf3_add(albedo, s->specular);
    }
    vf3 steady = path_light(&p, &lit, &first, vi_load(samples->paths + shading->at), samples->apart, parted);
    parted->albedo = vf3_select(s->hit, (vf3){vf_clamp(albedo.x, 0, 1), vf_clamp(albedo.y, 0, 1), vf_clamp(albedo.z, 0, 1)}, zero);
    if (samples->apart) s->emission = vf3_add(s->emission, product(parted->albedo, steady));
    return vf3_select(s->hit, s->emission, zero);
}

#endif
