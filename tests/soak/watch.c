/* watch: see watch.h. */
#define _GNU_SOURCE
#include "tests/soak/watch.h"

#include "platform/arena.h"
#include "platform/heap.h"
#include "tests/soak/devices.h"
#include "tests/soak/world.h"

#include <fcntl.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

enum { WINDOWS = 512, BINS = 1600, DESCRIPTORS = 256, FAILURES_SAID = 40 };
static const double bin_step = 0.01; /* of the logarithm of a frame's processor time in ns, per ray */

/* Limits. A stack may grow, and be touched for the first time; processor time is a noisy machine's. */
static const long resident_most_kb = 256, size_most_kb = 128;
static const struct {
    double windows_s, ray, rays; /* times as much in the last third of windows of that length as in the first */
} ratio_most[] = {{300, 1.5, 1.25}, {0, 4, 4}};

bool watch_hoard, watch_slow;
void (*watch_each_frame)(void);
int watch_closed;

static struct window {
    double at_s;
    int descriptors, threads;
    long size_kb, resident_kb;
    size_t arena;
    int64_t heap_calls, system_calls, frames;
    struct devices_held held;
    double frame_us, ray_ns, rays; /* a frame, in the mean; a ray, in the median; rays a frame, in the mean */
} window[WINDOWS];
static int windows;
static bool based; /* window[0] holds what there was before the first fault */

static uint64_t seed_of_all;
static const char *session_name;
static int64_t begun_ns, every_ns, next_ns;
static int failures;

static struct fv_setup *setup;
static struct fv_display *display;
static int64_t fresh_ns[FAULT_GROUPS], back_ns[FAULT_GROUPS];
static int64_t flips_before;

static unsigned bin[BINS];
static int64_t frames_binned, cpu_before_ns;
static double rays_sum, cpu_sum_ns;

static double at_s(void)
{
    return 1e-9 * (double)(world_now_ns() - begun_ns);
}

void watch_fail(const char *format, ...)
{
    char text[256];
    va_list list;
    va_start(list, format);
    vsnprintf(text, sizeof text, format, list);
    va_end(list);
    if (failures++ < FAILURES_SAID)
        printf("soak: seed %llu, %s, at %.1f s: %s\n", (unsigned long long)seed_of_all, session_name, at_s(), text);
    fflush(stdout);
}

int watch_failures(void)
{
    return failures;
}

static int descriptors(void)
{
    int open = watch_closed;
    for (int fd = 0; fd < DESCRIPTORS; fd++) open += fcntl(fd, F_GETFD) >= 0;
    return open;
}

void watch_look(struct seen *seen)
{
    *seen = (struct seen){.frames = 0};
    if (setup) {
        seen->sensors = fv_sensors_counts(setup->sensors);
        seen->frames = setup->session.frames;
        seen->skipped = setup->session.skipped;
    }
    if (imu_feed) seen->imu = imu_feed->state.counts;
    if (display) seen->display = fv_display_counts(display);
}

int64_t watch_fresh_ns(enum fault_group group)
{
    return fresh_ns[group];
}

void watch_expect(enum fault_group group)
{
    back_ns[group] = 0;
}

int64_t watch_back_ns(enum fault_group group)
{
    return back_ns[group];
}

static void works(enum fault_group group, bool well)
{
    if (!well) return;
    fresh_ns[group] = world_now_ns();
    if (back_ns[group] == 0) back_ns[group] = fresh_ns[group];
}

static void touch(char *from, char *to)
{
    for (volatile char *at = from; (char *)at < to; at += 4096) *at = *at;
}

/* What a session has taken is touched, so that resident memory grows by nothing but what is taken later. */
#ifdef FV_HEAP
static const bool own_heap = true;
extern char __data_start[], _end[];
static void touch_memory(void)
{
    const struct fv_arena *a = fv_arena();
    bool inside = a->base > __data_start && a->base < _end;
    touch(a->base, a->base + a->used);
    touch(__data_start, inside ? a->base : _end);
    if (inside) touch(a->base + a->built, _end);
}
#else
static const bool own_heap = false;
static void touch_memory(void) {}
#endif

