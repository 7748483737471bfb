/* lens: radial distortion against long double: display to direction and back, however strong, up to where tangents no
 * longer grow and beyond; its tangents, and maps between frames by them; the pixels that show something; red and blue
 * beside green. */
#include "rt/fovea/foveal.h"
#include "rt/pass/fringe.h"
#include "rt/pass/kernels.h"
#include "rt/pass/unseen.h"
#include "tests/support/program.h"
#include "tests/support/random.h"

#include <math.h>
#include <stdlib.h>

enum { SIZE = 256 };

static const struct fv_lens_settings lenses[] = {
    {.centre_px = {475.3, 540}, .unit_px = 552.346, .k = {0.2485, -0.0768, 0.2194}, .visible_deg = 54, .channel = {{0.98766, -0.01666}, {1.02059, 0.01666}}, .width = 960, .height = 1080},
    {.centre_px = {368.6, 400}, .unit_px = 350.4, .k = {0.2638, 0.3451, 0}, .visible_deg = 88, .channel = {{0.996, -0.0048}, {1.014, 0}}, .width = 640, .height = 800},
    {.centre_px = {320, 400}, .unit_px = 400, .k = {-0.2, 0, 0}, .visible_deg = 88, .channel = {{1, 0}, {1, 0}}, .width = 640, .height = 800},
    {.centre_px = {0, 0}, .unit_px = 300, .k = {-0.4, 0.3, -0.2}, .visible_deg = 88, .channel = {{0.5, 0.3}, {2, -1}}, .width = 500, .height = 400},
    {.centre_px = {500, 17}, .unit_px = 90, .k = {16, -16, 16}, .visible_deg = 88, .channel = {{1.1, 0}, {0.9, 0}}, .width = 500, .height = 400},
    {.centre_px = {250, 200}, .unit_px = 1, .k = {-16, -16, -16}, .visible_deg = 1, .channel = {{1, -2}, {2, 2}}, .width = 500, .height = 400},
    {.centre_px = {250, 200}, .unit_px = 16384, .k = {0, 0, 0}, .visible_deg = 88, .channel = {{1, 0}, {1, 0}}, .width = 500, .height = 400},
    {.centre_px = {4000, 4100}, .unit_px = 3000, .k = {0, 0, 0.7}, .visible_deg = 60, .channel = {{1, 0}, {1.01, 0}}, .width = 8192, .height = 8192},
};
enum { LENSES = sizeof lenses / sizeof lenses[0] };

static long double scale_at(const struct fv_bend *b, long double q)
{
    return 1 + q * (b->k[0] + q * (b->k[1] + q * (long double)b->k[2]));
}

/* As lens.h says it. */
static void straight(const struct fv_bend *b, long double x, long double y, long double to[2])
{
    long double d[2] = {x - b->centre[0], y - b->centre[1]}, u = d[0] * b->step[0], v = d[1] * b->step[1];
    long double most = b->most, q = fminl(u * u + v * v, most * most), scale = scale_at(b, q);
    for (int i = 0; i < 2; i++) to[i] = b->centre[i] + d[i] * scale;
}

static void place(uint64_t *random, const struct fv_lens_settings *s, int n, double at[2])
{
    at[0] = random_between(random, 0, s->width), at[1] = random_between(random, 0, s->height);
    if (n == 0) at[0] = s->centre_px[0], at[1] = s->centre_px[1];
    if (n % 8 == 1) at[0] = s->centre_px[0] + random_between(random, -1e-3, 1e-3), at[1] = s->centre_px[1];
    if (n % 8 == 2) at[0] *= 4, at[1] *= -3;
}

