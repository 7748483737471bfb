/* sandbox: in processes of their own, each kind of thread makes calls that are on its list and calls that are not: these
 * end the process with code 3 and one line. Then the program itself: what its threads have left while frames run, that
 * whole runs make no other calls, and that no network is linked into it. */
#define _GNU_SOURCE
#include "platform/sandbox.h"

#include "platform/files.h"
#include "platform/log.h"
#include "tests/support/program.h"
#include "tests/support/stripped.h"

#include <dirent.h>
#include <errno.h>
#include <linux/capability.h>
#include <linux/kd.h>
#include <sched.h>
#include <signal.h>
#include <stdatomic.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <time.h>

static char outside[160];
static _Alignas(4096) char page[4096];

static void make_file_inside(void)
{
    static struct fv_writer w;
    struct fv_error error;
    char path[160];
    snprintf(path, sizeof path, "%s/out/made", program_folder());
    if (fv_writer_open(&w, path, &error) || fv_writer_close(&w, &error)) _exit(50);
}

/* Forbidden by the list, or by the fence alone: then it is refused, and nothing ends. */
static void make_file_outside(void)
{
    if (open(outside, O_WRONLY | O_CREAT, 0600) < 0 && errno == EACCES) _exit(FV_SANDBOX_EXIT);
}

static void read_outside(void)
{
    if (open(FV_SOURCE_DIR "/README.md", O_RDONLY) < 0 && errno == EACCES) _exit(FV_SANDBOX_EXIT);
}

static void look_at_system(void)
{
    int fd = open("/sys/devices/system/cpu/online", O_RDONLY);
    if (fd < 0) fd = open("/proc/self/status", O_RDONLY);
    char byte;
    if (fd < 0 || read(fd, &byte, 1) != 1) _exit(51);
    close(fd);
}

static void open_device(void)
{
    int fd = open("/dev/null", O_RDWR);
    if (fd < 0 || write(fd, "", 1) != 1 || close(fd)) _exit(52);
}

/* Places in which displays come back: what is not there is told to be, and not refused. */
static void open_display_again(void)
{
    int fd = open("/dev/dri/none", O_RDWR | O_NONBLOCK | O_CLOEXEC);
    if (fd >= 0 || errno != ENOENT) _exit(54);
    fd = open("/dev/full", O_RDWR | O_NOCTTY | O_CLOEXEC);
    if (fd < 0 || ioctl(fd, TIOCGWINSZ, page) == 0 || errno != ENOTTY || close(fd)) _exit(55);
}

static void give_console_back(void)
{
    if (ioctl(-1, KDSETMODE, KD_TEXT) == 0 || errno != EBADF) _exit(56);
}

/* As the display does at the program's death; whoever dies. */
static void die(void)
{
    fv_die_calls(give_console_back);
    fv_die(gettid() > 0 && getpid() > 0 ? 0 : 59, "ends");
}

static void ask_terminal(void)
{
    ioctl(-1, TIOCGWINSZ, page);
}

static void type_for_a_terminal(void)
{
    ioctl(-1, TIOCSTI, "x");
}

/* Code that is there already is not written over, where there is Landlock. */
static void write_over_code(void)
{
    if (open("/proc/self/mem", O_RDWR) < 0 && errno == EACCES) _exit(FV_SANDBOX_EXIT);
}

static void map_shared(void)
{
    if (syscall(SYS_mmap, NULL, 4096, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0) == -1) _exit(53);
}

