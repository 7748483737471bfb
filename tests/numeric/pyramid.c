/* pyramid: starts lie before every surface; the picture is full marching's where all is masked, and in the fovea where
 * it is foveated; what is traced in turns comes to the same where nothing moves; of many samples a pixel few
 * come to what all do; thin wires stay; and pictures of odd
 * sizes, gazes anywhere, scenes without fields. */
#include "rt/frame/loop.h"
#include "rt/pass/pyramid.h"
#include "rt/scene/path.h"
#include "tests/support/program.h"

#include <math.h>

enum { WIDTH = 301, HEIGHT = 263, PIXELS = WIDTH * HEIGHT };

static struct stage {
    struct fv_config config;
    struct fv_scene scene;
    struct fv_tracer tracer;
    struct fv_workers workers;
    struct fv_plan plan[2];
    struct fv_session session[2];
    struct fv_loop full, pyramid;
} s;

static void open_loop(struct fv_loop *loop, int n, const char *method)
{
    fv_frame_size(&loop->frame, &s.config);
    fv_plan_make(&s.plan[n], fv_method_find(method), &s.scene, &s.config, &loop->frame);
    fv_loop_open(loop, &s.config, &s.plan[n], &s.tracer, &s.workers, &s.session[n], 1);
}

static void open_stage(const char *scene, const char *const *sets, int count)
{
    static bool open;
    struct fv_config_request request = {.sets = 2, .set = {scene, "display.eyes=1"}};
    struct fv_error error;
    if (open) {
        fv_tracer_close(&s.tracer);
        fv_workers_stop(&s.workers);
    }
    open = true;
    for (int i = 0; i < count; i++) request.set[request.sets++] = sets[i];
    memset(&s, 0, sizeof s);
    if (fv_config_load(&s.config, &request, &error)) fail_msg("%s", error.text);
    s.config.display_width = WIDTH, s.config.display_height = HEIGHT;
    if (fv_scene_load(&s.scene, &s.config, &error) || fv_tracer_open(&s.tracer, &s.scene, &s.config, &error))
        fail_msg("%s", error.text);
    fv_workers_start(&s.workers, 2);
    open_loop(&s.full, 0, "full");
    open_loop(&s.pyramid, 1, "pyramid");
}

/* Returns primary rays. */
static int64_t render(struct fv_loop *loop, double at_s, const double gaze[3])
{
    struct fv_pose head;
    double both[2][3];
    struct fv_frame_record record;
    memcpy(both[0], gaze, sizeof both[0]);
    memcpy(both[1], gaze, sizeof both[1]);
    fv_path_pose(&s.config.scene_path, s.config.scene_path_seconds, (int64_t)(at_s * 1e9), &head);
    fv_loop_frame(loop, &head, (const double(*)[3])both, 0, (int64_t)(at_s * 1e9), &record);
    fv_pass_run(&fv_pass_present, &loop->frame, &s.workers);
    return record.rays[FV_RAY_PRIMARY];
}

static const uint8_t *shown(const struct fv_loop *loop)
{
    return loop->frame.buffer[FV_PICTURE][0];
}

struct differences {
    int pixels, far; /* compared; off by more than 16 of 255 */
    double psnr;
};

/* Of pixels whose eccentricity lies between. */
static struct differences compare(double from_deg, double to_deg)
{
    struct differences d = {0};
    const uint8_t *a = shown(&s.full), *b = shown(&s.pyramid);
    double sum = 0;
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            float e = fv_eccentricity_deg(&s.full.frame.view[0], (float)x + 0.5f, (float)y + 0.5f);
            int most = 0;
            if (e < from_deg || e >= to_deg) continue;
            for (int c = 0; c < 3; c++) {
                int off = abs(a[4 * (y * s.full.frame.stride + x) + c] - b[4 * (y * s.full.frame.stride + x) + c]);
                most = off > most ? off : most;
                sum += off * off;
            }
            d.pixels++;
            d.far += most > 16;
        }
    d.psnr = sum > 0 ? 10 * log10(255.0 * 255 * 3 * d.pixels / sum) : 100;
    return d;
}

static const double ahead[3] = {0, 0, -1};
static const char *const scenes[] = {"scene.name=primitives", "scene.name=columns", "scene.name=temple"};

