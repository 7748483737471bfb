/* taped: Sponza in rift-dk2, both eyes, two workers, head and gaze from a Varjo log: frames for bench/budget.
 * The data is looked for in ../shared/data. For tests only. */
#ifndef FV_TESTS_TAPED_H
#define FV_TESTS_TAPED_H

#include "cli/cli.h"
#include "platform/arena.h"
#include "platform/log.h"
#include "rt/measure/contest.h"
#include "rt/measure/rank.h"
#include "tests/support/program.h"

#include <math.h>

/* A method with its loop, at settings of its own. */
struct runner {
    struct fv_config config;
    struct fv_contender own;
    struct fv_frame_record record; /* of the newest frame */
};

struct taped {
    int frames;
    const char *headset; /* NULL: rift-dk2 */
    struct fv_setup setup;
    bool open;
    struct fv_sweep_frame *frame; /* `frames` of them, latched a period apart */
    struct runner plain;          /* without adaptation */
};

/* With the settings as they are in r->config; adapt: on, off. */
static inline void runner_open(struct runner *r, struct taped *t, const char *method, const char *adapt,
                               double period_ms, struct fv_workers *workers)
{
    r->config.budget_hz = 1e3 / period_ms;
    snprintf(r->config.budget_adapt, sizeof r->config.budget_adapt, "%s", adapt);
    fv_contender_plan(&r->own, fv_method_find(method), &r->config, &t->setup.tracer);
    fv_contender_open(&r->own, &r->config, &t->setup.tracer, workers);
}

static inline void runner_render(struct runner *r, const struct fv_sweep_frame *f)
{
    fv_loop_frame(&r->own.loop, &f->head, f->gaze, f->uncertainty_deg, f->t_ns, &r->record);
}

/* Both, at the same pose and gaze; which is first alternates with n. */
static inline void runner_render_both(struct runner *a, struct runner *b, const struct fv_sweep_frame *f,
                                      int n)
{
    runner_render(n % 2 ? b : a, f);
    runner_render(n % 2 ? a : b, f);
}

/* On a terminal a line that is rewritten, elsewhere one every ten seconds. */
static inline void taped_progress(const char *what, int n, int of)
{
    static int64_t said_ns;
    int64_t now_ns = fv_clock_now_ns(&fv_clock_monotonic);
    fv_log_progress("%s: frame %d of %d", what, n + 1, of);
    if (fv_log_is_terminal() || now_ns - said_ns < INT64_C(10000000000)) return;
    said_ns = now_ns;
    fv_log("%s: frame %d of %d", what, n + 1, of);
}

/* All that does not depend on a period, taken once; `plain` at its usual settings. Skips the test where the
 * data is not there. The sink gives frames a buffer for their picture; none is opened. */
static inline void taped_open(struct taped *t)
{
    static const char library[] = FV_SOURCE_DIR "/../shared/data/scenes",
                      tape[] = FV_SOURCE_DIR "/../shared/data/gaze/varjo/p1_r1.csv";
    static char set[4][700];
    struct fv_error error;
    if (!fv_file_exists(library) || !fv_file_exists(tape)) {
        print_message("Sponza or the Varjo log is not in %s/../shared/data: skipped\n", FV_SOURCE_DIR);
        skip();
    }
    snprintf(set[0], sizeof set[0], "scene.library=%s", library);
    snprintf(set[1], sizeof set[1], "eye.tape=%s", tape);
    snprintf(set[2], sizeof set[2], "imu.tape=%s", tape);
    snprintf(set[3], sizeof set[3], "display.headset=%s", t->headset ? t->headset : "rift-dk2");
    struct fv_config_request request = {.sets = 9,
                                        .set = {"scene.name=sponza", set[0], set[3],
                                                "display.sink=png", "threads.workers=2", "eye.source=tape",
                                                set[1], "imu.source=tape", set[2]}};
    if (!t->open) {
        if (fv_setup_open(&t->setup, &request, &error) || fv_setup_start(&t->setup, true, &error))
            fail_msg("%s", error.text);
        t->frame = fv_arena_take(fv_arena(), "latches", (size_t)t->frames * sizeof *t->frame, 64);
        t->plain.config = t->setup.config;
        runner_open(&t->plain, t, "reproject", "off", 100, &t->setup.workers);
        t->open = true;
    }
    t->plain.config = t->setup.config; /* whatever a test made of them */
}

/* The session from its beginning, a frame a period. The sources are opened anew, so that nothing of an
 * earlier one is held. */
static inline void taped_latch(struct taped *t, double period_ms)
{
    struct fv_error error;
    if (fv_sensors_open(&t->setup.sensors, &t->setup.config, &error)) fail_msg("%s", error.text);
    for (int n = 0; n < t->frames; n++) {
        struct fv_sweep_frame *f = &t->frame[n];
        struct fv_pose relative;
        struct fv_gaze gaze;
        f->t_ns = llround(n * period_ms * 1e6);
        fv_setup_latch(&t->setup, f->t_ns, f->t_ns, &relative, &gaze, &f->head);
        memcpy(f->gaze, gaze.direction, sizeof f->gaze);
        f->uncertainty_deg = gaze.uncertainty_deg;
    }
}

/* The period at which the median frame of `plain`, as its settings are, takes `share` of it; the session is
 * latched at that period. By blocks of frames spread over the first `frames` >= TAPED_BLOCK, the first ones
 * of each not counted. In rounds, since how far the head turns between frames follows from the period. */
enum { TAPED_BLOCKS = 10, TAPED_BLOCK = 12, TAPED_WARM = 4 };
static inline double taped_settle(struct taped *t, int frames, int rounds, double share)
{
    double ms[TAPED_BLOCKS * TAPED_BLOCK], period_ms = 80;
    for (int round = 0; round < rounds; round++) {
        int timed = 0;
        taped_latch(t, period_ms);
        for (int i = 0; i < TAPED_BLOCKS * TAPED_BLOCK; i++) {
            int block = i / TAPED_BLOCK, k = i % TAPED_BLOCK;
            taped_progress("warm-up", i, TAPED_BLOCKS * TAPED_BLOCK);
            runner_render(&t->plain, &t->frame[(frames - TAPED_BLOCK) * block / (TAPED_BLOCKS - 1) + k]);
            if (k >= TAPED_WARM) ms[timed++] = (double)t->plain.record.frame_ms;
        }
        fv_rank_sort(ms, timed);
        period_ms = fv_rank_percentile(ms, timed, 50) / share;
    }
    taped_latch(t, period_ms);
    return period_ms;
}

#endif
