/* camera: lenses from 1 to 175 degrees, however lopsided, gazes everywhere, poses far out and close to each
 * other: directions, pixels, eccentricities and maps between views against long double. */
#include "rt/fovea/foveal.h"
#include "tests/support/long_rotation.h"
#include "tests/support/program.h"
#include "tests/support/random.h"

#include <float.h>

#define COUNT(table) (sizeof table / sizeof table[0])
static const double degree = M_PI / 180;

/* Degrees to the left, right, upper and lower edge; pixels. */
static const struct {
    double edge[4];
    int width, height;
} lenses[] = {
    {{0.5, 0.5, 0.5, 0.5}, 1000, 1000},     {{46.6323, 47.5268, 53.046, 53.046}, 1182, 1464},
    {{87.5, 87.5, 87.5, 87.5}, 1000, 1000}, {{87.5, 87.5, 87.5, 87.5}, 8192, 8192},
    {{1, 87.5, 87.5, 1}, 1000, 1000},       {{87.5, 1, 0.5, 87.5}, 8192, 16},
    {{87.5, 87.5, 0.5, 0.5}, 16, 8192},     {{30, 30, 30, 30}, 1, 1},
    {{1e-3, 1e-3, 1e-3, 1e-3}, 500, 500},
};

static struct fv_lens lens_of(unsigned i)
{
    const double *e = lenses[i].edge;
    return (struct fv_lens){tan(e[0] * degree), tan(e[1] * degree), tan(e[2] * degree),
                            tan(e[3] * degree), lenses[i].width,    lenses[i].height};
}

/* Direction through a pixel in the eye's frame, |z| = 1. */
static void direction_of(const struct fv_lens *l, long double x, long double y, long double out[3])
{
    out[0] = ((long double)l->tan_left + l->tan_right) * x / l->width - l->tan_left;
    out[1] = l->tan_up - ((long double)l->tan_up + l->tan_down) * y / l->height;
    out[2] = -1;
}