/* Every pixel's surface lies behind where its rays begin. */
static void starts_lie_before_surfaces(void **state)
{
    (void)state;
    static struct fv_samples samples;
    for (int n = 0; n < 3; n++) {
        open_stage(scenes[n], NULL, 0);
        double gained = 0, all = 0;
        for (int at = 0; at < 4; at++) {
            int64_t rays[FV_RAY_KINDS] = {0};
            render(&s.pyramid, 7.3 * at, ahead);
            const struct fv_frame *f = &s.pyramid.frame;
            samples.started = false;
            for (int first = 0; first < PIXELS; first += FV_SAMPLES_MAX) {
                samples.count = PIXELS - first < FV_SAMPLES_MAX ? PIXELS - first : FV_SAMPLES_MAX;
                for (int i = 0; i < samples.count; i++) {
                    samples.x[i] = (float)((first + i) % WIDTH) + (i & 1 ? 0.02f : 0.98f);
                    samples.y[i] = (float)((first + i) / WIDTH) + (i & 2 ? 0.02f : 0.98f);
                }
                f->kernels->trace(&s.tracer, &f->view[0], &samples, 0, rays);
                for (int i = 0; i < samples.count; i++) {
                    float start = fv_start_at(f, 0, (first + i) % WIDTH / 4, (first + i) / WIDTH / 4);
                    float w = samples.inverse_depth[i], t = w > 0 ? 1 / w : INFINITY;
                    if (!(start <= t * 1.00001f)) fail_msg("%s: starts at %g, surface at %g", scenes[n], (double)start, (double)t);
                    if (w > 0) gained += start / t, all++;
                }
            }
        }
        print_message("%s: starts at %.3f of the way\n", scenes[n], gained / all);
        assert_true(gained > 0.7 * all);
    }
}

/* But for grazing rays: how they are stepped along decides where they hit. */
static void everything_masked_is_full(void **state)
{
    (void)state;
    static const int limits[] = {16, 80, 16}; /* columns: many far and thin ones, each with five lights' shadows */
    static const char *const one[] = {"method.foveation=off"}, *const four[] = {"method.foveation=off", "method.ssaa=4", "method.spp=4"};
    for (int n = 0; n < 6; n++) {
        open_stage(scenes[n / 2], n & 1 ? four : one, n & 1 ? 3 : 1);
        for (int at = 0; at < 2; at++) {
            render(&s.full, 9.1 * at, ahead);
            render(&s.pyramid, 9.1 * at, ahead);
            struct differences d = compare(0, 181);
            print_message("%s, %d spp: %d of %d pixels off, %.1f dB\n", scenes[n / 2], n & 1 ? 4 : 1, d.far, d.pixels, d.psnr);
            assert_true(d.far <= limits[n / 2] && d.psnr > 45);
        }
    }
}

/* Of 16 samples a pixel few are taken where these agree, and the picture stays that of all; asked for all, all are taken. */
static void samples_where_they_differ(void **state)
{
    (void)state;
    static const double shares[] = {0.5, 0.75, 0.5}; /* of rays, from above: pixels are a third of a degree */
    static const char *const agreeing[] = {"method.foveation=off", "method.ssaa=16", "method.spp=16"};
    static const char *const all[] = {"method.foveation=off", "method.ssaa=16", "method.spp=16", "method.ssaa_contrast=0"};
    for (int n = 0; n < 3; n++) {
        double psnr[2], rays[2];
        for (int k = 0; k < 2; k++) {
            open_stage(scenes[n], k ? all : agreeing, k ? 4 : 3);
            render(&s.full, 9.1, ahead);
            rays[k] = (double)render(&s.pyramid, 9.1, ahead);
            psnr[k] = compare(0, 181).psnr;
        }
        print_message("%s: %.3f of the rays, %.1f dB, of all %.1f dB\n", scenes[n], rays[0] / rays[1], psnr[0], psnr[1]);
        assert_true(rays[1] >= 16.0 * PIXELS && rays[0] < shares[n] * rays[1]);
        assert_true(psnr[0] > 42 && psnr[1] > 45);
    }
}

static void foveated(void **state)
{
    (void)state;
    static const double gazes[][3] = {{0, 0, -1}, {0.5, 0.3, -0.8}, {-0.9, -0.4, -0.1}, {0, 0, 1}};
    static const double least[] = {22, 22, 22}; /* dB, of the whole; pixels are a third of a degree */
    const char *const sets[] = {"fovea.inner_deg=7.5"};
    for (int n = 0; n < 3; n++) {
        open_stage(scenes[n], sets, 1);
        for (int g = 0; g < 4; g++) {
            render(&s.full, 5, gazes[g]);
            render(&s.pyramid, 5, gazes[g]);
            struct differences fovea = compare(0, 7.4), all = compare(0, 181);
            print_message("%s, gaze %d: fovea %d of %d off, all %.1f dB\n", scenes[n], g, fovea.far, fovea.pixels, all.psnr);
            assert_true(fovea.far <= 6 && all.psnr > least[n]);
            assert_true(all.far > 0); /* it is foveated */
        }
    }
}

