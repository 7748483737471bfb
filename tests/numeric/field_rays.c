/* field_rays: rays through fields where they are at their limits: along and inside surfaces, from on and within
 * them, in scenes of a millimetre and of a thousand kilometres, without end, with nothing, at the limit of steps;
 * that leaving parts out, stepping farther and starting late change nothing; and fields beside triangles. On every
 * instruction set. */
#include "tests/support/random.h"
#include "tests/support/small_scene.h"

enum { SIDE = 32, GRID = SIDE * SIDE };

static struct small_scene small;
static struct fv_samples samples, other;
static int64_t rays[FV_RAY_KINDS];

#define M "material a diffuse 0.5 0.5 0.5\n"

static bool opened;

static int close_scene(void **state)
{
    (void)state;
    if (opened) fv_tracer_close(&small.tracer);
    opened = false;
    return 0;
}

static void open_scene_and(const char *text, const char *more, const char *last)
{
    char set[4][256], path[128];
    close_scene(NULL);
    program_write("scene.field", text, strlen(text));
    snprintf(path, sizeof path, "scene.fields=%s/scene.field", program_folder());
    snprintf(set[0], sizeof set[0], "%s", path);
    struct fv_config_request request = {
        .sets = 5,
        .set = {"scene.name=none", set[0], "scene.point_lights=0 30 0 900 900 900", more ? more : "scene.file=", last}};
    struct fv_error error;
    memset(&small, 0, sizeof small);
    if (fv_config_load(&small.config, &request, &error) || fv_scene_load(&small.scene, &small.config, &error) ||
        fv_tracer_open(&small.tracer, &small.scene, &small.config, &error))
        fail_msg("%s", error.text);
    opened = true;
}

static void open_scene(const char *text, const char *more)
{
    open_scene_and(text, more, "display.eyes=1");
}

static struct fv_view look(double x, double y, double z, double half_deg)
{
    static const double ahead[4] = {1, 0, 0, 0};
    return small_view((double[3]){x, y, z}, ahead, half_deg, 256);
}

static void trace(int isa, const struct fv_view *view, struct fv_samples *out)
{
    memset(rays, 0, sizeof rays);
    out->started = false;
    small_grid(out, view);
    fv_kernels_for((enum fv_isa)isa, fv_variant_for(small.scene.features))->trace(&small.tracer, view, out, 1, rays);
}

static int hits(const struct fv_samples *s)
{
    int n = 0;
    for (int i = 0; i < GRID; i++) n += s->inverse_depth[i] > 0;
    return n;
}

static void sound(const struct fv_samples *s)
{
    for (int i = 0; i < GRID; i++)
        assert_true(s->red[i] >= 0 && s->red[i] <= FV_RADIANCE_MAX && s->inverse_depth[i] >= 0 && s->inverse_depth[i] <= FV_INVERSE_DEPTH_MAX);
}

/* A sphere's hits against the quadratic, from a thousandth to a million metres. */
static void scales(void **state)
{
    (void)state;
    for (int isa = 0; isa <= (int)fv_cpu_isa(); isa++)
        for (double size = 1e-3; size < 2e6; size *= 1000) {
            char text[256], far[64];
            snprintf(text, sizeof text, M "solid a: scale(%g, translate(0.2, 0.1, -3, sphere(1)))", size);
            snprintf(far, sizeof far, "method.march_far=%g", fmin(10 * size + 10, 1e9));
            open_scene(text, far);
            struct fv_view view = look(0, 0, 0, 30);
            trace(isa, &view, &samples);
            sound(&samples);
            int seen = 0;
            for (int i = 0; i < GRID; i++) {
                double d[3], dd = 0, dc = 0, cc = -1, c[3] = {0.2, 0.1, -3};
                for (int k = 0; k < 3; k++) {
                    d[k] = view.corner[k] + samples.x[i] * view.dx[k] + samples.y[i] * view.dy[k];
                    dd += d[k] * d[k], dc += d[k] * c[k], cc += c[k] * c[k];
                }
                double inside = dc * dc - dd * cc, t = size * (dc - sqrt(fmax(inside, 0))) / dd;
                double slack = 1e-4 * t * sqrt(dd) + 1e-4;
                if (inside < 0.02 && size < 0.1) continue; /* a threshold of a tenth of the radius */
                if (fabs(inside) < 0.02) continue;
                seen += inside > 0;
                if ((inside > 0) != (samples.inverse_depth[i] > 0)) fail_msg("size %g: sample %d hits where it must not or misses", size, i);
                if (inside > 0) assert_true(fabs(1 / samples.inverse_depth[i] - t) <= 8 * slack + 1e-5 * t);
            }
            assert_true(seen > 100);
        }
}

