/* realtime: each extra granted and refused, in processes of their own that may be stripped of rights and
 * limits first; and nothing asked for, nothing changed. What this machine
 * itself does not permit is skipped with a notice. */
#define _GNU_SOURCE
#include "platform/realtime.h"

#include "platform/arena.h"
#include "platform/files.h"
#include "tests/support/program.h"
#include "tests/support/stripped.h"

#include <dirent.h>
#include <errno.h>
#include <linux/capability.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <sys/sysinfo.h>

enum { THREADS_MAX = 66, DEADLINE_S = 60, CPU_LATENCY_US = 20, MB = 1 << 20 };

#define ASK_NOTHING                                                                                          \
    {                                                                                                        \
        .cpu_latency_us = -1, .root = ""                                                                     \
    }

/* What a process got: the rows, and what the kernel says of its threads and memory. */
struct outcome {
    bool impossible; /* `before` could not strip or set what the trial is about */
    struct fv_realtime_row row[FV_REALTIME_EXTRAS];
    int threads, fifo,
        pinned;     /* threads; of them: in the class with the priority and flag asked for; with one core */
    bool same_core; /* two pinned threads share theirs */
    long locked_kb, taken_kb;
    int latency_files; /* open files named cpu_dma_latency, or the full device in its place */
};

struct trial {
    struct fv_realtime_request request;
    int workers;
    bool (*before)(void);
    void (*after)(struct fv_workers *workers);
};

static struct fv_workers workers;

static long locked_kb(void)
{
    char text[4096];
    program_slurp("/proc/self/status", text, sizeof text);
    const char *line = strstr(text, "VmLck:");
    return line ? atol(line + strlen("VmLck:")) : -1;
}

static void look_at_threads(struct outcome *o, int priority)
{
    cpu_set_t seen, mask;
    DIR *folder = opendir("/proc/self/task");
    CPU_ZERO(&seen);
    for (struct dirent *e; folder && (e = readdir(folder));) {
        pid_t tid = (pid_t)atoi(e->d_name);
        struct sched_param parameter = {0};
        if (tid == 0) continue;
        o->threads++;
        sched_getparam(tid, &parameter);
        o->fifo += sched_getscheduler(tid) == (SCHED_FIFO | SCHED_RESET_ON_FORK) &&
                   parameter.sched_priority == priority;
        if (sched_getaffinity(tid, sizeof mask, &mask) || CPU_COUNT(&mask) != 1) continue;
        o->pinned++;
        for (int core = 0; core < CPU_SETSIZE; core++) {
            if (!CPU_ISSET(core, &mask)) continue;
            o->same_core |= CPU_ISSET(core, &seen) != 0;
            CPU_SET(core, &seen);
        }
    }
    if (folder) closedir(folder);
}

static int latency_files(void)
{
    char path[64], target[256];
    int found = 0;
    for (int fd = 0; fd < 64; fd++) {
        snprintf(path, sizeof path, "/proc/self/fd/%d", fd);
        ssize_t n = readlink(path, target, sizeof target - 1);
        target[n > 0 ? n : 0] = 0;
        found += strstr(target, "cpu_dma_latency") || strcmp(target, "/dev/full") == 0;
    }
    return found;
}

static void attempt(const struct trial *t, int to)
{
    struct outcome o = {.impossible = t->before && !t->before()};
    if (!o.impossible) {
        fv_workers_start(&workers, t->workers);
        fv_realtime_apply(&t->request, &workers, o.row);
        look_at_threads(&o, t->request.fifo_priority);
        o.locked_kb = locked_kb();
        o.taken_kb = (long)(fv_arena()->used >> 10);
        o.latency_files = latency_files();
        if (t->after) t->after(&workers);
    }
    ssize_t written = write(to, &o, sizeof o);
    _exit(written == sizeof o ? 0 : 1);
}

