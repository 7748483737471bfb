/* arm64: the arm64 program in an arm64 machine (vm.sh, arm64.sh): it renders from the kernel's test camera and an
 * inertial sensor on USB, and this machine's program, which replays what it recorded, renders the same pictures. */
#include "tests/support/picture.h"
#include "tests/support/vm.h"

enum { FRAMES = 12, APART_MAX = 1 };

static int boot(void **state)
{
    (void)state;
    return vm_boot("arm64.sh");
}

static void devices(void **state)
{
    (void)state;
    const char *text = vm_part("devices");
    assert_true(vm_value(text, "exit") == 0);
    assert_true(vm_number(text, "frames", "frames") == FRAMES);
    assert_true(vm_number(text, "sealed", "heap_calls") == 0 && vm_number(text, "sealed", "memory_syscalls") == 0);
    /* 1.2 s: 75 pictures and 1000 readings a second, without those before the first frame. */
    double pictures = vm_number(text, "cameras", "frames") + vm_number(text, "cameras", "skipped");
    if (pictures < 70) fail_msg("only %g pictures of the camera", pictures);
    if (vm_number(text, "imu", "readings") < 1000) fail_msg("only %g readings", vm_number(text, "imu", "readings"));
    assert_true(vm_number(text, "cameras", "lost") == 0 && vm_number(text, "imu", "lost") == 0);
    assert_non_null(strstr(text, "\"cpu\":\"Cortex-A57\",\"isa\":\"neon\""));
    assert_null(strstr(text, "refused")); /* lists of system calls least of all */
}

/* The largest difference of a channel, 0..255. */
static int apart(const struct picture *a, const struct picture *b)
{
    assert_true(a->width == b->width && a->height == b->height);
    int most = 0;
    for (int i = 0; i < 3 * a->width * a->height; i++)
        if (abs(a->rgb[i] - b->rgb[i]) > most) most = abs(a->rgb[i] - b->rgb[i]);
    return most;
}

/* In the widest instruction set of this machine, and in the one that has as many lanes as NEON. What was latched and
 * decided there holds here, so only the arithmetic differs: 1/255 where rounding falls on the other side. */
static void same_pictures(void **state)
{
    (void)state;
    static const char *const isas[] = {"auto", "base"};
    for (int of = 0; of < 2; of++) {
        struct program_result r = program("replay devices --set threads.isa=%s --out %s", isas[of], isas[of]);
        if (r.code) fail_msg("exit %d: %s", r.code, r.errors);
        int most = 0;
        for (int n = 0; n < 2 * FRAMES; n++) {
            char path[2][256];
            struct picture p[2];
            for (int i = 0; i < 2; i++) {
                snprintf(path[i], sizeof path[i], "%s/%s/%s-%05d.png", program_folder(), i ? isas[of] : "devices",
                         n % 2 ? "right" : "left", n / 2);
                p[i] = picture_read(path[i]);
            }
            int d = apart(&p[0], &p[1]);
            if (d > APART_MAX) fail_msg("%s and %s are %d/255 apart", path[0], path[1], d);
            most = d > most ? d : most;
            free(p[0].rgb), free(p[1].rgb);
        }
        print_message("%s: %d pictures, at most %d/255 apart\n", isas[of], 2 * FRAMES, most);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(devices), cmocka_unit_test(same_pictures)};
    return cmocka_run_group_tests(tests, boot, program_clean);
}
