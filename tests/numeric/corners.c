/* corners: which corners of four pixels the method selective tests, which of these fail and what lies around them is
 * known, against a plain statement of it in double precision (Kim, Ko and Ihm 2021, section 4.4): each attribute alone
 * and together, contrast one code above and below its threshold, normals about the angle. Then rows of pixels put
 * together, and decoded. Every instruction set that this machine has. */
#include "rt/pass/selective.h"
#include "tests/support/random.h"
#include "tests/support/small_scene.h"

enum { COUNT = 64, ROW = COUNT + 32, STAMP = 9, ATTRIBUTES = FV_TAU_COLOUR };

#define FOR_EACH_ISA for (int isa = 0; isa <= (int)fv_cpu_isa(); isa++)

static const double degree = M_PI / 180;
static const double per_channel[3] = {1.36, 1.02, 2.04};
static uint64_t seed = 1;

/* Rows of pixels above and below the corners. */
static struct rows {
    uint32_t base[2][ROW], identity[2][ROW], facing[2][ROW], second_identity[2][ROW], second_facing[2][ROW];
    uint32_t triangle[2][ROW], lit[2][ROW], cache[2][ROW];
    float tolerance[ROW];
} rows;
static struct fv_selective settings;
static struct fv_view view;

static int below(int n)
{
    return (int)(random_bits(&seed) % (uint64_t)n);
}

static uint32_t facing_of(const double n[3])
{
    uint32_t word = 0;
    for (int c = 0; c < 3; c++) word |= (uint32_t)(511 * (n[c] + 1) + 0.5) << 10 * c;
    return word;
}

/* Unit: the direction turned by the angle, some way or other. */
static void turned(const double n[3], double deg, double out[3])
{
    double other[3], along = 0, length = 0;
    do random_direction(&seed, other);
    while (fabs(n[0] * other[0] + n[1] * other[1] + n[2] * other[2]) > 0.9);
    for (int c = 0; c < 3; c++) along += n[c] * other[c];
    for (int c = 0; c < 3; c++) other[c] -= along * n[c], length += other[c] * other[c];
    for (int c = 0; c < 3; c++) out[c] = cos(deg * degree) * n[c] + sin(deg * degree) * other[c] / sqrt(length);
}

/* One of four that is turned away from the others by it. */
static void set_angle(double deg)
{
    settings.facing_limit = (float)(12 * pow(sin(0.5 * deg * degree), 2));
}

static void run(int isa, int count, bool secondary, bool known, struct fv_corners *c)
{
    *c = (struct fv_corners){.count = count, .stamp = STAMP, .tolerance = rows.tolerance, .settings = &settings,
                             .view = &view, .x = 17, .y = 5};
    for (int k = 0; k < 2; k++) {
        c->base[k] = rows.base[k], c->identity[k] = rows.identity[k], c->facing[k] = rows.facing[k];
        if (secondary) c->second_identity[k] = rows.second_identity[k], c->second_facing[k] = rows.second_facing[k];
        if (known) c->triangle[k] = rows.triangle[k], c->lit[k] = rows.lit[k], c->cache[k] = rows.cache[k];
    }
    fv_kernels((enum fv_isa)isa)->test_corners(c);
}

/* Everywhere the same: one surface seen straight on, evenly lit; and every corner is tested. */
static void draw_even(uint32_t colour)
{
    const double ahead[3] = {0, 0, 1};
    memset(&rows, 0xff, sizeof rows); /* identities behind the last are of no frame */
    for (int i = 0; i < ROW; i++) rows.tolerance[i] = 1;
    for (int k = 0; k < 2; k++)
        for (int i = 0; i <= COUNT; i++) {
            rows.base[k][i] = colour | (uint32_t)below(4) << 30;
            rows.identity[k][i] = (uint32_t)STAMP << FV_IDENTITY_STAMP_SHIFT | 7;
            rows.facing[k][i] = facing_of(ahead);
            rows.second_identity[k][i] = 3;
            rows.second_facing[k][i] = facing_of(ahead);
            rows.triangle[k][i] = (uint32_t)(40 + i);
            rows.lit[k][i] = 5;
            rows.cache[k][i] = 0x7e800000; /* 0.25 / m, as floats are rounded */
        }
}

