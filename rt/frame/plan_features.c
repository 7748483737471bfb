/* plan_features: see plan_features.h. */
#include "rt/frame/plan_features.h"

#include "rt/frame/plan_buffers.h"

#include <string.h>

/* Lower levels of the pyramid are carried over where they are not traced in every frame: as the settings say, or where
 * levels of quality do. */
static void choose_carry(struct fv_plan *p, const struct fv_scene *s, const struct fv_config *config,
                         const struct fv_frame *f)
{
    bool can = p->buffers & FV_BIT(FV_HISTORY_STARTS), adapts = strcmp(config->budget_adapt, "on") == 0;
    const char *why = !can                                           ? "no pass carries levels over"
                      : strcmp(config->method_carry, "on") != 0      ? "method.carry is off: they stay as they were"
                      : s->fields.parts == 0                         ? "scene.fields is empty: no starts tell where they were"
                      : s->triangles > 0                             ? "the scene has triangles, which starts do not know: all is traced"
                      : strcmp(config->method_foveation, "on") != 0 && !adapts ? "method.foveation is off: there are none"
                      : config->method_refresh == 1 && !adapts       ? "method.refresh is 1: all is traced"
                                                                     : NULL;
    uint64_t carried = config->method_contrast < 1 ? FV_CARRIED : FV_CARRIED & ~FV_BIT(FV_HISTORY_COLOUR);
    int64_t bytes = 0;
    for (int b = 0; b < FV_BUFFERS; b++)
        if (carried & FV_BIT(b)) bytes += f->eyes * fv_plan_buffer_bytes(f, (enum fv_buffer)b);
    p->carry = !why;
    if (can) p->buffers &= ~(why ? FV_CARRIED : FV_CARRIED & ~carried);
    fv_plan_add(p, "feature", "carried levels", p->carry, can ? bytes : 0, "%s",
                why ? why : "the pyramid's lower levels are traced in turns: beside them the last frame's");
}

/* Where pixels of the pyramid's lower levels differ by checks only, these are painted anew. */
static void choose_repainting(struct fv_plan *p, const struct fv_scene *s, const struct fv_config *config,
                              const struct fv_frame *f)
{
    bool can = p->buffers & FV_SEEN, checks = false;
    for (int i = 0; i < s->fields.parts; i++) checks |= s->fields.part[i].checker_size > 0;
    const char *why = !can                           ? "no pass paints checks anew"
                      : !checks                      ? "the scene's fields have no checks"
                      : strcmp(config->display_lens, "none") != 0 ? "the lens bends what lies between pixels"
                      : config->method_contrast >= 1 ? "method.contrast is 1: nothing between pixels is looked at"
                                                     : NULL;
    int64_t bytes = f->eyes * (fv_plan_buffer_bytes(f, FV_COARSE_SEEN) + fv_plan_buffer_bytes(f, FV_COARSEST_SEEN));
    if (why) p->buffers &= ~FV_SEEN;
    fv_plan_add(p, "feature", "repainted checks", !why, can ? bytes : 0, "%s",
                why ? why : "between pixels of the pyramid's lower levels that differ by checks only");
}

/* Frames before the last, where pictures are smoothed over more than that one. */
static void choose_pasts(struct fv_plan *p, const struct fv_config *config, const struct fv_frame *f)
{
    bool can = p->buffers & FV_BIT(FV_SMOOTHED), kept = can && config->selective_smooth > 1;
    int64_t one = 2 * f->eyes * fv_plan_buffer_bytes(f, FV_EARLIER_COLOUR);
    p->pasts = can ? (int)config->selective_smooth : 0;
    if (!kept) p->buffers &= ~FV_PLAN_EARLIER;
    fv_plan_add(p, "feature", "earlier frames", kept, kept ? (p->pasts - 1) * one : can ? one : 0, "%s",
                !can   ? "no pass smooths over them"
                : kept ? "selective.smooth is above 1: colours and caches of those before the last, which change places with it"
                       : "selective.smooth is 1: over the last one, which is history");
}

static void drop(struct fv_plan *p, uint64_t bits, bool kept)
{
    if (!kept) p->buffers &= ~bits;
}

/* Attributes of second hits only where surfaces have such; of triangles and their light only where something is made of
 * it: where lights are few, and the scene has more than fields. */