static void map_code(void)
{
    syscall(SYS_mmap, NULL, 4096, PROT_READ | PROT_EXEC, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
}

static void make_code(void)
{
    mprotect(page, sizeof page, PROT_READ | PROT_EXEC);
}

static void open_socket(void)
{
    syscall(SYS_socket, AF_INET, SOCK_STREAM, 0);
}

static void run_a_program(void)
{
    execl("/bin/true", "true", (char *)NULL);
}

static void start_a_thread(void)
{
    syscall(SYS_clone, SIGCHLD, 0, 0, 0, 0);
}

static void kill_another(void)
{
    syscall(SYS_kill, 1, 0);
}

static void take_rights(void)
{
    syscall(SYS_setresuid, 0, 0, 0);
}

/* Capabilities of the first thread. */
static unsigned long long had, console_right = 1ull << CAP_SYS_TTY_CONFIG;
static unsigned long long rights(void)
{
    char text[4096];
    int fd = open("/proc/self/status", O_RDONLY);
    ssize_t n = fd < 0 ? 0 : read(fd, text, sizeof text - 1);
    text[n > 0 ? n : 0] = 0;
    close(fd);
    const char *at = strstr(text, "CapEff:");
    return at ? strtoull(at + 7, NULL, 16) : ~0ull;
}

static void look_at_rights(void)
{
    if (rights() != 0) _exit(57);
}

static void look_at_rights_with_a_console(void)
{
    if (rights() != (had & console_right)) _exit(58);
}

static void sleep_shortly(void)
{
    struct timespec t = {0, 1000};
    clock_nanosleep(CLOCK_MONOTONIC, 0, &t, NULL);
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    sched_yield();
}

static void nothing(void)
{
}

enum { F = 1, D = 2, W = 4 };
enum { WORKERS = 2 };
static const char *const threads[] = {"the first thread's", "device threads'", "workers'"};

static const struct trial {
    const char *what, *name; /* name: as the line has it; NULL: it is refused without a line */
    void (*call)(void);
    int allowed; /* threads that may */
} trials[] = {
    {"nothing", NULL, nothing, F | D | W},
    {"sleep", NULL, sleep_shortly, F | D | W},
    {"look at /sys", "openat", look_at_system, F | D},
    {"open a device", "openat", open_device, F | D},
    {"open a display again", "openat", open_display_again, F | D},
    {"give the console back", "ioctl", give_console_back, F | D | W},
    {"die", NULL, die, F | D | W},
    {"ask a terminal", "ioctl", ask_terminal, F | D},
    {"type for a terminal", "ioctl", type_for_a_terminal, 0},
    {"map memory", "mmap", map_shared, F | D},
    {"make a file inside", "openat", make_file_inside, F},
    {"make a file outside", "openat", make_file_outside, 0},
    {"map code", "mmap", map_code, 0},
    {"make code", "mprotect", make_code, 0},
    {"a socket", "socket", open_socket, 0},
    {"a program", "execve", run_a_program, 0},
    {"a thread", "clone", start_a_thread, 0},
    {"a signal", "kill", kill_another, 0},
    {"rights", "setresuid", take_rights, 0},
};

static struct {
    const struct trial *trial;
    int thread;
    atomic_int sealed, done;
    bool refused;
} now;

static void *device_thread(void *context)
{
    (void)context;
    while (!atomic_load(&now.sealed)) sched_yield();
    if (now.thread == 1) now.trial->call();
    atomic_store(&now.done, 1);
    return NULL; /* its end needs calls, too */
}

static void on_worker(void *context, int worker)
{
    (void)context;
    if (worker == 1 && now.thread == 2) now.trial->call();
}

/* 77: the kernel refuses the lists. */
static void attempt(void)
{
    static struct fv_workers workers;
    struct fv_error said;
    pthread_t thread;
    char out[160];
    snprintf(out, sizeof out, "%s/out", program_folder());
    alarm(20);
    had = rights();
    fv_sandbox_ask(true);
    fv_sandbox_keep_console(now.trial->call == look_at_rights_with_a_console);
    fv_workers_start(&workers, WORKERS);
    if (fv_thread_start(&thread, "device", FV_CAN_WAIT, device_thread, NULL, &said)) _exit(60);
    if (fv_sandbox_seal(&workers, out, &said)) _exit(77);
    atomic_store(&now.sealed, 1);
    pthread_join(thread, NULL);
    fv_workers_each(&workers, on_worker, NULL);
    if (now.thread == 0) now.trial->call();
    _exit(atomic_load(&now.done) ? 0 : 61);
}

/* The exit code of a process that tries; its standard error into `errors`. */
static int tried(const struct trial *t, int thread, char *errors, size_t size)
{
    int status;
    char path[160];
    snprintf(path, sizeof path, "%s/errors", program_folder());
    now.trial = t;
    now.thread = thread;
    fflush(NULL);
    pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        dup2(open(path, O_WRONLY | O_CREAT | O_TRUNC, 0600), STDERR_FILENO);
        attempt();
    }
    assert_int_equal(waitpid(child, &status, 0), child);
    program_slurp(path, errors, size);
    if (!WIFEXITED(status)) fail_msg("%s, %s: ended by signal %d: %s", t->what, threads[thread], WTERMSIG(status), errors);
    if (WEXITSTATUS(status) == 77) {
        print_message("no lists of system calls can be set here: skipped\n");
        skip();
    }
    return WEXITSTATUS(status);
}