/* One pixel of those around a corner: `pixel` 0 to 3. */
static void spoil(int corner, int pixel, int attribute)
{
    uint32_t(*identity)[ROW] = attribute < FV_TAU_SECOND ? rows.identity : rows.second_identity;
    uint32_t(*facing)[ROW] = attribute < FV_TAU_SECOND ? rows.facing : rows.second_facing;
    const double ahead[3] = {0, 0, 1};
    double other[3];
    int k = pixel >> 1, i = corner + (pixel & 1);
    switch (attribute % FV_TAU_SECOND) {
    case FV_TAU_OBJECT: identity[k][i] ^= below(2) ? 1u << below(3) : 1u << (16 + below(5)); break;
    case FV_TAU_FACING:
        turned(ahead, 30, other);
        facing[k][i] = facing_of(other);
        break;
    case FV_TAU_SHADOWS: identity[k][i] ^= 1u << (FV_IDENTITY_SHADOWS_SHIFT + below(5)); break;
    case FV_TAU_TEXTURED: identity[k][i] ^= FV_IDENTITY_TEXTURED; break;
    }
}

/* The least code above `low` whose contrast with it is above tau. */
static int code_above(int low, double tau)
{
    int high = low + 2;
    while (!(high - low - 1 > tau * (high + low))) high++;
    return high;
}

/* All subsets of the attributes: the threshold is the least of those that disagree, of colour where none does, to a
 * code in each channel, whichever of the four pixels it is that differs. */
static void the_least_threshold_of_those_that_disagree(void **state)
{
    (void)state;
    static const float thresholds[FV_TAUS] = {0.010f, 0.018f, 0.026f, 0.034f, 0.042f, 0.050f, 0.058f, 0.066f, 0.074f};
    const int low = 250, corner_step = 3;
    set_angle(8);
    for (int round = 0; round < 12; round++) {
        for (int t = 0; t < FV_TAUS; t++) settings.threshold[t] = thresholds[(t * 2 + round) % FV_TAUS];
        float tolerance = round % 3 == 0 ? 1 : round % 3 == 1 ? 2 : 0.5f;
        for (int subset = 0; subset < 1 << ATTRIBUTES; subset++) {
            double tau = 1e9;
            draw_even((uint32_t)(low | low << 10 | low << 20));
            for (int a = 0; a < ATTRIBUTES; a++)
                if (subset >> a & 1) tau = fmin(tau, (double)settings.threshold[a]);
            if (!subset) tau = (double)settings.threshold[FV_TAU_COLOUR];
            tau *= (double)tolerance;
            int expected[COUNT] = {0};
            for (int i = 0; i + 1 < COUNT; i += corner_step) {
                int channel = below(3), above = below(2), high = code_above(low, tau * per_channel[channel]) - !above;
                int pixel = below(4);
                rows.tolerance[i] = tolerance;
                rows.base[pixel >> 1][i + (pixel & 1)] += (uint32_t)(high - low) << 10 * channel;
                for (int a = 0; a < ATTRIBUTES; a++)
                    if (subset >> a & 1) spoil(i, below(4), a);
                expected[i] = above;
            }
            FOR_EACH_ISA
            {
                struct fv_corners c;
                run(isa, COUNT, true, true, &c);
                assert_true(c.tested == ~0ull);
                for (int i = 0; i + 1 < COUNT; i += corner_step) {
                    if ((int)(c.failed >> i & 1) != expected[i])
                        fail_msg("%s, attributes %02x, corner %d: tau %g, failed %d", fv_cpu_isa_name((enum fv_isa)isa), subset,
                                 i, tau, !expected[i]);
                    if ((c.known >> i & 1) && (subset || !expected[i]))
                        fail_msg("attributes %02x: what lies between them is not known", subset);
                }
            }
        }
    }
}

/* The same in double; `tie`: too near to the threshold or the angle to tell. */
static double object_of(uint32_t identity)
{
    return identity & FV_IDENTITY_OBJECT;
}