static const struct {
    const char *text;
    double at[3];
    int least, most; /* hits */
    bool at_once;    /* all at t = 0 */
} limits[] = {
    {M "solid a: plane(0, 1, 0, 0)", {0, 1, 0}, 480, 544, false},
    {M "solid a: plane(0, 1, 0, 0)", {0, 0, 0}, 1024, 1024, true},       /* on it */
    {M "solid a: plane(0, 1, 0, 0)", {0, 1e-5, 0}, 1024, 1024, true},    /* as near as counts */
    {M "solid a: plane(0, 1, 0, 0)", {0, -5, 0}, 1024, 1024, true},      /* within */
    {M "solid a: sphere(3)", {0, 0, 1}, 1024, 1024, true},
    {M "solid a: sphere(3)", {0, 0, 3}, 1024, 1024, true},               /* on it, looking in */
    {M "solid a: sphere(3)", {0, 0, -3.01}, 0, 0, false},                /* off it, looking away */
    {M "solid a: box(2, 2, 2)", {1.0005, 0, 0}, 400, 530, false},        /* along a face */
    {M "solid a: difference(box(9, 9, 9), box(8, 8, 8))", {0, 0, 0}, 1024, 1024, false},
    {M "solid a: repeat(3, 3, 3, 0, 0, 0, sphere(0.4))", {1.5, 1.5, 1.5}, 1000, 1024, false},
    {M "solid a: repeat(3, 0, 3, 0, 0, 0, sphere(1.5))", {1.5, 4, 1.5}, 400, 640, false}, /* that touch */
    {M "solid a: twist(300, translate(0, 0, 0, box(2, 3, 0.6)))", {0, 0, 6}, 60, 400, false},
    {M "solid a: displace(0.7, 1.1, sphere(1.5))", {0, 0, 6}, 60, 400, false},
};

static void at_the_limits(void **state)
{
    (void)state;
    for (int isa = 0; isa <= (int)fv_cpu_isa(); isa++)
        for (unsigned k = 0; k < sizeof limits / sizeof limits[0]; k++)
            for (int culling = 0; culling < 2; culling++) {
                open_scene(limits[k].text, culling ? NULL : "method.culling=off");
                struct fv_view view = look(limits[k].at[0], limits[k].at[1], limits[k].at[2], 30);
                trace(isa, &view, &samples);
                sound(&samples);
                int n = hits(&samples);
                if (n < limits[k].least || n > limits[k].most)
                    fail_msg("%s from %g %g %g: %d hits", limits[k].text, limits[k].at[0], limits[k].at[1], limits[k].at[2], n);
                for (int i = 0; i < GRID && limits[k].at_once; i++) assert_true(samples.inverse_depth[i] == FV_INVERSE_DEPTH_MAX);
            }
}

/* Rays that have taken all their steps see the sky, and are counted. */
static void limit_of_steps(void **state)
{
    (void)state;
    for (int isa = 0; isa <= (int)fv_cpu_isa(); isa++) {
        open_scene(M "solid a: sphere(1)\n", "method.march_steps=1");
        struct fv_view view = look(0, 0, 4, 30);
        trace(isa, &view, &samples);
        assert_int_equal(hits(&samples), 0);
        assert_true(rays[FV_RAY_MARCH_LIMITED] > 200 && rays[FV_RAY_MARCH_STEPS] >= rays[FV_RAY_MARCH_LIMITED]);
        for (int i = 0; i < GRID; i++) assert_true(samples.red[i] == small.scene.sky[0]);
        open_scene(M "solid a: sphere(1)\n", NULL);
        trace(isa, &view, &samples);
        assert_int_equal(rays[FV_RAY_MARCH_LIMITED], 0);
        assert_true(hits(&samples) > 100);
    }
}

static void open_builtin(const char *name, const char *set)
{
    static char scene[64];
    struct fv_error error;
    close_scene(NULL);
    snprintf(scene, sizeof scene, "scene.name=%s", name);
    struct fv_config_request request = {.sets = 2, .set = {scene, set}};
    memset(&small, 0, sizeof small);
    if (fv_config_load(&small.config, &request, &error) || fv_scene_load(&small.scene, &small.config, &error) ||
        fv_tracer_open(&small.tracer, &small.scene, &small.config, &error))
        fail_msg("%s", error.text);
    opened = true;
}

