/* reproject: the reprojection kernel by itself, on histories, nodes and maps that hold anything: what it
 * writes is finite, what it reads lies in its buffers, and equal views give equal pictures. Every instruction
 * set that this machine has. */
#include "rt/pass/reproject.h"

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

/* Each buffer of its own and as long as a frame's is, so that the sanitizer sees every read beyond it. */
struct buffers {
    uint32_t *history_colour, *colour, *support_colour;
    float *history_depth, *depth, *support_depth;
};

static void *take(size_t bytes)
{
    void *p = calloc(1, bytes);
    if (!p) abort();
    return p;
}

static struct buffers make_buffers(void)
{
    size_t pixels = (size_t)STRIDE * ROWS * 4, nodes = (size_t)NODES * NODES * 4;
    return (struct buffers){.history_colour = take(pixels + 64),
                            .colour = take(pixels + 64),
                            .support_colour = take(nodes),
                            .history_depth = take(pixels + 64),
                            .depth = take(pixels + 64),
                            .support_depth = take(nodes)};
}

static void free_buffers(struct buffers *b)
{
    free(b->history_colour), free(b->colour), free(b->support_colour);
    free(b->history_depth), free(b->depth), free(b->support_depth);
}

static uint32_t noise(uint32_t i)
{
    i = (i ^ (i >> 16)) * 0x7feb352du;
    i = (i ^ (i >> 15)) * 0x846ca68bu;
    return i ^ (i >> 16);
}

