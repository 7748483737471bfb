/* paths: light by paths (rt/trace/path.h) where it is known: a furnace, whose walls shine and reflect half, after 1, 4 and 16
 * bounces; one random light against all of them; what glosses; light of 1e30, NaN and none. On every instruction set. */
#include "rt/trace/variant.h"
#include "tests/support/random.h"
#include "tests/support/small_scene.h"

#include "rt/fovea/foveal.h"

static struct fv_samples samples;

/* A closed box, 2 m a side, of one material. */
static void box(struct small_scene *s, const struct fv_material *of)
{
    static const double plates[6][9] = {{-1, -1, -1, 2, 0, 0, 0, 2, 0}, {-1, -1, 1, 0, 2, 0, 2, 0, 0},
                                        {-1, -1, -1, 0, 0, 2, 2, 0, 0}, {-1, 1, -1, 2, 0, 0, 0, 0, 2},
                                        {-1, -1, -1, 0, 2, 0, 0, 0, 2}, {1, -1, -1, 0, 0, 2, 0, 2, 0}};
    int material = fv_build_material(s->build, of);
    for (int i = 0; i < 6; i++) small_plate(s, plates[i], plates[i] + 3, plates[i] + 6, 3, material);
}

static void trace(const struct small_scene *s, int bounces, int paths, uint32_t frame)
{
    static const double at[3] = {0.1, -0.2, 0.6}, ahead[4] = {1, 0, 0, 0};
    struct fv_view view = small_view(at, ahead, 40, 64);
    int64_t rays[FV_RAY_KINDS] = {0};
    small_grid(&samples, &view);
    samples.bounces = bounces;
    samples.noise = fv_noise();
    for (int i = 0; i < samples.count; i++) samples.paths[i] = paths;
    fv_kernels(s->tracer.isa)->paths(&s->tracer, &view, &samples, frame, rays);
}

static double mean_of(const float *v)
{
    double sum = 0;
    for (int i = 0; i < samples.count; i++) sum += (double)v[i];
    return sum / samples.count;
}

/* Emission and reflectance 1/2: what is missing after n bounces is 2^-(n + 1). */
static void furnace(void **state)
{
    (void)state;
    static struct small_scene s;
    static const int bounces[] = {1, 4, 16};
    struct fv_material m = fv_material_default();
    small_begin(&s);
    for (int c = 0; c < 3; c++) m.diffuse[c] = m.emission[c] = 0.5f;
    box(&s, &m);
    small_finish(&s);
    for (int c = 0; c < 3; c++) s.scene.ambient[c] = 0;
    for (int isa = 0; isa < 3 && small_reopen(&s, isa); isa++)
        for (int k = 0; k < 3; k++) {
            double sum = 0, missing = pow(0.5, bounces[k] + 1), off;
            enum { FRAMES = 4, PATHS = 8 };
            for (uint32_t frame = 0; frame < FRAMES; frame++) {
                trace(&s, bounces[k], PATHS, frame);
                sum += (mean_of(samples.red) + 0.5 * mean_of(samples.light_red)) / FRAMES;
            }
            off = sum - (1 - missing);
            print_message("furnace (%s), %d bounces: %.5f, %.5f short of 1; %+.5f off what is expected\n", small_isas[isa], bounces[k],
                          sum, 1 - sum, off);
            assert_true(fabs(off) < (bounces[k] == 1 ? 1e-5 : 2e-3));
        }
    fv_tracer_close(&s.tracer);
}

static void add_lights(struct small_scene *s, int lights)
{
    static const struct fv_light all[] = {
        {FV_LIGHT_POINT, {0.3f, 0.5f, 0.2f}, {0}, {0}, {1, 2, 1}},
        {FV_LIGHT_POINT, {-0.6f, 0.1f, -0.5f}, {0}, {0}, {0.5f, 0.1f, 0.2f}},
        {FV_LIGHT_AREA, {-0.4f, 0.9f, -0.4f}, {0.8f, 0, 0}, {0, 0, 0.8f}, {2, 1, 3}},
        {FV_LIGHT_POINT, {0.7f, -0.7f, -0.7f}, {0}, {0}, {0.2f, 0.2f, 0.8f}},
    };
    s->scene.lights = lights;
    for (int i = 0; i < lights; i++) s->scene.light[i] = all[i];
    s->scene.features |= FV_SCENE_POINT_LIGHTS | FV_SCENE_AREA_LIGHTS;
}

/* The mean over pixels of what each light adds, one drawn at a time or shared out among paths, against all of them by Whitted's
 * shading. */
