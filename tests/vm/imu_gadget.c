/* imu_gadget HZ SECONDS: the device's side of /dev/hidg0: reports of an HTC Vive that turns at 10 degrees a second about
 * its y axis, each with the newest three readings. A report that the host does not fetch in time is left out, as the
 * device does: its readings come with the next. It is before all others in getting the processor. Runs in the virtual machine of tests/vm. */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <sched.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
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

int main(int count, char **text)
{
    double hz = count > 1 ? atof(text[1]) : 1000, seconds = count > 2 ? atof(text[2]) : 1;
    uint8_t report[REPORT];
    struct timespec t;
    int fd = -1;
    sched_setscheduler(0, SCHED_FIFO, &(struct sched_param){50});
    clock_gettime(CLOCK_MONOTONIC, &t);
    for (long n = 0; n < (long)(hz * seconds); n++) {
        make_report(report, n, hz);
        if (fd < 0) fd = open("/dev/hidg0", O_RDWR | O_NONBLOCK);
        if (fd >= 0 && write(fd, report, REPORT) != REPORT && errno != EAGAIN) close(fd), fd = -1;
        t.tv_nsec += (long)(1e9 / hz);
        if (t.tv_nsec >= 1000000000) t.tv_nsec -= 1000000000, t.tv_sec++;
        clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, NULL);
    }
    return 0;
}
