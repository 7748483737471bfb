/* slivers: hits on triangles a million times as long as wide, on degenerate ones, on corners whose normals
 * are none, and light from lamps in places where none should be: exact where an answer is, finite everywhere.
 * Every instruction set that this machine has. */
#include "tests/support/small_scene.h"

static const double no_turn[4] = {1, 0, 0, 0}, origin[3] = {0, 0, 0};

#define FOR_EACH_ISA for (int isa = 0; isa <= (int)fv_cpu_isa(); isa++)

static void trace(struct small_scene *s, struct fv_samples *samples, const struct fv_view *view, int isa)
{
    int64_t rays[FV_RAY_KINDS] = {0};
    small_grid(samples, view);
    fv_kernels((enum fv_isa)isa)->trace(&s->tracer, view, samples, 1, rays);
    for (int i = 0; i < 1024; i++) {
        assert_true(samples->red[i] >= 0 && samples->red[i] <= FV_RADIANCE_MAX);
        float w = samples->inverse_depth[i];
        assert_true((w >= 0 && w <= FV_INVERSE_DEPTH_MAX) || w == FV_DEPTH_UNKNOWN);
    }
}

/* A slanted wall of strips, each `aspect` times as long as wide, before a lamp beside the eye. Strips to be
 * seen at all are a pixel wide, so that the view narrows with them. */
static void walls_of_slivers(void **state)
{
    (void)state;
    static struct small_scene s;
    static struct fv_samples samples;
    static const struct {
        double aspect, distance, tilt;
    } rows[] = {{1, 1, 0.5},   {1e3, 1, 0.5},    {1e4, 1, 0.5},   {1e5, 1, 0.5},
                {1e6, 1, 0.5}, {1e6, 1e-4, 0.3}, {1e6, 1e6, 0.5}, {1e6, 5, 0}};
    for (unsigned r = 0; r < sizeof rows / sizeof *rows; r++) {
        double d = rows[r].distance, length = 2 * d, width = length / rows[r].aspect;
        struct fv_material white = fv_material_default();
        for (int c = 0; c < 3; c++) white.diffuse[c] = 1;
        small_begin(&s);
        int m = fv_build_material(s.build, &white);
        int n = rows[r].aspect > 100 ? 200 : 2;
        double across = width * n, t = rows[r].tilt, sine = sin(0.6), cosine = cos(0.6);
        /* n strips side by side, by hand: small_plate makes squares. */
        for (int i = 0; i < n; i++) {
            double a = across * ((double)i / n - 0.5), b = -length / 2;
            double x = a * cosine - b * sine, y = a * sine + b * cosine;
            double corner[3] = {x, y, -d + t * y}, u[3] = {width * cosine, width * sine, t * width * sine};
            double v[3] = {-length * sine, length * cosine, t * length * cosine};
            small_plate(&s, corner, u, v, 1, m);
        }
        small_finish(&s);
        s.scene.lights = 1;
        s.scene.light[0] = (struct fv_light){.kind = FV_LIGHT_POINT};
        for (int c = 0; c < 3; c++) s.scene.light[0].colour[c] = (float)(d * d);
        struct fv_view view = small_view(origin, no_turn, atan(across / 2.2 / d) * 180 / M_PI, 512);
        FOR_EACH_ISA
        {
            trace(&s, &samples, &view, isa);
            int hit = 0, dark = 0;
            double worst = 0; /* relative */
            for (int i = 0; i < 1024; i++) {
                if (samples.inverse_depth[i] == 0) continue;
                double y = (1 - samples.y[i] / 256) * (across / 2.2 / d), depth = d / (1 + t * y);
                hit++;
                dark += !(samples.red[i] > 0);
                worst = fmax(worst, fabs(samples.inverse_depth[i] * depth - 1));
            }
            if (dark || hit < 500 || worst > 1e-6)
                fail_msg("aspect %g at %g m: %d hit, %d dark, depth off by %g", rows[r].aspect, d, hit, dark,
                         worst);
        }
        fv_tracer_close(&s.tracer);
    }
}

/* Walls of two triangles far larger than what is seen of them, and flat ones (three long edges, one corner
 * almost on the edge opposite), close up: lit where the lamp is beside the eye, and dark under a lid. */
