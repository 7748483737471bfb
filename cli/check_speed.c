/* check_speed: what the cores hold: bytes copied, rays traced, and frames of the scene, by the method and the controller
 * of the loop itself. See check.h. */
#include "cli/check.h"

#include "cli/columns.h"
#include "platform/arena.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { COPY_BYTES = 32 << 20, COPY_LEAST = 1 << 20 };
static const int64_t copy_ns = 200000000;

/* More misses than this and the budget does not hold; a part of all frames. */
static const double missed_most = 0.05, missed_noted = 0.01;

struct copying {
    char *from, *to;
    size_t bytes; /* of each worker's part */
};

static void copy_part(void *context, int worker)
{
    const struct copying *k = context;
    memcpy(k->to + (size_t)worker * k->bytes, k->from + (size_t)worker * k->bytes, k->bytes);
}

/* Every byte is read once and written once: what is counted is both. */
static void check_copy(struct fv_check *c, struct fv_workers *workers)
{
    size_t bytes = COPY_BYTES;
    char *block = NULL;
    while (bytes >= COPY_LEAST && !(block = fv_arena_try(fv_arena(), "check", 2 * bytes, 4096))) bytes /= 2;
    if (!block) {
        fv_check_add(c, "speed", "copy", FV_CHECK_NOTE, "", "not measured: the arena has no room for it");
        return;
    }
    struct copying k = {block, block + bytes, bytes / (size_t)workers->count & ~(size_t)63};
    int64_t rounds = 0, from_ns, now_ns;
    memset(block, 1, 2 * bytes);
    fv_workers_each(workers, copy_part, &k);
    from_ns = now_ns = fv_clock_now_ns(&fv_clock_monotonic);
    for (; now_ns - from_ns < copy_ns; rounds++) {
        fv_workers_each(workers, copy_part, &k);
        now_ns = fv_clock_now_ns(&fv_clock_monotonic);
    }
    c->copy_bytes_per_s = 2e9 * (double)rounds * (double)k.bytes * workers->count / (double)(now_ns - from_ns);
    fv_check_add(c, "speed", "copy", FV_CHECK_OK, "", "%.1f GB/s read and written, %d workers, pieces of %zu MB",
                 1e-9 * c->copy_bytes_per_s, workers->count, bytes >> 20);
}

static void trace_tile(void *context, int index, int worker)
{
    struct fv_frame *f = context;
    struct fv_tile tile = fv_tile_at(f, index, worker);
    struct fv_samples *s = &f->scratch[worker].samples;
    tile.density = FV_FINE;
    s->started = s->known = s->identified = s->numbered = s->mapped = false;
    fv_tile_place(f, &tile, fv_tile_inside(f, &tile));
    if (s->count > 0) fv_samples_trace(f, &tile, 1);
}

/* Every pixel of the newest frame's views, again and again, into nothing. */
static void check_rays(struct fv_check *c, struct fv_setup *s, double seconds)
{
    struct fv_frame *f = &s->loop.frame;
    double rays[2] = {0, 0};
    for (int w = 0; w < s->workers.count; w++) memset(f->scratch[w].rays, 0, sizeof f->scratch[w].rays);
    int64_t from_ns = fv_clock_now_ns(&fv_clock_monotonic), now_ns = from_ns;
    while ((double)(now_ns - from_ns) < 1e9 * seconds) {
        fv_workers_run(&s->workers, f->tiles, trace_tile, f);
        now_ns = fv_clock_now_ns(&fv_clock_monotonic);
    }
    for (int w = 0; w < s->workers.count; w++) {
        rays[0] += (double)f->scratch[w].rays[FV_RAY_PRIMARY];
        for (int kind = FV_RAY_PRIMARY; kind <= FV_RAY_SECONDARY; kind++) rays[1] += (double)f->scratch[w].rays[kind];
    }
    c->primary_per_s = 1e9 * rays[0] / (double)(now_ns - from_ns);
    c->rays_per_s = 1e9 * rays[1] / (double)(now_ns - from_ns);
    fv_check_add(c, "speed", "rays", FV_CHECK_OK, "",
                 "%.2f million primary rays/s, %.2f million with shadows and reflections; %s, %d workers, %s", 1e-6 * c->primary_per_s, 1e-6 * c->rays_per_s, s->scene.name, s->workers.count,
                 fv_cpu_isa_name(s->tracer.isa));
}

struct running {
    struct fv_setup *setup;
    int64_t until_ns;
};

static void latch(void *context, int64_t now_ns, int64_t show_ns, struct fv_pose *head, double gaze[2][3],
                  double *uncertainty_deg)
{
    struct running *r = context;
    struct fv_pose relative;
    struct fv_gaze g;
    fv_setup_latch(r->setup, now_ns, show_ns, &relative, &g, head);
    memcpy(gaze, g.direction, sizeof g.direction);
    *uncertainty_deg = g.uncertainty_deg;
}

static bool wants(void *context, int64_t frame, bool last)
{
    const struct running *r = context;
    (void)frame, (void)last;
    return r->setup->plan.present;
}

static void present(void *context, const struct fv_frame *frame)
{
    (void)context, (void)frame;
}

static bool after(void *context, const struct fv_session *session, const struct fv_frame_record *record)
{
    const struct running *r = context;
    (void)record;
    return fv_clock_now_ns(&fv_clock_monotonic) < r->until_ns && session->frames < session->capacity;
}

/* What the later half of a run's frames were like: the first teach the controller its prices. */
struct settled {
    int64_t frames;
    double ms_p50, ms_p99, level, periods, missed, cut;
};

