/* selective: the method's pictures against the full renderer's: where nothing fails, where everything does, where only
 * interpolation is left; samples that are known against samples that are traced; mirrors facing each other, total
 * reflection, fields, moving bodies, sampled light, no secondary rays at all; numbers that are none; and the same bytes
 * whatever the workers and the order of tiles. */
#include "rt/pass/cache.h"
#include "tests/support/small_scene.h"
#include "tests/support/stage.h"

#define SETS(...) ((const char *const[]){__VA_ARGS__, NULL})
#define HALL "scene.name=moving"
#define EVERY "selective.periphery=every"
#define ALL_TAU(tau)                                                                                                   \
    "selective.tau_col=" tau, "selective.tau_poid=" tau, "selective.tau_psn=" tau, "selective.tau_psc=" tau,           \
        "selective.tau_pte=" tau, "selective.tau_soid=" tau, "selective.tau_ssn=" tau, "selective.tau_ssc=" tau,       \
        "selective.tau_ste=" tau

static struct stage a, b, c;

/* The hall, with bodies that move in it: once for all. */
static const struct stage *hall(void)
{
    static struct stage s;
    if (s.tracer.scene) return &s;
    stage_begin(&s, 16, SETS("scene.name=moving", "method.name=full"), NULL, stage_workers());
    return &s;
}

/* The first setting is the scene's name. */
static void open_stage(struct stage *s, int size, const char *method, const char *const *sets, const char *const *more)
{
    struct fv_error error;
    char name[64];
    const char *with[STAGE_SETS] = {name};
    bool in_hall = strcmp(sets[0], HALL) == 0;
    snprintf(name, sizeof name, "method.name=%s", method);
    for (int n = 1; *sets; sets++) with[n++] = *sets;
    stage_set(s, size, with, more);
    if (in_hall) {
        stage_share(s, hall(), stage_workers());
        return;
    }
    if (fv_scene_load(&s->scene, &s->config, &error)) fail_msg("%s", error.text);
    stage_open(s, stage_workers());
}

static int64_t differing(const struct stage *p, const struct stage *q, int within)
{
    int64_t n = 0;
    for (int y = 0; y < p->loop.frame.height; y++)
        for (int x = 0; x < p->loop.frame.width; x++) n += stage_step(stage_row(p, y)[x], stage_row(q, y)[x]) > within;
    return n;
}

/* A scene of plates, into a stage that is then to be opened. */
struct plate {
    double p[9];
    struct fv_material material;
};

static void load_plates(struct stage *s, int size, const char *method, const struct plate *plates, int count)
{
    static struct small_scene small;
    struct fv_error error;
    small_begin(&small);
    small_picture(&small.config, size);
    strcpy(small.config.display_sink, "none");
    small.config.display_ipd_mm = 0;
    small.config.selective_smooth = 0;
    snprintf(small.config.method_name, sizeof small.config.method_name, "%s", method);
    memset(small.config.scene_path.value, 0, sizeof small.config.scene_path.value); /* the eye at the origin */
    small.config.scene_path.count = 5;
    for (int i = 0; i < count; i++)
        small_plate(&small, plates[i].p, plates[i].p + 3, plates[i].p + 6, 4, fv_build_material(small.build, &plates[i].material));
    memset(s, 0, sizeof *s);
    s->config = small.config;
    if (fv_build_finish(small.build, &s->scene, &error)) fail_msg("%s", error.text);
    s->scene.exposure = 1;
    for (int i = 0; i < 3; i++) s->scene.ambient[i] = 0.2f, s->scene.sky[i] = 0.3f + 0.1f * (float)i;
    s->scene.lights = 1;
    s->scene.features |= FV_SCENE_POINT_LIGHTS;
    s->scene.light[0] = (struct fv_light){.kind = FV_LIGHT_POINT, .position = {0.4f, 0.9f, -0.5f}, .colour = {6, 6, 6}};
}

/* Only sky: nothing fails. */
static void nothing_fails(void **state)
{
    (void)state;
    const struct plate behind = {{-1, -1, 900, 2, 0, 0, 0, 2, 0}, fv_material_default()};
    for (int every = 0; every < 2; every++) {
        load_plates(&a, 100, "full", &behind, 1);
        stage_open(&a, stage_workers());
        load_plates(&b, 100, "selective", &behind, 1);
        strcpy(b.config.selective_periphery, every ? "every" : "sparse");
        stage_open(&b, stage_workers());
        for (int n = 0; n < 3; n++) {
            stage_frame(&a, 2 * n, 10 * n, 0);
            stage_frame(&b, 2 * n, 10 * n, 0);
            /* What was reprojected is rounded once more. */
            if (differing(&a, &b, every || n == 0 ? 0 : 1)) fail_msg("frame %d: %lld pixels differ", n, (long long)differing(&a, &b, 0));
        }
        if (every) assert_int_equal(b.record.rays[FV_RAY_PRIMARY], 100 * 100);
        stage_close(&a);
        stage_close(&b);
    }
}

