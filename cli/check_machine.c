/* check_machine: what the kernel tells of clock, timers, frequency, heat and memory. See check.h.
 *
 * Files and their meaning: Linux, Documentation/ABI/testing/sysfs-devices-system-cpu and sysfs-class-thermal,
 * Documentation/timers/timekeeping.rst, Documentation/admin-guide/pm/cpufreq.rst. */
#define _GNU_SOURCE
#include "cli/check.h"

#include "platform/arena.h"
#include "rt/measure/rank.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum { LINE = 192, READINGS = 20000, SLEEPS = 100, SLEEP_NS = 1000000, ZONES_MAX = 64 };

/* First line of root/folder/file, without its end. False where there is none. */
static bool read_line(const struct fv_check *c, const char *folder, const char *file, char text[LINE])
{
    char path[2 * FV_PATH_MAX];
    snprintf(path, sizeof path, "%s%s/%s", c->root, folder, file);
    int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    text[0] = 0;
    if (fd < 0) return false;
    ssize_t got = read(fd, text, LINE - 1);
    close(fd);
    text[got > 0 ? got : 0] = 0;
    text[strcspn(text, "\n")] = 0;
    for (size_t end = strlen(text); end > 0 && text[end - 1] == ' ';) text[--end] = 0;
    return text[0] != 0;
}

static bool read_number(const struct fv_check *c, const char *folder, const char *file, double *number)
{
    char text[LINE], *end;
    if (!read_line(c, folder, file, text)) return false;
    *number = strtod(text, &end);
    return end != text && *end == 0;
}

/* What clocks are made of: those that are read without a system call and by the nanosecond, and the others. */
static const struct {
    const char *name;
    enum fv_check_state state;
    const char *what;
} sources[] = {
    {"tsc", FV_CHECK_OK, "the processor's counter"},
    {"arch_sys_counter", FV_CHECK_OK, "the processor's counter"},
    {"kvm-clock", FV_CHECK_NOTE, "the virtual machine's host: time may stand still for as long as the host likes"},
    {"hyperv_clocksource_tsc_page", FV_CHECK_NOTE, "the virtual machine's host"},
    {"hpet", FV_CHECK_NOTE, "a chip beside the processor: each reading is a system call of a microsecond"},
    {"acpi_pm", FV_CHECK_NOTE, "a chip beside the processor: each reading is a system call of microseconds"},
    {"jiffies", FV_CHECK_FAULT, "the timer's tick: milliseconds"},
    {"refined-jiffies", FV_CHECK_FAULT, "the timer's tick: milliseconds"},
};

static void check_source(struct fv_check *c)
{
    static const char folder[] = "/sys/devices/system/clocksource/clocksource0";
    char now[LINE], all[LINE], change[FV_TEXT_MAX] = "";
    if (!read_line(c, folder, "current_clocksource", now)) {
        fv_check_add(c, "clock", "source", FV_CHECK_NOTE, "", "not told by this kernel");
        return;
    }
    read_line(c, folder, "available_clocksource", all);
    enum fv_check_state state = FV_CHECK_NOTE;
    const char *what = "not known to this program";
    for (size_t i = 0; i < sizeof sources / sizeof sources[0]; i++)
        if (strcmp(now, sources[i].name) == 0) state = sources[i].state, what = sources[i].what;
    bool counter = strstr(all, "tsc") || strstr(all, "arch_sys_counter");
    if (state != FV_CHECK_OK && counter)
        snprintf(change, sizeof change, "boot with clocksource=%s on the kernel's command line",
                 strstr(all, "arch_sys_counter") ? "arch_sys_counter" : "tsc");
    else if (state == FV_CHECK_FAULT)
        snprintf(change, sizeof change, "a kernel with a driver for this board's counter (CONFIG_ARM_ARCH_TIMER, TSC)");
    fv_check_add(c, "clock", "source", state, change, "%.40s: %s; there are: %.80s", now, what, all);
}

/* The clock's resolution as the kernel has it (1 ns with high-resolution timers, else a tick), the smallest step that is
 * seen, and what a reading costs. */