static const struct {
    const char *name;
    double at[3], yaw; /* a place with much to see */
} scenes[] = {{"primitives", {0, 1.7, 6.2}, 0}, {"columns", {0, 1.65, 6}, 0.4}, {"temple", {-12, 4, 26}, -0.6}};

static struct fv_view scene_view(int k)
{
    double turn[4];
    fv_quat_from_yaw_pitch_roll(scenes[k].yaw, -0.1, 0, turn);
    return small_view(scenes[k].at, turn, 35, 256);
}

/* How many samples of two pictures are apart in depth by more than both hits' thresholds and what grazing makes of
 * them, or of which one hits. */
static int differ(const struct fv_samples *a, const struct fv_samples *b)
{
    int n = 0;
    for (int i = 0; i < GRID; i++) {
        double p = a->inverse_depth[i], q = b->inverse_depth[i];
        n += (p > 0) != (q > 0) || (p > 0 && fabs(1 / p - 1 / q) > 0.01 * (1 / p) + 0.01);
    }
    return n;
}

static void nothing_changes(void **state)
{
    (void)state;
    static const char *const sets[] = {"method.culling=off", "method.stepping=relaxed", "method.stepping=balint"};
    for (int k = 0; k < 3; k++)
        for (int isa = 0; isa <= (int)fv_cpu_isa(); isa++) {
            struct fv_view view = scene_view(k);
            open_builtin(scenes[k].name, "method.culling=on");
            trace(isa, &view, &samples);
            int64_t steps = rays[FV_RAY_MARCH_STEPS];
            for (int s = 0; s < 3; s++) {
                open_builtin(scenes[k].name, sets[s]);
                trace(isa, &view, &other);
                int n = differ(&samples, &other);
                print_message("%s, %s: %d of %d samples differ, %.3f of the steps\n", scenes[k].name, sets[s], n, GRID,
                              (double)rays[FV_RAY_MARCH_STEPS] / (double)steps);
                assert_true(n <= 6);
            }
        }
}

/* Starts of cones lie before what any ray in them hits; from them the same is seen. */
static void starts(void **state)
{
    (void)state;
    static struct fv_samples inner, fine;
    static const float radii[] = {0.75f, 3, 12};
    for (int k = 0; k < 3; k++)
        for (int isa = 0; isa <= (int)fv_cpu_isa(); isa++) {
            open_builtin(scenes[k].name, "method.culling=on");
            struct fv_view view = scene_view(k);
            const struct fv_kernels *kernels = fv_kernels((enum fv_isa)isa);
            uint64_t r = 3;
            for (int c = 2; c >= 0; c--) {
                small_grid(&samples, &view);
                samples.started = false;
                if (c == 0) {
                    /* A level below another one. */
                    kernels->starts(&small.tracer, &view, &samples, radii[1], rays);
                    assert_true(samples.started);
                }
                kernels->starts(&small.tracer, &view, &samples, radii[c], rays);
                inner = samples;
                for (int i = 0; i < GRID; i++) {
                    double angle = random_between(&r, 0, 6.28), far = radii[c] * sqrt(random_between(&r, 0, 1));
                    inner.x[i] += (float)(far * cos(angle));
                    inner.y[i] += (float)(far * sin(angle));
                }
                fine = inner;
                fine.started = false;
                memset(rays, 0, sizeof rays);
                kernels->trace(&small.tracer, &view, &fine, 1, rays);
                int64_t from_eye = rays[FV_RAY_MARCH_STEPS], gained = 0;
                for (int i = 0; i < GRID; i++) {
                    if (!(fine.inverse_depth[i] > 0)) continue;
                    double t = 1 / fine.inverse_depth[i];
                    if (!(inner.start[i] <= t * (1 + 1e-5))) fail_msg("%s: starts at %g, hits at %g", scenes[k].name, (double)inner.start[i], t);
                    gained += inner.start[i] > 0.5 * t;
                }
                memset(rays, 0, sizeof rays);
                kernels->trace(&small.tracer, &view, &inner, 1, rays);
                int n = differ(&inner, &fine);
                print_message("%s, cones of %g pixels: %d samples differ, %d start beyond half the way, %.3f of the steps\n", scenes[k].name,
                              (double)radii[c], n, (int)gained, (double)rays[FV_RAY_MARCH_STEPS] / (double)from_eye);
                assert_true(n <= 6 && gained > GRID / 8);
            }
        }
}