static void each_thread_keeps_to_its_list(void **state)
{
    (void)state;
    char errors[1024], words[128], folder[160];
    skip_without_own_heap();
    snprintf(folder, sizeof folder, "%s/out", program_folder());
    assert_int_equal(mkdir(folder, 0755), 0);
    snprintf(outside, sizeof outside, "%s/outside", program_folder());
    for (unsigned i = 0; i < sizeof trials / sizeof trials[0]; i++)
        for (int thread = 0; thread < 3; thread++) {
            bool may = trials[i].allowed & 1 << thread;
            bool fenced = trials[i].call == make_file_outside && thread == 0;
            int code = tried(&trials[i], thread, errors, sizeof errors);
            if (fenced && code == 0) continue; /* a kernel without Landlock */
            if (code != (may ? 0 : FV_SANDBOX_EXIT)) fail_msg("%s, %s: exit %d: %s", trials[i].what, threads[thread], code, errors);
            if (may || fenced) continue;
            snprintf(words, sizeof words, "(%s) is not on the %s list", trials[i].name, threads[thread]);
            char *end = strchr(errors, '\n');
            if (strncmp(errors, "foveola: sandbox: ", 18) != 0 || !strstr(errors, words) || !end || end[1])
                fail_msg("%s, %s: not one line with '%s': %s", trials[i].what, threads[thread], words, errors);
        }
}

static void files_of_others_are_not_read(void **state)
{
    (void)state;
    static const struct trial trials_of_files[] = {{"read outside", NULL, read_outside, 0},
                                                   {"write over code", NULL, write_over_code, 0}};
    char errors[1024];
    skip_without_own_heap();
    for (int i = 0; i < 4; i++) {
        int code = tried(&trials_of_files[i / 2], i % 2, errors, sizeof errors);
        if (code == 0) {
            print_message("no Landlock here: skipped\n");
            skip();
        }
        assert_int_equal(code, FV_SANDBOX_EXIT);
        assert_string_equal(errors, "");
    }
}

static void a_display_keeps_the_right_to_the_console_alone(void **state)
{
    (void)state;
    static const struct trial of[] = {{"rights", NULL, look_at_rights, F}, {"a console", NULL, look_at_rights_with_a_console, F}};
    char errors[1024];
    skip_without_own_heap();
    for (int i = 0; i < 2; i++) assert_int_equal(tried(&of[i], 0, errors, sizeof errors), 0);
}

#define SMALL "--set scene.name=cornell --set display.headset=small --set threads.workers=2 "

/* A line of /proc/PID/task/TID/status. */
static bool has_line(const char *text, const char *line)
{
    const char *at = strstr(text, line);
    return at && at[strlen(line)] == '\n';
}

static void running_threads_have_no_rights_left(void **state)
{
    (void)state;
    char path[512], text[4096];
    int looked_at = 0, status;
    skip_without_own_heap();
    fflush(NULL);
    pid_t child = fork();
    if (child == 0) {
        if (chdir(program_folder())) _exit(1);
        dup2(open("/dev/null", O_RDWR), STDERR_FILENO);
        execl(FV_PROGRAM, FV_PROGRAM, "run", "--set", "scene.name=cornell", "--set", "display.headset=small", "--set", "threads.workers=3",
              "--set", "display.sink=none", "--set", "budget.pace=vsync", "--out", "looked", (char *)NULL); /* 3 workers, the tapes' writer */
        _exit(1);
    }
    snprintf(path, sizeof path, "%s/looked/frames.csv.part", program_folder());
    for (int i = 0; i < 200 && !fv_file_exists(path); i++) usleep(50000);
    usleep(300000);
    snprintf(path, sizeof path, "/proc/%d/task", (int)child);
    DIR *folder = opendir(path);
    assert_non_null(folder);
    for (struct dirent *e; (e = readdir(folder));) {
        if (e->d_name[0] == '.') continue;
        snprintf(path, sizeof path, "/proc/%d/task/%s/status", (int)child, e->d_name);
        program_slurp(path, text, sizeof text);
        if (has_line(text, "Seccomp:\t0")) { /* the kernel has none */
            kill(child, SIGKILL);
            waitpid(child, &status, 0);
            skip();
        }
        if (!has_line(text, "NoNewPrivs:\t1") || !has_line(text, "Seccomp:\t2") || !has_line(text, "CapPrm:\t0000000000000000") ||
            !has_line(text, "CapEff:\t0000000000000000"))
            fail_msg("thread %s: %s", e->d_name, text);
        looked_at++;
    }
    closedir(folder);
    kill(child, SIGTERM);
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_int_equal(looked_at, 4);
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) fail_msg("status %x", status);
    snprintf(path, sizeof path, "%s/looked/report.json", program_folder());
    assert_true(fv_file_exists(path));
}

