/* reproject: the reprojection kernel by itself, on histories, nodes and maps that hold anything: what it
 * writes is finite, what it reads lies in its buffers, and equal views give equal pictures. Every instruction
 * set that this machine has. */
#include "rt/pass/reproject.h"

#include "rt/pass/cache.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum {
    WIDTH = 90,
    HEIGHT = 75,
    TILES_X = 3,
    TILES_Y = 3,
    STRIDE = 96,
    ROWS = 96,
    SPACING = 8,
    NODES = STRIDE / SPACING
};

/* Tiles of the fine raster, of the coarse one, and of the fine one with the coarse one's history behind it. */
enum mode { FINE, COARSE, COARSEST, ALL, MODES };

/* Each buffer of its own and as long as a frame's is, so that the sanitizer sees every read beyond it. */
struct pixels {
    uint32_t *history_colour, *history_cache, *colour, *cache;
};

struct buffers {
    struct pixels raster[FV_DENSITIES];
    uint32_t *support_colour;
    float *support_depth;
    uint8_t *support_surface;
};

static void *take(size_t bytes)
{
    void *p = calloc(1, bytes);
    if (!p) abort();
    return p;
}

static struct buffers make_buffers(void)
{
    size_t nodes = (size_t)NODES * NODES;
    struct buffers b = {.support_colour = take(nodes * 4), .support_depth = take(nodes * 4), .support_surface = take(nodes)};
    for (int d = 0; d < FV_DENSITIES; d++) {
        size_t bytes = ((size_t)STRIDE * ROWS * 4 >> 2 * d) + 64;
        b.raster[d] = (struct pixels){take(bytes), take(bytes), take(bytes), take(bytes)};
    }
    return b;
}

static void free_buffers(struct buffers *b)
{
    free(b->support_colour), free(b->support_depth), free(b->support_surface);
    for (int d = 0; d < FV_DENSITIES; d++) {
        struct pixels *r = &b->raster[d];
        free(r->history_colour), free(r->history_cache), free(r->colour), free(r->cache);
    }
}

/* The raster that a mode's tiles lie in. */
static int density_of(int mode)
{
    return mode == COARSE ? FV_COARSE : mode == COARSEST ? FV_COARSEST : FV_FINE;
}

/* Its width, height and stride from the picture's. */
static int of_raster(int picture, int mode)
{
    return (picture + (1 << density_of(mode)) - 1) >> density_of(mode);
}

static uint32_t noise(uint32_t i)
{
    i = (i ^ (i >> 16)) * 0x7feb352du;
    i = (i ^ (i >> 15)) * 0x846ca68bu;
    return i ^ (i >> 16);
}

static uint32_t word(float w)
{
    uint32_t bits;
    memcpy(&bits, &w, 4);
    return (bits + 0x4000) << 1 & 0xffff0000u;
}

/* NaN where none is known. */
static float depth_in(uint32_t cache)
{
    uint32_t bits = cache >> 1 & 0x7fff8000;
    float w;
    memcpy(&w, &bits, 4);
    return cache >= FV_CACHE_NONE ? NAN : w;
}

/* Histories of noise at inverse depth w, of any worth and age, with nodes to match. */
static void fill(struct buffers *b, float w)
{
    for (int d = 0; d < FV_DENSITIES; d++) {
        struct pixels *r = &b->raster[d];
        for (uint32_t i = 0; i < (uint32_t)STRIDE * ROWS >> 2 * d; i++) {
            r->history_colour[i] = noise(i + 7919 * (uint32_t)d);
            r->history_cache[i] = word(w) | (noise(i + 31) & 0xffff & ~(uint32_t)FV_CACHE_MOVING);
            r->colour[i] = 0x3fffffff;
            r->cache[i] = 0xff000000;
        }
    }
    for (uint32_t i = 0; i < NODES * NODES; i++) {
        b->support_colour[i] = noise(i + 77);
        b->support_depth[i] = w;
        b->support_surface[i] = 0;
    }
}

static const double no_turn[4] = {1, 0, 0, 0};

static struct fv_view view_at(const double at[3], const double rotation[4])
{
    const struct fv_lens lens = {1.0, 0.8, 0.9, 0.7, WIDTH, HEIGHT};
    const double ahead[3] = {0, 0, -1};
    struct fv_pose pose = {{at[0], at[1], at[2]}, {rotation[0], rotation[1], rotation[2], rotation[3]}};
    struct fv_view view;
    fv_view_set(&view, &lens, &pose, ahead);
    return view;
}

