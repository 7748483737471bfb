/* sandbox_filter: one table: which thread may make which system call, with which arguments. Numbers differ between
 * processors, and some calls exist on x86-64 only. Form of the program: Linux, Documentation/userspace-api/seccomp_filter.rst. */
#define _GNU_SOURCE
#include "platform/sandbox_filter.h"

#include <assert.h>
#include <fcntl.h>
#include <linux/audit.h>
#include <linux/kd.h>
#include <linux/seccomp.h>
#include <stddef.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/syscall.h>

enum {
    FIRST = 1 << FV_SANDBOX_FIRST,
    DEVICE = 1 << FV_SANDBOX_DEVICE,
    WORKER = 1 << FV_SANDBOX_WORKER,
    ALL = FIRST | DEVICE | WORKER
};

#ifdef __x86_64__
enum { ARCH = AUDIT_ARCH_X86_64 & 0x7fffffff, OTHER_ABI = 0x40000000 /* x32 */ };
#else
enum { ARCH = AUDIT_ARCH_AARCH64 & 0x7fffffff, OTHER_ABI = 0x40000000 };
#endif

/* Flags of openat that make a file, or empty one. */
#define MAKES (O_CREAT | O_TRUNC | (O_TMPFILE & ~O_DIRECTORY))

static const struct rule {
    int call;
    unsigned classes;
    int argument;       /* of which ... */
    unsigned forbidden; /* ... none of these bits may be set; 0: none is */
} rules[] = {
    /* Working, waiting, ending; log lines. */
    {SYS_futex, ALL, 0, 0},
    {SYS_clock_gettime, ALL, 0, 0},
    {SYS_sched_yield, ALL, 0, 0},
    {SYS_write, ALL, 0, 0},
    {SYS_clock_nanosleep, ALL, 0, 0},
    {SYS_nanosleep, ALL, 0, 0},
    {SYS_restart_syscall, ALL, 0, 0},
    {SYS_rt_sigreturn, ALL, 0, 0},
    {SYS_rt_sigprocmask, ALL, 0, 0},
    {SYS_gettid, ALL, 0, 0},
    {SYS_getpid, ALL, 0, 0},
    {SYS_exit, ALL, 0, 0},
    {SYS_exit_group, ALL, 0, 0},
    {SYS_madvise, ALL, 0, 0}, /* the end of a thread */
    /* A worker that ends the program gives the text console back (display/kms_sink.c): what has no other bits than
     * KDSETMODE is of the console, too. */
    {SYS_ioctl, WORKER, 1, ~(unsigned)KDSETMODE},
    /* Devices, which come and go: looked for, opened, their buffers mapped. */
    {SYS_ioctl, FIRST | DEVICE, 0, 0},
    {SYS_read, FIRST | DEVICE, 0, 0},
    {SYS_pread64, FIRST | DEVICE, 0, 0},
    {SYS_lseek, FIRST | DEVICE, 0, 0},
    {SYS_close, FIRST | DEVICE, 0, 0},
    {SYS_ppoll, FIRST | DEVICE, 0, 0},
    {SYS_openat, DEVICE, 2, MAKES},
    {SYS_fcntl, FIRST | DEVICE, 0, 0},
    {SYS_fstat, FIRST | DEVICE, 0, 0},
    {SYS_newfstatat, FIRST | DEVICE, 0, 0},
    {SYS_faccessat, FIRST | DEVICE, 0, 0},
    {SYS_readlinkat, FIRST | DEVICE, 0, 0},
    {SYS_getdents64, FIRST | DEVICE, 0, 0},
    {SYS_mmap, FIRST | DEVICE, 2, PROT_EXEC},
    {SYS_munmap, FIRST | DEVICE, 0, 0},
    {SYS_timerfd_settime, FIRST | DEVICE, 0, 0},
    /* Pictures, recordings, the report; the watchdog. */
    {SYS_openat, FIRST, 0, 0},
    {SYS_writev, FIRST, 0, 0},
    {SYS_pwrite64, FIRST, 0, 0},
    {SYS_fsync, FIRST, 0, 0},
    {SYS_fdatasync, FIRST, 0, 0},
    {SYS_ftruncate, FIRST, 0, 0},
    {SYS_renameat2, FIRST, 0, 0},
    {SYS_unlinkat, FIRST, 0, 0},
    {SYS_sched_getaffinity, FIRST, 0, 0},
    {SYS_setitimer, FIRST, 0, 0},
#ifdef __x86_64__
    {SYS_poll, FIRST | DEVICE, 0, 0},
    {SYS_access, FIRST | DEVICE, 0, 0},
    {SYS_readlink, FIRST | DEVICE, 0, 0},
    {SYS_pause, FIRST | DEVICE, 0, 0},
    {SYS_rename, FIRST, 0, 0},
    {SYS_unlink, FIRST, 0, 0},
#endif
#ifdef SYS_renameat
    {SYS_renameat, FIRST, 0, 0},
#endif
};

