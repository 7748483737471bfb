/* atrous: light filtered over its neighbours: its format; the kernels against an oracle in double, over planes, spheres' normals,
 * holes and what no picture should hold; and what must hold exactly: flat pictures stay, nothing gets brighter than what is there,
 * one poisoned pixel stays one, rectangles and instruction sets change nothing. */
#include "platform/heap.h"
#include "rt/pass/atrous.h"
#include "rt/pass/kernels.h"
#include "tests/support/random.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include <stdio.h>

enum { WIDTH = 143, HEIGHT = 141, STRIDE = 160, PIXELS = STRIDE * HEIGHT, UNTOUCHED = 0x12345678 };

/* Just so large that reading or writing beyond it is found out by the sanitizer. */
static _Alignas(64) uint32_t light[PIXELS], facing[PIXELS], filtered[PIXELS], other[PIXELS];
static _Alignas(64) float inverse_depth[PIXELS], variance[PIXELS], filtered_variance[PIXELS], other_variance[PIXELS];
static struct fv_view view;

static struct fv_atrous whole_of(enum fv_atrous_taps taps, int step, int width, int height)
{
    return (struct fv_atrous){.taps = taps, .step = step, .columns = width, .rows = height, .width = width, .height = height, .stride = STRIDE,
                              .view = &view, .light = light, .inverse_depth = inverse_depth, .facing = facing, .filtered = filtered,
                              .sigma_light = 1, .sigma_normal = 0.3f, .sigma_position = 1};
}

static uint32_t facing_of(const double n[3])
{
    uint32_t word = 0;
    for (int i = 0; i < 3; i++) word |= (uint32_t)lround(511 * (n[i] + 1)) << 10 * i;
    return word;
}

/* Where planes lie before one another, seen by a turned head. */
static void make_planes(uint64_t *random, int width, int height)
{
    struct fv_lens lens = {1.1, 0.9, 1, 1.2, width, height};
    struct fv_pose pose = {.position_m = {3, 1, 2}};
    random_rotation(random, pose.rotation);
    fv_view_set(&view, &lens, &pose, (const double[3]){0, 0, -1});
    double n[3][3], d[3];
    for (int p = 0; p < 3; p++) random_direction(random, n[p]), d[p] = random_decade(random, 0.5, 20);
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            double nearest = 0;
            int shown = 0;
            for (int p = 0; p < 3; p++) {
                double towards = 0;
                for (int i = 0; i < 3; i++)
                    towards += n[p][i] * ((double)view.corner[i] + (x + 0.5) * (double)view.dx[i] + (y + 0.5) * (double)view.dy[i]);
                if (fabs(towards) / d[p] > nearest && (x * 3 / width + p) % 3) nearest = fabs(towards) / d[p], shown = p;
            }
            inverse_depth[y * STRIDE + x] = (float)nearest;
            facing[y * STRIDE + x] = facing_of(n[shown]);
        }
}

/* Noise, and of `ill` of 256 pixels things that should not be there. */
static void make_light(uint64_t *random, int width, int height, unsigned holes, unsigned ill)
{
    static const float depths[] = {NAN, INFINITY, -1, 0, 1e9f, 1e-9f};
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            int i = y * STRIDE + x;
            float rgb[3];
            for (int c = 0; c < 3; c++) rgb[c] = (float)random_decade(random, 0.02, 5);
            variance[i] = (float)random_decade(random, 1e-4, 4);
            if (random_bits(random) % 256 < ill) rgb[random_bits(random) % 3] = random_bits(random) % 2 ? 1e30f : NAN;
            light[i] = random_bits(random) % 256 < holes ? FV_LIGHT_NONE : fv_light_pack(rgb[0], rgb[1], rgb[2]);
            if (random_bits(random) % 256 < ill) inverse_depth[i] = depths[random_bits(random) % 6];
            if (random_bits(random) % 256 < ill) variance[i] = random_bits(random) % 2 ? NAN : -1;
            if (random_bits(random) % 256 < ill) facing[i] = (uint32_t)random_bits(random);
        }
}

/* What stands for exp(-e). */
static double falling(double e)
{
    double x = -e * 1.4426950408889634, low = floor(x);
    return x < -126 ? 0 : ldexp(1 + x - low, (int)low);
}

struct seen {
    bool surface, has;
    double light[3], luma, spread, variance, normal[3], ray[3], depth;
};

