/* metrics: known values of PSNR, RMSE, SSIM and FLIP, their zones, and that threads change nothing. */
#include "rt/fovea/foveal.h"
#include "tests/support/judged.h"
#include "tests/support/picture.h"

#define DATA FV_SOURCE_DIR "/../shared/data/metrics/"

static struct judged j;

/* Values of the methods' own programs. FLIP's takes 67.0206 pixels per degree where it is not told, which
 * is written as 67. */
static const struct {
    const char *name;
    double ppd, flip, flip_tolerance, ssim, psnr;
} published[] = {
    {"noise12", 67, 0.091028, 5e-5, 0.816077, 26.7494},
    {"blur2", 67, 0.119907, 5e-5, 0.688022, 26.7683},
    {"dark090", 67, 0.198005, 5e-5, 0.990439, 28.3061},
    {"block4", 67, 0.106991, 5e-5, 0.639861, 25.6015},
    {"shift1", 67, 0.102233, 5e-5, 0.762710, 26.0770},
    {"noise12", 67.0206, 0.091028, 3e-6, 0.816077, 26.7494},
    {"blur2", 67.0206, 0.119907, 3e-6, 0.688022, 26.7683},
    {"dark090", 67.0206, 0.198005, 3e-6, 0.990439, 28.3061},
    {"block4", 67.0206, 0.106991, 3e-6, 0.639861, 25.6015},
    {"shift1", 67.0206, 0.102233, 3e-6, 0.762710, 26.0770},
    {"noise12", 20, 0.210630, 3e-6, 0.816077, 26.7494},
    {"blur2", 20, 0.181023, 3e-6, 0.688022, 26.7683},
    {"noise12", 40, 0.127082, 3e-6, 0.816077, 26.7494},
    {"blur2", 40, 0.147665, 3e-6, 0.688022, 26.7683},
};

static void load(uint8_t *pixels, const char *name)
{
    char path[512];
    snprintf(path, sizeof path, DATA "%s.png", name);
    struct picture p = picture_read(path);
    j.width = p.width;
    j.height = p.height;
    assert_true(3 * p.width * p.height <= JUDGED_BYTES);
    memcpy(pixels, p.rgb, (size_t)(3 * p.width * p.height));
    free(p.rgb);
}

static void published_values_are_met(void **state)
{
    (void)state;
    if (!fv_file_exists(DATA "ref256.png")) {
        printf("%s is not there: left out\n", DATA);
        skip();
    }
    load(j.reference, "ref256");
    load(j.test, "ref256");
    judge(&j, 67, NULL);
    assert_true(isinf(j.errors.psnr[FV_ZONE_ALL]) && j.errors.ssim[FV_ZONE_ALL] == 1 &&
                j.errors.flip[FV_ZONE_ALL] == 0);
    for (unsigned i = 0; i < sizeof published / sizeof published[0]; i++) {
        load(j.test, published[i].name);
        judge(&j, published[i].ppd, NULL);
        check_near("flip", j.errors.flip[FV_ZONE_ALL], published[i].flip, published[i].flip_tolerance);
        check_near("ssim", j.errors.ssim[FV_ZONE_ALL], published[i].ssim, 1e-5);
        check_near("psnr", j.errors.psnr[FV_ZONE_ALL], published[i].psnr, 1e-4);
    }
}

/* FLIP's colour term of two greys: their difference in lightness only, so that no feature plays in. */
static double grey_flip(int a, int b)
{
    double value[2] = {a / 255.0, b / 255.0};
    for (int i = 0; i < 2; i++) {
        double l = value[i] <= 0.04045 ? value[i] / 12.92 : pow((value[i] + 0.055) / 1.055, 2.4);
        value[i] = l > 216.0 / 24389 ? 116 * cbrt(l) - 16 : l * 24389 / 27;
    }
    double most = 41.2760556, bend = 0.4 * most, c = pow(fabs(value[0] - value[1]), 0.7);
    return c < bend ? 0.95 * c / bend : 0.95 + 0.05 * (c - bend) / (most - bend);
}

