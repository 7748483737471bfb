/* flicker: surfaces that move exactly as their depth says change nothing; what flashes, does by its size. */
#include "rt/measure/flicker.h"
#include "tests/support/program.h"

#include <math.h>

enum { W = 96, H = 64, N = W * H };

static uint8_t now[3 * N], before[3 * N];
static float depth_now[N], depth_before[N];
static const struct fv_map identity = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}};

static double flicker(const struct fv_map *map)
{
    struct fv_metrics_picture a = {W, H, 3, 3 * W, now}, b = {W, H, 3, 3 * W, before};
    return fv_flicker(&a, &b, map, depth_now, depth_before, W);
}

static void fill(float now_depth, float before_depth)
{
    for (int i = 0; i < N; i++) {
        depth_now[i] = now_depth;
        depth_before[i] = before_depth;
    }
    memset(now, 100, sizeof now);
    memset(before, 100, sizeof before);
}

static uint8_t texture(double x, double y, int k)
{
    return (uint8_t)lrint(128 + 50 * sin(0.21 * x + k) + 50 * cos(0.17 * y - k));
}

static void resting_pictures(void **state)
{
    static const float depths[] = {0, 1e-6f, 1, 1e4f};
    (void)state;
    for (int d = 0; d < 4; d++) {
        fill(depths[d], depths[d]);
        assert_true(flicker(&identity) == 0);
        /* One flashing pixel: 30 + 60 + 90 of 255, over 3 channels and all pixels. */
        for (int k = 0; k < 3; k++) now[3 * (W * 20 + 30) + k] = (uint8_t)(100 + 30 * (k + 1));
        assert_true(fabs(flicker(&identity) - 180.0 / (3 * 255.0 * N)) < 1e-15);
        now[3 * (W * 20 + 30)] = 255;
        depth_now[W * 20 + 30] = NAN;
        assert_true(flicker(&identity) == 0);
    }
}

/* A wall at depth 4 m and the eye moving along it: m the identity, t the pixels times the depth. */
static void moving_textures(void **state)
{
    static const double shifts[][2] = {{0, 0}, {3, -2}, {0.5, 0}, {0.25, -0.75}, {-7.3, 4.9}, {90, 0}};
    (void)state;
    for (int s = 0; s < 6; s++) {
        struct fv_map map = identity;
        fill(0.25f, 0.25f);
        map.t[0] = (float)(4 * shifts[s][0]);
        map.t[1] = (float)(4 * shifts[s][1]);
        for (int i = 0; i < 3 * N; i++) {
            double x = i / 3 % W, y = i / 3 / W;
            before[i] = texture(x, y, i % 3);
            now[i] = texture(x + shifts[s][0], y + shifts[s][1], i % 3);
        }
        /* Rounding of both, and of a bilinear lookup: 1/8 of the second derivatives. */
        double whole = shifts[s][0] == floor(shifts[s][0]) && shifts[s][1] == floor(shifts[s][1]);
        double bound = whole ? 1e-6 : (1 + (50 * 0.21 * 0.21 + 50 * 0.17 * 0.17) / 8) / 255;
        double value = flicker(&map);
        if (!(value <= bound))
            fail_msg("shift %g, %g: %g, at most %g", shifts[s][0], shifts[s][1], value, bound);
        /* Without the map it is seen. */
        if (s > 0) assert_true(flicker(&identity) > 2 * bound);
    }
}

static void what_was_hidden_is_left_out(void **state)
{
    (void)state;
    fill(0.25f, 0.25f);
    /* A white bar stood nearer before: what it hid must not count, nor may what it covers now. */
    for (int y = 0; y < H; y++)
        for (int x = 40; x < 50; x++) {
            depth_before[y * W + x] = 0.5f;
            memset(before + 3 * (y * W + x), 255, 3);
        }
    assert_true(flicker(&identity) == 0);
    for (int i = 0; i < N; i++) depth_now[i] = 0.5f;
    assert_true(fabs(flicker(&identity) - 155.0 / 255) < 1e-12); /* the bar alone */
    /* Depth differs by more than 1 %, and by less. */
    for (int sign = -1; sign <= 1; sign += 2) {
        fill(1, 1 + (float)sign * 0.011f);
        assert_true(isnan(flicker(&identity)));
        fill(1, 1 + (float)sign * 0.009f);
        assert_true(flicker(&identity) == 0);
    }
}

static void sky_only_turns(void **state)
{
    double t = tan(0.7), ahead[3] = {0, 0, -1};
    struct fv_lens lens = {t, t, t * H / W, t * H / W, W, H};
    struct fv_pose a = {{0, 0, 0}, {1, 0, 0, 0}}, b = {{1000, -50, 3}, {1, 0, 0, 0}};
    struct fv_view first, second;
    struct fv_map map;
    (void)state;
    fv_quat_from_yaw_pitch_roll(0.05, 0.02, 0.01, b.rotation);
    fv_view_set(&first, &lens, &a, ahead);
    fv_view_set(&second, &lens, &b, ahead);
    fv_map_set(&map, &second, &first);
    fill(0, 0);
    for (int v = 0; v < 2; v++)
        for (int i = 0; i < 3 * N; i++) {
            const struct fv_view *view = v ? &second : &first;
            double d[3];
            for (int k = 0; k < 3; k++)
                d[k] = (double)view->corner[k] + (i / 3 % W + 0.5) * (double)view->dx[k] +
                       (i / 3 / W + 0.5) * (double)view->dy[k];
            (v ? now : before)[i] = texture(40 * d[0] / -d[2], 40 * d[1] / -d[2], i % 3);
        }
    assert_true(flicker(&map) < 1.5 / 255);
    assert_true(flicker(&identity) > 3.0 / 255);
}

static void nothing_is_seen_twice(void **state)
{
    struct fv_map behind = {{{1, 0, 0}, {0, 1, 0}, {0, 0, -1}}, {0, 0, 0}};
    struct fv_map aside = {{{1, 0, 1e6f}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}};
    struct fv_map nonsense = {{{NAN, 0, 0}, {0, NAN, 0}, {0, 0, 1}}, {0, 0, 0}};
    static const float depths[] = {NAN, INFINITY, -1, -INFINITY};
    (void)state;
    fill(1, 1);
    assert_true(isnan(flicker(&behind)) && isnan(flicker(&aside)) && isnan(flicker(&nonsense)));
    for (int d = 0; d < 4; d++) {
        fill(depths[d], depths[d]);
        assert_true(isnan(flicker(&identity)));
        fill(1, depths[d]);
        assert_true(isnan(flicker(&identity)));
    }
    /* One bad pixel before takes away no more than the lookups that touch it. */
    fill(1, 1);
    depth_before[W * 10 + 10] = NAN;
    now[3 * (W * 10 + 12)] = 255;
    assert_true(fabs(flicker(&identity) - 155 / (3 * 255.0 * (N - 1))) < 1e-15);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(resting_pictures),
        cmocka_unit_test(moving_textures),
        cmocka_unit_test(what_was_hidden_is_left_out),
        cmocka_unit_test(sky_only_turns),
        cmocka_unit_test(nothing_is_seen_twice),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
