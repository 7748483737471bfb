/* gpio: a made-up chip behind struct fv_gpio_io: what is taken and refused, edges as a beat and as presses, outputs
 * frame by frame, and lines that fail. */
#include "platform/gpio.h"

#include "tests/support/program.h"

#include <errno.h>

enum { LINES = 8 };
static const char *const names[LINES] = {"TE", "KEY", "LED", "LATE", "BEAT", "SPARE", "", "EXTRA"};

static struct {
    bool open, taken[LINES], input[LINES], high[LINES];
    int takes_fail, edges_fail, set_fails, sets, waiting;
    struct fv_gpio_edge edge[100];
} fake;

static int fake_open(void *context, const char *chip, struct fv_error *error)
{
    (void)context;
    if (strcmp(chip, "board") != 0) return fv_error_set(error, "gpio.chip: there is no '%s'", chip);
    fake.open = true;
    return 0;
}

static int fake_find(void *context, const char *name)
{
    (void)context;
    for (int i = 0; i < LINES; i++)
        if (strcmp(names[i], name) == 0) return i;
    return -1;
}

static int fake_take(void *context, const int *input, int inputs, const int *output, int outputs, struct fv_error *error)
{
    (void)context;
    if (fake.takes_fail) return fv_error_set(error, "gpio: held");
    for (int i = 0; i < inputs; i++) fake.taken[input[i]] = fake.input[input[i]] = true;
    for (int i = 0; i < outputs; i++) fake.taken[output[i]] = true;
    return 0;
}

static int fake_edges(void *context, struct fv_gpio_edge *edge, int most)
{
    (void)context;
    int count = fake.waiting < most ? fake.waiting : most;
    if (fake.edges_fail) return -fake.edges_fail;
    memcpy(edge, fake.edge, sizeof *edge * (size_t)count);
    memmove(fake.edge, fake.edge + count, sizeof *edge * (size_t)(fake.waiting -= count));
    return count;
}

static int fake_set(void *context, int offset, bool high)
{
    (void)context;
    assert_true(fake.taken[offset] && !fake.input[offset]);
    if (fake.set_fails) return -fake.set_fails;
    fake.high[offset] = high;
    fake.sets++;
    return 0;
}

static void fake_close(void *context)
{
    (void)context;
    assert_true(fake.open);
    memset(&fake, 0, sizeof fake);
}

static const struct fv_gpio_io io = {fake_open, fake_find, NULL, fake_take, fake_edges, fake_set, fake_close, NULL};
static struct fv_gpio gpio;
static struct fv_error error;

static struct fv_gpio_settings all(void)
{
    struct fv_gpio_settings s = {.chip = "board", .period_ns = 10000000};
    for (int i = 0; i < FV_GPIO_LINES; i++) strcpy(s.line[i], names[i]);
    return s;
}

static void edge(int offset, int64_t t_ns, uint32_t number)
{
    fake.edge[fake.waiting++] = (struct fv_gpio_edge){offset, t_ns, number};
}

static void refusals(void **state)
{
    (void)state;
    static const char *const expected[] = {"gpio.chip: is empty; must name the chip that gpio.heartbeat is of",
                                           "there is no 'other'", "gpio.missed: the chip board has no line named 'NONE'",
                                           "gpio.strobe: the line 'TE' is that of gpio.vsync already", "held"};
    for (int i = 0; i < 5; i++) {
        struct fv_gpio_settings s = all();
        memset(&fake, 0, sizeof fake);
        if (i == 0) s.chip[0] = 0;
        if (i == 1) strcpy(s.chip, "other");
        if (i == 2) strcpy(s.line[FV_GPIO_MISSED], "NONE");
        if (i == 3) strcpy(s.line[FV_GPIO_STROBE], "TE");
        if (i == 4) fake.takes_fail = EBUSY;
        assert_int_equal(fv_gpio_open(&gpio, &s, &io, &error), -1);
        if (!strstr(error.text, expected[i])) fail_msg("%s", error.text);
        assert_false(fake.open);
        fv_gpio_poll(&gpio), fv_gpio_strobe(&gpio), fv_gpio_frame(&gpio, true), fv_gpio_close(&gpio);
    }
    /* Nothing is named: nothing is opened, and all calls do nothing. */
    struct fv_gpio_settings none = {.chip = "board"};
    struct fv_beat beat;
    assert_int_equal(fv_gpio_open(&gpio, &none, &io, &error), 0);
    fv_gpio_poll(&gpio), fv_gpio_strobe(&gpio), fv_gpio_frame(&gpio, true), fv_gpio_close(&gpio);
    assert_true(!fake.open && !fv_gpio_pressed(&gpio) && !fv_gpio_beat(&gpio, 0, &beat) && gpio.counts.strobes == 0);
}

