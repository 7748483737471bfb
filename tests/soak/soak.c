/* soak: hours of a session in made-up time: the real program, its threads and its devices' code, with faults dealt out by
 * a seed.
 *
 *   world.c          the clock, and whose turn it is
 *   *_device.c       camera, inertial sensor, display
 *   faults.c         what goes wrong, and when
 *   watch.c          what must not change by that
 *   soak.c           the sessions, each in a process of its own, as a run ends but once
 *
 * soak HOURS SEED [SABOTAGE]: the long session lasts so many hours, the others minutes. Exit code 0, or 1 with what is
 * wrong, by seed, session and time. SABOTAGE: a fault of the soak's own that it must find. Runs of one seed deal out the
 * same faults at the same times; only processor times and when a signal arrives within a frame are the machine's. */
#define _GNU_SOURCE
#include "cli/cli.h"
#include "tests/soak/devices.h"
#include "tests/soak/faults.h"
#include "tests/soak/watch.h"
#include "tests/soak/world.h"
#include "tests/support/random.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

static const char *const settings[] = {
    "scene.name=cornell",    "method.name=reproject", "display.eyes=2",     "display.width=16",   "display.height=16",
    "budget.hz=20",          "budget.pace=vsync",     "budget.adapt=on",    "threads.workers=1",  "threads.sandbox=off",
    "threads.sealed_heap=count", "eye.source=v4l2",   "eye.device=/dev/eye", "eye.format=GREY",   "eye.width=64",
    "eye.height=64",         "eye.hz=60",             "imu.source=usb",     "output.tape=on",     "budget.memory_mb=512",
    "eye.model=0.5 0.5 0.459"};
enum { SETTINGS = sizeof settings / sizeof settings[0] };

/* Sessions; parts of their length at which something happens, the disk being full after ten minutes at the latest; what
 * ends them, and how the run then exits. */
static const struct session {
    const char *name, *sink;
    double hours; /* 0: as long as is asked for */
    double disk_full, pipe_closed, log_closed;
    int end_signal, exit_code;
    bool replayed; /* from its tape, afterwards */
} sessions[] = {
    {"long", "kms", 0, 0.1, 0, 0, SIGINT, FV_EXIT_NOT_HELD, false},
    {"whole", "kms", 0.03, 0, 0, 0.5, SIGTERM, FV_EXIT_DONE, true},
    {"stream", "y4m", 0.03, 0, 0.5, 0, SIGHUP, FV_EXIT_NOT_HELD, false},
    {"pictures", "png", 0.015, 0.5, 0, 0, SIGTERM, FV_EXIT_NOT_HELD, false},
};
enum { SESSIONS = sizeof sessions / sizeof sessions[0] };

static const struct sabotage {
    const char *name;
    bool *flag;
} sabotages[] = {{"descriptor", &devices_leak}, {"memory", &watch_hoard}, {"counter", &faults_swallow},
                 {"keep", &faults_keep},        {"slow", &watch_slow}};
enum { SABOTAGES = sizeof sabotages / sizeof sabotages[0] };

static char folder[64];
static int reader = -1, log_reader = -1, log_file = -1; /* of these, what a session closes */

static void drain(int *from, int to, bool closed)
{
    static char bytes[1 << 16];
    ssize_t n;
    while (*from >= 0 && (n = read(*from, bytes, sizeof bytes)) > 0)
        if (to >= 0 && write(to, bytes, (size_t)n) < 0) break;
    if (closed && *from >= 0) close(*from), *from = -1, watch_closed++;
}

/* Who reads what the program writes. */
static void each_frame(void)
{
    drain(&reader, -1, faults_pipe_closed);
    drain(&log_reader, log_file, faults_log_closed);
}

ssize_t __real_write(int fd, const void *bytes, size_t size);
ssize_t __wrap_write(int fd, const void *bytes, size_t size);

/* A full disk takes a part of what is written, then nothing. */
ssize_t __wrap_write(int fd, const void *bytes, size_t size)
{
    static bool part = true;
    struct stat status;
    if (!faults_disk_full || fstat(fd, &status) != 0 || !S_ISREG(status.st_mode)) return __real_write(fd, bytes, size);
    if (part && size > 2) {
        part = false;
        return __real_write(fd, bytes, size / 3);
    }
    errno = ENOSPC;
    return -1;
}

static void set(struct fv_config_request *request, const char *key, const char *value)
{
    static char text[8][128];
    static int used;
    snprintf(text[used], sizeof text[used], "%s=%s", key, value);
    request->set[request->sets++] = text[used++];
}

