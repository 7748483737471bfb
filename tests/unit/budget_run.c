/* budget_run: the program itself inside its budget: it adapts and cuts on a budget that does not fit, waits
 * for flips, and ends cleanly whenever it is told to. */
#include "platform/clock.h"
#include "tests/support/program.h"

#include <jansson.h>
#include <signal.h>
#include <stdbool.h>

#define SMALL                                                                                                \
    "--set scene.name=cornell --set display.width=236 --set display.height=292 --set display.eyes=1 "

static json_t *report(const char *folder)
{
    char path[256];
    json_error_t error;
    snprintf(path, sizeof path, "%s/%s/report.json", program_folder(), folder);
    json_t *r = json_load_file(path, 0, &error);
    if (!r) fail_msg("%s: %s", path, error.text);
    return r;
}

static double number(const json_t *r, const char *a, const char *b)
{
    const json_t *value = json_object_get(r, a);
    if (b) value = json_object_get(value, b);
    assert_true(json_is_number(value));
    return json_number_value(value);
}

/* A budget far too small and one far too large: levels of the table only, the smallest where nothing fits,
 * the best where all does. */
static void adapts(void **state)
{
    (void)state;
    static const struct {
        double hz;
        double level_min, level_max; /* of the mean */
        bool cut;
    } cases[] = {{1000, 8.9, 9, true}, {0.01 + 1, 1, 3, false}};
    for (int i = 0; i < 2; i++) {
        struct program_result r =
            program("run " SMALL "--set display.sink=none --set budget.adapt=on --set budget.periods=1 "
                    "--set budget.hz=%g --frames 60 --out adapt",
                    cases[i].hz);
        if (r.code != 0) fail_msg("%s", r.errors);
        json_t *j = report("adapt");
        double mean = number(j, "level", "mean");
        if (!(mean >= cases[i].level_min && mean <= cases[i].level_max) || number(j, "level", "min") < 1 ||
            number(j, "level", "max") > 9)
            fail_msg("%g Hz: mean level %g", cases[i].hz, mean);
        if ((number(j, "cut_frames", NULL) > 0) != cases[i].cut)
            fail_msg("%g Hz: %g frames cut", cases[i].hz, number(j, "cut_frames", NULL));
        json_decref(j);
    }
}

/* Frame by frame at the middle of a scan-out, each later than the one before; every flip in between that no
 * frame was shown at is counted, whether rendering or the sink took too long. */
static void check_flips(const char *folder, int frames, long long period_ns, bool skips)
{
    static char text[1 << 20];
    char path[256], *line;
    long long before = -1, t_ns, frame = -1, skipped = 0;
    snprintf(path, sizeof path, "%s/%s/frames.csv", program_folder(), folder);
    program_slurp(path, text, sizeof text);
    for (line = strchr(text, '\n'); line && sscanf(line + 1, "%lld,%lld", &frame, &t_ns) == 2;
         line = strchr(line + 1, '\n')) {
        assert_int_equal((t_ns - period_ns / 2) % period_ns, 0);
        assert_true(t_ns > before);
        if (before >= 0) skipped += (t_ns - before) / period_ns - 1;
        before = t_ns;
    }
    json_t *j = report(folder);
    double counted = number(j, "skipped", NULL), missed = number(j, "missed", NULL);
    json_decref(j);
    assert_int_equal(frame, frames - 1);
    /* The last frame's own lateness shows in no later one. */
    if ((double)skipped > counted || (counted > 0) != (missed > 0) || (skips && skipped == 0))
        fail_msg("%s: %lld flips without a frame, %g counted, %g frames missed", folder, skipped, counted,
                 missed);
}

static void waits_for_flips(void **state)
{
    (void)state;
    int64_t start_ns = fv_clock_now_ns(&fv_clock_monotonic);
    struct program_result r = program("run " SMALL "--set display.sink=none --set budget.adapt=on "
                                      "--set budget.pace=vsync --set budget.hz=20 --frames 40 --out paced");
    double seconds = (double)(fv_clock_now_ns(&fv_clock_monotonic) - start_ns) * 1e-9;
    if (r.code != 0) fail_msg("%s", r.errors);
    if (seconds < 39 / 20.0) fail_msg("40 frames at 20 Hz took %g s", seconds);
    check_flips("paced", 40, 50000000, false);
    /* Pictures that take longer to write than a period. */
    r = program("run " SMALL
                "--set display.sink=png --set budget.pace=vsync --set budget.hz=500 --frames 20 --out slow");
    if (r.code != 0) fail_msg("%s", r.errors);
    check_flips("slow", 20, 2000000, true);
}

/* From the start to long after it: nothing is left half-written, and a run that had begun leaves its report.
 */
static void ends_when_told(void **state)
{
    (void)state;
    static const int signals[] = {SIGINT, SIGTERM, SIGHUP};
    static const int after_ms[] = {0, 2, 5, 10, 20, 40, 80, 150, 300, 600};
    int begun = 0;
    for (int i = 0; i < 20 || (begun == 0 && i < 40); i++) {
        char out[64], path[128];
        snprintf(out, sizeof out, "told-%d", i);
        pid_t child = fork();
        if (child == 0) {
            if (chdir(program_folder()) || !freopen("/dev/null", "w", stderr)) _exit(99);
            execl(FV_PROGRAM, "foveola", "run", "--set", "scene.name=cornell", "--set", "display.width=236",
                  "--set", "display.height=292", "--set", i % 2 ? "budget.pace=vsync" : "budget.pace=free",
                  "--set", "budget.hz=3", "--set", "display.sink=none", "--out", out, (char *)NULL);
            _exit(99);
        }
        /* The last ones long after any start. */
        usleep((useconds_t)(1000 * (i < 20 ? after_ms[i / 2] : 500 * (i - 18))));
        kill(child, signals[i % 3]);
        int status;
        assert_int_equal(waitpid(child, &status, 0), child);
        snprintf(path, sizeof path, "%s/%s", program_folder(), out);
        if (access(path, F_OK) != 0) continue; /* before anything was written */
        begun++;
        if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
            fail_msg("run %d, signal %d: status %x", i, signals[i % 3], status);
        json_decref(report(out));
    }
    assert_true(begun > 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(adapts),
        cmocka_unit_test(waits_for_flips),
        cmocka_unit_test(ends_when_told),
    };
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