static void there_and_back(void **state)
{
    (void)state;
    uint64_t random = 1;
    double worst = 0, worst_back = 0;
    for (int k = 0; k < LENSES; k++) {
        struct fv_bend b;
        fv_bend_set(&b, &lenses[k]);
        double size = lenses[k].width + lenses[k].height;
        for (int n = 0; n < 20000; n++) {
            double at[2], back[2];
            long double exact[2];
            float to[2];
            place(&random, &lenses[k], n, at);
            at[0] = (float)at[0], at[1] = (float)at[1];
            straight(&b, at[0], at[1], exact);
            fv_bend_straight(&b, (float)at[0], (float)at[1], to);
            double from[2] = {(double)exact[0], (double)exact[1]}, wide = fmax(size, fmax(fabs(from[0]), fabs(from[1])));
            fv_bend_bent(&b, from, back);
            for (int i = 0; i < 2; i++) {
                double off = fabs((double)(to[i] - exact[i])) / wide, off_back = fabs(back[i] - at[i]) / (4 * size);
                worst = fmax(worst, off), worst_back = fmax(worst_back, off_back);
                if (!(off < 2e-6)) fail_msg("lens %d, pixel %g %g: off by %g of the picture", k, at[0], at[1], off);
                if (!(off_back < 1e-12)) fail_msg("lens %d, pixel %g %g: %g %g, back off by %g", k, at[0], at[1], back[0], back[1], off_back);
            }
        }
    }
    print_message("display to pinhole: off by %.1e of the picture; and back: %.1e\n", worst, worst_back);
}

/* Up to `most`, tangents grow as fast as is asked for; where they stop growing within the picture, `most` is there. */
static void as_far_as_it_grows(void **state)
{
    (void)state;
    for (int k = 0; k < LENSES; k++) {
        struct fv_bend b;
        fv_bend_set(&b, &lenses[k]);
        assert_true(b.most > 0 && b.shown > 0 && b.shown <= b.most && b.least > 0 && b.widest >= 1);
        long double before = 0, most = b.most, shown = b.shown;
        for (int i = 1; i <= 10000; i++) {
            long double r = most * i / 10000, t = r * scale_at(&b, r * r);
            assert_true(t - before > most / 10000 * (long double)FV_LENS_SLOPE * 0.999L);
            before = t;
        }
        assert_true(before <= (long double)FV_LENS_TANGENT_MAX * 1.0001L);
        long double seen = atanl(shown * scale_at(&b, shown * shown)) * 180 / (long double)M_PI;
        assert_true(seen <= lenses[k].visible_deg + 1e-4);
    }
    struct fv_bend b;
    fv_bend_set(&b, &lenses[2]); /* 1 - 0.6 r^2 is FV_LENS_SLOPE */
    assert_true(fabs((double)b.shown - sqrt((1 - FV_LENS_SLOPE) / 0.6)) < 1e-6 && b.masks);
    fv_bend_set(&b, &lenses[0]); /* tan 54 degrees */
    assert_true(fabs((double)(b.shown * scale_at(&b, (long double)b.shown * b.shown)) - tan(54 * M_PI / 180)) < 1e-6);
    fv_bend_set(&b, &lenses[6]);
    assert_true(!b.masks && !b.fringes);
}

/* Rows of pixels that show something are those within the circle; and no block that holds one counts as beyond. */
static void seen_pixels(void **state)
{
    (void)state;
    for (int k = 0; k < LENSES - 1; k++) {
        struct fv_bend b;
        const struct fv_lens_settings *s = &lenses[k];
        int64_t seen = 0, shown = 0, traced = 0;
        fv_bend_set(&b, s);
        for (int y = 0; y < s->height; y++) {
            int from, to;
            fv_bend_row(&b, y, s->width, &from, &to);
            assert_true(from >= 0 && from <= to && to <= s->width);
            shown += to - from;
            for (int x = 0; x < s->width; x++) {
                double u = (x + 0.5 - (double)b.centre[0]) * (double)b.step[0], v = (y + 0.5 - (double)b.centre[1]) * (double)b.step[1];
                double off = hypot(u, v) - (double)b.shown;
                bool in = x >= from && x < to;
                seen += off <= 0;
                if (in != (off <= 0) && fabs(off) > 1e-6 * (double)b.shown) fail_msg("lens %d, pixel %d %d", k, x, y);
            }
        }
        for (int y = 0; y < s->height; y += 4)
            for (int x = 0; x < s->width; x += 4) {
                bool beyond = fv_bend_beyond(&b, (float)x, (float)y, (float)(x + 4), (float)(y + 4), 1), any = false;
                for (int i = 0; i < 16; i++) any |= fv_bend_square(&b, (float)(x + i % 4) + 0.5f, (float)(y + i / 4) + 0.5f) <= b.most * b.most;
                if (any && beyond) fail_msg("lens %d: block %d %d is not traced", k, x, y);
                traced += beyond ? 0 : 16;
            }
        print_message("lens %d: %.1f %% seen, %.1f %% traced\n", k, 100.0 * (double)seen / s->width / s->height, 100.0 * (double)traced / s->width / s->height);
        assert_true(traced >= shown);
    }
}

