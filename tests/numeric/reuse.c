/* reuse: which pixels take the last frame's colours: every condition alone, on every instruction set; and whole frames:
 * none in the first, none where it is off, chains that end, turns that are even, light that changes. */
#include "rt/pass/reuse.h"
#include "rt/pass/cache.h"
#include "rt/pass/selective.h"
#include "tests/support/small_scene.h"
#include "tests/support/stage.h"

enum { WIDTH = 80, HEIGHT = 24, STRIDE = 96, PIXELS = STRIDE * HEIGHT, PADDED = PIXELS + 64, STAMP = 12, NORMAL = 511 | 511 << 10 | 1022 << 20 };

/* What the kernel reads. */
static struct input {
    _Alignas(64) uint32_t colour[PADDED], cache[PADDED], now[5][PADDED];
    _Alignas(64) uint32_t last_colour[PADDED], last_cache[PADDED], last[5][PADDED];
    uint8_t chain[PADDED];
    _Alignas(64) float tolerance[STRIDE];
    struct fv_selective settings;
    struct fv_map map;
    uint32_t due;
    float together;
    bool second;
} in;

enum { BASE, IDENTITY, FACING, SECOND_IDENTITY, SECOND_FACING };

static uint32_t word_of(double w, int surface)
{
    return cache_of_sample((float)w, surface);
}

/* All that is needed for reuse, with a move of whole pixels: (3, 2). */
static void make_up(void)
{
    static const float thresholds[FV_TAUS] = {0.05f, 0.06f, 0.06f, 0.02f, 0.02f, 0.02f, 0.06f, 0.02f, 0.04f};
    memset(&in, 0, sizeof in);
    for (int i = 0; i < PADDED; i++) {
        in.colour[i] = 77 | 1u << 30, in.last_colour[i] = (uint32_t)(100 + i % STRIDE * 8) | 300 << 10 | 200 << 20;
        in.cache[i] = in.last_cache[i] = word_of(0.25, 0);
        in.now[BASE][i] = in.last[BASE][i] = 500 | 400 << 10 | 300 << 20;
        in.now[IDENTITY][i] = 5 | 2 << FV_IDENTITY_SHADOWS_SHIFT | (uint32_t)STAMP << FV_IDENTITY_STAMP_SHIFT;
        in.last[IDENTITY][i] = 5 | 2 << FV_IDENTITY_SHADOWS_SHIFT | (uint32_t)(STAMP - 1) << FV_IDENTITY_STAMP_SHIFT;
        in.now[FACING][i] = in.last[FACING][i] = in.now[SECOND_FACING][i] = in.last[SECOND_FACING][i] = NORMAL;
        in.now[SECOND_IDENTITY][i] = in.last[SECOND_IDENTITY][i] = 9;
    }
    for (int i = 0; i < STRIDE; i++) in.tolerance[i] = 1;
    memcpy(in.settings.threshold, thresholds, sizeof thresholds);
    in.settings.facing_limit = (float)(10 + 6 * cos(8 * M_PI / 180));
    in.settings.reuse_max = 5;
    in.map = (struct fv_map){.m = {{1, 0, 3}, {0, 1, 2}, {0, 0, 1}}};
    in.together = 1;
}

enum { X = 40, Y = 10, AT = Y * STRIDE + X, THERE = (Y + 2) * STRIDE + X + 3 };

struct answer {
    bool reused, central;
    int chain;
    uint32_t colour;
};

static struct answer ask(int isa)
{
    static _Alignas(64) uint32_t colour[PADDED];
    _Alignas(64) int32_t chain[STRIDE];
    const int row = Y * STRIDE;
    memcpy(colour, in.colour, sizeof colour);
    struct fv_reuse r = {.row = {.count = 32, .x = 32, .y = Y, .width = WIDTH, .height = HEIGHT, .stride = STRIDE, .colour = in.colour + row + 32,
                                 .cache = in.cache + row + 32, .stamp = STAMP},
                         .last = {.width = WIDTH, .height = HEIGHT, .stride = STRIDE, .epsilon = 0.03f, .together = in.together,
                                  .colour = in.last_colour, .cache = in.last_cache, .map = &in.map},
                         .now = {in.now[BASE] + row + 32, in.now[IDENTITY] + row + 32, in.now[FACING] + row + 32, NULL, NULL},
                         .before = {in.last[BASE], in.last[IDENTITY], in.last[FACING], NULL, NULL},
                         .stamp_before = STAMP - 1, .chain_before = in.chain, .tolerance = in.tolerance, .settings = &in.settings,
                         .due = in.due, .colour = colour + row + 32, .chain = chain};
    if (in.second) {
        r.now.second_identity = in.now[SECOND_IDENTITY] + row + 32, r.now.second_facing = in.now[SECOND_FACING] + row + 32;
        r.before.second_identity = in.last[SECOND_IDENTITY], r.before.second_facing = in.last[SECOND_FACING];
    }
    fv_kernels((enum fv_isa)isa)->reuse(&r);
    return (struct answer){r.reused >> (X - 32) & 1, r.central >> (X - 32) & 1, chain[X - 32], colour[AT]};
}