static struct fv_map map_between(const double now[3], const double now_rotation[4], const double before[3],
                                 const double before_rotation[4])
{
    struct fv_view a = view_at(now, now_rotation), b = view_at(before, before_rotation);
    struct fv_map map;
    fv_map_set(&map, &a, &b);
    return map;
}

/* From pictures to rasters of a density. */
static struct fv_map scaled(const struct fv_map *map, int density)
{
    struct fv_map h = *map;
    float scale = (float)(1 << density);
    for (int c = 0; c < 2; c++) h.m[c][2] /= scale, h.t[c] /= scale, h.m[2][c] *= scale;
    return h;
}

static struct fv_raster raster_of(const struct pixels *p, int d)
{
    return (struct fv_raster){.width = (WIDTH + (1 << d) - 1) >> d,
                              .height = (HEIGHT + (1 << d) - 1) >> d,
                              .stride = STRIDE >> d,
                              .scale = (float)(1 << d),
                              .colour = p->colour,
                              .cache = p->cache,
                              .history_colour = p->history_colour,
                              .history_cache = p->history_cache};
}

static void check_pixel(uint32_t colour, uint32_t cache, int x, int y)
{
    float w = depth_in(cache);
    if (cache < FV_CACHE_NONE && !(w >= 0 && w <= FV_INVERSE_DEPTH_MAX))
        fail_msg("cache %08x at %d %d", cache, x, y);
    assert_true(!(colour & FV_PIXEL_SAMPLED));
    /* What was filled counts for nothing. */
    if (colour & FV_PIXEL_FILLED) assert_int_equal(cache & 0xffff, FV_CACHE_OLDEST);
}

static uint64_t failed_blocks[TILES_X * TILES_Y]; /* by the last carry */

/* All tiles; returns how many pixels inside the picture found no history. */
static int carry(struct buffers *b, const struct fv_map *map, int isa, int mode)
{
    int filled = 0, d = density_of(mode), side = FV_TILE >> d, spacing = SPACING >> d;
    struct fv_raster raster = raster_of(&b->raster[d], d), coarse = raster_of(&b->raster[FV_COARSE], FV_COARSE);
    struct fv_raster coarsest = raster_of(&b->raster[FV_COARSEST], FV_COARSEST);
    for (int i = 0; i < TILES_X * TILES_Y; i++) {
        struct fv_reproject_tile t = {.map = scaled(map, d),
                                      .raster = &raster,
                                      .coarsers = mode == ALL ? 2 : 0,
                                      .coarser = {&coarse, &coarsest},
                                      .x0 = i % TILES_X * side,
                                      .y0 = i / TILES_X * side,
                                      .side = side,
                                      .footprint = 1,
                                      .sharp = i & 1,
                                      .spacing = (float)spacing,
                                      .node = {0.5f * (float)spacing, 0.5f * (float)spacing},
                                      .nodes_x = (WIDTH + SPACING - 1) / SPACING,
                                      .nodes_y = (HEIGHT + SPACING - 1) / SPACING,
                                      .support_stride = NODES,
                                      .support_colour = b->support_colour,
                                      .support_depth = b->support_depth,
                                      .support_surface = b->support_surface,
                                      .epsilon = 0.03f,
                                      .epsilon_luminance = 0.3f};
        fv_kernels((enum fv_isa)isa)->reproject[d](&t);
        failed_blocks[i] = t.failed;
    }
    for (int y = 0; y < raster.height; y++)
        for (int x = 0; x < raster.width; x++) {
            int64_t at = y * raster.stride + x;
            check_pixel(raster.colour[at], raster.cache[at], x, y);
            filled += (raster.colour[at] & FV_PIXEL_FILLED) != 0;
        }
    return filled;
}

#define FOR_EACH_ISA for (int isa = 0; isa <= (int)fv_cpu_isa(); isa++)

/* The same pose twice, wherever it is: colours to the bit, flags gone, depths as the nodes have them, the same
 * worth, a frame older. */