static struct fv_view view_of(int k, const struct fv_pose *pose, struct fv_bend *b)
{
    const struct fv_lens_settings *s = &lenses[k];
    const double ahead[3] = {0, 0, -1};
    struct fv_lens lens = {s->centre_px[0] / s->unit_px, (s->width - s->centre_px[0]) / s->unit_px, s->centre_px[1] / s->unit_px,
                           (s->height - s->centre_px[1]) / s->unit_px, s->width, s->height};
    struct fv_view view;
    fv_bend_set(b, s);
    fv_view_set_bent(&view, &lens, b, pose, ahead);
    return view;
}

/* The angle between neighbouring pixels' directions is nowhere more than pixel_deg; a gaze is found at its pixel. */
static void angles(void **state)
{
    (void)state;
    const struct fv_pose still = {{0, 0, 0}, {1, 0, 0, 0}};
    uint64_t random = 3;
    for (int k = 0; k < LENSES; k++) {
        struct fv_bend b;
        struct fv_view view = view_of(k, &still, &b), gazing;
        for (int n = 0; n < 3000; n++) {
            double at[2], gaze[3];
            float d[3];
            place(&random, &lenses[k], n & ~3, at);
            if (fv_bend_square(&b, (float)at[0], (float)at[1]) > 0.98f * b.most * b.most) continue;
            fv_view_direction(&view, (float)at[0], (float)at[1], d);
            for (int i = 0; i < 3; i++) gaze[i] = (double)d[i];
            fv_view_set_bent(&gazing, &view.lens, &b, &still, gaze);
            double off = hypot((double)gazing.gaze_px[0] - at[0], (double)gazing.gaze_px[1] - at[1]);
            if (!(off < 2e-3 / (double)b.least)) fail_msg("lens %d, pixel %g %g: gaze at %g %g", k, at[0], at[1], (double)gazing.gaze_px[0], (double)gazing.gaze_px[1]);
            for (int i = 0; i < 2; i++) {
                float e = fv_eccentricity_deg(&gazing, (float)at[0] + (i ? 0 : 1), (float)at[1] + (i ? 1 : 0));
                if (!(e <= view.pixel_deg * 1.01f + 1e-3f)) fail_msg("lens %d, pixel %g %g: %g degrees to the next one, pixel_deg %g", k, at[0], at[1], (double)e, (double)view.pixel_deg);
            }
        }
    }
}

/* Where a pixel of the first view, at inverse depth w, is in the second. */
static bool exactly(const struct fv_map *map, const struct fv_bend *b, double x, double y, double w, double to[2])
{
    long double from[2], out[3];
    straight(b, x, y, from);
    for (int i = 0; i < 3; i++) out[i] = map->m[i][0] * from[0] + map->m[i][1] * from[1] + map->m[i][2] + map->t[i] * (long double)w;
    if (!(out[2] > 0.1L)) return false;
    double pinhole[2] = {(double)(out[0] / out[2]), (double)(out[1] / out[2])};
    fv_bend_bent(b, pinhole, to);
    return true;
}

