/* schedule: which tiles are worked at, in which order and until when: on a made-up clock with one worker,
 * and on real threads, where what was done must still be the first tiles of the order. */
#include "rt/frame/schedule.h"
#include "platform/arena.h"
#include "platform/threads.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { WIDTH = 590, HEIGHT = 700, TILES_MAX = 2 * 19 * 22 };

static struct {
    struct fv_frame frame;
    struct fv_schedule schedule;
    struct fv_workers workers;
    uint64_t selected[TILES_MAX];
    struct fv_worker_scratch scratch[4];
    /* What the passes below did. */
    atomic_int ran[TILES_MAX], stood_in[TILES_MAX], sequence;
    int order[TILES_MAX]; /* of those that ran */
    int64_t now_ns, tile_ns, stand_in_ns;
} rig;

static int64_t made_up_ns(void *context)
{
    (void)context;
    return rig.now_ns;
}

static void no_sleep(void *context, int64_t t_ns)
{
    (void)context;
    rig.now_ns = t_ns;
}

static const struct fv_clock made_up = {made_up_ns, made_up_ns, no_sleep, NULL};

static int run(struct fv_frame *f, const struct fv_tile *tile)
{
    (void)f;
    rig.ran[tile->index]++;
    rig.order[rig.sequence++] = tile->index;
    if (rig.tile_ns) rig.now_ns += rig.tile_ns;
    return 64;
}

static void stand_in(struct fv_frame *f, const struct fv_tile *tile)
{
    (void)f;
    rig.stood_in[tile->index]++;
    if (rig.tile_ns) rig.now_ns += rig.stand_in_ns;
}

static const struct fv_pass by_gaze = {.name = "by gaze", .run = run, .stand_in = stand_in};
static const struct fv_pass by_need = {
    .name = "by need", .order = FV_ORDER_NEED, .run = run, .stand_in = stand_in};
static const struct fv_pass whole = {.name = "whole", .run = run};

static void look(double gaze_x, double gaze_y)
{
    static const struct fv_pose ahead = {.rotation = {1, 0, 0, 0}};
    const struct fv_lens lens = {1.06, 1.09, 1.33, 1.33, WIDTH, HEIGHT};
    const double gaze[3] = {gaze_x, gaze_y, -1};
    for (int e = 0; e < 2; e++) fv_view_set(&rig.frame.view[e], &lens, &ahead, gaze);
    fv_schedule_look(&rig.schedule, &rig.frame);
}

static void open_rig(int workers, const struct fv_clock *clock)
{
    struct fv_frame *f = &rig.frame;
    memset(&rig, 0, sizeof rig);
    *f = (struct fv_frame){.eyes = 2,
                           .width = WIDTH,
                           .height = HEIGHT,
                           .tiles_x = (WIDTH + FV_TILE - 1) / FV_TILE,
                           .tiles_y = (HEIGHT + FV_TILE - 1) / FV_TILE,
                           .has_history = true,
                           .scratch = rig.scratch};
    f->tiles = 2 * f->tiles_x * f->tiles_y;
    f->parameters.foveal = (struct fv_foveal){10, 20, 0.05f};
    f->buffer[FV_SELECTED][0] = rig.selected;
    for (int t = 0; t < f->tiles; t++) rig.selected[t] = 0xff;
    fv_workers_start(&rig.workers, workers);
    fv_schedule_take(&rig.schedule, f, &rig.workers, clock, NULL);
    look(0.1, -0.2);
}

static void close_rig(void)
{
    fv_workers_stop(&rig.workers);
}

static struct fv_stage_result stage(const struct fv_pass *pass, const struct fv_stage_limit *limit)
{
    struct fv_stage_result r;
    for (int t = 0; t < TILES_MAX; t++) rig.ran[t] = rig.stood_in[t] = 0;
    rig.sequence = 0;
    fv_schedule_run(&rig.schedule, &rig.frame, pass, limit, &r);
    return r;
}

/* Every tile of the order once; those done are its first. */
static void check_first_ones(const uint32_t *order, int tiles, const struct fv_stage_result *r)
{
    assert_int_equal(r->done + r->cut, tiles);
    for (int i = 0; i < tiles; i++) {
        assert_int_equal(rig.ran[order[i]], i < r->done);
        assert_int_equal(rig.stood_in[order[i]], i >= r->done);
    }
}