static struct seen seen_at(const struct fv_atrous *a, int x, int y)
{
    int i = y * STRIDE + x;
    struct seen s = {.surface = inverse_depth[i] > 0, .spread = 1};
    float rgb[3];
    fv_light_unpack(light[i], rgb);
    s.has = s.surface && light[i] != FV_LIGHT_NONE;
    for (int k = 0; k < 3; k++) {
        s.light[k] = s.has ? (double)rgb[k] : 0;
        s.normal[k] = ((double)(facing[i] >> 10 * k & 1023) - 511) / 511;
        s.ray[k] = (double)view.corner[k] + (x + 0.5) * (double)view.dx[k] + (y + 0.5) * (double)view.dy[k];
    }
    s.luma = (s.light[0] + 2 * s.light[1] + s.light[2]) / 4;
    s.depth = 1 / fmin(fmax((double)inverse_depth[i], 1e-6), 1e6);
    if (a->variance) {
        s.variance = variance[i] > 0 && s.has ? (double)variance[i] : 0;
        s.spread = 1 / sqrt(fmax(s.variance, 0x1p-20));
    }
    return s;
}

static double square_over(double d, float sigma)
{
    double s = (double)sigma;
    return isinf(s) || d == 0 ? 0 : s == 0 ? INFINITY : d * d / (s * s);
}

static double weight_of(const struct fv_atrous *a, const struct seen *p, const struct seen *q)
{
    double e = 0, plane = 0;
    if (p->has && q->has && a->taps != FV_ATROUS_FILL) e += square_over((p->luma - q->luma) * sqrt(p->spread * q->spread), a->sigma_light);
    for (int k = 0; k < 3; k++) {
        e += square_over(p->normal[k] - q->normal[k], a->sigma_normal);
        plane += (p->normal[k] + q->normal[k]) / 2 * (q->ray[k] * q->depth - p->ray[k] * p->depth);
    }
    e += square_over(plane / (p->depth * (double)view.pixel_size * a->step), a->sigma_position);
    return falling(e);
}

/* The mean at (x, y), and of variances; false where the pixel must stay as it is. `bound`: the greatest channel that weighs. */
static bool expected_at(const struct fv_atrous *a, int x, int y, double mean[3], double *spread, double *bound, double *total)
{
    static const double spline[5] = {1 / 16.0, 0.25, 0.375, 0.25, 1 / 16.0};
    struct seen p = seen_at(a, x, y);
    mean[0] = mean[1] = mean[2] = *spread = *bound = *total = 0;
    for (int v = -2; v <= 2; v++)
        for (int u = -2; u <= 2; u++) {
            int column = x + u * a->step, row = y + v * a->step;
            double w = 1;
            if (a->taps != FV_ATROUS_DOWN) w *= spline[u + 2];
            else if (u) continue;
            if (a->taps != FV_ATROUS_ACROSS) w *= spline[v + 2];
            else if (v) continue;
            if (column < 0 || row < 0 || column >= a->width || row >= a->height) continue;
            struct seen q = seen_at(a, column, row);
            bool after = v > 0 || (v == 0 && u > 0);
            if (!q.has) continue;
            if (u || v) w *= after ? weight_of(a, &p, &q) : weight_of(a, &q, &p);
            for (int k = 0; k < 3; k++) mean[k] += w * q.light[k], *bound = w > 0 ? fmax(*bound, q.light[k]) : *bound;
            *spread += w * w * q.variance;
            *total += w;
        }
    for (int k = 0; k < 3; k++) mean[k] /= *total;
    *spread /= *total * *total;
    double dx = x + 0.5 - (double)a->centre[0], dy = y + 0.5 - (double)a->centre[1];
    return p.surface && *total > 1e-20 && hypot(dx, dy) >= (double)a->from_px && !(a->taps == FV_ATROUS_FILL && p.has);
}

/* Counts pixels that were compared; those whose weights all but vanish are not. */
static int64_t compare(const struct fv_atrous *a, const char *what)
{
    int64_t compared = 0;
    for (int y = 0; y < a->height; y++)
        for (int x = 0; x < a->width; x++) {
            double mean[3], spread, bound, total;
            uint32_t got = filtered[y * STRIDE + x], own = light[y * STRIDE + x];
            float rgb[3];
            if (!expected_at(a, x, y, mean, &spread, &bound, &total)) {
                if (got != own && !(total > 1e-22 && total < 1e-18)) fail_msg("%s: %d, %d must stay %08x, is %08x", what, x, y, own, got);
                continue;
            }
            if (total < 1e-6) continue;
            fv_light_unpack(got, rgb);
            for (int k = 0; k < 3; k++)
                if (!(fabs((double)rgb[k] - mean[k]) <= 0.003 * fmax(fmax(mean[0], mean[1]), mean[2]) + 0.003 * bound + 1e-7))
                    fail_msg("%s: %d, %d channel %d is %g, must be %g (weights %g)", what, x, y, k, (double)rgb[k], mean[k], total);
            if (a->variance && !(fabs((double)a->filtered_variance[y * STRIDE + x] - spread) <= 0.01 * spread + 1e-9))
                fail_msg("%s: variance at %d, %d is %g, must be %g", what, x, y, (double)a->filtered_variance[y * STRIDE + x], spread);
            compared++;
        }
    return compared;
}

