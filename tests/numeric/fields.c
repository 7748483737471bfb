/* fields: what fields evaluate to against an oracle in double (tests/support/field_oracle.h), on every instruction
 * set: primitives and random solids; that no ball of a field's value reaches a surface; that bounds hold what they
 * should; and the built-in scenes. */
#include "platform/cpu.h"
#include "config/config.h"
#include "rt/scene/build.h"
#include "tests/numeric/probe/field_probe.h"
#include "tests/support/field_oracle.h"
#include "tests/support/program.h"

enum { POINTS = 1024, SURFACE = 96, SOLIDS = 250, TEXT = 1 << 15 };

static _Alignas(64) float at[3][POINTS], value[POINTS];
static const float *const points[3] = {at[0], at[1], at[2]};

static fv_field_probe *probe_of(int isa)
{
    static fv_field_probe *const probes[FV_ISA_COUNT] = {[FV_ISA_BASE] = fv_field_probe_base,
#ifdef __x86_64__
                                                         [FV_ISA_AVX2] = fv_field_probe_avx2,
                                                         [FV_ISA_AVX512] = fv_field_probe_avx512,
#endif
    };
    return isa <= (int)fv_cpu_isa() ? probes[isa] : NULL;
}

static struct fv_fields read_text(const char *text)
{
    struct fv_fields fields;
    struct fv_error error;
    struct fv_build *build = fv_build_create("test");
    if (fv_fields_read(&fields, build, text, strlen(text), "test.field", 1, &error)) fail_msg("%s\n%s", error.text, text);
    fv_build_destroy(build);
    return fields;
}

static void scatter(uint64_t *r, double size)
{
    for (int i = 0; i < POINTS; i++) {
        double reach = i % 4 == 0 ? 4 * size : size;
        for (int k = 0; k < 3; k++) at[k][i] = (float)random_between(r, -reach, reach);
    }
}

static struct fv_fields read_solid(const struct oracle_tree *t, int root)
{
    static char text[TEXT] = "material a diffuse 1 1 1\nsolid a: ";
    size_t head = strlen("material a diffuse 1 1 1\nsolid a: ");
    assert_true(oracle_print(t, root, text + head, sizeof text - head) < TEXT - 64);
    return read_text(text);
}

static void primitives(void **state)
{
    (void)state;
    uint64_t r = 1;
    double worst = 0;
    for (int isa = 0; isa < FV_ISA_COUNT; isa++)
        for (int k = 0; k < 40 * ORACLE_PRIMITIVES && probe_of(isa); k++) {
            struct oracle_tree t = {.nodes = 0};
            double size = random_decade(&r, 1e-3, 1e5);
            int root = oracle_primitive(&t, (enum oracle_shape)(k % ORACLE_PRIMITIVES), &r, size);
            struct fv_fields f = read_solid(&t, root);
            scatter(&r, 2 * size);
            probe_of(isa)(&f, 0, f.parts - 1, POINTS, points, value);
            for (int i = 0; i < POINTS; i++) {
                double p[3] = {at[0][i], at[1][i], at[2][i]}, d = oracle_solid(&t, root, p);
                double off = fabs(value[i] - d) / size;
                if (!(off < 3e-5)) fail_msg("%s: %.9g, must be %.9g", oracle_names[t.node[root].shape], (double)value[i], d);
                worst = fmax(worst, off);
            }
        }
    print_message("primitives: off by at most %.1e of their size\n", worst);
}

/* Points on the surface, by bisection between points inside and outside. */
static int find_surface(const struct oracle_tree *t, int root, double out[SURFACE][3])
{
    int n = 0, inside[POINTS], insides = 0, outside[POINTS], outsides = 0;
    for (int i = 0; i < POINTS; i++) {
        double p[3] = {at[0][i], at[1][i], at[2][i]};
        if (oracle_solid(t, root, p) < 0) inside[insides++] = i;
        else outside[outsides++] = i;
    }
    for (; n < SURFACE && insides && outsides; n++) {
        double a[3], b[3], m[3];
        for (int k = 0; k < 3; k++) a[k] = at[k][inside[n % insides]], b[k] = at[k][outside[(n * 7) % outsides]];
        for (int step = 0; step < 40; step++) {
            for (int k = 0; k < 3; k++) m[k] = 0.5 * (a[k] + b[k]);
            memcpy(oracle_solid(t, root, m) < 0 ? a : b, m, sizeof m);
        }
        memcpy(out[n], a, sizeof a);
    }
    return n;
}

