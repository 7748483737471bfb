/* faults: in processes of their own, each kind of thread comes to its end by a fault, by abort and by signals that are
 * sent: what was asked for is called once, and the end is what it would have been. Within the sandbox, too. */
#define _GNU_SOURCE
#include "platform/faults.h"

#include "platform/log.h"
#include "platform/sandbox.h"
#include "tests/support/program.h"
#include "tests/support/stripped.h"

#include <signal.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/syscall.h>

static int told[2];

static void tell(void)
{
    if (write(told[1], "x", 1) != 1) _exit(90);
}

static void write_nowhere(void)
{
    static volatile int *volatile nowhere;
    *nowhere = 1;
}

static void read_past_the_end(void)
{
    char path[160];
    snprintf(path, sizeof path, "%s/empty", program_folder());
    int fd = open(path, O_RDONLY);
    long at = syscall(SYS_mmap, NULL, 4096, PROT_READ, MAP_SHARED, fd, 0); /* past our own heap, which maps no files */
    (void)*(const volatile char *)at;
}

static void trap(void)
{
    __builtin_trap();
}

static void send_segv(void)
{
    kill(getpid(), SIGSEGV);
    for (;;) pause();
}

static void send_quit(void)
{
    kill(getpid(), SIGQUIT);
    for (;;) pause();
}

static void no_more(void)
{
    fv_faults_call(NULL);
    write_nowhere();
}

static const struct fault {
    const char *what;
    void (*act)(void);
    bool sealed;     /* may be tried in the sandbox */
    int signal, code; /* that ends it; signal 0: the code does */
    int calls;
} faults[] = {
    {"a null pointer", write_nowhere, true, SIGSEGV, 0, 1},
    {"a file's end", read_past_the_end, false, SIGBUS, 0, 1},
    {"an instruction", trap, true, SIGILL, 0, 1},
    {"abort", abort, false, SIGABRT, 0, 1},
    {"a signal sent", send_segv, false, 0, 128 + SIGSEGV, 1},
    {"SIGQUIT", send_quit, false, 0, 128 + SIGQUIT, 1},
    {"taken back", no_more, true, SIGSEGV, 0, 0},
};

enum { FIRST, DEVICE, WORKER, THREADS };
static const struct fault *now;
static int on;

static void *device_thread(void *context)
{
    (void)context;
    if (on == DEVICE) now->act();
    for (;;) pause();
    return NULL;
}

static void on_worker(void *context, int worker)
{
    (void)context;
    if (worker == 1 && on == WORKER) now->act();
}

static void come_to_an_end(bool sealed)
{
    static struct fv_workers workers;
    struct rlimit none = {0, 0};
    struct fv_error error;
    pthread_t thread;
    setrlimit(RLIMIT_CORE, &none);
    alarm(20);
    fv_faults_call(tell);
    fv_sandbox_ask(sealed);
    fv_workers_start(&workers, 2);
    if (on == DEVICE && fv_thread_start(&thread, "device", FV_CAN_WAIT, device_thread, NULL, &error)) _exit(91);
    if (sealed && on != DEVICE && fv_sandbox_seal(&workers, program_folder(), &error)) _exit(77);
    fv_workers_each(&workers, on_worker, NULL);
    if (on == FIRST) now->act();
    for (;;) pause();
}

static void try(const struct fault *f, int thread, bool sealed)
{
    int status, calls = 0;
    char byte;
    now = f;
    on = thread;
    assert_int_equal(pipe2(told, O_NONBLOCK), 0);
    fflush(NULL);
    pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        dup2(open("/dev/null", O_WRONLY), STDERR_FILENO);
        come_to_an_end(sealed);
    }
    assert_int_equal(waitpid(child, &status, 0), child);
    while (read(told[0], &byte, 1) == 1) calls++;
    close(told[0]);
    close(told[1]);
    if (WIFEXITED(status) && WEXITSTATUS(status) == 77) return; /* no lists of system calls can be set here */
    bool right = f->signal ? WIFSIGNALED(status) && WTERMSIG(status) == f->signal
                           : WIFEXITED(status) && WEXITSTATUS(status) == f->code;
    if (!right || calls != f->calls)
        fail_msg("%s, thread %d%s: status %x, called %d times", f->what, thread, sealed ? ", sandbox" : "", status, calls);
}

static void each_end_is_told_once(void **state)
{
    (void)state;
    char path[160];
    skip_without_own_heap();
    snprintf(path, sizeof path, "%s/empty", program_folder());
    close(open(path, O_WRONLY | O_CREAT, 0600));
    for (unsigned i = 0; i < sizeof faults / sizeof faults[0]; i++)
        for (int thread = 0; thread < THREADS; thread++) {
            try(&faults[i], thread, false);
            if (faults[i].sealed) try(&faults[i], thread, true);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(each_end_is_told_once)};
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
