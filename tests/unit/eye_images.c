/* eye_images: the simulated camera's images, and the pupil found in them: where it truly is over all gazes
 * and sizes, and none while the lids are closed. */
#include "sensors/eye/image_sim.h"
#include "tests/support/program.h"

#include <math.h>

enum { WIDTH = 640, HEIGHT = 400, MOST = 400 };
static uint8_t pixels[WIDTH * HEIGHT], again[WIDTH * HEIGHT];
static void *scratch;

static struct fv_eye_state looking(double right_deg, double up_deg, double pupil_mm)
{
    double x = right_deg * (M_PI / 180), y = up_deg * (M_PI / 180);
    return (struct fv_eye_state){1000, {sin(x) * cos(y), sin(y), -cos(x) * cos(y)}, pupil_mm, 1};
}

static int by_size(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static struct fv_pupil find(const struct fv_eye_camera *camera, const struct fv_eye_state *state,
                            struct fv_pupil *truth)
{
    struct fv_eye_frame frame = {pixels, camera->width, camera->height, WIDTH};
    struct fv_pupil p;
    fv_eye_image(camera, state, pixels, WIDTH, truth);
    fv_pupil_find(&frame, NULL, NULL, scratch, &p);
    return p;
}

static void grid_of_gazes(void **state)
{
    (void)state;
    static double error[MOST];
    static const double sizes_mm[] = {2.5, 4, 6.5};
    int n = 0, lost = 0;
    for (uint64_t seed = 1; seed <= 3; seed++) {
        struct fv_eye_camera camera = fv_eye_camera_usual(WIDTH, HEIGHT, seed);
        for (int size = 0; size < 3; size++)
            for (int i = -2; i <= 2; i++)
                for (int j = -2; j <= 2; j++) {
                    struct fv_eye_state s = looking(10 * i, 7 * j, sizes_mm[size]);
                    struct fv_pupil truth, p = find(&camera, &s, &truth);
                    assert_true(n < MOST);
                    /* A pupil that lids hide a third of may be missed. */
                    if (truth.confidence < 0.7) continue;
                    error[n] = p.found ? hypot(p.x - truth.x, p.y - truth.y) : 100;
                    lost += error[n++] > 5;
                }
    }
    qsort(error, (size_t)n, sizeof *error, by_size);
    print_message("%d gazes: median %.2f px, 95 %% %.2f, worst %.1f; %d lost\n", n, error[n / 2],
                  error[95 * n / 100], error[n - 1], lost);
    assert_true(n > 180);
    assert_true(error[n / 2] <= 1);
    assert_true(lost <= n / 50);
}

/* From no blur and noise to much of both: as long as the outline can be seen it is found. */
static void poor_cameras(void **state)
{
    (void)state;
    for (int i = 0; i < 5; i++) {
        struct fv_eye_camera camera = fv_eye_camera_usual(WIDTH, HEIGHT, 4);
        camera.blurs = 2 * i;
        camera.noise = 1.5 * i;
        camera.leds = 2 * i;
        struct fv_eye_state s = looking(3 * i - 6, 4 - 2 * i, 3.5);
        struct fv_pupil truth, p = find(&camera, &s, &truth);
        if (!p.found || hypot(p.x - truth.x, p.y - truth.y) > 1 || fabs(p.major - truth.major) > 4)
            fail_msg("%d: confidence %g, %g %g px off, axis %g of %g", i, p.confidence, p.x - truth.x,
                     p.y - truth.y, p.major, truth.major);
    }
}

static void closed_lids(void **state)
{
    (void)state;
    int found = 0, frames = 0;
    for (uint64_t seed = 1; seed <= 5; seed++)
        for (int i = -2; i <= 2; i++)
            for (int j = -1; j <= 1; j++, frames++) {
                struct fv_eye_camera camera = fv_eye_camera_usual(WIDTH, HEIGHT, seed);
                struct fv_eye_state s = looking(10 * i, 10 * j, 4);
                struct fv_pupil truth;
                s.open = 0;
                found += find(&camera, &s, &truth).found;
                assert_false(truth.found);
            }
    if (found) fail_msg("%d pupils in %d frames with closed lids", found, frames);
}

/* Six seconds of the simulated eye, frame after frame: blinks are none, between them the pupil is followed.
 */
static void a_stream(void **state)
{
    (void)state;
    struct fv_eye_camera camera = fv_eye_camera_usual(320, 240, 7);
    struct fv_pupil_track track = {0};
    int open = 0, seen = 0, shut = 0, none = 0;
    for (int i = 0; i < 150; i++) {
        struct fv_eye_state s;
        struct fv_pupil truth, p;
        struct fv_eye_frame frame = {pixels, 320, 240, WIDTH};
        fv_eye_state_at(7, 0, i * INT64_C(40000000), &s);
        fv_eye_image(&camera, &s, pixels, WIDTH, &truth);
        fv_pupil_find(&frame, NULL, &track, scratch, &p);
        if (s.open == 0) {
            shut++;
            none += !p.found;
        } else if (truth.confidence > 0.8) {
            open++;
            seen += p.found && hypot(p.x - truth.x, p.y - truth.y) < 1.5;
        }
    }
    print_message("seen %d of %d, none in %d of %d blinks; followed %d\n", seen, open, none, shut,
                  (int)track.followed);
    assert_true(open > 80 && shut > 2);
    assert_true(seen >= open - 2);
    assert_true(none == shut);
    assert_true(track.followed > open / 2);
}

/* The same bytes whenever asked; others for another time (noise) and another eye. Nothing outside the rows.
 */
static void pure_functions(void **state)
{
    (void)state;
    struct fv_eye_camera camera = fv_eye_camera_usual(WIDTH - 40, HEIGHT - 20, 9);
    struct fv_eye_state s = looking(5, 3, 4);
    memset(pixels, 77, sizeof pixels);
    memset(again, 77, sizeof again);
    fv_eye_image(&camera, &s, pixels, WIDTH, NULL);
    fv_eye_image(&camera, &s, again, WIDTH, NULL);
    assert_memory_equal(pixels, again, sizeof pixels);
    for (int y = 0; y < HEIGHT; y++)
        for (int x = y < HEIGHT - 20 ? WIDTH - 40 : 0; x < WIDTH; x++)
            assert_int_equal(pixels[y * WIDTH + x], 77);
    s.t_ns++;
    fv_eye_image(&camera, &s, again, WIDTH, NULL);
    assert_memory_not_equal(pixels, again, sizeof pixels);
    s.t_ns--;
    camera.seed++;
    fv_eye_image(&camera, &s, again, WIDTH, NULL);
    assert_memory_not_equal(pixels, again, sizeof pixels);
}

static int begin(void **state)
{
    (void)state;
    /* 320x240 is searched unboxed: more than for the larger frames. */
    size_t bytes = fv_pupil_scratch_bytes(WIDTH, HEIGHT), small = fv_pupil_scratch_bytes(320, 240);
    scratch = aligned_alloc(64, ((bytes > small ? bytes : small) + 63) & ~(size_t)63);
    return scratch == NULL;
}

static int end(void **state)
{
    (void)state;
    free(scratch);
    return 0;
}

/* Lamps are reflected in a ring about as wide as the pupil, so that glints lie on its outline, beside it and
 * in it: seen all the same, at any size of frame and pupil, where it is. */
static void glints_on_the_outline(void **state)
{
    (void)state;
    static const int frames[][2] = {{160, 120}, {192, 192}, {240, 160}, {320, 240}, {400, 400}};
    static const double sizes_mm[] = {2.5, 3.5, 4.25, 5.34, 6.5};
    for (unsigned f = 0; f < sizeof frames / sizeof *frames; f++) {
        int n = 0, found = 0, far = 0, ahead = 0, ahead_found = 0;
        for (int i = 0; i < 5 * 90; i++) {
            struct fv_eye_camera camera = fv_eye_camera_usual(frames[f][0], frames[f][1], (uint64_t)i % 7);
            bool straight = i % 90 >= 81;
            struct fv_eye_state s =
                looking(straight ? 0 : 5 * (i % 9 - 4), straight ? 0 : 5 * (i / 9 % 9 - 4), sizes_mm[i / 90]);
            s.t_ns = i + 1;
            struct fv_pupil truth, p = find(&camera, &s, &truth);
            if (truth.confidence < 0.7) continue;
            n++;
            found += p.found;
            far += p.found && hypot(p.x - truth.x, p.y - truth.y) > 2;
            ahead += straight;
            ahead_found += straight && p.found;
        }
        print_message("%dx%d: %.1f %% of %d found, %d far off; straight ahead %d of %d\n", frames[f][0],
                      frames[f][1], 100.0 * found / n, n, far, ahead_found, ahead);
        assert_true(n > 350 && found >= 0.97 * n && far <= 0.01 * n);
        assert_int_equal(ahead_found, ahead);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(grid_of_gazes),         cmocka_unit_test(poor_cameras),
        cmocka_unit_test(closed_lids),           cmocka_unit_test(a_stream),
        cmocka_unit_test(glints_on_the_outline), cmocka_unit_test(pure_functions)};
    return cmocka_run_group_tests(tests, begin, end);
}
