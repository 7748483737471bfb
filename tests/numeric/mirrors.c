/* mirrors: the depth that samples of flat mirrors have, that of the image behind them, in closed form, and what
 * samples say of surfaces: bent mirrors, glass, grazing ones. Every instruction set that this machine has. */
#include "tests/support/small_scene.h"

static const double no_turn[4] = {1, 0, 0, 0}, origin[3] = {0, 0, 0};

#define FOR_EACH_ISA for (int isa = 0; isa <= (int)fv_cpu_isa(); isa++)

static struct small_scene s;
static struct fv_samples samples;

static void plate(const double p[9], int cells, const struct fv_material *m)
{
    small_plate(&s, p, p + 3, p + 6, cells, fv_build_material(s.build, m));
}

static struct fv_material mirror(float weight, float diffuse)
{
    struct fv_material m = fv_material_default();
    for (int c = 0; c < 3; c++) m.mirror[c] = weight, m.diffuse[c] = diffuse;
    return m;
}

static void trace(int isa, const struct fv_view *view)
{
    int64_t rays[FV_RAY_KINDS] = {0};
    small_grid(&samples, view);
    fv_kernels((enum fv_isa)isa)->trace(&s.tracer, view, &samples, 1, rays);
}

/* The point's image at the plane through `at` with unit normal n. */
static void reflect(const double p[3], const double at[3], const double n[3], double out[3])
{
    double d = 0;
    for (int i = 0; i < 3; i++) d += (p[i] - at[i]) * n[i];
    for (int i = 0; i < 3; i++) out[i] = p[i] - 2 * d * n[i];
}

/* A mirror turned by an angle shows a wall behind the eye: the depth of every sample is that of the wall's
 * image, where the ray would meet it if it went straight on, less what keeps rays off surfaces. The eye's axis
 * is turned too. */
static void the_image_behind_a_mirror(void **state)
{
    (void)state;
    static const double turns_deg[] = {0, 5, -20, 35}, yaws[] = {0, 0.2, -0.15, 0.1};
    for (int k = 0; k < 4; k++) {
        double a = turns_deg[k] * M_PI / 180, n[3] = {sin(a), 0, cos(a)}, at[3] = {0, 0, -2}, q[4];
        double glass[9] = {-20 * cos(a), -20, -2 + 20 * sin(a), 40 * cos(a), 0, -40 * sin(a), 0, 40, 0};
        double wall[9] = {-300, -300, 3, 0, 600, 0, 600, 0, 0}, image[3], normal[3] = {0, 0, 1}, tip[3], foot[3];
        struct fv_material m = mirror(0.9f, 0.2f), plain = fv_material_default();
        small_begin(&s);
        plate(glass, 3, &m);
        plate(wall, 2, &plain);
        small_finish(&s);
        reflect(wall, at, n, image);
        for (int i = 0; i < 3; i++) tip[i] = wall[i] + normal[i];
        reflect(tip, at, n, foot);
        for (int i = 0; i < 3; i++) normal[i] = foot[i] - image[i];
        fv_quat_from_yaw_pitch_roll(yaws[k], 0.05, 0.1, q);
        struct fv_view view = small_view(origin, q, 20, 256);
        FOR_EACH_ISA
        {
            trace(isa, &view);
            for (int i = 0; i < 1024; i++) {
                double above = 0, below = 0;
                for (int c = 0; c < 3; c++) {
                    double d = view.corner[c] + (double)view.dx[c] * samples.x[i] + (double)view.dy[c] * samples.y[i];
                    above += normal[c] * image[c], below += normal[c] * d;
                }
                if (!(fabs(samples.inverse_depth[i] * above / below - 1) < 3e-4) || samples.surface[i] != 0)
                    fail_msg("turned by %g deg, sample %d: %g, not %g; surface %d", turns_deg[k], i,
                             (double)samples.inverse_depth[i], below / above, samples.surface[i]);
            }
        }
        fv_tracer_close(&s.tracer);
    }
}

/* Two mirrors facing each other, the eye in between: as far as the chain goes. */
static void chains(void **state)
{
    (void)state;
    struct fv_view view = small_view(origin, no_turn, 5, 256);
    struct fv_material m = mirror(0.9f, 0);
    static const double here[9] = {-50, -50, -2, 100, 0, 0, 0, 100, 0}, there[9] = {-50, -50, 1, 0, 100, 0, 100, 0, 0};
    small_begin(&s);
    plate(here, 1, &m);
    plate(there, 1, &m);
    small_finish(&s);
    FOR_EACH_ISA for (int depth = 0; depth <= 8; depth++)
    {
        s.tracer.depth = depth;
        trace(isa, &view);
        for (int i = 0; i < 1024; i++)
            if (!(fabs(samples.inverse_depth[i] * (2 + 3 * depth) - 1) < 1e-4) || samples.surface[i] != FV_SURFACE_VIEW)
                fail_msg("chain of %d: depth %g, surface %d", depth, 1 / (double)samples.inverse_depth[i], samples.surface[i]);
    }
    fv_tracer_close(&s.tracer);
}

