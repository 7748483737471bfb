/* control: what is learned from samples, usual and hostile ones, and which level follows. How it does over
 * time, in a loop with a plant: tests/numeric/plants.c. */
#include "rt/frame/control.h"
#include "tests/support/program.h"
#include "tests/support/random.h"

#include <float.h>
#include <math.h>

#define COUNT(table) (sizeof table / sizeof table[0])
enum { LAST = 7, DENSE = 1, SPARSE = 0 };
static const double period_ns = 10e6;
static const struct fv_work nothing = {{0}};

/* One stage with dense units: level i has 1e5 x 0.8^i. */
static void levels_of(struct fv_work expected[LAST + 1])
{
    for (int i = 0; i <= LAST; i++) expected[i] = (struct fv_work){{[DENSE] = 1e5 * pow(0.8, i)}};
}

/* A frame of `work` at `unit_ns` CPU, on one worker without load. */
static struct fv_cost_sample sample_of(int level, const struct fv_work *work, double unit_ns)
{
    struct fv_cost_sample s = {.level = level, .expected = *work, .done = *work};
    for (int k = 0; k < FV_COSTS; k++) {
        s.cpu_ns[k] = work->units[k] * unit_ns;
        s.total_cpu_ns += s.cpu_ns[k];
    }
    s.wall_ns = s.total_cpu_ns;
    return s;
}

static void frames(struct fv_control *c, const struct fv_work *expected, double unit_ns, int count)
{
    for (int n = 0; n < count; n++) {
        int level = fv_control_choose(c, expected, &nothing, period_ns, 0, 1);
        struct fv_cost_sample s = sample_of(level, &expected[level], unit_ns);
        fv_control_learn(c, &s);
    }
}

static void peaks(void **state)
{
    (void)state;
    static const struct {
        int samples;
        double value[8], held;
    } table[] = {
        {0, {0}, 0},
        {1, {5}, 5},
        {2, {50, 5}, 5},
        {2, {5, 50}, 5},
        {3, {50, 5, 6}, 6},
        {4, {5, 5, 5, 50}, 5},
        {5, {5, 5, 5, 50, 50}, 50},
        {6, {5, 5, 5, 50, 5, 49}, 49},
        {6, {5, 5, 5, 50, 5, 5}, 5},
        {5, {50, 50, 50, 5, 5}, 50 - 45.0 / 128},
        {6, {50, 50, 50, 5, 5, 6}, 6},
        {6, {50, 50, 50, 41, 41, 41}, 50 - 9.0 / 128 - 9.0 / 128 * 127 / 128},
        {4, {5, 5, 5, 4.5}, 5},
        {5, {5, NAN, INFINITY, -7, 0}, 5},
        {8, {5, 5, NAN, 5, 0, 50, -INFINITY, 50}, 50},
        {3, {DBL_MAX, DBL_MAX, DBL_MAX}, DBL_MAX},
        {3, {DBL_TRUE_MIN, DBL_TRUE_MIN, DBL_TRUE_MIN}, DBL_TRUE_MIN},
    };
    for (unsigned r = 0; r < COUNT(table); r++) {
        struct fv_peak peak = {0};
        for (int i = 0; i < table[r].samples; i++) fv_peak_learn(&peak, table[r].value[i]);
        if (!(fabs(peak.held - table[r].held) <= 1e-12 * table[r].held))
            fail_msg("row %u: %.17g", r, peak.held);
    }
}