/* Runs the trial in a process of its own. Skips the test where the machine cannot bring it about. */
static struct outcome try(struct trial t)
{
    struct outcome o;
    int ends[2], status;
    if (!t.workers) t.workers = 2;
    assert_int_equal(pipe(ends), 0);
    fflush(NULL);
    pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        int null = open("/dev/null", O_WRONLY);
        dup2(null, STDERR_FILENO);
        alarm(DEADLINE_S);
        attempt(&t, ends[1]);
    }
    close(ends[1]);
    ssize_t n = read(ends[0], &o, sizeof o);
    close(ends[0]);
    assert_int_equal(waitpid(child, &status, 0), child);
    if (!WIFEXITED(status)) fail_msg("ended by signal %d", WTERMSIG(status));
    assert_int_equal(WEXITSTATUS(status), 0);
    assert_int_equal(n, sizeof o);
    if (o.impossible) {
        print_message("the conditions of this test cannot be made here: skipped\n");
        skip();
    }
    return o;
}

/* A folder in whose place / is, with one file. */
static const char *root_with(const char *name, const char *file, const char *text)
{
    static char root[128];
    char command[512];
    snprintf(root, sizeof root, "%s/%s", program_folder(), name);
    snprintf(command, sizeof command,
             "mkdir -p $(dirname %s%s) && printf %%b '%s' >%s%s && chmod -R a+rwX %s", root, file, text, root,
             file, program_folder());
    assert_int_equal(system(command), 0);
    return root;
}

static void expect(const struct outcome *o, enum fv_realtime_extra extra, bool granted, const char *words)
{
    const struct fv_realtime_row *r = &o->row[extra];
    assert_true(r->asked);
    if (r->granted != granted) fail_msg("%s: %s: %s", r->key, r->granted ? "granted" : "refused", r->reason);
    if (!strstr(r->reason, words)) fail_msg("%s: '%s' does not hold '%s'", r->key, r->reason, words);
    if (strlen(r->reason) > sizeof r->reason - 2) fail_msg("cut short: %s", r->reason);
}

static void nothing_asked_for_changes_nothing(void **state)
{
    (void)state;
    struct trial t = {.request = ASK_NOTHING};
    struct outcome o = try(t);
    for (int i = 0; i < FV_REALTIME_EXTRAS; i++) {
        assert_false(o.row[i].asked || o.row[i].granted);
        assert_non_null(strstr(o.row[i].reason, o.row[i].key));
    }
    assert_int_equal(o.threads, 2);
    assert_int_equal(o.fifo, 0);
    assert_int_equal(o.locked_kb, 0);
    assert_int_equal(o.latency_files, 0);
    assert_int_equal(o.pinned, fv_threads_cores() == 1 ? 2 : 0);
}

static void pins_one_core_each_or_none(void **state)
{
    (void)state;
    int cores = fv_threads_cores();
    struct trial t = {.request = ASK_NOTHING, .workers = cores};
    t.request.pin = true;
    struct outcome o = try(t);
    expect(&o, FV_REALTIME_PIN, true, "each on a core of its own");
    assert_int_equal(o.pinned, cores);
    assert_false(o.same_core);
    if (cores == FV_WORKERS_MAX || cores == 1) return;
    t.workers = cores + 1;
    o = try(t);
    expect(&o, FV_REALTIME_PIN, false, "not one for each");
    assert_int_equal(o.pinned, 0);
}

static bool may_fifo(void)
{
    struct sched_param fifo = {.sched_priority = 5}, ordinary = {0};
    return sched_setscheduler(0, SCHED_FIFO, &fifo) == 0 &&
           sched_setscheduler(0, SCHED_OTHER, &ordinary) == 0;
}

static void *report_class(void *context)
{
    *(int *)context = sched_getscheduler(0);
    return NULL;
}

static void expect_later_threads_ordinary(struct fv_workers *w)
{
    int class = -1;
    pthread_t later;
    (void)w;
    if (pthread_create(&later, NULL, report_class, &class) || pthread_join(later, NULL) ||
        class != SCHED_OTHER)
        _exit(2);
}

static void fifo_takes_every_worker_and_no_other(void **state)
{
    (void)state;
    struct trial t = {.request = ASK_NOTHING, .before = may_fifo, .after = expect_later_threads_ordinary};
    t.request.fifo_priority = 5;
    struct outcome o = try(t);
    expect(&o, FV_REALTIME_FIFO, true, "2 workers at priority 5");
    assert_int_equal(o.threads, 2);
    assert_int_equal(o.fifo, 2);
}

static void *wait_for_ever(void *context)
{
    for (;;) pause();
    return context;
}

