/* plan: what is needed and what is left out, each with its reason; of the methods' own features plan_features.c decides. */
#include "rt/frame/plan.h"

#include "platform/arena.h"
#include "platform/threads.h"
#include "rt/frame/optics.h"
#include "rt/frame/plan_buffers.h"
#include "rt/frame/plan_features.h"
#include "rt/pass/fringe.h"
#include "rt/pass/turn.h"

#include <assert.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

void fv_plan_add(struct fv_plan *p, const char *kind, const char *what, bool kept, int64_t bytes,
                 const char *reason, ...)
{
    assert(p->rows < FV_PLAN_ROWS_MAX);
    if (p->rows == FV_PLAN_ROWS_MAX) return;
    struct fv_plan_row *r = &p->row[p->rows++];
    va_list arguments;
    va_start(arguments, reason);
    vsnprintf(r->reason, sizeof r->reason, reason, arguments);
    va_end(arguments);
    snprintf(r->what, sizeof r->what, "%s", what);
    snprintf(r->kind, sizeof r->kind, "%s", kind);
    r->kept = kept;
    r->bytes = bytes;
}

void fv_frame_size(struct fv_frame *f, const struct fv_config *config)
{
    f->eyes = (int)config->display_eyes;
    f->width = (int)config->display_width;
    f->height = (int)config->display_height;
    f->tiles_x = (f->width + FV_TILE - 1) / FV_TILE;
    f->tiles_y = (f->height + FV_TILE - 1) / FV_TILE;
    f->tiles = f->eyes * f->tiles_x * f->tiles_y;
    f->stride = (int64_t)f->tiles_x * FV_TILE;
    f->rows = (int64_t)f->tiles_y * FV_TILE;
    f->spacing = (int)config->method_support;
}

/* Pixels whose red and blue are seen elsewhere than their green, by the lens. */
static void choose_fringe(struct fv_plan *p, const struct fv_config *config)
{
    struct fv_lens lens;
    struct fv_bend bend;
    fv_optics_lens(config, 0, &lens, &bend);
    p->fringes = p->present && bend.fringes;
    if (p->fringes) p->buffers |= FV_BIT(FV_GREEN);
    fv_plan_add(p, "pass", "fringe", p->fringes, p->fringes ? (int64_t)sizeof(struct fv_fringe) : 0, "%s",
                p->fringes           ? "display.lens_red, lens_blue: red and blue by shifted lookups, of green's picture"
                : !bend.on      ? "display.lens is none: no colour parts"
                : !bend.fringes ? "display.lens_red and lens_blue are as green"
                                     : "nobody takes pictures");
}

/* Pictures that miss their flips, where frames have flips to miss. A lens whose colours part keeps what is turned anyway. */
static void choose_turn(struct fv_plan *p, const struct fv_config *config)
{
    bool rotates = strcmp(config->display_late, "rotate") == 0, paced = strcmp(config->budget_pace, "vsync") == 0;
    p->turns = p->present && rotates && paced;
    if (p->turns && !p->fringes) p->buffers |= FV_BIT(FV_TURNED);
    fv_plan_add(p, "pass", "turn", p->turns, p->turns ? (int64_t)sizeof(struct fv_turn) : 0, "%s",
                p->turns      ? "display.late is rotate: what missed its flip is turned to the newest head"
                : !p->present ? "nobody takes pictures"
                : !paced      ? "budget.pace is free: no frame has a flip to miss"
                              : "display.late is hold: what is late is shown as it is");
}

/* The lens, and what of the picture no eye sees through it. */
static void choose_lens(struct fv_plan *p, const struct fv_config *config, const struct fv_frame *f)
{
    int64_t unseen = 0, pixels = (int64_t)f->eyes * f->width * f->height;
    struct fv_lens lens;
    struct fv_bend bend = {.on = false};
    for (int e = 0; e < f->eyes; e++) {
        fv_optics_lens(config, e, &lens, &bend);
        unseen += fv_optics_unseen(&lens, &bend);
    }
    const struct fv_bend *b = &bend;
    if (b->on) fv_plan_add(p, "feature", "lens", true, 0, "display.lens is radial: rays go straight through it, no warp pass; k %g %g %g", (double)b->k[0], (double)b->k[1], (double)b->k[2]);
    else fv_plan_add(p, "feature", "lens", false, 0, "display.lens is none: rays are a pinhole's");
    if (unseen > 0)
        fv_plan_add(p, "feature", "unseen pixels", false, 0, "%lld of %lld, %.1f %%: beyond r = %.4f no eye sees them; none is traced but in 4 x 4 blocks at the rim",
                    (long long)unseen, (long long)pixels, 100 * (double)unseen / (double)pixels, (double)b->shown);
}