static double least_tau(const uint32_t (*identity)[ROW], const uint32_t (*facing)[ROW], const float *threshold, double limit,
                        int i, bool *tie)
{
    double tau = INFINITY, apart = 0;
    bool hit = true;
    uint32_t id[4] = {identity[0][i], identity[0][i + 1], identity[1][i], identity[1][i + 1]};
    uint32_t n[4] = {facing[0][i], facing[0][i + 1], facing[1][i], facing[1][i + 1]};
    for (int a = 0; a < 4; a++) {
        hit &= (id[a] & 0xffff) != 0;
        for (int b = a + 1; b < 4; b++)
            for (int c = 0; c < 3; c++) apart += pow(((double)(n[a] >> 10 * c & 1023) - (double)(n[b] >> 10 * c & 1023)) / 511, 2);
    }
    for (int k = 1; k < 4; k++) {
        if (object_of(id[k]) != object_of(id[0])) tau = fmin(tau, (double)threshold[FV_TAU_OBJECT]);
        if ((id[k] ^ id[0]) & FV_IDENTITY_SHADOWS) tau = fmin(tau, (double)threshold[FV_TAU_SHADOWS]);
        if ((id[k] ^ id[0]) & FV_IDENTITY_TEXTURED) tau = fmin(tau, (double)threshold[FV_TAU_TEXTURED]);
    }
    if (hit && apart > limit) tau = fmin(tau, (double)threshold[FV_TAU_FACING]);
    *tie |= hit && fabs(apart - limit) < 1e-4 * limit;
    return tau;
}

static bool expected_to_fail(int i, bool secondary, bool *tie)
{
    double limit = (double)settings.facing_limit;
    double tau = least_tau(rows.identity, rows.facing, settings.threshold, limit, i, tie);
    if (secondary)
        tau = fmin(tau, least_tau(rows.second_identity, rows.second_facing, settings.threshold + FV_TAU_SECOND, limit, i, tie));
    if (isinf(tau)) tau = (double)settings.threshold[FV_TAU_COLOUR];
    bool failed = false;
    for (int c = 0; c < 3; c++) {
        double high = 0, low = 1023;
        for (int k = 0; k < 4; k++) {
            double v = rows.base[k >> 1][i + (k & 1)] >> 10 * c & 1023;
            high = fmax(high, v), low = fmin(low, v);
        }
        double limit_here = tau * per_channel[c] * (double)rows.tolerance[i] * (high + low), off = high - low - 1 - limit_here;
        failed |= off > 0;
        *tie |= off != 0 && fabs(off) < 1e-5 * (1 + limit_here);
    }
    return failed;
}

/* Anything beside anything: black, the brightest, what was not hit, frames before, places that are not tested. */
static void draw_random(void)
{
    static const float thresholds[] = {0, 0.02f, 0.05f, 0.06f, 0.3f, 1, 1e6f};
    static const float tolerances[] = {0, 0.5f, 1, 2, 12, 1e6f, -1};
    double n[3], other[3];
    memset(&rows, 0, sizeof rows);
    for (int t = 0; t < FV_TAUS; t++) settings.threshold[t] = thresholds[below(7)];
    random_direction(&seed, n);
    int likely = 1 + below(12);
    for (int i = 0; i < ROW; i++) rows.tolerance[i] = tolerances[below(7)];
    for (int k = 0; k < 2; k++)
        for (int i = 0; i < ROW; i++) {
            for (int c = 0; c < 3; c++) {
                int code = 400 + below(60);
                if (below(20) == 0) code = below(2) ? 0 : 1023;
                if (below(20) == 0) code = below(3);
                rows.base[k][i] |= (uint32_t)code << 10 * c;
            }
            uint32_t of = below(likely) ? 4 : (uint32_t)below(3);
            uint32_t stamp = below(30) ? STAMP : (uint32_t)below(32), rest = below(likely) ? 0 : (uint32_t)below(1 << 6);
            rows.identity[k][i] = stamp << FV_IDENTITY_STAMP_SHIFT | rest << FV_IDENTITY_SHADOWS_SHIFT | of;
            rows.second_identity[k][i] = (below(likely) ? 0 : (uint32_t)below(1 << 6)) << FV_IDENTITY_SHADOWS_SHIFT | (below(likely) ? 2 : (uint32_t)below(2));
            turned(n, random_decade(&seed, 0.1, below(likely) ? 5 : 180), other);
            rows.facing[k][i] = below(20) ? facing_of(other) : (uint32_t)random_bits(&seed);
            turned(n, random_decade(&seed, 0.1, below(likely) ? 5 : 180), other);
            rows.second_facing[k][i] = facing_of(other);
        }
}

