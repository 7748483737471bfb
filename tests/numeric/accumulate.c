/* accumulate: light of paths over the frames (rt/pass/accumulate.h): the kernels of every instruction set over made-up frames:
 * noise falls by the square root of the frames and its mean stays, however skewed it is and however long it takes; light that
 * changes, surfaces that are uncovered, and views that turn; holes; counts that end; words that should not be there. And whole
 * frames: the first one, restarts, p of 1, light of 1e30. */
#include "rt/pass/accumulate.h"
#include "rt/pass/atrous.h"
#include "tests/support/random.h"
#include "tests/support/stage.h"

enum { WIDTH = 143, HEIGHT = 77, STRIDE = 160, ROWS = 96, PIXELS = STRIDE * ROWS, PADDED = PIXELS + 16 };

static _Alignas(64) uint32_t light[PADDED], facing[2][PADDED], track[2][PADDED], mean[2][PADDED], filtered[PADDED];
static _Alignas(64) float inverse_depth[PADDED];
static struct fv_view view, before;
static struct fv_map map[4];

static uint32_t facing_of(const double n[3])
{
    uint32_t word = 0;
    for (int i = 0; i < 3; i++) word |= (uint32_t)lround(511 * (n[i] + 1)) << 10 * i;
    return word;
}

static struct fv_view view_of(double yaw_deg, double x)
{
    struct fv_lens lens = {1, 1, 0.6, 0.6, WIDTH, HEIGHT};
    struct fv_pose pose = {.position_m = {x, 0, 0}};
    struct fv_view v;
    fv_quat_from_yaw_pitch_roll(yaw_deg * M_PI / 180, 0, 0, pose.rotation);
    fv_view_set(&v, &lens, &pose, (const double[3]){0, 0, -1});
    return v;
}

/* A wall 2 m ahead of the world's origin. */
static void show_wall(const struct fv_view *v, uint32_t *facing_out)
{
    static const double normal[3] = {0, 0, 1};
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            double ahead = -((double)v->corner[2] + (x + 0.5) * (double)v->dx[2] + (y + 0.5) * (double)v->dy[2]);
            inverse_depth[y * STRIDE + x] = (float)(ahead / (2 + (double)v->origin[2]));
            facing_out[y * STRIDE + x] = facing_of(normal);
        }
}

/* Where on it a pixel looks. */
static double wall_x(const struct fv_view *v, int x, int y)
{
    double t = 1 / (double)inverse_depth[y * STRIDE + x];
    return (double)v->origin[0] + t * ((double)v->corner[0] + (x + 0.5) * (double)v->dx[0] + (y + 0.5) * (double)v->dy[0]);
}

struct frames {
    const struct fv_kernels *kernels;
    int most, newest;
    uint32_t number;
    bool has_last, moves;
};

/* One frame: all tiles. */
static void accumulate(struct frames *f)
{
    int now = !f->newest;
    fv_map_set(&map[0], &view, &before);
    for (int y = 0; y < HEIGHT; y += FV_TILE)
        for (int x = 0; x < WIDTH; x += FV_TILE) {
            struct fv_accumulate a = {.x = x, .y = y, .columns = WIDTH - x < FV_TILE ? WIDTH - x : FV_TILE,
                                      .rows = HEIGHT - y < FV_TILE ? HEIGHT - y : FV_TILE, .width = WIDTH, .height = HEIGHT, .stride = STRIDE,
                                      .most = f->most, .seed = f->number, .moves = f->moves, .epsilon = 0.03f, .before = &before, .map = map,
                                      .light = light, .inverse_depth = inverse_depth, .facing = facing[now], .track = track[now],
                                      .mean = mean[now], .filtered = filtered};
            if (f->has_last) a.mean_before = mean[!now], a.track_before = track[!now], a.facing_before = facing[!now];
            f->kernels->accumulate(&a);
        }
    f->newest = now;
    f->has_last = true;
    f->number++;
    before = view;
}

static int frames_of(const struct frames *f, int x, int y)
{
    return (int)(track[f->newest][y * STRIDE + x] & FV_TRACK_FRAMES);
}

