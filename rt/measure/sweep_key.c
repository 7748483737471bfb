/* sweep_key: see sweep_key.h. Where files lie, where output goes and what sensors are called does not
 * count: what came of them does. */
#include "rt/measure/sweep_key.h"

#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

/* FNV-1a (Fowler, Noll, Vo), eight bytes a step. */
static uint64_t hash(uint64_t h, const void *bytes, size_t size)
{
    const uint8_t *p = bytes;
    for (; size >= 8; size -= 8, p += 8) {
        uint64_t word;
        memcpy(&word, p, 8);
        h = (h ^ word) * 0x100000001b3u;
        h ^= h >> 29;
    }
    for (; size; size--, p++) h = (h ^ *p) * 0x100000001b3u;
    return h;
}

/* Another build may render otherwise or faster, whatever its version is called. */
static uint64_t hash_program(uint64_t h)
{
    static uint64_t block[8192];
    ssize_t n;
    int file = open("/proc/self/exe", O_RDONLY | O_CLOEXEC);
    h = hash(h, FV_VERSION, sizeof FV_VERSION);
    while (file >= 0 && (n = read(file, block, sizeof block)) > 0) h = hash(h, block, (size_t)n);
    if (file >= 0) close(file);
    return h;
}

static bool counts(const struct fv_key *key, bool whole)
{
    static const char *const sections[] = {"display", "method", "selective", "denoise", "fovea",
                                           "threads", "scene",  "budget",    "imu"};
    enum { SECTIONS = sizeof sections / sizeof sections[0], OF_SWEEP = 6 };
    static const char *const without[] = {"sink", "y4m_path", "headset", "name", "sealed_heap", "library", "memory_mb"};
    bool in = false;
    for (int i = 0; i < (whole ? SECTIONS : OF_SWEEP); i++) in |= strcmp(key->section, sections[i]) == 0;
    for (unsigned i = 0; i < sizeof without / sizeof without[0]; i++)
        in &= strcmp(key->name, without[i]) != 0;
    return in;
}

/* `whole`: of the scene, the budget and the head, too, which a sweep sees by what came of them. */
static uint64_t hash_settings(uint64_t h, const struct fv_config *config, bool whole)
{
    static char text[32 * FV_LIST_MAX];
    for (int i = 0; i < fv_keys_count; i++) {
        if (!counts(&fv_keys[i], whole)) continue;
        fv_config_text(config, &fv_keys[i], text, sizeof text);
        h = hash(h, fv_keys[i].name, strlen(fv_keys[i].name) + 1);
        h = hash(h, text, strlen(text) + 1);
    }
    return h;
}

static uint64_t hash_scene(uint64_t h, const struct fv_scene *s)
{
    h = hash(h, s->position, (size_t)s->vertices * 12);
    h = hash(h, s->index, (size_t)s->triangles * 12);
    h = hash(h, s->triangle, (size_t)s->triangles * sizeof *s->triangle);
    h = hash(h, s->material, (size_t)s->materials * sizeof *s->material);
    for (int i = 0; i < s->textures; i++) {
        const struct fv_texture *t = &s->texture[i];
        h = hash(h, t->texel + t->offset[0], (size_t)(t->width + 1) * (size_t)t->height * 4);
    }
    h = hash(h, s->light, (size_t)s->lights * sizeof *s->light);
    h = hash(h, s->ambient, sizeof s->ambient);
    h = hash(h, s->sky, sizeof s->sky);
    return hash(h, &s->exposure, sizeof s->exposure);
}

void fv_sweep_fingerprint(char *out, unsigned size, const struct fv_config *config,
                          const struct fv_scene *scene,
                          const struct fv_sweep_frame (*frames)[FV_SWEEP_FRAMES])
{
    uint64_t h = hash_program(0xcbf29ce484222325u);
    h = hash_settings(h, config, false);
    h = hash_scene(h, scene);
    for (int s = 0; s < FV_SWEEP_SEGMENTS; s++)
        for (int k = 0; k < FV_SWEEP_FRAMES; k++) {
            const struct fv_sweep_frame *f = &frames[s][k];
            h = hash(h, &f->t_ns, sizeof f->t_ns);
            h = hash(h, &f->head, sizeof f->head);
            h = hash(h, f->gaze, sizeof f->gaze);
            double wider_deg = f->uncertainty_deg - config->eye_noise_deg; /* r0 grows by it */
            h = hash(h, &wider_deg, sizeof wider_deg);
        }
    snprintf(out, size, "%016llx", (unsigned long long)h);
}

void fv_settings_fingerprint(char *out, unsigned size, const struct fv_config *config, int frames)
{
    uint64_t h = hash_program(0xcbf29ce484222325u);
    h = hash_settings(h, config, true);
    h = hash(h, &frames, sizeof frames);
    snprintf(out, size, "%016llx", (unsigned long long)h);
}
