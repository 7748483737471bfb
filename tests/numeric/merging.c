/* merging: what the merge kernel makes of new samples and history against a plain statement of it in double
 * precision (Weier et al. 2016, section 3.4), the bounds of inverse depths that it is given, and the rows of half
 * and double density, against plain code. Every instruction set that this machine has. */
#include "rt/pass/cache.h"
#include "rt/pass/merge.h"
#include "tests/support/program.h"
#include "tests/support/random.h"

#include <math.h>

enum { COUNT = 512, SEEDS = 1000 };

#define FOR_EACH_ISA for (int isa = 0; isa <= (int)fv_cpu_isa(); isa++)

static uint64_t seed = 1;

/* The encoding (trace/pixel.h) of linear light, and its inverse by bisection. */
static double encode(double x)
{
    double y = x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14);
    y = fmin(y, 1);
    if (y < 0.0031308) return 12.92 * y;
    return fmin(0.662002687 * sqrt(y) + 0.68412206 * sqrt(sqrt(y)) - 0.323583601 * sqrt(sqrt(sqrt(y))) - 0.022541147 * y, 1);
}

static double decode(double e)
{
    double low = 0, high = 7.2416; /* which y = 1 is for */
    for (int i = 0; i < 60; i++) {
        double middle = 0.5 * (low + high);
        if (encode(middle) < e) low = middle;
        else high = middle;
    }
    return low;
}

static double blended(double history, double sample, double alpha)
{
    double h = decode(history / 1023.0), s = decode(sample / 1023.0);
    return 1023 * encode(h + alpha * (s - h));
}

/* How far off the blend may be: a twentieth of a step, and what comes of decoding to a twentieth. No light has the
 * code 42, which lies between the two branches of the curve. */
static double allowed(int history, int sample, double alpha)
{
    double step = history <= 42 || sample <= 42 ? 0.5 : 0.07;
    double by_sample = fabs(blended(history, sample + step, alpha) - blended(history, sample - step, alpha));
    double by_history = fabs(blended(history + step, sample, alpha) - blended(history - step, sample, alpha));
    return 0.05 + by_sample + by_history;
}

/* Depths that the 16 bits of the cache hold exactly. */
static float exact_depth(void)
{
    static const float some[] = {0, 0.03125f, 0.5f, 1, 1.5f, 3, 100, 0.001953125f};
    return some[random_bits(&seed) % 8];
}

static uint32_t word(float w, int rho, int age)
{
    uint32_t bits;
    memcpy(&bits, &w, 4);
    return ((bits << 1) & 0xffff0000u) | (uint32_t)rho << 8 | (uint32_t)age;
}

static struct inputs {
    _Alignas(64) uint32_t sample[COUNT], colour[COUNT], cache[COUNT];
    _Alignas(64) float depth[COUNT], nearest[COUNT], farthest[COUNT], k[FV_CACHE_OLDEST + 1];
    _Alignas(64) int32_t replaced[COUNT], surface[COUNT];
} in;
static _Alignas(64) uint32_t colour[COUNT], cache[COUNT];
static _Alignas(64) float radiance[3][COUNT]; /* of the samples, at that exposure */
static const float exposure = 0.5f;

/* Steps of colour between nothing and all; samples of the history's depth, of others, of none. */
static void draw_inputs(void)
{
    static const float factors[] = {1, 1, 1, 1.02f, 0.98f, 1.05f, 0.95f, 30};
    for (int age = 0; age <= FV_CACHE_OLDEST; age++) in.k[age] = (float)fmin(0.6, 0.05 + 0.01 * age);
    for (int i = 0; i < COUNT; i++) {
        float w = exact_depth();
        uint32_t dice = (uint32_t)random_bits(&seed);
        in.colour[i] = (uint32_t)random_bits(&seed) & 0x3fffffff;
        in.sample[i] = dice & 1 ? (uint32_t)random_bits(&seed) & 0x3fffffff : in.colour[i] ^ (dice >> 8 & 0x0070180fu);
        if ((dice >> 1 & 15) == 0) in.colour[i] |= FV_PIXEL_FILLED;
        in.cache[i] = word(w, (int)(random_bits(&seed) & 255) >> (dice >> 5 & 7), (int)(random_bits(&seed) & FV_CACHE_OLDEST) >> (dice >> 8 & 7));
        in.surface[i] = dice >> 24 & 3 ? 0 : FV_SURFACE_OBJECT & 2;
        if (dice >> 26 & 7 ? in.surface[i] : !in.surface[i]) in.cache[i] |= FV_CACHE_MOVING;
        in.nearest[i] = in.farthest[i] = w;
        if ((dice >> 11 & 3) == 0) in.nearest[i] = 2 * w, in.farthest[i] = 0.5f * w;
        in.depth[i] = w * factors[dice >> 13 & 7];
        if ((dice >> 16 & 7) == 0) in.depth[i] = (dice >> 19 & 1) ? FV_DEPTH_UNKNOWN : (dice >> 20 & 1) ? NAN : INFINITY;
        in.replaced[i] = (dice >> 21 & 7) == 0 ? -1 : 0;
    }
}