static void lights_stand_for_all(int paths)
{
    static struct small_scene s;
    struct fv_material m = fv_material_default();
    small_begin(&s);
    s.config.method_area_spp = 64;
    strcpy(s.config.denoise_specular, "phong"); /* as Whitted's shading has it */
    for (int c = 0; c < 3; c++) m.diffuse[c] = 0.6f, m.specular[c] = 0.3f;
    m.shininess = 12;
    box(&s, &m);
    int plate = fv_build_material(s.build, &m);
    small_plate(&s, (double[]){-0.5, -0.5, -0.3}, (double[]){0.6, 0, 0.1}, (double[]){0, 0.7, 0.2}, 2, plate);
    small_finish(&s);
    for (int c = 0; c < 3; c++) s.scene.ambient[c] = 0;
    add_lights(&s, 4);
    for (int isa = 0; isa < 3 && small_reopen(&s, isa); isa++) {
        double sum[3] = {0};
        enum { FRAMES = 64 };
        for (uint32_t frame = 0; frame < FRAMES; frame++) {
            trace(&s, 0, paths, frame);
            for (int i = 0; i < samples.count; i++) {
                sum[0] += (double)(samples.red[i] + samples.albedo_red[i] * samples.light_red[i]) / FRAMES / samples.count;
                sum[1] += (double)(samples.green[i] + samples.albedo_green[i] * samples.light_green[i]) / FRAMES / samples.count;
                sum[2] += (double)(samples.blue[i] + samples.albedo_blue[i] * samples.light_blue[i]) / FRAMES / samples.count;
            }
        }
        static const double at[3] = {0.1, -0.2, 0.6}, ahead[4] = {1, 0, 0, 0};
        struct fv_view view = small_view(at, ahead, 40, 64);
        int64_t rays[FV_RAY_KINDS] = {0};
        samples.split = false;
        fv_kernels(s.tracer.isa)->trace(&s.tracer, &view, &samples, 0, rays);
        double want[3] = {mean_of(samples.red), mean_of(samples.green), mean_of(samples.blue)};
        for (int c = 0; c < 3; c++) {
            print_message("%d paths for four lights (%s): %.4f, all: %.4f\n", paths, small_isas[isa], sum[c], want[c]);
            assert_true(fabs(sum[c] / want[c] - 1) < 0.01);
        }
    }
    fv_tracer_close(&s.tracer);
}

static void one_light_stands_for_all(void **state)
{
    (void)state;
    lights_stand_for_all(3);
}

static void lights_are_shared_out(void **state)
{
    (void)state;
    lights_stand_for_all(4);
    lights_stand_for_all(7);
}

enum crowd { SPREAD, AT_ONE_PLACE, FAR_OFF, BEHIND, ONE_OUTSHINES, CROWDS };

/* 80 point lights before the plane z = -1 (BEHIND: behind it), coloured, every fourth of no power. */
static void crowd_of(struct fv_scene *scene, enum crowd crowd)
{
    uint64_t random = 7;
    enum { LIGHTS = 80 };
    for (int i = 0; i < LIGHTS; i++) {
        struct fv_light *l = &scene->light[i];
        *l = (struct fv_light){.kind = FV_LIGHT_POINT};
        for (int c = 0; c < 3; c++) {
            double at = random_between(&random, -1, 1) + (c == 2 ? 0.5 : 0);
            double power = i % 4 == 3 ? 0 : random_between(&random, 0.05, 1);
            l->position[c] = (float)(crowd == AT_ONE_PLACE ? 0.2 : crowd == FAR_OFF ? 1e6 * (c == 2 ? 1 : at) : at);
            l->colour[c] = (float)(crowd == FAR_OFF ? 1e12 * power : crowd == ONE_OUTSHINES && i == 50 ? 1e30 : power);
        }
        if (crowd == BEHIND) l->position[2] = -1.5f - (float)i / 80;
    }
    scene->lights = LIGHTS;
    scene->features |= FV_SCENE_POINT_LIGHTS;
}

