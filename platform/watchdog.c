/* watchdog: see watchdog.h. */
#define _GNU_SOURCE
#include "platform/watchdog.h"

#include "platform/log.h"

#include <signal.h>
#include <stdbool.h>
#include <sys/time.h>

static int64_t fed_ns;
static double fed_seconds; /* 0: it sleeps */

static void on_silence(int number)
{
    (void)number;
    fv_die(FV_WATCHDOG_EXIT, "watchdog: no frame for %g s: the program ends", fed_seconds);
}

void fv_watchdog_open(void)
{
    signal(SIGALRM, on_silence);
}

void fv_watchdog_feed(double seconds, int64_t now_ns)
{
    bool changed = seconds != fed_seconds;
    if (!changed && (seconds == 0 || (double)(now_ns - fed_ns) < 0.25e9 * seconds)) return;
    double most = 1.25 * seconds; /* for it may not be set again for a quarter of them */
    struct itimerval timer = {.it_value = {(time_t)most, (suseconds_t)(1e6 * (most - (double)(time_t)most))}};
    fed_seconds = seconds;
    fed_ns = now_ns;
    setitimer(ITIMER_REAL, &timer, NULL);
}