static double green(uint32_t word)
{
    float rgb[3];
    fv_light_unpack(word, rgb);
    return (double)rgb[1];
}

static struct frames begin(enum fv_isa isa, int most)
{
    view = before = view_of(0, 0);
    for (int i = 0; i < 2; i++) show_wall(&view, facing[i]);
    memset(track, 0, sizeof track);
    return (struct frames){.kernels = fv_kernels(isa), .most = most};
}

#define EACH_ISA(isa) for (enum fv_isa isa = FV_ISA_BASE; isa <= fv_cpu_isa(); isa++)

static void fill_light(double (*of)(uint64_t *), uint64_t *random)
{
    for (int i = 0; i < PIXELS; i++) {
        float l = (float)of(random);
        light[i] = fv_light_pack(0.5f * l, l, 2 * l);
    }
}

/* Over the pixels: the mean, and how far from `from`, RMS. */
static double mean_green(double from, double *off)
{
    double sum = 0, square = 0;
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            double l = green(filtered[y * STRIDE + x]);
            sum += l, square += (l - from) * (l - from);
        }
    *off = sqrt(square / (WIDTH * HEIGHT));
    return sum / (WIDTH * HEIGHT);
}

static double even_noise(uint64_t *random) { return random_between(random, 0.5, 1.5); }

static void noise_falls(void **state)
{
    (void)state;
    EACH_ISA(isa) {
        struct frames f = begin(isa, 255);
        uint64_t random = 7;
        double first = 0, off;
        for (int n = 1; n <= 64; n++) {
            fill_light(even_noise, &random);
            accumulate(&f);
            double of = mean_green(1, &off);
            if (n == 1) first = off;
            if (n & (n - 1)) continue;
            print_message("%s, %d frames: mean %.5f, off by %.5f, times the root %.4f\n", fv_cpu_isa_name(isa), n, of, off, off / first * sqrt(n));
            assert_true(fabs(off / first * sqrt(n) - 1) < 0.08 && fabs(of - 1) < 0.01);
        }
    }
}

/* One in a hundred is brighter by 0.2: with 255 frames behind it a step is less than half a unit of the format up, and a fiftieth
 * of that down. */
static double rare_noise(uint64_t *random)
{
    return random_bits(random) % 100 == 0 ? 1.2 : 1;
}

/* One in thirty is twenty times as bright. */
static double wild_noise(uint64_t *random)
{
    return random_bits(random) % 30 == 0 ? 2 : 0.1;
}

static void mean_stays(void **state)
{
    (void)state;
    static const struct {
        double (*of)(uint64_t *);
        double within;
    } rows[] = {{rare_noise, 4e-4}, {wild_noise, 5e-3}};
    EACH_ISA(isa) for (unsigned k = 0; k < 2; k++) {
        struct frames f = begin(isa, 255);
        uint64_t random = 99;
        double off, sum = 0, want = 0;
        for (int n = 0; n < 400; n++) {
            fill_light(rows[k].of, &random);
            for (int i = 0; i < STRIDE * HEIGHT; i++) want += i % STRIDE < WIDTH ? green(light[i]) / 400 / (WIDTH * HEIGHT) : 0;
            accumulate(&f);
            if (n >= 300) sum += mean_green(0, &off) / 100;
        }
        print_message("%s, noise %u: %.5f of %.5f, %+.2e\n", fv_cpu_isa_name(isa), k, sum, want, sum / want - 1);
        assert_true(fabs(sum / want - 1) < rows[k].within);
    }
}