/* Things that bar reuse, one at a time. */
static void set_none(void) {}
static void set_due(void) { in.due = 1u << (X - 32); }
static void set_chain(void) { in.chain[THERE] = 5; }
static void set_no_chain(void) { in.chain[THERE] = FV_CHAIN_NONE; }
static void set_sky(void) { in.now[IDENTITY][AT] &= ~0xffffu; }
static void set_sky_before(void) { in.last[IDENTITY][THERE] &= ~0xffffu; }
static void set_old(void) { in.last[IDENTITY][THERE] += 1u << FV_IDENTITY_STAMP_SHIFT; }
static void set_unknown(void) { in.cache[AT] = FV_CACHE_NONE; }
static void set_far(void) { for (int i = 0; i < 4; i++) in.last_cache[THERE - 1 + i % 2 - STRIDE * (i / 2)] = in.last_cache[THERE] = word_of(0.3, 0); }
static void set_unknown_before(void) { in.last_cache[THERE] = FV_CACHE_NONE; }
static void set_kept(void) { in.last_cache[THERE] |= 3; }
static void set_filled(void) { in.last_cache[THERE] &= ~0xff00u; }
static void set_colour(void) { in.now[BASE][AT] = 560 | 400 << 10 | 300 << 20; }
static void set_object(void) { in.last[IDENTITY][THERE] ^= 3; in.now[BASE][AT] = 500 | 455 << 10 | 300 << 20; }
static void set_silhouette(void) { in.cache[AT + 1] = word_of(0.5, 0); }
static void set_body(void) { in.cache[AT - STRIDE] |= FV_CACHE_MOVING; }
static void set_body_before(void) { in.last_cache[THERE] |= FV_CACHE_MOVING; }
static void set_second_object(void) { in.second = true; in.last[SECOND_IDENTITY][THERE] = 8; }
static void set_second_gone(void) { in.second = true; in.last[SECOND_IDENTITY][THERE] = 0; }
static void set_second_facing(void) { in.second = true; in.last[SECOND_FACING][THERE] = 1022 | 511 << 10 | 511 << 20; }
static void set_behind(void) { in.map.m[2][2] = -1; }
static void set_outside(void) { in.map.m[0][2] = -60; }
static void set_nowhere(void) { in.map.m[0][2] = NAN; }
/* What does not. */
static void set_last_chain(void) { in.chain[THERE] = 4; }
static void set_shade(void) { in.now[BASE][AT] = 530 | 410 << 10 | 320 << 20; }
static void set_object_alike(void) { in.last[IDENTITY][THERE] ^= 3; in.now[BASE][AT] = 500 | 420 << 10 | 300 << 20; }
static void set_turned_alike(void) { in.last[FACING][THERE] = 1022 | 511 << 10 | 511 << 20; }
static void set_second(void) { in.second = true; }
static void set_slope(void) { in.cache[AT + 1] = word_of(0.26, 0); }
static void set_bodies(void) { in.together = 0; }

