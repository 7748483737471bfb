/* calibrate: the verb as its users meet it: simulated eyes that look at the targets, and how far off fresh
 * gazes are by the calibration that comes of it; the same bytes from the recording; what ends it. */
#include "sensors/eye/calibration.h"
#include "sensors/eye/frame_tape.h"
#include "sensors/eye/image_sim.h"
#include "sensors/eye/targets.h"
#include "sensors/eye/tracker.h"
#include "sensors/sensors.h"
#include "tests/support/program.h"

#include <math.h>

enum { WIDTH = 240, HEIGHT = 160 };
#define SIM                                                                                                  \
    "--set eye.source=sim-camera --set eye.width=240 --set eye.height=160 --set eye.hz=30 --set "            \
    "display.headset="                                                                                       \
    "small --set threads.sealed_heap=fatal "

static char first[1 << 19], second[1 << 19];

static const char *path_of(const char *name)
{
    static char path[256];
    snprintf(path, sizeof path, "%s/%s", program_folder(), name);
    return path;
}

static int compare(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* The median angle between true gazes of the simulated eyes at other times and what the map makes of them. */
static double median_off_deg(const struct fv_calibration *c, int eye)
{
    enum { FRESH = 120 };
    static uint8_t pixels[WIDTH * HEIGHT];
    static _Alignas(64) uint8_t scratch[4 << 20];
    struct fv_eye_camera camera = fv_eye_camera_usual(WIDTH, HEIGHT, 1 + (uint64_t)eye);
    struct fv_eye_settings settings = {
        .map = c->map[eye], .model = FV_EYE_MODEL_USUAL, .confidence = 0.5, .leds = camera.leds};
    struct fv_eye_tracker tracker;
    struct fv_eye_frame frame = {pixels, WIDTH, HEIGHT, WIDTH};
    double off[FRESH];
    int n = 0;
    assert_true(fv_pupil_scratch_bytes(WIDTH, HEIGHT) <= sizeof scratch);
    fv_eye_tracker_begin(&tracker, &settings, scratch, sizeof scratch);
    for (int i = 0; i < FRESH; i++) {
        struct fv_eye_state s;
        struct fv_eye_look look;
        fv_eye_state_at(1, eye, INT64_C(500000000) * 60 + i * INT64_C(110000000), &s);
        fv_eye_image(&camera, &s, pixels, WIDTH, NULL);
        fv_eye_tracker_frame(&tracker, &frame, s.t_ns, &look);
        if (!look.seen) continue;
        double truth[2], direction[3] = {-s.direction[0], s.direction[1], s.direction[2]};
        fv_gaze_degrees(direction, truth);
        off[n++] = hypot(look.at_deg[0] - truth[0], look.at_deg[1] - truth[1]);
    }
    assert_true(n > FRESH / 2);
    qsort(off, (size_t)n, sizeof off[0], compare);
    print_message("eye %d: %d fresh gazes, median %.2f degrees off, 90 %% %.2f\n", eye, n, off[n / 2],
                  off[n * 9 / 10]);
    return off[n / 2];
}

static void from_targets_to_gaze(void **state)
{
    (void)state;
    struct fv_calibration c;
    struct fv_error error;
    struct program_result r = program("calibrate --points 9 " SIM "--set output.eye_frames=on --out a");
    if (r.code) fail_msg("exit %d: %s", r.code, r.errors);
    assert_non_null(strstr(r.errors, "left eye: 9 of 9 targets"));
    assert_non_null(strstr(r.errors, "right eye: 9 of 9 targets"));
    assert_non_null(strstr(r.errors, "run with --set eye.calibration=a/calibration.csv"));
    assert_string_equal(r.output, "");
    if (fv_calibration_read(&c, path_of("a/calibration.csv"), &error)) fail_msg("%s", error.text);
    assert_true(c.width == WIDTH && c.height == HEIGHT && c.map[0].pupil.terms == 6 &&
                c.map[1].pupil.terms == 6);
    for (int eye = 0; eye < 2; eye++) assert_true(median_off_deg(&c, eye) < 1);
    static const char *const files[] = {"a/report.html",      "a/left-00000.png",   "a/right-00008.png",
                                        "a/tape/targets.csv", "a/tape/left.frames", "a/tape/right.frames"};
    for (unsigned i = 0; i < sizeof files / sizeof files[0]; i++)
        if (!fv_file_exists(path_of(files[i]))) fail_msg("%s is missing", files[i]);
    program_slurp(path_of("a/calibration.csv"), first, sizeof first);
    /* From the tape: the same bytes. */
    r = program("calibrate --set eye.source=tape --set eye.device=a/tape --set eye.leds=6 --out b "
                "--set threads.sealed_heap=fatal");
    if (r.code) fail_msg("exit %d: %s", r.code, r.errors);
    program_slurp(path_of("b/calibration.csv"), second, sizeof second);
    assert_string_equal(first, second);
    /* It is what run takes. */
    r = program("run " SIM
                "--frames 2 --set scene.name=cornell --set eye.calibration=b/calibration.csv --out run");
    if (r.code) fail_msg("exit %d: %s", r.code, r.errors);
}

/* Other sinks; an earlier calibration that is named, and not even there, plays no part. */
static void streams(void **state)
{
    (void)state;
    struct program_result r =
        program("calibrate --points 5 " SIM "--set display.sink=y4m --set display.y4m_path=t.y4m "
                "--set budget.hz=20 --set eye.calibration=old.csv --out y");
    if (r.code) fail_msg("exit %d: %s", r.code, r.errors);
    assert_false(fv_file_exists(path_of("y/left-00000.png")));
    program_slurp(path_of("t.y4m"), first, sizeof first);
    assert_memory_equal(first, "YUV4MPEG2 W", 11);
    r = program("calibrate --points 5 " SIM "--set display.sink=none --out none");
    assert_int_equal(r.code, 0);
    assert_false(fv_file_exists(path_of("none/left-00000.png")));
    /* A reader that goes away ends the pictures, not the calibration. */
    r = program("calibrate --points 5 " SIM
                "--set display.sink=y4m --set display.y4m_path=/dev/full --out full");
    assert_int_equal(r.code, 2);
}

/* A recording of an eye that looks at 9 places in turn or at none, and a log of 9 or fewer targets; 1: of the
 * same one 9 times. */
static void record(const char *name, bool moves, int targets)
{
    static uint8_t pixels[64 * 64];
    static struct fv_writer out;
    struct fv_error error;
    char path[256];
    struct fv_eye_camera camera = fv_eye_camera_usual(64, 64, 1);
    struct fv_camera_layout layout = {fv_camera_format_named("GREY"), 64, 64, 64};
    camera.px_per_mm = 3;
    camera.leds = 0;
    snprintf(path, sizeof path, "%s/%s", program_folder(), name);
    assert_int_equal(fv_folder_make(path, &error), 0);
    snprintf(path, sizeof path, "%s/%s/left.frames", program_folder(), name);
    assert_int_equal(fv_writer_open(&out, path, &error), 0);
    fv_frame_tape_begin(&out, &layout);
    for (int i = 0; i < 9 * 20; i++) {
        struct fv_eye_state s = {.t_ns = i * INT64_C(20000000), .pupil_mm = 5.5, .open = 1};
        double at[2] = {moves ? 15 * (i / 20 % 3 - 1) : 3, moves ? 10 * (i / 60 - 1) : 3};
        fv_gaze_vector(at, s.direction);
        s.direction[0] = -s.direction[0];
        fv_eye_image(&camera, &s, pixels, 64, NULL);
        fv_frame_tape_write(&out, s.t_ns, pixels, sizeof pixels);
    }
    assert_int_equal(fv_writer_close(&out, &error), 0);
    snprintf(path, sizeof path, "%s/%s/targets.csv", program_folder(), name);
    assert_int_equal(fv_writer_open(&out, path, &error), 0);
    fv_targets_begin(&out);
    for (int i = 0; i < 9; i++) {
        struct fv_target_shown s = {.t_ns = i * INT64_C(400000000),
                                    .from_ns = i * INT64_C(400000000) + 1000000};
        s.until_ns = s.t_ns + 399000000;
        if (targets > 1) s.at_deg[0] = 15 * (i % 3 - 1), s.at_deg[1] = 10 * (i / 3 - 1);
        if (targets == 1 || i < targets) fv_targets_row(&out, &s);
    }
    assert_int_equal(fv_writer_close(&out, &error), 0);
}

#define TAPE "--set eye.source=tape --set 'eye.model=0.5 0.55 0.459' --set eye.device="

static void refusals(void **state)
{
    (void)state;
    static const struct {
        const char *arguments, *message;
        int code;
    } cases[] = {
        {TAPE "good", "left eye: 9 of 9 targets", 0},
        {TAPE "still", "not calibrated: left eye: the pupil did not move", 1},
        {TAPE "same", "not calibrated: left eye: all targets are at the same place", 1},
        {TAPE "few", "not calibrated: left eye: fewer than 5 targets", 1},
        {"--points 7", "--points 7: must be 5, 9 or 13", 2},
        {"--points 9x", "--points 9x: must be", 2},
        {"--frames 3", "no such option", 2},
        {"", "eye.source: 'sim' has no cameras to calibrate", 2},
        {"--set eye.source=none", "eye.source: 'none' has no cameras", 2},
        {"--set eye.source=v4l2", "eye.device: no camera is named", 2},
        {"--set eye.source=v4l2 --set eye.device=/nowhere/camera", "/nowhere/camera: No such file", 2},
        {"--set eye.source=tape", "eye.device must name", 2},
        {"--set eye.source=tape --set eye.tape=gaze.csv", "eye.tape: a calibration is made of frames", 2},
        {TAPE "nowhere", "nowhere/targets.csv: No such file", 2},
        {TAPE "bad", "bad/targets.csv:3: must be", 2},
        {TAPE "empty", "empty/left.frames: No such file", 2},
        {SIM "--set display.sink=y4m --set display.y4m_path=/nowhere/y", "/nowhere/y: cannot be written", 2},
        {SIM "--out /proc/foveola", "/proc/foveola", 2}};
    record("good", true, 9);
    record("still", false, 9);
    record("same", true, 1);
    record("few", true, 4);
    assert_int_equal(mkdir(path_of("bad"), 0777) | mkdir(path_of("empty"), 0777), 0);
    static const char head[] =
        "# foveola targets 1\nt_ns,from_ns,until_ns,right_deg,up_deg\n0,500,1200,0,0\n";
    program_write("empty/targets.csv", head, sizeof head - 1);
    program_write("bad/targets.csv", head, sizeof head - 4);
    for (unsigned i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        /* A sanitized program has no sandbox, and says so. */
        struct program_result r = program(
            "calibrate --set threads.sandbox=off %s%s", strstr(cases[i].arguments, "--out") ? "" : "--out out ", cases[i].arguments);
        if (r.code != cases[i].code) fail_msg("%s: exit %d: %s", cases[i].arguments, r.code, r.errors);
        if (!strstr(r.errors, cases[i].message))
            fail_msg("%s: '%s' does not hold '%s'", cases[i].arguments, r.errors, cases[i].message);
        if (r.code == 0) {
            assert_true(fv_file_exists(path_of("out/calibration.csv")));
            char command[256];
            snprintf(command, sizeof command, "rm -r %s/out", program_folder());
            assert_int_equal(system(command), 0);
            continue;
        }
        char *end = strchr(r.errors, '\n');
        if (!end || end[1]) fail_msg("%s: not one line: %s", cases[i].arguments, r.errors);
        assert_false(fv_file_exists(path_of("out/calibration.csv")));
        if (r.code == 2) assert_int_equal(access(path_of("out/tape"), F_OK), -1);
    }
}

/* Ctrl-C: nothing is left that looks like a calibration. */
static void ended_by_a_signal(void **state)
{
    (void)state;
    char command[1024];
    snprintf(command, sizeof command,
             "cd %s && (%s calibrate " SIM
             "--set budget.pace=vsync --out ended 2>ended.txt & p=$!; sleep 1; kill -INT $p; "
             "kill -TERM $p; wait $p; echo $? >ended.code)",
             program_folder(), FV_PROGRAM);
    assert_int_equal(system(command), 0);
    program_slurp(path_of("ended.code"), first, sizeof first);
    assert_string_equal(first, "1\n");
    program_slurp(path_of("ended.txt"), first, sizeof first);
    assert_non_null(strstr(first, "ended before all targets were shown"));
    assert_false(fv_file_exists(path_of("ended/calibration.csv")));
    assert_true(fv_file_exists(path_of("ended/tape/targets.csv")));
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(from_targets_to_gaze), cmocka_unit_test(streams),
                                       cmocka_unit_test(refusals), cmocka_unit_test(ended_by_a_signal)};
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
