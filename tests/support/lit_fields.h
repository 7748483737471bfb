/* lit_fields: a scene of diffuse solids by its text, without light but what is asked for, and grids of samples of it. For
 * tests only. */
#ifndef FV_TESTS_LIT_FIELDS_H
#define FV_TESTS_LIT_FIELDS_H

#include "tests/support/small_scene.h"

enum { GRID = 1024 };

static struct small_scene small;
static struct fv_samples samples;
static int64_t rays[FV_RAY_KINDS]; /* of the newest samples */
static bool opened;

#define FOR_EACH_ISA for (int isa = 0; isa <= (int)fv_cpu_isa(); isa++)

/* A teardown, too. */
static inline int close_scene(void **state)
{
    (void)state;
    if (opened) fv_tracer_close(&small.tracer);
    opened = false;
    return 0;
}

/* Diffuse 1; `sets`: more settings, after those that leave no light but what they ask for. */
static inline void open_scene(const char *solids, const char *const *sets, int count)
{
    char path[160];
    static char text[8192];
    struct fv_config_request request = {.sets = 3, .set = {"scene.name=none", "display.eyes=1", path}};
    struct fv_error error;
    close_scene(NULL);
    snprintf(text, sizeof text, "material a diffuse 1 1 1\n%s", solids);
    program_write("light.field", text, strlen(text));
    snprintf(path, sizeof path, "scene.fields=%s/light.field", program_folder());
    request.set[request.sets++] = "scene.ambient=0 0 0";
    for (int i = 0; i < count; i++) request.set[request.sets++] = sets[i];
    memset(&small, 0, sizeof small);
    if (fv_config_load(&small.config, &request, &error) || fv_scene_load(&small.scene, &small.config, &error) ||
        fv_tracer_open(&small.tracer, &small.scene, &small.config, &error))
        fail_msg("%s", error.text);
    opened = true;
}

static inline struct fv_view look(double x, double y, double z, double pitch_deg, double half_deg)
{
    double turn[4];
    fv_quat_from_yaw_pitch_roll(0, pitch_deg * M_PI / 180, 0, turn);
    return small_view((double[3]){x, y, z}, turn, half_deg, 256);
}

static inline void trace(int isa, const struct fv_view *view, uint32_t seed, struct fv_samples *out)
{
    memset(rays, 0, sizeof rays);
    small_grid(out, view);
    fv_kernels_for((enum fv_isa)isa, fv_variant_for(small.scene.features))->trace(&small.tracer, view, out, seed, rays);
}

#endif