static void merge(int isa, uint32_t of, bool encoded)
{
    const struct fv_merge m = {.count = COUNT, .seed = of, .epsilon = 0.03f, .k = in.k,
                               .sample = encoded ? in.sample : NULL, .red = radiance[0], .green = radiance[1],
                               .blue = radiance[2], .exposure = exposure,
                               .inverse_depth = in.depth, .nearest = in.nearest, .farthest = in.farthest,
                               .surface = in.surface,
                               .replaced = in.replaced, .colour = colour, .cache = cache};
    memcpy(colour, in.colour, sizeof colour);
    memcpy(cache, in.cache, sizeof cache);
    fv_kernels((enum fv_isa)isa)->merge(&m);
}

static void take_radiances(void)
{
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < COUNT; i++)
            radiance[c][i] = (float)decode((double)(in.sample[i] >> 10 * c & 1023) / 1023) / exposure;
}

/* What must come out; `mean`: of each channel. False where nothing may change. */
static bool expected(int i, double mean[3], double within[3], double *rho, bool *known)
{
    double w = (double)in.depth[i], was = (in.cache[i] >> 8) & 255, alpha = 1;
    bool filled = in.colour[i] & FV_PIXEL_FILLED, replaced = in.replaced[i];
    *known = w >= 0 && w <= (double)FV_INVERSE_DEPTH_MAX;
    if (!*known && !filled && !replaced) return false;
    bool same = w <= (double)in.nearest[i] * 1.03 && w >= (double)in.farthest[i] * 0.97 &&
                !(in.cache[i] & FV_CACHE_MOVING) == !in.surface[i];
    if (*known && same && !filled && !replaced && was >= 1)
        alpha = fmax(1 / (was + 1), (double)in.k[in.cache[i] & FV_CACHE_OLDEST]);
    for (int c = 0; c < 3; c++) {
        int h = (int)(in.colour[i] >> 10 * c & 1023), s = (int)(in.sample[i] >> 10 * c & 1023);
        mean[c] = alpha < 1 ? blended(h, s, alpha) : s;
        within[c] = alpha < 1 ? allowed(h, s, alpha) : 0;
    }
    *rho = fmin(255, 1 / (alpha * alpha + (1 - alpha) * (1 - alpha) / fmax(was, 1)));
    return true;
}

static void check_cache(int i, double rho, bool known)
{
    uint32_t got = cache[i];
    if (!known) {
        assert_int_equal(got, FV_CACHE_NONE | FV_CACHE_OLDEST);
        return;
    }
    assert_int_equal(got & 255, in.surface[i] ? FV_CACHE_MOVING : 0);
    if (!(fabs((double)(got >> 8 & 255) - rho) <= 0.502)) fail_msg("pixel %d: rho %u, must be %g", i, got >> 8 & 255, rho);
    uint32_t bits = got >> 1 & 0x7fff8000;
    float w;
    memcpy(&w, &bits, 4);
    if (!(fabsf(w - in.depth[i]) <= in.depth[i] / 512)) fail_msg("pixel %d: %g of %g", i, (double)w, (double)in.depth[i]);
}