static void decode_around(const struct stage *s, int x, int y, double out[3])
{
    static _Alignas(64) float channel[3][16];
    static _Alignas(64) uint32_t code[16];
    code[0] = stage_row(s, y)[x] & FV_PIXEL_COLOUR;
    s->loop.frame.kernels->decode(code, channel[0], channel[1], channel[2], 16);
    for (int k = 0; k < 3; k++) out[k] = (double)channel[k][0];
}

/* No threshold is ever passed: the picture is full's, put through the weights of interpolation, 1 6 1 each way / 8. */
static void only_interpolation(void **state)
{
    (void)state;
    static const double weight[3] = {1 / 8.0, 6 / 8.0, 1 / 8.0};
    open_stage(&a, 96, "full", SETS("scene.name=cornell", "method.area_spp=1"), NULL);
    open_stage(&b, 96, "selective", SETS("scene.name=cornell", "method.area_spp=1", EVERY, "selective.near_deg=180", "selective.outer_deg=180"),
         SETS(ALL_TAU("1e6")));
    stage_frame(&a, 0, 0, 0);
    stage_frame(&b, 0, 0, 0);
    assert_int_equal(a.record.rays[FV_RAY_PRIMARY], b.record.rays[FV_RAY_PRIMARY]);
    int changed = 0;
    for (int y = 1; y < 95; y++)
        for (int x = 1; x < 95; x++) {
            static _Alignas(64) float mean[3][16];
            static _Alignas(64) uint32_t code[16];
            double sum[3] = {0, 0, 0}, of[3];
            for (int k = 0; k < 9; k++) {
                decode_around(&a, x - 1 + k % 3, y - 1 + k / 3, of);
                for (int i = 0; i < 3; i++) sum[i] += weight[k % 3] * weight[k / 3] * of[i];
            }
            for (int i = 0; i < 3; i++) mean[i][0] = (float)sum[i];
            b.loop.frame.kernels->encode(mean[0], mean[1], mean[2], 1, code, 16);
            if (stage_step(stage_row(&b, y)[x], code[0]) > 1) fail_msg("pixel %d, %d is not interpolated", x, y);
            changed += stage_step(stage_row(&b, y)[x], stage_row(&a, y)[x]) > 1;
        }
    assert_true(changed > 500);
    stage_close(&a);
    stage_close(&b);
}

/* Every corner that is not even fails, and takes k x k samples a quarter: full's picture of 4 k x k, within what jitter is. */
static void everything_refined_is_full(void **state)
{
    (void)state;
    static const struct {
        const char *scene, *samples, *spp;
        double least;
    } table[] = {{"scene.name=cornell", "selective.samples=1 1 1 1", "method.spp=4", 30},
                 {"scene.name=cornell", "selective.samples=9 9 9 9", "method.spp=36", 41},
                 {HALL, "selective.samples=9 9 9 9", "method.spp=36", 32}};
    for (unsigned i = 0; i < sizeof table / sizeof *table; i++) {
        const char *const scene[] = {table[i].scene, "method.area_spp=4", NULL};
        open_stage(&a, 72, "full", scene, SETS(table[i].spp));
        open_stage(&c, 72, "full", scene, SETS("method.spp=1"));
        open_stage(&b, 72, "selective", scene,
             SETS(table[i].samples, ALL_TAU("0"), EVERY, "selective.near_deg=180", "selective.outer_deg=180", "selective.texture=trace"));
        stage_frame(&a, 0, 0, 0);
        stage_frame(&b, 0, 0, 0);
        stage_frame(&c, 0, 0, 0);
        double psnr = stage_psnr(&a, &b, 0, 180), one = stage_psnr(&a, &c, 0, 180);
        print_message("%s, %s: %.1f dB (one sample %.1f)\n", table[i].scene, table[i].samples, psnr, one);
        assert_true(psnr > table[i].least && psnr > one + 4.5);
        stage_close(&a);
        stage_close(&b);
        stage_close(&c);
    }
}