static void large_and_flat_triangles(void **state)
{
    (void)state;
    static struct small_scene s;
    static struct fv_samples samples;
    static const struct {
        double size, distance, flat, place; /* flat: height over length, 0: halves of a square */
    } rows[] = {{10, 1e-4, 0, 0},  {1000, 0.01, 0, 3}, {1e6, 1, 0, -7}, {1e6, 1e6, 0, 0},
                {100, 10, 0, 1e6}, {2, 1, 1e-2, 0},    {2, 1, 1e-4, 5}, {2, 1, 1e-5, 0}};
    for (unsigned r = 0; r < sizeof rows / sizeof *rows; r++) {
        double d = rows[r].distance, half = rows[r].size / 2, flat = rows[r].flat, p = rows[r].place, t = 0.4;
        struct fv_material white = fv_material_default();
        small_begin(&s);
        int m = fv_build_material(s.build, &white);
        if (flat == 0) {
            double corner[3] = {p - half, p - half * 1.1, p - d - t * half * 1.1},
                   u[3] = {2 * half, 0.2 * half, t * 0.2 * half}, v[3] = {0, 2 * half, t * 2 * half};
            small_plate(&s, corner, u, v, 1, m);
        } else {
            double at[3][2] = {{-half, -half * 0.3}, {half, half * 0.3}, {0.1, 0.03 + flat * 2 * half}};
            uint32_t v[3];
            for (int i = 0; i < 3; i++) {
                struct fv_vertex x = {.position = {(float)(p + at[i][0]), (float)(p + at[i][1]),
                                                   (float)(p - d + t * at[i][1])}};
                v[i] = fv_build_vertex(s.build, &x);
            }
            fv_build_triangle(s.build, v[0], v[1], v[2], m);
        }
        small_finish(&s);
        s.scene.lights = 1;
        s.scene.light[0] =
            (struct fv_light){.kind = FV_LIGHT_POINT, .position = {(float)p, (float)p, (float)p}};
        for (int c = 0; c < 3; c++) s.scene.light[0].colour[c] = (float)(d * d);
        double at[3] = {p, p, p};
        struct fv_view view = small_view(at, no_turn, flat > 0 ? fmin(30, flat * 100) : 20, 512);
        FOR_EACH_ISA
        {
            trace(&s, &samples, &view, isa);
            int hit = 0, dark = 0;
            for (int i = 0; i < 1024; i++)
                hit += samples.inverse_depth[i] > 0,
                    dark += samples.inverse_depth[i] > 0 && !(samples.red[i] > 0);
            if (dark || (flat == 0 && hit < 1024) || !hit)
                fail_msg("size %g at %g m, flat %g: %d hit, %d dark", rows[r].size, d, flat, hit, dark);
        }
        fv_tracer_close(&s.tracer);
    }
}

/* Triangles that are none are left out, wherever their corners stand: to the bit the scene without them. */
static void degenerate_triangles(void **state)
{
    (void)state;
    static struct small_scene s[2];
    static struct fv_samples samples[2];
    static const float odd[][3][3] = {
        {{0, 0, -1}, {0, 0, -1}, {0, 0, -1}},          {{0, 0, -1}, {0.1f, 0, -1}, {0, 0, -1}},
        {{-1, -1, -1}, {0, 0, -1}, {1, 1, -1}},        {{1e-30f, 0, -1}, {0, 1e-30f, -1}, {0, 0, -1}},
        {{-1e30f, 0, -1}, {1e30f, 0, -1}, {0, 0, -1}}, {{3e38f, 0, -1}, {-3e38f, 1, -1}, {0, 3e38f, -1}}};
    for (int i = 0; i < 2; i++) {
        static const double corner[3] = {-2, -2, -2}, u[3] = {4, 0, 0}, v[3] = {0, 4, 0};
        struct fv_material grey = fv_material_default();
        small_begin(&s[i]);
        int m = fv_build_material(s[i].build, &grey);
        small_plate(&s[i], corner, u, v, 3, m);
        for (unsigned k = 0; i && k < sizeof odd / sizeof *odd; k++) {
            uint32_t first = fv_build_vertices(s[i].build);
            for (int j = 0; j < 3; j++) {
                struct fv_vertex x = {.position = {odd[k][j][0], odd[k][j][1], odd[k][j][2]}};
                fv_build_vertex(s[i].build, &x);
            }
            fv_build_triangle(s[i].build, first, first + 1, first + 2, m);
        }
        small_finish(&s[i]);
        s[i].scene.lights = 1;
        s[i].scene.light[0] =
            (struct fv_light){.kind = FV_LIGHT_POINT, .position = {0.5f, 1, 0}, .colour = {5, 5, 5}};
    }
    struct fv_view view = small_view(origin, no_turn, 60, 512);
    FOR_EACH_ISA
    {
        for (int i = 0; i < 2; i++) trace(&s[i], &samples[i], &view, isa);
        assert_memory_equal(samples[0].red, samples[1].red, sizeof samples[0].red);
        assert_memory_equal(samples[0].inverse_depth, samples[1].inverse_depth,
                            sizeof samples[0].inverse_depth);
    }
    for (int i = 0; i < 2; i++) fv_tracer_close(&s[i].tracer);
}