/* What is predicted of 100 sparse and 1000 dense units of two stages from one sample. */
static void predictions(void **state)
{
    (void)state;
    static const struct {
        int workers;
        double units[4], cpu_ns[4], stretched, ns;
    } table[] = {
        {1, {0}, {0}, 1, 0},
        {1, {10, 10, 10, 10}, {20, 10, 40, 30}, 1, 200 + 1000 + 400 + 3000},
        {2, {10, 10, 10, 10}, {20, 10, 40, 30}, 1, (200 + 1000 + 400 + 3000) / 2.0},
        {2, {10, 10, 10, 10}, {20, 10, 40, 30}, 1.5, (200 + 1000 + 400 + 3000) * 0.75},
        {2, {10, 10, 10, 10}, {20, 10, 40, 30}, 0.1, (200 + 1000 + 400 + 3000) / 2.0},
        {1, {0, 10, 0, 10}, {0, 10, 0, 30}, 1, 160 + 1000 + 480 + 3000},
        {1, {10, 0, 10, 0}, {20, 0, 40, 0}, 1, 200 + 2000 + 400 + 4000},
        {1, {10, 10, 0, 0}, {20, 10, 0, 0}, 1, 2 * (200 + 1000)},
        {1, {10, 10, 10, 10}, {20, 10, NAN, -30}, 1, 2 * (200 + 1000)},
    };
    for (unsigned r = 0; r < COUNT(table); r++) {
        struct fv_control c;
        struct fv_cost_sample s = {.level = LAST};
        struct fv_work work = {{100, 1000, 100, 1000}};
        fv_control_open(&c, 0, LAST, table[r].workers, 0.1);
        for (int k = 0; k < 4; k++) {
            s.expected.units[k] = s.done.units[k] = table[r].units[k];
            s.cpu_ns[k] = table[r].cpu_ns[k];
            s.total_cpu_ns += s.cpu_ns[k] > 0 ? s.cpu_ns[k] : 0;
        }
        s.wall_ns = s.total_cpu_ns / table[r].workers * table[r].stretched;
        fv_control_learn(&c, &s);
        double ns = fv_control_predict_ns(&c, LAST, &work);
        if (!(fabs(ns - table[r].ns) <= 1e-12 * table[r].ns)) fail_msg("row %u: %g ns", r, ns);
    }
}

/* Half as many units as expected came, twice, three times, and in a frame that was cut. */
static void corrections(void **state)
{
    (void)state;
    static const struct {
        double came;
        bool cut;
        double correction;
    } table[] = {{1, false, 1},     {0.5, false, 0.5}, {2, false, 2},   {3, false, 2},
                 {0.1, false, 0.5}, {0.4, true, 1},    {1.5, true, 1.5}};
    for (unsigned r = 0; r < COUNT(table); r++) {
        struct fv_control c;
        struct fv_work expected = {{[DENSE] = 1000}};
        fv_control_open(&c, 0, LAST, 1, 0.1);
        struct fv_cost_sample s = sample_of(LAST, &expected, 10);
        for (int n = 0; n < 3; n++) fv_control_learn(&c, &s);
        s.done.units[DENSE] *= table[r].came;
        s.cpu_ns[DENSE] = s.total_cpu_ns = s.wall_ns = 10 * s.done.units[DENSE];
        s.cut = table[r].cut;
        for (int n = 0; n < 3; n++) fv_control_learn(&c, &s);
        double ns = fv_control_predict_ns(&c, LAST, &expected);
        if (!(fabs(ns - 10000 * table[r].correction) < 1e-6)) fail_msg("row %u: %g ns", r, ns);
    }
}

/* Reserves: the newest price at once if it is the dearer, the held one if it is not. */
static void reserves(void **state)
{
    (void)state;
    struct fv_control c;
    struct fv_work work = {{[DENSE] = 1000}};
    fv_control_open(&c, 0, LAST, 2, 0.1);
    assert_true(fv_control_price_ns(&c, DENSE) == 0);
    static const double unit_ns[] = {10, 10, 10, 80, 10}, expected[] = {5, 5, 5, 40, 5};
    for (unsigned i = 0; i < COUNT(unit_ns); i++) {
        struct fv_cost_sample s = sample_of(LAST, &work, unit_ns[i]);
        s.wall_ns /= 2;
        fv_control_learn(&c, &s);
        assert_true(fabs(fv_control_price_ns(&c, DENSE) - expected[i]) < 1e-9);
        assert_true(fabs(fv_control_price_ns(&c, SPARSE) - 1.6 * expected[i]) < 1e-9);
        assert_true(fv_control_price_ns(&c, 2) == 0);
    }
}