/* The log goes to a file, or through a pipe whose reader may go away. */
static void lead_log(const struct session *s, const char *path)
{
    int ends[2];
    log_file = open(path, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
    if (s->log_closed == 0) {
        dup2(log_file, STDERR_FILENO);
        return;
    }
    if (pipe2(ends, O_CLOEXEC | O_NONBLOCK)) abort();
    dup2(ends[1], STDERR_FILENO);
    close(ends[1]);
    log_reader = ends[0];
}

static bool holds(const char *path, const char *text)
{
    static char bytes[1 << 16];
    int fd = open(path, O_RDONLY);
    ssize_t n = fd >= 0 ? read(fd, bytes, sizeof bytes - 1) : -1;
    close(fd);
    if (n < 0) return false;
    bytes[n] = 0;
    return strstr(bytes, text) != NULL;
}

/* What the run leaves. */
static void check_left(const struct session *s, const char *out, int code)
{
    char path[256], frames[64];
    struct seen seen;
    watch_look(&seen);
    struct devices_held held = devices_held(), none = {0};
    if (code != s->exit_code) watch_fail("the run ended with exit code %d, not %d", code, s->exit_code);
    if (memcmp(&held, &none, sizeof held) != 0) watch_fail("a device is still held at the end");
    if (s->disk_full > 0) return;
    snprintf(path, sizeof path, "%s/report.json", out);
    snprintf(frames, sizeof frames, "\"frames\":%lld,", (long long)seen.frames);
    if (!holds(path, frames)) watch_fail("%s does not tell %s", path, frames);
    snprintf(path, sizeof path, "%s/tape/frames", out);
    snprintf(frames, sizeof frames, "%lld\n", (long long)seen.frames);
    if (!holds(path, frames)) watch_fail("%s does not tell %s", path, frames);
}

static int run_session(const struct session *s, double hours, uint64_t seed, uint64_t dice)
{
    static struct fv_arguments arguments = {.frames = -1};
    char out[128], path[160];
    double all_s = 3600 * hours;
    struct faults_once once = {fmin(s->disk_full * all_s, 600), s->pipe_closed * all_s, s->log_closed * all_s, all_s, s->end_signal};
    snprintf(out, sizeof out, "%s/%s", folder, s->name);
    snprintf(path, sizeof path, "%s.log", out);
    lead_log(s, path);
    signal(SIGHUP, SIG_DFL);
    world_begin();
    devices_plug();
    for (int i = 0; i < SETTINGS; i++) arguments.request.set[arguments.request.sets++] = settings[i];
    set(&arguments.request, "display.sink", s->sink);
    snprintf(path, sizeof path, "%s/%s.y4m", folder, s->name);
    set(&arguments.request, "display.y4m_path", path);
    if (strcmp(s->sink, "y4m") == 0) {
        if (mkfifo(path, 0600)) abort();
        reader = open(path, O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    }
    arguments.out = out;
    watch_each_frame = each_frame;
    watch_begin(seed, s->name, all_s / 12 < 600 ? all_s / 12 : 600);
    faults_begin(dice, strcmp(s->sink, "kms") == 0, 5, &once);
    int code = fv_verb_run(&arguments);
    each_frame();
    check_left(s, out, code);
    watch_report();
    faults_report();
    fflush(stdout);
    return watch_failures() > 0;
}

/* Waits for a session; one that is stopped is continued. */
static int await(pid_t session)
{
    int status;
    for (;;) {
        if (waitpid(session, &status, WUNTRACED) < 0) return -1;
        if (!WIFSTOPPED(status)) break;
        kill(session, SIGCONT);
    }
    if (WIFEXITED(status)) return WEXITSTATUS(status);
    printf("soak: ended by signal %d\n", WTERMSIG(status));
    return -1;
}

/* What was recorded amid all that is whole: the program itself plays it. */
static int replay(const struct session *s)
{
    char command[640];
    snprintf(command, sizeof command, "%s replay %s/%s --set display.sink=none --out %s/replayed >>%s/replay.log 2>&1", FV_PROGRAM,
             folder, s->name, folder, folder);
    int status = system(command);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

static int clean(void)
{
    char command[128];
    snprintf(command, sizeof command, "rm -rf %s", folder);
    return system(command);
}

int main(int count, char **text)
{
    double hours = count > 1 ? atof(text[1]) : 2;
    uint64_t seed = count > 2 ? strtoull(text[2], NULL, 10) : 1;
    int failed = 0;
    const char *temporary = getenv("TMPDIR");
    snprintf(folder, sizeof folder, "%.40s/foveola-soak-XXXXXX", temporary ? temporary : "/tmp");
    if (!mkdtemp(folder)) return 1;
    for (int i = 0; i < SABOTAGES && count > 3; i++)
        if (strcmp(text[3], sabotages[i].name) == 0) *sabotages[i].flag = true;
    for (int i = 0; i < SESSIONS && (i == 0 || count <= 3); i++) {
        double lasts = sessions[i].hours > 0 ? sessions[i].hours : hours;
        uint64_t own = seed + (uint64_t)i;
        printf("soak: %s: %g h, seed %llu, output in %s\n", sessions[i].name, lasts, (unsigned long long)seed, folder);
        fflush(stdout);
        pid_t session = fork();
        if (session == 0) _exit(run_session(&sessions[i], lasts, seed, random_bits(&own)));
        int code = await(session);
        if (code != 0) printf("soak: %s: failed (%d)\n", sessions[i].name, code);
        failed |= code != 0;
        if (code == 0 && sessions[i].replayed && (code = replay(&sessions[i])) != 0) {
            printf("soak: %s: its tape cannot be replayed (%d)\n", sessions[i].name, code);
            failed = 1;
        }
    }
    if (!failed) clean();
    return failed;
}