/* The lower half of the wall comes nearer, in the frame in which light changes there. */
static void uncovered_starts_anew(void **state)
{
    (void)state;
    EACH_ISA(isa) {
        struct frames f = begin(isa, 32);
        uint64_t random = 3;
        for (int n = 0; n < 20; n++) fill_light(even_noise, &random), accumulate(&f);
        fill_light(even_noise, &random);
        for (int i = 40 * STRIDE; i < PIXELS; i++) inverse_depth[i] *= 1.1f;
        accumulate(&f);
        for (int y = 0; y < HEIGHT; y++)
            for (int x = 0; x < WIDTH; x++) {
                int i = y * STRIDE + x;
                if (y >= 40 && (filtered[i] != light[i] || frames_of(&f, x, y) != 1)) fail_msg("%d, %d: light of before", x, y);
                if (y < 38 && frames_of(&f, x, y) < 12) fail_msg("%d, %d: %d frames", x, y, frames_of(&f, x, y));
                assert_true(mean[f.newest][i] == filtered[i]);
            }
    }
}

/* Normals that turn by 60 degrees, and another object: nothing is taken over. */
static void others_start_anew(void **state)
{
    (void)state;
    static const double turned[3] = {0.866, 0, 0.5};
    EACH_ISA(isa) for (int other = 0; other < 2; other++) {
        struct frames f = begin(isa, 32);
        uint64_t random = 3;
        f.moves = other == 1;
        map[1] = map[0];
        for (int n = 0; n < 5; n++) {
            for (int i = 0; i < PIXELS && f.moves; i++) track[!f.newest][i] = n == 4 && i % STRIDE >= 64 ? 2u << 16 : 1u << 16;
            for (int i = 0; i < PIXELS && !f.moves; i++)
                if (n == 4 && i % STRIDE >= 64) facing[!f.newest][i] = facing_of(turned);
            fv_map_set(&map[1], &view, &before);
            map[2] = map[1];
            fill_light(even_noise, &random);
            accumulate(&f);
        }
        for (int y = 0; y < HEIGHT; y++)
            for (int x = 0; x < WIDTH; x++)
                if ((frames_of(&f, x, y) == 1) != (x >= 64)) fail_msg("%d, %d: %d frames", x, y, frames_of(&f, x, y));
    }
}

/* Stripes on the wall, a third of a metre wide each, while the head turns or goes aside: they stay where they are. */
static void views_turn(void **state)
{
    (void)state;
    EACH_ISA(isa) for (int aside = 0; aside < 2; aside++) {
        struct frames f = begin(isa, 64);
        uint64_t random = 5;
        double sum = 0, n = 0, lengths = 0;
        for (int k = 0; k < 30; k++) {
            view = aside ? view_of(0, 0.013 * k) : view_of(0.37 * k, 0);
            show_wall(&view, facing[!f.newest]);
            for (int y = 0; y < HEIGHT; y++)
                for (int x = 0; x < WIDTH; x++) {
                    float l = (float)((1 + 0.5 * sin(wall_x(&view, x, y) * 2 * M_PI / 0.6)) * random_between(&random, 0.5, 1.5));
                    light[y * STRIDE + x] = fv_light_pack(l, l, l);
                }
            accumulate(&f);
        }
        for (int y = 0; y < HEIGHT; y++)
            for (int x = 2; x < WIDTH - 40; x++, n++) {
                int at = aside ? x : x + 38; /* what turned in is not looked at */
                double want = 1 + 0.5 * sin(wall_x(&view, at, y) * 2 * M_PI / 0.6);
                sum += pow(green(filtered[y * STRIDE + at]) - want, 2);
                lengths += frames_of(&f, at, y);
            }
        print_message("%s, %s: off by %.4f after 30 frames (one: 0.30), %.1f of them count\n", fv_cpu_isa_name(isa),
                      aside ? "aside" : "turning", sqrt(sum / n), lengths / n);
        assert_true(sqrt(sum / n) < 0.09);
        assert_true(lengths / n > 20);
    }
}

