/* progress: what a run says while it runs, on a terminal of any width, and at its end. */
#include "tests/support/program.h"

static const char run[] = "run --set scene.name=cornell --set display.headset=small --set display.sink=none "
                          "--set output.tape=off --set threads.workers=1";

/* The line that begins with a word and spaces, "" where there is none; a copy, without its end. */
static const char *line_of(const char *text, const char *word)
{
    static char line[512];
    size_t length = strlen(word);
    line[0] = 0;
    for (const char *at = text; *at; at += strcspn(at, "\n"), at += *at == '\n')
        if (strncmp(at, word, length) == 0 && at[length] == ' ')
            snprintf(line, sizeof line, "%.*s", (int)strcspn(at, "\n"), at);
    return line;
}

static void the_table_of_stages_is_aligned(void **unused)
{
    (void)unused;
    static const char *const stages[] = {"select", "support", "reproject", "sample"};
    char head[512];
    struct program_result r = program("%s --frames 20 --out a", run);
    assert_int_equal(r.code, 0);
    assert_string_equal(r.output, "");
    snprintf(head, sizeof head, "%s", line_of(r.errors, "stage"));
    for (size_t i = 0; i < sizeof stages / sizeof stages[0]; i++) {
        const char *line = line_of(r.errors, stages[i]);
        double number[6];
        if (strlen(line) != strlen(head)) fail_msg("%s is not in line with:\n%s\n%s", stages[i], head, line);
        assert_int_equal(sscanf(line, "%*s %lf %lf %lf %lf %lf %lf", &number[0], &number[1], &number[2],
                                &number[3], &number[4], &number[5]),
                         6);
        assert_true(number[0] > 0 && number[1] > 0);
        assert_true(number[1] <= number[2] && number[2] <= number[3]);
        assert_true(number[4] > 0 && number[4] <= 100);
    }
}

/* At 1000 Hz every frame is late; at 1 Hz none is. */
static void late_frames_have_a_hint(void **unused)
{
    (void)unused;
    static const struct {
        const char *settings, *hint; /* "": none */
    } rows[] = {
        {"--set budget.hz=1000", "--set budget.adapt=on"},
        {"--set budget.hz=1000 --set method.name=full", "--set method.name=reproject --set budget.adapt=on"},
        {"--set budget.hz=1", ""},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        struct program_result r =
            program("%s --frames 5 --out b %s --set display.width=400", run, rows[i].settings);
        assert_int_equal(r.code, 0);
        const char *hint = strstr(r.errors, "late frames: ");
        if (!hint != !rows[i].hint[0] || (hint && !strstr(hint, rows[i].hint)))
            fail_msg("%s:\n%s", rows[i].settings, r.errors);
    }
}

/* What a terminal gets up to a carriage return is never wider than it is. */
static void the_live_line_fits_the_terminal(void **unused)
{
    (void)unused;
    static const int widths[] = {1, 20, 79, 200};
    static char shown[1 << 16];
    char command[1024], path[128];
    if (system("script -qc true /dev/null >/dev/null 2>&1") != 0) {
        print_message("skipped: no script(1) here\n");
        return;
    }
    for (size_t i = 0; i < sizeof widths / sizeof widths[0]; i++) {
        snprintf(
            command, sizeof command,
            "cd %s && script -qc 'stty cols %d; %s %s --frames 40 --out c 2>&1' shown >/dev/null </dev/null",
            program_folder(), widths[i], FV_PROGRAM, run);
        assert_int_equal(system(command), 0);
        snprintf(path, sizeof path, "%s/shown", program_folder());
        program_slurp(path, shown, sizeof shown);
        int lines = 0;
        for (const char *at = shown; (at = strstr(at, "\rf")); lines++) {
            size_t length = strcspn(++at, "\033\r\n");
            if (length >= (size_t)widths[i] && length > 0) fail_msg("%.*s", (int)length, at);
            if (widths[i] == 200) assert_non_null(strstr(at, "missed"));
            if (widths[i] >= 79) assert_int_equal(strncmp(at, "frame ", 6), 0);
        }
        assert_true(lines > 0 || widths[i] == 1);
        assert_non_null(strstr(shown, "40 frames of cornell"));
    }
}

static void frames_csv_has_every_frame(void **unused)
{
    (void)unused;
    static char text[1 << 16];
    char path[128];
    struct program_result r = program("%s --frames 37 --out d", run);
    assert_int_equal(r.code, 0);
    snprintf(path, sizeof path, "%s/d/frames.csv", program_folder());
    program_slurp(path, text, sizeof text);
    int rows = 0;
    for (const char *at = text; (at = strchr(at, '\n')); at++) rows++;
    assert_int_equal(rows, 38);
}

int main(void)
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_table_of_stages_is_aligned),
        cmocka_unit_test(late_frames_have_a_hint),
        cmocka_unit_test(the_live_line_fits_the_terminal),
        cmocka_unit_test(frames_csv_has_every_frame),
    };
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