static void orders(void **state)
{
    (void)state;
    const struct fv_stage_limit none = {.done = -1};
    open_rig(1, &made_up);
    /* Row by row where none may be left out. */
    struct fv_stage_result r = stage(&by_gaze, &none);
    assert_int_equal(r.done, rig.frame.tiles);
    for (int i = 0; i < rig.frame.tiles; i++) assert_int_equal(rig.order[i], i);
    const struct fv_stage_limit told = {.done = rig.frame.tiles};
    r = stage(&by_gaze, &told);
    check_first_ones(rig.schedule.by_gaze, rig.frame.tiles, &r);
    for (int i = 1; i < rig.sequence; i++)
        if (floorf(rig.schedule.eccentricity_deg[rig.order[i]]) <
            floorf(rig.schedule.eccentricity_deg[rig.order[i - 1]]))
            fail_msg("tile %d of the order lies nearer than the one before", i);
    /* By need: tiles without work are no part of it; without history before others of the same place; those
     * that have waited before those that have not. */
    int far[3] = {0}, n = 0;
    for (int i = 0; i < rig.frame.tiles && n < 3; i++) {
        int t = (int)rig.schedule.by_gaze[rig.frame.tiles - 1 - i];
        if (rig.schedule.eccentricity_deg[t] < 55) far[n++] = t;
    }
    for (int t = 0; t < rig.frame.tiles; t += 2)
        if (rig.schedule.eccentricity_deg[t] > 30 && t != far[0] && t != far[1] && t != far[2])
            rig.selected[t] = 0;
    rig.frame.failed_blocks[far[0]] = 8;
    rig.schedule.waited[far[1]] = 2;
    int working = 0, place[3] = {0};
    for (int t = 0; t < rig.frame.tiles; t++) working += rig.selected[t] != 0;
    r = stage(&by_need, &none);
    assert_int_equal(r.done, working);
    for (int i = 0; i < rig.sequence; i++) {
        float e = rig.schedule.eccentricity_deg[rig.order[i]];
        if (i < rig.schedule.must) assert_true(e < FV_FOVEA_DEG + rig.schedule.radius_deg + 1);
        for (int k = 0; k < 3; k++)
            if (rig.order[i] == far[k]) place[k] = i;
    }
    assert_true(rig.schedule.must > 4 && rig.schedule.must < 60);
    assert_true(place[0] < place[1] && place[1] < place[2]);
    close_rig();
}

static void deadlines(void **state)
{
    (void)state;
    static const struct {
        int64_t budget_ns;
        double follow_ns, tile_cpu_ns;
    } cases[] = {{800000, 0, 0}, {500000, 0, 0}, {500000, 100000, 0},
                 {90000, 0, 0},  {1, 0, 0},      {500000, 100000, 250}};
    open_rig(1, &made_up);
    rig.tile_ns = 1000, rig.stand_in_ns = 50;
    for (int c = 0; c < (int)(sizeof cases / sizeof cases[0]); c++)
        for (int need = 0; need < 2; need++) {
            struct fv_stage_limit limit = {.deadline_ns = rig.now_ns + cases[c].budget_ns,

                                           .stand_in_ns = 50,
                                           .follow_ns = cases[c].follow_ns,
                                           .tile_cpu_ns = cases[c].tile_cpu_ns,
                                           .done = -1};
            struct fv_stage_result r = stage(need ? &by_need : &by_gaze, &limit);
            int must = need ? rig.schedule.must : 0;
            check_first_ones(need ? rig.schedule.by_need : rig.schedule.by_gaze, rig.frame.tiles, &r);
            assert_true(r.done >= must);
            /* Done in time, unless what must be done takes longer; not more than a tile too early. What took
             * longer than expected makes what follows dearer, too. */
            int64_t left_ns = limit.deadline_ns - r.end_ns;
            int64_t least_ns = must * rig.tile_ns + (rig.frame.tiles - must) * rig.stand_in_ns;
            if (r.done > must) assert_true((double)left_ns >= cases[c].follow_ns - (double)rig.tile_ns);
            if (r.cut && least_ns < cases[c].budget_ns && cases[c].tile_cpu_ns == 0)
                assert_true((double)left_ns <= cases[c].follow_ns + 2 * (double)rig.tile_ns);
            if (cases[c].tile_cpu_ns > 0 && r.done > must)
                assert_true((double)left_ns > 2 * cases[c].follow_ns);
        }
    /* A recorded number is done again whatever the clock says. */
    for (int done = 0; done <= rig.frame.tiles; done += 77) {
        struct fv_stage_limit limit = {.deadline_ns = 1, .done = done};
        struct fv_stage_result r = stage(&by_gaze, &limit);
        assert_int_equal(r.done, done);
    }
    /* What cannot be cut is not. */
    const struct fv_stage_limit late = {.deadline_ns = 1, .done = 3};
    assert_int_equal(stage(&whole, &late).done, rig.frame.tiles);
    struct fv_pass needs = by_gaze;
    needs.needs = FV_NEEDS_HISTORY;
    rig.frame.has_history = false;
    assert_int_equal(stage(&needs, &late).done, rig.frame.tiles);
    close_rig();
}