static bool may_fifo_with_a_device(void)
{
    pthread_t thread;
    struct fv_error error;
    return may_fifo() && fv_thread_start(&thread, "writer", FV_CAN_WAIT, wait_for_ever, NULL, &error) == 0 &&
           fv_thread_start(&thread, "device", FV_URGENT, wait_for_ever, NULL, &error) == 0;
}

static void expect_device_above(struct fv_workers *w)
{
    const pthread_t *thread;
    struct sched_param parameter = {0};
    int class = -1;
    (void)w;
    if (fv_device_threads(&thread) != 1 || pthread_getschedparam(thread[0], &class, &parameter) ||
        (class & ~SCHED_RESET_ON_FORK) != SCHED_FIFO || parameter.sched_priority != 6)
        _exit(2);
}

static void fifo_takes_devices_above_workers(void **state)
{
    (void)state;
    struct trial t = {.request = ASK_NOTHING, .before = may_fifo_with_a_device, .after = expect_device_above};
    t.request.fifo_priority = 5;
    struct outcome o = try(t);
    expect(&o, FV_REALTIME_FIFO, true, "2 workers at priority 5, devices' at 6");
    assert_int_equal(o.threads, 4);
    assert_int_equal(o.fifo, 2);
}

static void count_tile(void *context, int tile, int worker)
{
    (void)tile, (void)worker;
    atomic_fetch_add((atomic_int *)context, 1);
}

static bool one_core(void)
{
    cpu_set_t allowed, one;
    int core = 0;
    if (!may_fifo() || sched_getaffinity(0, sizeof allowed, &allowed)) return false;
    while (core < CPU_SETSIZE - 1 && !CPU_ISSET(core, &allowed)) core++;
    CPU_ZERO(&one);
    CPU_SET(core, &one);
    return sched_setaffinity(0, sizeof one, &one) == 0;
}

static void run_many(struct fv_workers *w)
{
    atomic_int seen = 0;
    for (int run = 0; run < 200; run++) fv_workers_run(w, 16, count_tile, &seen);
    if (seen != 200 * 16) _exit(2);
}

static void fifo_workers_share_a_core(void **state)
{
    (void)state;
    struct trial t = {.request = ASK_NOTHING, .workers = 3, .before = one_core, .after = run_many};
    t.request.fifo_priority = 1;
    t.request.root = root_with("bounded", "/proc/sys/kernel/sched_rt_runtime_us", "950000");
    struct outcome o = try(t);
    expect(&o, FV_REALTIME_FIFO, true, "at most 950 ms");
    assert_int_equal(o.fifo, 3);
}

static bool nobody_without_rtprio(void)
{
    return limit(RLIMIT_RTPRIO, 0) && become_nobody();
}

static bool nobody_with_rtprio(void)
{
    return may_fifo() && limit(RLIMIT_RTPRIO, 5) && become_nobody();
}

static bool with_rttime(void)
{
    return limit(RLIMIT_RTTIME, 200000);
}

static bool root_without_nice(void)
{
    struct __user_cap_header_struct header = {.version = _LINUX_CAPABILITY_VERSION_3};
    struct __user_cap_data_struct data[2];
    if (geteuid() != 0 || syscall(SYS_capget, &header, data)) return false;
    data[0].effective &= ~(1u << CAP_SYS_NICE);
    return limit(RLIMIT_RTPRIO, 0) && syscall(SYS_capset, &header, data) == 0;
}

static void fifo_is_refused_with_the_reason(void **state)
{
    (void)state;
    char many[8];
    struct trial t = {.request = ASK_NOTHING, .before = nobody_without_rtprio};
    t.request.fifo_priority = 7;
    struct outcome o = try(t);
    expect(&o, FV_REALTIME_FIFO, false, "needs CAP_SYS_NICE or an rtprio limit of 7 (ulimit -r), now 0");
    assert_int_equal(o.fifo, 0);
    t.before = root_without_nice;
    o = try(t);
    expect(&o, FV_REALTIME_FIFO, false, "CAP_SYS_NICE is missing, or the control group");
    t.before = with_rttime;
    o = try(t);
    expect(&o, FV_REALTIME_FIFO, false, "RLIMIT_RTTIME is 200000 us");
    t.before = NULL;
    t.workers = get_nprocs();
    t.request.root = root_with("unbounded", "/proc/sys/kernel/sched_rt_runtime_us", "-1");
    snprintf(many, sizeof many, "%d", t.workers);
    if (t.workers > FV_WORKERS_MAX) return;
    o = try(t);
    expect(&o, FV_REALTIME_FIFO, false, "sched_rt_runtime_us is -1");
    assert_non_null(strstr(o.row[FV_REALTIME_FIFO].reason, many));
    assert_int_equal(o.fifo, 0);
}