/* Passes that a frame runs: the method's and, where a sink takes pictures, present. */
static void choose_passes(struct fv_plan *p, const struct fv_config *config)
{
    uint64_t read = 0;
    for (const struct fv_pass *const *list = fv_method_passes(p->method, config); *list; list++) {
        const struct fv_pass *pass = *list;
        const char *why = pass->idle ? pass->idle(config) : NULL;
        if (why) {
            fv_plan_add(p, "pass", pass->name, false, 0, "%s", why);
            continue;
        }
        p->pass[p->passes++] = pass;
        p->buffers |= pass->reads | pass->writes;
        p->needs |= pass->needs;
        read |= pass->reads;
        fv_plan_add(p, "pass", pass->name, true, 0, "a step of method %s", p->method->name);
    }
    /* Nobody asks what nodes were where all are traced in every frame. */
    if (config->method_support_refresh == 1)
        p->buffers &= ~(FV_BIT(FV_SUPPORT_HISTORY_DEPTH) | FV_BIT(FV_SUPPORT_HISTORY_SURFACE));
    p->present = strcmp(config->display_sink, "none") != 0;
    if (p->present) p->buffers |= FV_BIT(FV_PICTURE);
    fv_plan_add(p, "pass", "present", p->present, 0,
                p->present ? "display.sink is %s: it takes 8-bit pictures"
                           : "display.sink is %s: nobody takes pictures",
                config->display_sink);
    choose_fringe(p, config);
    choose_turn(p, config);
    p->history = (read & FV_BIT(FV_HISTORY_CACHE)) != 0;
    p->accumulates = (read & FV_BIT(FV_HISTORY_MEAN)) != 0;
    for (int n = 0; fv_method_at(n); n++)
        for (int i = 0; i < 2 * FV_METHOD_PASSES_MAX; i++) {
            const struct fv_method *other = fv_method_at(n);
            const struct fv_pass *pass = i < FV_METHOD_PASSES_MAX ? other->pass[i] : other->every[i - FV_METHOD_PASSES_MAX];
            bool listed = !pass;
            for (int k = 0; k < p->rows && pass; k++) listed |= strcmp(p->row[k].what, pass->name) == 0;
            if (!listed && other == p->method)
                fv_plan_add(p, "pass", pass->name, false, 0, "selective.periphery is %s", config->selective_periphery);
            else if (!listed)
                fv_plan_add(p, "pass", pass->name, false, 0, "a step of method %s, not of %s", other->name, p->method->name);
        }
}

/* "written by a, b; read by c", of kept passes. */
static void name_users(const struct fv_plan *p, enum fv_buffer b, char *out, size_t size)
{
    size_t n = 0;
    out[0] = 0;
    for (int reading = 0; reading < 2; reading++) {
        const char *before = reading ? n ? "; read by " : "read by " : "written by ";
        for (int i = 0; i < p->passes + p->present + p->turns && n < size; i++) {
            const struct fv_pass *pass = i < p->passes ? p->pass[i] : i == p->passes ? &fv_pass_present : &fv_pass_turn;
            if (!((reading ? pass->reads : pass->writes | pass->offers) & FV_BIT(b))) continue;
            n += (size_t)snprintf(out + n, size - n, "%s%s", before, pass->name);
            before = ", ";
        }
    }
}

static void choose_buffers(struct fv_plan *p, const struct fv_frame *f)
{
    int64_t of_one_eye = 0;
    char users[128];
    for (int b = 0; b < FV_BUFFERS; b++) {
        const char *name = fv_plan_buffer_name((enum fv_buffer)b);
        bool kept = p->buffers & FV_BIT(b), swapped = strstr(name, "history") != NULL;
        int images = FV_PLAN_COLOURS & FV_BIT(b) ? p->planes : FV_PLAN_EARLIER & FV_BIT(b) && kept ? p->pasts - 1 : 1;
        int64_t bytes = fv_plan_buffer_bytes(f, (enum fv_buffer)b) * images;
        if (kept) of_one_eye += bytes;
        p->bytes[b] = kept ? f->eyes * bytes : 0;
        name_users(p, (enum fv_buffer)b, users, sizeof users);
        fv_plan_add(p, "buffer", name, kept, f->eyes * bytes, "%s%s",
                    kept ? swapped ? "the last frame's, swapped after each; " : ""
                         : "no kept pass reads or writes it",
                    kept ? users : "");
    }
    fv_plan_add(p, "feature", "second eye", f->eyes == 2, of_one_eye,
                f->eyes == 2 ? "display.eyes is 2: its half of the buffers, its tiles"
                             : "display.eyes is 1: no buffers and no tiles of another");
}