/* Samples that lie on the triangles that pixels show are as good as rays, and take far fewer of these. */
static void known_samples_are_as_good_as_traced_ones(void **state)
{
    (void)state;
    const char *const sets[] = {HALL, "method.area_spp=1", "display.eyes=1", NULL};
    open_stage(&a, 240, "full", sets, SETS("method.spp=16"));
    open_stage(&b, 240, "selective", sets, SETS(EVERY, "selective.texture=fetch"));
    open_stage(&c, 240, "selective", sets, SETS(EVERY, "selective.texture=trace"));
    stage_frame(&a, 0, 0, 0);
    stage_frame(&b, 0, 0, 0);
    stage_frame(&c, 0, 0, 0);
    double between = stage_psnr(&b, &c, 0, 30), fetch = stage_psnr(&a, &b, 0, 30), trace = stage_psnr(&a, &c, 0, 30);
    int64_t pixels = 240 * 240;
    double share = (double)(b.record.rays[FV_RAY_PRIMARY] - pixels) / (double)(c.record.rays[FV_RAY_PRIMARY] - pixels);
    print_message("%.1f dB between them; against 16 samples %.2f fetched, %.2f traced; %.2f of the rays\n", between, fetch, trace, share);
    assert_true(between > 36 && fetch > trace - 0.3 && share < 0.95);
    stage_close(&a);
    stage_close(&b);
    stage_close(&c);
}

/* The samples of pixels' centres again, as known: the radiance and depth that were traced. */
static void known_hits_are_those_traced(void **state)
{
    (void)state;
    static const char *const scenes[] = {HALL, "scene.name=cornell"};
    static struct fv_samples traced, known;
    for (int i = 0; i < 2; i++) {
        open_stage(&a, 128, "selective", SETS(scenes[i], "method.area_spp=1"), NULL);
        stage_frame(&a, 0, 0, 700000000);
        for (int isa = 0; isa <= (int)fv_cpu_isa(); isa++) {
            const struct fv_view *view = &a.loop.frame.view[0];
            int64_t rays[FV_RAY_KINDS] = {0}, before;
            int compared = 0, off = 0;
            traced.identified = true, traced.known = known.identified = false, known.known = true;
            small_grid(&traced, view);
            small_grid(&known, view);
            fv_kernels((enum fv_isa)isa)->trace(&a.tracer, view, &traced, 1, rays);
            before = rays[FV_RAY_PRIMARY];
            for (int k = 0; k < 1024; k++)
                known.triangle[k] = traced.triangle[k] >= 0 ? traced.triangle[k] : 0, known.lit[k] = traced.lit[k];
            fv_kernels((enum fv_isa)isa)->trace(&a.tracer, view, &known, 1, rays);
            assert_int_equal(rays[FV_RAY_PRIMARY], before);
            for (int k = 0; k < 1024; k++) {
                if (traced.triangle[k] < 0) continue;
                const float was[4] = {traced.red[k], traced.green[k], traced.blue[k], traced.inverse_depth[k]};
                const float is[4] = {known.red[k], known.green[k], known.blue[k], known.inverse_depth[k]};
                bool same = true;
                for (int n = 0; n < 4; n++) same &= fabsf(is[n] - was[n]) <= 1e-4f * fabsf(was[n]) + 1e-6f;
                compared++, off += !same;
            }
            /* Rays from here to sampled light, and from mirrors, may fall to the other side of an edge. */
            print_message("%s, %s: %d of %d are off\n", scenes[i], fv_cpu_isa_name((enum fv_isa)isa), off, compared);
            assert_true(compared > 600 && off <= compared / 100);
        }
        stage_close(&a);
    }
}

/* The newest frame's passes once more, tile by tile from the last to the first. */
static void run_backwards(struct stage *s)
{
    struct fv_frame *f = &s->loop.frame;
    int64_t number = f->number--;
    for (int p = 0; p < s->plan.passes; p++)
        for (int t = f->tiles - 1; t >= 0; t--) {
            struct fv_tile tile = fv_tile_at(f, t, 0);
            s->plan.pass[p]->run(f, &tile);
        }
    f->number = number;
}