/* Where there is never time for more than a part, every tile that has work gets its turn. */
static void nobody_starves(void **state)
{
    (void)state;
    static int last[TILES_MAX];
    open_rig(1, &made_up);
    rig.tile_ns = 1000, rig.stand_in_ns = 10;
    int longest = 0;
    memset(last, 0, sizeof last);
    for (int frame = 1; frame <= 400; frame++) {
        struct fv_stage_limit limit = {.deadline_ns = rig.now_ns + 250000, .stand_in_ns = 10, .done = -1};
        stage(&by_need, &limit);
        for (int t = 0; t < rig.frame.tiles; t++) {
            if (rig.ran[t]) last[t] = frame;
            if (frame - last[t] > longest) longest = frame - last[t];
        }
    }
    print_message("with time for 29 %% of the tiles the longest wait is %d frames\n", longest);
    assert_in_range(longest, 4, 40);
    close_rig();
}

static void real_threads(void **state)
{
    (void)state;
    open_rig(4, &fv_clock_monotonic);
    for (int i = 0; i < 300; i++) {
        int64_t now_ns = fv_clock_now_ns(&fv_clock_monotonic);
        struct fv_stage_limit limit = {.deadline_ns = now_ns + 1000 * i, .done = -1};
        struct fv_stage_result r = stage(i % 2 ? &by_need : &by_gaze, &limit);
        check_first_ones(i % 2 ? rig.schedule.by_need : rig.schedule.by_gaze, rig.frame.tiles, &r);
        assert_true(r.idle_ns >= 0 && r.cpu_ns > 0 && r.end_ns > r.start_ns);
    }
    int64_t tiles = 0, cut = 0;
    for (int w = 0; w < 4; w++)
        for (int i = 0; i < FV_RINGS; i++) {
            tiles += rig.schedule.ring[w][i].tiles;
            cut += rig.schedule.ring[w][i].cut;
        }
    assert_int_equal(tiles + cut, 150 * rig.frame.tiles);
    close_rig();
}

/* Rings against every pixel; what passes are expected to be against every block. */
static void expectations(void **state)
{
    (void)state;
    static const double gazes[][2] = {{0, 0}, {0.3, -0.2}, {-0.9, 1.1}};
    static const struct fv_foveal frcs[] = {
        {5, 10, 0.01f}, {10, 20, 0.05f}, {15, 30, 0.1f}, {10, 20, 1}, {2.6f, 5.2f, 0.01f}};
    open_rig(1, &made_up);
    for (int g = 0; g < 3; g++) {
        look(gazes[g][0], gazes[g][1]);
        double pixels = 0;
        for (int d = 0; d < FV_DEGREES; d++) pixels += (double)rig.schedule.rings.pixels[d];
        assert_true(pixels == 2.0 * WIDTH * HEIGHT);
        for (int k = 0; k < 5; k++) {
            struct fv_parameters p = {.foveal = frcs[k], .spp = 1, .spacing = 8};
            double sum = 0, expected[2] = {0};
            for (int y = 0; y < HEIGHT; y++)
                for (int x = 0; x < WIDTH; x++)
                    sum += 2 * (double)fv_foveal_probability(
                                   &p.foveal,
                                   fv_eccentricity_deg(&rig.frame.view[0], (float)x + 0.5f, (float)y + 0.5f));
            fv_pass_sample.expect(&rig.frame, &p, &rig.schedule.rings, expected);
            if (fabs(expected[0] + expected[1] - sum) > 0.03 * sum)
                fail_msg("gaze %d, FRC %d: %.0f pixels expected, %.0f come", g, k, expected[0] + expected[1],
                         sum);
            if (p.foveal.p_min >= 1) assert_true(expected[0] == 0);
        }
    }
    close_rig();
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(orders),       cmocka_unit_test(deadlines),    cmocka_unit_test(nobody_starves),
        cmocka_unit_test(real_threads), cmocka_unit_test(expectations),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
