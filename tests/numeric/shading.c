/* shading: light, glass, mirrors and pixels against formulas in double, at their edges; the polynomials
 * of simd.h over their range. Every instruction set that this machine has. */
#include "tests/support/small_scene.h"

#include "rt/pass/pass.h"

static const double no_turn[4] = {1, 0, 0, 0}, origin[3] = {0, 0, 0};

static void trace_grid(struct small_scene *s, struct fv_samples *samples, int isa, int64_t *rays)
{
    struct fv_view view = small_view(origin, no_turn, 20, 256);
    memset(rays, 0, FV_RAY_KINDS * sizeof *rays);
    small_grid(samples, &view);
    fv_kernels((enum fv_isa)isa)->trace(&s->tracer, &view, samples, 3, rays);
}

static void wall(struct small_scene *s, double z, const struct fv_material *material)
{
    double corner[3] = {-10, -10, z}, u[3] = {20, 0, 0}, v[3] = {0, 20, 0};
    small_plate(s, corner, u, v, 3, fv_build_material(s->build, material));
}

/* Radiance = albedo / pi * I cos / d^2 (Lambert), depth exact. */
static void lambert(void **state)
{
    (void)state;
    static struct small_scene s;
    static struct fv_samples samples;
    int64_t rays[FV_RAY_KINDS];
    struct fv_material m = fv_material_default();
    m.diffuse[0] = 0.5f;
    small_begin(&s);
    wall(&s, -2, &m);
    small_finish(&s);
    s.scene.lights = 1;
    s.scene.light[0] = (struct fv_light){.kind = FV_LIGHT_POINT, .position = {0.5f, 1, -0.5f}, .colour = {7, 7, 7}};
    for (int isa = 0; isa <= (int)fv_cpu_isa(); isa++) {
        trace_grid(&s, &samples, isa, rays);
        for (int i = 0; i < 1024; i++) {
            double t = tan(20 * M_PI / 180), x = (samples.x[i] / 128 - 1) * t * 2, y = (1 - samples.y[i] / 128) * t * 2;
            double dx = 0.5 - x, dy = 1 - y, d2 = dx * dx + dy * dy + 1.5 * 1.5;
            double expected = 0.5 / M_PI * 7 * 1.5 / sqrt(d2) / d2;
            assert_true(fabs(samples.red[i] - expected) < 1e-4 * expected);
            assert_true(fabs(samples.inverse_depth[i] - 0.5) < 1e-6);
        }
        assert_int_equal(rays[FV_RAY_SHADOW], 1024);
    }
    fv_tracer_close(&s.tracer);
}

/* The area light's mean over many samples is its integral: a square of 1 m at 3 m over the point. */
static void area_light(void **state)
{
    (void)state;
    static struct small_scene s;
    static struct fv_samples samples;
    int64_t rays[FV_RAY_KINDS];
    struct fv_material m = fv_material_default();
    for (int c = 0; c < 3; c++) m.diffuse[c] = 1;
    small_begin(&s);
    wall(&s, -2, &m);
    s.config.method_area_spp = 64;
    small_finish(&s);
    s.scene.features |= FV_SCENE_AREA_LIGHTS;
    s.tracer.noise = fv_noise();
    s.scene.lights = 1;
    s.scene.light[0] = (struct fv_light){.kind = FV_LIGHT_AREA, .position = {-0.5f, 0.5f, 1}, .u = {1, 0, 0}, .v = {0, -1, 0}, .colour = {4, 4, 4}};
    trace_grid(&s, &samples, s.tracer.isa, rays);
    double t = tan(20 * M_PI / 180), bias = 0;
    for (int i = 0; i < 1024; i++) {
        double x = (samples.x[i] / 128 - 1) * t * 2, y = (1 - samples.y[i] / 128) * t * 2, sum = 0;
        for (int a = 0; a < 50; a++)
            for (int b = 0; b < 50; b++) {
                double lx = -0.5 + (a + 0.5) / 50 - x, ly = 0.5 - (b + 0.5) / 50 - y, d2 = lx * lx + ly * ly + 9;
                sum += 9 / d2 / d2 / 2500;
            }
        double expected = 4 / M_PI * sum;
        assert_true(fabs(samples.red[i] - expected) < 0.015 * expected);
        bias += (samples.red[i] / expected - 1) / 1024;
    }
    assert_true(fabs(bias) < 5e-4);
    assert_int_equal(rays[FV_RAY_SHADOW], 64 * 1024);
    fv_tracer_close(&s.tracer);
}