static void outputs(void **state)
{
    (void)state;
    struct fv_gpio_settings s = all();
    memset(&fake, 0, sizeof fake);
    assert_int_equal(fv_gpio_open(&gpio, &s, &io, &error), 0);
    assert_true(gpio.lines == 5 && fake.input[0] && fake.input[1] && !fake.taken[5] && !fake.taken[6]);
    for (int frame = 0; frame < 10; frame++) {
        if (frame != 4) fv_gpio_strobe(&gpio); /* nothing to show */
        fv_gpio_frame(&gpio, frame == 6 || frame == 7);
        assert_int_equal(fake.high[2], (frame < 4 ? frame + 1 : frame) % 2);
        assert_int_equal(fake.high[3], frame == 6 || frame == 7);
        assert_int_equal(fake.high[4], (frame + 1) % 2);
    }
    assert_int_equal(fake.sets, 9 + 2 + 10);
    assert_int_equal(gpio.counts.strobes, 9);
    fake.set_fails = EIO; /* once each, said; then left alone */
    fv_gpio_frame(&gpio, true);
    assert_true(gpio.counts.errors == 2 && strstr(gpio.text, "Input/output error"));
    fv_gpio_frame(&gpio, false);
    fv_gpio_strobe(&gpio);
    fv_gpio_strobe(&gpio);
    assert_true(gpio.counts.errors == 3 && gpio.counts.strobes == 9);
    fv_gpio_close(&gpio);
    assert_false(fake.open);
    memset(&fake, 0, sizeof fake); /* closed while high: left low */
    memset(&s.line, 0, sizeof s.line);
    strcpy(s.line[FV_GPIO_STROBE], "LED");
    assert_int_equal(fv_gpio_open(&gpio, &s, &io, &error), 0);
    fv_gpio_strobe(&gpio);
    assert_true(fake.high[2] && !fake.taken[4]);
    fv_gpio_close(&gpio);
}

/* Edges as a beat: dropped ones are told by their number. */
static void beats(void **state)
{
    (void)state;
    struct fv_gpio_settings s = all();
    struct fv_beat beat = {.lead_ns = 7};
    memset(&fake, 0, sizeof fake);
    assert_int_equal(fv_gpio_open(&gpio, &s, &io, &error), 0);
    assert_false(fv_gpio_beat(&gpio, 0, &beat));
    for (uint32_t i = 0; i < 200; i++) {
        if (i % 10 == 3) continue;
        edge(0, 1000000000 + (int64_t)i * 10100000, UINT32_MAX - 50 + i);
        if (i % 30 == 0) fv_gpio_poll(&gpio);
    }
    fv_gpio_poll(&gpio);
    assert_int_equal(fake.waiting, 0);
    assert_true(fv_gpio_beat(&gpio, 1000000000 + (int64_t)200 * 10100000, &beat));
    assert_int_equal(beat.flip_ns, 1000000000 + (int64_t)199 * 10100000);
    assert_true(beat.period_ns == 10100000 && beat.lead_ns == 7 && gpio.counts.vsyncs == 180 && gpio.vsync.odd == 0);
    assert_false(fv_gpio_beat(&gpio, 9000000000, &beat)); /* the display has stopped */
    fake.edges_fail = ENODEV;
    fv_gpio_poll(&gpio), fv_gpio_poll(&gpio);
    assert_true(gpio.counts.errors == 1 && strstr(gpio.text, "gpio.vsync: No such device"));
    assert_false(fv_gpio_beat(&gpio, 1000000000 + (int64_t)200 * 10100000, &beat));
    fv_gpio_close(&gpio);
}

/* A button bounces; each press is told once. */
static void presses(void **state)
{
    (void)state;
    struct fv_gpio_settings s = all();
    memset(&fake, 0, sizeof fake);
    assert_int_equal(fv_gpio_open(&gpio, &s, &io, &error), 0);
    static const int64_t at_ms[] = {10, 11, 15, 40, 200, 400, 460};
    for (uint32_t i = 0; i < 7; i++) edge(1, at_ms[i] * 1000000, i);
    edge(5, 700000000, 1); /* not ours */
    assert_false(fv_gpio_pressed(&gpio));
    fv_gpio_poll(&gpio);
    assert_true(fv_gpio_pressed(&gpio) && !fv_gpio_pressed(&gpio));
    assert_int_equal(gpio.counts.presses, 4);
    assert_int_equal(gpio.counts.vsyncs, 0);
    fv_gpio_close(&gpio);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(refusals), cmocka_unit_test(outputs), cmocka_unit_test(beats),
                                       cmocka_unit_test(presses)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
