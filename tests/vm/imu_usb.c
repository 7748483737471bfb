/* imu_usb: imu.source=usb against the kernel's own USB in a virtual machine (vm.sh, imu_usb.sh): a gadget like an HTC
 * Vive at 1 kHz, whose reports are as long as its packets; unplugged and plugged in under load; and what is said where
 * it is not there, may not be opened, or is another one. */
#include "tests/support/program.h"

static char output[1 << 16];

/* The part of the output under a headline. */
static const char *part(const char *name)
{
    static char text[1 << 14];
    char headline[64];
    snprintf(headline, sizeof headline, "== %s\n", name);
    const char *from = strstr(output, headline), *to = from ? strstr(from + 3, "\n== ") : NULL;
    assert_non_null(from);
    from += strlen(headline);
    size_t length = to ? (size_t)(to + 1 - from) : strlen(from);
    assert_true(length < sizeof text);
    memcpy(text, from, length);
    text[length] = 0;
    return text;
}

static double value(const char *text, const char *name)
{
    char line[64];
    snprintf(line, sizeof line, "\n%s ", name);
    const char *at = strncmp(text, line + 1, strlen(line + 1)) == 0 ? text - 1 : strstr(text, line);
    if (!at) fail_msg("no %s in: %s", name, text);
    return atof(at + strlen(line));
}

static int boot(void **state)
{
    (void)state;
    char command[2048], path[256];
    snprintf(path, sizeof path, "%s/vm.txt", program_folder());
    snprintf(command, sizeof command, "sh %s/tests/vm/vm.sh '%s' %s/tests/vm/imu_usb.sh %s %s >%s 2>&1", FV_SOURCE_DIR,
             FV_VM_CACHE, FV_SOURCE_DIR, FV_VM_PROBE, FV_VM_GADGET, path);
    int status = system(command), code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    program_slurp(path, output, sizeof output);
    fputs(output, stdout);
    if (code == 77) exit(77);
    return code;
}

static void refusals(void **state)
{
    (void)state;
    assert_non_null(strstr(part("absent"), "no inertial sensor is plugged in; known are 28de:2000 (vive)"));
    assert_non_null(strstr(part("forbidden"), "28de:2000 (vive) is there, but /dev/bus/usb/001/002 may not be opened"));
    assert_non_null(strstr(part("forbidden"), "config/udev/70-foveola-imu.rules"));
    assert_non_null(strstr(part("other"), "no USB device of serial number 'LHR-2' is plugged in"));
    assert_non_null(strstr(part("interface"), "interface 3 has no endpoint for reports of 52 bytes"));
    assert_non_null(strstr(part("unknown"), "1d6b:0002 is not known; imu.layout must say"));
}

/* 30 s at 1 kHz and 10 degrees a second: nothing is lost, and nothing allocated. */
static void steady(void **state)
{
    (void)state;
    const char *text = part("steady");
    assert_true(value(text, "lost") == 0 && value(text, "reconnects") == 0 && value(text, "rejected") <= 2);
    assert_true(value(text, "heap_calls") == 0 && value(text, "usb_refused") == 0);
    assert_true(value(text, "turned_deg") > 295 && value(text, "turned_deg") < 305);
    assert_true(value(text, "fastest_deg") < 0.5);
    assert_non_null(strstr(text, "driver given back: yes"));
}

static void unplugged(void **state)
{
    (void)state;
    const char *text = part("unplugged");
    assert_non_null(strstr(text, "driver detached: no"));
    assert_non_null(strstr(text, "vive: unplugged; it is searched for"));
    assert_non_null(strstr(text, "vive: reports come again"));
    assert_true(value(text, "reconnects") == 2 && value(text, "lost") == 0);
    assert_true(value(text, "heap_calls") == 0 && value(text, "usb_refused") == 0);
    /* Held while it was gone: 4 to 6 s of 12. A pose that was predicted is taken back, 1 degree at most. */
    assert_true(value(text, "turned_deg") > 50 && value(text, "turned_deg") < 90);
    assert_true(value(text, "fastest_deg") < 1.5);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(refusals), cmocka_unit_test(steady), cmocka_unit_test(unplugged)};
    return cmocka_run_group_tests(tests, boot, program_clean);
}