static bool of_this_frame(int i)
{
    bool known = true;
    for (int k = 0; k < 4; k++) known &= rows.identity[k >> 1][i + (k & 1)] >> FV_IDENTITY_STAMP_SHIFT == STAMP;
    return known;
}

static void corners_as_stated(void **state)
{
    (void)state;
    static const double angles[] = {0.5, 3, 8, 25, 180};
    long tried = 0, tested = 0, failed = 0, ties = 0;
    for (int round = 0; round < 3000; round++) {
        draw_random();
        set_angle(angles[below(5)]);
        int count = 1 + below(COUNT);
        bool secondary = below(2);
        FOR_EACH_ISA
        {
            struct fv_corners c;
            run(isa, count, secondary, false, &c);
            assert_true(c.known == 0);
            for (int i = 0; i < COUNT; i++) {
                bool tie = false, test = i < count && rows.tolerance[i] >= 0 && of_this_frame(i);
                bool fail = test && expected_to_fail(i, secondary, &tie);
                tried++, tested += test, failed += fail, ties += tie;
                if ((bool)(c.tested >> i & 1) != test || (!tie && (bool)(c.failed >> i & 1) != fail))
                    fail_msg("%s, round %d, corner %d of %d: tested %d, not %d; failed %d, not %d", fv_cpu_isa_name((enum fv_isa)isa),
                             round, i, count, !test, test, !fail, fail);
            }
        }
    }
    print_message("%ld corners, %ld tested, %ld failed, %ld too near to tell\n", tried, tested, failed, ties);
    assert_true(tested > tried / 10 && failed > tested / 10 && failed < tested * 9 / 10 && ties < tried / 100);
}

/* Four normals of one code never disagree, however small the angle; one of them turned by less than the angle does not,
 * one turned by more does. Codes are good to a tenth of a degree. */
static void normals_by_their_angle(void **state)
{
    (void)state;
    static const double angles[] = {0, 0.05, 1, 3, 8, 20, 45, 90, 150};
    settings.threshold[FV_TAU_FACING] = 0;
    settings.threshold[FV_TAU_COLOUR] = 1e6f;
    for (unsigned a = 0; a < sizeof angles / sizeof *angles; a++)
        for (int round = 0; round < 300; round++) {
            double n[3], other[3], within = angles[a] < 45 ? 0.25 : 1; /* lengths, good to 1 / 600, count there */
            double to[3] = {0, fmax(angles[a] - within, 0), angles[a] + within};
            draw_even(300);
            set_angle(angles[a]);
            for (int i = 0; i < COUNT - 1; i += 2) {
                random_direction(&seed, n);
                turned(n, i % 3 == 0 ? 0 : to[i % 3], other);
                for (int k = 0; k < 4; k++) rows.facing[k >> 1][i + (k & 1)] = facing_of(n);
                if (i % 3) rows.facing[i / 2 % 2][i + i / 4 % 2] = facing_of(other);
                rows.base[0][i] = 900;
            }
            FOR_EACH_ISA
            {
                struct fv_corners c;
                run(isa, COUNT, false, false, &c);
                for (int i = 0; i < COUNT - 1; i += 2) {
                    if (i % 3 == 1 && angles[a] < within) continue;
                    if ((bool)(c.failed >> i & 1) != (i % 3 == 2))
                        fail_msg("%g degrees, one turned by %g: %s", angles[a], to[i % 3], i % 3 == 2 ? "agree" : "disagree");
                }
            }
        }
}

/* Of a depth's inverse, as the cache keeps it. */
static uint32_t cache_word(double w)
{
    float f = (float)w;
    uint32_t bits;
    memcpy(&bits, &f, 4);
    return ((bits + 0x4000) << 1 & 0xffff0000u) | 1 << 8;
}

