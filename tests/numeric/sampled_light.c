/* sampled_light: ambient occlusion and area lights: where their rays go, closed forms of what is occluded,
 * light that is kept apart, and how it is kept in pixels. Every instruction set that this machine has. */
#include "tests/numeric/probe/probe.h"
#include "tests/support/room.h"

static const double no_turn[4] = {1, 0, 0, 0}, origin[3] = {0, 0, 0};

#define FOR_EACH_ISA for (int isa = 0; isa <= (int)fv_cpu_isa(); isa++)

enum { ROWS = 6, MOST = 4096 };
static float in[ROWS][MOST], out[ROWS][MOST];

static void probe(int isa, enum fv_probe p, int n)
{
    const float *from[ROWS];
    float *to[ROWS];
    for (int i = 0; i < ROWS; i++) from[i] = in[i], to[i] = out[i];
    assert_true(n <= MOST && n % 16 == 0);
    fv_probe_of(isa, p)(NULL, from, to, n);
}

/* For every count: each point keeps to its own cell wherever the random numbers move it, the cells cover the
 * square evenly, and one pixel's points are as far apart along each axis as n points can nearly be. */
static void cells_cover_the_square(void **state)
{
    (void)state;
    FOR_EACH_ISA for (int n = 1; n <= 64; n++)
    {
        double mean[2] = {0, 0}, square[2] = {0, 0};
        static double axis[2][64];
        for (int i = 0; i < n; i++) {
            double low[2] = {2, 2}, high[2] = {-1, -1};
            for (int k = 0; k < 256; k++) {
                in[0][k] = k == 0 ? 0 : ((float)(k % 16) + 0.5f) / 16;
                in[1][k] = k == 0 ? 0.99999994f : ((float)(k / 16) + 0.5f) / 16;
                in[2][k] = (float)i, in[3][k] = (float)n;
            }
            probe(isa, PROBE_SAMPLE, 256);
            for (int k = 0; k < 256; k++)
                for (int c = 0; c < 2; c++) {
                    double v = out[c][k];
                    if (!(v >= 0 && v <= 1)) fail_msg("point %d of %d: %g", i, n, v);
                    low[c] = fmin(low[c], v), high[c] = fmax(high[c], v);
                    mean[c] += v / (256 * n), square[c] += v * v / (256 * n);
                    if (k == 100) axis[c][i] = v;
                }
            double area = (high[0] - low[0]) * (high[1] - low[1]);
            if (area > 1.001 / n) fail_msg("point %d of %d: a cell of %g", i, n, area);
        }
        for (int c = 0; c < 2; c++) {
            if (fabs(mean[c] - 0.5) > 4e-3 || fabs(square[c] - 1 / 3.0) > 4e-3)
                fail_msg("%d points: mean %g, mean square %g", n, mean[c], square[c]);
            int side = (int)lround(sqrt(n));
            if (side * side != n) continue;
            bool taken[64] = {false};
            for (int i = 0; i < n; i++) {
                int slot = (int)(axis[c][i] * n);
                if (taken[slot]) fail_msg("%d points: two in slot %d of axis %d", n, slot, c);
                taken[slot] = true;
            }
        }
    }
}