static void kernels_are_right(void **state)
{
    (void)state;
    static const int sizes[][2] = {{WIDTH, HEIGHT}, {37, 29}, {1, 1}, {3, 2}, {75, 1}, {1, 40}}, steps[] = {1, 2, 5, 16, 64};
    static const float sigmas[] = {1, 0.1f, INFINITY, NAN, 0, 1e-25f, 1e25f};
    uint64_t random = 5;
    int64_t compared = 0;
    for (int round = 0; round < 120; round++) {
        int width = sizes[round % 6][0], height = sizes[round % 6][1];
        char what[100];
        make_planes(&random, width, height);
        make_light(&random, width, height, round % 3 ? 0 : 120, round % 4 ? 0 : 8);
        struct fv_atrous a = whole_of((enum fv_atrous_taps)(random_bits(&random) % 4), steps[random_bits(&random) % 5], width, height);
        if (round > 30) a.sigma_light = sigmas[random_bits(&random) % 7], a.sigma_normal = sigmas[random_bits(&random) % 7];
        if (round > 60) a.sigma_position = sigmas[random_bits(&random) % 4];
        if (isnan(a.sigma_light)) a.sigma_light = INFINITY;
        if (random_bits(&random) % 3 == 0) a.from_px = 0.3f * (float)width, a.centre[0] = 0.6f * (float)width, a.centre[1] = 0.2f * (float)height;
        if (random_bits(&random) % 3 == 0) a.variance = variance, a.filtered_variance = filtered_variance;
        for (int isa = 0; isa <= (int)fv_cpu_isa(); isa++) {
            snprintf(what, sizeof what, "round %d isa %d taps %d step %d", round, isa, (int)a.taps, a.step);
            struct fv_atrous oracle = a;
            memset(filtered, 0, sizeof filtered);
            fv_kernels((enum fv_isa)isa)->atrous(&a);
            if (isnan(oracle.sigma_normal)) oracle.sigma_normal = INFINITY;
            if (isnan(oracle.sigma_position)) oracle.sigma_position = INFINITY;
            compared += compare(&oracle, what);
        }
    }
    print_message("%lld pixels compared\n", (long long)compared);
    assert_true(compared > 100000);
}

/* Instruction sets agree to a step of the format; rectangles to the bit; nothing beyond them is written. */
static void rectangles_and_instructions(void **state)
{
    (void)state;
    uint64_t random = 9;
    for (int round = 0; round < 48; round++) {
        make_planes(&random, WIDTH, HEIGHT);
        make_light(&random, WIDTH, HEIGHT, round % 2 ? 0 : 60, round % 3 ? 0 : 8);
        struct fv_atrous a = whole_of((enum fv_atrous_taps)(round % 4), 1 << random_bits(&random) % 7, WIDTH, HEIGHT);
        if (round % 5 == 0) a.variance = variance, a.filtered_variance = filtered_variance;
        for (int isa = (int)fv_cpu_isa(); isa >= 0; isa--) {
            const struct fv_kernels *k = fv_kernels((enum fv_isa)isa);
            struct fv_atrous part = a;
            k->atrous(&a);
            part.filtered = other, part.filtered_variance = a.variance ? other_variance : NULL;
            for (int i = 0; i < PIXELS; i++) other[i] = UNTOUCHED;
            part.x = (int)(random_bits(&random) % 100), part.y = (int)(random_bits(&random) % 100);
            part.columns = 1 + (int)(random_bits(&random) % (unsigned)(WIDTH - part.x)), part.rows = 1 + (int)(random_bits(&random) % (unsigned)(HEIGHT - part.y));
            k->atrous(&part);
            for (int y = 0; y < HEIGHT; y++)
                for (int x = 0; x < STRIDE; x++) {
                    bool in = x >= part.x && y >= part.y && x < part.x + part.columns && y < part.y + part.rows;
                    assert_int_equal(other[y * STRIDE + x], in ? filtered[y * STRIDE + x] : UNTOUCHED);
                }
            memcpy(other, filtered, sizeof other);
            if (isa == 0) continue;
            a.filtered = other;
            fv_kernels(FV_ISA_BASE)->atrous(&a);
            a.filtered = filtered;
            k->atrous(&a);
            for (int i = 0; i < PIXELS; i++) {
                float one[3], two[3];
                if (i % STRIDE >= WIDTH) continue;
                fv_light_unpack(filtered[i], one), fv_light_unpack(other[i], two);
                float most = fmaxf(fmaxf(one[0], one[1]), one[2]);
                for (int c = 0; c < 3; c++) assert_true(fabsf(one[c] - two[c]) <= most / 200);
            }
        }
    }
}

