/* realtime_run: the board's extras through the command line: a run that is refused all of them, what the plan
 * says, and that a plain run asks the system for nothing. */
#define _GNU_SOURCE
#include "platform/realtime.h"

#include "tests/support/program.h"
#include "tests/support/stripped.h"

/* `foveola` as nobody, without real-time priority, with 64 KB of memory to lock; -1 where that cannot be
 * made. */
static int run_stripped(const char *arguments)
{
    int status, program_fd = open(FV_PROGRAM, O_RDONLY);
    char line[2048];
    assert_true(program_fd >= 0);
    assert_int_equal(chmod(program_folder(), 0777), 0);
    fflush(NULL);
    pid_t child = fork();
    if (child == 0) {
        if (!limit(RLIMIT_RTPRIO, 0) || !limit(RLIMIT_MEMLOCK, 64 << 10) || !become_nobody()) _exit(99);
        snprintf(line, sizeof line, "cd %s && /proc/self/fd/%d %s 2>errors >/dev/null", program_folder(),
                 program_fd, arguments);
        execl("/bin/sh", "sh", "-c", line, (char *)NULL);
        _exit(99);
    }
    close(program_fd);
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFEXITED(status));
    return WEXITSTATUS(status) == 99 ? -1 : WEXITSTATUS(status);
}

#define SMALL "--set scene.name=cornell --set display.headset=small "
#define HEADSET "--config " FV_SOURCE_DIR "/config/boards/headset.ini "

static const struct {
    const char *key, *what;
} asked_by_headset[] = {{"threads.pin", "pinned workers"},
                        {"threads.fifo", "real-time class"},
                        {"threads.lock_memory", "locked memory"},
                        {"threads.cpu_latency_us", "short wake-up"}};

static void a_run_refused_everything_goes_on_and_says_why(void **state)
{
    (void)state;
    static char json[1 << 17];
    char errors[8192], arguments[1024], path[256], words[128];
    static const char board[] = "[threads]\npin=on\nfifo=5\nlock_memory=on\ncpu_latency_us=0\n";
    program_write("board.ini", board, strlen(board));
    snprintf(path, sizeof path, "%s/board.ini", program_folder());
    assert_int_equal(chmod(path, 0644), 0);
    snprintf(arguments, sizeof arguments,
             "run " SMALL "--config board.ini --frames 3 --out refused --set threads.sealed_heap=fatal "
             "--set threads.workers=%d",
             fv_threads_cores() + 1);
    int code = run_stripped(arguments);
    if (code < 0) {
        print_message("no rights can be dropped here: skipped\n");
        skip();
    }
    snprintf(path, sizeof path, "%s/errors", program_folder());
    program_slurp(path, errors, sizeof errors);
    if (code) fail_msg("exit %d: %s", code, errors);
    snprintf(path, sizeof path, "%s/refused/report.json", program_folder());
    program_slurp(path, json, sizeof json);
    for (int i = 0; i < FV_REALTIME_EXTRAS; i++) {
        snprintf(words, sizeof words, "foveola: %s: refused: ", asked_by_headset[i].key);
        const char *line = strstr(errors, words);
        if (!line) fail_msg("'%s' is not in: %s", words, errors);
        assert_null(strstr(line + 1, words));
        snprintf(words, sizeof words,
                 "{\"what\":\"%s\",\"kind\":\"thread\",\"kept\":false,\"reason\":\"refused: ",
                 asked_by_headset[i].what);
        if (!strstr(json, words)) fail_msg("report.json lacks %s", words);
    }
}

static void plan_says_what_is_asked(void **state)
{
    (void)state;
    char row[128];
    struct program_result r = program("plan " SMALL HEADSET);
    if (r.code) fail_msg("exit %d: %s", r.code, r.errors);
    for (int asked = 1; asked >= 0; asked--) {
        const char *left_out = strstr(r.output, "\nleft out");
        assert_non_null(left_out);
        for (int i = 0; i < FV_REALTIME_EXTRAS; i++) {
            snprintf(row, sizeof row, "\nthread   %s ", asked_by_headset[i].what);
            const char *found = strstr(r.output, row);
            if (!found) fail_msg("no row '%s' in: %s", row, r.output);
            if ((found < left_out) != asked) fail_msg("'%s' should be %s", row, asked ? "kept" : "left out");
        }
        assert_null(strstr(r.errors, "refused"));
        r = program("plan " SMALL);
        assert_int_equal(r.code, 0);
    }
}

static void a_plain_run_asks_the_system_for_nothing(void **state)
{
    (void)state;
    static char calls[1 << 20];
    char command[1024], path[128];
    skip_without_own_heap(); /* sanitizers make calls of their own */
    if (system("strace -o /dev/null true 2>/dev/null") != 0) {
        print_message("strace cannot trace here: skipped\n");
        skip();
    }
    snprintf(command, sizeof command,
             "cd %s && strace -f -e trace=%%memory,openat,sched_setscheduler,sched_setparam,sched_setattr,"
             "sched_setaffinity,prlimit64 -o calls %s run %s --frames 2 --out plain 2>/dev/null",
             program_folder(), FV_PROGRAM, SMALL);
    assert_int_equal(system(command), 0);
    snprintf(path, sizeof path, "%s/calls", program_folder());
    program_slurp(path, calls, sizeof calls);
    assert_non_null(strstr(calls, "report.json"));
    static const char *const changes[] = {"sched_set", "mlock", "cpu_dma_latency"};
    for (unsigned i = 0; i < sizeof changes / sizeof changes[0]; i++)
        if (strstr(calls, changes[i])) fail_msg("a call that holds '%s'", changes[i]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_run_refused_everything_goes_on_and_says_why),
        cmocka_unit_test(plan_says_what_is_asked),
        cmocka_unit_test(a_plain_run_asks_the_system_for_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