static void turns_and_bases(void **state)
{
    (void)state;
    static const float normals[][3] = {{0, 0, 1}, {0, 0, -1}, {1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {1, 0, -0.0f},
                                       {1e-4f, 0, 1}, {1e-4f, 0, -1}, {1e-20f, 1e-20f, -1}, {0.6f, 0, 1e-7f},
                                       {0.6f, 0.8f, -1e-7f}, {0.36f, 0.48f, 0.8f}, {0.36f, 0.48f, -0.8f},
                                       {-1, -1, -1}, {1, -1, 1e-38f}, {0, 1e-3f, -1}};
    FOR_EACH_ISA
    {
        for (int i = 0; i < MOST; i++) in[0][i] = (float)i / (MOST - 1) - 0.5f;
        probe(isa, PROBE_TURN, MOST);
        for (int i = 0; i < MOST; i++) {
            double a = 2 * M_PI * (double)in[0][i];
            assert_true(fabs(out[0][i] - sin(a)) < 2e-6 && fabs(out[1][i] - cos(a)) < 2e-6);
        }
        for (int i = 0; i < 16; i++) {
            const float *n = normals[i];
            double length = sqrt((double)n[0] * n[0] + (double)n[1] * n[1] + (double)n[2] * n[2]);
            for (int c = 0; c < 3; c++) in[c][i] = (float)(n[c] / length);
        }
        probe(isa, PROBE_BASIS, 16);
        for (int i = 0; i < 16; i++) {
            double v[3][3], dot;
            for (int c = 0; c < 3; c++) v[0][c] = in[c][i], v[1][c] = out[c][i], v[2][c] = out[3 + c][i];
            for (int a = 0; a < 3; a++)
                for (int b = 0; b < 3; b++) {
                    dot = v[a][0] * v[b][0] + v[a][1] * v[b][1] + v[a][2] * v[b][2];
                    if (!(fabs(dot - (a == b)) < 1e-6)) fail_msg("normal %d: %d . %d is %g", i, a, b, dot);
                }
        }
    }
}

/* A white wall 2 m before the eye, facing it, and what else `case` has; ambient light 1. */
struct corner {
    const char *name;
    double radius, plate[9]; /* a plate besides the wall; edges 0: none */
    double scale;            /* of all lengths */
};

static void open_corner(struct small_scene *s, const struct corner *k)
{
    struct fv_material m = fv_material_default();
    double wall[9] = {-40, -40, -2, 80, 0, 0, 0, 80, 0}, plate[9];
    for (int i = 0; i < 9; i++) wall[i] *= k->scale, plate[i] = k->plate[i] * k->scale;
    small_begin(s);
    for (int c = 0; c < 3; c++) m.diffuse[c] = 1;
    int material = fv_build_material(s->build, &m);
    small_plate(s, wall, wall + 3, wall + 6, 3, material);
    if (plate[3] != 0 || plate[4] != 0 || plate[5] != 0) small_plate(s, plate, plate + 3, plate + 6, 3, material);
    s->config.method_ao_spp = 64;
    s->config.method_ao_radius = k->radius * k->scale;
    small_finish(s);
    for (int c = 0; c < 3; c++) s->scene.ambient[c] = 1;
}

/* The open share at a point of the wall. */
static double open_share(int which, double radius, double x)
{
    double d = which == 3 ? x + 0.5 : 1, c = d / radius;
    if (which < 2 || c >= 1) return 1;
    /* A plate in parallel at 1 m takes the cone within acos c; one that meets the wall at right angles d beside
     * the point, the part of the unit disk (Malley) beyond the chord at c. */
    if (which == 2) return c * c;
    return 1 - (acos(c) - c * sqrt(1 - c * c)) / M_PI;
}

static void occlusion(void **state)
{
    (void)state;
    static const struct corner corners[] = {
        {"open", 5, {0}, 1},
        {"nearer than the radius is nothing", 0.5, {-40, -40, -1, 80, 0, 0, 0, 80, 0}, 1},
        {"parallel", 1.5, {-40, -40, -1, 80, 0, 0, 0, 80, 0}, 1},
        {"at right angles", 2, {-0.5, -40, -40, 0, 80, 0, 0, 0, 80}, 1},
    };
    static struct small_scene s;
    static struct fv_samples samples;
    for (int k = 0; k < 4; k++) {
        double at[3] = {0, 0, k == 1 || k == 2 ? -1.5 : 0}; /* between the two plates */
        struct fv_view view = small_view(at, no_turn, 10, 256);
        open_corner(&s, &corners[k]);
        small_grid(&samples, &view);
        FOR_EACH_ISA
        {
            double bias = 0, worst = 0;
            int64_t rays[FV_RAY_KINDS] = {0};
            fv_kernels((enum fv_isa)isa)->trace(&s.tracer, &view, &samples, 7, rays);
            for (int i = 0; i < 1024; i++) {
                double x = (samples.x[i] / 128 - 1) * tan(10 * M_PI / 180) * (2 + at[2]);
                double expected = 0.8 * open_share(k, corners[k].radius, x); /* 0.8: the light of a level normal */
                worst = fmax(worst, fabs(samples.red[i] - expected)), bias += (samples.red[i] - expected) / 1024;
            }
            if (worst > 0.07 || fabs(bias) > 2e-3)
                fail_msg("%s (isa %d): off by %g at worst, %g on average", corners[k].name, isa, worst, bias);
            assert_int_equal(rays[FV_RAY_SHADOW], 64 * 1024);
        }
        fv_tracer_close(&s.tracer);
    }
}

/* From millimetres to thousands of kilometres, radii from none to all, few samples or many: shares are shares,
 * and a wall by itself is not occluded by its own rounding. */
static void occlusion_at_any_size(void **state)
{
    (void)state;
    static struct small_scene s;
    static struct fv_samples samples;
    static const double scales[] = {1e-3, 1, 1e3, 1e5, 1e7}, radii[] = {1e-9, 1e-3, 1, 1e6};
    for (int a = 0; a < 5; a++)
        for (int r = 0; r < 4; r++) {
            struct corner alone = {"alone", radii[r], {0}, scales[a]};
            struct fv_view view = small_view(origin, no_turn, 80, 256);
            open_corner(&s, &alone);
            small_grid(&samples, &view);
            FOR_EACH_ISA for (int n = 1; n <= 64; n = n < 4 ? n + 1 : 4 * n)
            {
                int64_t rays[FV_RAY_KINDS] = {0};
                s.tracer.ao_spp = n;
                samples.count = n == 3 ? 5 : 1024;
                fv_kernels((enum fv_isa)isa)->trace(&s.tracer, &view, &samples, 0, rays);
                for (int i = 0; i < samples.count; i++)
                    if (!(fabsf(samples.red[i] - 0.8f) < 1e-5f || samples.inverse_depth[i] == 0))
                        fail_msg("scale %g, radius %g, %d rays: %g", scales[a], radii[r], n, (double)samples.red[i]);
            }
            fv_tracer_close(&s.tracer);
        }
}

/* Fewer rays where a list asks for that, but four at least, and never more than the settings say. */
static void fewer_rays(void **state)
{
    (void)state;
    static struct small_scene s;
    static struct fv_samples samples;
    static const struct {
        int spp, fewer, rays;
    } cases[] = {{16, 0, 16}, {16, 1, 16}, {16, 4, 4}, {64, 4, 16}, {8, 4, 4}, {4, 4, 4}, {3, 4, 3}, {1, 64, 1}, {21, 2, 10}};
    struct corner alone = {"alone", 1, {0}, 1};
    struct fv_view view = small_view(origin, no_turn, 20, 256);
    open_corner(&s, &alone);
    small_grid(&samples, &view);
    FOR_EACH_ISA for (unsigned k = 0; k < sizeof cases / sizeof cases[0]; k++)
    {
        int64_t rays[FV_RAY_KINDS] = {0};
        s.tracer.ao_spp = cases[k].spp;
        samples.fewer = cases[k].fewer;
        fv_kernels((enum fv_isa)isa)->trace(&s.tracer, &view, &samples, 0, rays);
        assert_int_equal(rays[FV_RAY_SHADOW], 1024 * cases[k].rays);
        for (int i = 0; i < 1024; i++) assert_true(fabsf(samples.red[i] - 0.8f) < 1e-5f);
    }
    samples.fewer = 0;
    fv_tracer_close(&s.tracer);
}

/* Nothing is hit: no ray, no light, no albedo. */
static void nothing_there(void **state)
{
    (void)state;
    static struct small_scene s;
    static struct fv_samples samples;
    struct corner alone = {"alone", 1, {0}, 1};
    double about[4] = {0, 0, 1, 0}; /* half a turn: the wall is behind */
    struct fv_view view = small_view(origin, about, 20, 256);
    open_corner(&s, &alone);
    small_grid(&samples, &view);
    samples.split = true;
    FOR_EACH_ISA
    {
        int64_t rays[FV_RAY_KINDS] = {0};
        memset(samples.light_red, 0x7f, sizeof samples.light_red);
        memset(samples.albedo_red, 0x7f, sizeof samples.albedo_red);
        fv_kernels((enum fv_isa)isa)->trace(&s.tracer, &view, &samples, 0, rays);
        assert_int_equal(rays[FV_RAY_SHADOW], 0);
        for (int i = 0; i < 1024; i++)
            assert_true(samples.light_red[i] == 0 && samples.albedo_red[i] == 0 && samples.surface[i] == 0);
    }
    fv_tracer_close(&s.tracer);
}

static void assert_parts_sum_up(const struct fv_samples *whole, const struct fv_samples *parts, int isa)
{
    const float *w[] = {whole->red, whole->green, whole->blue}, *base[] = {parts->red, parts->green, parts->blue};
    const float *albedo[] = {parts->albedo_red, parts->albedo_green, parts->albedo_blue};
    const float *light[] = {parts->light_red, parts->light_green, parts->light_blue};
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < 1024; i++) {
            assert_true(albedo[c][i] >= 0 && albedo[c][i] <= 1 && light[c][i] >= 0 && isfinite(light[c][i]));
            float sum = base[c][i] + albedo[c][i] * light[c][i];
            if (!(fabsf(sum - w[c][i]) <= 1e-5f * (1e-3f + w[c][i])))
                fail_msg("isa %d, sample %d: %g + %g * %g, not %g", isa, i, (double)base[c][i],
                         (double)albedo[c][i], (double)light[c][i], (double)w[c][i]);
        }
}