static void constant_pictures(void **state)
{
    static const int greys[][2] = {{0, 255},   {255, 0}, {0, 0},   {255, 255},
                                   {128, 129}, {0, 1},   {10, 11}, {100, 200}};
    static const int sizes[][2] = {{1, 1}, {11, 1}, {3, 7}, {32, 19}};
    (void)state;
    for (unsigned g = 0; g < sizeof greys / sizeof greys[0]; g++)
        for (unsigned s = 0; s < sizeof sizes / sizeof sizes[0]; s++) {
            double a = greys[g][0], b = greys[g][1], c1 = 6.5025;
            judged_size(&j, sizes[s][0], sizes[s][1]);
            judged_fill(j.reference, j.width * j.height, greys[g][0], greys[g][0], greys[g][0]);
            judged_fill(j.test, j.width * j.height, greys[g][1], greys[g][1], greys[g][1]);
            judge(&j, 20, NULL);
            check_near("rmse", j.errors.rmse[FV_ZONE_ALL], fabs(a - b) / 255, 1e-12);
            if (greys[g][0] == greys[g][1]) assert_true(isinf(j.errors.psnr[FV_ZONE_ALL]));
            else check_near("psnr", j.errors.psnr[FV_ZONE_ALL], 20 * log10(255 / fabs(a - b)), 1e-9);
            check_near("ssim", j.errors.ssim[FV_ZONE_ALL], (2 * a * b + c1) / (a * a + b * b + c1), 1e-4);
            check_near("flip", j.errors.flip[FV_ZONE_ALL], grey_flip(greys[g][0], greys[g][1]), 1e-4);
        }
}

static void one_changed_pixel(void **state)
{
    static const int sizes[][2] = {{1, 1}, {5, 5}, {16, 16}, {31, 47}};
    (void)state;
    for (unsigned s = 0; s < sizeof sizes / sizeof sizes[0]; s++) {
        judged_noise(&j, sizes[s][0], sizes[s][1], s, 40, 0);
        int n = j.width * j.height, at = n / 2;
        judged_fill(j.reference + 3 * at, 1, 10, 20, 30);
        judged_fill(j.test + 3 * at, 1, 13, 16, 30);
        judge(&j, 12, NULL);
        double mse = 25.0 / (3 * n);
        check_near("psnr", j.errors.psnr[FV_ZONE_ALL], 10 * log10(255 * 255 / mse), 1e-9);
        check_near("rmse", j.errors.rmse[FV_ZONE_ALL], sqrt(mse) / 255, 1e-12);
        assert_true(j.errors.ssim[FV_ZONE_ALL] < 1 && j.errors.flip[FV_ZONE_ALL] > 0);
        /* It is seen nowhere beyond the reach of the widest filter: 3 sigma, at 12 ppd 2 pixels. */
        for (int i = 0; i < n; i++)
            if (abs(i % j.width - at % j.width) > 2 || abs(i / j.width - at / j.width) > 2)
                assert_true(j.flip[i] == 0);
    }
}

static void odd_sizes_and_every_ppd(void **state)
{
    static const int sizes[][2] = {{1, 1}, {11, 1}, {1, 11}, {10, 10}, {2, 300}, {33, 17}, {300, 1}};
    static const double ppds[] = {1, 1.5, 7, 67, 300, 1000, 0, -1, NAN, INFINITY};
    (void)state;
    for (unsigned s = 0; s < sizeof sizes / sizeof sizes[0]; s++)
        for (unsigned p = 0; p < sizeof ppds / sizeof ppds[0]; p++)
            for (int error = 0; error <= 255; error += 255) {
                judged_noise(&j, sizes[s][0], sizes[s][1], s + p, 60, error);
                judge(&j, ppds[p], NULL);
                const struct fv_errors *e = &j.errors;
                double flip = e->flip[FV_ZONE_ALL], ssim = e->ssim[FV_ZONE_ALL];
                assert_int_equal(e->pixels[FV_ZONE_ALL], j.width * j.height);
                if (error)
                    assert_true(flip > 0 && flip <= 1 && ssim > -1 && ssim < 1 &&
                                isfinite(e->psnr[FV_ZONE_ALL]));
                else
                    assert_true(flip == 0 && ssim == 1 && isinf(e->psnr[FV_ZONE_ALL]) &&
                                e->rmse[FV_ZONE_ALL] == 0);
            }
}