static void equal_poses_copy(void **state)
{
    (void)state;
    static const float depths[] = {0, 1e-30f, 1e-6f, 1e-3f, 0.5f, 1, 100, 1e4f, 1e6f};
    struct buffers b = make_buffers();
    for (int p = 0; p < 5; p++)
        for (unsigned d = 0; d < 9 * MODES; d++) FOR_EACH_ISA
            {
                double at[3] = {p * 1e5, -p * 17.3, p}, turn[4];
                float depth = depths[d / MODES];
                int mode = (int)d % MODES;
                const struct pixels *r = &b.raster[density_of(mode)];
                fv_quat_from_yaw_pitch_roll(p * 1.1, p * 0.4, -p * 2.0, turn);
                struct fv_map map = map_between(at, turn, at, turn);
                fill(&b, depth);
                assert_int_equal(carry(&b, &map, isa, mode), 0);
                for (int y = 0; y < of_raster(HEIGHT, mode); y++)
                    for (int x = 0; x < of_raster(WIDTH, mode); x++) {
                        int i = y * of_raster(STRIDE, mode) + x;
                        uint32_t was = r->history_cache[i], age = was & FV_CACHE_OLDEST;
                        if (r->colour[i] != (r->history_colour[i] & 0x3fffffff))
                            fail_msg("pose %d, depth %g, mode %d: %d %d: %08x from %08x", p, (double)depth, mode, x, y,
                                     r->colour[i], r->history_colour[i]);
                        if (r->cache[i] != was + (age < FV_CACHE_OLDEST))
                            fail_msg("pose %d, depth %g, mode %d: %d %d: cache %08x from %08x", p, (double)depth, mode, x,
                                     y, r->cache[i], was);
                    }
            }
    free_buffers(&b);
}

/* History that was only ever filled in is shown, but its block is to be sampled, once a quarter of it is so. */
static void what_was_filled_is_asked_for(void **state)
{
    (void)state;
    static const double here[3] = {0, 0, 0};
    static const struct {
        int pixels;
        uint64_t failed;
    } cases[] = {{0, 0}, {3, 0}, {4, 1ull << 9}, {16, 1ull << 9}};
    struct buffers b = make_buffers();
    struct fv_map map = map_between(here, no_turn, here, no_turn);
    for (int mode = 0; mode < MODES; mode++)
        for (int n = 0; n < 4; n++) FOR_EACH_ISA
            {
                const struct pixels *r = &b.raster[density_of(mode)];
                int stride = of_raster(STRIDE, mode);
                fill(&b, 0.5f);
                for (int i = 0; i < stride * of_raster(ROWS, mode); i++) r->history_cache[i] |= 0x100;
                for (int i = 0; i < cases[n].pixels; i++)
                    r->history_cache[(4 + i / 4) * stride + 4 + i % 4] &= 0xffff00ff;
                assert_int_equal(carry(&b, &map, isa, mode), 0);
                for (int i = 0; i < TILES_X * TILES_Y; i++)
                    assert_true(failed_blocks[i] == (i == 0 ? cases[n].failed : 0));
                assert_int_equal(r->colour[5 * stride + 5], r->history_colour[5 * stride + 5] & 0x3fffffff);
            }
    free_buffers(&b);
}

/* Where the fine raster holds no history the coarse one's is found, and where that holds none either the coarsest
 * one's: nothing is filled, and an even picture stays even up to its borders. */
static void coarse_history_is_found(void **state)
{
    (void)state;
    static const double here[3] = {0, 0, 0}, steps[][3] = {{0, 0, 0}, {0.011, -0.007, 0.02}, {-0.03, 0.02, -0.05}};
    const uint32_t even = 700 | 300 << 10 | 90 << 20;
    struct buffers b = make_buffers();
    for (int s = 0; s < 3; s++)
        for (int density = FV_COARSE; density < FV_DENSITIES; density++) FOR_EACH_ISA
            {
                struct fv_map map = map_between(steps[s], no_turn, here, no_turn);
                fill(&b, 0.5f);
                int usual = carry(&b, &map, isa, FINE);
                for (int d = FV_FINE; d < density; d++)
                    for (int i = 0; i < STRIDE * ROWS >> 2 * d; i++)
                        b.raster[d].history_cache[i] = FV_CACHE_NONE | (noise((uint32_t)i) & 0xffff);
                for (int d = density; d < FV_DENSITIES; d++)
                    for (int i = 0; i < STRIDE * ROWS >> 2 * d; i++) b.raster[d].history_colour[i] = even | 3u << 30;
                assert_int_equal(carry(&b, &map, isa, FINE), WIDTH * HEIGHT);
                /* The coarse rasters' last rows and columns reach beyond the picture. */
                assert_true(carry(&b, &map, isa, ALL) <= usual);
                for (int y = 0; y < HEIGHT; y++)
                    for (int x = 0; x < WIDTH; x++) {
                        uint32_t c = b.raster[FV_FINE].colour[y * STRIDE + x];
                        if (!(c & FV_PIXEL_FILLED) && c != even) fail_msg("step %d: %08x at %d %d", s, c, x, y);
                    }
            }
    free_buffers(&b);
}