/* Light that goes down to a fifth, everywhere or in a small square: how many frames until it is within a tenth of what changed. */
static void light_changes(void **state)
{
    (void)state;
    EACH_ISA(isa) for (int small = 0; small < 2; small++) {
        struct frames f = begin(isa, 64);
        uint64_t random = 11;
        int took = 0;
        for (int n = 0; n < 80; n++) {
            fill_light(even_noise, &random);
            for (int y = 0; y < HEIGHT && n >= 64; y++)
                for (int x = 0; x < WIDTH; x++)
                    if (!small || (abs(x - 70) < 8 && abs(y - 40) < 8)) {
                        float l = (float)(0.2 * green(light[y * STRIDE + x]));
                        light[y * STRIDE + x] = fv_light_pack(0.5f * l, l, 2 * l);
                    }
            accumulate(&f);
            double sum = 0, count = 0;
            for (int y = 33; y < 48; y++)
                for (int x = 63; x < 78; x++) sum += green(filtered[y * STRIDE + x]), count++;
            if (n >= 64 && sum / count > 0.28) took = n - 64 + 1;
        }
        print_message("%s, %s: %d frames behind\n", fv_cpu_isa_name(isa), small ? "a square" : "everywhere", took);
        assert_true(took <= (small ? 8 : 1));
    }
}

/* What has no light of its own keeps the mean; without that it stays empty; counts end; no history leaves everything. */
static void holes_and_ends(void **state)
{
    (void)state;
    EACH_ISA(isa) {
        struct frames f = begin(isa, 255);
        uint64_t random = 1;
        f.number = UINT32_MAX - 100;
        long lost = 0;
        for (int n = 0; n < 300; n++) {
            fill_light(even_noise, &random);
            for (int i = 0; i < PIXELS; i++)
                if ((i % 3 == 0 && n > 0) || i % STRIDE < 32) light[i] = FV_LIGHT_NONE;
            accumulate(&f);
            for (int y = 0; y < HEIGHT; y++)
                for (int x = 0; x < WIDTH; x++) {
                    int i = y * STRIDE + x;
                    if (n == 0 && filtered[i] != light[i]) fail_msg("first frame, %d, %d", x, y);
                    if (x < 32 && (filtered[i] != FV_LIGHT_NONE || track[f.newest][i])) fail_msg("%d, %d: light from nowhere", x, y);
                    lost += x >= 34 && filtered[i] == FV_LIGHT_NONE;
                }
        }
        print_message("%s: %ld times history was doubted where light of its own was missing\n", fv_cpu_isa_name(isa), lost);
        assert_true(lost < 840);
        f.most = 1;
        accumulate(&f);
        assert_true(frames_of(&f, 50, 40) <= 1);
    }
}

/* Any words, depths and maps: what leaves is light in range or none, and a track that says how old. */
static void anything(void **state)
{
    (void)state;
    static const float depths[] = {NAN, INFINITY, -1, 0, 1e9f, 1e-9f, 1e-38f};
    EACH_ISA(isa) {
        uint64_t random = 17;
        struct frames f = begin(isa, 31);
        f.moves = true;
        for (int n = 0; n < 60; n++) {
            for (int i = 0; i < PIXELS; i++) {
                light[i] = (uint32_t)random_bits(&random);
                if (i % 7 == 0) light[i] = FV_LIGHT_NONE;
                if (i % 5 == 0) light[i] = fv_light_pack(1e30f, NAN, INFINITY);
                facing[!f.newest][i] = (uint32_t)random_bits(&random);
                track[!f.newest][i] = (uint32_t)random_bits(&random) & ~(28u << 16);
                if (n % 2) track[f.newest][i] = (uint32_t)random_bits(&random);
                inverse_depth[i] = i % 3 ? 0.5f : depths[random_bits(&random) % 7];
            }
            view = view_of(random_between(&random, -180, 180), random_between(&random, -1e6, 1e6));
            for (int o = 1; o < 4; o++)
                for (int k = 0; k < 12; k++) ((float *)&map[o])[k] = (float)random_between(&random, -1e4, 1e4);
            accumulate(&f);
            for (int y = 0; y < HEIGHT; y++)
                for (int x = 0; x < WIDTH; x++) {
                    int i = y * STRIDE + x;
                    assert_true(green(filtered[i]) >= 0 && green(filtered[i]) <= 1.01 * (double)FV_LIGHT_MAX);
                    assert_true(frames_of(&f, x, y) <= 31);
                    assert_true((frames_of(&f, x, y) > 0) == (filtered[i] != FV_LIGHT_NONE));
                    if (!(inverse_depth[i] > 0)) assert_true(filtered[i] == FV_LIGHT_NONE);
                }
        }
    }
}