/* The mean of lights drawn from many against the sum of all by Whitted's shading. */
static void few_of_many_stand_for_all(void **state)
{
    (void)state;
    static struct small_scene s;
    struct fv_material m = fv_material_default();
    static const double at[3] = {0.1, -0.2, 0.6}, ahead[4] = {1, 0, 0, 0};
    struct fv_view view = small_view(at, ahead, 40, 64);
    int64_t rays[FV_RAY_KINDS] = {0};
    small_begin(&s);
    small_plate(&s, (double[]){-9, -9, -1}, (double[]){18, 0, 0}, (double[]){0, 18, 0}, 3, fv_build_material(s.build, &m));
    small_finish(&s);
    for (int c = 0; c < 3; c++) s.scene.ambient[c] = 0;
    for (int isa = 0; isa < 3 && small_reopen(&s, isa); isa++)
        for (enum crowd crowd = 0; crowd < CROWDS; crowd++) {
            double sum[3] = {0};
            enum { FRAMES = 64 };
            crowd_of(&s.scene, crowd);
            for (uint32_t frame = 0; frame < FRAMES; frame++) {
                trace(&s, 0, 3, frame);
                for (int i = 0; i < samples.count; i++) {
                    sum[0] += (double)(samples.albedo_red[i] * samples.light_red[i]) / FRAMES / samples.count;
                    sum[1] += (double)(samples.albedo_green[i] * samples.light_green[i]) / FRAMES / samples.count;
                    sum[2] += (double)(samples.albedo_blue[i] * samples.light_blue[i]) / FRAMES / samples.count;
                }
            }
            samples.split = false;
            fv_kernels(s.tracer.isa)->trace(&s.tracer, &view, &samples, 0, rays);
            double want[3] = {mean_of(samples.red), mean_of(samples.green), mean_of(samples.blue)};
            for (int c = 0; c < 3; c++) {
                if (c == 0) print_message("80 lights, crowd %d (%s): %.5g, all: %.5g\n", (int)crowd, small_isas[isa], sum[c], want[c]);
                assert_true(crowd == BEHIND ? sum[c] == 0 && want[c] == 0 : fabs(sum[c] / want[c] - 1) < 0.004);
            }
        }
    fv_tracer_close(&s.tracer);
}

/* In a furnace of glossy walls, whose lobes reflect 0.3 and matt parts 0.4, nothing gets brighter than what walls of 0.7 would
 * show, nor darker than those of 0.4; with Fresnel's law by 0.3 of what is seen edge-on, here a fifteenth at most. */
static void gloss_gains_no_energy(void **state)
{
    (void)state;
    static struct small_scene s;
    static const float shininess[] = {1, 40, 10000};
    for (int k = 0; k < 6; k++) {
        struct fv_material m = fv_material_default();
        bool phong = k < 3;
        small_begin(&s);
        strcpy(s.config.denoise_specular, phong ? "phong" : "ggx");
        for (int c = 0; c < 3; c++) m.diffuse[c] = 0.4f, m.specular[c] = 0.3f, m.emission[c] = 1;
        m.shininess = shininess[k % 3];
        box(&s, &m);
        small_finish(&s);
        for (int c = 0; c < 3; c++) s.scene.ambient[c] = 0;
        double sum = 0;
        for (uint32_t frame = 0; frame < 4; frame++) {
            trace(&s, 1, 16, frame);
            for (int i = 0; i < samples.count; i++) sum += (double)(samples.albedo_red[i] * samples.light_red[i]) / 4 / samples.count;
        }
        print_message("gloss (%s), exponent %g: reflects %.3f of 0.7\n", s.config.denoise_specular, (double)shininess[k % 3], sum);
        assert_true(sum > 0.4 && sum < (phong ? 0.702 : 0.722));
        fv_tracer_close(&s.tracer);
    }
}

/* What shines at a point light is not counted twice: a lamp that would send as much as the light where it filled the ball around it
 * adds nothing to the walls, the same one farther off, or brighter where the light is no brighter, does. */
static void light_stands_for_its_lamp(void **state)
{
    (void)state;
    static struct small_scene s;
    static const struct {
        float emission, intensity;
        double off;
        bool counts;
    } row[] = {{0, 1, 0.1, false}, {4, 1, 0.1, false}, {4, 1, 0.5, true}, {400, 1, 0.1, true}, {4, 0, 0.1, true}, {4, 1e30f, 0.5, false}};
    double without = 0;
    for (unsigned k = 0; k < sizeof row / sizeof *row; k++) {
        struct fv_material wall = fv_material_default(), lamp = wall;
        small_begin(&s);
        for (int c = 0; c < 3; c++) lamp.emission[c] = row[k].emission, wall.diffuse[c] = 0.5f, lamp.diffuse[c] = 0;
        box(&s, &wall);
        int plate = fv_build_material(s.build, &lamp);
        small_plate(&s, (double[]){-0.05, 0.3 + row[k].off, -0.05}, (double[]){0.1, 0, 0}, (double[]){0, 0, 0.1}, 1, plate);
        small_finish(&s);
        for (int c = 0; c < 3; c++) s.scene.ambient[c] = 0;
        s.scene.lights = 1;
        s.scene.light[0] = (struct fv_light){FV_LIGHT_POINT, {0, 0.3f, 0}, {0}, {0}, {row[k].intensity, row[k].intensity, row[k].intensity}};
        s.scene.features |= FV_SCENE_POINT_LIGHTS;
        struct fv_light light = s.scene.light[0];
        double with[2];
        for (int shines = 0; shines < 2; shines++) {
            struct fv_material *m = (struct fv_material *)&s.scene.material[plate];
            for (int c = 0; c < 3; c++) m->emission[c] = shines ? row[k].emission : 0;
            assert_true(s.scene.light[0].kind == light.kind);
            trace(&s, 1, 16, 3);
            with[shines] = mean_of(samples.light_red);
        }
        if (k == 0) without = with[0];
        print_message("lamp of %g, %g m from a light of %g: %.5g, dark %.5g\n", (double)row[k].emission, row[k].off, (double)row[k].intensity, with[1], with[0]);
        assert_true(without > 0);
        assert_true(row[k].counts ? with[1] > with[0] * 1.001 : with[1] == with[0]);
        fv_tracer_close(&s.tracer);
    }
}