/* Corner normals of all kinds on a matt wall with a lamp in front: a colour between 0 and that of a lamp
 * straight above, whatever they are; where all are the wall's own, turned round or missing, the formula's. */
static void corner_normals(void **state)
{
    (void)state;
    static struct small_scene s;
    static struct fv_samples samples;
    static const struct {
        float normal[3][3];
        bool usual;
    } rows[] = {{{{0, 0, 1}, {0, 0, 1}, {0, 0, 1}}, true},
                {{{0, 0, -1}, {0, 0, -1}, {0, 0, -1}}, true},
                {{{0}}, true},
                {{{NAN, 0, 0}, {INFINITY, 0, 1}, {0, -INFINITY, 0}}, true},
                {{{0, 0, 1e30f}, {0, 0, 1e-30f}, {0, 0, 3e38f}}, true},
                {{{0, 0, 1e-45f}, {0, 0, 1}, {0, 0, 1}}, true},
                {{{0, 0, 1}, {0, 0, -1}, {0, 0, 1}}, false},
                {{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}}, false},
                {{{1, 0, 0}, {-1, 0, 0}, {1, 0, 0}}, false},
                {{{1, 0, -1}, {-1, 0, -1}, {0, 1, 1}}, false}};
    for (unsigned r = 0; r < sizeof rows / sizeof *rows; r++) {
        static const float at[3][2] = {{-20, -20}, {20, -20}, {0, 30}};
        struct fv_material white = fv_material_default();
        for (int c = 0; c < 3; c++) white.diffuse[c] = 1, white.specular[c] = 0;
        small_begin(&s);
        int m = fv_build_material(s.build, &white);
        for (int i = 0; i < 3; i++) {
            struct fv_vertex x = {.position = {at[i][0], at[i][1], -2}};
            memcpy(x.normal, rows[r].normal[i], sizeof x.normal);
            fv_build_vertex(s.build, &x);
        }
        fv_build_triangle(s.build, 0, 1, 2, m);
        small_finish(&s);
        s.scene.lights = 1;
        s.scene.light[0] =
            (struct fv_light){.kind = FV_LIGHT_SUN, .position = {0, 0, 1}, .colour = {3, 3, 3}};
        struct fv_view view = small_view(origin, no_turn, 60, 512);
        FOR_EACH_ISA
        {
            trace(&s, &samples, &view, isa);
            for (int i = 0; i < 1024; i++) {
                double most = 3 / M_PI;
                assert_true(samples.red[i] <= most * (1 + 1e-5));
                if (rows[r].usual && !(fabs(samples.red[i] / most - 1) < 1e-4))
                    fail_msg("normals %u: %g", r, (double)samples.red[i]);
            }
        }
        fv_tracer_close(&s.tracer);
    }
}