/* A plane of glass, seen head on: Fresnel's ((n - 1) / (n + 1))^2 back, the rest through; n = 1: all through. */
static void glass_and_mirror(void **state)
{
    (void)state;
    static struct small_scene s;
    static struct fv_samples samples;
    int64_t rays[FV_RAY_KINDS];
    static const float indices[] = {1, 1.000001f, 1.5f, 2.4f};
    for (int n = 0; n < 5; n++) {
        struct fv_material front = fv_material_default(), lamp = fv_material_default();
        for (int c = 0; c < 3; c++) {
            front.diffuse[c] = 0;
            front.transmission[c] = n < 4;
            front.mirror[c] = n == 4 ? 0.75f : 0;
            front.ior = n < 4 ? indices[n] : 1;
            lamp.emission[c] = 2;
            lamp.diffuse[c] = 0;
        }
        front.flags |= n < 4 ? FV_MATERIAL_GLASS : FV_MATERIAL_MIRROR;
        lamp.flags |= FV_MATERIAL_EMISSIVE;
        small_begin(&s);
        wall(&s, -1, &front);
        wall(&s, -3, &lamp);
        small_finish(&s);
        s.scene.sky[0] = 8;
        for (int isa = 0; isa <= (int)fv_cpu_isa(); isa++) {
            trace_grid(&s, &samples, isa, rays);
            int centre = 16 * 32 + 16;
            double r = n < 4 ? pow((indices[n] - 1) / (indices[n] + 1), 2) : 0;
            double expected = n < 4 ? 8 * r + 2 * (1 - r) : 8 * 0.75;
            if (r < 1 / 512.0 && n < 4) expected = 2 * (1 - r);
            if (!(fabs(samples.red[centre] - expected) < 2e-3 * expected)) fail_msg("case %d: %g, not %g", n, (double)samples.red[centre], expected);
            for (int i = 0; i < 1024; i++) assert_true(isfinite(samples.red[i]) && samples.red[i] >= 0);
        }
        fv_tracer_close(&s.tracer);
    }
}

/* Tone mapping and encoding: monotone, from 0 to 1023, whatever comes in. */
static void pixels(void **state)
{
    (void)state;
    static float in[64], zero[64];
    static uint32_t out[64];
    static uint8_t bytes[256];
    static const float odd[] = {0, -1, NAN, INFINITY, -INFINITY, 1e-40f, 1e30f, 1e-10f};
    for (int isa = 0; isa <= (int)fv_cpu_isa(); isa++) {
        const struct fv_kernels *k = fv_kernels((enum fv_isa)isa);
        for (int i = 0; i < 64; i++) in[i] = i < 8 ? odd[i] : powf(2, (float)(i - 48) * 0.5f);
        k->encode(in, zero, in, 1, out, 64);
        static const unsigned expected[] = {0, 0, 0, 1023, 0, 0, 1023, 0};
        for (int i = 0; i < 8; i++) assert_int_equal(out[i] & 1023, expected[i]);
        for (int i = 9; i < 64; i++) assert_true((out[i] & 1023) >= (out[i - 1] & 1023));
        for (int i = 0; i < 64; i++) assert_int_equal(out[i] >> 20 & 1023, out[i] & 1023);
        for (int v = 0; v < 1024; v += 64) {
            for (int i = 0; i < 64; i++) out[i] = (uint32_t)(v + i) | FV_PIXEL_SAMPLED | FV_PIXEL_FILLED;
            k->present(out, bytes, 64);
            for (int i = 0; i < 64; i++) {
                assert_true(fabs(bytes[4 * i] - (v + i) * 255.0 / 1023) <= 0.5001);
                assert_int_equal(bytes[4 * i + 1], 0);
            }
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(lambert), cmocka_unit_test(area_light),
                                       cmocka_unit_test(glass_and_mirror), cmocka_unit_test(pixels)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
