/* sandbox: see sandbox.h, and sandbox_filter.c for what each thread may call.
 *
 * Everything here is of a thread, not of the process: threads of devices give up at their beginning, the first one and the
 * workers when the loop begins. So no thread depends on what another one still needs. */
#define _GNU_SOURCE
#include "platform/sandbox.h"

#include "platform/log.h"
#include "platform/sandbox_filter.h"

#include <errno.h>
#include <fcntl.h>
#include <linux/capability.h>
#include <linux/landlock.h>
#include <linux/seccomp.h>
#include <signal.h>
#include <stdatomic.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

static bool asked, console;

void fv_sandbox_ask(bool on)
{
    asked = on;
}

void fv_sandbox_keep_console(bool on)
{
    console = on;
}

#ifdef FV_HEAP

static atomic_int refused; /* errno of the first filter that was refused */
static _Thread_local enum fv_sandbox_class here;

/* The forbidden call did not happen; the program ends without another one that could be forbidden. */
static void on_forbidden(int number, siginfo_t *info, void *context)
{
    static const char *const threads[FV_SANDBOX_CLASSES] = {"the first thread's", "device threads'", "workers'"};
    const char *name = fv_sandbox_call_name(info->si_syscall);
    (void)number, (void)context;
    fv_die(FV_SANDBOX_EXIT,
           "sandbox: the system call %d (%s) is not on the %s list: the program ends; threads.sandbox=off runs without",
           info->si_syscall, name ? name : "without a name here", threads[here]);
}

static void heed_forbidden(void)
{
    struct sigaction action = {.sa_sigaction = on_forbidden, .sa_flags = SA_SIGINFO};
    sigset_t trap;
    sigaction(SIGSYS, &action, NULL);
    sigemptyset(&trap);
    sigaddset(&trap, SIGSYS);
    pthread_sigmask(SIG_UNBLOCK, &trap, NULL);
}

/* Of the calling thread. `keep`: bits of capabilities below 32 that stay, beside the console's. */
static void drop_capabilities(unsigned keep)
{
    if (console) keep |= 1u << CAP_SYS_TTY_CONFIG;
    struct __user_cap_header_struct head = {.version = _LINUX_CAPABILITY_VERSION_3};
    struct __user_cap_data_struct data[2] = {{keep, keep, 0}, {0, 0, 0}}, had[2] = {{0, 0, 0}, {0, 0, 0}};
    if (syscall(SYS_capget, &head, had) != 0) return;
    data[0].effective &= had[0].permitted;
    data[0].permitted &= had[0].permitted;
    for (int cap = 0; cap < 64; cap++) prctl(PR_CAPBSET_DROP, cap, 0, 0, 0); /* refused where there is no such, or no right to */
    syscall(SYS_capset, &head, data);
}

/* The calling thread's list, for good. SPEC_ALLOW: what runs is our own code, and slower speculation would cost frames. */
static int enter(enum fv_sandbox_class of)
{
    struct sock_filter program[FV_SANDBOX_PROGRAM_MAX];
    struct sock_fprog list = {.filter = program};
    here = of;
    list.len = (unsigned short)fv_sandbox_program(of, program);
    heed_forbidden();
    if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
        syscall(SYS_seccomp, SECCOMP_SET_MODE_FILTER, SECCOMP_FILTER_FLAG_SPEC_ALLOW, &list) == 0)
        return 0;
    int none = 0;
    atomic_compare_exchange_strong(&refused, &none, errno);
    return -1;
}

enum {
    LOOKS = LANDLOCK_ACCESS_FS_READ_FILE | LANDLOCK_ACCESS_FS_READ_DIR,
    WRITES = LANDLOCK_ACCESS_FS_WRITE_FILE,
    MAKES = LANDLOCK_ACCESS_FS_MAKE_REG | LANDLOCK_ACCESS_FS_REMOVE_FILE,
    NEVER = LANDLOCK_ACCESS_FS_EXECUTE | LANDLOCK_ACCESS_FS_REMOVE_DIR | LANDLOCK_ACCESS_FS_MAKE_CHAR |
            LANDLOCK_ACCESS_FS_MAKE_DIR | LANDLOCK_ACCESS_FS_MAKE_SOCK | LANDLOCK_ACCESS_FS_MAKE_FIFO |
            LANDLOCK_ACCESS_FS_MAKE_BLOCK | LANDLOCK_ACCESS_FS_MAKE_SYM
};

/* Nothing of a path that is not there. */
static void allow(int rules, const char *path, unsigned long long what)
{
    struct landlock_path_beneath_attr beneath = {.allowed_access = what};
    int folder = open(path, O_PATH | O_CLOEXEC);
    if (folder < 0) return;
    beneath.parent_fd = folder;
    syscall(SYS_landlock_add_rule, rules, LANDLOCK_RULE_PATH_BENEATH, &beneath, 0);
    close(folder);
}

/* The calling thread's files: what it writes, beneath `out` (NULL: nothing); what devices are, under /dev, /sys and /proc.
 * Files that are open stay so. False where the kernel has no Landlock. */
static bool fence(const char *out)
{
    struct landlock_ruleset_attr handled = {.handled_access_fs = LOOKS | WRITES | MAKES | NEVER};
    int rules = (int)syscall(SYS_landlock_create_ruleset, &handled, sizeof handled.handled_access_fs, 0);
    if (rules < 0) return false;
    if (out) allow(rules, out, LOOKS | WRITES | MAKES);
    allow(rules, "/dev", LOOKS | WRITES);
    allow(rules, "/sys", LOOKS);
    allow(rules, "/proc", LOOKS);
    bool fenced = prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 && syscall(SYS_landlock_restrict_self, rules, 0) == 0;
    close(rules);
    return fenced;
}

void fv_sandbox_enter_device(void)
{
    if (!asked) return;
    drop_capabilities(0);
    fence(NULL);
    enter(FV_SANDBOX_DEVICE);
}

static void enter_worker(void *context, int worker)
{
    (void)context;
    if (worker == 0) return;
    drop_capabilities(0);
    enter(FV_SANDBOX_WORKER);
}

int fv_sandbox_seal(struct fv_workers *workers, const char *out, struct fv_error *said)
{
    struct stat folder;
    /* Another one's folder can be written into by this right alone. */
    bool of_others = geteuid() == 0 && stat(out, &folder) == 0 && folder.st_uid != 0;
    fv_workers_each(workers, enter_worker, NULL);
    drop_capabilities(of_others ? 1u << CAP_DAC_OVERRIDE : 0);
    bool fenced = fence(out);
    int failed = enter(FV_SANDBOX_FIRST);
    if (failed || atomic_load(&refused))
        return fv_error_set(said, "the kernel refuses lists of system calls (seccomp): %s", strerror(atomic_load(&refused)));
    fv_error_set(said, "system calls by thread, no capabilities%s%s, files made beneath the output %s",
                 of_others ? " but CAP_DAC_OVERRIDE" : "", console ? of_others ? ", CAP_SYS_TTY_CONFIG" : " but CAP_SYS_TTY_CONFIG" : "",
                 fenced ? "only (Landlock)" : "or elsewhere (no Landlock)");
    return 0;
}

#else

void fv_sandbox_enter_device(void)
{
}

int fv_sandbox_seal(struct fv_workers *workers, const char *out, struct fv_error *said)
{
    (void)workers, (void)out, (void)asked, (void)console;
    return fv_error_set(said, "not in builds with sanitizers, which make system calls of their own");
}

#endif
