/* check_display: what `foveola check` says of a made-up card and of a made-up GPIO chip: each is looked at, left as it was,
 * and what is wrong is told with its cure. */
#include "cli/check.h"

#include "tests/support/fake_drm.h"

static struct fv_check check;
static struct fv_config config;
static struct fv_error error;

/* A chip of four lines. */
static struct {
    bool open;
    int opened, holds_fails;
    const char *holder[4];
} chip;

static int chip_open(void *context, const char *name, struct fv_error *why)
{
    (void)context;
    if (strcmp(name, "board") != 0) return fv_error_set(why, "gpio.chip: there is no '%s'; there are: board", name);
    chip.open = true;
    chip.opened++;
    return 0;
}

static int chip_find(void *context, const char *name)
{
    static const char *const names[] = {"TE", "LED", "KEY", "BEAT"};
    (void)context;
    assert_true(chip.open);
    for (int i = 0; i < 4; i++)
        if (strcmp(names[i], name) == 0) return i;
    return -1;
}

static int chip_look(void *context, int offset, char holder[FV_GPIO_NAME])
{
    (void)context;
    assert_true(chip.open && offset >= 0 && offset < 4);
    if (chip.holds_fails) return -chip.holds_fails;
    snprintf(holder, FV_GPIO_NAME, "%s", chip.holder[offset] ? chip.holder[offset] : "");
    return chip.holder[offset] != NULL;
}

static void chip_close(void *context)
{
    (void)context;
    assert_true(chip.open);
    chip.open = false;
}

/* Taking or driving a line would be a call of NULL. */
static const struct fv_gpio_io chip_io = {.open = chip_open, .find = chip_find, .look = chip_look, .close = chip_close};

static void begin(void)
{
    struct fv_config_request request = {0};
    assert_int_equal(fv_config_load(&config, &request, &error), 0);
    fake_plug();
    memset(&chip, 0, sizeof chip);
    config.display_eyes = 2;
    config.display_width = config.display_height = 32;
    config.budget_hz = 500;
    check = (struct fv_check){.root = program_folder(), .display = &fake_io, .lines = &chip_io};
}

static void look(void)
{
    check.rows = 0;
    fv_check_devices(&check, &config);
    fake_left();
    assert_false(chip.open);
    assert_true(fake.set_crtcs == 0 && fake.commits == 0 && fake.flips == 0 && fake.crtc[0].fb == FAKE_CONSOLE);
}

static const struct fv_check_row *row_of(const char *what)
{
    for (int i = 0; i < check.rows; i++)
        if (strcmp(check.row[i].what, what) == 0) return &check.row[i];
    fail_msg("no row %s", what);
    return NULL;
}

static void expect(const char *what, enum fv_check_state state, const char *found, const char *change)
{
    const struct fv_check_row *r = row_of(what);
    if (r->state != state || !strstr(r->found, found) || !strstr(r->change, change) || (!change[0] && r->change[0]))
        fail_msg("%s: %d %s; %s", what, r->state, r->found, r->change);
}

static void what_is_not_asked_for_is_not_looked_at(void **state)
{
    (void)state;
    begin();
    strcpy(config.display_sink, "png");
    strcpy(config.gpio_chip, "board");
    look();
    expect("display", FV_CHECK_UNASKED, "budget.hz", "");
    expect("gpio", FV_CHECK_UNASKED, "names no line", "");
    assert_true(fake.probes == 0 && chip.opened == 0);
}