/* Of codes, or of the radiances that these stand for. */
static void check_means(bool encoded)
{
    FOR_EACH_ISA
    {
        static double sum[COUNT][3];
        double worst = 0;
        memset(sum, 0, sizeof sum);
        seed = 1;
        draw_inputs();
        take_radiances();
        for (uint32_t s = 0; s < SEEDS; s++) {
            merge(isa, s * 0x85ebca6bu, encoded);
            for (int i = 0; i < COUNT; i++)
                for (int c = 0; c < 3; c++) sum[i][c] += colour[i] >> 10 * c & 1023;
        }
        for (int i = 0; i < COUNT; i++) {
            double mean[3], within[3], rho;
            bool known;
            if (!expected(i, mean, within, &rho, &known)) {
                assert_true(colour[i] == in.colour[i] && cache[i] == in.cache[i]);
                continue;
            }
            assert_int_equal(colour[i] & ~FV_PIXEL_COLOUR, FV_PIXEL_SAMPLED);
            check_cache(i, rho, known);
            for (int c = 0; c < 3; c++) {
                double off = fabs(sum[i][c] / SEEDS - mean[c]);
                if (!encoded && mean[c] == 42) within[c] = 1; /* no light's */
                if (within[c] < 0.2) worst = fmax(worst, off);
                if (off > within[c])
                    fail_msg("%s, pixel %d: %.3f, must be %.3f (%08x, %08x, %08x)", fv_cpu_isa_name((enum fv_isa)isa), i,
                             sum[i][c] / SEEDS, mean[c], in.colour[i], in.sample[i], in.cache[i]);
            }
        }
        print_message("%s: means of %d within %.3f of a step\n", fv_cpu_isa_name((enum fv_isa)isa), SEEDS, worst);
    }
}

static void merged_as_stated(void **state)
{
    (void)state;
    check_means(true);
}

static void radiance_merged_as_stated(void **state)
{
    (void)state;
    check_means(false);
}

/* Radiance that is no number is black, and what is too bright for any code counts as the highest one does. */
static void radiance_is_bounded(void **state)
{
    static const float extreme[] = {NAN, -1, -INFINITY, 0, 1e3f, 1e30f, INFINITY};
    static const double counted[] = {0, 0, 0, 0, 1023, 1023, 1023};
    (void)state;
    FOR_EACH_ISA
        for (size_t e = 0; e < sizeof extreme / sizeof extreme[0]; e++) {
            draw_inputs();
            for (int c = 0; c < 3; c++)
                for (int i = 0; i < COUNT; i++) radiance[c][i] = extreme[e];
            for (int i = 0; i < COUNT; i++) in.sample[i] = extreme[e] > 0 ? 0x3fffffff : 0;
            merge(isa, 1, false);
            for (int i = 0; i < COUNT; i++) {
                double mean[3], within[3], rho;
                bool known;
                if (!expected(i, mean, within, &rho, &known)) continue;
                for (int c = 0; c < 3; c++) {
                    double got = colour[i] >> 10 * c & 1023;
                    if (within[c] == 0) assert_true(got == counted[e]);
                    else assert_true(fabs(got - mean[c]) <= 1 + within[c]);
                }
            }
        }
}

/* Where all samples count alike and depths stay, rho counts them and stops at 255; a sample that replaces begins
 * anew. */
static void rho_counts_samples(void **state)
{
    (void)state;
    FOR_EACH_ISA
    {
        draw_inputs();
        for (int age = 0; age <= FV_CACHE_OLDEST; age++) in.k[age] = 1 / 256.0f;
        for (int i = 0; i < COUNT; i++) {
            in.cache[i] = word(1, 0, FV_CACHE_OLDEST), in.depth[i] = in.nearest[i] = in.farthest[i] = 1;
            in.replaced[i] = in.surface[i] = 0, in.colour[i] &= FV_PIXEL_COLOUR;
        }
        for (int n = 1; n <= 300; n++) {
            if (n == 300) memset(in.replaced, -1, sizeof in.replaced);
            merge(isa, (uint32_t)n, true);
            int rho = n == 300 ? 1 : n < 255 ? n : 255;
            for (int i = 0; i < COUNT; i++) assert_int_equal(cache[i], word(1, rho, 0));
            memcpy(in.cache, cache, sizeof cache);
            memcpy(in.colour, colour, sizeof colour);
            for (int i = 0; i < COUNT; i++) in.colour[i] &= FV_PIXEL_COLOUR;
        }
    }
}