/* ---- whole frames ---- */

static struct stage with, without;
static const char *const usual[] = {"scene.name=cornell", "method.name=denoise", "denoise.history=32", "denoise.deviations=0", NULL};

static bool same_picture(const struct stage *a, const struct stage *b)
{
    bool same = true;
    for (int y = 0; y < 96; y++) same &= memcmp(stage_row(a, y), stage_row(b, y), 96 * 4) == 0;
    return same;
}

static void first_frames(void **state)
{
    (void)state;
    stage_begin(&with, 96, usual, NULL, stage_workers());
    stage_set(&without, 96, usual, (const char *const[]){"denoise.history=0", NULL});
    stage_share(&without, &with, stage_workers());
    assert_null(without.loop.frame.buffer[FV_HISTORY_MEAN][0]);
    stage_frame(&with, 0, 0, 0);
    stage_frame(&without, 0, 0, 0);
    assert_true(same_picture(&with, &without));
    stage_frame(&with, 1, 0, 0);
    stage_frame(&without, 1, 0, 0);
    assert_false(same_picture(&with, &without));
    fv_loop_restart(&with.loop);
    fv_loop_restart(&without.loop);
    stage_frame(&with, 2, 0, 0);
    stage_frame(&without, 2, 0, 0);
    assert_true(same_picture(&with, &without));
    /* Off and on again while it runs. */
    for (int n = 3; n < 5; n++) {
        with.config.denoise_history = n == 3 ? 0 : 32;
        fv_loop_settings(&with.loop);
        stage_frame(&with, n, 0, 0), stage_frame(&without, n, 0, 0);
        assert_true(same_picture(&with, &without));
    }
    stage_close(&with);
}

/* Light of a still view gets stiller. */
static void frames_settle(void **state)
{
    (void)state;
    static double last[96][96];
    long first = 0, later = 0;
    stage_begin(&with, 96, usual, NULL, stage_workers());
    for (int n = 0; n < 40; n++) {
        long changes = 0;
        stage_frame(&with, 0, 0, 0);
        const uint32_t *of = with.loop.frame.buffer[FV_LIGHT][0];
        int64_t stride = with.loop.frame.stride;
        for (int y = 0; y < 96; y++)
            for (int x = 0; x < 96; x++) changes += lround(1e3 * fabs(green(of[y * stride + x]) - last[y][x])), last[y][x] = green(of[y * stride + x]);
        *(n == 1 ? &first : &later) = changes;
    }
    print_message("changes from frame to frame: %ld, after 40: %ld\n", first, later);
    assert_true(later * 8 < first);
    stage_close(&with);
}

static void odd_frames(void **state)
{
    (void)state;
    static const char *const all_out[] = {"denoise.p=1", "fovea.inner_deg=5", "fovea.outer_deg=5", NULL};
    stage_begin(&with, 96, usual, all_out, stage_workers());
    for (int n = 0; n < 6; n++) stage_frame(&with, 3 * n, n < 3 ? 20 : -20, 0);
    for (int i = 0; i < with.scene.lights; i++) with.scene.light[i].colour[1] = i % 2 ? 1e30f : NAN;
    for (int n = 0; n < 4; n++) stage_frame(&with, 3 * n, 0, 0);
    const uint32_t *of = with.loop.frame.buffer[FV_HISTORY_MEAN][0];
    for (int64_t i = 0; i < 96 * with.loop.frame.stride; i++) assert_true(of[i] == FV_LIGHT_NONE || green(of[i]) <= (double)FV_LIGHT_MAX);
    stage_close(&with);
}

