/* Replay: a recorded session gives the same bytes again whatever the clock decided while it ran; recordings
 * that cannot be followed end with 2 and one line. */
#include "tests/support/program.h"
#include "platform/files.h"

#define SMALL "--set scene.name=cornell --set display.headset=small --set threads.workers=2 "
/* Far more than any machine does in time. */
#define HURRIED SMALL "--set budget.adapt=on --set budget.hz=1000 "

/* No frame is in time. */
#define LATE SMALL "--set method.name=full --set method.spp=4 --set budget.pace=vsync --set budget.hz=120 "

/* A shell command in the fresh folder; its exit code. */
static int shell(const char *command)
{
    char text[1024];
    snprintf(text, sizeof text, "cd %s && %s", program_folder(), command);
    int status = system(text);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

/* Every picture and sample of b is a's. */
static void expect_same(const char *a, const char *b)
{
    char command[512];
    snprintf(
        command, sizeof command,
        "test -e %s/left-00000.png && for f in %s/*.png %s/tape/*.csv; do cmp $f %s/${f#%s/} || exit 1; done",
        b, b, b, a, b);
    if (shell(command)) fail_msg("%s is not %s again", b, a);
}

static void record(const char *name, const char *settings)
{
    struct program_result r = program("run %s --frames 24 --out %s", settings, name);
    if (r.code) fail_msg("exit %d: %s", r.code, r.errors);
}

static void replay(const char *of, const char *into, const char *more)
{
    struct program_result r = program("replay %s --out %s %s", of, into, more);
    if (r.code) fail_msg("exit %d: %s", r.code, r.errors);
}

static void what_was_decided_is_done_again(void **state)
{
    (void)state;
    static const struct {
        const char *name, *settings, *holds; /* an expression that some row of decisions.csv must match */
    } cases[] = {
        {"plain", SMALL, "^306666659,0,-1,-1,-1,-1$"},
        {"full", SMALL "--set method.name=full", "^306666659,0,-1$"},
        {"adapts", HURRIED, "^[0-9]*,[1-9],.*,[0-9][0-9]*$"},
        {"waits", HURRIED "--set budget.pace=vsync", "^[0-9]*,[1-9],.*,[0-9][0-9]*$"},
        {"waits-only", SMALL "--set budget.pace=vsync --set budget.hz=200", "^[0-9]*,0,[0-9]*,-1,-1,-1,-1$"},
        {"holds", SMALL "--set budget.pace=vsync --set budget.hz=200 --set display.late=hold", "^[0-9]*,0,-1,-1,-1,-1$"},
        {"turns", LATE, "^[0-9]*,0,[0-9][0-9]*,-1$"},
        {"turns-lens", LATE "--set display.lens=radial --set display.lens_unit_px=128 --set display.lens_x_px=120 --set display.lens_y_px=128 "
                       "--set \"display.lens_red=0.98 0\"", "^[0-9]*,0,[0-9][0-9]*,-1$"},
    };
    for (unsigned i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char command[256], again[64], third[64];
        record(cases[i].name, cases[i].settings);
        snprintf(command, sizeof command,
                 "test $(wc -l <%s/tape/decisions.csv) = 26 && grep -q '%s' %s/tape/decisions.csv",
                 cases[i].name, cases[i].holds, cases[i].name);
        if (shell(command)) fail_msg("%s: no decision is like %s", cases[i].name, cases[i].holds);
        snprintf(again, sizeof again, "%s-2", cases[i].name);
        snprintf(third, sizeof third, "%s-3", cases[i].name);
        replay(cases[i].name, again, "--set threads.workers=1"); /* another machine's workers */
        expect_same(cases[i].name, again);
        replay(again, third, "");
        expect_same(cases[i].name, third);
    }
    /* Periods were left out: a row's time is no number of periods behind the one before. */
    assert_int_equal(
        shell("awk -F, 'NR > 3 && $1 - before > 1500000 { found = 1 } { before = $1 } END { exit !found }' "
              "waits/tape/decisions.csv"),
        0);
}

/* Pictures of frames that missed their flips were turned, by what the recording says: without it they are others. */
static void late_pictures_are_turned_again(void **state)
{
    (void)state;
    assert_int_equal(shell("grep -q '\"late_corrected\":[1-9]' turns/report.json && grep -q '\"late_corrected\":[1-9]' turns-2/report.json"), 0);
    assert_int_equal(shell("test $(wc -l <turns/tape/head.csv) -gt $(wc -l <turns/tape/decisions.csv)"), 0);
    replay("turns", "held", "--set display.late=hold");
    assert_int_equal(shell("for f in turns/left-*.png; do cmp -s $f held/${f#turns/} && echo same; done | grep -c same | grep -q '^[0-9]$'"), 0);
    assert_int_equal(shell("grep -q '\"late_corrected\":0' held/report.json"), 0);
}

static void parts_and_other_settings(void **state)
{
    (void)state;
    record("session", HURRIED);
    replay("session", "part", "--frames 5");
    assert_int_equal(shell("rm part/tape/*.csv"), 0); /* of fewer frames */
    assert_int_equal(shell("cmp session/left-00003.png part/left-00003.png"), 0);
    /* Nothing but times was decided: another method, another size. */
    record("calm", SMALL);
    replay("calm", "other", "--set method.name=full --set display.width=100");
    replay("calm", "unseen", "--set display.sink=none");
    assert_int_equal(shell("cmp calm/tape/decisions.csv unseen/tape/decisions.csv"), 0);
    /* As recorded before there were decisions. */
    assert_int_equal(shell("cp -r calm old && rm old/tape/decisions.csv"), 0);
    replay("old", "old-2", "");
    expect_same("calm", "old-2");
}

/* What is made of a recording, and what the one line must hold. */
static const struct {
    const char *change, *arguments, *message;
} bad[] = {
    {":", "--frames 25", "replay: --frames 25: 24 were recorded"},
    {":", "--set method.name=full", "decisions.csv:3: level and tiles of a method with other stages"},
    {":", "--set display.width=32 --set display.height=32", "not of pictures of this size"},
    {"echo 23 >tape/frames", "", "decisions.csv:26: more rows than the 23 frames"},
    {"echo 25 >tape/frames", "", "decisions.csv:26: fewer rows than the 25 frames"},
    {"echo 9223372036854775807 >tape/frames", "--frames 3", "fewer rows"},
    {"sed -i 7s/,[1-9],/,10,/ tape/decisions.csv", "", "decisions.csv:7: level 10; must be 0 to 9"},
    {"sed -i 7s/,[1-9],/,-3,/ tape/decisions.csv", "", "decisions.csv:7: the level is not a number"},
    {"sed -i 7s/,[1-9],/,,/ tape/decisions.csv", "", "decisions.csv:7: the level is not a number"},
    {"sed -i 7s/$/000000/ tape/decisions.csv", "", "decisions.csv:7: "},
    {"sed -i 2s/sample/simple/ tape/decisions.csv", "",
     "decisions.csv:3: level and tiles of a method with other"},
    {"sed -i 1s/1/2/ tape/decisions.csv", "", "decisions.csv:1: not decisions of a version that is known"},
    {": >tape/decisions.csv", "", "decisions.csv:1: not decisions"},
    {"head -c 100 /dev/zero >tape/decisions.csv", "", "decisions.csv:1: not decisions"},
    {"rm tape/decisions.csv && mkdir tape/decisions.csv", "", "decisions.csv: not a regular file"},
    {"rm tape/decisions.csv && mkfifo tape/decisions.csv", "", "decisions.csv: not a regular file"},
    {"rm tape/decisions.csv && truncate -s 300M tape/decisions.csv", "", "more than the 268435456 allowed"},
};

static void bad_recordings_end_with_2_and_one_line(void **state)
{
    (void)state;
    record("good", HURRIED "--set display.sink=none");
    for (unsigned i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        char command[256], path[128];
        snprintf(command, sizeof command, "rm -rf bad && cp -r good bad && cd bad && %s", bad[i].change);
        assert_int_equal(shell(command), 0);
        struct program_result r = program("replay bad --out never %s", bad[i].arguments);
        char *error = strstr(r.errors, "foveola: scene cornell:"), *end;
        error = error ? strchr(error, '\n') + 1 : r.errors;
        end = strchr(error, '\n');
        if (r.code != 2) fail_msg("%s: exit %d: %s", bad[i].change, r.code, r.errors);
        if (!strstr(error, bad[i].message))
            fail_msg("%s: '%s' does not hold '%s'", bad[i].change, error, bad[i].message);
        if (!end || end[1]) fail_msg("%s: not one line: %s", bad[i].change, error);
        snprintf(path, sizeof path, "%s/never", program_folder());
        if (fv_file_exists(path)) fail_msg("%s: wrote into the folder", bad[i].change);
    }
}

/* A run that would record over the tape that it plays is refused, and the tape is as it was. */
static void tapes_that_are_played_are_kept(void **state)
{
    (void)state;
    static const char *const over[] = {"--set imu.source=tape --set imu.tape=kept/tape/head.csv --out kept",
                                       "--set eye.source=tape --set eye.tape=./kept/tape/gaze.csv --out kept/../kept",
                                       "--set eye.source=tape --set eye.device=kept/tape --out kept"};
    record("kept", SMALL);
    assert_int_equal(shell("cp -r kept before"), 0);
    for (unsigned i = 0; i < sizeof over / sizeof over[0]; i++) {
        struct program_result r = program("run " SMALL "--frames 2 %s", over[i]);
        if (r.code != 2 || !strstr(r.errors, "kept/tape, which this run records anew: name another --out"))
            fail_msg("%s: exit %d: %s", over[i], r.code, r.errors);
        assert_int_equal(shell("diff -r kept before"), 0);
    }
    struct program_result r = program("run " SMALL "--frames 2 --set output.tape=off %s", over[0]);
    assert_int_equal(r.code, 0);
    assert_int_equal(shell("cmp kept/tape/head.csv before/tape/head.csv"), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_was_decided_is_done_again),
        cmocka_unit_test(late_pictures_are_turned_again),
        cmocka_unit_test(parts_and_other_settings),
        cmocka_unit_test(bad_recordings_end_with_2_and_one_line),
        cmocka_unit_test(tapes_that_are_played_are_kept),
    };
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