static int64_t texture_bytes(const struct fv_texture *t)
{
    int64_t texels = 0;
    for (int l = 0; l < t->levels; l++) {
        int width = t->width >> l, height = t->height >> l;
        texels += (int64_t)((width ? width : 1) + 1) * (height ? height : 1);
    }
    return 4 * texels;
}

/* Bytes of the textures that materials use for one end, each counted once. */
static int64_t bytes_used(const struct fv_scene *s, uint32_t feature)
{
    int64_t bytes = 0;
    for (int t = 0; t < s->textures; t++)
        for (int i = 0; i < s->materials; i++) {
            const struct fv_material *m = &s->material[i];
            int32_t used = feature == FV_SCENE_TEXTURES      ? m->base_texture
                           : feature == FV_SCENE_NORMAL_MAPS ? m->normal_texture
                           : feature == FV_SCENE_ALPHA       ? m->alpha_texture
                                                             : -1;
            if (used != t) continue;
            bytes += texture_bytes(&s->texture[t]);
            break;
        }
    return bytes;
}

static const struct {
    uint32_t feature;
    const char *name, *with, *without;
} features[] = {
    {FV_SCENE_TEXTURES, "textures", "materials have textures", "no material has a texture"},
    {FV_SCENE_NORMAL_MAPS, "normal maps", "materials have normal maps", "no material has a normal map"},
    {FV_SCENE_ALPHA, "alpha test", "materials are masked: texels are tested inside traversal",
     "no material is masked: no test inside traversal"},
    {FV_SCENE_SPECULAR, "Phong lobe", "materials are glossy", "no material is glossy"},
    {FV_SCENE_MIRRORS, "reflection", "materials mirror: rays go on from them", "no material is a mirror"},
    {FV_SCENE_GLASS, "refraction", "materials are transparent: rays go on through them",
     "no material is transparent"},
    {FV_SCENE_EMISSIVE, "emission", "materials shine", "no material shines"},
    {FV_SCENE_POINT_LIGHTS, "point lights", "the scene or scene.point_lights has some", "no point light"},
    {FV_SCENE_AREA_LIGHTS, "area lights",
     "the scene or scene.area_lights has some: method.area_spp shadow rays each",
     "no area light"},
    {FV_SCENE_SUN, "sun", "the scene or scene.sun has one", "no sun"},
    {FV_SCENE_FIELDS, "fields", "scene.fields names some: rays are marched through them", "scene.fields is empty: no ray is marched"},
    {FV_SCENE_MIXED, "meshes beside fields", "the scene has triangles and fields: the nearer hit counts",
     "the scene has not both triangles and fields"},
    {FV_SCENE_MOVING, "moving objects", "scene.moving has some: each ray is tried against each one's ball",
     "scene.moving is empty: one acceleration structure, no motion but the viewer's"},
    {FV_SCENE_AO, "ambient occlusion", "method.ao_spp rays from what each primary ray hits",
     "method.ao_spp is 0, or there is no ambient light"},
};
enum { FEATURES = sizeof features / sizeof features[0] };