static void format(void **state)
{
    (void)state;
    static _Alignas(64) float rgb[4][1024];
    static _Alignas(64) uint32_t packed[1024];
    static const float odd[] = {0, -0.0f, -1, NAN, INFINITY, -INFINITY, 1e30f, FV_LIGHT_MAX, 65407, 1e-40f, 0x1p-24f, 0x1p-25f, 511.49f, 511.5f, 0.99899f, 0.99903f};
    uint64_t random = 1;
    for (int round = 0; round < 200; round++) {
        for (int i = 0; i < 1024; i++)
            for (int c = 0; c < 3; c++) rgb[c][i] = random_bits(&random) % 8 ? (float)random_decade(&random, 1e-9, 1e6) : odd[random_bits(&random) % 16];
        for (int isa = 0; isa <= (int)fv_cpu_isa(); isa++) {
            const struct fv_kernels *k = fv_kernels((enum fv_isa)isa);
            k->pack_light(rgb[0], rgb[1], rgb[2], 1, packed, 1024);
            for (int i = 0; i < 1024; i++) {
                float back[3], most = 0;
                uint32_t word = fv_light_pack(rgb[0][i], rgb[1][i], rgb[2][i]);
                assert_int_equal(packed[i], word);
                assert_true(word != FV_LIGHT_NONE);
                fv_light_unpack(word, back);
                assert_int_equal(fv_light_pack(back[0], back[1], back[2]), word);
                for (int c = 0; c < 3; c++) most = fmaxf(most, fv_light_channel(rgb[c][i]));
                for (int c = 0; c < 3; c++) assert_true(fabsf(back[c] - fv_light_channel(rgb[c][i])) <= most / 511 + 0x1p-25f);
            }
            packed[5] = FV_LIGHT_NONE;
            k->unpack_light(packed, rgb[3], filtered_variance, other_variance, 1024);
            for (int i = 0; i < 1024; i++) {
                float back[3];
                fv_light_unpack(packed[i], back);
                assert_true(rgb[3][i] == back[0] && filtered_variance[i] == back[1] && other_variance[i] == back[2]);
            }
        }
    }
}

/* Weights against exp: of two pixels, the left one dark, what reaches it of the other tells them. */
static void weights_against_exp(void **state)
{
    (void)state;
    uint64_t random = 2;
    make_planes(&random, 2, 1);
    inverse_depth[0] = inverse_depth[1] = 0.5f;
    facing[0] = facing[1] = facing_of((const double[3]){0, 0, 1});
    light[0] = fv_light_pack(0, 0, 0), light[1] = fv_light_pack(510, 510, 510);
    double most = 0, least = 2;
    for (double e = 0; e < 5; e += 0.01) {
        float rgb[3];
        struct fv_atrous a = whole_of(FV_ATROUS_ACROSS, 1, 2, 1);
        a.sigma_light = e > 0 ? (float)(510 / sqrt(e)) : INFINITY, a.sigma_position = INFINITY;
        fv_kernels(fv_cpu_isa())->atrous(&a);
        fv_light_unpack(filtered[0], rgb);
        double got = 1.5 * (double)rgb[0] / (510 - (double)rgb[0]) / exp(-e);
        most = fmax(most, got), least = fmin(least, got);
    }
    print_message("weights over exp: %.4f to %.4f\n", least, most);
    assert_true(least > 0.995 && most < 1.067 && most > 1.055);
}