static void workers_and_order_change_nothing(void **state)
{
    (void)state;
    struct fv_workers one;
    fv_workers_start(&one, 1);
    for (int every = 0; every < 2; every++) {
        const char *const sets[] = {"method.name=selective", HALL, "display.eyes=2", "method.area_spp=1",
                                    every ? EVERY : "selective.periphery=sparse", NULL};
        for (int k = 0; k < 2; k++) {
            stage_set(k ? &b : &a, 150, sets, NULL);
            stage_share(k ? &b : &a, hall(), k ? stage_workers() : &one);
        }
        for (int n = 0; n < 4; n++) {
            stage_frame(&a, 1.5 * n, 4 * n, n * 20000000);
            stage_frame(&b, 1.5 * n, 4 * n, n * 20000000);
            if (every) run_backwards(&a);
            for (int e = 0; e < 2; e++)
                for (int y = 0; y < 150; y++)
                    assert_memory_equal((uint32_t *)a.loop.frame.buffer[FV_COLOUR][e] + y * a.loop.frame.stride,
                                        (uint32_t *)b.loop.frame.buffer[FV_COLOUR][e] + y * b.loop.frame.stride, 150 * 4);
        }
        stage_close(&a);
        stage_close(&b);
    }
}

/* Of each kind of scene: nearer to many samples than one sample is, where the eye looks. */
static void scenes_of_all_kinds(void **state)
{
    (void)state;
    static const struct {
        const char *what, *set[5];
        double gain; /* dB within 12 degrees */
    } table[] = {
        {"moving bodies", {HALL, "method.area_spp=1"}, 5},
        {"moving bodies, every", {HALL, "method.area_spp=1", EVERY}, 5},
        {"fields", {"scene.name=primitives"}, 4},
        {"fields, every", {"scene.name=primitives", EVERY}, 4},
        {"fields beside triangles", {"scene.name=cornell", "scene.fields=builtin:primitives"}, 3},
        {"area light", {"scene.name=cornell", "method.area_spp=16"}, 3},
        {"ambient occlusion", {"scene.name=cornell", "method.area_spp=4", "method.ao_spp=8"}, 1},
        {"no secondary rays", {"scene.name=cornell", "method.depth=0"}, 3},
        {"one level of them", {"scene.name=cornell", "method.depth=1"}, 3},
        {"light that was to be kept apart", {"scene.name=cornell", "method.light=apart"}, 3},
    };
    for (unsigned i = 0; i < sizeof table / sizeof *table; i++) {
        open_stage(&a, 96, "full", table[i].set, SETS("method.spp=25"));
        open_stage(&c, 96, "full", table[i].set, NULL);
        open_stage(&b, 96, "selective", table[i].set, NULL);
        assert_int_equal(b.plan.planes, 1);
        for (int n = 0; n < 2; n++) stage_frame(&b, n, 0, n * 20000000);
        stage_frame(&a, 1, 0, 20000000);
        stage_frame(&c, 1, 0, 20000000);
        double refined = stage_psnr(&a, &b, 0, 12), one = stage_psnr(&a, &c, 0, 12);
        print_message("%s: %.1f dB, one sample %.1f\n", table[i].what, refined, one);
        assert_true(refined > one + table[i].gain);
        stage_close(&a);
        stage_close(&b);
        stage_close(&c);
    }
}

static struct fv_material shiny(float mirror, float transmission)
{
    struct fv_material m = fv_material_default();
    for (int k = 0; k < 3; k++) m.mirror[k] = mirror, m.transmission[k] = transmission, m.diffuse[k] = mirror + transmission > 0 ? 0.05f : 0.4f + 0.2f * (float)k;
    m.ior = 1.5f;
    return m;
}