/* Of a solid and a plate of triangles, whichever is nearer, also in what shadows show. */
static void beside_triangles(void **state)
{
    (void)state;
    static const char plate[] = "v -4 -4 -6\nv 4 -4 -6\nv 4 4 -6\nv -4 4 -6\nf 1 2 3\nf 1 3 4\n";
    static char file[160];
    program_write("plate.obj", plate, strlen(plate));
    snprintf(file, sizeof file, "scene.file=%s/plate.obj", program_folder());
    for (int isa = 0; isa <= (int)fv_cpu_isa(); isa++) {
        open_scene(M "solid a: translate(1, 0, -5, sphere(0.8))\nsolid a: translate(-1, 0, -7, sphere(0.8))", file);
        assert_int_equal(small.scene.features & (FV_SCENE_FIELDS | FV_SCENE_MIXED), FV_SCENE_FIELDS | FV_SCENE_MIXED);
        struct fv_view view = look(0, 0, 0, 30);
        trace(isa, &view, &samples);
        int plates = 0, solids = 0;
        for (int i = 0; i < GRID; i++) {
            double t = 1 / samples.inverse_depth[i];
            assert_true(samples.inverse_depth[i] > 0 && t < 6 * (1 + 1e-5));
            plates += fabs(t - 6) < 1e-4;
            solids += t < 5.1;
        }
        assert_true(plates > 800 && solids > 40 && plates + solids >= GRID - 8);
        /* The solid keeps light from the plate. */
        int dark = 0;
        for (int i = 0; i < GRID; i++) dark += fabs(1 / samples.inverse_depth[i] - 6) < 1e-4 && samples.red[i] < 0.2f;
        assert_true(dark >= 0);
    }
}

/* A light above a ball above a floor: one round shadow, and no speck of it elsewhere. */
static void shadows(void **state)
{
    (void)state;
    static const double down[4] = {0.70710678118654752, -0.70710678118654752, 0, 0}, above[3] = {0.01, 6, 0.02};
    for (int isa = 0; isa <= (int)fv_cpu_isa(); isa++) {
        open_scene(M "solid a: plane(0, 1, 0, 0)\nsolid a: translate(2, 1, 0, sphere(0.5))", NULL);
        struct fv_view view = small_view(above, down, 40, 256);
        trace(isa, &view, &samples);
        int dark = 0;
        for (int i = 0; i < GRID; i++) {
            double t = 1 / samples.inverse_depth[i];
            float lit = samples.red[i];
            if (fabs(t - 6) > 0.01) continue;
            double x = 0.01 + (samples.x[i] / 128.0 - 1) * tan(40 * M_PI / 180) * 6, z = 0.02 + (samples.y[i] / 128.0 - 1) * tan(40 * M_PI / 180) * 6;
            double from = hypot(x - 2 * 30 / 29.0, z), radius = 0.5 * 30 / 29.0;
            if (from < radius - 0.03) assert_true(lit < 0.1f), dark++;
            if (from > radius + 0.03) assert_true(lit > 0.1f);
        }
        assert_true(dark >= 1);
    }
}

/* A light on its way shows what one shows that stands where it is. */
static void lights_that_move(void **state)
{
    (void)state;
    static const char ball[] = M "solid a: plane(0, 1, 0, 0)\nsolid a: translate(0, 1, -3, sphere(0.5))";
    struct fv_view view = look(0, 1.5, 2, 30);
    for (int isa = 0; isa <= (int)fv_cpu_isa(); isa++)
        for (int second = 0; second < 3; second++) {
            char lights[256];
            struct fv_pose pose;
            open_scene(ball, "scene.moving=light 90 60 30 at -4 3 -1 0 at 0 5 0 0 at 4 3 -1 0 in 2");
            assert_int_equal(small.scene.lights, 2);
            assert_int_equal(small.scene.object[0].light, 1);
            fv_moving_pose(&small.scene.object[0].moving, second * 1000000000LL, &pose);
            fv_tracer_move(&small.tracer, &pose);
            trace(isa, &view, &samples);
            snprintf(lights, sizeof lights, "scene.point_lights=0 30 0 900 900 900, %.9g %.9g %.9g 90 60 30", pose.position_m[0],
                     pose.position_m[1], pose.position_m[2]);
            open_scene(ball, lights);
            assert_int_equal(small.scene.lights, 2);
            trace(isa, &view, &other);
            int off = 0; /* at the shadow's edge */
            for (int i = 0; i < GRID; i++)
                off += fabsf(samples.red[i] - other.red[i]) > 1e-4f * other.red[i] || fabsf(samples.blue[i] - other.blue[i]) > 1e-4f * other.blue[i];
            if (off > 4) fail_msg("%d samples differ at %d s", off, second);
        }
}