/* What the scene shows, and what all of it takes. */
static void choose_scene(struct fv_plan *p, const struct fv_scene *s, const struct fv_config *config)
{
    for (int i = 0; i < FEATURES; i++) {
        bool kept = s->features & features[i].feature;
        fv_plan_add(p, "feature", features[i].name, kept, kept ? bytes_used(s, features[i].feature) : 0, "%s",
                    kept ? features[i].with : features[i].without);
    }
    bool overlay = p->present && strcmp(config->output_overlay, "on") == 0;
    fv_plan_add(p, "feature", "overlay", overlay, 0, "output.overlay is %s%s", config->output_overlay,
                p->present ? "" : ", and there are no pictures");
    int64_t geometry =
        s->triangles * (int64_t)(sizeof *s->triangle + 3 * sizeof *s->index) + 12 * s->vertices;
    fv_plan_add(p, "memory", "geometry", true, geometry, "%lld triangles, %lld vertices",
                (long long)s->triangles, (long long)s->vertices);
    fv_plan_add(p, "memory", "scene fields", s->fields.parts > 0, fv_fields_bytes(&s->fields),
                s->fields.parts > 0 ? "%d parts, %d instructions" : "scene.fields is empty", s->fields.parts, s->fields.codes);
    bool stochastic = s->features & FV_SCENE_STOCHASTIC;
    p->noise = p->needs & FV_NEEDS_NOISE;
    fv_plan_add(p, "memory", "blue-noise mask", p->noise || stochastic,
                FV_NOISE_SIZE * FV_NOISE_SIZE * (int)sizeof(float),
                p->noise ? "pixels are chosen by it"
                : stochastic ? "rays to area lights and for ambient occlusion are chosen by it"
                             : "every pixel is sampled, and there is no light that is sampled");
}

static const char *first_feature(uint32_t bits)
{
    for (int i = 0; i < FEATURES; i++)
        if (bits & features[i].feature) return features[i].name;
    return "nothing";
}

static void choose_variant(struct fv_plan *p, const struct fv_scene *s)
{
    p->variant = fv_variant_for(s->features);
    for (int v = 0; v < FV_VARIANTS; v++) {
        const struct fv_variant_row *row = &fv_variants[v];
        char what[32];
        snprintf(what, sizeof what, "tracing, %s", row->name);
        if (v == (int)p->variant)
            fv_plan_add(p, "kernel", what, true, 0, "the smallest that shows all that the scene has");
        else if (row->needs & ~s->features)
            fv_plan_add(p, "kernel", what, false, 0, "shows scenes of %s alone", first_feature(row->needs));
        else if (s->features & ~row->features)
            fv_plan_add(p, "kernel", what, false, 0, "does not show the scene's %s",
                        first_feature(s->features & ~row->features));
        else
            fv_plan_add(p, "kernel", what, false, 0, "more than this scene needs: %s and others",
                        first_feature(row->features & ~fv_variants[p->variant].features));
    }
}

/* More workers than tiles would have nothing to do; more than cores take turns, which is the user's choice.
 */
static void choose_workers(struct fv_plan *p, const struct fv_frame *f, const struct fv_config *config)
{
    int cores = fv_threads_cores(), wanted = config->threads_workers ? (int)config->threads_workers : cores;
    int64_t each = sizeof(struct fv_worker_scratch);
    p->workers = wanted < f->tiles ? wanted : f->tiles;
    const char *why = !config->threads_workers ? "one a core"
                      : p->workers > cores ? "as threads.workers says: more than the cores, they take turns"
                                           : "as threads.workers says";
    fv_plan_add(p, "thread", "workers", true, p->workers * each, "%d on %d cores: %s", p->workers, cores,
                why);
    if (p->workers < wanted)
        fv_plan_add(p, "thread", "further workers", false, (wanted - p->workers) * each,
                    "%d: a pass has %d tiles, they would have none", wanted - p->workers, f->tiles);
}

static void choose_adaptation(struct fv_plan *p, const struct fv_config *config)
{
    bool asked = strcmp(config->budget_adapt, "on") == 0, can = p->method->levels > 1;
    if (asked && can)
        fv_plan_add(p, "feature", "adaptation", true, 0, "budget.adapt is on: levels 1 to %d, late tiles are cut",
                    p->method->levels - 1);
    else
        fv_plan_add(p, "feature", "adaptation", false, 0, "%s%s%s",
                    asked ? "method " : "budget.adapt is off: frames take as long as they take",
                    asked ? p->method->name : "", asked ? " has nothing to give way" : "");
}