/* A history of noise at inverse depth w, with nodes to match. */
static void fill(struct buffers *b, float w)
{
    for (uint32_t i = 0; i < STRIDE * ROWS; i++) {
        b->history_colour[i] = noise(i);
        b->history_depth[i] = w;
        b->colour[i] = 0x3fffffff;
        b->depth[i] = NAN;
    }
    for (uint32_t i = 0; i < NODES * NODES; i++) {
        b->support_colour[i] = noise(i + 77);
        b->support_depth[i] = w;
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

/* All tiles; returns how many pixels inside the picture found no history. */
static int carry(struct buffers *b, const struct fv_map *map, int isa)
{
    int filled = 0;
    for (int i = 0; i < TILES_X * TILES_Y; i++) {
        struct fv_reproject_tile t = {.map = *map,
                                      .x0 = i % TILES_X * FV_TILE,
                                      .y0 = i / TILES_X * FV_TILE,
                                      .width = WIDTH,
                                      .height = HEIGHT,
                                      .stride = STRIDE,
                                      .history_colour = b->history_colour,
                                      .history_depth = b->history_depth,
                                      .spacing = SPACING,
                                      .nodes_x = (WIDTH + SPACING - 1) / SPACING,
                                      .nodes_y = (HEIGHT + SPACING - 1) / SPACING,
                                      .support_stride = NODES,
                                      .support_colour = b->support_colour,
                                      .support_depth = b->support_depth,
                                      .epsilon = 0.03f,
                                      .colour = b->colour,
                                      .depth = b->depth};
        fv_kernels((enum fv_isa)isa)->reproject(&t);
    }
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            float w = b->depth[y * STRIDE + x];
            uint32_t c = b->colour[y * STRIDE + x];
            if (!(w == FV_DEPTH_UNKNOWN || (w >= 0 && w <= FV_INVERSE_DEPTH_MAX)))
                fail_msg("depth %g at %d %d", (double)w, x, y);
            assert_true(!(c & FV_PIXEL_SAMPLED));
            filled += (c & FV_PIXEL_FILLED) != 0;
        }
    return filled;
}

#define FOR_EACH_ISA for (int isa = 0; isa <= (int)fv_cpu_isa(); isa++)

/* The same pose twice, wherever it is: colours and depths to the bit, flags gone. */
static void equal_poses_copy(void **state)
{
    (void)state;
    static const float depths[] = {0, 1e-30f, 1e-6f, 1e-3f, 0.5f, 1, 100, 1e4f, 1e6f};
    struct buffers b = make_buffers();
    for (int p = 0; p < 5; p++)
        for (unsigned d = 0; d < sizeof depths / sizeof *depths; d++) FOR_EACH_ISA
            {
                double at[3] = {p * 1e5, -p * 17.3, p}, turn[4];
                fv_quat_from_yaw_pitch_roll(p * 1.1, p * 0.4, -p * 2.0, turn);
                struct fv_map map = map_between(at, turn, at, turn);
                fill(&b, depths[d]);
                assert_int_equal(carry(&b, &map, isa), 0);
                for (int y = 0; y < HEIGHT; y++)
                    for (int x = 0; x < WIDTH; x++) {
                        int i = y * STRIDE + x;
                        if (b.colour[i] != (b.history_colour[i] & 0x3fffffff))
                            fail_msg("pose %d, depth %g: %d %d: %08x from %08x", p, (double)depths[d], x, y,
                                     b.colour[i], b.history_colour[i]);
                        assert_true(fabsf(b.depth[i] - depths[d]) <= 1e-6f * depths[d]);
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
                        int filled = carry(&b, &map, isa);
                        if (turn == 2 && depths[d] * fabs(steps[s]) < 1e-3)
                            assert_int_equal(filled, WIDTH * HEIGHT);
                    }
        static const float odd[] = {NAN, INFINITY, -INFINITY, 0, 1e38f, -1e38f, 1e-45f};
        for (int i = 0; i < 12; i++)
            for (int k = 0; k < 7; k++) {
                struct fv_map map = map_between(here, no_turn, here, no_turn);
                *(i < 9 ? &map.m[i / 3][i % 3] : &map.t[i - 9]) = odd[k];
                fill(&b, 0.5f);
                carry(&b, &map, isa);
            }
    }
    free_buffers(&b);
}

static const uint32_t odd_bits[] = {0x7fc00000, 0xffc00000, 0x7f800001, 0x7f800000, 0xff800000,
                                    0x7f7fffff, 0xff7fffff, 0x00000001, 0x80000001, 0x80000000,
                                    0xbf800000, 0x4b18967f, 0xffffffff, 0xc2c80000};
enum { ODD = sizeof odd_bits / sizeof *odd_bits };

/* One node, or one pixel of history, of any bits: what lies around shows it in this frame at most; the pixels
 * out of its reach are as they would be without it. */
static void one_odd_value(void **state)
{
    (void)state;
    static const int places[][2] = {{0, 0}, {5, 4}, {11, 9}, {3, 9}};
    static const double here[3] = {0, 0, 0}, there[3] = {0.011, -0.007, 0.02};
    struct buffers clean = make_buffers(), b = make_buffers();
    FOR_EACH_ISA
    for (int moved = 0; moved < 2; moved++) {
        struct fv_map map = map_between(moved ? there : here, no_turn, here, no_turn);
        fill(&clean, 0.5f);
        int usual = carry(&clean, &map, isa);
        for (int what = 0; what < 2; what++)
            for (int k = 0; k < ODD; k++)
                for (int p = 0; p < 4; p++) {
                    int x = places[p][0] * SPACING + SPACING / 2, y = places[p][1] * SPACING + SPACING / 2;
                    if (x >= WIDTH) x = WIDTH - 1;
                    fill(&b, 0.5f);
                    float *at = what ? &b.history_depth[y * STRIDE + x]
                                     : &b.support_depth[places[p][1] * NODES + places[p][0]];
                    memcpy(at, &odd_bits[k], 4);
                    int reach = what ? 2 : SPACING + 2, filled = carry(&b, &map, isa) - usual;
                    if (filled > (what ? 4 : 0))
                        fail_msg("%s %08x: %d pixels without history", what ? "pixel" : "node", odd_bits[k],
                                 filled);
                    for (int j = 0; j < HEIGHT; j++)
                        for (int i = 0; i < WIDTH; i++) {
                            int n = j * STRIDE + i;
                            bool same = b.colour[n] == clean.colour[n] && b.depth[n] == clean.depth[n];
                            bool far = abs(i - x) > reach || abs(j - y) > reach;
                            if (far && !same)
                                fail_msg("%s %08x at %d %d shows at %d %d", what ? "pixel" : "node",
                                         odd_bits[k], x, y, i, j);
                            /* A node of unknown depth costs its surroundings no history. */
                            bool had = !(clean.colour[n] & FV_PIXEL_FILLED);
                            if (!what && had &&
                                !(fabsf(b.depth[n] - clean.depth[n]) <= 0.031f * clean.depth[n]))
                                fail_msg("node %08x: depth %g at %d %d", odd_bits[k], (double)b.depth[n], i,
                                         j);
                        }
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
            for (uint32_t i = 0; i < STRIDE * ROWS; i++)
                if (noise(++seed) % 3 == 0) memcpy(&b.history_depth[i], &odd_bits[noise(seed) / 3 % ODD], 4);
            for (uint32_t i = 0; i < NODES * NODES; i++)
                if (noise(++seed) % 3 == 0) memcpy(&b.support_depth[i], &odd_bits[noise(seed) / 3 % ODD], 4);
            carry(&b, &map, isa);
        }
    free_buffers(&b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(equal_poses_copy), cmocka_unit_test(extreme_motion),
                                       cmocka_unit_test(one_odd_value), cmocka_unit_test(all_odd_values)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
