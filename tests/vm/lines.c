/* lines: section gpio against the kernel's own interface in a virtual machine (vm.sh, lines.sh), on a made-up chip
 * (gpio-sim): a display's line as the clock of the frames, a button, outputs as they are seen from outside. */
#include "tests/support/vm.h"

#include <math.h>

static int boot(void **state)
{
    (void)state;
    return vm_boot("lines.sh");
}

/* 200 frames at the line's 20 Hz, not at the settings' 21: each pulse has one, and nothing is allocated. */
static void inputs(void **state)
{
    (void)state;
    const char *text = vm_part("lines");
    assert_non_null(strstr(text, "exit 0"));
    assert_int_equal(vm_number(text, "gpio", "lines"), 5);
    assert_true(fabs(vm_number(text, "gpio", "vsync_hz") - 20) < 0.05);
    double vsyncs = vm_number(text, "gpio", "vsyncs");
    assert_true(vsyncs >= 195 && vsyncs <= 205 && vm_number(text, "gpio", "odd") <= 1);
    assert_true(vm_number(text, "skipped", "skipped") <= 1);
    assert_int_equal(vm_number(text, "gpio", "presses"), 2);
    assert_int_equal(vm_number(text, "gpio", "errors"), 0);
    assert_true(vm_number(text, "sealed", "heap_calls") == 0 && vm_number(text, "sealed", "memory_syscalls") == 0);
}

/* Each frame changes its lines once. */
static void outputs(void **state)
{
    (void)state;
    const char *text = vm_part("lines");
    assert_int_equal(vm_number(text, "gpio", "strobes"), 200);
    assert_in_range((int)vm_value(text, "changes"), 199, 201);
    assert_in_range((int)vm_value(text, "heartbeat changes"), 199, 201);
}

static void refusals(void **state)
{
    (void)state;
    assert_non_null(strstr(vm_part("nochip"), "gpio.chip: there is no 'other'; there are: board (gpiochip0)"));
    assert_non_null(strstr(vm_part("nochip"), "exit 2"));
    assert_non_null(strstr(vm_part("noline"), "gpio.vsync: the chip board has no line named 'NONE'"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(inputs), cmocka_unit_test(outputs), cmocka_unit_test(refusals)};
    return cmocka_run_group_tests(tests, boot, program_clean);
}
