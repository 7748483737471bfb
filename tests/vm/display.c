/* display: display.sink=kms against the kernel's own displays in a virtual machine (vm.sh, display.sh): one with a
 * vertical blank (vkms) and two without (bochs, virtio-gpu): rates, pictures read back, the way out, and what is said where the
 * display cannot be had. */
#include "tests/support/vm.h"

#include <math.h>

static int boot(void **state)
{
    (void)state;
    return vm_boot("display.sh");
}

/* 600 frames at the display's refresh: each refresh has a new one, and nothing is allocated; what is shown is what the
 * png sink writes, byte by byte. */
static void steady(void **state)
{
    (void)state;
    const char *text = vm_part("steady");
    assert_non_null(strstr(text, "exit 0"));
    assert_non_null(strstr(text, "(vkms): Virtual-1 1024x768, 60.00 Hz; atomic, 3 buffers"));
    assert_non_null(strstr(text, "the display refreshes at 60.00 Hz, budget.hz says 75"));
    assert_true(vm_number(text, "display", "flips") == 600 && vm_number(text, "display", "skipped") == 0);
    assert_true(vm_number(text, "display", "dropped") == 0 && vm_number(text, "display", "busy") == 0);
    assert_true(vm_number(text, "display", "odd") == 0 && vm_number(text, "display", "lost") == 0);
    assert_true(fabs(vm_number(text, "display", "measured_hz") - 60) < 0.1);
    assert_true(vm_number(text, "sealed", "heap_calls") == 0 && vm_number(text, "sealed", "memory_syscalls") == 0);
    assert_non_null(strstr(text, "console graphics"));
    assert_non_null(strstr(text, "\nsame pictures\n"));
    assert_true(vm_value(text, "read 24x20 twice, black") < 2 * 24 * 20);
}

/* Without waiting for flips of its own accord, the loop is held to the refresh by the buffers. */
static void held_by_buffers(void **state)
{
    (void)state;
    const char *text = vm_part("free");
    assert_true(vm_number(text, "display", "flips") == 120 && vm_number(text, "display", "skipped") == 0);
    assert_non_null(strstr(text, "2 buffers"));
}

/* What was shown before is shown again, after the last frame and after SIGTERM. */
static void given_back(void **state)
{
    (void)state;
    char before[256];
    snprintf(before, sizeof before, "%s", strstr(vm_part("before"), "shows"));
    *strchr(before, '\n') = 0;
    assert_non_null(strstr(before, "a mode"));
    static const char *const after[] = {"steady", "ended"};
    for (int i = 0; i < 2; i++) {
        const char *text = vm_part(after[i]), *last = strstr(text, "exit 0");
        assert_non_null(last);
        if (!strstr(last, before)) fail_msg("before: %s; %s: %s", before, after[i], last);
    }
}

/* Said once, its mode set again when it is back; the loop goes on meanwhile at the display's pace, and nothing is
 * allocated. */
static void unplugged(void **state)
{
    (void)state;
    const char *text = vm_part("unplugged");
    assert_non_null(strstr(text, "exit 0"));
    assert_non_null(strstr(text, "/dev/dri/card0: display lost (unplugged); looked for again until it is back"));
    assert_true(vm_number(text, "display", "lost") == 1 && vm_number(text, "display", "back") == 1);
    double flips = vm_number(text, "display", "flips"), dropped = vm_number(text, "display", "dropped");
    assert_true(flips + dropped == 480 && dropped >= 60 && dropped <= 220);
    assert_true(vm_number(text, "sealed", "heap_calls") == 0 && vm_number(text, "sealed", "memory_syscalls") == 0);
}

static void refusals(void **state)
{
    (void)state;
    assert_non_null(strstr(vm_part("held"), "another program holds the display"));
    assert_non_null(strstr(vm_part("held"), "exit 2"));
    assert_non_null(strstr(vm_part("refused"), "has no connector DP-9; there are: Virtual-1 (connected)"));
    assert_non_null(strstr(vm_part("refused"), "exit 2"));
    assert_non_null(strstr(vm_part("nomode"), "Virtual-1 has no such mode as display.mode says; it has:"));
}

/* No vertical blank: by the clock, at budget.hz. */
static void blankless(void **state)
{
    static const char *const parts[] = {"bochs", "virtio"}, *const said[] = {"(bochs-drm): Virtual-", "(virtio_gpu): Virtual-"};
    (void)state;
    for (int i = 0; i < 2; i++) {
        const char *text = vm_part(parts[i]);
        assert_non_null(strstr(text, "exit 0"));
        assert_non_null(strstr(text, said[i]));
        assert_non_null(strstr(text, "no vertical blank: paced by the clock"));
        assert_true(vm_number(text, "display", "flips") == 60 && vm_number(text, "display", "lost") == 0);
        assert_true(fabs(vm_number(text, "period_ms", "period_ms") - 50) < 1e-3);
        assert_non_null(strstr(text, "\nsame pictures\n"));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(steady), cmocka_unit_test(held_by_buffers),
                                       cmocka_unit_test(given_back), cmocka_unit_test(unplugged),
                                       cmocka_unit_test(refusals), cmocka_unit_test(blankless)};
    return cmocka_run_group_tests(tests, boot, program_clean);
}