/* From the last level to the best that fits with room, one a frame after three: the best that is predicted to
 * take 0.9 of 9 ms. */
static void climbs(void **state)
{
    (void)state;
    static const struct {
        double unit_ns;
        int level;
    } table[] = {{1, 0},   {80, 0},  {82, 1},  {101, 1}, {102, 2},  {126, 2},
                 {127, 3}, {308, 6}, {310, 7}, {1e4, 7}, {1e11, 7}, {1e-9, 0}};
    struct fv_work expected[LAST + 1];
    levels_of(expected);
    for (unsigned r = 0; r < COUNT(table); r++) {
        struct fv_control c;
        fv_control_open(&c, 0, LAST, 1, 0.1);
        frames(&c, expected, table[r].unit_ns, 3);
        assert_int_equal(c.level, LAST);
        for (int n = 1; n <= LAST - table[r].level; n++) {
            frames(&c, expected, table[r].unit_ns, 1);
            assert_int_equal(c.level, LAST - n);
        }
        frames(&c, expected, table[r].unit_ns, 100);
        if (c.level != table[r].level) fail_msg("row %u: level %d", r, c.level);
    }
}

/* Where it stands, what a unit costs in the frames that follow, and the level chosen after each. */
static void follows_changes(void **state)
{
    (void)state;
    static const struct {
        double from_ns, unit_ns[12];
        int frames, level[12];
    } table[] = {
        {20, {200}, 1, {0}}, /* a spike */
        {20, {200, 20, 20, 200, 20, 20, 20}, 7, {0}},
        {20, {200, 200}, 2, {0, 4}}, /* a step, believed on its second frame */
        {20, {200, 20, 200}, 3, {0, 0, 4}},
        {20, {1e4, 1e4}, 2, {0, 7}},
        {200, {20, 20, 20, 20, 20, 20, 20}, 7, {5, 5, 4, 3, 2, 1, 0}},
        {200, {20, 20, 200, 20, 20, 20}, 6, {5, 5, 5, 5, 5, 4}},
        {20, {200, 200, 20, 20, 20, 20, 20, 20}, 8, {0, 4, 4, 4, 3, 2, 1, 0}},
        {20, {NAN, NAN, -1, 0, INFINITY, 1e300}, 6, {0}},
    };
    struct fv_work expected[LAST + 1];
    levels_of(expected);
    for (unsigned r = 0; r < COUNT(table); r++) {
        struct fv_control c;
        fv_control_open(&c, 0, LAST, 1, 0.1);
        frames(&c, expected, table[r].from_ns, 50);
        int level = fv_control_choose(&c, expected, &nothing, period_ns, 0, 1);
        for (int n = 0; n < table[r].frames; n++) {
            struct fv_cost_sample s = sample_of(level, &expected[level], table[r].unit_ns[n]);
            fv_control_learn(&c, &s);
            level = fv_control_choose(&c, expected, &nothing, period_ns, 0, 1);
            if (level != table[r].level[n]) fail_msg("row %u, frame %d: level %d", r, n, level);
        }
    }
}