static void choose_devices(struct fv_plan *p, const struct fv_config *config)
{
    bool source = strcmp(config->eye_source, "none") != 0, taped = strcmp(config->output_tape, "on") == 0;
    bool overlay = p->present && strcmp(config->output_overlay, "on") == 0,
         foveated = p->needs & FV_NEEDS_GAZE;
    p->gaze = source && (foveated || overlay || taped);
    fv_plan_add(p, "device", "eye", p->gaze, 0, "eye.source is %s%s", config->eye_source,
                !source    ? ": straight ahead"
                : foveated ? ": the method follows the gaze"
                : overlay  ? ": the overlay shows the gaze"
                : taped    ? ": the method needs no gaze, but it is recorded (output.tape)"
                           : ", but the method needs no gaze, and nothing shows or records it");
    bool imu = strcmp(config->imu_source, "none") != 0;
    fv_plan_add(p, "device", "imu", imu, 0, "imu.source is %s: the head %s", config->imu_source,
                imu ? "turns" : "rests");
    fv_plan_add(p, "device", "display", p->present, 0, "display.sink is %s", config->display_sink);
}

void fv_plan_make(struct fv_plan *p, const struct fv_method *method, const struct fv_scene *scene,
                  const struct fv_config *config, const struct fv_frame *frame)
{
    *p = (struct fv_plan){.method = method};
    choose_passes(p, config);
    fv_plan_choose_features(p, scene, config, frame);
    choose_buffers(p, frame);
    choose_lens(p, config, frame);
    choose_scene(p, scene, config);
    choose_variant(p, scene);
    choose_workers(p, frame, config);
    choose_adaptation(p, config);
    choose_devices(p, config);
}

/* Images of the frames before: the last one's is history. */
static void take_pasts(const struct fv_plan *p, struct fv_frame *f)
{
    int64_t each = p->pasts > 1 ? p->bytes[FV_EARLIER_COLOUR] / f->eyes / (p->pasts - 1) : 0;
    f->pasts_kept = p->pasts;
    for (int e = 0; e < f->eyes && p->pasts > 0; e++) {
        f->past[0].colour[e] = f->buffer[FV_HISTORY_COLOUR][e];
        f->past[0].cache[e] = f->buffer[FV_HISTORY_CACHE][e];
        for (int k = 1; k < p->pasts; k++) {
            f->past[k].colour[e] = (uint32_t *)((char *)f->buffer[FV_EARLIER_COLOUR][e] + (k - 1) * each);
            f->past[k].cache[e] = (uint32_t *)((char *)f->buffer[FV_EARLIER_CACHE][e] + (k - 1) * each);
        }
    }
}

void fv_plan_take(const struct fv_plan *p, struct fv_frame *f, int workers)
{
    const uint64_t shared = FV_BIT(FV_SELECTED) | FV_BIT(FV_RESAMPLED) | FV_BIT(FV_MASKED) | FV_BIT(FV_REUSED) |
                            FV_BIT(FV_TILE_LAYERS); /* of all eyes' tiles */
    for (int b = 0; b < FV_BUFFERS; b++) {
        if (!(p->buffers & FV_BIT(b))) continue;
        char *bytes = fv_arena_take(fv_arena(), fv_plan_buffer_name((enum fv_buffer)b), (size_t)p->bytes[b], 4096);
        memset(bytes, 0, (size_t)p->bytes[b]); /* touched now: the first frames would pay for it */
        f->buffer[b][0] = bytes;
        if (f->eyes == 2 && !(shared & FV_BIT(b))) f->buffer[b][1] = bytes + p->bytes[b] / 2;
    }
    take_pasts(p, f);
    f->planes = p->planes;
    f->support_plane = f->stride / f->spacing * (f->rows / f->spacing);
    f->scratch = fv_arena_take(fv_arena(), "worker scratch", (size_t)workers * sizeof *f->scratch, 64);
    f->noise = p->noise ? fv_noise() : NULL;
    if (p->fringes) f->fringe = fv_arena_take(fv_arena(), "fringe", sizeof *f->fringe, 64);
    if (p->turns) f->turn = fv_arena_take(fv_arena(), "turn", sizeof *f->turn, 64);
    if (!p->history && !(p->needs & FV_NEEDS_DENSITIES)) return;
    f->state = fv_arena_take(fv_arena(), "tiles", (size_t)f->tiles * sizeof *f->state, 64);
    /* Nothing is history yet, wherever a tile turns out coarse; and without history nothing is held. */
    uint8_t holds = p->history ? FV_HELD_ALL : 0;
    for (int t = 0; t < f->tiles; t++) f->state[t] = (struct fv_tile_state){.holds = {holds, holds}, .held = holds};
}

void fv_plan_report(const struct fv_plan *p, struct fv_session *session)
{
    session->plan_rows = p->rows;
    memcpy(session->plan, p->row, sizeof session->plan);
}