/* The limit that the refusal names is enough, and one less is not. */
static void fifo_needs_the_limit_it_names(void **state)
{
    (void)state;
    struct trial t = {.request = ASK_NOTHING, .before = nobody_with_rtprio};
    t.request.fifo_priority = 6;
    struct outcome o = try(t);
    expect(&o, FV_REALTIME_FIFO, false, "an rtprio limit of 6 (ulimit -r), now 5");
    assert_int_equal(o.fifo, 0);
    t.request.fifo_priority = 5;
    o = try(t);
    expect(&o, FV_REALTIME_FIFO, true, "priority 5");
    assert_int_equal(o.fifo, 2);
}

static bool may_lock(void)
{
    return mlock(fv_arena()->base, 64 * MB) == 0 && munlock(fv_arena()->base, 64 * MB) == 0;
}

static bool may_lock_with_small_stack(void)
{
    return may_lock() && limit(RLIMIT_STACK, 256 << 10);
}

static void locks_what_is_taken_and_no_more(void **state)
{
    (void)state;
    skip_without_own_heap();
    struct trial t = {.request = ASK_NOTHING, .before = may_lock};
    t.request.lock_memory = true;
    struct outcome o = try(t);
    expect(&o, FV_REALTIME_LOCK, true, " MB: what is taken of the arena");
    assert_true(o.locked_kb >= o.taken_kb + FV_WORKER_STACK_BYTES / 1024);
    assert_true(o.locked_kb < o.taken_kb + 64 * 1024);
    assert_true(o.locked_kb < (long)(fv_arena()->built >> 10) / 2);
    t.before = may_lock_with_small_stack;
    o = try(t);
    expect(&o, FV_REALTIME_LOCK, true, " MB: what is taken of the arena");
}

static rlim_t memlock_limit;

static bool nobody_with_memlock(void)
{
    return limit(RLIMIT_MEMLOCK, memlock_limit) && become_nobody();
}

static __attribute__((noinline)) int deep(volatile char *above)
{
    volatile char room[4 * MB];
    for (int at = 4 * MB - 1; at >= 0; at -= 4096) room[at] = *above;
    return room[123];
}

/* With the limit all used up, the stack can still grow. */
static void grow_stack(struct fv_workers *w)
{
    volatile char one = 1;
    (void)w;
    deep(&one);
}

/* The limit that a process without any would need, in bytes, from the refusal. */
static rlim_t named_limit(void)
{
    struct trial t = {.request = ASK_NOTHING, .before = nobody_with_memlock};
    t.request.lock_memory = true;
    memlock_limit = 0;
    struct outcome o = try(t);
    expect(&o, FV_REALTIME_LOCK, false, "needs RLIMIT_MEMLOCK of at least ");
    assert_int_equal(o.locked_kb, 0);
    const char *named = strstr(o.row[FV_REALTIME_LOCK].reason, "(ulimit -l ");
    assert_non_null(named);
    return (rlim_t)atoll(named + strlen("(ulimit -l ")) << 10;
}

static void lock_is_refused_with_the_limit_it_needs(void **state)
{
    (void)state;
    skip_without_own_heap();
    assert_true(named_limit() > 2 * FV_WORKER_STACK_BYTES);
}

/* Nor is anything kept of what fitted where not all does. */
static void lock_needs_the_limit_it_names(void **state)
{
    (void)state;
    skip_without_own_heap();
    struct trial t = {.request = ASK_NOTHING, .before = nobody_with_memlock};
    t.request.lock_memory = true;
    rlim_t needed = named_limit();
    memlock_limit = needed - 8192;
    struct outcome o = try(t);
    expect(&o, FV_REALTIME_LOCK, false, "needs RLIMIT_MEMLOCK of at least ");
    assert_int_equal(o.locked_kb, 0);
    memlock_limit = needed;
    t.after = grow_stack;
    o = try(t);
    expect(&o, FV_REALTIME_LOCK, true, "MB");
    assert_true(o.locked_kb << 10 <= (long)needed);
}