static void both_orders_are_equal(void **state)
{
    static struct judged k;
    (void)state;
    judged_noise(&j, 61, 43, 5, 90, 70);
    k = j;
    memcpy(k.reference, j.test, sizeof k.reference);
    memcpy(k.test, j.reference, sizeof k.test);
    judge(&j, 30, NULL);
    judge(&k, 30, NULL);
    check_near("psnr", k.errors.psnr[FV_ZONE_ALL], j.errors.psnr[FV_ZONE_ALL], 0);
    check_near("ssim", k.errors.ssim[FV_ZONE_ALL], j.errors.ssim[FV_ZONE_ALL], 1e-6);
    check_near("flip", k.errors.flip[FV_ZONE_ALL], j.errors.flip[FV_ZONE_ALL], 1e-6);
}

static void threads_change_no_bit(void **state)
{
    static struct judged alone, together;
    static struct fv_workers workers;
    (void)state;
    for (int count = 1; count <= 5; count++) {
        judged_noise(&alone, 61, 250, 9, 90, 70);
        fv_zones_of_picture(61, 250, 20, 30, 150, alone.zone);
        together = alone;
        fv_workers_start(&workers, count); /* denormals off here too, in both */
        judge(&alone, 12, NULL);
        judge(&together, 12, &workers);
        fv_workers_stop(&workers);
        assert_memory_equal(&alone.errors, &together.errors, sizeof alone.errors);
        assert_memory_equal(alone.flip, together.flip, sizeof alone.flip);
    }
}

static int zone_of(double degrees)
{
    int z = 0;
    while (z < FV_ZONE_FAR && degrees > fv_zones[z].upper_deg) z++;
    return z;
}

/* Against angles in long double; those within 1e-9 degrees of a border may be on either side. */
static void zones_of_pictures(void **state)
{
    static const struct {
        int width, height;
        double gaze_x, gaze_y, focal_px;
    } table[] = {{256, 256, 128, 128, 300}, {200, 100, 0.5, 0.5, 50}, {64, 64, -1000, 20, 30},
                 {64, 64, 1e6, -1e6, 10},   {100, 100, 50, 50, 0.01}, {100, 100, 50, 50, 1e7},
                 {1, 1, 0.5, 0.5, 1},       {1, 1, 0, 0, 3840}};
    long double degree = acosl(-1) / 180;
    (void)state;
    for (unsigned t = 0; t < sizeof table / sizeof table[0]; t++) {
        int w = table[t].width, h = table[t].height;
        long double f = table[t].focal_px, gx = table[t].gaze_x - w / 2.0L, gy = table[t].gaze_y - h / 2.0L;
        fv_zones_of_picture(w, h, table[t].gaze_x, table[t].gaze_y, table[t].focal_px, j.zone);
        for (int i = 0; i < w * h; i++) {
            long double x = i % w + 0.5L - w / 2.0L, y = i / w + 0.5L - h / 2.0L;
            long double cx = (y - gy) * f, cy = (gx - x) * f, cz = x * gy - y * gx;
            double e = (double)(atan2l(sqrtl(cx * cx + cy * cy + cz * cz), x * gx + y * gy + f * f) / degree);
            assert_in_range(j.zone[i], zone_of(e - 1e-9), zone_of(e + 1e-9));
        }
    }
}

static void zones_of_views(void **state)
{
    static const double gazes[][3] = {{0, 0, -1}, {0.3, -0.2, -0.9}, {0.9, 0.1, -0.1}};
    struct fv_lens lens = {2, 0.5, 1, 1.2, 200, 150};
    struct fv_pose pose = {{1, 2, 3}, {0.5, 0.5, -0.5, 0.5}};
    struct fv_view view;
    (void)state;
    for (unsigned g = 0; g < sizeof gazes / sizeof gazes[0]; g++) {
        fv_view_set(&view, &lens, &pose, gazes[g]);
        fv_zones_of_view(&view, j.zone);
        for (int i = 0; i < 200 * 150; i++) {
            double e = (double)fv_eccentricity_deg(&view, (float)(i % 200) + 0.5f, (float)(i / 200) + 0.5f);
            assert_in_range(j.zone[i], zone_of(e - 2e-3), zone_of(e + 2e-3));
        }
    }
}