/* Flat light stays to the bit, holes take it, and what has no light at all gets none. */
static void flat_and_empty(void **state)
{
    (void)state;
    uint64_t random = 3;
    for (int round = 0; round < 32; round++) {
        uint32_t flat = fv_light_pack((float)random_decade(&random, 1e-6, 6e4), (float)random_decade(&random, 1e-6, 6e4), (float)random_decade(&random, 1e-6, 6e4));
        make_planes(&random, WIDTH, HEIGHT);
        make_light(&random, WIDTH, HEIGHT, 80, 4);
        for (int i = 0; i < PIXELS; i++) light[i] = light[i] == FV_LIGHT_NONE || round % 8 == 7 ? FV_LIGHT_NONE : flat;
        struct fv_atrous a = whole_of((enum fv_atrous_taps)(round % 4), 1 << random_bits(&random) % 7, WIDTH, HEIGHT);
        int64_t filled = 0;
        for (int isa = 0; isa <= (int)fv_cpu_isa(); isa++) {
            fv_kernels((enum fv_isa)isa)->atrous(&a);
            for (int i = 0; i < PIXELS; i++) {
                if (i % STRIDE >= WIDTH) continue;
                if (filtered[i] != FV_LIGHT_NONE) assert_int_equal(filtered[i], flat);
                if (light[i] != FV_LIGHT_NONE) assert_int_equal(filtered[i], light[i]);
                filled += light[i] == FV_LIGHT_NONE && filtered[i] == flat;
            }
        }
        if (round % 8 == 7) assert_int_equal(filled, 0);
        else assert_true(filled > 1000);
    }
}

/* Many iterations of whatever there is, fireflies included, never pass what was brightest; with sigmas of 0 nothing changes. */
static void energy_and_underflow(void **state)
{
    (void)state;
    uint64_t random = 4;
    for (int round = 0; round < 12; round++) {
        float most[3] = {0, 0, 0}, rgb[3];
        make_planes(&random, WIDTH, HEIGHT);
        make_light(&random, WIDTH, HEIGHT, 40, round % 2 ? 6 : 0);
        for (int i = 0; i < PIXELS; i++) {
            fv_light_unpack(light[i], rgb);
            if (i % STRIDE < WIDTH)
                for (int c = 0; c < 3; c++) most[c] = fmaxf(most[c], rgb[c]);
        }
        struct fv_atrous a = whole_of(FV_ATROUS_FULL, 1, WIDTH, HEIGHT);
        a.sigma_light = a.sigma_normal = a.sigma_position = 0;
        fv_kernels(fv_cpu_isa())->atrous(&a);
        int changed = 0; /* where lumas are equal */
        for (int i = 0; i < PIXELS; i++) changed += i % STRIDE < WIDTH && light[i] != FV_LIGHT_NONE && light[i] != filtered[i];
        assert_true(changed < WIDTH * HEIGHT / 100);
        for (int n = 0; n < 10; n++) {
            a = whole_of((enum fv_atrous_taps)(n == 0 ? FV_ATROUS_FILL : n % 3), 1 << (9 - n) % 7, WIDTH, HEIGHT);
            a.sigma_light = 100;
            fv_kernels(fv_cpu_isa())->atrous(&a);
            memcpy(light, filtered, sizeof light);
        }
        float brightest = fmaxf(fmaxf(most[0], most[1]), most[2]);
        for (int i = 0; i < PIXELS; i++) {
            fv_light_unpack(light[i], rgb);
            if (i % STRIDE < WIDTH)
                for (int c = 0; c < 3; c++) assert_true(rgb[c] >= 0 && rgb[c] <= most[c] + brightest * 10 / 512);
        }
    }
}

/* Of noise over three planes that are lit differently: what is left after steps 16 to 1, where a plane stays in view. */
static double left_of_noise(bool apart, uint64_t *random, double *before)
{
    static double truth[PIXELS];
    double sum[2] = {0, 0};
    for (int i = 0; i < PIXELS; i++) {
        truth[i] = 0.3 + 0.4 * (double)(facing[i] % 7);
        float l = (float)(truth[i] * random_between(random, 0.2, 1.8));
        light[i] = fv_light_pack(l, l, l);
    }
    for (int n = 0; n < 5; n++)
        for (int pass = 0; pass < (apart ? 2 : 1); pass++) {
            struct fv_atrous a = whole_of(!apart ? FV_ATROUS_FULL : pass ? FV_ATROUS_DOWN : FV_ATROUS_ACROSS, 16 >> n, WIDTH, HEIGHT);
            a.sigma_light = 4;
            for (int i = 0; i < PIXELS && n == 0 && pass == 0; i++) {
                float rgb[3];
                fv_light_unpack(light[i], rgb);
                if (i % STRIDE < WIDTH) sum[0] += pow((double)rgb[0] - truth[i], 2);
            }
            fv_kernels(fv_cpu_isa())->atrous(&a);
            memcpy(light, filtered, sizeof light);
        }
    for (int i = 0; i < PIXELS; i++) {
        float rgb[3];
        fv_light_unpack(light[i], rgb);
        if (i % STRIDE < WIDTH) sum[1] += pow((double)rgb[0] - truth[i], 2);
    }
    *before = sqrt(sum[0] / (WIDTH * HEIGHT));
    return sqrt(sum[1] / (WIDTH * HEIGHT));
}