/* Pixels of one plane in front of the eye: known; and each thing that makes them not so. */
static void one_surface_evenly_lit(void **state)
{
    (void)state;
    enum { SAME, OFF_PLANE, ON_PLANE, OTHER_LIGHT, NO_TRIANGLE, MOVES, NO_DEPTH, NORMAL, SHADOW, KINDS };
    const double origin[3] = {0, 0, 0}, no_turn[4] = {1, 0, 0, 0};
    view = small_view(origin, no_turn, 45, 64);
    int known[KINDS] = {0}, all[KINDS] = {0};
    set_angle(8);
    for (int t = 0; t < FV_TAUS; t++) settings.threshold[t] = 0.02f;
    for (int round = 0; round < 400; round++) {
        double n[3], away = random_decade(&seed, 0.01, 1e4), other[3];
        do random_direction(&seed, n);
        while (n[2] < 0.3);
        draw_even(500);
        for (int k = 0; k < 2; k++)
            for (int i = 0; i < 32; i++) {
                double along = 0;
                for (int c = 0; c < 3; c++) along -= n[c] * (view.corner[c] + (17 - 0.5 + i) * view.dx[c] + (5 - 0.5 + k) * view.dy[c]);
                rows.facing[k][i] = facing_of(n);
                rows.cache[k][i] = cache_word(fmax(along, 0) / away);
                rows.base[k][i] = k ? 300 : 700;
            }
        int kind = round % KINDS, k = below(2);
        for (int i = 2; i < 30; i += 4) {
            turned(n, 30, other);
            float w = 0;
            memcpy(&w, &(uint32_t){rows.cache[k][i] >> 1 & 0x7fff8000}, 4);
            switch (kind) {
            case OFF_PLANE: rows.cache[k][i] = cache_word((double)w * (below(2) ? 1.1 : 0.9)); break;
            case ON_PLANE: rows.cache[k][i] = cache_word((double)w * 1.001); break;
            case OTHER_LIGHT: rows.lit[k][i] ^= 1u << below(32); break;
            case NO_TRIANGLE: rows.triangle[k][i] = (uint32_t)-1; break;
            case MOVES: for (int j = 0; j < 4; j++) rows.identity[j >> 1][i - 1 + (j & 1)] |= 3 << 16, rows.identity[j >> 1][i + (j & 1)] |= 3 << 16; break;
            case NO_DEPTH: rows.cache[k][i] = 0xffff0000; break;
            case NORMAL: rows.facing[k][i] = facing_of(other); break;
            case SHADOW: rows.identity[k][i] |= 1 << FV_IDENTITY_SHADOWS_SHIFT; break;
            }
        }
        FOR_EACH_ISA
        {
            struct fv_corners c;
            run(isa, 32, false, true, &c);
            for (int i = 1; i < 29; i++) {
                /* Spoilt pixels are 2, 6, ..: corners 1, 2, 5, 6, ... Grazed planes are too coarsely known to tell. */
                bool spoilt = (i & 3) == 1 || (i & 3) == 2;
                double along = 0;
                for (int d = 0; d < 3; d++) along -= n[d] * (view.corner[d] + (17.0 + i) * view.dx[d] + 5.0 * view.dy[d]);
                if (along < 0.3 || !spoilt) continue;
                all[kind]++, known[kind] += (int)(c.known >> i & 1);
            }
        }
    }
    for (int kind = 0; kind < KINDS; kind++) {
        bool yes = kind == SAME || kind == ON_PLANE;
        if (all[kind] < 100 || known[kind] != (yes ? all[kind] : 0)) fail_msg("kind %d: %d of %d are known", kind, known[kind], all[kind]);
    }
}

/* Codes of what a channel's linear values come to. */
static void encode(int isa, const float linear[3][ROW], uint32_t *code)
{
    fv_kernels((enum fv_isa)isa)->encode(linear[0], linear[1], linear[2], 1, code, COUNT);
}

