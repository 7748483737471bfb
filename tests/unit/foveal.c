/* foveal: eccentricity, the foveal function, thresholds and views, at their extremes too. */
#include "rt/fovea/foveal.h"
#include "tests/support/program.h"

#include <float.h>
#include <math.h>

static const struct fv_pose identity = {{0, 0, 0}, {1, 0, 0, 0}};

static struct fv_view view_of(double half_deg, int size, const struct fv_pose *pose, const double gaze[3])
{
    double t = tan(half_deg * M_PI / 180);
    struct fv_lens lens = {t, t, t, t, size, size};
    struct fv_view view;
    fv_view_set(&view, &lens, pose, gaze);
    return view;
}

/* Against long double, for narrow and very wide lenses and gazes everywhere. */
static void eccentricity_is_exact(void **state)
{
    (void)state;
    static const double halves[] = {1, 30, 53, 80, 87.4};
    static const double gazes[][3] = {{0, 0, -1}, {0.3, -0.2, -0.9}, {0.9, 0.1, -0.1}, {-0.5, 0.5, -0.01}};
    for (unsigned h = 0; h < 5; h++)
        for (unsigned g = 0; g < 4; g++) {
            struct fv_view v = view_of(halves[h], 1000, &identity, gazes[g]);
            long double gx = gazes[g][0], gy = gazes[g][1], gz = gazes[g][2], t = tanl(halves[h] * 3.14159265358979323846264338327950288L / 180);
            for (int i = 0; i <= 20; i++)
                for (int j = 0; j <= 20; j++) {
                    long double x = t * (i / 10.0L - 1), y = t * (1 - j / 10.0L), z = -1;
                    long double cx = y * gz - z * gy, cy = z * gx - x * gz, cz = x * gy - y * gx;
                    long double e = atan2l(sqrtl(cx * cx + cy * cy + cz * cz), x * gx + y * gy + z * gz) * 180 / 3.14159265358979323846264338327950288L;
                    assert_true(fabsl((long double)fv_eccentricity_deg(&v, (float)i * 50, (float)j * 50) - e) < 1e-3L);
                }
        }
}

static void degenerate_gazes_look_ahead(void **state)
{
    (void)state;
    static const double gazes[][3] = {{NAN, 0, -1}, {0, 0, 0}, {0, 0, 1}, {INFINITY, 0, -1}, {1e-30, 0, -1e-30}, {1, 0, 0}};
    for (unsigned g = 0; g < 6; g++) {
        struct fv_view v = view_of(45, 100, &identity, gazes[g]);
        assert_true(fabsf(v.gaze[2] + 1) < 1e-6f);
        assert_true(fabsf(v.gaze_px[0] - 50) < 1e-3f);
        assert_true(fv_eccentricity_deg(&v, 50, 50) < 1e-3f);
    }
}

static void foveal_function(void **state)
{
    (void)state;
    static const struct {
        struct fv_foveal f;
        float e, p;
    } table[] = {
        {{10, 20, 0.05f}, 0, 1}, {{10, 20, 0.05f}, 10, 1}, {{10, 20, 0.05f}, 15, 0.525f}, {{10, 20, 0.05f}, 20, 0.05f},
        {{10, 20, 0.05f}, 180, 0.05f}, {{10, 20, 0.05f}, NAN, 1}, {{10, 10, 0.2f}, 10, 1}, {{10, 10, 0.2f}, 10.001f, 0.2f},
        {{0, 0, 0}, 0, 1}, {{0, 0, 0}, 1e-6f, 0}, {{0, 10, 1}, 5, 1}, {{5, 10, 1}, 90, 1}, {{180, 180, 1}, 180, 1},
        {{INFINITY, INFINITY, 1}, 90, 1}, {{20, 10, 0.1f}, 15, 1}, {{20, 10, 0.1f}, 25, 0.1f}};
    for (unsigned i = 0; i < sizeof table / sizeof table[0]; i++)
        if (!(fabsf(fv_foveal_probability(&table[i].f, table[i].e) - table[i].p) < 1e-6f)) fail_msg("row %u", i);
}