static void a_display_is_looked_at_and_left_as_it_was(void **state)
{
    (void)state;
    begin();
    strcpy(config.display_sink, "kms");
    look();
    expect("display", FV_CHECK_OK, "/dev/dri/card0 may be opened, and nobody holds it", "");
    expect("connector", FV_CHECK_OK, "HDMI-A-1 is connected: 64x32 at 500.00 Hz", "");
    expect("display refresh", FV_CHECK_NOTE, "500.00 Hz measured, in the mode that is on now: 164x48, 1000.", "display.mode");
    fake.period_ns = 1000000;
    config.budget_hz = 400;
    strcpy(config.display_connector, "DP-1"), strcpy(config.display_connector_right, "HDMI-A-1");
    look();
    expect("connector", FV_CHECK_NOTE, "DP-1 is connected: 32x32 at 50", "budget.hz");
    expect("right connector", FV_CHECK_NOTE, "HDMI-A-1", "budget.hz");
    expect("display refresh", FV_CHECK_NOTE, "shows nothing now", "");
    config.display_connector[0] = config.display_connector_right[0] = 0;
    look();
    expect("display refresh", FV_CHECK_OK, "1000.00 Hz measured", "");
    fake.vblank = false;
    look();
    expect("display refresh", FV_CHECK_NOTE, "no vertical blank", "");
}

static void a_display_that_will_not_do_is_a_fault(void **state)
{
    (void)state;
    static const char *const found[] = {"there is no display card", "in the group", "no display is plugged in", "no connector DP-7",
                                        "no such mode", "is held by another program", "is held by Xorg (process 812)"};
    for (int i = 0; i < 7; i++) {
        begin();
        strcpy(config.display_sink, "kms");
        if (i == 0) fake.card = false;
        if (i == 1) fake.open_fails = EACCES;
        if (i == 2) fake.connected[0] = fake.connected[1] = false;
        if (i == 3) strcpy(config.display_connector, "DP-7");
        if (i == 4) strcpy(config.display_mode, "65x32");
        if (i >= 5) fake.master = EBUSY;
        if (i == 6) {
            char command[256];
            snprintf(command, sizeof command, "mkdir -p %s/sys/kernel/debug/dri/0", program_folder());
            assert_int_equal(system(command), 0);
            static const char clients[] = "             command  tgid dev master a   uid      magic\n"
                                          "               watch   700   0   n    n     0          0\n"
                                          "                Xorg   812   0   y    y     0          0\n";
            program_write("sys/kernel/debug/dri/0/clients", clients, sizeof clients - 1);
        }
        look();
        expect("display", FV_CHECK_FAULT, found[i], i >= 5 ? "systemctl stop" : "display.");
        if (i >= 5) expect("connector", FV_CHECK_OK, "HDMI-A-1 is connected", "");
    }
}

static void lines_are_looked_for_by_name(void **state)
{
    (void)state;
    begin();
    strcpy(config.gpio_vsync, "TE");
    look();
    expect("gpio", FV_CHECK_FAULT, "gpio.chip is not set", "gpiodetect");
    strcpy(config.gpio_chip, "other");
    look();
    expect("gpio", FV_CHECK_FAULT, "there are: board", "gpiodetect");
    strcpy(config.gpio_chip, "board");
    strcpy(config.gpio_strobe, "LED"), strcpy(config.gpio_missed, "NONE"), strcpy(config.gpio_heartbeat, "TE");
    chip.holder[1] = "leds-gpio";
    look();
    expect("gpio", FV_CHECK_OK, "'board' may be opened", "");
    expect("gpio.vsync", FV_CHECK_OK, "line 0, 'TE', is free", "");
    expect("gpio.strobe", FV_CHECK_FAULT, "line 1, 'LED', is held by leds-gpio", "another line");
    expect("gpio.missed", FV_CHECK_FAULT, "no line named 'NONE'", "gpioinfo");
    expect("gpio.heartbeat", FV_CHECK_FAULT, "'TE' is gpio.vsync already", "of its own");
    chip.holds_fails = EIO;
    look();
    expect("gpio.vsync", FV_CHECK_FAULT, "Input/output error", "");
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(what_is_not_asked_for_is_not_looked_at),
                                       cmocka_unit_test(a_display_is_looked_at_and_left_as_it_was),
                                       cmocka_unit_test(a_display_that_will_not_do_is_a_fault),
                                       cmocka_unit_test(lines_are_looked_for_by_name)};
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
