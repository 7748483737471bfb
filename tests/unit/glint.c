/* glint: reflections of the simulated camera's LEDs, whose places are known: found at all gazes and sizes,
 * their middle the same where lids hide some; none where there are none; rings of all sizes with spots
 * missing and added. */
#include "sensors/eye/glint.h"
#include "sensors/eye/image_sim.h"

#include "tests/support/program.h"
#include "tests/support/random.h"

enum { WIDTH = 640, HEIGHT = 400, MOST = 400 };
static uint8_t pixels[WIDTH * HEIGHT];

/* Middle of the cornea's reflections, by image_sim's measures of the eye: 5.6 mm from the eye's middle. */
static void true_middle(const struct fv_eye_camera *c, const struct fv_eye_state *s, double out[2])
{
    out[0] = c->x + 5.6 * s->direction[0] * c->px_per_mm;
    out[1] = c->y - 5.6 * s->direction[1] * c->px_per_mm;
}

static struct fv_eye_state looking(double right_deg, double up_deg, double pupil_mm)
{
    double x = right_deg * (M_PI / 180), y = up_deg * (M_PI / 180);
    return (struct fv_eye_state){1000, {sin(x) * cos(y), sin(y), -cos(x) * cos(y)}, pupil_mm, 1};
}

static int spots_of(const struct fv_eye_camera *c, const struct fv_eye_state *s, struct fv_glint *spot)
{
    struct fv_eye_frame frame = {pixels, c->width, c->height, WIDTH};
    struct fv_pupil truth;
    fv_eye_image(c, s, pixels, WIDTH, &truth);
    truth.found = true;
    return fv_glint_spots(&frame, &truth, spot);
}

