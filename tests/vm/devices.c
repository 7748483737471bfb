/* devices: eye camera and inertial sensor at once against the kernel's own interfaces, in a virtual machine (vm.sh,
 * devices.sh), while `foveola run` renders: 30 s without a loss, then both unplugged and plugged in again. */
#include "tests/support/vm.h"

static int boot(void **state)
{
    (void)state;
    return vm_boot("devices.sh");
}

/* What holds of every run: it ends well, all its frames are there, and nothing was allocated. */
static void whole(const char *text, int frames)
{
    assert_true(vm_value(text, "exit") == 0);
    assert_true(vm_number(text, "frames", "frames") == frames);
    assert_true(vm_number(text, "sealed", "heap_calls") == 0 && vm_number(text, "sealed", "memory_syscalls") == 0);
}

/* 30 s: 120 frames and 1000 reports a second, none lost, and an eye that is seen all the time. */
static void steady(void **state)
{
    (void)state;
    const char *text = vm_part("steady");
    whole(text, 300);
    double frames = vm_number(text, "cameras", "frames") + vm_number(text, "cameras", "skipped");
    assert_true(frames > 3590 && frames < 3630);
    assert_true(vm_number(text, "cameras", "gaps") == 0 && vm_number(text, "cameras", "lost") == 0);
    assert_true(vm_number(text, "cameras", "rejected") == 0 && vm_number(text, "cameras", "untimed") == 0);
    assert_true(vm_number(text, "imu", "readings") >= 30000 && vm_number(text, "imu", "readings") <= 30300);
    assert_true(vm_number(text, "imu", "lost") == 0 && vm_number(text, "imu", "reconnects") == 0);
    assert_true(vm_number(text, "gaze", "lost") <= 2);
}

/* Both gone and back, the camera by another name; the sensor once more. Every frame is rendered all the same. */
static void unplugged(void **state)
{
    (void)state;
    const char *text = vm_part("unplugged");
    whole(text, 120);
    assert_true(vm_number(text, "imu", "reconnects") == 2 && vm_number(text, "imu", "lost") == 0);
    assert_true(vm_number(text, "cameras", "lost") == 1 && vm_number(text, "cameras", "restarts") == 1);
    assert_true(vm_number(text, "cameras", "frames") > 500 && vm_number(text, "gaze", "lost") > 10);
    assert_non_null(strstr(text, "camera gone: \n"));
    assert_non_null(strstr(text, "/dev/v4l/by-id/eye: lost (no good frame for 1"));
    /* The bus says so, or its transfers fail all at once: whichever comes first. */
    assert_non_null(strstr(text, "; it is searched for"));
    assert_non_null(strstr(text, "vive: reports come again"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(steady), cmocka_unit_test(unplugged)};
    return cmocka_run_group_tests(tests, boot, program_clean);
}