static void choose_attributes(struct fv_plan *p, const struct fv_scene *s, const struct fv_config *config, const struct fv_frame *f)
{
    const uint64_t second = FV_BIT(FV_SECOND_IDENTITY) | FV_BIT(FV_SECOND_FACING) | FV_BIT(FV_HISTORY_SECOND_IDENTITY) |
                            FV_BIT(FV_HISTORY_SECOND_FACING),
                   known = FV_BIT(FV_TRIANGLE) | FV_BIT(FV_LIT);
    bool can = p->buffers & second, has = s->features & (FV_SCENE_MIRRORS | FV_SCENE_GLASS);
    const char *why = !can                                               ? "no pass tells pixels apart by them"
                      : strcmp(config->selective_texture, "fetch") != 0 ? "selective.texture is trace: by rays"
                      : s->lights > 32                                   ? "more than 32 lights: samples are traced"
                      : s->opaque_triangles == 0                         ? "there are no opaque triangles that stand still"
                                                                         : NULL;
    drop(p, second, has);
    drop(p, known, !why);
    fv_plan_add(p, "feature", "secondary attributes", can && has, 2 * f->eyes * fv_plan_buffer_bytes(f, FV_SECOND_IDENTITY), "%s",
                !can ? "no pass tells pixels apart by them" : has ? "materials mirror or are transparent" : "no material is a mirror or transparent");
    fv_plan_add(p, "feature", "samples without rays", !why, 2 * f->eyes * fv_plan_buffer_bytes(f, FV_TRIANGLE), "%s",
                why ? why : "selective.texture is fetch: where pixels differ in texture alone, on the triangles that they show");
}

static void choose_light(struct fv_plan *p, const struct fv_scene *s, const struct fv_config *config,
                         const struct fv_frame *f)
{
    bool sampled = s->features & FV_SCENE_STOCHASTIC, asked = strcmp(config->method_light, "apart") == 0;
    bool refined = p->buffers & FV_BIT(FV_BASE), apart = p->history && sampled && asked && !refined;
    int64_t bytes = 0;
    for (int b = 0; b < FV_BUFFERS; b++)
        if (FV_PLAN_COLOURS & p->buffers & FV_BIT(b)) bytes += f->eyes * (FV_PLANES - 1) * fv_plan_buffer_bytes(f, (enum fv_buffer)b);
    p->planes = apart ? FV_PLANES : 1;
    fv_plan_add(p, "feature", "light kept apart", apart, p->history ? bytes : 0, "%s",
                !p->history ? "the method keeps no history"
                : refined   ? "pixels are put together from several samples' whole colours"
                : !sampled  ? "no light is sampled"
                : apart     ? "method.light is apart: albedo and light beside each colour"
                            : "method.light is whole");
}

/* Shadows in the periphery by maps, of the lights that can have one. */
static void choose_maps(struct fv_plan *p, const struct fv_scene *s, const struct fv_config *config)
{
    int side = (int)config->selective_map, maps = 0, lights = 0;
    for (int i = 0; i < s->lights; i++) {
        lights += s->light[i].kind != FV_LIGHT_AREA;
        maps += fv_light_mappable(s, i);
    }
    const char *why = !(p->needs & FV_NEEDS_MAPS) ? "no pass takes shadows from them"
                      : side == 0                 ? "selective.map is 0: shadow rays everywhere"
                      : lights == 0               ? "no point light and no sun"
                      : s->fields.parts > 0       ? "the scene has fields, which maps do not hold: shadow rays"
                      : maps == 0 ? "points and suns move, are far off or have nothing that stands still around them: "
                                    "shadow rays"
                                                  : NULL;
    p->map_side = why ? 0 : side;
    if (why) fv_plan_add(p, "feature", "light maps", false, fv_visibility_bytes(s, side), "%s", why);
    else
        fv_plan_add(p, "feature", "light maps", true, fv_visibility_bytes(s, side),
                    "of %d of %d points and suns, %d texels a side: shadows in the periphery without rays, but where a map is too coarse%s", maps,
                    lights, side, maps < lights ? "; rays to the rest" : "");
}

/* How much paths vary, where the filter is guided by that. */
static void choose_variance(struct fv_plan *p, const struct fv_config *config, const struct fv_frame *f)
{
    bool can = p->buffers & FV_BIT(FV_FILTERED_VARIANCE), kept = can && config->denoise_deviations > 0;
    drop(p, FV_BIT(FV_VARIANCE) | FV_BIT(FV_FILTERED_VARIANCE), kept);
    fv_plan_add(p, "feature", "variance of light", kept, can ? 2 * f->eyes * fv_plan_buffer_bytes(f, FV_VARIANCE) : 0, "%s",
                !can   ? "no pass filters by it"
                : kept ? "denoise.deviations: by how much paths vary, the filter tells noise from edges"
                       : "denoise.deviations is 0: the filter goes by denoise.sigma_light");
}

void fv_plan_choose_features(struct fv_plan *p, const struct fv_scene *s, const struct fv_config *config, const struct fv_frame *f)
{
    choose_carry(p, s, config, f);
    choose_attributes(p, s, config, f);
    choose_repainting(p, s, config, f);
    choose_pasts(p, config, f);
    choose_light(p, s, config, f);
    choose_maps(p, s, config);
    choose_variance(p, config, f);
}
