/* pupil: drawn frames of which the ellipse is known, and frames that no eye is in: black, white, saturated,
 * noise, two pupils, a single pixel, 4096x4096; ellipses through exact, few, coinciding and straight points.
 */
#include "sensors/eye/pupil_ellipse.h"
#include "sensors/eye/pupil.h"
#include "tests/support/program.h"
#include "tests/support/random.h"

#include <math.h>
#include <time.h>

#define COUNT(table) (sizeof table / sizeof table[0])
enum { GUARD = 64 };

struct drawn {
    uint8_t *pixels;
    int width, height, stride;
};

static struct drawn blank(int width, int height, int stride, int grey)
{
    struct drawn d = {malloc((size_t)stride * (size_t)height), width, height, stride};
    assert_non_null(d.pixels);
    memset(d.pixels, grey, (size_t)stride * (size_t)height);
    return d;
}

/* A dark ellipse, its edge `soft` pixels wide. */
static void draw(struct drawn *d, const struct fv_ellipse *e, double grey, double soft)
{
    for (int y = 0; y < d->height; y++)
        for (int x = 0; x < d->width; x++) {
            uint8_t *p = &d->pixels[y * d->stride + x];
            double share = 0.5 - fv_ellipse_distance(e, x, y) / soft;
            share = fmin(fmax(share, 0), 1);
            *p = (uint8_t)(*p + (grey - *p) * share + 0.5);
        }
}

static void add_noise(struct drawn *d, double deviation, uint64_t seed)
{
    for (int i = 0; i < d->stride * d->height; i++) {
        double sum = 0;
        for (int j = 0; j < 4; j++) sum += random_between(&seed, -1, 1);
        d->pixels[i] = (uint8_t)fmin(fmax(d->pixels[i] + deviation * sum / sqrt(4.0 / 3) + 0.5, 0), 255);
    }
}

static void sane(const struct fv_pupil *p)
{
    assert_true(isfinite(p->x) && isfinite(p->y) && isfinite(p->major) && isfinite(p->minor) &&
                isfinite(p->angle));
    assert_true(p->confidence >= 0 && p->confidence <= 1);
    assert_true(p->found == (p->confidence >= FV_PUPIL_CONFIDENT));
    assert_true(p->major >= p->minor && p->minor >= 0);
    assert_true(p->angle > -M_PI / 2 && p->angle <= M_PI / 2 + 1e-12);
}

/* Searches with scratch memory full of ones, whose end is guarded. */
static struct fv_pupil find(const struct drawn *d, struct fv_pupil_track *track)
{
    struct fv_eye_frame frame = {d->pixels, d->width, d->height, d->stride};
    size_t bytes = fv_pupil_scratch_bytes(d->width, d->height);
    assert_true(bytes > 0);
    char *scratch = aligned_alloc(64, ((bytes + 63) & ~(size_t)63) + GUARD);
    assert_non_null(scratch);
    memset(scratch, 0xff, bytes + GUARD);
    struct fv_pupil p;
    memset(&p, 0xff, sizeof p);
    fv_pupil_find(&frame, NULL, track, scratch, &p);
    for (int i = 0; i < GUARD; i++) assert_int_equal((uint8_t)scratch[bytes + (size_t)i], 0xff);
    free(scratch);
    sane(&p);
    return p;
}

/* Widths from the least to the most, any angle, any fraction of a pixel. */
static void drawn_ellipses_are_found(void **state)
{
    (void)state;
    static const struct {
        int width, height;
        double major, minor, centre_px, axis_px;
    } table[] = {
        {640, 400, 22, 20, 0.15, 0.6},  {640, 400, 56, 50, 0.1, 0.4},    {640, 480, 110, 90, 0.1, 0.5},
        {640, 400, 160, 130, 0.1, 0.6}, {320, 240, 30, 24, 0.1, 0.4},    {192, 192, 40, 34, 0.1, 0.4},
        {400, 400, 60, 40, 0.1, 0.5},   {1280, 720, 100, 80, 0.15, 0.6}, {1920, 1080, 120, 100, 0.25, 1},
        {2048, 2048, 300, 280, 0.3, 1},
    };
    uint64_t seed = 1;
    for (unsigned i = 0; i < COUNT(table); i++)
        for (int turn = 0; turn < 4; turn++) {
            double angle = -1.2 + 0.7 * turn;
            struct drawn d = blank(table[i].width, table[i].height, table[i].width, 90);
            struct fv_ellipse e = {d.width * random_between(&seed, 0.4, 0.6),
                                   d.height * random_between(&seed, 0.4, 0.6),
                                   0.5 * table[i].major,
                                   0.5 * table[i].minor,
                                   cos(angle),
                                   sin(angle)};
            draw(&d, &e, 20, 3);
            struct fv_pupil p = find(&d, NULL);
            if (!p.found || hypot(p.x - e.x, p.y - e.y) > table[i].centre_px ||
                fabs(p.major - table[i].major) > table[i].axis_px ||
                fabs(p.minor - table[i].minor) > table[i].axis_px ||
                (table[i].major - table[i].minor >= 10 && fabs(sin(p.angle - angle)) > 0.05))
                fail_msg("%dx%d, %g x %g px at %g: confidence %g, off by %g %g, axes %g %g at %g", d.width,
                         d.height, table[i].major, table[i].minor, angle, p.confidence, p.x - e.x, p.y - e.y,
                         p.major, p.minor, p.angle);
            free(d.pixels);
        }
}

