/* hog BUSY_MS EVERY_MS SECONDS: takes the processor for so long, so often, before all others. Runs in the virtual machine of
 * tests/vm. */
#define _GNU_SOURCE
#include <sched.h>
#include <stdint.h>
#include <stdlib.h>
#include <time.h>

static int64_t now_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (int64_t)t.tv_sec * 1000000000 + t.tv_nsec;
}

int main(int count, char **text)
{
    if (count < 4) return 2;
    int64_t busy_ns = (int64_t)(1e6 * atof(text[1])), every_ns = (int64_t)(1e6 * atof(text[2])), t_ns = now_ns();
    int64_t until_ns = t_ns + (int64_t)(1e9 * atof(text[3]));
    sched_setscheduler(0, SCHED_FIFO, &(struct sched_param){70});
    for (; t_ns < until_ns; t_ns += every_ns) {
        while (now_ns() < t_ns + busy_ns) {}
        const struct timespec next = {.tv_sec = (t_ns + every_ns) / 1000000000, .tv_nsec = (t_ns + every_ns) % 1000000000};
        clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &next, NULL);
    }
    return 0;
}