/* Lamps in a point, in all places: on the wall, behind it, a hair above it, far off, of any strength. */
static void lamps(void **state)
{
    (void)state;
    static struct small_scene s;
    static struct fv_samples samples;
    static const struct {
        double x, y, z, strength; /* z: above the wall */
    } rows[] = {{0, 0, 0, 1},
                {0.01, 0.02, 0, 1e30},
                {0, 0, -1, 1},
                {0, 0, -1e-6, 1e6},
                {0.013, -0.02, 1e-3, 1},
                {0.01, 0.02, 1e-6, 1},
                {0, 0, 1.9, 3},
                {1, -2, 1e6, 1e12},
                {1e6, 0, 1, 1e12},
                {0, 0, 1e18, 1e36},
                {0, 0, 1, 0},
                {0, 0, 1, 1e30},
                {0, 0, 1, 3e38}};
    struct fv_material white = fv_material_default();
    for (int c = 0; c < 3; c++) white.diffuse[c] = 1;
    small_begin(&s);
    double corner[3] = {-5, -5, -2}, u[3] = {10, 0, 0}, v[3] = {0, 10, 0};
    small_plate(&s, corner, u, v, 3, fv_build_material(s.build, &white));
    small_finish(&s);
    s.scene.lights = 1;
    struct fv_view view = small_view(origin, no_turn, 20, 512);
    FOR_EACH_ISA
    for (unsigned r = 0; r < sizeof rows / sizeof *rows; r++) {
        struct fv_light *l = &s.scene.light[0];
        *l = (struct fv_light){.kind = FV_LIGHT_POINT,
                               .position = {(float)rows[r].x, (float)rows[r].y, (float)(rows[r].z - 2)}};
        for (int c = 0; c < 3; c++) l->colour[c] = (float)rows[r].strength;
        trace(&s, &samples, &view, isa);
        for (int i = 0; i < 1024; i++) {
            long double t = tanl(20 * acosl(-1) / 180) * 2, x = (samples.x[i] / 256 - 1) * t,
                        y = (1 - samples.y[i] / 256) * t;
            long double dx = l->position[0] - x, dy = l->position[1] - y,
                        dz = (long double)l->position[2] + 2;
            long double d2 = dx * dx + dy * dy + dz * dz,
                        exact = dz > 0 ? l->colour[0] / acosl(-1) * dz / sqrtl(d2) / d2 : 0;
            /* A lamp lower than the shadow rays' start does not shine on the wall. */
            if (dz > 0 && dz < 1e-5L && samples.red[i] == 0) continue;
            if (exact > 1e30L || !(d2 < 1e36L)) continue; /* unknown, or too far to tell */
            if (!(fabsl(samples.red[i] - exact) <= 2e-3L * exact + (dz < 1e-2L ? 1e-2L * exact : 0)))
                fail_msg("lamp %u (%s): %g at %Lg %Lg, not %Lg", r, fv_cpu_isa_name((enum fv_isa)isa),
                         (double)samples.red[i], x, y, exact);
        }
    }
    fv_tracer_close(&s.tracer);
}

/* Area lights of no extent, and around the surface itself. */
static void area_lamps(void **state)
{
    (void)state;
    static struct small_scene s;
    static struct fv_samples samples;
    static const float rows[][9] = {{0, 0, 1, 0, 0, 0, 0, 0, 0},
                                    {0, 0, 1, 1, 0, 0, 1, 0, 0},
                                    {-1, 1, -2, 2, 0, 0, 0, -2, 0},
                                    {-1, 1, -2.5f, 2, 0, 0, 0, -2, 0},
                                    {-1, 1, -1.999999f, 2, 0, 0, 0, -2, 0},
                                    {-1, 1, -1.9999f, 2, 0, 0, 0, -2, 0},
                                    {-1e6f, 1e6f, 1e6f, 2e6f, 0, 0, 0, -2e6f, 0},
                                    {0, 0, 1, 1e-30f, 0, 0, 0, -1e-30f, 0},
                                    {-1e18f, 1e18f, 1, 2e18f, 0, 0, 0, -2e18f, 0}};
    struct fv_material white = fv_material_default();
    small_begin(&s);
    double corner[3] = {-5, -5, -2}, u[3] = {10, 0, 0}, v[3] = {0, 10, 0};
    small_plate(&s, corner, u, v, 3, fv_build_material(s.build, &white));
    static const struct fv_light any = {.kind = FV_LIGHT_AREA, .u = {1, 0, 0}, .v = {0, 1, 0}};
    struct fv_error error;
    assert_int_equal(fv_build_light(s.build, &any, &error), 0);
    small_finish(&s);
    struct fv_view view = small_view(origin, no_turn, 20, 512);
    FOR_EACH_ISA
    for (unsigned r = 0; r < sizeof rows / sizeof *rows; r++) {
        struct fv_light *l = &s.scene.light[0];
        *l = (struct fv_light){.kind = FV_LIGHT_AREA, .colour = {1, 1, 1}};
        memcpy(l->position, rows[r], 12), memcpy(l->u, rows[r] + 3, 12), memcpy(l->v, rows[r] + 6, 12);
        trace(&s, &samples, &view, isa);
        for (int i = 0; i < 1024; i++)
            if (r < 4 && samples.red[i] != 0) fail_msg("area light %u: %g", r, (double)samples.red[i]);
    }
    fv_tracer_close(&s.tracer);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(walls_of_slivers),
                                       cmocka_unit_test(large_and_flat_triangles),
                                       cmocka_unit_test(degenerate_triangles),
                                       cmocka_unit_test(corner_normals),
                                       cmocka_unit_test(lamps),
                                       cmocka_unit_test(area_lamps)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
