/* flight: see flight.h. */
#include "rt/measure/flight.h"

#include "platform/arena.h"
#include "rt/measure/rank.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

void fv_flight_open(struct fv_flight *f, const struct fv_config *config, const struct fv_tracer *tracer,
                    struct fv_workers *workers, const struct fv_sweep_io *io)
{
    struct fv_arena *arena = fv_arena();
    size_t frames = (size_t)f->frames;
    assert(f->frames >= 1 && f->path_frames >= 1 && f->sides >= 1 && f->sides <= FV_FLIGHT_SIDES);
    f->workers = workers;
    f->io = io;
    f->beside = fv_arena_take(arena, "flight", frames * sizeof *f->beside, 64);
    f->scratch = fv_arena_take(arena, "flight", frames * sizeof *f->scratch, 64);
    for (struct fv_flight_side *s = f->side; s < f->side + f->sides; s++) {
        s->config = *config;
        s->config.fovea_inner_deg = (double)s->foveal.r0_deg;
        s->config.fovea_outer_deg = (double)s->foveal.r1_deg;
        s->config.fovea_p_min = (double)s->foveal.p_min;
        s->record = fv_arena_take(arena, "flight", frames * sizeof *s->record, 64);
        fv_contender_plan(&s->own, fv_method_find(s->method), &s->config, tracer);
        fv_contender_open(&s->own, &s->config, tracer, workers);
    }
}

int fv_flight_at(const struct fv_flight *f, int n)
{
    int pieces = (f->frames + FV_FLIGHT_PIECE - 1) / FV_FLIGHT_PIECE;
    int path = f->path_frames > f->frames ? f->path_frames : f->frames;
    int apart = path / pieces > FV_FLIGHT_PIECE ? path / pieces : FV_FLIGHT_PIECE;
    return n / FV_FLIGHT_PIECE * apart + n % FV_FLIGHT_PIECE;
}

/* Counted frames that full is rendered beside: every so many. */
static bool is_beside(const struct fv_flight *f, int n)
{
    int every = f->frames / (f->full > 0 ? f->full : FV_FLIGHT_FULL);
    return every < 2 || n % every == every / 2;
}

static void latch(const struct fv_flight *f, int at, struct fv_sweep_frame *frame)
{
    static const double ahead[3] = {0, 0, -1};
    double gaze[2][3], uncertainty_deg;
    int64_t t_ns = (int64_t)(at + FV_FLIGHT_WARM) * llround(1e9 / f->side[0].config.budget_hz);
    *frame = (struct fv_sweep_frame){.t_ns = t_ns};
    f->io->latch(f->io->context, t_ns, &frame->head, gaze, &uncertainty_deg);
    for (int e = 0; e < 2; e++) memcpy(frame->gaze[e], ahead, sizeof ahead);
}

static void render(struct fv_flight *f, struct fv_flight_side *s, const struct fv_sweep_frame *frame,
                   struct fv_frame_record *record)
{
    struct fv_loop *loop = &s->own.loop;
    fv_loop_frame(loop, &frame->head, frame->gaze, frame->uncertainty_deg, frame->t_ns, record);
    if (!s->own.plan.present) return;
    int64_t start_ns = fv_clock_now_ns(&fv_clock_monotonic);
    fv_pass_run(&fv_pass_present, &loop->frame, f->workers);
    record->stage_ms[s->own.plan.passes] =
        (float)((double)(fv_clock_now_ns(&fv_clock_monotonic) - start_ns) * 1e-6);
}

static void render_full(struct fv_flight *f, const struct fv_sweep_frame *frame, int n)
{
    f->beside[f->fulls] = n;
    render(f, &f->side[0], frame, &f->side[0].record[f->fulls++]);
    if (f->rendered) f->rendered(f->context, 0, n);
}

/* The sides take turns in being the first after, or before, full. */
static void render_counted(struct fv_flight *f, const struct fv_sweep_frame *frame, int n)
{
    bool full = is_beside(f, n), full_first = f->fulls % 2;
    if (full && full_first) render_full(f, frame, n);
    for (int i = 0; i + 1 < f->sides; i++) {
        int side = 1 + (i + n) % (f->sides - 1);
        render(f, &f->side[side], frame, &f->side[side].record[n]);
        if (f->rendered) f->rendered(f->context, side, n);
    }
    if (full && !full_first) render_full(f, frame, n);
}

/* Up to frame `at` of the way, from where the histories are. */
static void warm_up(struct fv_flight *f, int from, int at)
{
    struct fv_sweep_frame frame;
    struct fv_frame_record record;
    for (int k = from; k < at; k++) {
        latch(f, k, &frame);
        for (int side = 1; side < f->sides; side++) render(f, &f->side[side], &frame, &record);
    }
}

int fv_flight_run(struct fv_flight *f, const char *what)
{
    struct fv_sweep_frame frame;
    int next = INT32_MIN; /* frame of the way that would follow */
    f->fulls = 0;
    for (int n = 0; n < f->frames; n++) {
        int at = fv_flight_at(f, n);
        if (f->io->stopped(f->io->context)) return 1;
        f->io->progress(f->io->context, what, (double)n / f->frames);
        if (at - FV_FLIGHT_WARM > next) {
            for (int side = 1; side < f->sides; side++) fv_loop_restart(&f->side[side].own.loop);
            next = at - FV_FLIGHT_WARM;
        }
        warm_up(f, next, at);
        latch(f, at, &frame);
        render_counted(f, &frame, n);
        next = at + 1;
    }
    return 0;
}

double fv_flight_frame_ms(const struct fv_frame_record *r, int unused)
{
    (void)unused;
    return (double)r->frame_ms;
}

double fv_flight_stage_ms(const struct fv_frame_record *r, int stage)
{
    return (double)r->stage_ms[stage];
}

double fv_flight_rays(const struct fv_frame_record *r, int unused)
{
    double rays = 0;
    (void)unused;
    for (int k = 0; k < FV_RAY_MARCH_STEPS; k++) rays += (double)r->rays[k];
    return rays;
}

double fv_flight_sampled(const struct fv_frame_record *r, int unused)
{
    (void)unused;
    return (double)r->sampled_fraction;
}

static int count_of(const struct fv_flight *f, int side)
{
    return side == 0 ? f->fulls : f->frames;
}

struct fv_measured fv_flight_median(const struct fv_flight *f, int side, fv_flight_of *of, int which)
{
    for (int i = 0; i < count_of(f, side); i++) f->scratch[i] = of(&f->side[side].record[i], which);
    return fv_rank_quartiles(f->scratch, count_of(f, side));
}

double fv_flight_mean(const struct fv_flight *f, int side, fv_flight_of *of, int which)
{
    double sum = 0;
    for (int i = 0; i < count_of(f, side); i++) sum += of(&f->side[side].record[i], which);
    return sum / count_of(f, side);
}

struct fv_measured fv_flight_speedup(const struct fv_flight *f, int side)
{
    for (int i = 0; i < f->fulls; i++) {
        const struct fv_frame_record *own = &f->side[side].record[side == 0 ? i : f->beside[i]];
        f->scratch[i] = (double)f->side[0].record[i].frame_ms / (double)own->frame_ms;
    }
    return fv_rank_quartiles(f->scratch, f->fulls);
}
