/* faults: see faults.h. */
#define _GNU_SOURCE
#include "tests/soak/faults.h"

#include "tests/soak/devices.h"
#include "tests/soak/watch.h"
#include "tests/soak/world.h"
#include "tests/support/random.h"

#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

static const double second = 1e9;
bool faults_swallow, faults_keep, faults_disk_full, faults_pipe_closed, faults_log_closed;
static double held_s; /* of the fault that is dealt out */

static void eye_gone(int n) { (void)n, eye_faults.gone = true; }
static void eye_silent(int n) { (void)n, eye_faults.silent = true; }
static void eye_shut(int n) { (void)n, eye_faults.shut = true; }
static void eye_larger(int n) { (void)n, eye_faults.larger = true, eye_faults.failing = 100; }
static void eye_flagged(int n) { eye_faults.flagged = n; }
static void eye_shorted(int n) { eye_faults.shorted = n; }
static void eye_odd(int n) { eye_faults.odd = n; }
static void eye_untimed(int n) { eye_faults.untimed = n; }
static void eye_dropped(int n) { eye_faults.dropped = n; }
static void eye_failing(int n) { eye_faults.failing = n; }
static void eye_held(int n) { (void)n, world_hold_ns("eye cameras", (int64_t)(held_s * second)); }
static void eye_well(void) { memset(&eye_faults, 0, sizeof eye_faults); }

static void imu_told(int n) { (void)n, imu_faults.gone = imu_faults.says_so = true; }
static void imu_untold(int n) { (void)n, imu_faults.gone = true; }
static void imu_mute(int n) { (void)n, imu_faults.mute = true; }
static void imu_fails(int n) { (void)n, imu_faults.fails = true; }
static void imu_refuses(int n) { (void)n, imu_faults.refuses = true; }
static void imu_stuck(int n) { (void)n, imu_faults.stuck = true; }
static void imu_forbidden(int n) { (void)n, imu_faults.fails = imu_faults.forbidden = true; }
static void imu_jammed(int n) { imu_faults.jammed = true, imu_faults.halts = n; }
static void imu_halts(int n) { imu_faults.halts = n; }
static void imu_garbled(int n) { imu_faults.garbled = n; }
static void imu_dropped(int n) { imu_faults.dropped = n + 2; /* each report brings the last three readings */ }
static void imu_skips(int n) { imu_faults.skips = n; }
static void imu_held(int n) { (void)n, world_hold_ns("imu", (int64_t)(held_s * second)); }
static void imu_well(void) { memset(&imu_faults, 0, sizeof imu_faults); }

static void screen_unplugged(int n) { (void)n, screen_lose(SCREEN_UNPLUGGED); }
static void screen_gone(int n) { (void)n, screen_lose(SCREEN_CARD_GONE); }
static void screen_taken(int n) { (void)n, screen_lose(SCREEN_TAKEN); }
static void screen_silent(int n) { (void)n, screen_lose(SCREEN_SILENT); }
static void screen_unreadable(int n) { (void)n, screen_lose(SCREEN_UNREADABLE); }
static void screen_refuses(int n) { (void)n, screen_lose(SCREEN_REFUSES); }
static void screen_clogged(int n) { (void)n, screen_busy(1000); }
static void screen_well(void) { screen_lose(SCREEN_WELL), screen_busy(0); }

static void frame_held(int n) { (void)n, world_hold_ns("main", (int64_t)(held_s * second)); }
static void disk_slow(int n) { (void)n, world_hold_ns("tape writer", (int64_t)(held_s * second)); }
static void asleep(int n);
static void stopped(int n);
static void strays(int n)
{
    static const int harmless[] = {SIGCONT, SIGWINCH, SIGURG, SIGCHLD};
    for (int i = 0; i < n; i++) kill(getpid(), harmless[i % 4]);
}
static void nothing(void) {}