static void check_resolution(struct fv_check *c)
{
    struct timespec tick = {0};
    int64_t from = fv_clock_now_ns(&fv_clock_monotonic), last = from, step = INT64_MAX;
    for (int i = 0; i < READINGS; i++) {
        int64_t now = fv_clock_now_ns(&fv_clock_monotonic);
        if (now > last && now - last < step) step = now - last;
        last = now;
    }
    double each_ns = (double)(last - from) / READINGS;
    clock_getres(CLOCK_MONOTONIC, &tick);
    bool coarse = tick.tv_sec > 0 || tick.tv_nsec > 1000;
    enum fv_check_state state = coarse ? FV_CHECK_FAULT : each_ns > 500 ? FV_CHECK_NOTE : FV_CHECK_OK;
    fv_check_add(c, "clock", "resolution", state,
                 coarse ? "a kernel with high-resolution timers (CONFIG_HIGH_RES_TIMERS, no nohighres)" : "",
                 "timers %ld ns, steps of %lld ns, a reading takes %.0f ns", tick.tv_sec * 1000000000L + tick.tv_nsec,
                 (long long)step, each_ns);
}

static void check_wake(struct fv_check *c)
{
    double late_us[SLEEPS];
    for (int i = 0; i < SLEEPS; i++) {
        int64_t until_ns = fv_clock_now_ns(&fv_clock_monotonic) + SLEEP_NS;
        fv_clock_sleep_until_ns(&fv_clock_monotonic, until_ns);
        late_us[i] = 1e-3 * (double)(fv_clock_now_ns(&fv_clock_monotonic) - until_ns);
    }
    fv_rank_sort(late_us, SLEEPS);
    c->wake_us_p50 = late_us[SLEEPS / 2 - 1];
    c->wake_us_p99 = late_us[SLEEPS * 99 / 100 - 1];
    bool late = c->wake_us_p99 > 2000;
    fv_check_add(c, "clock", "wake-up", late ? FV_CHECK_NOTE : FV_CHECK_OK,
                 late ? "threads.fifo and threads.cpu_latency_us (config/boards/headset.ini), fewer other programs" : "",
                 "a sleep ends late by %.0f us (p50), %.0f us (p99), %.0f us at most", c->wake_us_p50, c->wake_us_p99,
                 late_us[SLEEPS - 1]);
}

/* Entries of a folder whose names begin with `prefix` and a number, in order of it; returns how many. */
static int numbered(const struct fv_check *c, const char *folder, const char *prefix, int number[ZONES_MAX])
{
    char path[2 * FV_PATH_MAX];
    int count = 0;
    size_t length = strlen(prefix);
    snprintf(path, sizeof path, "%s%s", c->root, folder);
    DIR *all = opendir(path);
    for (struct dirent *e; all && (e = readdir(all));) {
        const char *digits = e->d_name + length;
        if (strncmp(e->d_name, prefix, length) != 0 || count == ZONES_MAX) continue;
        if (!*digits || strspn(digits, "0123456789") != strlen(digits) || strlen(digits) > 6) continue;
        int at = count++, value = atoi(digits);
        for (; at > 0 && number[at - 1] > value; at--) number[at] = number[at - 1];
        number[at] = value;
    }
    if (all) closedir(all);
    return count;
}

/* powersave of these drivers follows the load; that of others stays at the lowest frequency. */
static bool follows_load(const char *governor, const char *driver)
{
    bool own = strcmp(driver, "intel_pstate") == 0 || strcmp(driver, "amd-pstate-epp") == 0;
    return strcmp(governor, "powersave") != 0 || own;
}

static void check_policy(struct fv_check *c, int number)
{
    char folder[96], what[48], governor[LINE] = "none", driver[LINE] = "", cores[LINE] = "", change[FV_TEXT_MAX] = "";
    double now = 0, most = 0, able = 0;
    snprintf(folder, sizeof folder, "/sys/devices/system/cpu/cpufreq/policy%d", number);
    read_line(c, folder, "scaling_governor", governor);
    read_line(c, folder, "scaling_driver", driver);
    read_line(c, folder, "affected_cpus", cores);
    read_number(c, folder, "scaling_cur_freq", &now);
    read_number(c, folder, "scaling_max_freq", &most);
    read_number(c, folder, "cpuinfo_max_freq", &able);
    enum fv_check_state state = FV_CHECK_OK;
    if (strcmp(governor, "performance") != 0) {
        state = follows_load(governor, driver) ? FV_CHECK_NOTE : FV_CHECK_FAULT;
        snprintf(change, sizeof change, "governor performance: echo performance >%s/scaling_governor", folder);
    }
    if (most > 0 && most < 0.98 * able) {
        if (state == FV_CHECK_OK) state = FV_CHECK_NOTE;
        snprintf(change + strlen(change), sizeof change - strlen(change), "%sit is held below what it can: %s/scaling_max_freq",
                 change[0] ? "; " : "", folder);
    }
    snprintf(what, sizeof what, "cores %.36s", cores[0] ? cores : "?");
    fv_check_add(c, "cpu", what, state, change, "governor %.24s (%.24s), %.0f of %.0f MHz, able to %.0f", governor,
                 driver[0] ? driver : "driver not told", 1e-3 * now, 1e-3 * most, 1e-3 * able);
}

