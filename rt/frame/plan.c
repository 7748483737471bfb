/* plan: what is needed and what is left out, each with its reason. */
#include "rt/frame/plan.h"

#include "platform/arena.h"

#include <assert.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

static const char *const buffer_names[FV_BUFFERS] = {
    [FV_COLOUR] = "colour", [FV_DEPTH] = "depth", [FV_HISTORY_COLOUR] = "history colour",
    [FV_HISTORY_DEPTH] = "history depth", [FV_SUPPORT_COLOUR] = "support colour",
    [FV_SUPPORT_DEPTH] = "support depth", [FV_SELECTED] = "selected blocks", [FV_PICTURE] = "picture"};

static void add(struct fv_plan *p, const char *kind, const char *what, bool kept, int64_t bytes,
                const char *reason, ...) __attribute__((format(printf, 6, 7)));
static void add(struct fv_plan *p, const char *kind, const char *what, bool kept, int64_t bytes,
                const char *reason, ...)
{
    assert(p->rows < (int)(sizeof p->row / sizeof p->row[0]));
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

static int64_t bytes_of(const struct fv_frame *f, enum fv_buffer buffer)
{
    int64_t pixels = f->stride * f->rows;
    switch (buffer) {
    case FV_SUPPORT_COLOUR:
    case FV_SUPPORT_DEPTH: return f->eyes * 4 * pixels / (f->spacing * f->spacing);
    case FV_SELECTED: return 8 * (int64_t)f->tiles;
    default: return f->eyes * (4 * pixels + 64); /* pixels are loaded in pairs: one behind the last */
    }
}

/* Passes that a frame runs: the method's and, where a sink takes pictures, present. */
static void choose_passes(struct fv_plan *p, const struct fv_config *config)
{
    uint32_t read = 0;
    for (int i = 0; p->method->pass[i]; i++) {
        const struct fv_pass *pass = p->method->pass[i];
        p->pass[p->passes++] = pass;
        p->buffers |= pass->reads | pass->writes;
        read |= pass->reads;
        add(p, "pass", pass->name, true, 0, "method %s", p->method->name);
    }
    p->present = strcmp(config->display_sink, "none") != 0;
    if (p->present) p->buffers |= FV_BIT(FV_PICTURE);
    add(p, "pass", "present", p->present, 0, "display.sink is %s", config->display_sink);
    p->history = (read & FV_BIT(FV_HISTORY_COLOUR)) != 0;
    for (int n = 0; fv_method_at(n); n++)
        for (int i = 0; fv_method_at(n)->pass[i]; i++) {
            const struct fv_pass *pass = fv_method_at(n)->pass[i];
            bool kept = false;
            for (int k = 0; k < p->passes; k++) kept |= p->pass[k] == pass;
            if (!kept) add(p, "pass", pass->name, false, 0, "only method %s needs it", fv_method_at(n)->name);
        }
}

static const struct {
    uint32_t feature;
    const char *name, *without;
} features[] = {
    {FV_SCENE_TEXTURES, "textures", "no material has a texture"},
    {FV_SCENE_NORMAL_MAPS, "normal maps", "no material has a normal map"},
    {FV_SCENE_ALPHA, "alpha test", "no material is masked: no filter inside traversal"},
    {FV_SCENE_SPECULAR, "Phong lobe", "no material is glossy"},
    {FV_SCENE_MIRRORS, "reflection", "no material is a mirror"},
    {FV_SCENE_GLASS, "refraction", "no material is transparent"},
    {FV_SCENE_EMISSIVE, "emission", "no material shines"},
    {FV_SCENE_POINT_LIGHTS, "point lights", "no point light"},
    {FV_SCENE_AREA_LIGHTS, "area lights", "no area light: no random numbers either"},
    {FV_SCENE_SUN, "sun", "no sun"},
};

void fv_plan_make(struct fv_plan *p, const struct fv_method *method, const struct fv_scene *scene,
                  const struct fv_config *config, const struct fv_frame *frame)
{
    *p = (struct fv_plan){.method = method};
    choose_passes(p, config);
    for (int b = 0; b < FV_BUFFERS; b++) {
        bool kept = p->buffers & FV_BIT(b);
        p->bytes[b] = kept ? bytes_of(frame, b) : 0;
        add(p, "buffer", buffer_names[b], kept, p->bytes[b], kept ? "%s" : "no pass reads or writes it%s",
            kept ? "read or written by a kept pass" : "");
    }
    for (unsigned i = 0; i < sizeof features / sizeof features[0]; i++) {
        bool kept = scene->features & features[i].feature;
        add(p, "feature", features[i].name, kept, 0, "%s", kept ? "the scene has it" : features[i].without);
    }
    add(p, "feature", "second eye", frame->eyes == 2, 0, "display.eyes is %d", frame->eyes);
    add(p, "device", "eye", strcmp(config->eye_source, "none") != 0, 0, "eye.source is %s", config->eye_source);
    add(p, "device", "imu", strcmp(config->imu_source, "none") != 0, 0, "imu.source is %s", config->imu_source);
}

void fv_plan_take(const struct fv_plan *p, struct fv_frame *f, int workers)
{
    for (int b = 0; b < FV_BUFFERS; b++) {
        if (!(p->buffers & FV_BIT(b))) continue;
        char *bytes = fv_arena_take(fv_arena(), buffer_names[b], (size_t)p->bytes[b], 4096);
        f->buffer[b][0] = bytes;
        if (f->eyes == 2 && b != FV_SELECTED) f->buffer[b][1] = bytes + p->bytes[b] / 2;
    }
    f->scratch = fv_arena_take(fv_arena(), "worker scratch", (size_t)workers * sizeof *f->scratch, 64);
}