/* Glints on the outline, a lid over a quarter of it, noise: still found, to a pixel. */
static void hidden_parts(void **state)
{
    (void)state;
    struct fv_ellipse e = {310.3, 205.6, 30, 27, 0.8, 0.6};
    for (int i = 0; i < 8; i++) {
        struct drawn d = blank(640, 400, 640, 80);
        draw(&d, &e, 30, 3);
        for (int j = 0; j < 2; j++) {
            double angle = i + 2.5 * j;
            struct fv_ellipse glint = {e.x + 28 * cos(angle), e.y + 28 * sin(angle), 4, 4, 1, 0};
            draw(&d, &glint, 250, 2);
        }
        for (int y = 0; y < e.y - 18 && i % 2; y++) memset(d.pixels + y * 640, 110, 640);
        add_noise(&d, 3, (uint64_t)i);
        struct fv_pupil p = find(&d, NULL);
        if (!p.found || hypot(p.x - e.x, p.y - e.y) > 1)
            fail_msg("%d: confidence %g, at %g %g", i, p.confidence, p.x, p.y);
        free(d.pixels);
    }
}

static void none_in(struct drawn *d, const char *what)
{
    struct fv_pupil p = find(d, NULL);
    if (p.found)
        fail_msg("%s: confidence %g at %g %g, %g x %g", what, p.confidence, p.x, p.y, p.major, p.minor);
    free(d->pixels);
}

static void frames_without_a_pupil(void **state)
{
    (void)state;
    static const int sizes[][2] = {{1, 1},   {1, 400}, {640, 1},   {8, 8},   {7, 300},
                                   {16, 16}, {33, 17}, {640, 400}, {4096, 3}};
    for (unsigned i = 0; i < COUNT(sizes); i++)
        for (int grey = 0; grey <= 255; grey += 51) {
            struct drawn d = blank(sizes[i][0], sizes[i][1], sizes[i][0] + (int)i, grey);
            none_in(&d, "one grey");
        }
    for (unsigned i = 0; i < 6; i++) {
        uint64_t seed = i;
        struct drawn d = blank(640, 400, 640, 100), saturated = blank(640, 400, 640, 255),
                     ramp = blank(640, 400, 640, 0);
        if (i < 3)
            for (int j = 0; j < 640 * 400; j++) d.pixels[j] = (uint8_t)(random_bits(&seed) >> 56);
        else add_noise(&d, 4 * i, i);
        none_in(&d, "noise");
        for (int j = 0; j < 640 * 400; j++) ramp.pixels[j] = (uint8_t)((j % 640 * (int)i + j / 640 * 3) / 10);
        none_in(&ramp, "a ramp");
        /* Only a corner of it is not saturated. */
        for (int y = 0; y < 60; y++)
            for (int x = 0; x < 90; x++) saturated.pixels[y * 640 + x] = (uint8_t)(2 * x + y);
        none_in(&saturated, "saturated");
    }
}

/* Either will do, neither in between; a second one far worse does not matter. */
static void two_pupils(void **state)
{
    (void)state;
    struct drawn d = blank(640, 400, 640, 100);
    struct fv_ellipse left = {180, 200, 30, 28, 1, 0}, right = {450, 190, 30, 28, 1, 0};
    draw(&d, &left, 20, 3);
    draw(&d, &right, 20, 3);
    struct fv_pupil p = find(&d, NULL), again = find(&d, NULL);
    assert_memory_equal(&p, &again, sizeof p);
    assert_true(p.found);
    assert_true(fmin(hypot(p.x - left.x, p.y - left.y), hypot(p.x - right.x, p.y - right.y)) < 0.2);
    free(d.pixels);
}