/* Half a turn, steps sideways and through the picture's plane, further than any picture, at all depths; maps
 * that are no maps. Where no history can be, all is filled. */
static void extreme_motion(void **state)
{
    (void)state;
    static const double steps[] = {0, 1e-12, 1e-4, 1, -1, 100, -1e6, 1e9, 1e30};
    static const float depths[] = {0, 1e-30f, 1e-6f, 1, 1e4f, 1e6f};
    static const double here[3] = {0, 0, 0};
    struct buffers b = make_buffers();
    FOR_EACH_ISA
    {
        for (unsigned s = 0; s < sizeof steps / sizeof *steps; s++)
            for (int axis = 0; axis < 3; axis++)
                for (int turn = 0; turn < 4; turn++)
                    for (unsigned d = 0; d < sizeof depths / sizeof *depths; d++) {
                        double to[3] = {0}, rotation[4];
                        to[axis] = steps[s];
                        fv_quat_from_yaw_pitch_roll(turn * M_PI / 2, 0, 0, rotation);
                        struct fv_map map = map_between(to, rotation, here, no_turn);
                        fill(&b, depths[d]);
                        for (int mode = 0; mode < MODES; mode++) {
                            int filled = carry(&b, &map, isa, mode);
                            if (turn == 2 && depths[d] * fabs(steps[s]) < 1e-3)
                                assert_int_equal(filled, of_raster(WIDTH, mode) * of_raster(HEIGHT, mode));
                        }
                    }
        static const float odd[] = {NAN, INFINITY, -INFINITY, 0, 1e38f, -1e38f, 1e-45f};
        for (int i = 0; i < 12; i++)
            for (int k = 0; k < 7; k++) {
                struct fv_map map = map_between(here, no_turn, here, no_turn);
                *(i < 9 ? &map.m[i / 3][i % 3] : &map.t[i - 9]) = odd[k];
                fill(&b, 0.5f);
                for (int mode = 0; mode < MODES; mode++) carry(&b, &map, isa, mode);
            }
    }
    free_buffers(&b);
}

static const uint32_t odd_bits[] = {0x7fc00000, 0xffc00000, 0x7f800001, 0x7f800000, 0xff800000,
                                    0x7f7fffff, 0xff7fffff, 0x00000001, 0x80000001, 0x80000000,
                                    0xbf800000, 0x4b18967f, 0xffffffff, 0xc2c80000,
                                    0xff00ff00, 0xfeffff00, 0xfffeff00, 0x0000ff00};
enum { ODD = sizeof odd_bits / sizeof *odd_bits };

enum what { NODE, PIXEL, SURFACE, WHATS };
static const char *const names[WHATS] = {"node", "pixel", "surface"};

/* One node's depth or surface, or one pixel's cache, of any bits: what lies around shows it in this frame at
 * most; the pixels out of its reach are as they would be without it. In the coarse raster too. */
static void check_odd_value(const struct buffers *b, const struct buffers *clean, int what, uint32_t bits, int mode,
                            const int at[2])
{
    int d = density_of(mode), width = of_raster(WIDTH, mode), height = of_raster(HEIGHT, mode);
    int reach = what == PIXEL ? 2 : (SPACING >> d) + 2;
    const struct pixels *is = &b->raster[d], *was = &clean->raster[d];
    for (int j = 0; j < height; j++)
        for (int i = 0; i < width; i++) {
            int n = j * of_raster(STRIDE, mode) + i;
            bool same = is->colour[n] == was->colour[n] && is->cache[n] == was->cache[n];
            bool far = abs(i - at[0]) > reach || abs(j - at[1]) > reach;
            if (far && !same)
                fail_msg("%s %08x at %d %d shows at %d %d, mode %d", names[what], bits, at[0], at[1], i, j, mode);
            /* A node of unknown depth costs its surroundings no history. */
            bool had = !(was->colour[n] & FV_PIXEL_FILLED) && !(mode == ALL && i == width - 1);
            float w = depth_in(is->cache[n]), usual = depth_in(was->cache[n]);
            if (what == NODE && had && !(fabsf(w - usual) <= 0.035f * usual))
                fail_msg("node %08x: depth %g at %d %d", bits, (double)w, i, j);
        }
}