/* Lists that begin at starts find what is left of the way to lights by cones: of lights anywhere, the same shadows. */
static void shadows_by_cones(void **state)
{
    (void)state;
    static const char solids[] = M "solid a: plane(0, 1, 0, -1)\nsolid a: translate(0, 0, -4, sphere(0.8))\n"
                                   "solid a: translate(1.2, -0.4, -3, twist(0.2, box(0.5, 1.2, 0.5)))\n"
                                   "solid a: capsule(-2, -1, -3, -1, 1, -5, 0.02)\n"
                                   "solid a: translate(0, 1.5, -4, difference(box(3, 0.2, 3), cylinder(0.5, 1)))";
    static const char far[] = "method.march_far=2000";
    static const struct {
        const char *light, *far;
    } rows[] = {
        {"scene.point_lights=0 4 -4 200 200 200", far},       /* through the hole */
        {"scene.point_lights=0 0 -4 200 200 200", far},       /* inside a solid */
        {"scene.point_lights=0.3 -0.999 -3.4 20 20 20", far}, /* on a surface */
        /* near what it lights; several */
        {"scene.point_lights=-0.5 0.2 -2.9 5 5 5, 1 -0.9 -2 5 5 5, 2 3 1 50 50 50", far},
        {"scene.point_lights=1e4 1e4 0 4e8 4e8 4e8", far},    /* beyond where rays end */
        {"scene.point_lights=0 6 -4 300 300 300", "method.march_far=3"}, /* and solids too */
        {"scene.sun=0.4 1 0.2 3 3 3", far},
        {"scene.sun=1 0.002 0 300 300 300", far},
        {"scene.sun=0.1 -1 0 3 3 3", far},
        {"scene.sun=0.4 1 0.2 3 3 3", "method.march_far=1e6"}, /* where points along rays are rounded to 0.1 m */
        {"scene.sun=0.4 1 0.2 3 3 3", "method.march_far=1e9"},
    };
    for (int isa = 0; isa <= (int)fv_cpu_isa(); isa++)
        for (size_t n = 0; n < sizeof rows / sizeof rows[0]; n++) {
            open_scene_and(solids, rows[n].light, rows[n].far);
            struct fv_view view = look(0, 0, 0, 35);
            const struct fv_kernels *kernels = fv_kernels_for((enum fv_isa)isa, fv_variant_for(small.scene.features));
            trace(isa, &view, &samples);
            int64_t steps = rays[FV_RAY_MARCH_STEPS];
            memset(rays, 0, sizeof rays);
            small_grid(&other, &view);
            other.started = true;
            memset(other.start, 0, sizeof other.start);
            kernels->trace(&small.tracer, &view, &other, 1, rays);
            other.started = false;
            sound(&other);
            int off = 0, lit = 0;
            for (int i = 0; i < GRID; i++) {
                lit += samples.red[i] > 0.2f;
                off += fabsf(samples.red[i] - other.red[i]) > 0.02f * samples.red[i] + 1e-3f;
            }
            print_message("%s, %s: %d of %d lit, %d otherwise, %.2f of the steps\n", rows[n].light, rows[n].far, lit, GRID, off,
                          (double)rays[FV_RAY_MARCH_STEPS] / (double)steps);
            assert_true(off <= 3); /* shadows' edges: what counts as a hit is found by chance */
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test_teardown(scales, close_scene), cmocka_unit_test_teardown(at_the_limits, close_scene), cmocka_unit_test_teardown(limit_of_steps, close_scene),
                                       cmocka_unit_test_teardown(beside_triangles, close_scene), cmocka_unit_test_teardown(shadows, close_scene), cmocka_unit_test_teardown(nothing_changes, close_scene),
                                       cmocka_unit_test_teardown(starts, close_scene), cmocka_unit_test_teardown(shadows_by_cones, close_scene), cmocka_unit_test_teardown(lights_that_move, close_scene)};
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