/* Of calls that are on the lists. No key is typed for a terminal: who reads there would run it. */
static const struct {
    int call, argument;
    unsigned value; /* that this argument never has */
} never[] = {{SYS_ioctl, 1, TIOCSTI}, {SYS_ioctl, 1, TIOCLINUX}};

static int add(struct sock_filter *program, int at, unsigned code, unsigned yes, unsigned no, unsigned k)
{
    assert(at < FV_SANDBOX_PROGRAM_MAX);
    program[at] = (struct sock_filter){(unsigned short)code, (unsigned char)yes, (unsigned char)no, k};
    return at + 1;
}

enum { LOAD = BPF_LD | BPF_W | BPF_ABS, EQUAL = BPF_JMP | BPF_JEQ | BPF_K, HAS = BPF_JMP | BPF_JSET | BPF_K, END = BPF_RET | BPF_K };

/* Low half of an argument: both processors are little-endian. Flags and protections have 32 bits. */
static unsigned argument_at(int argument)
{
    return (unsigned)offsetof(struct seccomp_data, args) + 8 * (unsigned)argument;
}

int fv_sandbox_program(enum fv_sandbox_class of, struct sock_filter program[FV_SANDBOX_PROGRAM_MAX])
{
    int at = 0;
    at = add(program, at, LOAD, 0, 0, offsetof(struct seccomp_data, arch));
    at = add(program, at, EQUAL, 1, 0, (unsigned)ARCH | __AUDIT_ARCH_LE | __AUDIT_ARCH_64BIT);
    at = add(program, at, END, 0, 0, SECCOMP_RET_TRAP);
    at = add(program, at, LOAD, 0, 0, offsetof(struct seccomp_data, nr));
    at = add(program, at, HAS, 0, 1, OTHER_ABI);
    at = add(program, at, END, 0, 0, SECCOMP_RET_TRAP);
    for (size_t i = 0; i < sizeof never / sizeof never[0]; i++) {
        at = add(program, at, EQUAL, 0, 4, (unsigned)never[i].call);
        at = add(program, at, LOAD, 0, 0, argument_at(never[i].argument));
        at = add(program, at, EQUAL, 0, 1, never[i].value);
        at = add(program, at, END, 0, 0, SECCOMP_RET_TRAP);
        at = add(program, at, LOAD, 0, 0, offsetof(struct seccomp_data, nr));
    }
    for (size_t i = 0; i < sizeof rules / sizeof rules[0]; i++) {
        const struct rule *r = &rules[i];
        if (!(r->classes & 1u << of)) continue;
        at = add(program, at, EQUAL, 0, r->forbidden ? 4 : 1, (unsigned)r->call);
        if (r->forbidden) {
            at = add(program, at, LOAD, 0, 0, argument_at(r->argument));
            at = add(program, at, HAS, 0, 1, r->forbidden);
            at = add(program, at, END, 0, 0, SECCOMP_RET_TRAP);
        }
        at = add(program, at, END, 0, 0, SECCOMP_RET_ALLOW);
    }
    return add(program, at, END, 0, 0, SECCOMP_RET_TRAP);
}

static const struct {
    int call;
    const char *name;
} names[] = {
#define NAME(name) {SYS_##name, #name}
    NAME(openat), NAME(mmap), NAME(mprotect), NAME(socket), NAME(connect), NAME(bind), NAME(sendto), NAME(recvfrom),
    NAME(sendmsg), NAME(recvmsg), NAME(execve), NAME(execveat), NAME(clone), NAME(clone3), NAME(ptrace), NAME(kill),
    NAME(tgkill), NAME(tkill), NAME(setuid), NAME(setresuid), NAME(capset), NAME(prctl), NAME(seccomp), NAME(brk),
    NAME(mremap), NAME(munmap), NAME(read), NAME(ioctl), NAME(close), NAME(fstat), NAME(newfstatat), NAME(mkdirat),
    NAME(unlinkat), NAME(renameat2), NAME(pipe2), NAME(dup), NAME(dup3), NAME(getrandom), NAME(statx), NAME(rt_sigaction),
    NAME(getuid), NAME(geteuid), NAME(set_robust_list), NAME(rseq), NAME(sched_setscheduler), NAME(sched_setaffinity),
    NAME(mount), NAME(fchmodat), NAME(fchownat), NAME(linkat), NAME(symlinkat), NAME(prlimit64), NAME(uname), NAME(sysinfo),
#ifdef __x86_64__
    NAME(open), NAME(fork), NAME(vfork), NAME(mkdir), NAME(unlink), NAME(rename), NAME(stat), NAME(pipe), NAME(dup2),
    NAME(chmod), NAME(chown), NAME(link), NAME(symlink), NAME(poll), NAME(select),
#endif
#undef NAME
};

const char *fv_sandbox_call_name(int number)
{
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++)
        if (names[i].call == number) return names[i].name;
    return NULL;
}