static bool take_untouched(void)
{
    fv_arena_take(fv_arena(), "untouched", 64 * MB, 4096);
    return true;
}

static void lock_leaves_memory_to_others(void **state)
{
    (void)state;
    skip_without_own_heap();
    struct trial t = {.request = ASK_NOTHING, .before = take_untouched};
    t.request.lock_memory = true;
    t.request.root = root_with("full", "/proc/meminfo", "MemTotal: 900000 kB\\nMemAvailable: 1024 kB\\n");
    struct outcome o = try(t);
    expect(&o, FV_REALTIME_LOCK, false, "MB more would have to be in memory, 1 MB are available");
    assert_int_equal(o.locked_kb, 0);
}

static void latency_is_written_and_held(void **state)
{
    (void)state;
    char path[256];
    int32_t text[16] = {0};
    struct trial t = {.request = ASK_NOTHING};
    t.request.cpu_latency_us = CPU_LATENCY_US;
    t.request.root = root_with("device", "/dev/cpu_dma_latency", "");
    struct outcome o = try(t);
    expect(&o, FV_REALTIME_LATENCY, true, "within 20 us");
    assert_int_equal(o.latency_files, 1);
    snprintf(path, sizeof path, "%s/dev/cpu_dma_latency", t.request.root);
    FILE *f = fopen(path, "rb");
    assert_non_null(f);
    assert_int_equal(fread(text, 1, sizeof text, f), sizeof *text);
    fclose(f);
    assert_int_equal(text[0], CPU_LATENCY_US);
}

static void latency_is_refused_with_the_reason(void **state)
{
    (void)state;
    char command[512];
    struct trial t = {.request = ASK_NOTHING};
    t.request.cpu_latency_us = 0;
    t.request.root = root_with("none", "/dev/null", "");
    struct outcome o = try(t);
    expect(&o, FV_REALTIME_LATENCY, false, "no /dev/cpu_dma_latency on this kernel");
    t.request.root = root_with("odd", "/dev/null", "");
    snprintf(command, sizeof command, "mkdir %s/dev/cpu_dma_latency", t.request.root);
    assert_int_equal(system(command), 0);
    o = try(t);
    expect(&o, FV_REALTIME_LATENCY, false, strerror(EISDIR));
    t.request.root = root_with("broken", "/dev/null", "");
    snprintf(command, sizeof command, "ln -s /dev/full %s/dev/cpu_dma_latency", t.request.root);
    assert_int_equal(system(command), 0);
    o = try(t);
    expect(&o, FV_REALTIME_LATENCY, false, strerror(ENOSPC));
    assert_int_equal(o.latency_files, 0);
    t.request.root = root_with("shut", "/dev/cpu_dma_latency", "");
    snprintf(command, sizeof command, "chmod 0 %s/dev/cpu_dma_latency", t.request.root);
    assert_int_equal(system(command), 0);
    t.before = become_nobody;
    o = try(t);
    expect(&o, FV_REALTIME_LATENCY, false, "needs write access to /dev/cpu_dma_latency");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nothing_asked_for_changes_nothing),
        cmocka_unit_test(pins_one_core_each_or_none),
        cmocka_unit_test(fifo_takes_every_worker_and_no_other),
        cmocka_unit_test(fifo_takes_devices_above_workers),
        cmocka_unit_test(fifo_workers_share_a_core),
        cmocka_unit_test(fifo_is_refused_with_the_reason),
        cmocka_unit_test(fifo_needs_the_limit_it_names),
        cmocka_unit_test(locks_what_is_taken_and_no_more),
        cmocka_unit_test(lock_is_refused_with_the_limit_it_needs),
        cmocka_unit_test(lock_needs_the_limit_it_names),
        cmocka_unit_test(lock_leaves_memory_to_others),
        cmocka_unit_test(latency_is_written_and_held),
        cmocka_unit_test(latency_is_refused_with_the_reason),
    };
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
