/* faults: every fault of the design's table (DESIGN.md, "Faults") brought about in a virtual machine (vm.sh, faults.sh), while
 * `foveola run` renders to a display of the kernel's: the run goes on, and report.json has a counter that names it. */
#include "tests/support/vm.h"

#include <stdbool.h>

static int boot(void **state)
{
    (void)state;
    return vm_boot("faults.sh");
}

/* A fault, how it was brought about, the counter in the report of the run, and from what value to what. */
static const struct {
    const char *run, *fault, *how, *counter;
    double least, most;
} rows[] = {
    {"faults", "blink", "lids closed for 0.2 s", "gaze.cameras.blinks", 2, 8},
    {"faults", "no pupil", "a grey picture for 1.4 s", "gaze.cameras.no_pupil", 150, 350},
    {"faults", "low confidence", "lids half closed for 0.4 s", "gaze.cameras.unsure", 10, 120},
    {"faults", "eye lost", "all of these", "gaze.lost", 60, 400},
    {"faults", "camera unplugged", "its driver is unloaded", "gaze.cameras.lost", 1, 3},
    {"faults", "and back", "loaded again, by another name", "gaze.cameras.restarts", 1, 3},
    {"faults", "sensor: NaN, absurd", "floats", "imu.bad", 200, 700},
    {"faults", "sensor: saturated", "500 degrees a second", "imu.saturated", 50, 400},
    {"faults", "sensor: stuck", "the same for 0.4 s", "imu.stuck", 100, 500},
    {"faults", "sensor: dt = 0", "its clock stands still", "imu.repeated", 100, 500},
    {"faults", "sensor: dt < 0", "its clock is set back", "imu.clock_restarts", 3, 6},
    {"faults", "its readings refused", "all of these", "imu.rejected", 300, 2000},
    {"faults", "sensor unplugged", "its port is unbound", "imu.reconnects", 1, 2},
    {"faults", "frames late", "SIGSTOP for 0.3 s", "missed", 1, 200},
    {"faults", "and turned", "shown as of the newest head", "late_corrected", 1, 200},
    {"faults", "refreshes without a frame", "the same", "skipped", 15, 400},
    {"faults", "frames cut", "another takes the processor", "cut_frames", 1, 700},
    {"faults", "flip refused (EBUSY)", "another flips in between", "display.busy", 1, 100},
    {"faults", "display lost", "a flip's event taken; unplugged", "display.lost", 2, 2},
    {"faults", "and back", "its mode set again", "display.back", 2, 2},
    {"faults", "pictures not shown", "the same", "display.dropped", 30, 400},
    {"faults", "heap calls meanwhile", "all of these", "sealed.heap_calls", 0, 0},
    {"faults", "rows of the tape lost", "none, the disk has room", "tape.dropped", 0, 0},
    {"faults", "recordings cut", "none", "tape.cut", 0, 0},
    {"recorded", "disk full", "a tape on 32 KB", "tape.dropped", 100, 1e6},
    {"recorded", "recordings cut", "the same", "tape.cut", 2, 2},
    {"recorded", "pipe closed", "the reader of y4m ends", "pictures.failed", 1, 1},
    {"recorded", "frames all the same", "both", "frames", 120, 120},
};

static void counted(void **state)
{
    (void)state;
    int failed = 0;
    print_message("%-26s %-32s %-24s %10s\n", "fault", "brought about by", "counter", "value");
    for (unsigned i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        double value = vm_at(vm_part(rows[i].run), rows[i].counter);
        bool holds = value >= rows[i].least && value <= rows[i].most;
        print_message("%-26s %-32s %-24s %10g%s\n", rows[i].fault, rows[i].how, rows[i].counter, value,
                      holds ? "" : "  NOT AS IT MUST BE");
        failed += !holds;
    }
    assert_int_equal(failed, 0);
}

/* Said, and the run ended as it was told to. */
static void told(void **state)
{
    static const char *const faults[] = {"/dev/v4l/by-id/eye: lost (no good frame for 1",
                                         "; it is searched for",
                                         "generic: reports come again",
                                         "display lost (a flip was never over)",
                                         "display lost (unplugged)",
                                         "\nexit 0\n"};
    static const char *const recorded[] = {"tape/imu.csv: No space left on device: recording ends here, the run goes on",
                                           "/pipe: the reader has closed the pipe; the stream ends: no more pictures are written, "
                                           "the run goes on",
                                           "/out/recorded/tape: the recording is not whole",
                                           "/out/recorded/tape/imu.csv: not whole: No space left on device", "exit 1\n"};
    (void)state;
    const char *text = vm_part("faults");
    for (unsigned i = 0; i < sizeof faults / sizeof faults[0]; i++)
        if (!strstr(text, faults[i])) fail_msg("not said: %s", faults[i]);
    text = vm_part("recorded");
    for (unsigned i = 0; i < sizeof recorded / sizeof recorded[0]; i++)
        if (!strstr(text, recorded[i])) fail_msg("not said: %s", recorded[i]);
}

/* One line that says where and what, exit 2, and nothing is left behind. */
static void refused(void **state)
{
    static const struct {
        const char *part, *said;
    } bad[] = {{"settings", "/bad.ini:3: "}, {"scene", "/bad.obj:4: "}, {"argument", "--frames"}};
    (void)state;
    for (unsigned i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        const char *text = vm_part(bad[i].part);
        if (!strstr(text, bad[i].said) || !strstr(text, "exit 2\n") || strstr(text, "left something"))
            fail_msg("%s: %s", bad[i].part, text);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(counted), cmocka_unit_test(told), cmocka_unit_test(refused)};
    return cmocka_run_group_tests(tests, boot, program_clean);
}
