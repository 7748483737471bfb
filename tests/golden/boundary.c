/* boundary: nothing shows where the central region of the method selective ends, nor its regions within it: what has one
 * colour keeps it, whatever the gaze and the head do; and shadows beyond, which are looked up in lights' maps, meet those
 * within, which are traced. */
#include "tests/support/shown.h"
#include "tests/support/small_scene.h"
#include "tests/support/stage.h"

enum { SIDE = 320, FRAMES = 12 };

static struct stage s, full;

/* A plate behind the viewer, or a room of two walls with bars before them, under a point light and a sun. */
static void load(struct stage *to, const char *method, const char *periphery, bool room)
{
    static struct small_scene small;
    static const struct fv_light lights[] = {{.kind = FV_LIGHT_POINT, .position = {0.7f, 1.1f, 0.4f}, .colour = {30, 28, 25}},
                                             {.kind = FV_LIGHT_SUN, .position = {-0.3f, 0.5f, 0.81f}, .colour = {2, 2, 2.5f}}};
    static const double plates[][9] = {{-12, -8, -5, 24, 0, 0, 0, 16, 0}, {-12, -2, -5, 0, 0, 10, 24, 0, 0}};
    const double behind[] = {-1, -1, 900, 2, 0, 0, 0, 2, 0};
    struct fv_material grey = fv_material_default();
    struct fv_error error;
    for (int c = 0; c < 3; c++) grey.diffuse[c] = 0.6f;
    small_begin(&small);
    memset(to, 0, sizeof *to);
    int material = fv_build_material(small.build, &grey);
    if (!room) small_plate(&small, behind, behind + 3, behind + 6, 1, material);
    for (int i = 0; i < 2 && room; i++) small_plate(&small, plates[i], plates[i] + 3, plates[i] + 6, 8, material);
    for (int i = -7; i <= 7 && room; i++) {
        const double bar[9] = {0.7 * i, -1.5, -3 + 0.04 * i, 0.22, 0.05, 0.03, 0.25, 3, 0.1};
        small_plate(&small, bar, bar + 3, bar + 6, 2, material);
    }
    for (int i = 0; i < 2 && room; i++)
        if (fv_build_light(small.build, &lights[i], &error) < 0) fail_msg("%s", error.text);
    if (fv_build_finish(small.build, &to->scene, &error)) fail_msg("%s", error.text);
    to->config = small.config;
    small_picture(&to->config, SIDE);
    to->config.display_ipd_mm = 0;
    memset(to->config.scene_path.value, 0, sizeof to->config.scene_path.value);
    to->config.scene_path.count = 5;
    strcpy(to->config.display_sink, "none");
    strcpy(to->config.selective_periphery, periphery);
    strcpy(to->config.method_name, method);
    to->config.selective_near_deg = 14;
    to->scene.exposure = 1;
    for (int i = 0; i < 3; i++) to->scene.ambient[i] = 0.1f, to->scene.sky[i] = 0.2f;
    stage_open(to, stage_workers());
}

static void one_colour_stays_one_colour(void **state)
{
    (void)state;
    static const char *const peripheries[] = {"every", "sparse"};
    static const struct {
        double head_deg, gaze_deg; /* a frame */
    } motions[] = {{0, 0}, {0.6, 0}, {0, 0.7}, {-0.37, 0.5}};
    for (int p = 0; p < 2; p++)
        for (size_t m = 0; m < sizeof motions / sizeof *motions; m++) {
            load(&s, "selective", peripheries[p], false);
            for (int n = 0; n < FRAMES; n++) {
                stage_frame(&s, n * motions[m].head_deg, n * motions[m].gaze_deg - 8, n * 13333333);
                uint32_t first = shown_pixel(&s.loop.frame, 0, SIDE / 2, SIDE / 2);
                for (int y = 0; y < SIDE; y++)
                    for (int x = 0; x < SIDE; x++) {
                        uint32_t here = shown_pixel(&s.loop.frame, 0, x, y);
                        if (stage_step(here, first) > 2)
                            fail_msg("%s, motion %zu, frame %d: pixel %d, %d is %08x, not %08x", peripheries[p], m, n, x, y, here, first);
                    }
            }
            stage_close(&s);
        }
}

/* Within two pixels of this one the picture changes by more than so many codes. */
static bool edge_near(const struct stage *of, int x, int y, int step)
{
    for (int j = y > 1 ? y - 2 : 0; j <= y + 2 && j < SIDE; j++)
        for (int i = x > 1 ? x - 2 : 0; i <= x + 2 && i < SIDE; i++)
            if (stage_step(stage_row(of, j)[i], stage_row(of, y)[x]) > step) return true;
    return false;
}

static void shadows_meet(void **state)
{
    (void)state;
    for (int gaze = -20; gaze <= 20; gaze += 20) {
        load(&full, "full", "every", true);
        load(&s, "selective", "every", true);
        assert_true(s.plan.map_side > 0);
        stage_frame(&full, 0, gaze, 0);
        stage_frame(&s, 0, gaze, 0);
        int seam = 0, edges = 0, off = 0, beyond = 0;
        for (int y = 0; y < SIDE; y++)
            for (int x = 0; x < SIDE; x++) {
                double e = (double)stage_eccentricity(&s, x, y);
                int step = stage_step(stage_row(&s, y)[x], stage_row(&full, y)[x]);
                if (e < 15) continue; /* refined */
                beyond++, off += step > 4;
                if (step > 4 && !edge_near(&full, x, y, 20)) fail_msg("gaze %d, pixel %d, %d at %.1f degrees: off by %d, away from edges", gaze, x, y, e, step);
                if (e > 18) continue;
                seam += step > 4, edges += edge_near(&full, x, y, 20);
            }
        print_message("gaze %d: %d of %d pixels beyond, %d of %d near edges at the boundary, are off\n", gaze, off, beyond, seam, edges);
        assert_true(edges > 500 && seam < edges / 10 && off < beyond / 25);
        assert_true(s.record.rays[FV_RAY_SHADOW] < full.record.rays[FV_RAY_SHADOW] / 2);
        stage_close(&full);
        stage_close(&s);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(one_colour_stays_one_colour), cmocka_unit_test(shadows_meet)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