static void each_condition(void **state)
{
    (void)state;
    static const struct {
        const char *what;
        void (*set)(void);
        bool reused;
        int chain;
    } rows[] = {{"as it should be", set_none, true, 1}, {"its turn to be sampled", set_due, false, 0}, {"a chain that is full", set_chain, false, 0},
                {"nothing to reuse", set_no_chain, false, 0}, {"sky", set_sky, false, 0}, {"sky before", set_sky_before, false, 0},
                {"attributes of another frame", set_old, false, 0}, {"an unknown depth", set_unknown, false, 0}, {"another distance", set_far, false, 0},
                {"an unknown depth before", set_unknown_before, false, 0}, {"not sampled before", set_kept, false, 0}, {"filled before", set_filled, false, 0},
                {"another colour", set_colour, false, 0}, {"another object of another colour", set_object, false, 0}, {"a silhouette that moved", set_silhouette, false, 0},
                {"something moving beside it", set_body, false, 0}, {"something moving before", set_body_before, false, 0},
                {"another object in the mirror", set_second_object, false, 0}, {"a mirror where there was none", set_second_gone, false, 0},
                {"another side of it in the mirror", set_second_facing, false, 0}, {"behind the eye", set_behind, false, 0}, {"outside", set_outside, false, 0},
                {"nowhere", set_nowhere, false, 0}, {"a chain that goes on", set_last_chain, true, 5}, {"nearly the same colour", set_shade, true, 1},
                {"another object of nearly the same colour", set_object_alike, true, 1}, {"turned, of the same colour", set_turned_alike, true, 1},
                {"the same in the mirror", set_second, true, 1}, {"a slope", set_slope, true, 1}, {"a plane, whatever the head did", set_bodies, true, 1}};
    for (int isa = 0; isa <= (int)fv_cpu_isa(); isa++)
        for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
            make_up();
            rows[i].set();
            struct answer a = ask(isa);
            if (a.reused != rows[i].reused || a.chain != rows[i].chain || !a.central) fail_msg("isa %d, %s: %d, chain %d", isa, rows[i].what, a.reused, a.chain);
            if (a.reused && stage_step(a.colour, in.last_colour[THERE]) > 1) fail_msg("isa %d, %s: %08x", isa, rows[i].what, a.colour);
            if (!a.reused) assert_int_equal(a.colour, in.colour[AT]);
            assert_int_equal(a.colour >> 30, 1);
        }
    for (int isa = 0; isa <= (int)fv_cpu_isa(); isa++) {
        make_up();
        in.tolerance[X - 32] = -1;
        struct answer a = ask(isa);
        assert_false(a.reused || a.central);
        assert_int_equal(a.chain, FV_CHAIN_NONE);
        make_up();
        in.now[IDENTITY][AT] ^= 1u << FV_IDENTITY_STAMP_SHIFT;
        a = ask(isa);
        assert_false(a.reused || a.central);
        assert_int_equal(a.chain, FV_CHAIN_NONE);
    }
}

/* A place between pixels takes a colour between theirs. */
static void between_pixels(void **state)
{
    (void)state;
    for (int isa = 0; isa <= (int)fv_cpu_isa(); isa++) {
        make_up();
        in.map.m[0][2] = 3.25f;
        struct answer a = ask(isa);
        assert_true(a.reused);
        assert_true(abs((int)(a.colour & 1023) - (100 + (X + 3) * 8 + 2)) <= 1);
    }
}

static struct stage plain, reused;
/* Columns has no light that is sampled at random. */
static const char *const base[] = {"scene.name=columns", "method.name=selective", "selective.periphery=every", "selective.samples=4 4 4 4",
                                   "selective.shape=1 2 0.5 4", NULL};
static const char *const on[] = {"selective.reuse=2", "selective.reuse_max=4", NULL};

static void open_stages(const char *const *more)
{
    stage_begin(&plain, 200, base, NULL, stage_workers());
    stage_set(&reused, 200, base, more);
    stage_share(&reused, &plain, stage_workers());
}

static bool same(void)
{
    for (int y = 0; y < 200; y++)
        if (memcmp(stage_row(&plain, y), stage_row(&reused, y), 200 * sizeof(uint32_t)) != 0) return false;
    return true;
}

static int64_t rays(const struct stage *s)
{
    return s->record.rays[FV_RAY_PRIMARY];
}

/* Chains end; blocks take turns, so that frames are alike; the first frame, and those after a restart, reuse nothing. */
static void frames_of_a_still_view(void **state)
{
    (void)state;
    static uint8_t run[200 * 200];
    double most = 0, sum = 0, before = 0;
    open_stages(on);
    memset(run, 0, sizeof run);
    for (int i = 0; i < 24; i++) {
        stage_frame(&plain, 0, 0, 0);
        stage_frame(&reused, 0, 0, 0);
        const struct fv_frame *f = &reused.loop.frame;
        const uint8_t *chain = f->buffer[FV_CHAIN][0];
        const uint32_t *taken = f->buffer[FV_REUSED][0];
        for (int y = 0; y < 200; y++)
            for (int x = 0; x < 200; x++) {
                bool is = taken[(y / FV_TILE * f->tiles_x + x / FV_TILE) * FV_TILE + y % FV_TILE] >> x % FV_TILE & 1;
                run[y * 200 + x] = (uint8_t)(is ? run[y * 200 + x] + 1 : 0);
                assert_true(run[y * 200 + x] <= 4);
                if (is) assert_int_equal(chain[y * f->stride + x], run[y * 200 + x]);
            }
        if (i == 0) {
            assert_true(same() && f->reused_share == 0);
            continue;
        }
        assert_true(rays(&reused) < rays(&plain));
        if (i < 6) continue;
        double extra = (double)(rays(&reused) - 200 * 200);
        most = fmax(most, extra), sum += extra, before += (double)(rays(&plain) - 200 * 200);
        if (i == 23) print_message("still view: %.3f reused, %.3f of the extra samples, PSNR %.1f dB\n", (double)f->reused_share, sum / before, stage_psnr(&plain, &reused, 0, 90));
    }
    assert_true(sum < 0.4 * before);
    assert_true(most < 1.6 * sum / 18);
    assert_true(stage_psnr(&plain, &reused, 0, 90) > 35);
    fv_loop_restart(&reused.loop);
    fv_loop_restart(&plain.loop);
    stage_frame(&plain, 0, 0, 0);
    stage_frame(&reused, 0, 0, 0);
    assert_true(same());
    stage_close(&plain);
}