/* Of 3 x 3 pixels, as far as they lie in the tile; pixels of no depth are passed over. */
static void bounds_are_those_around(void **state)
{
    (void)state;
    uint32_t *tile = calloc(FV_TILE * 40, sizeof *tile); /* as long as it is, so that the sanitizer sees reads beyond */
    static _Alignas(64) float nearest[FV_TILE * FV_TILE], farthest[FV_TILE * FV_TILE];
    for (int round = 0; round < 20; round++) FOR_EACH_ISA
        for (int density = FV_FINE; density < FV_DENSITIES; density++) {
            int side = FV_TILE >> density;
            for (int i = 0; i < FV_TILE * 40; i++)
                tile[i] = random_bits(&seed) % 20 < (uint64_t)round ? FV_CACHE_NONE | 3 : word(exact_depth(), 7, 9);
            fv_kernels((enum fv_isa)isa)->bounds[density](tile, 40, side, ~0u >> (32 - side), nearest, farthest);
            for (int y = 0; y < side; y++)
                for (int x = 0; x < side; x++) {
                    float high = -1, low = INFINITY;
                    for (int j = y ? y - 1 : 0; j <= y + 1 && j < side; j++)
                        for (int i = x ? x - 1 : 0; i <= x + 1 && i < side; i++) {
                            uint32_t bits = tile[j * 40 + i] >> 1 & 0x7fff8000;
                            float w;
                            memcpy(&w, &bits, 4);
                            if (tile[j * 40 + i] < FV_CACHE_NONE) high = fmaxf(high, w), low = fminf(low, w);
                        }
                    assert_true(nearest[y * FV_TILE + x] == high);
                    assert_true(high < 0 ? farthest[y * FV_TILE + x] > 1 : farthest[y * FV_TILE + x] == low);
                }
        }
    free(tile);
}

static int channel(uint32_t pixel, int c)
{
    return (int)(pixel >> 10 * c & 1023);
}

static void halved_and_doubled(void **state)
{
    (void)state;
    enum { N = 16 };
    uint32_t upper[2 * N + 2], lower[2 * N + 2], half[N], twice[2 * N];
    for (int round = 0; round < 2000; round++) FOR_EACH_ISA
        {
            const struct fv_kernels *k = fv_kernels((enum fv_isa)isa);
            uint32_t all = round == 0 ? 0xffffffff : round == 1 ? 0 : 0xbfffffff;
            for (int i = 0; i < 2 * N + 2; i++) {
                upper[i] = round < 2 ? all : (uint32_t)random_bits(&seed) & all;
                lower[i] = round < 2 ? all : (uint32_t)random_bits(&seed) & all;
            }
            k->halve(upper, lower, half, N);
            for (int i = 0; i < N; i++)
                for (int c = 0; c < 3; c++) {
                    int sum = channel(upper[2 * i], c) + channel(upper[2 * i + 1], c) + channel(lower[2 * i], c) +
                              channel(lower[2 * i + 1], c);
                    assert_int_equal(channel(half[i], c), (sum + 2) / 4);
                    assert_int_equal(half[i] & ~FV_PIXEL_COLOUR, all == 0xffffffff ? FV_PIXEL_SAMPLED : 0);
                }
            k->double_row(upper, lower, twice, N);
            for (int i = 0; i < 2 * N; i++)
                for (int c = 0; c < 3; c++) {
                    int own = i / 2 + 1, other = own + (i & 1 ? 1 : -1);
                    double near = 0.75 * channel(upper[own], c) + 0.25 * channel(upper[other], c);
                    double far = 0.75 * channel(lower[own], c) + 0.25 * channel(lower[other], c);
                    assert_int_equal(channel(twice[i], c), (int)floor(0.75 * near + 0.25 * far + 0.5));
                }
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(merged_as_stated), cmocka_unit_test(radiance_merged_as_stated),
                                       cmocka_unit_test(radiance_is_bounded), cmocka_unit_test(rho_counts_samples),
                                       cmocka_unit_test(bounds_are_those_around), cmocka_unit_test(halved_and_doubled)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