/* A level that costs `times` what its units say, in CPU time, in units or in wall time, is tried once. */
static void wrong_level_is_tried_once(void **state)
{
    (void)state;
    struct fv_work expected[LAST + 1];
    levels_of(expected);
    for (int way = 0; way < FV_MEASURES; way++)
        for (int wrong = 0; wrong < LAST; wrong++) {
            struct fv_control c;
            int raises = 0, before = LAST;
            fv_control_open(&c, 0, LAST, 1, 0.1);
            for (int n = 0; n < 2000; n++) {
                int level = fv_control_choose(&c, expected, &nothing, period_ns, 0, 1);
                struct fv_cost_sample s = sample_of(level, &expected[level], 76);
                double times = level == wrong ? 3 : 1;
                if (way == FV_UNITS) s.done.units[DENSE] *= times;
                if (way != FV_STRETCH) s.cpu_ns[DENSE] *= times, s.total_cpu_ns *= times;
                s.wall_ns *= times;
                fv_control_learn(&c, &s);
                raises += level == wrong && before == wrong + 1;
                if (n > 20 && level > wrong + 1) fail_msg("level %d where %d is wrong", level, wrong);
                before = level;
            }
            /* Where it fits all the same, it is passed. */
            bool fits = 3 * 76 * expected[wrong].units[DENSE] <= 0.9 * 0.9 * period_ns;
            if (raises != 1 || c.level != (fits ? 0 : wrong + 1))
                fail_msg("wrong level %d: tried %d times, ends at %d", wrong, raises, c.level);
        }
}

/* Frames that are cut again and again lead down, though predicted to fit, and do not come back. */
static void cuts_lead_down(void **state)
{
    (void)state;
    struct fv_work expected[LAST + 1];
    struct fv_control c;
    int changes = 0, before = 0;
    levels_of(expected);
    fv_control_open(&c, 0, LAST, 1, 0.1);
    frames(&c, expected, 20, 20);
    assert_int_equal(c.level, 0);
    for (int n = 0; n < 10000; n++) {
        int level = fv_control_choose(&c, expected, &nothing, period_ns, 0, 1);
        struct fv_cost_sample s = sample_of(level, &expected[level], 20);
        s.cut = level < 3;
        fv_control_learn(&c, &s);
        changes += level != before;
        before = level;
    }
    assert_int_equal(c.level, 3);
    assert_int_equal(changes, 3);
}

/* Frames that were given less time than there is say nothing about the level. */
static void hurried_cuts_do_not(void **state)
{
    (void)state;
    struct fv_work expected[LAST + 1];
    struct fv_control c;
    levels_of(expected);
    fv_control_open(&c, 0, LAST, 1, 0.1);
    frames(&c, expected, 20, 20);
    for (int n = 0; n < 100; n++) {
        int level = fv_control_choose(&c, expected, &nothing, period_ns, 0, 1);
        struct fv_cost_sample s = sample_of(level, &expected[level], 20);
        s.cut = s.hurried = true;
        fv_control_learn(&c, &s);
    }
    assert_int_equal(c.level, 0);
}

/* One frame's level for the time that is left to it; the level chosen stays. */
static void fits_what_is_left(void **state)
{
    (void)state;
    static const struct {
        double left_ms;
        int level;
    } table[] = {{100, 0},  {2.001, 0}, {1.999, 1}, {1.601, 1},    {1.599, 2},     {0.42, 7},
                 {0.01, 7}, {0, 7},     {-5, 7},    {INFINITY, 0}, {-INFINITY, 7}, {NAN, 7}};
    struct fv_work expected[LAST + 1];
    struct fv_control c;
    levels_of(expected);
    fv_control_open(&c, 0, LAST, 1, 0.1);
    assert_int_equal(fv_control_fit(&c, expected, 0), LAST);
    frames(&c, expected, 20, 20);
    for (unsigned r = 0; r < COUNT(table); r++) {
        int level = fv_control_fit(&c, expected, table[r].left_ms * 1e6);
        if (level != table[r].level || c.level != 0) fail_msg("row %u: level %d", r, level);
    }
}