/* Where nothing moves, tiles that are traced in turns come to what is traced in every frame; and a gaze that jumped
 * finds nothing left of before. Refined, in two rounds: what lies between tiles takes what is known of both. */
static void turns_come_to_the_same(void **state)
{
    (void)state;
    static const double aside[3] = {0.4, -0.2, -0.9};
    static uint8_t kept[4 * 320 * 288];
    static const char *const carries[] = {"method.carry=on", "method.carry=off"};
    for (int n = 0; n < 8; n++) {
        bool refined = n >= 4;
        const char *const sets[] = {"method.lowest_deg=16", "fovea.inner_deg=5", "method.refresh=4", carries[n & 1],
                                    refined ? "method.contrast=0.25" : "method.contrast=1"};
        int refresh = n & 2 ? 4 : 2;
        open_stage("scene.name=primitives", sets, 5);
        s.config.method_refresh = 1;
        render(&s.pyramid, 3, aside);
        memcpy(kept, shown(&s.pyramid), (size_t)(4 * s.pyramid.frame.stride * HEIGHT));
        s.config.method_refresh = refresh;
        fv_loop_restart(&s.pyramid);
        render(&s.pyramid, 8, ahead);
        for (int i = 0; i < (refined ? 2 : 1) * refresh; i++) render(&s.pyramid, 3, aside);
        for (int y = 0; y < HEIGHT; y++)
            assert_memory_equal(kept + 4 * y * s.pyramid.frame.stride, shown(&s.pyramid) + 4 * y * s.pyramid.frame.stride, 4 * WIDTH);
    }
}

/* Of a floor with checks, foveated: PSNR against full marching, and rays. */
static double floor_psnr(const char *contrast, const char *isa, double *rays)
{
    static const char text[] = "material a diffuse 0.8 0.75 0.7 checker 0.1 0.15 0.2 0.7\nsolid a: plane(0, 1, 0, -1)\n";
    static char field[320];
    const char *const sets[] = {field, "scene.file=", "scene.path=0 1 0 0 -35", "scene.path_seconds=0", "fovea.inner_deg=5",
                                "method.lowest_deg=10", contrast, isa};
    program_write("floor.field", text, strlen(text));
    snprintf(field, sizeof field, "scene.fields=%s/floor.field", program_folder());
    open_stage("scene.name=none", sets, 8);
    render(&s.full, 0, (const double[3]){0, 0, -1});
    render(&s.pyramid, 0, (const double[3]){0, 0, -1});
    *rays = 0;
    for (int w = 0; w < s.workers.count; w++) *rays += (double)s.pyramid.frame.scratch[w].rays[FV_RAY_PRIMARY];
    return compare(0, 180).psnr;
}

/* Where only checks differ they are full marching's, and take no rays but along the fovea and the picture's border. */
static void checks_are_painted(void **state)
{
    (void)state;
    static const char *const isas[] = {"threads.isa=auto", "threads.isa=avx2", "threads.isa=base"};
    for (int n = 0; n < 3; n++) {
        double rays[2], plain = floor_psnr("method.contrast=1", isas[n], &rays[0]);
        double painted = floor_psnr("method.contrast=0.25", isas[n], &rays[1]);
        print_message("checks: %.1f dB and %.0f rays, %.1f dB and %.0f rays painted anew\n", plain, rays[0], painted, rays[1]);
        assert_true(painted > plain + 8);
        assert_true(rays[1] < 1.3 * rays[0]);
    }
}

