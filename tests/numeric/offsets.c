/* offsets: shadow rays leave surfaces cleanly from 1e-4 m to 1e6 m: no surface shades itself, and no
 * light leaks through what lies just above it. Every instruction set that this machine has. */
#include "tests/support/small_scene.h"

#include "platform/arena.h"

static const double no_turn[4] = {1, 0, 0, 0};

static const struct {
    const char *what;
    double distance; /* of the wall from the eye */
    double place;    /* offset of everything along all axes */
    double tilt;     /* of the wall, as a slope */
} walls[] = {
    {"close", 1e-4, 0, 0},        {"close, slanted", 1e-4, 0, 0.7}, {"close, away from the origin", 1e-4, 10, 0.3},
    {"arm's length", 0.5, 3, 0.5}, {"room", 5, -20, 0.9},            {"street", 1e3, 100, 0.4},
    {"land", 1e6, 0, 0.5},        {"land, far off", 1e4, 1e6, 0.2}, {"steep", 1, 5, 8},
};

/* A wall before the eye, a lamp beside the eye: every sample sees it lit as the formula says. */
static void no_surface_shades_itself(void **state)
{
    (void)state;
    static struct small_scene s;
    static struct fv_samples samples;
    for (unsigned w = 0; w < sizeof walls / sizeof walls[0]; w++) {
        double d = walls[w].distance, p = walls[w].place, r = 20 * d;
        struct fv_material white = fv_material_default();
        for (int c = 0; c < 3; c++) white.diffuse[c] = 1;
        small_begin(&s);
        int m = fv_build_material(s.build, &white);
        double corner[3] = {p - r, p - r, p - d + r * walls[w].tilt}, u[3] = {2 * r, 0, -2 * r * walls[w].tilt}, v[3] = {0, 2 * r, 0};
        small_plate(&s, corner, u, v, 7, m);
        small_finish(&s);
        s.scene.lights = 1;
        s.scene.light[0] = (struct fv_light){.kind = FV_LIGHT_POINT, .position = {(float)p, (float)p, (float)p}};
        for (int c = 0; c < 3; c++) s.scene.light[0].colour[c] = (float)(d * d);
        double at[3] = {p, p, p};
        struct fv_view view = small_view(at, no_turn, 40, 512);
        for (int isa = 0; isa <= (int)fv_cpu_isa(); isa++) {
            int64_t rays[FV_RAY_KINDS] = {0};
            int dark = 0, hit = 0;
            small_grid(&samples, &view);
            fv_kernels((enum fv_isa)isa)->trace(&s.tracer, &view, &samples, 0, rays);
            for (int i = 0; i < 1024; i++) {
                hit += samples.inverse_depth[i] > 0;
                dark += samples.inverse_depth[i] > 0 && !(samples.red[i] > 0 && isfinite(samples.red[i]));
            }
            assert_true(hit > 400);
            if (dark) fail_msg("%s: %d samples are dark (%s)", walls[w].what, dark, fv_cpu_isa_name((enum fv_isa)isa));
            assert_int_equal(rays[FV_RAY_PRIMARY], 1024);
        }
        fv_tracer_close(&s.tracer);
    }
}

/* A lid over a floor, a lamp above the lid: the floor below stays dark. `gap` in parts of the scene's size. */
static void no_light_leaks(void **state)
{
    (void)state;
    static struct small_scene s;
    static struct fv_samples samples;
    static const double sizes[] = {1e-2, 1, 100, 1e6}, gaps[] = {1e-4, 1e-3, 0.1};
    for (int i = 0; i < 12; i++) {
        double size = sizes[i / 3], gap = size * gaps[i % 3];
        struct fv_material white = fv_material_default();
        small_begin(&s);
        int m = fv_build_material(s.build, &white);
        double x[3] = {2 * size, 0, 0}, z[3] = {0, 0, 2 * size};
        double floor_at[3] = {-size, 0, -size}, lid_at[3] = {-size, gap, -size};
        small_plate(&s, floor_at, x, z, 9, m);
        small_plate(&s, lid_at, x, z, 5, m);
        small_finish(&s);
        s.scene.lights = 1;
        s.scene.light[0] = (struct fv_light){.kind = FV_LIGHT_POINT, .position = {0, (float)size, 0}, .colour = {1e6f, 1e6f, 1e6f}};
        double at[3] = {0.3 * size, 0.5 * gap, 0.2 * size}, down[4];
        fv_quat_from_yaw_pitch_roll(0.3, -1.2, 0, down);
        struct fv_view view = small_view(at, down, 30, 256);
        int64_t rays[FV_RAY_KINDS] = {0};
        small_grid(&samples, &view);
        fv_kernels(s.tracer.isa)->trace(&s.tracer, &view, &samples, 0, rays);
        for (int k = 0; k < 1024; k++) {
            assert_true(samples.inverse_depth[k] > 0);
            if (samples.red[k] != 0) fail_msg("size %g, gap %g: light under the lid", size, gap);
        }
        fv_tracer_close(&s.tracer);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(no_surface_shades_itself), cmocka_unit_test(no_light_leaks)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