/* A price that is not measured for a while goes with the other one of its stage. */
static void prices_of_a_stage_go_together(void **state)
{
    (void)state;
    struct fv_control c;
    struct fv_work both = {{[SPARSE] = 1000, [DENSE] = 1000}}, one = {{[SPARSE] = 1000}};
    fv_control_open(&c, 0, LAST, 1, 0.1);
    struct fv_cost_sample s = sample_of(LAST, &both, 10);
    s.cpu_ns[SPARSE] *= 3;
    for (int n = 0; n < 3; n++) fv_control_learn(&c, &s);
    assert_true(fabs(c.price[SPARSE].held - 30) < 1e-9 && fabs(c.price[DENSE].held - 10) < 1e-9);
    s = sample_of(LAST, &one, 300);
    for (int n = 0; n < 2; n++) fv_control_learn(&c, &s);
    assert_true(fabs(c.price[SPARSE].held - 300) < 1e-9 && fabs(c.price[DENSE].held / 100 - 1) < 0.05);
    s = sample_of(LAST, &one, 3);
    for (int n = 0; n < 3; n++) fv_control_learn(&c, &s);
    assert_true(fabs(c.price[SPARSE].held - 3) < 1e-9 && fabs(c.price[DENSE].held - 1) < 0.1);
    for (int n = 0; n < 1000; n++) fv_control_learn(&c, &s);
    assert_true(fabs(c.price[DENSE].held - 3) < 0.01);
    /* A few units say nothing. */
    s.done.units[DENSE] = 30, s.cpu_ns[DENSE] = 30e6;
    for (int n = 0; n < 10; n++) fv_control_learn(&c, &s);
    assert_true(fabs(c.price[DENSE].held - 3) < 0.01 && c.correction[DENSE].held == 1);
    s.done.units[DENSE] = 40, s.cpu_ns[DENSE] = 40 * 7;
    for (int n = 0; n < 2; n++) fv_control_learn(&c, &s);
    assert_true(fabs(c.price[DENSE].held - 7) < 1e-9);
}

/* The least that a frame needs sets its periods: more at once, fewer after three easy frames. */
static void periods(void **state)
{
    (void)state;
    static const struct {
        double least_ms, other_ms, period_ms;
        int most, periods;
    } table[] = {
        {1, 0, 10, 8, 1},  {8.9, 0, 10, 8, 1}, {9.1, 0, 10, 8, 2},       {9.1, 0, 10, 1, 1},
        {5, 5, 10, 8, 2},  {50, 0, 10, 8, 6},  {500, 0, 10, 8, 8},       {1, NAN, 10, 8, 1},
        {1, -5, 10, 8, 1}, {1, 0, NAN, 8, 8},  {1, 0, 0, 8, 8},          {1, INFINITY, 10, 8, 1},
        {1, 0, -10, 8, 8}, {1, 0, 10, -3, 1},  {1, 0, 1e-300, 100, 100}, {5, 9e8, 1e-4, INT32_MAX, INT32_MAX},
    };
    for (unsigned r = 0; r < COUNT(table); r++) {
        struct fv_control c;
        struct fv_work expected[LAST + 1], least = {{[DENSE] = table[r].least_ms * 1e4}};
        levels_of(expected);
        fv_control_open(&c, 0, LAST, 1, 0.1);
        struct fv_cost_sample s = sample_of(LAST, &expected[LAST], 100);
        for (int n = 0; n < 3; n++) fv_control_learn(&c, &s);
        fv_control_choose(&c, expected, &least, table[r].period_ms * 1e6, table[r].other_ms * 1e6,
                          table[r].most);
        if (c.periods != table[r].periods) fail_msg("row %u: %d periods", r, c.periods);
        int before = c.periods;
        for (int n = 0; n < 3; n++) {
            assert_int_equal(c.periods, before);
            fv_control_choose(&c, expected, &nothing, 10e6, 0, table[r].most < 1 ? 1 : table[r].most);
        }
        assert_int_equal(c.periods, 1);
    }
}