/* Maps by tangents, over a tile of 32 pixels, of a head that turns at 150 degrees a second and walks, at 75 Hz. */
static void maps(void **state)
{
    (void)state;
    static const struct {
        double yaw_deg, walk_m, limit_px;
    } motions[] = {{0, 0, 2e-3}, {0.05, 0, 0.02}, {2, 0, 0.25}, {0, 0.02, 0.25}};
    const struct fv_pose still = {{0, 0, 0}, {1, 0, 0, 0}};
    uint64_t random = 7;
    for (int k = 0; k < 2; k++)
        for (int m = 0; m < 4; m++) {
            struct fv_pose moved = {{motions[m].walk_m, 0, 0}, {1, 0, 0, 0}};
            struct fv_bend b;
            struct fv_view now = view_of(k, &still, &b), before;
            struct fv_map map;
            double worst = 0;
            fv_quat_from_yaw_pitch_roll(motions[m].yaw_deg * M_PI / 180, 0.4 * motions[m].yaw_deg * M_PI / 180, 0, moved.rotation);
            before = view_of(k, &moved, &b);
            fv_map_set(&map, &now, &before);
            for (int n = 0; n < 3000; n++) {
                struct fv_map bent = map;
                double at[2], to[2], w = random_between(&random, 0, 0.7);
                float found[3];
                place(&random, &lenses[k], 3, at);
                fv_map_bend(&bent, &b, &b, (float)at[0], (float)at[1], (float)w);
                at[0] += random_between(&random, -16, 16), at[1] += random_between(&random, -16, 16);
                if (fv_bend_square(&b, (float)at[0], (float)at[1]) > 0.9f * b.shown * b.shown) continue;
                if (!exactly(&map, &b, at[0], at[1], w, to)) continue;
                if (fv_bend_square(&b, (float)to[0], (float)to[1]) > 0.9f * b.shown * b.shown) continue;
                fv_map_point(&bent, (float)at[0], (float)at[1], (float)w, found);
                worst = fmax(worst, hypot((double)(found[0] / found[2]) - to[0], (double)(found[1] / found[2]) - to[1]));
            }
            print_message("lens %d, head by %g degrees and %g m: maps by tangents off by %.4f px\n", k, motions[m].yaw_deg, motions[m].walk_m, worst);
            assert_true(worst < motions[m].limit_px);
        }
    /* What was behind the eye stays there. */
    struct fv_bend b;
    struct fv_map behind = {.m = {{1, 0, 0}, {0, 1, 0}, {0, 0, -1}}}, as_it_was = behind;
    fv_bend_set(&b, &lenses[0]);
    fv_map_bend(&behind, &b, &b, 100, 100, 0);
    assert_memory_equal(&behind, &as_it_was, sizeof behind);
}

/* Red and blue on a ramp, which bilinear lookups show nearly as it is (by squares, least so where it is dark); green untouched. Every instruction set. */
static void fringes(void **state)
{
    (void)state;
    uint32_t *green = malloc((SIZE * SIZE + 64) * sizeof *green);
    static struct fv_fringe table;
    for (int k = 0; k < 2; k++) {
        struct fv_lens_settings s = lenses[k];
        struct fv_bend b;
        s.centre_px[0] = 120.3, s.centre_px[1] = 131.7, s.unit_px = 150, s.width = s.height = SIZE;
        fv_bend_set(&b, &s);
        fv_fringe_set(&table, &b);
        for (int i = 0; i < SIZE * SIZE; i++) green[i] = 0xff000000u | (uint32_t)(i / SIZE) << 16 | (uint32_t)(i * 7 % 256) << 8 | (uint32_t)(i % SIZE);
        for (int isa = 0; isa <= (int)fv_cpu_isa(); isa++)
            for (int y = 0; y < SIZE; y++) {
                _Alignas(64) uint32_t row[SIZE];
                struct fv_fringe_row r = {.bend = &b, .table = &table, .green = green, .to = row, .stride = SIZE, .width = SIZE, .height = SIZE, .y = y, .count = SIZE};
                fv_kernels((enum fv_isa)isa)->fringe(&r);
                for (int x = 0; x < SIZE; x++) {
                    double u = (x + 0.5 - (double)b.centre[0]) * (double)b.step[0], v = (y + 0.5 - (double)b.centre[1]) * (double)b.step[1], square = u * u + v * v;
                    if (square > (double)b.shown * (double)b.shown) continue;
                    assert_int_equal(row[x] >> 8 & 255, green[y * SIZE + x] >> 8 & 255);
                    for (int c = 0; c < 2; c++) {
                        long double pinhole[2], factor = s.channel[c].c0 + s.channel[c].c1 * (long double)square;
                        straight(&b, x + 0.5L, y + 0.5L, pinhole);
                        double from[2], to[2];
                        for (int i = 0; i < 2; i++) from[i] = (double)(b.centre[i] + (pinhole[i] - b.centre[i]) * factor);
                        fv_bend_bent(&b, from, to);
                        double expected = fmax(0, fmin(SIZE - 1, (c ? to[1] : to[0]) - 0.5)), got = (double)(row[x] >> 16 * c & 255);
                        if (!(fabs(got - expected) < (expected > 4 ? 0.54 : 0.8))) fail_msg("lens %d, channel %d, pixel %d %d: %g, not %g", k, c, x, y, got, expected);
                    }
                }
            }
    }
    free(green);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(there_and_back), cmocka_unit_test(as_far_as_it_grows),
                                       cmocka_unit_test(seen_pixels),    cmocka_unit_test(angles),
                                       cmocka_unit_test(maps),           cmocka_unit_test(fringes)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