static double apart(int i, const double b[3])
{
    return sqrt(((double)at[0][i] - b[0]) * ((double)at[0][i] - b[0]) + ((double)at[1][i] - b[1]) * ((double)at[1][i] - b[1]) +
                ((double)at[2][i] - b[2]) * ((double)at[2][i] - b[2]));
}

static void within_bounds(const struct fv_fields *f, const double p[3], double size)
{
    bool box = false, ball = false;
    for (int k = 0; k < f->parts; k++) {
        const struct fv_field_part *part = &f->part[k];
        double d2 = (p[0] - f->x[k]) * (p[0] - f->x[k]) + (p[1] - f->y[k]) * (p[1] - f->y[k]) + (p[2] - f->z[k]) * (p[2] - f->z[k]);
        bool in = true;
        for (int i = 0; i < 3; i++) in &= p[i] >= part->low[i] - 1e-5 * size && p[i] <= part->high[i] + 1e-5 * size;
        box |= in;
        ball |= sqrt(d2) <= f->radius[k] + 1e-5 * size;
    }
    assert_true(box && ball);
}

static void random_solid(uint64_t *r, int isa, double *shortest, int *surfaces)
{
    struct oracle_tree t = {.nodes = 0};
    double size = random_decade(r, 0.01, 100), surface[SURFACE][3];
    int root = oracle_make(&t, 1 + (int)(random_bits(r) % 4), r, size);
    const struct oracle *o = &t.node[root];
    struct fv_fields f = read_solid(&t, root);
    double reach = isfinite(o->reach) ? o->reach : 20 * size, tolerance = 1e-4 * reach;
    scatter(r, reach);
    probe_of(isa)(&f, 0, f.parts - 1, POINTS, points, value);
    int n = find_surface(&t, root, surface);
    for (int s = 0; s < n; s++) within_bounds(&f, surface[s], reach);
    for (int i = 0; i < POINTS; i++) {
        double p[3] = {at[0][i], at[1][i], at[2][i]}, d = oracle_solid(&t, root, p);
        assert_true(isfinite(value[i]));
        if (fabs(d) > tolerance && (d < 0) != (value[i] < 0))
            fail_msg("%s: %.9g, must be %.9g", oracle_names[o->shape], (double)value[i], d);
        if (o->pure && !(fabs(value[i] - d) < tolerance)) fail_msg("%s: %.9g, must be %.9g", oracle_names[o->shape], (double)value[i], d);
        for (int s = 0; s < n && value[i] > 0; s++)
            if (value[i] > apart(i, surface[s]) + tolerance)
                fail_msg("%s: %.9g, but a surface %.9g away", oracle_names[o->shape], (double)value[i], apart(i, surface[s]));
        for (int j = (i + 1) % POINTS, k = 0; o->nonexpansive && k < 8; k++, j = (j * 5 + 3) % POINTS) {
            double b[3] = {at[0][j], at[1][j], at[2][j]};
            assert_true(fabs((double)value[i] - value[j]) <= apart(i, b) + tolerance);
        }
    }
    *surfaces += n > 0;
    for (int i = 0; i < POINTS && n > 0 && o->pure; i++)
        if (value[i] > 0) *shortest = fmin(*shortest, value[i] / fmax(oracle_solid(&t, root, (double[3]){at[0][i], at[1][i], at[2][i]}), 1e-9));
}

static void random_solids(void **state)
{
    (void)state;
    for (int isa = 0; isa < FV_ISA_COUNT; isa++) {
        uint64_t r = 7;
        int surfaces = 0;
        double shortest = INFINITY;
        for (int k = 0; k < SOLIDS && probe_of(isa); k++) random_solid(&r, isa, &shortest, &surfaces);
        if (probe_of(isa)) assert_true(surfaces > SOLIDS / 2);
    }
}