/* Where it is off nothing of it is there; where it is on, and its factor next to nothing, little is reused. */
static void off(void **state)
{
    (void)state;
    open_stages(NULL);
    for (int i = 0; i < plain.plan.passes; i++) assert_string_not_equal(plain.plan.pass[i]->name, "reuse");
    assert_null(plain.loop.frame.buffer[FV_CHAIN][0]);
    assert_null(plain.loop.frame.buffer[FV_HISTORY_BASE][0]);
    assert_null(plain.loop.frame.buffer[FV_HISTORY_COLOUR][0]);
    for (int i = 0; i < 3; i++) {
        stage_frame(&plain, i, 0, 0);
        stage_frame(&reused, i, 0, 0);
        assert_true(same());
        assert_true(reused.loop.frame.reused_share == 0);
    }
    stage_close(&plain);
}

/* A head that turns slowly, then jumps. */
static void heads_that_turn(void **state)
{
    (void)state;
    static const char *const sparse[] = {"selective.reuse=1", "selective.periphery=sparse", NULL};
    open_stages(sparse);
    for (int i = 0; i < 8; i++) {
        stage_frame(&plain, 0.1 * i, 0.2 * i, 0);
        stage_frame(&reused, 0.1 * i, 0.2 * i, 0);
    }
    print_message("turning head: %.3f reused, rays %.3f, PSNR %.1f dB\n", (double)reused.loop.frame.reused_share,
                  (double)rays(&reused) / (double)rays(&plain), stage_psnr(&plain, &reused, 0, 28));
    assert_true(reused.loop.frame.reused_share > 0.3f);
    assert_true(reused.loop.frame.spared_share > 0.2f);
    assert_true(stage_psnr(&plain, &reused, 0, 28) > 33);
    stage_frame(&reused, 170, 0, 0);
    assert_true(reused.loop.frame.reused_share < 0.01f);
    stage_close(&plain);
}

/* Lights that go on moving, then stand elsewhere at once. */
static void light_that_changes(void **state)
{
    (void)state;
    static const char *const little[] = {"selective.reuse=0.1", NULL};
    open_stages(little);
    assert_true(plain.scene.lights > 1);
    for (int i = 0; i < 12; i++) {
        int64_t t_ns = (int64_t)i * 20000000 + (i < 10 ? 0 : (int64_t)(i - 9) * 2000000000);
        stage_frame(&plain, 0, 0, t_ns);
        stage_frame(&reused, 0, 0, t_ns);
        double psnr = stage_psnr(&plain, &reused, 0, 90);
        print_message("lights, frame %d: %.3f reused, PSNR %.1f dB\n", i, (double)reused.loop.frame.reused_share, psnr);
        assert_true(psnr > (i < 10 ? 38 : 33));
    }
    stage_close(&plain);
}

/* A frame whose refinement was cut has nothing that is worth being reused. */
static int cut_tile(struct fv_frame *f, const struct fv_tile *tile)
{
    fv_pass_refine.stand_in(f, tile);
    return 0;
}

static void frames_that_were_cut(void **state)
{
    (void)state;
    struct fv_pass cut = fv_pass_refine;
    cut.run = cut_tile;
    open_stages(on);
    for (int i = 0; i < 5; i++) {
        reused.plan.pass[2] = i == 3 ? &cut : &fv_pass_refine;
        stage_frame(&plain, 0, 0, 0);
        stage_frame(&reused, 0, 0, 0);
        if (i == 2) assert_true(reused.loop.frame.reused_share > 0.3f);
    }
    assert_true(reused.loop.frame.reused_share == 0);
    assert_true(same());
    stage_close(&plain);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(each_condition), cmocka_unit_test(between_pixels), cmocka_unit_test(frames_of_a_still_view),
                                       cmocka_unit_test(off), cmocka_unit_test(heads_that_turn), cmocka_unit_test(light_that_changes),
                                       cmocka_unit_test(frames_that_were_cut)};
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