/* The two passes are about as good as the 25 pixels: within a fifth. */
static void noise_falls(void **state)
{
    (void)state;
    uint64_t random = 11;
    for (int round = 0; round < 4; round++) {
        double before, other_before;
        make_planes(&random, WIDTH, HEIGHT);
        uint64_t same = random;
        double full = left_of_noise(false, &random, &before), apart = left_of_noise(true, &same, &other_before);
        print_message("noise of %.3f: %.4f by 25 pixels, %.4f by two passes\n", before, full, apart);
        assert_true(before == other_before && full < 0.15 * before && apart < 1.2 * full);
    }
}

/* A pixel on another surface than all around it: alone, it keeps its light, or has none. */
static void lonely(void **state)
{
    (void)state;
    uint64_t random = 6;
    for (int taps = 0; taps < 4; taps++)
        for (int with = 0; with < 2; with++) {
            make_planes(&random, 64, 64);
            for (int i = 0; i < 64 * STRIDE; i++) inverse_depth[i] = 0.2f, facing[i] = facing_of((const double[3]){1, 0, 0}), light[i] = fv_light_pack(1, 2, 3);
            int at = 30 * STRIDE + 31;
            facing[at] = facing_of((const double[3]){-1, 0, 0});
            light[at] = with ? fv_light_pack(9, 8, 7) : FV_LIGHT_NONE;
            struct fv_atrous a = whole_of((enum fv_atrous_taps)taps, 2, 64, 64);
            a.sigma_normal = 0.05f;
            fv_kernels(fv_cpu_isa())->atrous(&a);
            assert_int_equal(filtered[at], light[at]);
            for (int y = 0; y < 64; y++)
                for (int x = 0; x < 64; x++)
                    if (y * STRIDE + x != at) assert_int_equal(filtered[y * STRIDE + x], fv_light_pack(1, 2, 3));
        }
}

/* Whatever one pixel's depth, normal, light or variance is, others are as if it were not there, or bounded by what it says. */
static void one_poisoned_pixel(void **state)
{
    (void)state;
    static const float ill[] = {NAN, -INFINITY, -3, 0};
    uint64_t random = 8;
    for (int round = 0; round < 16; round++) {
        make_planes(&random, WIDTH, HEIGHT);
        make_light(&random, WIDTH, HEIGHT, 0, 0);
        int at = 70 * STRIDE + 60 + round;
        struct fv_atrous a = whole_of((enum fv_atrous_taps)(round % 4), 1, WIDTH, HEIGHT);
        a.variance = variance, a.filtered_variance = filtered_variance;
        inverse_depth[at] = 0;
        light[at] = FV_LIGHT_NONE;
        fv_kernels(fv_cpu_isa())->atrous(&a);
        memcpy(other, filtered, sizeof other);
        inverse_depth[at] = ill[round / 4];
        light[at] = fv_light_pack(1e30f, NAN, 1e30f);
        facing[at] = ~0u;
        variance[at] = round % 2 ? NAN : INFINITY;
        fv_kernels(fv_cpu_isa())->atrous(&a);
        for (int i = 0; i < PIXELS; i++) {
            if (i % STRIDE >= WIDTH) continue;
            assert_true(isfinite(filtered_variance[i]) && filtered_variance[i] >= 0);
            assert_int_equal(filtered[i], i == at ? light[at] : other[i]);
        }
    }
}

static int no_heap(void **state)
{
    (void)state;
    return fv_heap_calls() != 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(format), cmocka_unit_test(kernels_are_right), cmocka_unit_test(rectangles_and_instructions),
                                       cmocka_unit_test(weights_against_exp), cmocka_unit_test(flat_and_empty), cmocka_unit_test(energy_and_underflow),
                                       cmocka_unit_test(noise_falls), cmocka_unit_test(lonely), cmocka_unit_test(one_poisoned_pixel)};
    return cmocka_run_group_tests(tests, NULL, no_heap);
}