static void check_frequency(struct fv_check *c)
{
    int number[ZONES_MAX], policies = numbered(c, "/sys/devices/system/cpu/cpufreq", "policy", number);
    for (int i = 0; i < policies; i++) check_policy(c, number[i]);
    if (!policies)
        fv_check_add(c, "cpu", "frequency", FV_CHECK_NOTE, "", "not told by this kernel (a virtual machine, or no cpufreq driver)");
}

/* The lowest temperature at which something gives way, 1e9 where nothing does: hot and critical ends the machine itself. */
static double passive_trip(const struct fv_check *c, const char *folder)
{
    double lowest = 1e9, at;
    for (int i = 0; i < 16; i++) {
        char file[32], type[LINE];
        snprintf(file, sizeof file, "trip_point_%d_type", i);
        if (!read_line(c, folder, file, type)) continue;
        snprintf(file, sizeof file, "trip_point_%d_temp", i);
        if (strcmp(type, "active") != 0 && read_number(c, folder, file, &at) && at > 0 && at < lowest) lowest = at;
    }
    return lowest;
}

static void check_zone(struct fv_check *c, int number)
{
    char folder[64], type[LINE], limit[48] = "no limit told";
    double now;
    snprintf(folder, sizeof folder, "/sys/class/thermal/thermal_zone%d", number);
    if (!read_number(c, folder, "temp", &now)) return; /* sensors may be off */
    if (!read_line(c, folder, "type", type)) snprintf(type, sizeof type, "zone %d", number);
    double trip = passive_trip(c, folder);
    if (trip < 1e9) snprintf(limit, sizeof limit, "gives way at %.1f C", 1e-3 * trip);
    bool hot = now >= trip, warm = now >= trip - 5000;
    fv_check_add(c, "heat", type, hot ? FV_CHECK_FAULT : warm ? FV_CHECK_NOTE : FV_CHECK_OK,
                 warm ? "cool it, or ask less of it (budget.hz, threads.workers): frames get slower here" : "", "%.1f C, %s",
                 1e-3 * now, limit);
}

/* What the kernel does against heat right now to what computes; fans are no matter. */
static void check_cooling(struct fv_check *c)
{
    int number[ZONES_MAX], count = numbered(c, "/sys/class/thermal", "cooling_device", number);
    for (int i = 0; i < count; i++) {
        char folder[64], type[LINE];
        double now, most;
        snprintf(folder, sizeof folder, "/sys/class/thermal/cooling_device%d", number[i]);
        if (!read_line(c, folder, "type", type) || !read_number(c, folder, "cur_state", &now) || now <= 0) continue;
        if (!strcasestr(type, "cpu") && !strcasestr(type, "processor")) continue;
        if (!read_number(c, folder, "max_state", &most)) most = now;
        fv_check_add(c, "heat", type, FV_CHECK_FAULT, "cool it: the kernel slows the cores",
                     "step %.0f of %.0f is taken", now, most);
    }
}

static void check_heat(struct fv_check *c)
{
    int number[ZONES_MAX], zones = numbered(c, "/sys/class/thermal", "thermal_zone", number), before = c->rows;
    for (int i = 0; i < zones; i++) check_zone(c, number[i]);
    if (c->rows == before) fv_check_add(c, "heat", "temperature", FV_CHECK_NOTE, "", "not told by this kernel");
    check_cooling(c);
}

void fv_check_machine(struct fv_check *c)
{
    check_source(c);
    check_resolution(c);
    check_wake(c);
    check_frequency(c);
    check_heat(c);
}

void fv_check_memory(struct fv_check *c, const struct fv_config *config)
{
    const struct fv_arena *arena = fv_arena();
    char path[FV_PATH_MAX], line[LINE];
    unsigned long long kb = 0;
    (void)config;
    snprintf(path, sizeof path, "%s/proc/meminfo", c->root);
    FILE *f = fopen(path, "re");
    while (f && fgets(line, sizeof line, f)) sscanf(line, "MemAvailable: %llu kB", &kb);
    if (f) fclose(f);
    size_t used_mb = arena->used >> 20;
    bool little = kb > 0 && kb >> 10 < used_mb; /* of its own, some is in use already */
    fv_check_add(c, "memory", "arena", little ? FV_CHECK_FAULT : FV_CHECK_OK,
                 little ? "end other programs, or a smaller scene, display or method ('foveola plan' tells what takes it)" : "",
                 "%zu MB taken of %zu MB; the machine has %llu MB left", used_mb, arena->capacity >> 20, kb >> 10);
}
