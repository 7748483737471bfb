/* gpio_tool COMMAND...: drives and watches the lines of a gpio-sim chip by its files. Runs in the virtual machine of
 * tests/vm, before all others in getting the processor.
 *
 *   pulse PULL HZ SECONDS   the line rises so often
 *   watch VALUE SECONDS     how often the line changed in that time, or until SIGTERM */
#define _GNU_SOURCE
#include <fcntl.h>
#include <sched.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

static volatile sig_atomic_t ended;

static void end(int number)
{
    (void)number;
    ended = 1;
}

static void wait_ns(struct timespec *t, long ns)
{
    t->tv_nsec += ns;
    while (t->tv_nsec >= 1000000000) t->tv_nsec -= 1000000000, t->tv_sec++;
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, t, NULL);
}

int main(int count, char **text)
{
    struct timespec t;
    if (count < 4) return 2;
    int pulse = strcmp(text[1], "pulse") == 0, fd = open(text[2], pulse ? O_WRONLY : O_RDONLY);
    double hz = pulse ? atof(text[3]) : 250, seconds = atof(text[pulse ? 4 : 3]);
    if (fd < 0) return perror(text[2]), 1;
    sched_setscheduler(0, SCHED_FIFO, &(struct sched_param){50});
    clock_gettime(CLOCK_MONOTONIC, &t);
    int changes = 0;
    signal(SIGTERM, end);
    char before = 0;
    for (long n = 0; n < (long)(hz * seconds) && !ended; n++) {
        if (pulse) {
            if (pwrite(fd, "pull-up", 7, 0) != 7) return perror("pull"), 1;
            wait_ns(&t, (long)(0.5e9 / hz));
            if (pwrite(fd, "pull-down", 9, 0) != 9) return perror("pull"), 1;
            wait_ns(&t, (long)(0.5e9 / hz));
        } else {
            char now = 0;
            if (pread(fd, &now, 1, 0) != 1) return perror("value"), 1;
            changes += before && now != before;
            before = now;
            wait_ns(&t, (long)(1e9 / hz));
        }
    }
    if (!pulse) printf("changes %d\n", changes);
    return 0;
}