static void rows_may_be_longer_than_the_picture(void **state)
{
    (void)state;
    struct fv_ellipse e = {300, 200, 30, 26, 0.6, 0.8};
    struct drawn tight = blank(640, 400, 640, 90), wide = blank(640, 400, 777, 255);
    draw(&tight, &e, 20, 3);
    for (int y = 0; y < 400; y++) memcpy(wide.pixels + y * 777, tight.pixels + y * 640, 640);
    struct fv_pupil a = find(&tight, NULL), b = find(&wide, NULL);
    assert_memory_equal(&a, &b, sizeof a);
    assert_true(a.found);
    free(tight.pixels);
    free(wide.pixels);
}

/* 16 million pixels of noise: the lists are full, and still it ends within a second of this thread's time. */
static void huge_frames_end(void **state)
{
    (void)state;
    struct drawn d = blank(4096, 4096, 4096, 0);
    struct timespec begin, end;
    uint64_t seed = 5;
    for (int y = 0; y < 4096; y += 8)
        for (int x = 0; x < 4096; x += 8) {
            uint8_t grey = (uint8_t)(random_bits(&seed) >> 56);
            for (int i = 0; i < 8; i++) memset(d.pixels + (y + i) * 4096 + x, grey, 8);
        }
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &begin);
    find(&d, NULL);
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &end);
    double seconds = (double)(end.tv_sec - begin.tv_sec) + 1e-9 * (double)(end.tv_nsec - begin.tv_nsec);
#ifdef FV_HEAP /* not with sanitizers */
    if (seconds > 1) fail_msg("%g s", seconds);
#else
    (void)seconds;
#endif
    free(d.pixels);
    assert_int_equal(fv_pupil_scratch_bytes(0, 5), 0);
    assert_int_equal(fv_pupil_scratch_bytes(5, -1), 0);
    assert_int_equal(fv_pupil_scratch_bytes(FV_PUPIL_SIDE_MAX + 1, 5), 0);
    assert_true(fv_pupil_scratch_bytes(4096, 4096) < 8 << 20);
}

/* A pupil that moves a little is followed in its region, lost in a blink, found again anywhere; the answers
 * are those of the search in the whole frame. */
static void following(void **state)
{
    (void)state;
    struct fv_pupil_track track = {0};
    for (int i = 0; i < 30; i++) {
        struct drawn d = blank(640, 400, 640, 95);
        struct fv_ellipse e = {
            i < 20 ? 150 + 9 * i : 600, i < 20 ? 120 + 7 * i : 360, 26 + 0.3 * i, 24 + 0.3 * i, 1, 0};
        bool blink = i >= 10 && i < 13;
        if (!blink) draw(&d, &e, 25, 3);
        add_noise(&d, 2, (uint64_t)i);
        struct fv_pupil p = find(&d, &track), whole = find(&d, NULL);
        assert_int_equal(p.found, !blink);
        if (p.found) assert_true(hypot(p.x - e.x, p.y - e.y) < 0.3);
        if (p.found) assert_true(hypot(p.x - whole.x, p.y - whole.y) < 0.3);
        free(d.pixels);
    }
    assert_int_equal(track.frames, 30);
    assert_int_equal(track.found, 27);
    assert_int_equal(track.followed,
                     30 - 3 - 1 - 1 - 1); /* not: first, in and after the blink, after the jump */
}

/* What was known of a larger stream is of no harm: regions off the frame are not read. */
static void regions_off_the_frame(void **state)
{
    (void)state;
    static const double places[][2] = {{-500, 20},     {20, 1e9},          {5000, 5000},
                                       {-1e12, -1e12}, {1e300, -INFINITY}, {NAN, NAN}};
    for (unsigned i = 0; i < COUNT(places); i++) {
        struct fv_pupil_track track = {.last = {true, places[i][0], places[i][1], 60, 50, 0, 1}};
        struct drawn d = blank(100, 80, 100, 90);
        find(&d, &track);
        assert_false(track.last.found);
        free(d.pixels);
    }
}