/* Steep ones: Lipschitz constants of 5 and more, by twist, waves and noise. */
static void steep(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        double least;
    } table[] = {{"twist(300, box(2, 3, 0.6))", 5}, {"displace(0.7, 1.1, sphere(1.5))", 4.9}, {"noise(0.5, 0.8, 0.6, 3, sphere(1.5))", 4.9},
                 {"twist(200, displace(0.1, 0.5, round_box(1, 3, 1, 0.1)))", 5}};
    uint64_t r = 3;
    for (unsigned k = 0; k < 4; k++) {
        char text[256];
        snprintf(text, sizeof text, "material a diffuse 1 1 1\nsolid a: %s", table[k].text);
        struct fv_fields f = read_text(text);
        assert_true(f.part[0].lipschitz >= table[k].least && f.part[0].lipschitz < 20);
        fv_field_probe *probe = probe_of((int)fv_cpu_isa());
        for (int round = 0; round < 40; round++) {
            /* Pairs of points near each other, and far. */
            scatter(&r, 3);
            for (int i = 1; i < POINTS; i += 2)
                for (int c = 0; c < 3; c++) at[c][i] = at[c][i - 1] + (float)random_between(&r, -1, 1) * (i % 4 == 1 ? 0.02f : 0.5f);
            probe(&f, 0, 0, POINTS, points, value);
            for (int i = 1; i < POINTS; i += 2) {
                double b[3] = {at[0][i], at[1][i], at[2][i]};
                bool crosses = (value[i] < 0) != (value[i - 1] < 0);
                assert_true(isfinite(value[i]));
                /* Of two points with the surface between them neither may say that it is farther than the other. */
                if (crosses) assert_true(fmax(value[i], value[i - 1]) <= apart(i - 1, b) + 1e-4);
            }
        }
    }
}

/* Spheres that fill their cells but for a little, beside the middle: never more than the distance to the nearest of
 * all, and beside the walls that itself. */
static void repetition(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        int from[3], to[3];
    } table[] = {{"repeat(1, 0, 1.5, 5, 0, 4, translate(0.1, 0.2, 0, sphere(0.39)))", {-2, 0, -2}, {2, 0, 1}},
                 {"repeat(1, 0, 1.5, 0, 0, 0, translate(0.1, 0.2, 0, sphere(0.39)))", {-12, 0, -9}, {12, 0, 9}},
                 {"repeat(1, 0, 1.5, 1, 0, 2, translate(0.1, 0.2, 0, sphere(0.39)))", {0, 0, -1}, {0, 0, 0}}};
    uint64_t r = 13;
    for (int k = 0; k < 3; k++) {
        char text[256];
        snprintf(text, sizeof text, "material a diffuse 1 1 1\nsolid a: %s", table[k].text);
        struct fv_fields f = read_text(text);
        int told = 0;
        for (int round = 0; round < 30; round++) {
            scatter(&r, 1 + round % 3);
            probe_of((int)fv_cpu_isa())(&f, 0, 0, POINTS, points, value);
            for (int i = 0; i < POINTS; i++) {
                double exact = INFINITY, even = table[k].to[2] == 9 ? 0 : 0.75;
                for (int x = table[k].from[0]; x <= table[k].to[0]; x++)
                    for (int z = table[k].from[2]; z <= table[k].to[2]; z++)
                        exact = fmin(exact, apart(i, (double[3]){x + 0.1, 0.2, z * 1.5 + even}) - 0.39);
                if (!(value[i] <= exact + 1e-5)) fail_msg("%s: %g, but a surface %g away", table[k].text, (double)value[i], exact);
                told += value[i] > exact - 1e-4;
            }
        }
        print_message("%s: exact at %.0f of 100 points\n", table[k].text, told / (0.3 * POINTS));
        assert_true(told > 30 * POINTS / 20);
    }
}

static void extreme_places(void **state)
{
    (void)state;
    static const char text[] = "material a diffuse 1 1 1\nlet s = sphere(1)\nsolid a: union(plane(0, 1, 0, 0), repeat(3, 0, 3, 0, 0, 0, s),\n"
                               "repeat(5, 5, 5, 3, 0, 1000000, box(1, 1, 1)), twist(90, box(1, 1, 2)), noise(0.2, 1, 0.5, 8, s), displace(0.1, 1, s),"
                               "mirror(1, 1, 1, translate(1, 1, 1, cone(1, 0, 2))))";
    static const float places[] = {0, -0.0f, 1e-38f, 1e-20f, 1, 1.5f, 2.5f, 1e6f, 1e9f, 1e15f, -1e6f, -1e12f, -1e15f};
    struct fv_fields f = read_text(text);
    uint64_t r = 5;
    for (int isa = 0; isa < FV_ISA_COUNT; isa++)
        for (int k = 0; k < 40 && probe_of(isa); k++) {
            for (int i = 0; i < POINTS; i++)
                for (int c = 0; c < 3; c++) at[c][i] = places[random_bits(&r) % (sizeof places / sizeof places[0])];
            probe_of(isa)(&f, 0, f.parts - 1, POINTS, points, value);
            for (int i = 0; i < POINTS; i++) assert_true(isfinite(value[i]));
        }
}

