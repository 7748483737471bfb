/* field_occlusion: ambient occlusion whose rays are marched through fields, against closed forms, at radii and sizes that are
 * degenerate; sampled light of lists that begin at starts; and no such rays where nobody asks for them. On every
 * instruction set. */
#include "tests/support/lit_fields.h"

enum { SPP = 64 };

static struct fv_samples other;

static const struct occluded {
    const char *name, *solids;
    double radius, at[3], pitch_deg;
    double worst, bias;
    /* The open share, by where the hit is. */
    double (*open)(const double p[3], double radius);
} occluded[];

static double all_open(const double p[3], double radius)
{
    (void)p, (void)radius;
    return 1;
}

static double none_open(const double p[3], double radius)
{
    (void)p, (void)radius;
    return 0;
}

/* A slab in parallel at 1 m takes the cone within acos(1 / radius). */
static double below_slab(const double p[3], double radius)
{
    (void)p;
    return 1 / (radius * radius);
}

/* A wall that meets the floor at x = -1 takes the part of the unit disk (Malley) beyond the chord: at the corner half
 * of it. */
static double beside_wall(const double p[3], double radius)
{
    double c = fmax(p[0] + 1, 0) / radius;
    return c >= 1 ? 1 : 1 - (acos(c) - c * sqrt(1 - c * c)) / M_PI;
}

/* A ball of 0.5 m at 1 m, wholly above the horizon: (r / d)^2 times the cosine. */
static double below_ball(const double p[3], double radius)
{
    double d2 = p[0] * p[0] + 1 + p[2] * p[2];
    (void)radius;
    return 1 - 0.25 / d2 / sqrt(d2);
}

static const struct occluded occluded[] = {
    {"open", "solid a: plane(0, 1, 0, 0)", 5, {0, 1.5, 2}, -40, 1e-5, 1e-6, all_open},
    {"beyond the radius", "solid a: plane(0, 1, 0, 0)\nsolid a: plane(0, -1, 0, -2.5)", 2.4, {0, 1.5, 2}, -40, 1e-5, 1e-6, all_open},
    {"slab", "solid a: plane(0, 1, 0, 0)\nsolid a: plane(0, -1, 0, -1)", 1.5, {0, 0.7, 1}, -40, 0.06, 4e-3, below_slab},
    {"corner", "solid a: plane(0, 1, 0, 0)\nsolid a: plane(1, 0, 0, -1)", 2, {0, 1.5, 2}, -40, 0.11, 2e-3, beside_wall},
    {"corner, near", "solid a: plane(0, 1, 0, 0)\nsolid a: plane(1, 0, 0, -1)", 2, {-0.985, 0.1, 0}, -89.5, 0.06, 2e-3, beside_wall},
    {"ball", "solid a: plane(0, 1, 0, 0)\nsolid a: translate(0, 1, 0, sphere(0.5))", 50, {0, 0.9, 1.7}, -45, 0.08, 3e-3, below_ball},
    {"room", "solid a: difference(box(20, 20, 20), translate(0, 3, 0, box(8, 6, 8)))", 30, {0, 1.5, 2}, -40, 1e-5, 1e-6, none_open},
};

static void occlusion(void **state)
{
    (void)state;
    for (size_t k = 0; k < sizeof occluded / sizeof occluded[0]; k++) {
        const struct occluded *o = &occluded[k];
        char radius[64];
        const char *const sets[] = {"scene.ambient=1 1 1", "method.ao_spp=64", radius};
        struct fv_view view = look(o->at[0], o->at[1], o->at[2], o->pitch_deg, 25);
        snprintf(radius, sizeof radius, "method.ao_radius=%g", o->radius);
        open_scene(o->solids, sets, 3);
        FOR_EACH_ISA
        {
            double worst = 0, bias = 0, mean = 0;
            int counted = 0, hits = 0;
            trace(isa, &view, 11, &samples);
            for (int i = 0; i < GRID; i++) {
                double p[3];
                hits += samples.inverse_depth[i] > 0;
                assert_true(samples.red[i] >= 0 && samples.red[i] <= 1.00001f);
                for (int a = 0; a < 3; a++) {
                    double d = (double)(view.corner[a] + samples.x[i] * view.dx[a] + samples.y[i] * view.dy[a]);
                    p[a] = view.origin[a] + d / (double)samples.inverse_depth[i];
                }
                if (!(fabs(p[1]) < 5e-3) || p[0] < -1) continue; /* the floor, whose light is 1 where it is open */
                double truth = o->open(p, o->radius), off = (double)samples.red[i] - truth;
                worst = fmax(worst, fabs(off)), bias += off, mean += truth, counted++;
            }
            print_message("%s, isa %d: %.3f open on average; off by %.4f at worst, %.5f on average\n", o->name, isa, mean / counted,
                          worst, bias / counted);
            assert_true(counted > 300 && worst < o->worst && fabs(bias / counted) < o->bias);
            assert_int_equal(rays[FV_RAY_SHADOW], SPP * hits);
            assert_int_equal(rays[FV_RAY_SECONDARY], 0);
        }
    }
}

