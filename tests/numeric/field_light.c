/* field_light: soft shadows whose rays are marched through fields: against closed forms, and against an oracle that marches
 * to every part of a light in double; lights that are degenerate, scenes of centimetres and of a hundred kilometres. On
 * every instruction set. */
#include "tests/support/field_oracle.h"
#include "tests/support/lit_fields.h"

enum { SOLIDS_MAX = 5, CELLS = 18 };

/* A primitive, moved. */
struct solid {
    enum oracle_shape shape;
    double n[7], at[3];
};

struct light {
    double corner[3], u[3], v[3];
};

struct stage {
    const char *name;
    struct solid solid[SOLIDS_MAX];
    int solids;
    struct light light;
};

/* ---- the oracle ---- */

static struct oracle_tree tree;
static int root[SOLIDS_MAX], roots;

static double distance(const double p[3])
{
    double least = INFINITY;
    for (int i = 0; i < roots; i++) least = fmin(least, oracle_solid(&tree, root[i], p));
    return least;
}

static size_t lay_out(const struct stage *s, double scale, char *text, size_t size)
{
    size_t at = 0;
    tree.nodes = roots = 0;
    for (int i = 0; i < s->solids; i++) {
        struct oracle *shape = &tree.node[tree.nodes], *moved = shape + 1;
        *shape = (struct oracle){.shape = s->solid[i].shape};
        *moved = (struct oracle){.shape = TRANSLATE, .child = {tree.nodes, -1}};
        /* A plane's normal is a direction. */
        for (int k = 0; k < 7; k++) shape->n[k] = s->solid[i].n[k] * (shape->shape == PLANE && k < 3 ? 1 : scale);
        for (int k = 0; k < 3; k++) moved->n[k] = s->solid[i].at[k] * scale;
        root[roots++] = tree.nodes + 1;
        tree.nodes += 2;
        at += (size_t)snprintf(text + at, size - at, "solid a: ");
        at += oracle_print(&tree, root[i], text + at, size - at);
        at += (size_t)snprintf(text + at, size - at, "\n");
    }
    return at;
}

static double normal_at(const double p[3], double h, double n[3])
{
    double length = 0;
    for (int k = 0; k < 3; k++) {
        double a[3] = {p[0], p[1], p[2]}, b[3] = {p[0], p[1], p[2]};
        a[k] -= h, b[k] += h;
        n[k] = distance(b) - distance(a);
        length += n[k] * n[k];
    }
    for (int k = 0; k < 3; k++) n[k] /= sqrt(length);
    return sqrt(length) / (2 * h);
}

static bool blocked(const double from[3], const double way[3], double length)
{
    double t = 0, nothing = 1e-7 * length;
    for (int i = 0; i < 1000 && t < length; i++) {
        double p[3], d;
        for (int k = 0; k < 3; k++) p[k] = from[k] + way[k] * t / length;
        d = distance(p);
        if (d < nothing) return true;
        t += d;
    }
    return false;
}