/* Chains that go on until depth ends them, and rays that nothing lets out. */
static void mirrors_and_glass_without_end(void **state)
{
    (void)state;
    const struct fv_material mirror = shiny(0.9f, 0), glass = shiny(0, 0.95f), matt = shiny(0, 0);
    const struct plate facing[] = {{{-1, -1, -3, 0, 0, 6, 0, 2, 0}, mirror}, {{1, -1, 3, 0, 0, -6, 0, 2, 0}, mirror}, {{-1, -1, -3, 0, 2, 0, 2, 0, 0}, mirror},
                                   {{-1, -1, 3, 0, 0, -6, 2, 0, 0}, matt}, {{-0.3, -1, -2, 0.4, 0, 0.1, 0, 0.8, 0}, matt}};
    /* A slab of glass seen from inside, behind which a wall is: beyond 42 degrees all is reflected. */
    const struct plate inside[] = {{{-9, -9, -0.5, 0, 18, 0, 18, 0, 0}, glass}, {{-9, -9, 0.5, 18, 0, 0, 0, 18, 0}, glass}, {{-9, -9, -4, 18, 0, 0, 0, 18, 0}, matt}, {{-2, -2, -3, 1, 0, 0, 0, 1, 0}, matt}};
    const double gaze_deg = 35;
    for (int kind = 0; kind < 2; kind++)
        for (int depth = 0; depth <= 8; depth += 4) {
            struct stage *const all[] = {&a, &b, &c};
            for (int k = 0; k < 3; k++) {
                load_plates(all[k], 96, k == 1 ? "selective" : "full", kind ? inside : facing, kind ? 4 : 5);
                all[k]->config.method_depth = depth;
                all[k]->config.method_spp = k == 0 ? 25 : 1;
                all[k]->config.selective_tau_col = all[k]->config.selective_tau_poid = all[k]->config.selective_tau_psn = 0.005;
                stage_open(all[k], stage_workers());
                stage_frame(all[k], 3, gaze_deg, 0);
            }
            assert_true((b.plan.buffers & FV_BIT(FV_SECOND_IDENTITY)) != 0);
            double refined = stage_psnr(&a, &b, 0, 12), one = stage_psnr(&a, &c, 0, 12);
            print_message("%s, depth %d: %.1f dB, one sample %.1f\n", kind ? "glass" : "mirrors", depth, refined, one);
            assert_true(refined > one + 2 || refined > 45);
            for (int k = 0; k < 3; k++) stage_close(all[k]);
        }
}

/* A spark of light that is no number, or too much of one: the picture is another only where it stands, and around it. */
static void odd_light_stays_where_it_is(void **state)
{
    (void)state;
    static const float odd[] = {NAN, INFINITY, -INFINITY, 3e38f, 1e30f, -1, 1e-45f};
    struct plate plates[] = {{{-5, -5, -4, 10, 0, 0, 0, 10, 0}, shiny(0, 0)}, {{0.3, 0.2, -3.5, 0.4, 0, 0, 0, 0.4, 0}, shiny(0, 0)}};
    plates[1].material.emission[0] = 0.3f;
    load_plates(&a, 96, "selective", plates, 2);
    stage_open(&a, stage_workers());
    for (int n = 0; n < 3; n++) stage_frame(&a, 0, 0, 0);
    const double pixel = 2.0 * 3.5 / 96; /* size of one, there */
    const double low[2] = {0.3 / pixel + 48, 48 - 0.6 / pixel}, high[2] = {0.7 / pixel + 48, 48 - 0.2 / pixel};
    for (unsigned i = 0; i < sizeof odd / sizeof *odd; i++)
        for (int exposed = 0; exposed < 2; exposed++) {
            load_plates(&b, 96, "selective", plates, 2);
            int inside = 0;
            for (int k = 0; k < 3; k++) ((struct fv_material *)b.scene.material)[1].emission[k] = odd[i];
            if (exposed) b.scene.exposure = 1e6f;
            stage_open(&b, stage_workers());
            for (int n = 0; n < 3; n++) stage_frame(&b, 0, 0, 0);
            for (int y = 0; y < 96 && !exposed; y++)
                for (int x = 0; x < 96; x++) {
                    bool near = x + 1.6 > low[0] && x - 0.6 < high[0] && y + 1.6 > low[1] && y - 0.6 < high[1];
                    int step = stage_step(stage_row(&a, y)[x], stage_row(&b, y)[x]);
                    if (!near && step > 1) fail_msg("emission %g: pixel %d, %d changes by %d", (double)odd[i], x, y, step);
                    inside += near && step > 1;
                }
            if (!exposed && inside < 10) fail_msg("emission %g: only %d pixels change", (double)odd[i], inside);
            for (int64_t k = 0; k < 96 * b.loop.frame.stride; k++) {
                uint32_t cache = ((const uint32_t *)b.loop.frame.buffer[FV_CACHE][0])[k];
                float w = cache_depth_of(cache);
                assert_true(w == FV_DEPTH_UNKNOWN || (w >= 0 && w <= FV_INVERSE_DEPTH_MAX * 1.01f));
            }
            stage_close(&b);
        }
    stage_close(&a);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nothing_fails), cmocka_unit_test(only_interpolation), cmocka_unit_test(everything_refined_is_full),
        cmocka_unit_test(known_samples_are_as_good_as_traced_ones), cmocka_unit_test(known_hits_are_those_traced),
        cmocka_unit_test(workers_and_order_change_nothing), cmocka_unit_test(scenes_of_all_kinds),
        cmocka_unit_test(mirrors_and_glass_without_end), cmocka_unit_test(odd_light_stays_where_it_is)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