/* The built-in scenes: finite, and of two points with a surface between them neither lies farther from it. */
static void scenes(void **state)
{
    (void)state;
    static const char *const names[] = {"primitives", "columns", "temple"};
    for (int k = 0; k < 3; k++) {
        const char *text = fv_preset_text("fields", names[k]);
        assert_non_null(text);
        struct fv_fields f = read_text(text);
        fv_field_probe *probe = probe_of((int)fv_cpu_isa());
        uint64_t r = 11;
        int crossings = 0;
        for (int part = 0; part < f.parts; part++)
            for (int round = 0; round < 20; round++) {
                scatter(&r, 20);
                for (int i = 0; i < POINTS && isfinite(f.radius[part]); i++) {
                    const float centre[3] = {f.x[part], f.y[part], f.z[part]};
                    for (int c = 0; c < 3; c++) at[c][i] = centre[c] + (float)random_between(&r, -1, 1) * f.radius[part];
                }
                for (int i = 1; i < POINTS; i += 2)
                    for (int c = 0; c < 3; c++) at[c][i] = at[c][i - 1] + (float)random_between(&r, -1, 1) * (i % 4 == 1 ? 0.1f : 1.5f);
                probe(&f, part, part, POINTS, points, value);
                for (int i = 1; i < POINTS; i += 2) {
                    double b[3] = {at[0][i], at[1][i], at[2][i]};
                    assert_true(isfinite(value[i]));
                    if ((value[i] < 0) == (value[i - 1] < 0)) continue;
                    crossings++;
                    if (fmax(value[i], value[i - 1]) > apart(i - 1, b) + 1e-3)
                        fail_msg("%s, part %d: %g and %g, %g apart", names[k], part, (double)value[i - 1], (double)value[i], apart(i - 1, b));
                }
            }
        assert_true(crossings > 100);
    }
}

/* What is called convex is: halfway between two points its field is no more than their mean, which is what lets rays that
 * leave it never ask for it again. Nothing that only looks like it is called so. */
static void convex(void **state)
{
    (void)state;
    static const struct {
        const char *solid;
        bool is;
    } table[] = {{"sphere(1)", true}, {"box(1, 2, 1)", true}, {"round_box(1, 2, 1, 0.2)", true}, {"cylinder(1, 2)", true},
                 {"cone(1, 0.3, 2)", true}, {"cone(0.1, 1, 0.5)", true}, {"capsule(0, 0, 0, 1, 1, 0, 0.3)", true},
                 {"plane(0.3, 1, 0, 0.5)", true}, {"rotate(20, 30, 40, scale(1.5, box(1, 1, 2)))", true},
                 {"intersection(rotate(0, 30, 0, box(1, 1, 2)), translate(0.3, 0, 0, sphere(0.9)))", true},
                 {"torus(1, 0.3)", false}, {"difference(box(1, 1, 1), sphere(0.4))", false}, {"mirror(1, 0, 0, sphere(1))", false},
                 {"smooth_union(0.2, sphere(1), box(1, 1, 1))", false}, {"repeat(3, 0, 0, 3, 0, 0, sphere(1))", false},
                 {"twist(50, box(1, 1, 1))", false}, {"noise(0.1, 0.5, 0.5, 2, sphere(1))", false}, {"displace(0.1, 0.5, sphere(1))", false}};
    uint64_t r = 5;
    for (size_t k = 0; k < sizeof table / sizeof table[0]; k++) {
        char text[256];
        snprintf(text, sizeof text, "material a diffuse 1 1 1\nsolid a: %s", table[k].solid);
        struct fv_fields f = read_text(text);
        if (f.part[0].convex != table[k].is) fail_msg("%s: convex: %d", table[k].solid, f.part[0].convex);
        for (int round = 0; round < 50 && table[k].is; round++) {
            scatter(&r, 2);
            for (int i = 0; i + 2 < POINTS; i += 3)
                for (int c = 0; c < 3; c++) at[c][i + 2] = 0.5f * (at[c][i] + at[c][i + 1]);
            probe_of((int)fv_cpu_isa())(&f, 0, 0, POINTS, points, value);
            for (int i = 0; i + 2 < POINTS; i += 3)
                if (value[i + 2] > 0.5f * (value[i] + value[i + 1]) + 1e-5f)
                    fail_msg("%s: %g between %g and %g", table[k].solid, (double)value[i + 2], (double)value[i], (double)value[i + 1]);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(primitives), cmocka_unit_test(random_solids), cmocka_unit_test(steep), cmocka_unit_test(repetition),
                                       cmocka_unit_test(extreme_places), cmocka_unit_test(scenes), cmocka_unit_test(convex)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