/* Every second block of the outer layer takes paths, the others in the next frame, once there is history; the rays say so. */
static void outer_pixels_take_turns(void **state)
{
    (void)state;
    static const char *const turns[] = {"denoise.rate=2", "denoise.deviations=10", "denoise.inner_px=10", "denoise.outer_px=20", "denoise.spp=1 1 1", NULL};
    int64_t rays[4];
    stage_begin(&with, 96, usual, turns, stage_workers());
    for (int n = 0; n < 4; n++) {
        stage_frame(&with, 0, 0, 0);
        rays[n] = with.record.rays[FV_RAY_SECONDARY];
        const struct fv_frame *f = &with.loop.frame;
        const uint32_t *of = f->buffer[FV_LIGHT][0];
        for (int y = 0; y < 96; y++)
            for (int x = 0; x < 96; x++) {
                int64_t at = y * f->stride + x, due = (x / 4 + y / 4 + n) % 2 == 0 || n == 0 || (x - 48) * (x - 48) + (y - 48) * (y - 48) < 19 * 19;
                if (!(((const float *)f->buffer[FV_DEPTH][0])[at] > 0)) continue;
                if (of[at] == FV_LIGHT_NONE) fail_msg("%d, %d: no light in frame %d", x, y, n);
                bool sampled = stage_row(&with, y)[x] & FV_PIXEL_SAMPLED;
                if (due && !sampled) fail_msg("%d, %d: left out in frame %d", x, y, n);
                if (!due && sampled && (x - 48) * (x - 48) + (y - 48) * (y - 48) > 22 * 22) fail_msg("%d, %d: sampled in frame %d", x, y, n);
            }
    }
    for (int n = 1; n < 4; n++) assert_true((double)rays[n] > 0.5 * (double)rays[0] && (double)rays[n] < 0.65 * (double)rays[0]);
    stage_close(&with);
}

/* By how much the filter changes light. */
static double filtered_by(const struct stage *s)
{
    const struct fv_frame *f = &s->loop.frame;
    const uint32_t *from = f->buffer[FV_MEAN][0], *to = f->buffer[FV_LIGHT][0];
    double sum = 0;
    for (int y = 0; y < 96; y++)
        for (int x = 0; x < 96; x++) sum += fabs(green(to[y * f->stride + x]) - green(from[y * f->stride + x])) / 96 / 96;
    return sum;
}

/* The longer history is, the less is left to smooth: after many frames the filter leaves most as it is. */
static void filter_is_guided(void **state)
{
    (void)state;
    double first = 0, last = 0;
    stage_begin(&with, 96, usual, (const char *const[]){"denoise.deviations=10", NULL}, stage_workers());
    for (int n = 0; n < 32; n++) {
        stage_frame(&with, 0, 0, 0);
        last = filtered_by(&with);
        if (n == 0) first = last;
    }
    print_message("light is changed by %.4f in the first frame, by %.4f in the last\n", first, last);
    assert_true(first > 0 && last < 0.7 * first);
    stage_close(&with);
}

static void moving_lights_keep_it_short(void **state)
{
    (void)state;
    stage_begin(&with, 96, usual, (const char *const[]){"scene.moving=light 1 1 1 at -0.3 1.5 0.4 0 at 0.3 1.5 0.4 0 in 1", NULL}, stage_workers());
    for (int n = 0; n < 9; n++) stage_frame(&with, 0, 0, n * 10000000);
    const uint32_t *of = with.loop.frame.buffer[FV_TRACK][0];
    for (int64_t i = 0; i < 96 * with.loop.frame.stride; i++) assert_true((of[i] & FV_TRACK_FRAMES) <= FV_ACCUMULATE_MOVED);
    stage_close(&with);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(noise_falls), cmocka_unit_test(mean_stays), cmocka_unit_test(uncovered_starts_anew),
                                       cmocka_unit_test(others_start_anew), cmocka_unit_test(views_turn), cmocka_unit_test(light_changes),
                                       cmocka_unit_test(holes_and_ends), cmocka_unit_test(anything), cmocka_unit_test(first_frames),
                                       cmocka_unit_test(frames_settle), cmocka_unit_test(odd_frames),
                                       cmocka_unit_test(outer_pixels_take_turns), cmocka_unit_test(filter_is_guided), cmocka_unit_test(moving_lights_keep_it_short)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