/* Limits of one's own: those of the table are its zones; a pixel's number is that of the limits it lies beyond. */
static void zones_beyond_limits(void **state)
{
    static const double limits_deg[] = {7.5, 20}, tables_deg[] = {3.3, 5.5, 12.1, 30};
    static uint8_t own[80 * 60], tables[80 * 60], none[80 * 60];
    struct fv_lens lens = {0.9, 0.8, 0.7, 1, 80, 60};
    struct fv_pose pose = {{1, 2, 3}, {0.8, 0.6, 0, 0}};
    struct fv_view view;
    (void)state;
    fv_view_set(&view, &lens, &pose, (double[3]){0.2, -0.1, -1});
    fv_zones_beyond(&view, limits_deg, 2, own);
    fv_zones_beyond(&view, tables_deg, 4, tables);
    fv_zones_beyond(&view, limits_deg, 0, none);
    fv_zones_of_view(&view, j.zone);
    assert_memory_equal(tables, j.zone, sizeof tables);
    for (int i = 0; i < 80 * 60; i++) {
        double e = (double)fv_eccentricity_deg(&view, (float)(i % 80) + 0.5f, (float)(i / 80) + 0.5f);
        assert_int_equal(none[i], 0);
        if (fabs(e - 7.5) < 1e-3 || fabs(e - 20) < 1e-3) continue;
        assert_int_equal(own[i], (e > 7.5) + (e > 20));
    }
}

/* A zone's values are the means of its own pixels, and the picture's those of its zones. */
static void zones_are_shares_of_the_picture(void **state)
{
    (void)state;
    judged_noise(&j, 90, 70, 3, 80, 50);
    fv_zones_of_picture(90, 70, 30, 40, 100, j.zone);
    judge(&j, 20, NULL);
    double squared = 0, flip = 0;
    for (int z = 0; z < FV_ZONE_ALL; z++) {
        double sum = 0, flips = 0;
        int64_t n = 0;
        for (int i = 0; i < 90 * 70; i++) {
            if (j.zone[i] != z) continue;
            for (int k = 0; k < 3; k++) sum += pow((double)j.reference[3 * i + k] - j.test[3 * i + k], 2);
            flips += (double)j.flip[i];
            n++;
        }
        assert_int_equal(j.errors.pixels[z], n);
        squared += sum;
        flip += flips;
        if (n == 0) {
            assert_true(isnan(j.errors.psnr[z]) && isnan(j.errors.rmse[z]));
            assert_true(isnan(j.errors.ssim[z]) && isnan(j.errors.flip[z]));
            continue;
        }
        check_near("psnr", j.errors.psnr[z], 10 * log10(255.0 * 255 * 3 * (double)n / sum), 1e-9);
        check_near("rmse", j.errors.rmse[z], sqrt(sum / (3 * (double)n)) / 255, 1e-12);
        check_near("flip", j.errors.flip[z], flips / (double)n, 1e-12);
    }
    check_near("psnr", j.errors.psnr[FV_ZONE_ALL], 10 * log10(255.0 * 255 * 3 * 90 * 70 / squared), 1e-9);
    check_near("flip", j.errors.flip[FV_ZONE_ALL], flip / (90 * 70), 1e-12);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(published_values_are_met),
        cmocka_unit_test(constant_pictures),
        cmocka_unit_test(one_changed_pixel),
        cmocka_unit_test(odd_sizes_and_every_ppd),
        cmocka_unit_test(both_orders_are_equal),
        cmocka_unit_test(threads_change_no_bit),
        cmocka_unit_test(zones_of_pictures),
        cmocka_unit_test(zones_of_views),
        cmocka_unit_test(zones_beyond_limits),
        cmocka_unit_test(zones_are_shares_of_the_picture),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