static double any_double(uint64_t *random)
{
    static const double odd[] = {0, -0.0, 1, -1, NAN, INFINITY, -INFINITY, DBL_MAX, DBL_TRUE_MIN, 1e15, 1e6};
    uint64_t bits = random_bits(random);
    double value;
    if (bits % 4 == 0) return odd[bits / 4 % COUNT(odd)];
    if (bits % 4 == 1) return random_decade(random, 1, 1e9);
    memcpy(&value, &bits, sizeof value);
    return value;
}

static struct fv_work any_work(uint64_t *random)
{
    struct fv_work work;
    for (int k = 0; k < FV_COSTS; k++) work.units[k] = any_double(random);
    return work;
}

static void check(const struct fv_control *c, const struct fv_work *work)
{
    assert_true(c->level >= c->first && c->level <= c->last && c->periods >= 1);
    for (int i = c->first; i <= c->last; i++) {
        double ns = fv_control_predict_ns(c, i, work);
        assert_true(isfinite(ns) && ns >= 0);
        assert_true(c->memory[i].caution >= 1 && c->memory[i].caution <= 16);
        for (int m = 0; m < FV_MEASURES; m++)
            assert_true(c->memory[i].factor[m] >= 1 && c->memory[i].factor[m] <= 16);
    }
    for (int k = 0; k < FV_COSTS; k++) {
        assert_true(isfinite(c->price[k].held) && c->price[k].held >= 0);
        assert_true(c->correction[k].held >= 0 && c->correction[k].held <= 2);
        assert_true(isfinite(fv_control_price_ns(c, k)) && fv_control_price_ns(c, k) >= 0);
    }
    assert_true(c->stretch.held >= 0 && c->stretch.held <= 1000);
}

/* Bit patterns for numbers, odd ones among them. After them it works as before. */
static void hostile_numbers(void **state)
{
    (void)state;
    uint64_t random = 5;
    struct fv_work expected[FV_LEVELS_MAX], usual[LAST + 1];
    levels_of(usual);
    for (int round = 0; round < 300; round++) {
        struct fv_control c;
        int last = (int)(random_bits(&random) % FV_LEVELS_MAX),
            first = (int)(random_bits(&random) % (unsigned)(last + 1));
        fv_control_open(&c, first, last, 1 + (int)(random_bits(&random) % 64), any_double(&random));
        for (int n = 0; n < 200; n++) {
            struct fv_cost_sample s = {.level = (int)(random_bits(&random) % 20) - 2,
                                       .expected = any_work(&random),
                                       .done = any_work(&random),
                                       .cut = random_bits(&random) & 1,
                                       .wall_ns = any_double(&random),
                                       .total_cpu_ns = any_double(&random)};
            for (int k = 0; k < FV_COSTS; k++) s.cpu_ns[k] = any_double(&random);
            for (int i = first; i <= last; i++) expected[i] = any_work(&random);
            fv_control_learn(&c, &s);
            struct fv_work least = any_work(&random);
            int most = (int)(random_bits(&random) % 40) - 2;
            int level =
                fv_control_choose(&c, expected, &least, any_double(&random), any_double(&random), most);
            assert_int_equal(level, c.level);
            assert_true(c.periods <= (most < 1 ? 1 : most));
            check(&c, &s.done);
        }
        if (first > 0 || last != LAST) continue;
        c.headroom = 0.1, c.workers = 1;
        frames(&c, usual, 50, 1000);
        assert_int_equal(c.level, 0);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(peaks),
                                       cmocka_unit_test(predictions),
                                       cmocka_unit_test(corrections),
                                       cmocka_unit_test(reserves),
                                       cmocka_unit_test(climbs),
                                       cmocka_unit_test(follows_changes),
                                       cmocka_unit_test(wrong_level_is_tried_once),
                                       cmocka_unit_test(cuts_lead_down),
                                       cmocka_unit_test(hurried_cuts_do_not),
                                       cmocka_unit_test(fits_what_is_left),
                                       cmocka_unit_test(prices_of_a_stage_go_together),
                                       cmocka_unit_test(periods),
                                       cmocka_unit_test(hostile_numbers)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