static void rows_put_together(void **state)
{
    (void)state;
    enum { N = 32 };
    static _Alignas(64) float around[3][3][ROW], extra[3][ROW], linear[3][ROW];
    static _Alignas(64) uint32_t before[ROW], code[ROW];
    uint32_t *colour = calloc(ROW, sizeof *colour);
    static const float some[] = {0, 0, 1e-4f, 0.01f, 0.2f, 1, 7.24f};
    for (int round = 0; round < 4000; round++) FOR_EACH_ISA
        {
            struct fv_resolve r = {.count = round % 2 ? N : 1 + below(N), .exposure = (float)random_decade(&seed, 1e-3, 1e3), .colour = colour};
            for (int k = 0; k < 2; k++) r.tested[k] = random_bits(&seed) | random_bits(&seed) | random_bits(&seed), r.failed[k] = random_bits(&seed);
            if (round < 4) r.tested[0] = r.tested[1] = ~0ull, r.failed[0] = r.failed[1] = round & 1 ? ~0ull : 0;
            for (int c = 0; c < 3; c++) {
                r.extra[c] = extra[c];
                for (int y = 0; y < 3; y++) {
                    r.around[c][y] = around[c][y];
                    for (int i = 0; i < ROW; i++) around[c][y][i] = some[below(7)];
                }
                for (int i = 0; i < ROW; i++) extra[c][i] = some[below(7)] / r.exposure;
            }
            if (round % 7 == 0) extra[1][5] = NAN, extra[2][6] = INFINITY;
            for (int i = 0; i < ROW; i++) before[i] = colour[i] = (uint32_t)random_bits(&seed);
            for (int c = 0; c < 3; c++)
                for (int i = 0; i < COUNT; i++) {
                    double sum = (double)extra[c][i] * (double)r.exposure;
                    for (int k = 0; k < 4; k++) {
                        int x = i + 2 * (k & 1), y = 2 * (k >> 1);
                        double mean = 9 * (double)around[c][1][i + 1] + 3 * (double)around[c][1][x] + 3 * (double)around[c][y][i + 1] + (double)around[c][y][x];
                        int corner = i + (k & 1);
                        if (corner > 63 || !(r.failed[k >> 1] >> corner & 1)) sum += mean / 64;
                    }
                    linear[c][i] = (float)sum;
                }
            encode(isa, (const float(*)[ROW])linear, code);
            fv_kernels((enum fv_isa)isa)->resolve(&r);
            for (int i = 0; i < ROW; i++) {
                bool whole = i < r.count && (r.tested[0] >> i & 1) && (r.tested[0] >> (i + 1) & 1) && (r.tested[1] >> i & 1) && (r.tested[1] >> (i + 1) & 1);
                if (!whole) {
                    if (colour[i] != before[i]) fail_msg("pixel %d of %d was not to be touched", i, r.count);
                    continue;
                }
                assert_int_equal(colour[i] >> 30, before[i] >> 30);
                for (int c = 0; c < 3; c++)
                    if (abs((int)(colour[i] >> 10 * c & 1023) - (int)(code[i] >> 10 * c & 1023)) > 1)
                        fail_msg("pixel %d, channel %d: %u, must be %u", i, c, colour[i] >> 10 * c & 1023, code[i] >> 10 * c & 1023);
            }
        }
    free(colour);
}

static void codes_come_back(void **state)
{
    (void)state;
    static _Alignas(64) uint32_t pixel[1024], again[1024];
    static _Alignas(64) float red[1024], green[1024], blue[1024];
    for (uint32_t i = 0; i < 1024; i++) pixel[i] = i | (1023 - i) << 10 | (i * 5 & 1023) << 20 | 3u << 30;
    FOR_EACH_ISA
    {
        const struct fv_kernels *k = fv_kernels((enum fv_isa)isa);
        k->decode(pixel, red, green, blue, 1024);
        k->encode(red, green, blue, 1, again, 1024);
        for (int i = 0; i < 1024; i++)
            for (int c = 0; c < 3; c++) {
                int was = (int)(pixel[i] >> 10 * c & 1023);
                if (abs((int)(again[i] >> 10 * c & 1023) - was) > (was == 42)) /* no light's code */
                    fail_msg("%d comes back as %u", was, again[i] >> 10 * c & 1023);
            }
        for (int i = 1; i < 1024; i++) assert_true(red[i] >= red[i - 1] && red[0] == 0 && red[1023] < 7.3f);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_least_threshold_of_those_that_disagree), cmocka_unit_test(corners_as_stated),
        cmocka_unit_test(normals_by_their_angle), cmocka_unit_test(one_surface_evenly_lit),
        cmocka_unit_test(rows_put_together), cmocka_unit_test(codes_come_back)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
