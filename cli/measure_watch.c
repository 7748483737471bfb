/* measure_watch: see measure_watch.h. */
#include "cli/measure_watch.h"

#include "platform/log.h"

#include <signal.h>
#include <stdio.h>
#include <string.h>

static volatile int stop_signal;

static void on_signal(int number)
{
    stop_signal = number;
}

const volatile int *fv_measure_heed_signals(void)
{
    struct sigaction action = {.sa_handler = on_signal};
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
    return &stop_signal;
}

static bool stopped(void *context)
{
    (void)context;
    return stop_signal != 0;
}

static void latch(void *context, int64_t t_ns, struct fv_pose *head, double gaze[2][3],
                  double *uncertainty_deg)
{
    struct fv_measure_watch *w = context;
    struct fv_pose relative;
    struct fv_gaze g;
    fv_setup_latch(w->setup, t_ns, t_ns, &relative, &g, head);
    memcpy(gaze, g.direction, sizeof g.direction);
    *uncertainty_deg = g.uncertainty_deg;
}

/* A bar, and the time left once there is something to tell it from. */
static void progress(void *context, const char *what, double done)
{
    enum { WIDTH = 24 };
    struct fv_measure_watch *w = context;
    char bar[WIDTH + 1], left[32] = "";
    int64_t now_ns = fv_clock_now_ns(&fv_clock_monotonic);
    if (done == 0 || w->stage_ns == 0) {
        w->stage_ns = now_ns;
        w->stage_from = done;
    }
    double seconds = (double)(now_ns - w->stage_ns) * 1e-9, part = done - w->stage_from;
    if (part > 0.01) {
        int more = (int)(seconds / part * (1 - done) + 0.5);
        snprintf(left, sizeof left, more >= 120 ? "%d min left" : "%d s left",
                 more >= 120 ? more / 60 : more);
    }
    for (int i = 0; i < WIDTH; i++) bar[i] = i < done * WIDTH ? '#' : '.';
    bar[WIDTH] = 0;
    fv_log_progress("[%s] %3.0f %% %s: %s", bar, 100 * done, left, what);
}

struct fv_sweep_io fv_measure_io(struct fv_measure_watch *watch)
{
    return (struct fv_sweep_io){watch, latch, stopped, progress};
}