/* Whatever lights say, what leaves is finite and not below 0. */
static void odd_lights(void **state)
{
    (void)state;
    static struct small_scene s;
    static const float odd[] = {1e30f, 3e38f, INFINITY, NAN, 0, 1e-38f};
    struct fv_material m = fv_material_default();
    small_begin(&s);
    box(&s, &m);
    small_finish(&s);
    add_lights(&s, 4);
    for (int isa = 0; isa < 3 && small_reopen(&s, isa); isa++)
        for (int lights = 0; lights <= 4; lights++)
            for (unsigned k = 0; k < sizeof odd / sizeof *odd; k++) {
                add_lights(&s, lights);
                if (lights > 0) s.scene.light[lights - 1].colour[1] = odd[k];
                trace(&s, 2, 3, k);
                for (int i = 0; i < samples.count; i++) {
                    const float of[] = {samples.light_red[i], samples.light_green[i], samples.light_blue[i], samples.albedo_red[i], samples.red[i]};
                    for (int c = 0; c < 5; c++)
                        if (!(of[c] >= 0 && of[c] <= FV_RADIANCE_MAX)) fail_msg("%d lights, colour %g: %g", lights, (double)odd[k], (double)of[c]);
                }
            }
    /* A light in the surface itself. */
    add_lights(&s, 1);
    memcpy(s.scene.light[0].position, (float[]){0, 0, -1}, 12);
    trace(&s, 1, 2, 0);
    for (int i = 0; i < samples.count; i++) assert_true(samples.light_red[i] >= 0 && samples.light_red[i] <= FV_RADIANCE_MAX);
    fv_tracer_close(&s.tracer);
}

/* No paths: surfaces without light; samples differ in how many they take. */
static void paths_by_sample(void **state)
{
    (void)state;
    static struct small_scene s;
    static const double at[3] = {0.1, -0.2, 0.6}, ahead[4] = {1, 0, 0, 0};
    struct fv_material m = fv_material_default();
    struct fv_view view = small_view(at, ahead, 40, 64);
    int64_t rays[FV_RAY_KINDS] = {0}, wanted = 0;
    small_begin(&s);
    box(&s, &m);
    small_finish(&s);
    add_lights(&s, 2);
    assert_true(small_reopen(&s, (int)s.tracer.isa));
    small_grid(&samples, &view);
    samples.bounces = 1;
    samples.noise = fv_noise();
    for (int i = 0; i < samples.count; i++) samples.paths[i] = i % 7 == 0 ? 0 : i % 5, wanted += samples.paths[i];
    fv_kernels(s.tracer.isa)->paths(&s.tracer, &view, &samples, 0, rays);
    print_message("%lld primary rays, %lld bounces of %lld paths\n", (long long)rays[FV_RAY_PRIMARY], (long long)rays[FV_RAY_SECONDARY], (long long)wanted);
    assert_true(rays[FV_RAY_PRIMARY] == samples.count && rays[FV_RAY_SECONDARY] == wanted);
    for (int i = 0; i < samples.count; i++) {
        assert_true(samples.inverse_depth[i] > 0);
        if (samples.paths[i] == 0 && samples.light_red[i] != 0) fail_msg("light without a path");
    }
    fv_tracer_close(&s.tracer);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(furnace), cmocka_unit_test(one_light_stands_for_all), cmocka_unit_test(lights_are_shared_out),
                                       cmocka_unit_test(few_of_many_stand_for_all), cmocka_unit_test(gloss_gains_no_energy), cmocka_unit_test(light_stands_for_its_lamp), cmocka_unit_test(odd_lights),
                                       cmocka_unit_test(paths_by_sample)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