/* A plate at -2 m whose corners' normals lean outwards by `lean`. */
static void bent_plate(double lean, const struct fv_material *m)
{
    int material = fv_build_material(s.build, m);
    uint32_t first = fv_build_vertices(s.build);
    for (int i = 0; i < 4; i++) {
        float x = i % 2 ? 20 : -20, y = i / 2 ? 20 : -20;
        struct fv_vertex v = {.position = {x, y, -2}, .normal = {(float)lean * x / 20, (float)lean * y / 20, 1}};
        fv_build_vertex(s.build, &v);
    }
    fv_build_triangle(s.build, first, first + 1, first + 3, material);
    fv_build_triangle(s.build, first, first + 3, first + 2, material);
}

static void what_is_no_flat_mirror(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        float weight, diffuse, transmission;
        double lean, wall, expected; /* wall: 0: none; expected: depth, 0: none */
        int surface;
    } cases[] = {
        {"flat", 0.9f, 0.1f, 0, 0, 3, 7, 0},
        {"flat to rounding", 0.9f, 0.1f, 0, 1e-4, 3, 7, 0},
        {"nothing to show", 0.9f, 0.1f, 0, 0, 0, 0, 0},
        {"bent", 0.9f, 0.1f, 0, 0.1, 3, 2, FV_SURFACE_VIEW},
        {"hardly bent", 0.9f, 0.1f, 0, 3e-3, 3, 2, FV_SURFACE_VIEW},
        {"scatters more", 0.3f, 0.6f, 0, 0, 3, 2, FV_SURFACE_VIEW},
        {"too dark to be followed", 0.001f, 0, 0, 0, 3, 2, 0},
        {"glass", 0, 0, 0.9f, 0, 3, 2, FV_SURFACE_VIEW},
        {"wall", 0, 0.5f, 0, 0, 3, 2, 0},
    };
    struct fv_view view = small_view(origin, no_turn, 20, 256);
    for (unsigned k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        struct fv_material m = mirror(cases[k].weight, cases[k].diffuse), plain = fv_material_default();
        for (int c = 0; c < 3; c++) m.transmission[c] = cases[k].transmission;
        m.ior = 1.5f;
        double wall[9] = {-300, -300, cases[k].wall, 0, 600, 0, 600, 0, 0};
        small_begin(&s);
        bent_plate(cases[k].lean, &m);
        if (cases[k].wall > 0) plate(wall, 2, &plain);
        small_finish(&s);
        FOR_EACH_ISA
        {
            trace(isa, &view);
            for (int i = 0; i < 1024; i++) {
                double expected = cases[k].expected > 0 ? 1 / cases[k].expected : 0;
                if (!(fabs(samples.inverse_depth[i] - expected) < 2e-4 * expected + 1e-9) ||
                    samples.surface[i] != cases[k].surface)
                    fail_msg("%s, sample %d: %g, not %g; surface %d", cases[k].name, i,
                             (double)samples.inverse_depth[i], expected, samples.surface[i]);
            }
        }
        fv_tracer_close(&s.tracer);
    }
}

/* A wall through (0, 0, -2) leaning back by an angle is grazing where its normal's cosine to the axis is below
 * epsilon, wherever in the picture it is; the sky never is. */
static void grazing(void **state)
{
    (void)state;
    static const double leans_deg[] = {0, 45, 84.2, 84.4, 89, 90, 95, -84.2, -84.4};
    static const float epsilons[] = {0, 0.1f, 0.5f, 1};
    struct fv_view view = small_view(origin, no_turn, 60, 256);
    struct fv_material plain = fv_material_default();
    for (unsigned k = 0; k < sizeof leans_deg / sizeof leans_deg[0]; k++) {
        double a = leans_deg[k] * M_PI / 180;
        double wall[9] = {-50, -1 - 50 * cos(a), -2 + 50 * sin(a), 100, 0, 0, 0, 100 * cos(a), -100 * sin(a)};
        small_begin(&s);
        plate(wall, 1, &plain);
        small_finish(&s);
        FOR_EACH_ISA for (int e = 0; e < 4; e++)
        {
            int hits = 0;
            s.tracer.epsilon_grazing = epsilons[e];
            trace(isa, &view);
            for (int i = 0; i < 1024; i++) {
                bool hit = samples.inverse_depth[i] > 0;
                double d = view.corner[1] + (double)view.dy[1] * samples.y[i];
                double facing = sin(a) * d - cos(a) < 0 ? cos(a) : -cos(a); /* of the side that shows */
                bool expected = hit && fmax(facing, 0) < epsilons[e] - 1e-6;
                hits += hit;
                if (samples.surface[i] != (expected ? FV_SURFACE_GRAZING : 0))
                    fail_msg("lean %g, epsilon %g: surface %d", leans_deg[k], (double)epsilons[e], samples.surface[i]);
            }
            assert_true(hits > 100);
        }
        fv_tracer_close(&s.tracer);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(the_image_behind_a_mirror), cmocka_unit_test(chains),
                                       cmocka_unit_test(what_is_no_flat_mirror), cmocka_unit_test(grazing)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