/* Every threshold once; neighbours far apart; over time each cell is drawn as often as p says. */
static void blue_noise(void **state)
{
    (void)state;
    static int seen[4096];
    const float *mask = fv_noise();
    double near = 0;
    for (int i = 0; i < 4096; i++) seen[(int)(mask[i] * 4096)]++;
    for (int i = 0; i < 4096; i++) assert_int_equal(seen[i], 1);
    for (int y = 0; y < 64; y++)
        for (int x = 0; x < 64; x++) near += fabs((double)mask[64 * y + x] - mask[64 * y + (x + 1) % 64]);
    assert_true(near / 4096 > 0.36); /* white noise: 1/3; this mask: 0.42 */
    for (int cell = 0; cell < 64; cell += 7) {
        int drawn = 0;
        for (int64_t frame = 1000000000000; frame < 1000000001000; frame++)
            drawn += fv_noise_threshold(mask, cell, 3 * cell, frame) < 0.05f;
        assert_in_range(drawn, 48, 52);
    }
}

/* The map agrees with projecting the world point into both views by long way, in double. */
static void map_agrees_with_projection(void **state)
{
    (void)state;
    static const double turns[][3] = {{0, 0, 0}, {0.001, 0.002, 0}, {0.05, -0.3, 0.1}}, moves[][3] = {{0, 0, 0}, {0.01, 0, -0.02}, {0.5, 0.2, 0.4}};
    static const double places[] = {0, 1e6};
    const double ahead[3] = {0, 0, -1};
    for (int turn = 0; turn < 3; turn++)
        for (int move = 0; move < 3; move++)
            for (int place = 0; place < 2; place++) {
                struct fv_pose before = {{places[place], 1, places[place]}, {1, 0, 0, 0}}, now = before;
                fv_quat_from_vector(turns[turn], now.rotation);
                for (int i = 0; i < 3; i++) now.position_m[i] += moves[move][i];
                struct fv_view a = view_of(50, 1000, &before, ahead), b = view_of(50, 1000, &now, ahead);
                struct fv_map m;
                fv_map_set(&m, &b, &a);
                for (int k = 0; k < 200; k++) {
                    double px = 5 * k + 0.5, py = (37 * k) % 1000 + 0.5, depth = 0.2 + 0.1 * k * k, step = 2 * tan(50 * M_PI / 180) / 1000;
                    double d[3] = {(px - 500) * step * depth, (500 - py) * step * depth, -depth}, world[3], back[3], inverse[4], pixel[2];
                    fv_quat_rotate(now.rotation, d, world);
                    for (int i = 0; i < 3; i++) world[i] += now.position_m[i] - before.position_m[i];
                    fv_quat_conjugate(before.rotation, inverse);
                    fv_quat_rotate(inverse, world, back);
                    double w = 1 / depth, z = m.m[2][0] * px + m.m[2][1] * py + m.m[2][2] + m.t[2] * w;
                    if (!fv_lens_project(&a.lens, back, pixel) || back[2] > -0.05) continue;
                    double x = (m.m[0][0] * px + m.m[0][1] * py + m.m[0][2] + m.t[0] * w) / z;
                    double y = (m.m[1][0] * px + m.m[1][1] * py + m.m[1][2] + m.t[1] * w) / z;
                    double scale = 1 + fabs(pixel[0]) + fabs(pixel[1]);
                    assert_true(fabs(x - pixel[0]) < 2e-5 * scale && fabs(y - pixel[1]) < 2e-5 * scale);
                    assert_true(fabs(w / z + 1 / back[2]) < 1e-5 / -back[2]);
                }
            }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(eccentricity_is_exact), cmocka_unit_test(degenerate_gazes_look_ahead),
        cmocka_unit_test(foveal_function),       cmocka_unit_test(blue_noise),
        cmocka_unit_test(map_agrees_with_projection),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