/* Base + albedo * light is the picture, with every feature or few; without area light or occlusion, or where
 * it was not asked for, nothing is written. */
static void parts_are_the_whole(void **state)
{
    (void)state;
    static const uint32_t scenes[] = {FV_FEATURES_ALL, FV_FEATURES_ALL & ~FV_SCENE_AO,
                                      FV_FEATURES_ALL & ~FV_SCENE_AREA_LIGHTS, FV_SCENE_AREA_LIGHTS, FV_SCENE_AO,
                                      FV_FEATURES_MIRRORED};
    static struct room room;
    static struct fv_workers workers;
    static struct fv_samples whole, parts;
    struct fv_view view = small_view(origin, no_turn, 45, 256);
    assert_int_equal(fv_workers_start(&workers, 1), 1);
    for (int k = 0; k < 6; k++) {
        room_open(&room, &workers, scenes[k], 1, 64);
        FOR_EACH_ISA
        {
            int64_t rays[2][FV_RAY_KINDS] = {{0}};
            small_grid(&whole, &view);
            small_grid(&parts, &view);
            whole.split = false, parts.split = true;
            memset(whole.albedo_red, 0x55, sizeof whole.albedo_red);
            memset(parts.albedo_red, 0x55, sizeof parts.albedo_red);
            fv_kernels((enum fv_isa)isa)->trace(&room.small.tracer, &view, &whole, 3, rays[0]);
            fv_kernels((enum fv_isa)isa)->trace(&room.small.tracer, &view, &parts, 3, rays[1]);
            assert_memory_equal(rays[0], rays[1], sizeof rays[0]);
            assert_memory_equal(whole.inverse_depth, parts.inverse_depth, sizeof whole.inverse_depth);
            bool stochastic = scenes[k] & FV_SCENE_STOCHASTIC;
            for (int i = 0; i < 1024; i++) {
                int32_t untouched[2];
                memcpy(untouched, &whole.albedo_red[i], 4);
                memcpy(untouched + 1, &parts.albedo_red[i], 4);
                assert_int_equal(untouched[0], 0x55555555);
                if (!stochastic) assert_int_equal(untouched[1], 0x55555555);
            }
            if (stochastic) assert_parts_sum_up(&whole, &parts, isa);
            else assert_memory_equal(whole.red, parts.red, sizeof whole.red);
        }
        fv_tracer_close(&room.small.tracer);
    }
    fv_workers_stop(&workers);
}