/* A floor by itself is not occluded by its own rounding, or by where its rays begin, whatever the radius; nor is a ball. */
static void occlusion_at_any_size(void **state)
{
    static const double scales[] = {0.01, 1, 1e3, 1e5}, radii[] = {1e-3, 0.1, 1, 1e6};
    (void)state;
    for (int s = 0; s < 4; s++)
        for (int r = 0; r < 4; r++) {
            char solids[160], radius[64];
            const char *const sets[] = {"scene.ambient=1 1 1", "method.ao_spp=16", radius, "method.march_far=1e7"};
            struct fv_view view = look(0, 1.5 * scales[s], 3 * scales[s], -40, 25);
            snprintf(solids, sizeof solids, "solid a: %s", r % 2 ? "plane(0, 1, 0, 0)" : "");
            if (r % 2 == 0) snprintf(solids, sizeof solids, "solid a: scale(%g, sphere(1))", scales[s]);
            snprintf(radius, sizeof radius, "method.ao_radius=%g", fmin(fmax(radii[r] * scales[s], 1e-3), 1e6));
            open_scene(solids, sets, 4);
            FOR_EACH_ISA
            {
                int hits = 0, occluded_ones = 0;
                trace(isa, &view, 3, &samples);
                for (int i = 0; i < GRID; i++) {
                    if (!(samples.inverse_depth[i] > 0)) continue;
                    double up = 1, d, p = 0;
                    if (r % 2 == 0) { /* the ball's normal */
                        d = (double)(view.corner[1] + samples.x[i] * view.dx[1] + samples.y[i] * view.dy[1]);
                        p = view.origin[1] + d / (double)samples.inverse_depth[i], up = p / scales[s];
                    }
                    hits++;
                    occluded_ones += (double)samples.red[i] < 0.8 + 0.2 * up - 0.03;
                }
                if (hits < 100 || occluded_ones > 0)
                    fail_msg("scale %g, radius %g, isa %d: %d of %d occluded", scales[s], radii[r], isa, occluded_ones, hits);
            }
        }
}

/* ---- what is asked for ---- */

static const char pair[] = "solid a: plane(0, 1, 0, 0)\nsolid a: translate(0, 1, 0, sphere(0.5))";

/* Rays by kind: none that nobody asked for, and no steps of theirs. */
static void no_rays_unasked(void **state)
{
    static const struct {
        const char *set[3];
        int sets, least, most; /* shadow rays a hit */
    } asked[] = {{{"scene.ambient=1 1 1"}, 1, 0, 0},
                 {{"scene.ambient=1 1 1", "method.area_spp=16"}, 2, 0, 0},
                 {{"scene.ambient=0 0 0", "method.ao_spp=16"}, 2, 0, 0}, /* no light to take away */
                 {{"scene.ambient=1 1 1", "method.ao_spp=16"}, 2, 16, 16},
                 {{"scene.ambient=1 1 1", "scene.point_lights=0 9 0 100 100 100", "method.area_spp=16"}, 3, 0, 1},
                 {{"scene.ambient=1 1 1", "scene.area_lights=-0.5 3 -0.5 1 0 0 0 0 1 1 1 1", "method.area_spp=16"}, 3, 1, 16},
                 {{"method.ao_spp=4", "scene.ambient=1 1 1", "scene.area_lights=-0.5 3 -0.5 1 0 0 0 0 1 1 1 1"}, 3, 5, 8}};
    struct fv_view view = look(0, 2.2, 3.6, -33, 30);
    (void)state;
    FOR_EACH_ISA
    {
        int64_t steps = 0;
        for (size_t k = 0; k < sizeof asked / sizeof asked[0]; k++) {
            int hits = 0;
            open_scene(pair, asked[k].set, asked[k].sets);
            trace(isa, &view, 1, &samples);
            for (int i = 0; i < GRID; i++) hits += samples.inverse_depth[i] > 0;
            if (k == 0) steps = rays[FV_RAY_MARCH_STEPS];
            assert_int_equal(rays[FV_RAY_PRIMARY], GRID);
            assert_int_equal(rays[FV_RAY_SECONDARY], 0);
            int64_t shadow = rays[FV_RAY_SHADOW];
            if (shadow < (int64_t)asked[k].least * hits || shadow > (int64_t)asked[k].most * hits)
                fail_msg("%s: %d shadow rays of %d hits", asked[k].set[asked[k].sets - 1], (int)shadow, hits);
            if (asked[k].most == 0) assert_int_equal(rays[FV_RAY_MARCH_STEPS], steps);
            else assert_true(shadow > 0 && rays[FV_RAY_MARCH_STEPS] > steps);
        }
    }
}

/* From starts of cones, as the pyramid has them, the same light. */
static void from_starts(void **state)
{
    static const char *const sets[] = {"scene.ambient=1 1 1", "method.ao_spp=16", "scene.area_lights=-0.5 3 -0.5 1 0 0 0 0 1 1 1 1",
                                       "method.area_spp=16", "scene.point_lights=2 4 1 20 20 20"};
    struct fv_view view = look(0, 2.2, 3.6, -33, 30);
    (void)state;
    FOR_EACH_ISA
    {
        int off = 0;
        open_scene(pair, sets, 5);
        trace(isa, &view, 9, &samples);
        int64_t sampled = rays[FV_RAY_SHADOW];
        const struct fv_kernels *k = fv_kernels_for((enum fv_isa)isa, fv_variant_for(small.scene.features));
        memset(rays, 0, sizeof rays);
        small_grid(&other, &view);
        other.started = false;
        k->starts(&small.tracer, &view, &other, 2, rays);
        assert_true(other.started);
        k->trace(&small.tracer, &view, &other, 9, rays);
        other.started = false;
        for (int i = 0; i < GRID; i++) off += fabsf(samples.red[i] - other.red[i]) > 0.02f * fmaxf(samples.red[i], 0.1f);
        print_message("from starts, isa %d: %d of %d otherwise\n", isa, off, GRID);
        assert_true(off <= 6);
        assert_true(rays[FV_RAY_SHADOW] <= sampled && rays[FV_RAY_SHADOW] > sampled / 2);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(occlusion, close_scene), cmocka_unit_test_teardown(occlusion_at_any_size, close_scene),
        cmocka_unit_test_teardown(no_rays_unasked, close_scene), cmocka_unit_test_teardown(from_starts, close_scene)};
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