static void read_memory(struct window *w)
{
    char text[128] = "";
    int fd = open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
    if (fd >= 0 && read(fd, text, sizeof text - 1) < 0) text[0] = 0;
    close(fd);
    char *end;
    w->size_kb = strtol(text, &end, 10) * 4;
    w->resident_kb = strtol(end, NULL, 10) * 4;
    struct stat tasks;
    w->threads = stat("/proc/self/task", &tasks) == 0 ? (int)tasks.st_nlink - 2 : 0;
}

static double median_ns(void)
{
    int64_t below = 0;
    for (int i = 0; i < BINS; i++)
        if ((below += bin[i]) * 2 > frames_binned) return exp((i + 0.5) * bin_step);
    return 0;
}

static void compare(const struct window *w)
{
    const struct window *base = &window[0], *first = &window[1];
    if (w->descriptors != base->descriptors)
        watch_fail("%d descriptors are open, %d were", w->descriptors, base->descriptors);
    if (memcmp(&w->held, &base->held, sizeof w->held) != 0)
        watch_fail("devices are held otherwise than at first: camera %d, %d mapped; sensor %d; display %d, %d mapped, %d blobs",
                   w->held.eye_open, w->held.eye_mapped, w->held.imu_open, w->held.screen_open, w->held.screen_mapped,
                   w->held.screen_blobs);
    if (w->threads != base->threads) watch_fail("%d threads, there were %d", w->threads, base->threads);
    if (w->arena != base->arena) watch_fail("%zu bytes of the arena are taken, %zu were", w->arena, base->arena);
    if (w->heap_calls || w->system_calls)
        watch_fail("%lld calls of the sealed heap, %lld memory system calls", (long long)w->heap_calls, (long long)w->system_calls);
    if (!own_heap) return; /* a sanitizer's grows */
    if (w->size_kb > first->size_kb + size_most_kb) watch_fail("%ld kB of memory, %ld after the first window", w->size_kb, first->size_kb);
    if (w->resident_kb > first->resident_kb + resident_most_kb)
        watch_fail("%ld kB of memory are resident, %ld after the first window", w->resident_kb, first->resident_kb);
}

static void inspect(void)
{
    if (windows == WINDOWS) return;
    struct window *w = &window[windows++];
    *w = (struct window){.at_s = at_s(),
                         .descriptors = descriptors(),
                         .arena = fv_arena()->used,
                         .heap_calls = fv_heap_calls(),
                         .system_calls = fv_heap_system_calls(),
                         .held = devices_held(),
                         .frames = frames_binned};
    read_memory(w);
    if (frames_binned > 0) {
        w->frame_us = 1e-3 * cpu_sum_ns / (double)frames_binned;
        w->ray_ns = median_ns();
        w->rays = rays_sum / (double)frames_binned;
    }
    memset(bin, 0, sizeof bin);
    frames_binned = 0;
    rays_sum = cpu_sum_ns = 0;
    if (windows > 1) compare(w);
    if (watch_hoard) {
        char *kept = mmap(NULL, 1 << 20, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
        if (kept != MAP_FAILED) touch(kept, kept + (1 << 20));
    }
}

/* Where no fault is under way: they are held back until none is. */
static void inspect_in_time(void)
{
    if (world_now_ns() < next_ns) return;
    faults_pause(true);
    if (!faults_idle()) return;
    if (!based) touch_memory();
    inspect();
    based = true;
    next_ns = world_now_ns() + every_ns;
    faults_pause(false);
}

static int64_t cpu_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (int64_t)t.tv_sec * 1000000000 + t.tv_nsec;
}

/* The frame before. */
static void take_frame(const struct fv_setup *s)
{
    int64_t now = cpu_ns(), took = now - cpu_before_ns;
    cpu_before_ns = now;
    if (took <= 0 || !based || s->session.frames == 0) return;
    double rays = 0;
    for (int w = 0; w < s->workers.count; w++)
        for (int k = 0; k < FV_RAY_KINDS; k++) rays += (double)s->loop.frame.scratch[w].rays[k];
    int i = (int)(log((double)took / fmax(rays, 1)) / bin_step);
    bin[i < 0 ? 0 : i < BINS ? i : BINS - 1]++;
    frames_binned++;
    rays_sum += rays;
    cpu_sum_ns += (double)took;
}

