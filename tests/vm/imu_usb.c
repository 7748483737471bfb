/* imu_usb: imu.source=usb against the kernel's own USB in a virtual machine (vm.sh, imu_usb.sh): a gadget like an HTC
 * Vive at 1 kHz, whose reports are as long as its packets; unplugged and plugged in under load; and what is said where
 * it is not there, may not be opened, or is another one. */
#include "tests/support/vm.h"

static int boot(void **state)
{
    (void)state;
    return vm_boot("imu_usb.sh");
}

static void refusals(void **state)
{
    (void)state;
    assert_non_null(strstr(vm_part("absent"), "no inertial sensor is plugged in; known are 28de:2000 (vive)"));
    assert_non_null(strstr(vm_part("forbidden"), "28de:2000 (vive) is there, but /dev/bus/usb/001/002 may not be opened"));
    assert_non_null(strstr(vm_part("forbidden"), "config/udev/70-foveola-imu.rules"));
    assert_non_null(strstr(vm_part("other"), "no USB device of serial number 'LHR-2' is plugged in"));
    assert_non_null(strstr(vm_part("interface"), "interface 3 has no endpoint for reports of 52 bytes"));
    assert_non_null(strstr(vm_part("unknown"), "1d6b:0002 is not known; imu.layout must say"));
}

/* 10 s (30: devices.c) at 1 kHz and 10 degrees a second: nothing is lost, and nothing allocated. */
static void steady(void **state)
{
    (void)state;
    const char *text = vm_part("steady");
    assert_true(vm_value(text, "lost") == 0 && vm_value(text, "reconnects") == 0 && vm_value(text, "rejected") <= 2);
    assert_true(vm_value(text, "heap_calls") == 0 && vm_value(text, "usb_refused") == 0);
    assert_true(vm_value(text, "turned_deg") > 97 && vm_value(text, "turned_deg") < 103);
    assert_true(vm_value(text, "fastest_deg") < 0.5);
    assert_non_null(strstr(text, "driver given back: yes"));
}

static void unplugged(void **state)
{
    (void)state;
    const char *text = vm_part("unplugged");
    assert_non_null(strstr(text, "driver detached: no"));
    /* The bus says so, or its transfers fail all at once: whichever comes first. */
    assert_non_null(strstr(text, "; it is searched for"));
    assert_non_null(strstr(text, "vive: reports come again"));
    assert_true(vm_value(text, "reconnects") == 2 && vm_value(text, "lost") == 0);
    assert_true(vm_value(text, "heap_calls") == 0 && vm_value(text, "usb_refused") == 0);
    /* Held while it was gone: 4 to 6 s of 12. A pose that was predicted is taken back, 1 degree at most. */
    assert_true(vm_value(text, "turned_deg") > 50 && vm_value(text, "turned_deg") < 90);
    assert_true(vm_value(text, "fastest_deg") < 1.5);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(refusals), cmocka_unit_test(steady), cmocka_unit_test(unplugged)};
    return cmocka_run_group_tests(tests, boot, program_clean);
}