/* Pixels of full's picture that show a wire of 0.3 pixels before the sky, and how many of them ours shows. */
static double wire_kept(const char *starts, bool foveated)
{
    static const char text[] = "material a diffuse 1 1 1\nsolid a: union(capsule(-3, -2, -4, 3, 1.3, -4.5, 0.004), "
                               "capsule(-1, 2, -4, 0.7, -2, -4, 0.004))\n";
    char set[320];
    program_write("wire.field", text, strlen(text));
    snprintf(set, sizeof set, "scene.fields=%s/wire.field", program_folder());
    const char *const sets[] = {set, "scene.sky=0 0 0", "scene.ambient=1 1 1", "scene.file=", starts,
                                foveated ? "method.foveation=on" : "method.foveation=off", "method.lowest_deg=181"};
    int wire = 0, kept = 0;
    open_stage("scene.name=none", sets, 7);
    render(&s.full, 0, ahead);
    render(&s.pyramid, 0, ahead);
    const uint8_t *a = shown(&s.full), *b = shown(&s.pyramid);
    for (int y = 2; y < HEIGHT - 2; y++)
        for (int x = 2; x < WIDTH - 2; x++) {
            int64_t at = 4 * (y * s.full.frame.stride + x), most = 0;
            if (a[at] < 30) continue;
            /* The middle level shows it a pixel beside at most, and half as bright. */
            for (int k = 0; k < 9; k++) {
                int64_t p = at + 4 * ((k / 3 - 1) * s.full.frame.stride + k % 3 - 1);
                most = b[p] > most && (foveated || k == 4) ? b[p] : most;
            }
            wire++;
            kept += most > (foveated ? 15 : 30);
        }
    assert_true(wire > 30);
    return (double)kept / wire;
}

static void wires_stay(void **state)
{
    (void)state;
    double cones = wire_kept("method.starts=cones", false), minimum = wire_kept("method.starts=minimum", false);
    double periphery = wire_kept("method.starts=cones", true);
    print_message("wire of 0.3 pixels: cones keep %.3f, the minimum filter %.3f, foveated cones %.3f\n", cones, minimum, periphery);
    assert_true(cones >= 0.97);
    assert_true(minimum < 0.9);
    assert_true(periphery >= 0.8);
}

/* Without fields nothing is left but `full`, bit for bit; and there is no scene that it cannot show. */
static void scenes_without_fields(void **state)
{
    (void)state;
    const char *const sets[] = {"method.foveation=off"};
    open_stage("scene.name=cornell", sets, 1);
    render(&s.full, 2, ahead);
    render(&s.pyramid, 2, ahead);
    for (int y = 0; y < HEIGHT; y++)
        assert_memory_equal(shown(&s.full) + 4 * y * s.full.frame.stride, shown(&s.pyramid) + 4 * y * s.full.frame.stride, 4 * WIDTH);
}

/* Blurred or not, only what lies along the mask's edge changes, and nothing in the fovea. */
static void blur_stays_at_the_edge(void **state)
{
    (void)state;
    static uint8_t kept[4 * 320 * 288];
    const char *const sets[] = {"fovea.inner_deg=10"};
    int changed = 0;
    open_stage("scene.name=primitives", sets, 1);
    render(&s.pyramid, 3, ahead);
    int64_t stride = s.pyramid.frame.stride;
    memcpy(kept, shown(&s.pyramid), (size_t)(4 * stride * HEIGHT));
    s.pyramid.frame.pyramid.blur = true;
    render(&s.pyramid, 3, ahead);
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            float e = fv_eccentricity_deg(&s.pyramid.frame.view[0], (float)x + 0.5f, (float)y + 0.5f);
            bool differs = memcmp(kept + 4 * (y * stride + x), shown(&s.pyramid) + 4 * (y * stride + x), 3) != 0;
            if (differs && (e < 9.9f || e > 24)) fail_msg("blurred at %g degrees", (double)e);
            changed += differs;
        }
    print_message("%d pixels blurred\n", changed);
    assert_true(changed > 100);
}

static void edge_probabilities(void **state)
{
    (void)state;
    assert_true(fabsf(fv_edge_probability(0) - 0.91756f) < 1e-5f);
    assert_true(fabsf(fv_edge_probability(7.5f) - 0.08048f) < 1e-4f);
    assert_true(fv_edge_probability(90) > 0.0079f && fv_edge_probability(90) < 0.00793f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(starts_lie_before_surfaces), cmocka_unit_test(everything_masked_is_full),
        cmocka_unit_test(samples_where_they_differ), cmocka_unit_test(foveated), cmocka_unit_test(turns_come_to_the_same),
        cmocka_unit_test(wires_stay), cmocka_unit_test(checks_are_painted), cmocka_unit_test(scenes_without_fields),
        cmocka_unit_test(blur_stays_at_the_edge), cmocka_unit_test(edge_probabilities)};
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