static void ellipses_through_points(void **state)
{
    (void)state;
    uint64_t seed = 3;
    for (int i = 0; i < 2000; i++) {
        double angle = random_between(&seed, -1.5, 1.5), a = random_decade(&seed, 1e-2, 1e4);
        struct fv_ellipse e = {random_between(&seed, -1e4, 1e4),
                               random_between(&seed, -1e4, 1e4),
                               a,
                               a * random_between(&seed, 0.2, 0.95),
                               cos(angle),
                               sin(angle)},
                          fit;
        struct fv_outline_point point[40];
        for (int j = 0; j < 40; j++) {
            double normal[2], at[2], t = 0.1 * i + 2 * M_PI * (i % 2 ? 0.6 : 1) * j / 40;
            fv_ellipse_outline(&e, cos(t), sin(t), at, normal);
            point[j] = (struct fv_outline_point){at[0], at[1], 1};
        }
        assert_true(fv_ellipse_fit(point, 40, &fit));
        double near = 1e-6 * e.a + 1e-9;
        if (hypot(fit.x - e.x, fit.y - e.y) > near || fabs(fit.a - e.a) > near || fabs(fit.b - e.b) > near ||
            fabs(fit.c * e.s - fit.s * e.c) > 1e-5)
            fail_msg("%d: %g %g %g %g became %g %g %g %g", i, e.x, e.y, e.a, e.b, fit.x, fit.y, fit.a, fit.b);
        if (i % 2) continue;
        for (int j = 0; j < 8; j++)
            point[(i + j) % 40].x += 0.3 * e.a; /* a fifth of the outline lies elsewhere */
        assert_true(fv_ellipse_fit_parts(point, 40, 1e-3 * e.a, &fit));
        assert_true(fv_ellipse_trim(point, 40, 1e-3 * e.a, &fit));
        assert_true(hypot(fit.x - e.x, fit.y - e.y) < 1e-3 * e.a);
    }
}

static void points_on_no_ellipse(void **state)
{
    (void)state;
    struct fv_outline_point point[20], none = {0};
    struct fv_ellipse e;
    for (int i = 0; i < 20; i++) point[i] = (struct fv_outline_point){3, 4, 1};
    assert_false(fv_ellipse_fit(point, 20, &e)); /* all at one place */
    for (int i = 0; i < 20; i++) point[i] = (struct fv_outline_point){i, 2 * i, 1};
    assert_false(fv_ellipse_fit(point, 20, &e)); /* on a line */
    for (int i = 0; i < 20; i++) point[i] = (struct fv_outline_point){cos(i), sin(i), i < 5};
    assert_false(fv_ellipse_fit(point, 20, &e)); /* too few that weigh */
    assert_false(fv_ellipse_fit(&none, 0, &e));
    for (int i = 0; i < 20; i++) point[i] = (struct fv_outline_point){i == 7 ? NAN : cos(i), sin(i), 1};
    assert_false(fv_ellipse_fit(point, 20, &e));
    /* On a hyperbola the nearest ellipse may be far away, but it is one. */
    for (int i = 0; i < 20; i++)
        point[i] = (struct fv_outline_point){i - 10, sqrt(1.0 + (i - 10) * (i - 10)), 1};
    if (fv_ellipse_fit(point, 20, &e)) assert_true(isfinite(e.x + e.y + e.a) && e.b > 0);
}

/* Limits that are no limits find nothing, or what there is. */
static void odd_limits(void **state)
{
    (void)state;
    static const struct fv_pupil_limits table[] = {{NAN, NAN}, {0, INFINITY}, {INFINITY, INFINITY}, {-5, -3},
                                                   {100, 50},  {0, 1e300},    {1e300, 0},           {0, 0}};
    struct drawn d = blank(320, 240, 320, 90);
    struct fv_ellipse e = {150, 120, 20, 18, 1, 0};
    draw(&d, &e, 20, 3);
    void *scratch = aligned_alloc(64, (fv_pupil_scratch_bytes(320, 240) + 63) & ~(size_t)63);
    for (unsigned i = 0; i < COUNT(table); i++) {
        struct fv_eye_frame frame = {d.pixels, 320, 240, 320};
        struct fv_pupil p;
        fv_pupil_find(&frame, &table[i], NULL, scratch, &p);
        sane(&p);
        assert_true(p.found == (table[i].least == 0 && table[i].most > 100));
    }
    free(scratch);
    free(d.pixels);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(drawn_ellipses_are_found),
        cmocka_unit_test(hidden_parts),
        cmocka_unit_test(frames_without_a_pupil),
        cmocka_unit_test(two_pupils),
        cmocka_unit_test(rows_may_be_longer_than_the_picture),
        cmocka_unit_test(huge_frames_end),
        cmocka_unit_test(following),
        cmocka_unit_test(regions_off_the_frame),
        cmocka_unit_test(odd_limits),
        cmocka_unit_test(ellipses_through_points),
        cmocka_unit_test(points_on_no_ellipse),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
