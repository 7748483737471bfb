/* watchdog: it sleeps while it is fed, and ends what has stopped, also a sandboxed run; and cores that are named. */
#define _GNU_SOURCE
#include "platform/watchdog.h"

#include "platform/clock.h"
#include "platform/threads.h"
#include "tests/support/program.h"

#include <sched.h>

static int64_t now(void)
{
    return fv_clock_now_ns(&fv_clock_monotonic);
}

/* Fed every ms for `fed_ms`, then `stop`ped or not, then silent for two seconds: exits 0. */
static int silent_after(int fed_ms, bool stop, double *took_s)
{
    int status;
    int64_t from_ns = now();
    fflush(NULL);
    pid_t child = fork();
    if (child == 0) {
        dup2(open("/dev/null", O_WRONLY), STDERR_FILENO);
        fv_watchdog_open();
        for (int i = 0; i < fed_ms; i++) {
            fv_watchdog_feed(0.4, now());
            usleep(1000);
        }
        if (stop) fv_watchdog_feed(0, 0);
        fv_clock_sleep_until_ns(&fv_clock_monotonic, now() + 2000000000);
        _exit(0);
    }
    assert_int_equal(waitpid(child, &status, 0), child);
    *took_s = 1e-9 * (double)(now() - from_ns);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

static void silence_ends_the_program(void **state)
{
    (void)state;
    double took_s;
    assert_int_equal(silent_after(1000, false, &took_s), FV_WATCHDOG_EXIT);
    assert_true(took_s > 1.2);
    assert_int_equal(silent_after(10, true, &took_s), 0);
}

/* Calls that are never two seconds apart, of which one comes too early to set the timer again. */
static void seldom_is_enough(void **state)
{
    (void)state;
    int status;
    fflush(NULL);
    pid_t child = fork();
    if (child == 0) {
        static const int after_ms[] = {0, 450, 1750};
        dup2(open("/dev/null", O_WRONLY), STDERR_FILENO);
        fv_watchdog_open();
        for (int i = 0; i < 3; i++) {
            fv_clock_sleep_until_ns(&fv_clock_monotonic, now() + after_ms[i] * INT64_C(1000000));
            fv_watchdog_feed(2, now());
        }
        _exit(0);
    }
    assert_int_equal(waitpid(child, &status, 0), child);
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) fail_msg("status %x", status);
}

#define SMALL "--set scene.name=cornell --set display.headset=small --set threads.workers=2 --set output.tape=off "

static void a_run_that_stops_is_ended(void **state)
{
    (void)state;
    struct program_result r = program("run " SMALL "--frames 3 --set budget.watchdog_s=0.2 --set budget.pace=vsync --set budget.hz=1 --out late");
    if (r.code != 3 || !strstr(r.errors, "watchdog: no frame for 0.2 s")) fail_msg("exit %d: %s", r.code, r.errors);
    r = program("run " SMALL "--frames 3 --set budget.watchdog_s=30 --out even");
    if (r.code) fail_msg("exit %d: %s", r.code, r.errors);
}

static void cores_that_are_named_are_kept_to(void **state)
{
    (void)state;
    static const char *const bad[] = {"x", "3-1", "-1", "0-", "0,,1", "5000", "0;1"};
    char list[64];
    cpu_set_t before, after;
    struct fv_error error;
    assert_int_equal(sched_getaffinity(0, sizeof before, &before), 0);
    int first = 0;
    while (!CPU_ISSET(first, &before)) first++;
    for (unsigned i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        struct program_result r = program("plan " SMALL "--set threads.cores='%s'", bad[i]);
        if (r.code != 2 || !strstr(r.errors, "--set: threads.cores: ")) fail_msg("%s: exit %d: %s", bad[i], r.code, r.errors);
        assert_int_equal(fv_threads_keep_to(bad[i], &error), -1);
    }
    snprintf(list, sizeof list, "%d,1000-1001", first);
    assert_int_equal(fv_threads_keep_to(list, &error), 0);
    assert_int_equal(fv_threads_cores(), 1);
    assert_int_equal(sched_getaffinity(0, sizeof after, &after), 0);
    assert_true(CPU_ISSET(first, &after));
    assert_int_equal(sched_setaffinity(0, sizeof before, &before), 0);
    struct program_result r = program("plan --set scene.name=cornell --set display.headset=small --set threads.cores=%d", first);
    assert_int_equal(r.code, 0);
    assert_non_null(strstr(r.output, "worker stacks"));
    assert_true(strstr(r.output, "worker stacks") > strstr(r.output, "left out")); /* one worker: none is needed */
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(silence_ends_the_program),
                                       cmocka_unit_test(seldom_is_enough),
                                       cmocka_unit_test(a_run_that_stops_is_ended),
                                       cmocka_unit_test(cores_that_are_named_are_kept_to)};
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