static void cross(const double a[3], const double b[3], double out[3])
{
    for (int k = 0; k < 3; k++) out[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Irradiance / pi of a light of radiance 1, cell by cell; `open`: as if nothing were in between. Else somewhere in each
 * cell, as the middles of all together would be more or less in a shadow than the light is. */
static double irradiance(const struct light *l, const double p[3], const double n[3], double offset, bool open)
{
    static uint64_t random = 5;
    double face[3], sum = 0, from[3];
    cross(l->u, l->v, face);
    for (int k = 0; k < 3; k++) from[k] = p[k] + offset * n[k];
    for (int i = 0; i < CELLS * CELLS; i++) {
        double a = 0.5, b = 0.5, way[3];
        if (!open) a = random_between(&random, 0, 1), b = random_between(&random, 0, 1);
        a = (a + i % CELLS) / CELLS, b = (b + (double)(i / CELLS)) / CELLS;
        for (int k = 0; k < 3; k++) way[k] = l->corner[k] + a * l->u[k] + b * l->v[k] - from[k];
        double r2 = dot(way, way), leaves = -dot(face, way), arrives = dot(n, way);
        if (leaves <= 0 || arrives <= 0) continue;
        if (open || !blocked(from, way, sqrt(r2))) sum += leaves * arrives / (r2 * r2);
    }
    return sum / (M_PI * CELLS * CELLS);
}

/* The same in closed form (Lambert 1760) where the light lies above p's horizon and shines to it. */
static double polygon(const struct light *l, const double p[3], const double n[3])
{
    double at[4][3], sum = 0;
    for (int i = 0; i < 4; i++) {
        double length;
        for (int k = 0; k < 3; k++) at[i][k] = l->corner[k] + (i == 1 || i == 2) * l->u[k] + (i >= 2) * l->v[k] - p[k];
        length = sqrt(dot(at[i], at[i]));
        for (int k = 0; k < 3; k++) at[i][k] /= length;
    }
    for (int i = 0; i < 4; i++) {
        double across[3];
        cross(at[i], at[(i + 1) % 4], across);
        sum += acos(dot(at[i], at[(i + 1) % 4])) * dot(across, n) / sqrt(dot(across, across));
    }
    return fabs(sum) / (2 * M_PI);
}

/* ---- lights ---- */

#define FLOOR {PLANE, {0, 1, 0, 0}, {0, 0, 0}}
#define LAMP {{-0.6, 3, -0.6}, {1.2, 0, 0}, {0, 0, 1.2}}

static const struct stage stages[] = {
    {"open", {FLOOR}, 1, LAMP},
    {"ball", {FLOOR, {SPHERE, {0.5}, {0, 1, 0}}}, 2, LAMP},
    {"ball on the floor", {FLOOR, {SPHERE, {0.6}, {0.3, 0.6, 0}}}, 2, LAMP},
    {"beam", {FLOOR, {BOX, {4, 0.2, 0.3}, {0, 1.4, 0}}}, 2, LAMP},
    {"ring and posts", {FLOOR, {TORUS, {0.7, 0.15}, {0, 1, 0}}, {CYLINDER, {0.1, 2}, {-1, 1, 0.3}}, {CAPSULE, {1, 0, 0, 1.2, 1.5, -0.4, 0.1}, {0, 0, 0}}},
     4, LAMP},
    {"upright", {FLOOR, {SPHERE, {0.3}, {-0.5, 0.35, 0}}}, 2, {{-3, 0.6, -0.5}, {0, 0, 1}, {0, -0.5, 0}}}, /* shines to +x */
    {"ball that the lamp cuts", {FLOOR, {SPHERE, {0.4}, {0, 3.1, 0}}}, 2, LAMP},
};
enum { STAGES = sizeof stages / sizeof stages[0] };

static const char *lamp_setting(const struct light *l, double scale)
{
    static char text[400];
    const double *n[] = {l->corner, l->u, l->v};
    int at = snprintf(text, sizeof text, "scene.area_lights=");
    for (int i = 0; i < 9; i++) at += snprintf(text + at, sizeof text - (size_t)at, "%.9g ", n[i / 3][i % 3] * scale);
    snprintf(text + at, sizeof text - (size_t)at, "1 1 1");
    return text;
}

static void open_stage(const struct stage *s, double scale)
{
    static char text[4096], far[64];
    const char *const sets[] = {lamp_setting(&s->light, scale), "method.area_spp=64", far};
    snprintf(far, sizeof far, "method.march_far=%g", fmax(2000, 20 * scale));
    lay_out(s, scale, text, sizeof text);
    open_scene(text, sets, 3);
}

/* A sample's point in the stage as it is at scale 1; false where it met nothing, or an edge between two surfaces. */
static bool point_of(const struct fv_view *view, const struct fv_samples *s, int i, double scale, double p[3], double n[3])
{
    if (!(s->inverse_depth[i] > 0)) return false;
    double slope;
    for (int k = 0; k < 3; k++) {
        double d = (double)(view->corner[k] + s->x[i] * view->dx[k] + s->y[i] * view->dy[k]);
        p[k] = (view->origin[k] + d / (double)s->inverse_depth[i]) / scale;
    }
    slope = normal_at(p, 2e-2, n);
    if (fabs(slope - 1) > 0.02) return false;
    normal_at(p, 1e-5, n);
    double off = distance(p);
    for (int k = 0; k < 3; k++) p[k] -= off * n[k];
    return true;
}

/* Worst, and mean of, what the samples are off the truth, in parts of the light that there is where it is brightest. */
static void against_oracle(const struct stage *s, double scale)
{
    struct fv_view view = look(0.1 * scale, 2.2 * scale, 3.6 * scale, -33, 30);
    double truth[GRID], brightest = 0;
    int penumbra = 0, dark = 0, counted = 0;
    open_stage(s, scale);
    lay_out(s, 1, (char[4096]){0}, 4096);
    trace(0, &view, 1, &samples);
    for (int i = 0; i < GRID; i++) {
        double p[3], n[3], open;
        truth[i] = NAN;
        if (!point_of(&view, &samples, i, scale, p, n)) continue;
        truth[i] = irradiance(&s->light, p, n, 2e-3, false);
        open = irradiance(&s->light, p, n, 2e-3, true);
        brightest = fmax(brightest, open);
        penumbra += truth[i] < 0.95 * open && truth[i] > 0.05 * open;
        dark += open > 0 && truth[i] < 0.05 * open;
        counted++;
    }
    assert_true(counted > 600);
    FOR_EACH_ISA
    {
        double worst = 0, bias = 0, square = 0;
        trace(isa, &view, 7, &samples);
        for (int i = 0; i < GRID; i++) {
            assert_true(samples.red[i] >= 0 && samples.red[i] <= FV_RADIANCE_MAX);
            if (isnan(truth[i])) continue;
            double off = ((double)samples.red[i] - truth[i]) / brightest;
            worst = fmax(worst, fabs(off));
            bias += off / counted;
            square += off * off / counted;
        }
        print_message("%s at %g, isa %d: %d penumbra, %d dark of %d; off by %.4f at worst, %.5f on average, %.4f rms\n", s->name,
                      scale, isa, penumbra, dark, counted, worst, bias, sqrt(square));
        assert_true(rays[FV_RAY_SHADOW] > 0 && rays[FV_RAY_SECONDARY] == 0 && rays[FV_RAY_MARCH_LIMITED] == 0);
        assert_true(worst < 0.08 && fabs(bias) < 2e-3 && sqrt(square) < 0.012);
    }
}

static void soft_shadows(void **state)
{
    (void)state;
    for (int k = 0; k < STAGES; k++) against_oracle(&stages[k], 1);
}

static void soft_shadows_at_any_size(void **state)
{
    static const double scales[] = {0.05, 30, 1e3, 1e5};
    (void)state;
    for (int k = 0; k < 4; k++) against_oracle(&stages[1], scales[k]);
}

/* What nothing keeps from a floor, in closed form; and half of it, where a slab's edge is right above. */
static void closed_forms(void **state)
{
    static const double up[3] = {0, 1, 0};
    static const struct stage half = {"half", {FLOOR, {BOX, {40, 0.05, 40}, {20, 1.5, 0}}}, 2, LAMP};
    (void)state;
    struct fv_view view = look(0, 2.2, 3.6, -33, 30);
    FOR_EACH_ISA
    {
        double bias = 0, worst = 0;
        int counted = 0;
        open_stage(&stages[0], 1);
        lay_out(&stages[0], 1, (char[4096]){0}, 4096);
        trace(isa, &view, 3, &samples);
        for (int i = 0; i < GRID; i++) {
            double p[3], n[3];
            if (!point_of(&view, &samples, i, 1, p, n)) continue;
            double truth = polygon(&stages[0].light, p, up), off = (double)samples.red[i] / truth - 1;
            assert_true(fabs(irradiance(&stages[0].light, p, up, 0, true) / truth - 1) < 2e-3);
            bias += off, worst = fmax(worst, fabs(off)), counted++;
        }
        print_message("open floor, isa %d: off by %.4f at worst, %.5f on average\n", isa, worst, bias / counted);
        assert_true(counted > 600 && worst < 0.02 && fabs(bias / counted) < 1e-3);
        /* A column of samples straight below the edge, from below the slab. */
        struct fv_view under = look(0, 0.6, 3, -20, 20);
        double share = 0, seen = 0;
        open_stage(&half, 1);
        memset(rays, 0, sizeof rays);
        small_grid(&samples, &under);
        for (int i = 0; i < GRID; i++) samples.x[i] = 128;
        fv_kernels_for((enum fv_isa)isa, fv_variant_for(small.scene.features))->trace(&small.tracer, &under, &samples, 5, rays);
        for (int i = 0; i < GRID; i++) {
            if (!(samples.inverse_depth[i] > 0)) continue;
            double p[3], d[3];
            for (int k = 0; k < 3; k++) {
                d[k] = (double)(under.corner[k] + samples.x[i] * under.dx[k] + samples.y[i] * under.dy[k]);
                p[k] = under.origin[k] + d[k] / (double)samples.inverse_depth[i];
            }
            if (fabs(p[1]) > 1e-2 || fabs(p[2]) > 8) continue; /* the slab ends at 20 */
            double truth = polygon(&half.light, p, up), part = (double)samples.red[i] / truth;
            assert_true(fabs(part - 0.5) < 0.12);
            share += part, seen++;
        }
        print_message("half of a light, isa %d: %.4f\n", isa, share / seen);
        assert_true(seen > 300 && fabs(share / seen - 0.5) < 0.005);
    }
}

/* What such lights send is 0 or none; never anything else than a number. */
static void odd_lights(void **state)
{
    static const struct {
        struct light light;
        bool dark, rays;
    } odd[] = {
        {{{-0.5, 3, -0.5}, {0, 0, 1}, {1, 0, 0}}, true, false},      /* looks up */
        {{{-0.5, -3, -0.5}, {0, 0, 1}, {1, 0, 0}}, true, true},      /* below the floor, which the ball's underside faces */
        {{{-0.5, 3, -0.5}, {1e-9, 0, 0}, {0, 0, 1e-9}}, false, true},
        {{{-0.1, 0.9, -0.1}, {0.2, 0, 0}, {0, 0, 0.2}}, true, true}, /* inside the ball, which all of its light is within */
        {{{-5, 0, -5}, {10, 0, 0}, {0, 0, 10}}, false, false},       /* on the floor */
        {{{-0.5, 0.5, 1}, {1, 0, 0}, {0, 1e-6, 1e-6}}, false, true}, /* a line of a micrometre */
        {{{-1e5, 1e5, -1e5}, {2e5, 0, 0}, {0, 0, 2e5}}, false, true},
        {{{-1e8, 2, -1e8}, {2e8, 0, 0}, {0, 0, 2e8}}, false, true},
    };
    static const char ball[] = "solid a: plane(0, 1, 0, 0)\nsolid a: translate(0, 1, 0, sphere(0.5))";
    struct fv_view view = look(0, 2.2, 3.6, -33, 30);
    (void)state;
    FOR_EACH_ISA for (size_t k = 0; k < sizeof odd / sizeof odd[0]; k++)
    {
        const char *const sets[] = {lamp_setting(&odd[k].light, 1), "method.area_spp=16"};
        open_scene(ball, sets, 2);
        trace(isa, &view, 1, &samples);
        for (int i = 0; i < GRID; i++) {
            assert_true(samples.red[i] >= 0 && samples.red[i] <= FV_RADIANCE_MAX);
            if (odd[k].dark && samples.inverse_depth[i] > 0 && samples.red[i] > 0)
                fail_msg("light %d, isa %d: sample %d shows %g", (int)k, isa, i, (double)samples.red[i]);
        }
        if (!odd[k].rays && odd[k].dark) assert_int_equal(rays[FV_RAY_SHADOW], 0);
        if (odd[k].rays) assert_true(rays[FV_RAY_SHADOW] > 0);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(soft_shadows, close_scene), cmocka_unit_test_teardown(soft_shadows_at_any_size, close_scene),
        cmocka_unit_test_teardown(closed_forms, close_scene), cmocka_unit_test_teardown(odd_lights, close_scene)};
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
