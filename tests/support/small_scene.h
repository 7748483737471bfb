/* small_scene: scenes of a few triangles, built and traced in one process. For tests only. */
#ifndef FV_TESTS_SMALL_SCENE_H
#define FV_TESTS_SMALL_SCENE_H

#include "rt/pass/kernels.h"
#include "rt/scene/build.h"
#include "rt/trace/rays.h"
#include "tests/support/program.h"

#include <math.h>

struct small_scene {
    struct fv_scene scene;
    struct fv_tracer tracer;
    struct fv_build *build;
    struct fv_config config;
};

static inline void small_begin(struct small_scene *s)
{
    struct fv_config_request none = {0};
    struct fv_error error;
    memset(s, 0, sizeof *s);
    if (fv_config_load(&s->config, &none, &error)) fail_msg("%s", error.text);
    s->build = fv_build_create("test");
}

/* The parallelogram corner, corner + u, corner + u + v, corner + v in n x n cells of two triangles. */
static inline void small_plate(struct small_scene *s, const double corner[3], const double u[3], const double v[3],
                               int n, int material)
{
    uint32_t first = fv_build_vertices(s->build);
    for (int j = 0; j <= n; j++)
        for (int i = 0; i <= n; i++) {
            struct fv_vertex x = {.uv = {(float)i / (float)n, (float)j / (float)n}};
            for (int k = 0; k < 3; k++) x.position[k] = (float)(corner[k] + u[k] * i / n + v[k] * j / n);
            fv_build_vertex(s->build, &x);
        }
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++) {
            uint32_t a = first + (uint32_t)(j * (n + 1) + i), b = a + 1, c = a + (uint32_t)n + 1, d = c + 1;
            fv_build_triangle(s->build, a, b, d, material);
            fv_build_triangle(s->build, a, d, c, material);
        }
}

static inline void small_finish(struct small_scene *s)
{
    struct fv_error error;
    if (fv_build_finish(s->build, &s->scene, &error)) fail_msg("%s", error.text);
    s->scene.exposure = 1;
    if (s->config.method_ao_spp > 0) s->scene.features |= FV_SCENE_AO;
    if (fv_tracer_open(&s->tracer, &s->scene, &s->config, &error)) fail_msg("%s", error.text);
}

/* The tracer for an instruction set, false where this machine has not got it. */
static const char *const small_isas[] = {"base", "avx2", "avx512"};
static inline bool small_reopen(struct small_scene *s, int isa)
{
    struct fv_error error;
    if (isa > (int)fv_cpu_isa()) return false;
    fv_tracer_close(&s->tracer);
    snprintf(s->config.threads_isa, sizeof s->config.threads_isa, "%s", small_isas[isa]);
    if (fv_tracer_open(&s->tracer, &s->scene, &s->config, &error)) fail_msg("%s", error.text);
    return true;
}

/* One eye's picture, `side` pixels a side and 90 degrees wide and high. */
static inline void small_picture(struct fv_config *c, int side)
{
    c->display_eyes = 1;
    c->display_width = c->display_height = side;
    c->display_fov_in_deg = c->display_fov_out_deg = c->display_fov_up_deg = c->display_fov_down_deg = 45;
}

/* A pinhole at `at`, looking along -z turned by `rotation`. */
static inline struct fv_view small_view(const double at[3], const double rotation[4], double half_deg, int size)
{
    double t = tan(half_deg * M_PI / 180), ahead[3] = {0, 0, -1};
    struct fv_lens lens = {t, t, t, t, size, size};
    struct fv_pose pose = {{at[0], at[1], at[2]}, {rotation[0], rotation[1], rotation[2], rotation[3]}};
    struct fv_view view;
    fv_view_set(&view, &lens, &pose, ahead);
    return view;
}

/* A grid of 32 x 32 samples over the view. */
static inline void small_grid(struct fv_samples *samples, const struct fv_view *view)
{
    samples->count = 1024;
    for (int i = 0; i < 1024; i++) {
        samples->x[i] = ((float)(i % 32) + 0.5f) * (float)view->width / 32;
        samples->y[i] = ((float)(i / 32) + 0.5f) * (float)view->height / 32;
    }
}

#endif