/* Every code of a colour comes back where no light is added; light and albedo come back to a code's width; the
 * sum is that of the radiances; flags stay. */
static void codes(void **state)
{
    (void)state;
    static uint32_t base[1024], dark[1024], other[1024], sum[1024];
    static float x[1024], y[1024], z[1024];
    FOR_EACH_ISA
    {
        const struct fv_kernels *k = fv_kernels((enum fv_isa)isa);
        for (uint32_t i = 0; i < 1024; i++) {
            base[i] = i | (1023 - i) << 10 | (i ^ 512) << 20 | (i & 3) << 30;
            dark[i] = i % 2 ? 0 : 0x3fffffff, other[i] = i % 2 ? 0x3fffffff : 0;
        }
        k->compose(base, dark, other, sum, 1024);
        for (int i = 0; i < 1024; i++)
            if (sum[i] != base[i]) fail_msg("isa %d: %08x becomes %08x", isa, base[i], sum[i]);
        static const float odd[] = {NAN, -1, -INFINITY, 0, INFINITY, 3e38f};
        static const unsigned lights[] = {0, 0, 0, 0, 1023, 1023}, albedos[] = {0, 0, 0, 0, 1023, 1023};
        for (int i = 0; i < 1024; i++) x[i] = i < 6 ? odd[i] : exp2f((float)(i - 700) / 50), y[i] = 0.18f, z[i] = 0;
        k->encode_light(x, y, z, 2, other, 1024);
        k->encode_albedo(x, y, z, dark, 1024);
        for (int i = 0; i < 1024; i++) {
            unsigned light = i < 6 ? lights[i] : (unsigned)lround(1023 * sqrt(2.0 * x[i] / (1 + 2.0 * x[i])));
            unsigned albedo = i < 6 ? albedos[i] : (unsigned)lround(1023 * sqrt(fmin(x[i], 1)));
            assert_true(abs((int)(other[i] & 1023) - (int)light) <= 1 && other[i] >> 20 == 0);
            assert_true(abs((int)(dark[i] & 1023) - (int)albedo) <= 1 && dark[i] >> 20 == 0);
        }
        /* 0.1 + albedo 0.5 * light, against the sum encoded at once. */
        for (int i = 0; i < 1024; i++) x[i] = 0.1f, y[i] = 0.5f, z[i] = exp2f((float)(i - 800) / 80);
        k->encode(x, x, x, 1, base, 1024);
        k->encode_albedo(y, y, y, dark, 1024);
        k->encode_light(z, z, z, 1, other, 1024);
        k->compose(base, dark, other, other, 1024);
        for (int i = 0; i < 1024; i++) x[i] += 0.5f * z[i];
        k->encode(x, x, x, 1, base, 1024);
        for (int i = 0; i < 1024; i++)
            if (abs((int)(other[i] & 1023) - (int)(base[i] & 1023)) > 3)
                fail_msg("isa %d: light %g: %u, not %u", isa, (double)z[i], other[i] & 1023, base[i] & 1023);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(cells_cover_the_square), cmocka_unit_test(turns_and_bases),
                                       cmocka_unit_test(occlusion), cmocka_unit_test(occlusion_at_any_size), cmocka_unit_test(fewer_rays),
                                       cmocka_unit_test(nothing_there), cmocka_unit_test(parts_are_the_whole),
                                       cmocka_unit_test(codes)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