static volatile double burnt;
static void burn(void)
{
    for (int i = 0; i < (int)(100 * at_s() * at_s()); i++) burnt = burnt + i;
}

void __real_fv_setup_latch(struct fv_setup *s, int64_t now_ns, int64_t show_ns, struct fv_pose *relative, struct fv_gaze *gaze,
                           struct fv_pose *head);
void __wrap_fv_setup_latch(struct fv_setup *s, int64_t now_ns, int64_t show_ns, struct fv_pose *relative, struct fv_gaze *gaze,
                           struct fv_pose *head);
void __wrap_fv_setup_latch(struct fv_setup *s, int64_t now_ns, int64_t show_ns, struct fv_pose *relative, struct fv_gaze *gaze,
                           struct fv_pose *head)
{
    setup = s;
    take_frame(s);
    inspect_in_time();
    if (watch_each_frame) watch_each_frame();
    if (watch_slow) burn();
    __real_fv_setup_latch(s, now_ns, show_ns, relative, gaze, head);
    works(FAULT_MACHINE, true);
    works(FAULT_EYE, !gaze->held && now_ns - gaze->t_ns < 100000000);
    works(FAULT_IMU, imu_feed && imu_feed->phase == FV_IMU_STREAMING && world_now_ns() - imu_feed->state.t_ns < 20000000);
    if (!fv_pose_sound(head)) watch_fail("a pose that is none");
}

int __real_fv_display_present(struct fv_display *d, const struct fv_picture *picture, int64_t frame, struct fv_error *error);
int __wrap_fv_display_present(struct fv_display *d, const struct fv_picture *picture, int64_t frame, struct fv_error *error);
int __wrap_fv_display_present(struct fv_display *d, const struct fv_picture *picture, int64_t frame, struct fv_error *error)
{
    display = d;
    int failed = __real_fv_display_present(d, picture, frame, error);
    int64_t flips = fv_display_counts(d).flips;
    works(FAULT_SCREEN, flips > flips_before);
    flips_before = flips;
    return failed;
}

void watch_begin(uint64_t seed, const char *session, double every_s)
{
    seed_of_all = seed;
    session_name = session;
    begun_ns = world_now_ns();
    every_ns = (int64_t)(every_s * 1e9);
    next_ns = begun_ns + 3000000000;
}

/* The median of some windows' rays a frame, or of what a ray takes. */
static double middle(int from, int count, bool rays)
{
    double sorted[WINDOWS];
    for (int i = 0; i < count; i++) {
        double value = rays ? window[from + i].rays : window[from + i].ray_ns;
        int at = i;
        for (; at > 0 && sorted[at - 1] > value; at--) sorted[at] = sorted[at - 1];
        sorted[at] = value;
    }
    return sorted[count / 2];
}

/* The last third of the windows against the first. */
static void report_drift(void)
{
    int third = (windows - 1) / 3, of = 0;
    if (third == 0) return;
    while (every_ns < (int64_t)(ratio_most[of].windows_s * 1e9)) of++;
    for (int rays = 0; rays < 2; rays++) {
        const char *what = rays ? "rays a frame" : "ns a ray";
        double first = middle(1, third, rays), last = middle(windows - third, third, rays);
        printf("%s: %.1f at first, %.1f at last: %.3f times\n", what, first, last, last / first);
        if (last > (rays ? ratio_most[of].rays : ratio_most[of].ray) * first) watch_fail("%.1f %s, %.1f at first", last, what, first);
    }
}

void watch_report(void)
{
    printf("%8s %7s %5s %7s %8s %11s %8s %7s %7s\n", "at s", "frames", "files", "threads", "size kB", "resident kB", "frame us",
           "rays", "ns/ray");
    for (int i = 0; i < windows; i++) {
        const struct window *w = &window[i];
        printf("%8.0f %7lld %5d %7d %8ld %11ld %8.1f %7.1f %7.1f\n", w->at_s, (long long)w->frames, w->descriptors, w->threads,
               w->size_kb, w->resident_kb, w->frame_us, w->rays, w->ray_ns);
    }
    report_drift();
}