static struct settled run(struct fv_setup *s, double seconds)
{
    struct running running = {s, fv_clock_now_ns(&fv_clock_monotonic) + (int64_t)(1e9 * seconds)};
    struct fv_loop_io io = {&running, latch, wants, present, NULL, after, NULL, NULL};
    struct fv_session *session = &s->session;
    struct settled of = {0};
    session->frames = 0;
    fv_loop_restart(&s->loop);
    fv_loop_run(&s->loop, &io, -1);
    int64_t first = session->frames / 2, count = session->frames - first;
    for (int64_t i = first; i < session->frames; i++) {
        of.missed += session->record[i].missed;
        of.cut += session->record[i].cut;
    }
    of.frames = count;
    of.missed /= (double)count;
    of.cut /= (double)count;
    of.ms_p50 = fv_column_percentile(session, &fv_columns[FV_COLUMN_FRAME_MS], first, count, 50);
    of.ms_p99 = fv_column_percentile(session, &fv_columns[FV_COLUMN_FRAME_MS], first, count, 99);
    of.level = fv_column_percentile(session, &fv_columns[FV_COLUMN_LEVEL], first, count, 50);
    of.periods = fv_column_percentile(session, &fv_columns[FV_COLUMN_PERIODS], first, count, 50);
    return of;
}

static enum fv_check_state state_of(const struct settled *s)
{
    return s->missed > missed_most || s->periods > 1 ? FV_CHECK_FAULT : s->missed > missed_noted ? FV_CHECK_NOTE : FV_CHECK_OK;
}

/* What would let such frames fit: the rate that 95 of 100 hold, or as many pixels less. */
static void advise(const struct fv_setup *s, const struct settled *of, char *out, size_t size)
{
    double period_ms = 1e3 / s->config.budget_hz, times = fmax(of->ms_p99 / period_ms, 1.01);
    int cores = fv_threads_cores();
    int used = snprintf(out, size, "budget.hz=%.0f, or display.width and display.height by %.2f, or a smaller scene",
                        floor(fmax(s->config.budget_hz / times, 1)), 1 / sqrt(times));
    if (s->workers.count < cores && used > 0 && (size_t)used < size)
        snprintf(out + used, size - (size_t)used, ", or threads.workers=%d", cores);
}

/* As the settings have it: no level is chosen, nothing cut. */
static void check_plain(struct fv_check *c, struct fv_setup *s, const struct settled *adapted, double seconds)
{
    char change[FV_TEXT_MAX] = "", less[FV_TEXT_MAX] = "";
    bool adapt = s->loop.budget.adapt;
    s->loop.budget.adapt = false;
    struct settled of = run(s, seconds);
    s->loop.budget.adapt = adapt;
    enum fv_check_state state = state_of(&of);
    if (state != FV_CHECK_OK) advise(s, &of, less, sizeof less);
    if (state != FV_CHECK_OK && adapted && state_of(adapted) != FV_CHECK_FAULT)
        snprintf(change, sizeof change, "budget.adapt=on: level %.0f holds", adapted->level);
    else if (state != FV_CHECK_OK)
        snprintf(change, sizeof change, "%.300s%s", less, adapted ? "" : "; or method.name=reproject with budget.adapt=on");
    fv_check_add(c, "budget", "as set", state, change, "%.2f ms (p50), %.2f ms (p99) of %.2f; %.1f %% of %lld frames missed",
                 of.ms_p50, of.ms_p99, 1e3 / s->config.budget_hz, 100 * of.missed, (long long)of.frames);
    if (adapted) return;
    c->frame_ms_p50 = of.ms_p50;
    c->frame_ms_p99 = of.ms_p99;
    c->periods = 1;
    c->missed = of.missed;
}

static void check_adapted(struct fv_check *c, struct fv_setup *s, bool asked, double seconds, struct settled *of)
{
    char change[FV_TEXT_MAX] = "";
    int last = s->plan.method->levels - 1;
    *of = run(s, seconds);
    enum fv_check_state state = state_of(of);
    if (state != FV_CHECK_OK) advise(s, of, change, sizeof change);
    if (state == FV_CHECK_FAULT && !asked) state = FV_CHECK_NOTE; /* what counts is as it is set */
    fv_check_add(c, "budget", "adapting", state, change,
                 "level %.0f of 1 (best) to %d: %.2f ms (p50), %.2f ms (p99) of %.2f; %.1f %% missed, %.1f %% cut, %.0f period%s",
                 of->level, last, of->ms_p50, of->ms_p99, 1e3 / s->config.budget_hz, 100 * of->missed, 100 * of->cut,
                 of->periods, of->periods > 1 ? "s" : "");
    c->frame_ms_p50 = of->ms_p50;
    c->frame_ms_p99 = of->ms_p99;
    c->level = of->level;
    c->periods = of->periods;
    c->missed = of->missed;
}

void fv_check_speed(struct fv_check *c, struct fv_setup *s, const struct fv_config *config, double seconds)
{
    bool can = s->plan.method->levels > 1, asked = can && strcmp(config->budget_adapt, "on") == 0;
    struct settled adapted;
    check_copy(c, &s->workers);
    run(s, 0); /* one frame: views, and pages that are touched first */
    check_rays(c, s, fmin(0.25 * seconds, 1));
    if (can) check_adapted(c, s, asked, asked ? seconds : 0.6 * seconds, &adapted);
    if (!asked) check_plain(c, s, can ? &adapted : NULL, can ? 0.4 * seconds : seconds);
}
