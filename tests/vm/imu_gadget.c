/* imu_gadget HZ SECONDS [MODE...]: the device's side of /dev/hidg0: reports of an HTC Vive that turns at 10 degrees a second
 * about its y axis, each with the newest three readings. With modes: reports of one reading in floats (acceleration, rate,
 * clock in ms), sound or insane as the first mode says, as the next one from each SIGUSR1 on: sound, nan, huge, saturated,
 * stuck, repeated (the clock stands still), back (it is behind by a minute). A report that the host does not fetch in time
 * is left out, as the device does: its readings come with the next. It is before all others in getting the processor. Runs
 * in the virtual machine of tests/vm. */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <sched.h>
#include <signal.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum { REPORT = 52 };

static void put(uint8_t *at, int64_t value, int bytes)
{
    for (int i = 0; i < bytes; i++) at[i] = (uint8_t)((uint64_t)value >> 8 * i);
}

/* The clock wraps after 6 s. */
static void make_report(uint8_t report[REPORT], long newest, double hz)
{
    report[0] = 0x20;
    for (int n = 0; n < 3; n++) {
        uint8_t *at = report + 1 + 17 * n;
        long reading = newest + n - 2;
        put(at, reading % 3 - 1, 2), put(at + 2, -8192, 2), put(at + 4, 0, 2);
        put(at + 6, 0, 2), put(at + 8, -lrint(10 * 32768.0 / 500), 2), put(at + 10, 0, 2);
        put(at + 12, INT64_C(4000000000) + (int64_t)((double)reading * 48e6 / hz), 4);
        at[16] = (uint8_t)reading;
    }
}

static volatile sig_atomic_t mode;

static void go_on(int number)
{
    (void)number;
    mode = mode + 1;
}

/* imu.layout: faults.sh. */
static void make_floats(uint8_t report[REPORT], long newest, double hz, const char *how)
{
    static long stopped;
    float acc[3] = {(float)(newest % 3 - 1) * 0.005f, -9.81f, 0}, rate[3] = {0, -0.1745f, 0}, rates = NAN;
    long clock_ms = 100000 + lrint((double)newest * 1e3 / hz);
    bool stuck = strcmp(how, "stuck") == 0, repeated = strcmp(how, "repeated") == 0;
    if (strcmp(how, "huge") == 0) rates = 1e30f;
    if (strcmp(how, "saturated") == 0) rates = 8.75f;
    if (strcmp(how, "nan") == 0 || !isnan(rates)) rate[0] = rate[1] = rate[2] = rates;
    if (stuck) acc[0] = 0;
    if (!repeated) stopped = clock_ms;
    if (strcmp(how, "back") == 0) stopped -= 60000;
    memset(report, 0, REPORT);
    memcpy(report, acc, sizeof acc);
    memcpy(report + 12, rate, sizeof rate);
    put(report + 24, stopped, 4);
}

int main(int count, char **text)
{
    double hz = count > 1 ? atof(text[1]) : 1000, seconds = count > 2 ? atof(text[2]) : 1;
    uint8_t report[REPORT];
    struct timespec t;
    int fd = -1, modes = count - 3;
    signal(SIGUSR1, go_on);
    sched_setscheduler(0, SCHED_FIFO, &(struct sched_param){50});
    clock_gettime(CLOCK_MONOTONIC, &t);
    for (long n = 0; n < (long)(hz * seconds); n++) {
        if (modes > 0) make_floats(report, n, hz, text[3 + (mode < modes ? mode : modes - 1)]);
        else make_report(report, n, hz);
        if (fd < 0) fd = open("/dev/hidg0", O_RDWR | O_NONBLOCK);
        if (fd >= 0 && write(fd, report, REPORT) != REPORT && errno != EAGAIN) close(fd), fd = -1;
        t.tv_nsec += (long)(1e9 / hz);
        if (t.tv_nsec >= 1000000000) t.tv_nsec -= 1000000000, t.tv_sec++;
        while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, NULL) == EINTR) {}
    }
    return 0;
}