#define COUNTER(name, of) static int64_t name(const struct seen *s) { return of; }
COUNTER(eye_lost, s->sensors.camera.lost)
COUNTER(eye_rejected, s->sensors.camera.rejected)
/* One that a newer frame overtakes is not looked at. */
COUNTER(eye_without_time, s->sensors.camera.untimed + s->sensors.camera.skipped)
COUNTER(eye_gaps, s->sensors.camera.gaps)
COUNTER(eye_missed, s->sensors.camera.gaps + s->sensors.camera.skipped)
COUNTER(eye_errors, s->sensors.camera.errors)
COUNTER(gaze_lost, s->sensors.gaze_lost)
COUNTER(reconnects, s->imu.connects)
COUNTER(silences, s->imu.silences)
COUNTER(failures, s->imu.failures)
COUNTER(refused, s->imu.refused)
COUNTER(stalls, s->imu.stalls)
COUNTER(foreign, s->imu.foreign)
COUNTER(lost_readings, s->imu.lost)
COUNTER(restarts, s->imu.restarts)
COUNTER(rejected, s->imu.rejected)
COUNTER(screen_lost, s->display.lost)
COUNTER(busy, s->display.busy)
COUNTER(dropped, s->display.dropped)
COUNTER(skipped, s->skipped)
COUNTER(frames, s->frames)

/* n of it, 1 to most; so long; what must grow by n (of those that are done for as long as they last: by 1). */
static const struct fault {
    const char *name;
    enum fault_group group;
    int most;
    double least_s, most_s;
    void (*inject)(int n);
    void (*mend)(void);
    int64_t (*counter)(const struct seen *seen);
} table[] = {
    {"camera: unplugged", FAULT_EYE, 1, 0.3, 5, eye_gone, eye_well, eye_lost},
    {"camera: silent", FAULT_EYE, 1, 1.5, 4, eye_silent, eye_well, eye_lost},
    {"camera: comes back too large", FAULT_EYE, 1, 0.5, 3, eye_larger, eye_well, eye_lost},
    {"camera: frames flagged", FAULT_EYE, 20, 0.7, 1, eye_flagged, eye_well, eye_rejected},
    {"camera: frames cut short", FAULT_EYE, 20, 0.7, 1, eye_shorted, eye_well, eye_rejected},
    {"camera: buffers that are none", FAULT_EYE, 7, 0.7, 1, eye_odd, eye_well, eye_rejected},
    {"camera: another clock's times", FAULT_EYE, 20, 0.7, 1, eye_untimed, eye_well, eye_without_time},
    {"camera: frames dropped", FAULT_EYE, 20, 0.7, 1, eye_dropped, eye_well, eye_gaps},
    {"camera: calls fail", FAULT_EYE, 7, 0.7, 1, eye_failing, eye_well, eye_errors},
    {"camera: the lid is down", FAULT_EYE, 1, 0.3, 3, eye_shut, eye_well, gaze_lost},
    {"camera: its thread held up", FAULT_EYE, 1, 0.1, 0.8, eye_held, eye_well, eye_missed},
    {"sensor: unplugged", FAULT_IMU, 1, 0.3, 5, imu_told, imu_well, reconnects},
    {"sensor: unplugged, not told", FAULT_IMU, 1, 0.3, 5, imu_untold, imu_well, reconnects},
    {"sensor: mute", FAULT_IMU, 1, 2.5, 5, imu_mute, imu_well, silences},
    {"sensor: transfers fail", FAULT_IMU, 1, 0.1, 4, imu_fails, imu_well, failures},
    {"sensor: transfers refused", FAULT_IMU, 1, 0.1, 1, imu_refuses, imu_well, refused},
    {"sensor: endpoint halted", FAULT_IMU, 1, 0.3, 1, imu_halts, imu_well, stalls},
    {"sensor: a halt that stays", FAULT_IMU, 1, 0.5, 3, imu_jammed, imu_well, stalls},
    {"sensor: fails, is forbidden", FAULT_IMU, 1, 1, 4, imu_forbidden, imu_well, failures},
    {"sensor: reports cut short", FAULT_IMU, 50, 0.3, 1, imu_garbled, imu_well, foreign},
    {"sensor: reports dropped", FAULT_IMU, 200, 0.5, 1, imu_dropped, imu_well, lost_readings},
    {"sensor: its clock begins anew", FAULT_IMU, 1, 0.3, 1, imu_skips, imu_well, restarts},
    {"sensor: stuck", FAULT_IMU, 1, 0.7, 3, imu_stuck, imu_well, rejected},
    {"sensor: its thread held up", FAULT_IMU, 1, 0.1, 1, imu_held, imu_well, lost_readings},
    {"display: unplugged", FAULT_SCREEN, 1, 0.7, 4, screen_unplugged, screen_well, screen_lost},
    {"display: card gone", FAULT_SCREEN, 1, 0.2, 4, screen_gone, screen_well, screen_lost},
    {"display: taken by another", FAULT_SCREEN, 1, 0.2, 4, screen_taken, screen_well, screen_lost},
    {"display: flips never over", FAULT_SCREEN, 1, 1, 4, screen_silent, screen_well, screen_lost},
    {"display: unreadable", FAULT_SCREEN, 1, 0.2, 4, screen_unreadable, screen_well, screen_lost},
    {"display: refuses flips", FAULT_SCREEN, 1, 0.2, 4, screen_refuses, screen_well, screen_lost},
    {"display: busy", FAULT_SCREEN, 3, 0.5, 1, screen_busy, screen_well, busy},
    {"display: busy for long", FAULT_SCREEN, 1, 0.5, 2, screen_clogged, screen_well, dropped},
    {"machine: a frame held up", FAULT_MACHINE, 1, 0.1, 0.5, frame_held, nothing, skipped},
    {"machine: asleep", FAULT_MACHINE, 1, 0.2, 3, asleep, nothing, skipped},
    {"machine: stopped, continued", FAULT_MACHINE, 1, 0.2, 3, stopped, nothing, skipped},
    {"machine: stray signals", FAULT_MACHINE, 4, 0.2, 0.5, strays, nothing, frames},
    {"machine: a slow disk", FAULT_MACHINE, 1, 0.5, 3, disk_slow, nothing, frames},
};
enum { FAULTS = sizeof table / sizeof table[0] };