static long double angle_deg(const long double a[3], const long double b[3])
{
    long double cross[3], dot = 0;
    for (int i = 0; i < 3; i++) {
        cross[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
        dot += a[i] * b[i];
    }
    return atan2l(long_length(cross, 3), dot) * 180 / LONG_PI;
}

/* From 0 to 180 degrees to 1e-3: gazes along, across and against each pixel's ray, and near those; pixels
 * also outside the picture; heads turned and far from the origin. */
static void eccentricity(void **state)
{
    (void)state;
    static const double offs_deg[] = {0, 1e-6, 1e-4, 0.01, 1, 30, 89.99, 90, 120, 179, 179.99, 179.9999, 180};
    const double ahead[3] = {0, 0, -1};
    uint64_t random = 4;
    double worst = 0;
    for (unsigned k = 0; k < COUNT(lenses); k++)
        for (int n = 0; n < 4000; n++) {
            struct fv_lens l = lens_of(k);
            struct fv_pose pose = {{1e6, -1e6, 1e6}, {1, 0, 0, 0}};
            if (n % 3) random_rotation(&random, pose.rotation);
            struct fv_view view;
            fv_view_set(&view, &l, &pose, ahead);
            float x = (float)random_between(&random, 0, l.width),
                  y = (float)random_between(&random, 0, l.height);
            if (n % 8 == 0) x = n % 16 ? 0 : (float)l.width, y = n % 32 < 16 ? 0 : (float)l.height;
            if (n % 8 == 1) x = -3 * x, y = 2 * y + (float)l.height;
            long double d[3], turned[3], turn[3], gaze[3];
            double axis[3];
            direction_of(&l, x, y, d);
            long_rotate(long_unit(long_of(pose.rotation)), d, turned);
            random_direction(&random, axis);
            for (int i = 0; i < 3; i++) /* across the ray */
                turn[i] = turned[(i + 1) % 3] * axis[(i + 2) % 3] - turned[(i + 2) % 3] * axis[(i + 1) % 3];
            long double scale = offs_deg[n % (int)COUNT(offs_deg)] * LONG_PI / 180 / long_length(turn, 3),
                        length = long_length(turned, 3);
            for (int i = 0; i < 3; i++) turn[i] *= scale;
            long_rotate(long_exp(turn), turned, gaze);
            for (int i = 0; i < 3; i++) gaze[i] = view.gaze[i] = (float)(gaze[i] / length);
            double e = fv_eccentricity_deg(&view, x, y), off = fabs(e - (double)angle_deg(turned, gaze));
            worst = fmax(worst, off);
            if (!(off < 1e-3))
                fail_msg("lens %u, pixel %g %g: %g degrees, off by %g", k, (double)x, (double)y, e, off);
            assert_true(e >= 0 && e <= 180.0001);
        }
    print_message("eccentricity: off by at most %.1e degrees\n", worst);
}

/* Pixel to direction to pixel; a view's own rays in float too. */
static void project_and_back(void **state)
{
    (void)state;
    const double ahead[3] = {0, 0, -1};
    const struct fv_pose pose = {{0, 0, 0}, {1, 0, 0, 0}};
    uint64_t random = 5;
    for (unsigned k = 0; k < COUNT(lenses); k++)
        for (int n = 0; n < 20000; n++) {
            struct fv_lens l = lens_of(k);
            struct fv_view view;
            long double d[3];
            double x = random_between(&random, 0, l.width), y = random_between(&random, 0, l.height),
                   size = l.width + l.height;
            if (n < 4) x = n % 2 ? l.width : 0, y = n / 2 ? l.height : 0;
            if (n % 8 == 4) x *= -4, y *= 4, size *= 8;
            direction_of(&l, x, y, d);
            long double length = long_length(d, 3);
            double unit[3] = {(double)(d[0] / length), (double)(d[1] / length), (double)(d[2] / length)},
                   pixel[2];
            assert_true(fv_lens_project(&l, unit, pixel));
            /* The tangents are up to 23, the angles at a pixel down to a part of width: what cancels is in
             * size. */
            assert_true(fabs(pixel[0] - x) < 4 * DBL_EPSILON * size &&
                        fabs(pixel[1] - y) < 4 * DBL_EPSILON * size);
            for (int i = 0; i < 3; i++) unit[i] = -unit[i];
            assert_false(fv_lens_project(&l, unit, pixel));
            fv_view_set(&view, &l, &pose, ahead);
            double ray[3];
            for (int i = 0; i < 3; i++)
                ray[i] = (double)(view.corner[i] + (float)x * view.dx[i] + (float)y * view.dy[i]);
            assert_true(fv_lens_project(&l, ray, pixel));
            assert_true(fabs(pixel[0] - x) < 4 * (double)FLT_EPSILON * size &&
                        fabs(pixel[1] - y) < 4 * (double)FLT_EPSILON * size);
        }
}

/* Where a gaze goes that is none, too long or short, sideways or behind. */
static void gazes(void **state)
{
    (void)state;
    static const struct {
        double gaze[3];
        bool counts;
    } table[] = {
        {{0, 0, -1}, true},         {{0.6, 0, -0.8}, true},     {{0, 0, 1}, false},
        {{0.6, 0, 0.8}, false},     {{1, 0, 0}, false},         {{0, 1, -0.0}, false},
        {{1, 0, -1e-7}, true},      {{0, -1, -1e-12}, true},    {{1, 0, -1e-300}, true},
        {{-1, 0, -1e-7}, true},     {{0.6, 0.8, -1e-8}, true},  {{-0.8, 0.6, -1e-9}, true},
        {{0, 0, 0}, false},         {{0, 0, -5e-324}, false},   {{1e-200, 0, -1e-200}, false},
        {{2e-6, 0, -5e-7}, true},   {{3e5, 0, -4e5}, true},     {{1e200, 0, -1}, false},
        {{0, 0, -DBL_MAX}, false},  {{NAN, 0, -1}, false},      {{0, NAN, -1}, false},
        {{0, 0, NAN}, false},       {{INFINITY, 0, -1}, false}, {{0, -INFINITY, -1}, false},
        {{0, 0, -INFINITY}, false}, {{NAN, NAN, NAN}, false},   {{0.999, 0.0447, -1e-4}, true},
    };
    uint64_t random = 6;
    for (unsigned k = 0; k < COUNT(lenses); k++)
        for (unsigned g = 0; g < COUNT(table); g++) {
            struct fv_lens l = lens_of(k);
            struct fv_pose pose = {{0, 0, 0}, {1, 0, 0, 0}};
            struct fv_view view;
            long double gaze[3] = {0, 0, -1}, turned[3], length;
            random_rotation(&random, pose.rotation);
            for (int i = 0; i < 3 && table[g].counts; i++) gaze[i] = table[g].gaze[i];
            length = long_length(gaze, 3);
            fv_view_set(&view, &l, &pose, table[g].gaze);
            long_rotate(long_unit(long_of(pose.rotation)), gaze, turned);
            for (int i = 0; i < 3; i++)
                if (!(fabsl(view.gaze[i] - turned[i] / length) < 1e-7L))
                    fail_msg("lens %u, gaze %u: %g", k, g, (double)view.gaze[i]);
            /* In the picture's plane, held within a million pixels. */
            double across = (double)((gaze[0] / -gaze[2] + l.tan_left) * l.width /
                                     ((long double)l.tan_left + l.tan_right));
            double down =
                (double)((l.tan_up + gaze[1] / gaze[2]) * l.height / ((long double)l.tan_up + l.tan_down));
            bool sideways = -gaze[2] / length<1.5e-6L, far = fabs(across)> 9e5 || fabs(down) > 9e5;
            for (int i = 0; i < 2; i++) assert_true(fabsf(view.gaze_px[i]) <= 1e6f);
            if (sideways || far) {
                assert_true(fabsf(view.gaze_px[0]) > 5e5f || fabsf(view.gaze_px[1]) > 5e5f);
                if (fabs(across) > 5e5) assert_true(across * (double)view.gaze_px[0] > 0);
                if (fabs(down) > 5e5) assert_true(down * (double)view.gaze_px[1] > 0);
            }
            else if (!(fabs(view.gaze_px[0] - across) < 1e-6 * (2000 + fabs(across)) &&
                       fabs(view.gaze_px[1] - down) < 1e-6 * (2000 + fabs(down))))
                fail_msg("lens %u, gaze %u: pixel %g %g, not %g %g", k, g, (double)view.gaze_px[0],
                         (double)view.gaze_px[1], across, down);
        }
}

/* Every number of the map as exact as float holds it. */
static void check_map(const struct fv_view *now, const struct fv_view *before, const char *what, double a,
                      double b)
{
    struct fv_map map;
    const struct fv_lens *l = &now->lens, *k = &before->lens;
    fv_map_set(&map, now, before);
    struct long_rotation back = long_inverse(long_unit(long_of(before->pose.rotation)));
    struct long_rotation turn = long_product(back, long_unit(long_of(now->pose.rotation)));
    long double column[4][3] = {{((long double)l->tan_left + l->tan_right) / l->width, 0, 0},
                                {0, -((long double)l->tan_up + l->tan_down) / l->height, 0},
                                {-l->tan_left, l->tan_up, -1}};
    for (int i = 0; i < 3; i++)
        column[3][i] = (long double)now->pose.position_m[i] - before->pose.position_m[i];
    for (int c = 0; c < 4; c++) {
        long double size = long_length(column[c], 3), v[3], out[3], scale[3];
        long_rotate(c < 3 ? turn : back, column[c], v);
        long double across = k->width / ((long double)k->tan_left + k->tan_right),
                    down = k->height / ((long double)k->tan_up + k->tan_down);
        out[0] = (v[0] - k->tan_left * v[2]) * across, scale[0] = (1 + k->tan_left) * across * size;
        out[1] = (-k->tan_up * v[2] - v[1]) * down, scale[1] = (1 + k->tan_up) * down * size;
        out[2] = -v[2], scale[2] = size;
        for (int r = 0; r < 3; r++) {
            long double got = c < 3 ? map.m[r][c] : map.t[r],
                        limit = fabsl(out[r]) * 0x1p-24L + scale[r] * 2e-15L + FLT_TRUE_MIN;
            if (!(fabsl(got - out[r]) <= limit))
                fail_msg("%s %g %g: row %d, column %d: %.9g, not %.9g", what, a, b, r, c, (double)got,
                         (double)out[r]);
        }
    }
}

static void maps(void **state)
{
    (void)state;
    static const double places[] = {0, 1, 1e3, 1e6, 1e12}, moves[] = {0, 1e-12, 1e-6, 1e-3, 0.3, 1e3, 1e6};
    /* 0.47: what 2000 degrees a second turn in a frame of 75 Hz. */
    static const double turns[] = {0,    1e-300,   1e-12,       1e-9,         1e-6, 1e-3,
                                   0.47, M_PI / 2, M_PI - 1e-6, M_PI - 1e-12, M_PI};
    const double ahead[3] = {0, 0, -1};
    uint64_t random = 7;
    for (unsigned k = 0; k < COUNT(lenses); k++)
        for (unsigned m = 0; m < COUNT(moves); m++)
            for (unsigned t = 0; t < COUNT(turns); t++)
                for (unsigned p = 0; p < COUNT(places); p++) {
                    struct fv_lens l = lens_of(k), other = lens_of((k + m) % COUNT(lenses));
                    struct fv_pose before = {{0, 0, 0}, {1, 0, 0, 0}}, now;
                    struct fv_view a, b;
                    double way[3], axis[3], step[4];
                    random_direction(&random, way);
                    random_direction(&random, axis);
                    if (t % 3) random_rotation(&random, before.rotation);
                    fv_quat_normalise(before.rotation);
                    for (int i = 0; i < 3; i++) axis[i] *= turns[t];
                    fv_quat_from_vector(axis, step);
                    fv_quat_multiply(before.rotation, step, now.rotation);
                    fv_quat_normalise(now.rotation);
                    for (int i = 0; i < 3; i++) before.position_m[i] = (i - 1) * places[p];
                    for (int i = 0; i < 3; i++) now.position_m[i] = before.position_m[i] + moves[m] * way[i];
                    fv_view_set(&a, &l, &before, ahead);
                    fv_view_set(&b, m % 2 ? &l : &other, &now, ahead);
                    check_map(&b, &a, "move, turn", moves[m], turns[t]);
                }
}

/* A standing eye's map takes every pixel to itself, at every depth. */
static void standing_still(void **state)
{
    (void)state;
    static const float weights[] = {0, 1e-6f, 1, 1e4f};
    const double ahead[3] = {0, 0, -1};
    uint64_t random = 8;
    for (unsigned k = 0; k < COUNT(lenses); k++)
        for (int n = 0; n < 1000; n++) {
            struct fv_lens l = lens_of(k);
            struct fv_pose pose = {{1e6, 3, -1e6}, {1, 0, 0, 0}};
            struct fv_view view;
            struct fv_map map;
            random_rotation(&random, pose.rotation);
            fv_quat_normalise(pose.rotation);
            fv_view_set(&view, &l, &pose, ahead);
            fv_map_set(&map, &view, &view);
            float x = (float)random_between(&random, 0, l.width),
                  y = (float)random_between(&random, 0, l.height), w = weights[n % 4], to[3];
            for (int r = 0; r < 3; r++)
                to[r] = map.m[r][0] * x + map.m[r][1] * y + map.m[r][2] + w * map.t[r];
            float limit = 1e-6f * (float)(l.width + l.height);
            assert_true(fabsf(to[0] / to[2] - x) < limit && fabsf(to[1] / to[2] - y) < limit &&
                        fabsf(to[2] - 1) < 1e-6f);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(eccentricity), cmocka_unit_test(project_and_back),
                                       cmocka_unit_test(gazes), cmocka_unit_test(maps),
                                       cmocka_unit_test(standing_still)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
