/* board: camera, inertial sensor, lines and display at once, as on a board, by one configuration, in a virtual machine (vm.sh,
 * board.sh): `foveola check` finds it ready, then `foveola run` loses nothing for ten seconds; and `foveola calibrate`. */
#include "tests/support/vm.h"

#include <math.h>
#include <stdbool.h>

static int boot(void **state)
{
    (void)state;
    return vm_boot("board.sh");
}

/* Rows of the table: what, its state, and part of what was found. */
static const struct {
    const char *what, *state, *found;
} rows[] = {
    {"eye camera", "ok", " Hz measured; /dev/v4l/by-id/eye (Dummy video device (0x0000)): GREY 192x192, 120 Hz"},
    {"right eye camera", "-", "not set"},
    {"eye calibration", "note", "none: gaze by eye.model"},
    {"inertial sensor", "ok", "28de:2000 (vive), may be opened"},
    {"display", "ok", "/dev/dri/card0 may be opened, and nobody holds it"},
    {"connector", "ok", "Virtual-1 is connected: 1024x768 at 60.00 Hz"},
    {"display refresh", "ok", "60.00 Hz measured, in the mode that is on now"},
    {"gpio", "ok", "the chip 'board' may be opened"},
    {"gpio.button", "ok", "'KEY', is free"},
    {"gpio.strobe", "ok", "'STROBE', is free"},
    {"gpio.missed", "ok", "'LATE', is free"},
    {"gpio.heartbeat", "ok", "'BEAT', is free"},
};

static bool has_row(const char *text, unsigned i)
{
    for (const char *line = text; line; line = strchr(line, '\n')) {
        char what[64], of[400], *end;
        line += *line == '\n';
        if (!*line) return false;
        snprintf(of, sizeof of, "%.399s", line);
        if ((end = strchr(of, '\n'))) *end = 0;
        snprintf(what, sizeof what, "%-24s %-6s ", rows[i].what, rows[i].state);
        if (strlen(of) > 9 && strncmp(of + 9, what, strlen(what)) == 0) return strstr(of, rows[i].found) != NULL;
    }
    return false;
}

static void checked(void **state)
{
    (void)state;
    const char *text = vm_part("check");
    assert_non_null(strstr(text, "exit 0\n"));
    assert_non_null(strstr(text, "\nready\n"));
    assert_null(strstr(text, "FAULT"));
    for (unsigned i = 0; i < sizeof rows / sizeof rows[0]; i++)
        if (!has_row(text, i)) fail_msg("no row '%s  %s  %s'", rows[i].what, rows[i].state, rows[i].found);
    const char *camera = strstr(text, "eye camera               ok     ");
    assert_true(camera && fabs(atof(camera + 32) - 120) < 2);
}

/* Ten seconds at 60, 120 and 1000 a second. */
static void ran(void **state)
{
    (void)state;
    const char *text = vm_part("board");
    assert_non_null(strstr(text, "exit 0\n"));
    /* The first frames teach their prices; then, threads of devices go first, and there is one core for all. */
    assert_true(vm_at(text, "frames") == 600 && vm_at(text, "skipped") <= 30);
    double taken = vm_at(text, "gaze.cameras.frames") + vm_at(text, "gaze.cameras.skipped");
    assert_true(taken > 1180 && taken < 1320);
    assert_true(vm_at(text, "gaze.cameras.gaps") == 0 && vm_at(text, "gaze.cameras.lost") == 0);
    assert_true(vm_at(text, "gaze.cameras.rejected") + vm_at(text, "gaze.cameras.untimed") == 0);
    assert_true(vm_at(text, "gaze.cameras.no_pupil") == 0 && vm_at(text, "gaze.lost") <= 2);
    assert_true(vm_at(text, "imu.readings") > 9300 && vm_at(text, "imu.readings") < 11000);
    /* The one core serves the bus late at times (devices.c, without a display and locked memory: none is lost). */
    assert_true(vm_at(text, "imu.lost") <= 3 && vm_at(text, "imu.reconnects") == 0);
    /* Heads of frames before the sensor spoke: for half a second (board.sh), and as long as the script takes. */
    assert_true(vm_at(text, "imu.rejected") <= 60);
    assert_true(vm_at(text, "display.flips") == 600 && vm_at(text, "display.dropped") == 0);
    assert_true(vm_at(text, "display.lost") == 0 && vm_at(text, "display.busy") == 0 && vm_at(text, "display.odd") == 0);
    assert_true(fabs(vm_at(text, "display.measured_hz") - 60) < 0.1);
    assert_true(vm_at(text, "pictures.taken") == 600 && vm_at(text, "pictures.failed") == 0);
    assert_true(vm_at(text, "tape.rows") > 10000 && vm_at(text, "tape.dropped") == 0);
    assert_true(vm_at(text, "sealed.heap_calls") == 0 && vm_at(text, "sealed.memory_syscalls") == 0);
    assert_non_null(strstr(text, "</html>"));
}

/* As they are seen from outside. */
static void lines(void **state)
{
    (void)state;
    const char *text = vm_part("board");
    assert_int_equal(vm_at(text, "gpio.lines"), 4);
    assert_int_equal(vm_at(text, "gpio.strobes"), 600);
    assert_int_equal(vm_value(text, "strobe changes"), vm_at(text, "display.flips"));
    assert_int_equal(vm_value(text, "heartbeat changes"), 600);
    assert_in_range((int)vm_value(text, "missed changes"), 0, 60);
    assert_int_equal(vm_at(text, "gpio.presses"), 1);
    assert_int_equal(vm_at(text, "gpio.errors"), 0);
}

/* What the board's settings ask for was granted, and rights were given up. */
static void granted(void **state)
{
    (void)state;
    const char *text = vm_part("board");
    assert_null(strstr(text, "refused"));
    const char *sandbox = strstr(text, "\"what\":\"sandbox\"");
    assert_non_null(sandbox);
    assert_non_null(strstr(sandbox, "\"kept\":true"));
}

/* The same board calibrates: targets on its display, rights given up as in a run. */
static void calibrated(void **state)
{
    (void)state;
    const char *text = vm_part("calibrate");
    assert_non_null(strstr(text, "exit 0\n"));
    assert_non_null(strstr(text, "(vkms): Virtual-1 1024x768, 60.00 Hz"));
    assert_non_null(strstr(text, "calibration.csv\n"));
    assert_null(strstr(text, "sandbox"));
    assert_true(vm_value(text, "read 32x32 twice, black") < 2 * 32 * 32); /* a target is on it */
    assert_non_null(strstr(text, "console text"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(checked), cmocka_unit_test(ran), cmocka_unit_test(lines),
                                       cmocka_unit_test(granted), cmocka_unit_test(calibrated)};
    return cmocka_run_group_tests(tests, boot, program_clean);
}