static void one_odd_value(void **state)
{
    (void)state;
    static const int places[][2] = {{0, 0}, {5, 4}, {11, 9}, {3, 9}};
    static const double here[3] = {0, 0, 0}, there[3] = {0.011, -0.007, 0.02};
    struct buffers clean = make_buffers(), b = make_buffers();
    for (int round = 0; round < 2 * MODES; round++) FOR_EACH_ISA
        {
            int mode = round / 2, d = density_of(mode);
            struct fv_map map = map_between(round & 1 ? there : here, no_turn, here, no_turn);
            fill(&clean, 0.5f);
            int usual = carry(&clean, &map, isa, mode);
            for (int n = 0; n < WHATS * ODD * 4; n++) {
                int what = n / 4 % WHATS, k = n / 4 / WHATS, node = places[n % 4][1] * NODES + places[n % 4][0];
                int at[2] = {places[n % 4][0] * SPACING + SPACING / 2, places[n % 4][1] * SPACING + SPACING / 2};
                if (at[0] >= WIDTH) at[0] = WIDTH - 1;
                at[0] >>= d, at[1] >>= d;
                fill(&b, 0.5f);
                if (what == NODE) memcpy(&b.support_depth[node], &odd_bits[k], 4);
                if (what == PIXEL) b.raster[d].history_cache[at[1] * of_raster(STRIDE, mode) + at[0]] = odd_bits[k];
                if (what == SURFACE) b.support_surface[node] = (uint8_t)odd_bits[k];
                int filled = carry(&b, &map, isa, mode) - usual;
                /* At the picture's border, which the coarser rasters reach beyond, it may. */
                if (filled > (what == PIXEL || mode == ALL ? 4 : 0))
                    fail_msg("%s %08x at %d %d, mode %d: %d pixels without history", names[what], odd_bits[k], at[0], at[1], mode, filled);
                check_odd_value(&b, &clean, what, odd_bits[k], mode, at);
            }
        }
    free_buffers(&clean);
    free_buffers(&b);
}

/* Everything at once, at random. */
static void all_odd_values(void **state)
{
    (void)state;
    struct buffers b = make_buffers();
    uint32_t seed = 1;
    for (int round = 0; round < 40; round++) FOR_EACH_ISA
        {
            double at[3], rotation[4];
            for (int i = 0; i < 3; i++)
                at[i] = ((double)noise(seed++) / 2147483648.0 - 1) * pow(10, round % 8 - 4);
            fv_quat_from_yaw_pitch_roll(noise(seed) * 1e-9, noise(seed + 1) * 1e-9, 0, rotation);
            seed += 2;
            struct fv_map map = map_between(at, rotation, (double[3]){0, 0, 0}, no_turn);
            fill(&b, 0.5f);
            for (int d = 0; d < FV_DENSITIES; d++)
                for (uint32_t i = 0; i < (uint32_t)STRIDE * ROWS >> 2 * d; i++)
                    if (noise(++seed) % 3 == 0) b.raster[d].history_cache[i] = odd_bits[noise(seed) / 3 % ODD];
            for (uint32_t i = 0; i < NODES * NODES; i++) {
                if (noise(++seed) % 3 == 0) memcpy(&b.support_depth[i], &odd_bits[noise(seed) / 3 % ODD], 4);
                b.support_surface[i] = (uint8_t)noise(++seed);
            }
            for (int mode = 0; mode < MODES; mode++) carry(&b, &map, isa, mode);
        }
    free_buffers(&b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(equal_poses_copy), cmocka_unit_test(coarse_history_is_found),
                                       cmocka_unit_test(what_was_filled_is_asked_for),
                                       cmocka_unit_test(extreme_motion),
                                       cmocka_unit_test(one_odd_value), cmocka_unit_test(all_odd_values)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
