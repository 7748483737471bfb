/* eye_camera: eye.source=v4l2 against the kernel's own interface in a virtual machine (vm.sh, eye_camera.sh), while
 * `foveola run` renders: the kernel's test camera in every format, its faults, unplugged and plugged in; a loopback
 * camera at 120 Hz that shows an eye whose gaze is known. */
#include "tests/support/vm.h"

#include <math.h>

static int boot(void **state)
{
    (void)state;
    return vm_boot("eye_camera.sh");
}

/* What holds of every run: it ends well, all its frames are there, and nothing was allocated. */
static void whole(const char *text, int frames)
{
    assert_true(vm_value(text, "exit") == 0);
    assert_true(vm_number(text, "frames", "frames") == frames);
    assert_true(vm_number(text, "sealed", "heap_calls") == 0 && vm_number(text, "sealed", "memory_syscalls") == 0);
}

static double camera(const char *text, const char *key)
{
    return vm_number(text, "cameras", key);
}

static void refusals(void **state)
{
    (void)state;
    assert_true(vm_value(vm_part("absent"), "exit") == 2 && vm_value(vm_part("other"), "exit") == 2);
    assert_non_null(strstr(vm_part("absent"), "eye.device: /dev/v4l/by-id/eye: No such file or directory"));
    assert_non_null(strstr(vm_part("other"), "no camera (Inappropriate ioctl for device); must be a capture device"));
    const char *text = vm_part("faults");
    assert_true(vm_value(text, "busy exit") == 2);
    assert_non_null(strstr(text, "eye.device: /dev/v4l/by-id/eye: in use by another program"));
}

/* 75 pictures a second for 0.4 s, and those of the start. */
static void formats(void **state)
{
    (void)state;
    static const char *const name[] = {"GREY", "Y10", "Y16", "YUYV", "NV12"};
    for (int i = 0; i < 5; i++) {
        char said[96];
        const char *text = vm_part(name[i]);
        snprintf(said, sizeof said, "(vivid): %s 640x480, 75.01 Hz; asked for %s 640x480, 75 Hz", name[i], name[i]);
        whole(text, 4);
        assert_non_null(strstr(text, said));
        assert_true(camera(text, "frames") + camera(text, "skipped") >= 25 && camera(text, "gaps") <= 8);
        assert_true(camera(text, "rejected") + camera(text, "untimed") + camera(text, "errors") == 0);
        assert_true(camera(text, "lost") == 0);
    }
}

/* vivid shows only about 90 of 120 pictures a second, as it counts time in 250ths, and numbers them all: what it leaves
 * out is a gap, and nothing else is. */
static void fast(void **state)
{
    (void)state;
    const char *text = vm_part("fast");
    whole(text, 20);
    assert_non_null(strstr(text, "GREY 200x120, 120 Hz"));
    double frames = camera(text, "frames") + camera(text, "skipped"), all = frames + camera(text, "gaps");
    assert_true(all >= 237 && all <= 250 && frames >= 0.7 * all);
    assert_true(camera(text, "untimed") + camera(text, "errors") + camera(text, "lost") == 0);
}

/* Each fault is counted, and frames come again after each. */
static void faults(void **state)
{
    (void)state;
    const char *text = vm_part("faults");
    whole(text, 70);
    assert_true(camera(text, "rejected") == 3);                            /* damaged */
    assert_true(camera(text, "gaps") >= 4 && camera(text, "gaps") <= 40); /* 30 % of 0.5 s, and starts */
    assert_true(camera(text, "errors") >= 5); /* a buffer refused, two streams that broke, two devices gone */
    assert_true(camera(text, "lost") == 4 && camera(text, "restarts") == 4);
    assert_true(camera(text, "frames") + camera(text, "skipped") > 250);
    assert_non_null(strstr(text, "/dev/v4l/by-id/eye: lost (Input/output error); looked for again"));
    assert_non_null(strstr(text, "/dev/v4l/by-id/eye: does not begin to stream: Invalid argument"));
    assert_non_null(strstr(text, "/dev/v4l/by-id/eye: gives no buffers: Invalid argument"));
    assert_non_null(strstr(text, "/dev/v4l/by-id/eye: lost (No such device); looked for again"));
    assert_non_null(strstr(text, "gone from /dev/video0\n"));
    assert_non_null(strstr(text, "back as /dev/video1\n"));
}

/* 5 s at 120 Hz, nothing lost; and where the eye looked, in turn, the gaze is. */
static void loop(void **state)
{
    (void)state;
    static const double way_deg[][2] = {{0, 0}, {12, 0}, {-12, 0}, {0, 8}, {5, -8}};
    enum { WAYS = sizeof way_deg / sizeof way_deg[0] };
    const char *text = vm_part("loop"), *line = strstr(text, "t_ns,left_x");
    whole(text, 50);
    double frames = camera(text, "frames") + camera(text, "skipped");
    assert_true(frames >= 595 && frames <= 630 && camera(text, "gaps") == 0);
    assert_true(camera(text, "untimed") + camera(text, "rejected") + camera(text, "errors") + camera(text, "lost") == 0);
    assert_non_null(line);
    int way = 0, rows = 0, seen[WAYS] = {0};
    while ((line = strchr(line, '\n')) && strncmp(++line, "vm:", 3) != 0) {
        double x, y, z;
        if (sscanf(line, "%*[0-9],%lf,%lf,%lf,1", &x, &y, &z) != 3) continue;
        rows++;
        for (int w = way; w < WAYS && w <= way + 1; w++) {
            double angle = hypot(way_deg[w][0], way_deg[w][1]), sine = angle > 0 ? sin(angle * M_PI / 180) / angle : 0;
            double off_deg = hypot(x - sine * way_deg[w][0], y - sine * way_deg[w][1]) * 180 / M_PI;
            if (off_deg > 1) continue;
            way = w, seen[w]++;
            break;
        }
    }
    for (int w = 0; w < WAYS; w++) assert_true(seen[w] >= 4);
    int near = seen[0] + seen[1] + seen[2] + seen[3] + seen[4];
    assert_true(rows >= 45 && near >= rows - 4);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(refusals), cmocka_unit_test(formats), cmocka_unit_test(fast),
                                       cmocka_unit_test(faults), cmocka_unit_test(loop)};
    return cmocka_run_group_tests(tests, boot, program_clean);
}