/* Runs that open what there is to open: not one call that is on no list. */
static const char *const whole[] = {
    "run " SMALL "--frames 4 --out whole",
    "run " SMALL "--frames 4 --out y4m --set display.sink=y4m --set display.y4m_path=pictures.y4m",
    "run " SMALL "--frames 4 --out none --set display.sink=none --set output.tape=off --set budget.pace=vsync --set budget.adapt=on",
    "run " SMALL "--frames 4 --out camera --set eye.source=sim-camera",
    "run " SMALL "--frames 4 --out fatal --set threads.sealed_heap=fatal --set output.overlay=on",
    "replay whole --out again",
    "calibrate --points 5 --out calibrated --set eye.source=sim-camera --set eye.width=160 --set eye.height=120 --set display.sink=none "
    "--set output.eye_frames=on",
    "run " SMALL "--frames 4 --out off --set threads.sandbox=off",
};

static void whole_runs_keep_to_the_lists(void **state)
{
    (void)state;
    static char json[1 << 17];
    char path[160];
    for (unsigned i = 0; i < sizeof whole / sizeof whole[0]; i++) {
        struct program_result r = program("%s", whole[i]);
        if (r.code || strstr(r.errors, "sandbox: the")) fail_msg("%s: exit %d: %s", whole[i], r.code, r.errors);
    }
    snprintf(path, sizeof path, "%s/whole/report.json", program_folder());
    program_slurp(path, json, sizeof json);
    assert_non_null(strstr(json, "\"what\":\"sandbox\""));
    snprintf(path, sizeof path, "%s/off/report.json", program_folder());
    program_slurp(path, json, sizeof json);
    assert_non_null(strstr(json, "threads.sandbox is off"));
}

/* Lines of `nm`'s output that match; fails where there is one. */
static void holds_none(const char *nm, const char *pattern)
{
    char command[1024], found[1024], path[160];
    snprintf(path, sizeof path, "%s/found", program_folder());
    snprintf(command, sizeof command, "nm %s 2>/dev/null | grep -E '%s' >%s", nm, pattern, path);
    if (system(command) != 0) return;
    program_slurp(path, found, sizeof found);
    fail_msg("%s: %s", nm, found);
}

/* What libusb has for hotplug by the kernel's own messages is there and never called (usb_port.c): no thread may open a
 * socket. Nothing connects, listens or asks for names. */
static void no_network_is_linked_in(void **state)
{
    (void)state;
    skip_without_own_heap(); /* the C library is a shared one there */
    holds_none("-u " FV_BINARY_DIR "/lib*.a", " (socket|socketpair|connect|bind|listen|accept4?|send|sendto|sendmsg|recv|recvfrom|"
                                              "recvmsg|getaddrinfo|gethostby[a-z_]*|getifaddrs|res_[a-z]*)$");
    holds_none(FV_PROGRAM, " [TtWwi] (__)?(connect|listen|accept4?|getaddrinfo|gethostby[a-z_]*|getnameinfo|res_n?search|"
                           "res_n?query|sendmsg|sendmmsg|socketpair|recvfrom)$");
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(each_thread_keeps_to_its_list),
                                       cmocka_unit_test(files_of_others_are_not_read),
                                       cmocka_unit_test(a_display_keeps_the_right_to_the_console_alone),
                                       cmocka_unit_test(running_threads_have_no_rights_left),
                                       cmocka_unit_test(whole_runs_keep_to_the_lists),
                                       cmocka_unit_test(no_network_is_linked_in)};
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