/* Until a device must be back: the longest pause between two searches, a search in vain, and the start. */
static const double grace_s[FAULT_GROUPS] = {4, 5, 3, 2};
static const int64_t frames_least = 3;
static const double gap_s = 20; /* the longest, from one fault to the next */

static struct dealt {
    enum { QUIET, ACTIVE, SETTLING } phase;
    const struct fault *fault;
    int n;
    int64_t next_ns, ended_ns, before, frames;
} dealt[FAULT_GROUPS];
static struct tally {
    int64_t times, n, counted;
    double slowest_s;
} tally[FAULTS];

static uint64_t dice;
static bool paused, screened;
static int64_t begun_ns, last_ns;
static struct faults_once once;

/* What waits for others' recovery waits for so much longer. */
static void delay_others(double s)
{
    for (int g = 0; g < FAULT_GROUPS; g++) dealt[g].next_ns += (int64_t)(s * second);
}

static void asleep(int n)
{
    (void)n;
    world_stand_still_ns((int64_t)(held_s * second));
    delay_others(held_s + 1);
}

/* Who started the soak's session continues it. */
static void stopped(int n)
{
    kill(getpid(), SIGSTOP);
    asleep(n);
}

static const struct fault *choose(enum fault_group group)
{
    const struct fault *of[FAULTS];
    int count = 0;
    for (int i = 0; i < FAULTS; i++)
        if (table[i].group == group) of[count++] = &table[i];
    return of[(int)random_between(&dice, 0, count)];
}

static void inject(struct dealt *d, enum fault_group group, int64_t now_ns)
{
    struct seen seen;
    const struct fault *f = d->fault = choose(group);
    held_s = random_between(&dice, f->least_s, f->most_s);
    d->n = 1 + (int)random_between(&dice, 0, f->most);
    watch_look(&seen);
    d->before = f->counter(&seen);
    d->frames = seen.frames;
    d->phase = ACTIVE;
    d->next_ns = now_ns + (int64_t)(held_s * second);
    if (!(faults_swallow && f->inject == eye_flagged)) f->inject(d->n);
}