static int by_size(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void all_gazes(void **state)
{
    (void)state;
    static const int sizes[][2] = {{640, 400}, {320, 240}, {400, 400}};
    for (unsigned k = 0; k < 3; k++) {
        static double error[MOST];
        int n = 0, asked = 0;
        struct fv_glint spot[FV_GLINTS_MAX];
        struct fv_eye_camera c = fv_eye_camera_usual(sizes[k][0], sizes[k][1], k + 1);
        struct fv_glint_ring ring = {.leds = c.leds};
        for (int i = -2; i <= 2; i++)
            for (int j = -2; j <= 2; j++)
                for (int m = 0; m < 3; m++) {
                    struct fv_eye_state s = looking(9 * (i ? i : 0), 6 * j, 2.5 + 1.7 * m);
                    double truth[2], middle[2];
                    int spots = spots_of(&c, &s, spot);
                    if (!ring.known && spots != c.leds) continue;
                    asked++;
                    true_middle(&c, &s, truth);
                    if (fv_glint_middle(&ring, spot, spots, middle))
                        error[n++] = hypot(middle[0] - truth[0], middle[1] - truth[1]);
                }
        assert_true(ring.known && n > 0);
        qsort(error, (size_t)n, sizeof *error, by_size);
        print_message("%dx%d: told %d of %d, median %.2f px, worst %.2f\n", c.width, c.height, n, asked,
                      error[n / 2], error[n - 1]);
        assert_true(asked > 60 && n >= asked * 9 / 10);
        assert_true(error[n / 2] < 0.35 && error[n - 1] < 2);
    }
}

static void none_where_none_are(void **state)
{
    (void)state;
    struct fv_glint spot[FV_GLINTS_MAX];
    int seen = 0;
    for (int i = 0; i < 20; i++) {
        struct fv_eye_camera c = fv_eye_camera_usual(WIDTH, HEIGHT, (uint64_t)i);
        c.leds = 0;
        struct fv_eye_state s = looking(2 * i - 20, 10 - i, 4);
        seen += spots_of(&c, &s, spot);
    }
    assert_int_equal(seen, 0);
    /* Frames of one grey, of noise, smaller than the window, pupils at and beyond every border. */
    uint64_t seed = 5;
    for (int i = 0; i < 3000; i++) {
        int width = 1 + (int)(random_bits(&seed) % 80), height = 1 + (int)(random_bits(&seed) % 80);
        uint8_t *p = malloc((size_t)width * (size_t)height);
        for (int k = 0; k < width * height; k++) p[k] = (uint8_t)(i % 3 ? random_bits(&seed) >> 56 : 255);
        struct fv_eye_frame frame = {p, width, height, width};
        struct fv_pupil pupil = {true,
                                 random_between(&seed, -100, 200),
                                 random_between(&seed, -100, 200),
                                 random_decade(&seed, 1e-3, 1e3),
                                 1,
                                 0,
                                 1};
        int spots = fv_glint_spots(&frame, &pupil, spot);
        assert_true(spots <= FV_GLINTS_MAX && (i % 3 || spots == 0));
        for (int k = 0; k < spots; k++)
            assert_true(spot[k].x > 0 && spot[k].x < width && spot[k].y > 0 && spot[k].y < height &&
                        spot[k].contrast > 0 && (k == 0 || spot[k].contrast <= spot[k - 1].contrast));
        pupil.found = false;
        assert_int_equal(fv_glint_spots(&frame, &pupil, spot), 0);
        free(p);
    }
}

/* A ring with some reflections hidden, others' spots beside them, in any order: the middle of all, or none.
 */
static void parts_of_rings(void **state)
{
    (void)state;
    uint64_t seed = 9;
    int told = 0, enough = 0;
    for (int i = 0; i < 3000; i++) {
        int leds = 1 + i % FV_GLINT_LEDS_MAX, spots = 0, seen = 0;
        double place[FV_GLINT_LEDS_MAX][2], middle[2];
        struct fv_glint spot[FV_GLINTS_MAX], all[FV_GLINT_LEDS_MAX];
        for (int k = 0; k < leds; k++) {
            place[k][0] = 40 * cos(2 * M_PI * k / leds), place[k][1] = 40 * sin(2 * M_PI * k / leds);
            if (leds == 1) place[k][0] = 0;
            all[k] = (struct fv_glint){100 + place[k][0], 90 + place[k][1], 100};
        }
        struct fv_glint_ring ring = {.leds = leds};
        assert_false(fv_glint_middle(&ring, all, leds - 1, middle)); /* not known yet */
        assert_true(fv_glint_middle(&ring, all, leds, middle));
        if (hypot(middle[0] - 100, middle[1] - 90) > 1e-9) fail_msg("%g %g", middle[0], middle[1]);
        for (int k = 0; k < leds; k++)
            if (random_between(&seed, 0, 1) < 0.7)
                spot[spots++] = (struct fv_glint){200 + place[k][0] + random_between(&seed, -1, 1),
                                                  50 + place[k][1] + random_between(&seed, -1, 1), 100};
        seen = spots;
        for (int k = 0; k < 2; k++) /* and two that are none */
            spot[spots++] =
                (struct fv_glint){random_between(&seed, 100, 300), random_between(&seed, 0, 100), 100};
        for (int k = 0; k < spots; k++) {
            int other = (int)(random_bits(&seed) % (uint64_t)spots);
            struct fv_glint g = spot[k];
            spot[k] = spot[other], spot[other] = g;
        }
        if (leds < 4) continue; /* other spots may well lie alike */
        bool whole = seen >= leds / 2 + 1, answer = fv_glint_middle(&ring, spot, spots, middle);
        enough += whole;
        told += whole && answer && hypot(middle[0] - 200, middle[1] - 50) < 2;
        if (whole && !answer) fail_msg("%d of %d seen, none told", seen, leds);
    }
    print_message("%d of %d\n", told, enough);
    assert_true(told >= enough * 98 / 100);
    /* A ring that was learnt from something else is forgotten. */
    struct fv_glint wrong[4] = {{10, 10, 50}, {30, 12, 50}, {33, 70, 50}, {90, 5, 50}},
                    right[4] = {{0, 0, 50}, {40, 0, 50}, {40, 40, 50}, {0, 40, 50}};
    struct fv_glint_ring slow = {.leds = 4};
    double at[2];
    int frames = 0;
    assert_true(fv_glint_middle(&slow, wrong, 4, at));
    while (!fv_glint_middle(&slow, right, 4, at)) assert_true(++frames < 100);
    assert_true(frames > 10 && fabs(at[0] - 20) < 1e-9 && fabs(at[1] - 20) < 1e-9);
    struct fv_glint_ring ring = {.leds = 0};
    double middle[2];
    struct fv_glint spot = {1, 1, 1};
    assert_false(fv_glint_middle(&ring, &spot, 1, middle));
    ring.leds = FV_GLINT_LEDS_MAX + 1;
    assert_false(fv_glint_middle(&ring, &spot, 1, middle));
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(all_gazes), cmocka_unit_test(none_where_none_are),
                                       cmocka_unit_test(parts_of_rings)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