/* Once the frame loop, which may be held up as well, has met with it. */
static void mend(struct dealt *d, enum fault_group group, int64_t now_ns)
{
    struct seen seen;
    watch_look(&seen);
    if (seen.frames < d->frames + frames_least) {
        d->next_ns = now_ns + (int64_t)(0.1 * second);
        return;
    }
    if (!(faults_keep && d->fault->inject == eye_gone)) d->fault->mend();
    d->phase = SETTLING;
    d->ended_ns = now_ns;
    d->next_ns = now_ns + (int64_t)(grace_s[group] * second);
    watch_expect(group);
}

static void judge(struct dealt *d, enum fault_group group, int64_t now_ns)
{
    struct seen seen;
    watch_look(&seen);
    struct tally *t = &tally[d->fault - table];
    int64_t grown = d->fault->counter(&seen) - d->before, back_ns = watch_back_ns(group);
    double took_s = 1e-9 * (double)(back_ns - d->ended_ns);
    t->times++;
    t->n += d->n;
    t->counted += grown;
    if (grown < d->n)
        watch_fail("%s: %d times, but its counter grew by %lld", d->fault->name, d->n, (long long)grown);
    if (back_ns == 0) watch_fail("%s: not back %g s after it was put right", d->fault->name, grace_s[group]);
    else if (watch_fresh_ns(group) < watch_fresh_ns(FAULT_MACHINE) - (int64_t)(0.3 * second))
        watch_fail("%s: back, but not for good", d->fault->name);
    else if (took_s > t->slowest_s) t->slowest_s = took_s;
    d->phase = QUIET;
    d->next_ns = now_ns + (int64_t)(random_between(&dice, 0.5, gap_s) * second);
}

static void step(enum fault_group group, int64_t now_ns)
{
    struct dealt *d = &dealt[group];
    if (now_ns < d->next_ns) return;
    switch (d->phase) {
    case QUIET:
        if (paused || now_ns >= last_ns) d->next_ns = now_ns + (int64_t)(0.1 * second);
        else inject(d, group, now_ns);
        break;
    case ACTIVE: mend(d, group, now_ns); break;
    case SETTLING: judge(d, group, now_ns); break;
    }
}

static bool due(double s, int64_t now_ns)
{
    return s > 0 && now_ns >= begun_ns + (int64_t)(s * second);
}

static int64_t fate(int64_t now_ns)
{
    int64_t next_ns = INT64_MAX;
    faults_disk_full = due(once.disk_full_s, now_ns);
    faults_pipe_closed = due(once.pipe_closed_s, now_ns);
    faults_log_closed = due(once.log_closed_s, now_ns);
    if (due(once.end_s, now_ns) && faults_idle()) {
        kill(getpid(), once.end_signal);
        return now_ns + (int64_t)second;
    }
    for (int g = 0; g < FAULT_GROUPS; g++) {
        if (g != FAULT_SCREEN || screened) step(g, now_ns);
        if (dealt[g].next_ns < next_ns && (g != FAULT_SCREEN || screened)) next_ns = dealt[g].next_ns;
    }
    int64_t soon_ns = world_now_ns() + (int64_t)(0.1 * second);
    return next_ns < soon_ns ? next_ns : soon_ns;
}

void faults_begin(uint64_t seed, bool screen, double quiet_s, const struct faults_once *of)
{
    dice = seed;
    screened = screen;
    once = *of;
    begun_ns = world_now_ns();
    last_ns = begun_ns + (int64_t)((of->end_s - 15) * second);
    memset(dealt, 0, sizeof dealt);
    for (int g = 0; g < FAULT_GROUPS; g++)
        dealt[g].next_ns = begun_ns + (int64_t)((quiet_s + random_between(&dice, 0, 3)) * second);
    world_fate(fate, begun_ns);
}

void faults_pause(bool pause_them)
{
    paused = pause_them;
}

bool faults_idle(void)
{
    for (int g = 0; g < FAULT_GROUPS; g++)
        if (dealt[g].phase != QUIET) return false;
    return true;
}

void faults_report(void)
{
    printf("%-32s %7s %8s %9s %12s\n", "fault", "times", "of it", "counted", "back after");
    for (int i = 0; i < FAULTS; i++)
        if (tally[i].times)
            printf("%-32s %7lld %8lld %9lld %10.2f s\n", table[i].name, (long long)tally[i].times, (long long)tally[i].n,
                   (long long)tally[i].counted, tally[i].slowest_s);
}
