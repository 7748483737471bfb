/* contest: see contest.h. */
#include "rt/measure/contest.h"

#include "platform/arena.h"
#include "rt/measure/flicker.h"
#include "rt/measure/picture.h"
#include "rt/measure/rank.h"

#include <math.h>
#include <stdio.h>

enum { TIMES_MAX = FV_SWEEP_SEGMENTS * FV_SWEEP_TIMED * FV_SWEEP_REPEATS_MAX };

/* What is gathered of a row. */
struct tally {
    int times, full_times, pictures;
    double ms[TIMES_MAX], full_ms[TIMES_MAX], ratio[TIMES_MAX];
    double rays, sampled;
    struct fv_errors errors[FV_SWEEP_SEGMENTS];
    double flicker[FV_SWEEP_SEGMENTS];
};

void fv_contender_plan(struct fv_contender *c, const struct fv_method *method, const struct fv_config *config,
                       const struct fv_tracer *tracer)
{
    static struct fv_config adapted; /* any level may be asked for: what one of them needs is taken */
    adapted = *config;
    snprintf(adapted.budget_adapt, sizeof adapted.budget_adapt, "on");
    fv_frame_size(&c->loop.frame, config);
    fv_plan_make(&c->plan, method, tracer->data, &adapted, &c->loop.frame);
}

void fv_contender_open(struct fv_contender *c, const struct fv_config *config, const struct fv_tracer *tracer,
                       struct fv_workers *workers)
{
    if (!c->loop.workers) fv_loop_open(&c->loop, config, &c->plan, tracer, workers, &c->session, 1);
}

void fv_contest_open(struct fv_contest *c, struct fv_reference *reference, const struct fv_config *config,
                     const struct fv_tracer *tracer, struct fv_workers *workers, const struct fv_sweep_io *io)
{
    const struct fv_frame *f = &reference->loop.frame;
    const struct fv_pose origin = {{0, 0, 0}, {1, 0, 0, 0}};
    const double ahead[3] = {0, 0, -1};
    struct fv_view view;
    fv_loop_view(&reference->loop, 0, &origin, ahead, &view);
    c->reference = reference;
    c->workers = workers;
    c->io = io;
    c->plain = *config;
    c->plain.method_spp = 1;
    snprintf(c->plain.display_sink, sizeof c->plain.display_sink, "none");
    c->ppd = M_PI / 180 / (double)view.pixel_size;
    c->metrics = fv_metrics_open(f->width, f->height, c->ppd);
    c->before = fv_arena_take(fv_arena(), "judged picture", (size_t)f->width * (size_t)f->height * 3, 64);
    fv_contender_plan(&c->full, fv_method_find("full"), &c->plain, tracer);
    fv_contender_open(&c->full, &c->plain, tracer, workers);
}

static void render(struct fv_contender *c, const struct fv_sweep_frame *f, struct fv_frame_record *record)
{
    fv_loop_frame(&c->loop, &f->head, f->gaze, f->uncertainty_deg, f->t_ns, record);
}

void fv_contest_calibrate(struct fv_contest *c, double *full, double *judging)
{
    static struct fv_errors errors;
    const struct fv_reference_segment *s = &c->reference->segment[1];
    struct fv_frame_record record;
    double ms[5];
    for (int i = 0; i < 5; i++) {
        render(&c->full, &c->frame[i % FV_SWEEP_SEGMENTS][0], &record);
        ms[i] = (double)record.frame_ms;
    }
    *full = fv_rank_quartiles(ms, 5).value * 1e-3;
    int64_t start_ns = fv_clock_now_ns(&fv_clock_monotonic);
    fv_metrics_compare(c->metrics, c->workers, &s->picture[1], &s->picture[0], s->zone, &errors);
    fv_flicker(&s->picture[1], &s->picture[0], &s->map, s->inverse_depth[1], s->inverse_depth[0],
               c->reference->loop.frame.stride);
    *judging = 1.1 * FV_SWEEP_SEGMENTS * (double)(fv_clock_now_ns(&fv_clock_monotonic) - start_ns) * 1e-9;
}

double fv_contest_guess(struct fv_contest *c, struct fv_contender *contender, int level, double full)
{
    struct fv_parameters parameters;
    struct fv_frame_record record;
    double ms[3];
    contender->plan.method->parameters(contender->loop.config, level, &parameters);
    if (!fv_plan_remembers(&contender->plan)) return full * parameters.spp;
    contender->loop.level = level;
    fv_loop_restart(&contender->loop);
    for (int i = -2; i < 3; i++) {
        render(contender, &c->frame[0][2 + i], &record);
        if (i >= 0) ms[i] = (double)record.frame_ms;
    }
    return fv_rank_quartiles(ms, 3).value * 1e-3;
}

/* One frame of the method and, where `with_full`, one of the full renderer at the same pose; which is first
 * alternates. */
static void time_frame(struct fv_contest *c, struct fv_contender *contender,
                       const struct fv_sweep_frame *frame, bool with_full, struct tally *t)
{
    struct fv_frame_record own, full;
    bool full_first = t->times % 2;
    if (with_full && full_first) render(&c->full, frame, &full);
    render(contender, frame, &own);
    if (with_full && !full_first) render(&c->full, frame, &full);
    if (with_full) t->full_ms[t->full_times++] = (double)full.frame_ms;
    t->ms[t->times] = (double)own.frame_ms;
    t->ratio[t->times] = t->full_ms[t->full_times - 1] / (double)own.frame_ms;
    for (int k = 0; k < FV_RAY_MARCH_STEPS; k++) t->rays += (double)own.rays[k];
    t->sampled += (double)own.sampled_fraction;
    t->times++;
}

static int judge(struct fv_contest *c, struct fv_contender *contender, int segment, struct tally *t,
                 const char *picture, const char *difference, struct fv_error *error)
{
    const struct fv_reference_segment *s = &c->reference->segment[segment];
    struct fv_metrics_picture now = fv_picture_present(&contender->loop.frame, c->workers);
    struct fv_metrics_picture before = {now.width, now.height, 3, 3 * (int64_t)now.width, c->before};
    fv_metrics_compare(c->metrics, c->workers, &s->picture[FV_REFERENCE_LAST], &now, s->zone,
                       &t->errors[segment]);
    t->flicker[segment] =
        !fv_reference_flickers(segment)
            ? (double)NAN
            : fv_flicker(&now, &before, &s->map, s->inverse_depth[FV_REFERENCE_LAST],
                         s->inverse_depth[FV_REFERENCE_BEFORE], c->reference->loop.frame.stride) -
                  s->flicker;
    t->pictures++;
    if (segment != FV_CONTEST_SHOWN) return 0;
    if (fv_picture_jpeg(&now, picture, error)) return -1;
    return fv_picture_map_jpeg(fv_metrics_flip_map(c->metrics), now.width, now.height, fv_difference_white,
                               difference, error);
}

/* Mean, smallest and largest of those that are numbers; NaN where none is. */
static struct fv_measured spread(const double *value, int n)
{
    struct fv_measured m = {0, INFINITY, -INFINITY};
    int counted = 0;
    for (int i = 0; i < n; i++) {
        if (isnan(value[i])) continue;
        m.value += value[i];
        m.low = fmin(m.low, value[i]);
        m.high = fmax(m.high, value[i]);
        counted++;
    }
    if (counted == 0) return (struct fv_measured){NAN, NAN, NAN};
    m.value /= counted;
    return m;
}

static double decibel(double mean_square)
{
    return mean_square > 0 ? -10 * log10(mean_square) : mean_square == 0 ? INFINITY : NAN;
}

static void fill_errors(struct fv_measure_row *row, const struct tally *t)
{
    double square[FV_SWEEP_SEGMENTS], ssim[FV_SWEEP_SEGMENTS], flip[FV_SWEEP_SEGMENTS];
    for (int z = 0; z < FV_ZONES; z++) {
        for (int i = 0; i < t->pictures; i++) {
            square[i] = t->errors[i].rmse[z] * t->errors[i].rmse[z];
            ssim[i] = t->errors[i].ssim[z];
            flip[i] = t->errors[i].flip[z];
        }
        struct fv_measured m = spread(square, t->pictures);
        row->rmse[z] = (struct fv_measured){sqrt(m.value), sqrt(m.low), sqrt(m.high)};
        row->psnr[z] = (struct fv_measured){decibel(m.value), decibel(m.high), decibel(m.low)};
        row->ssim[z] = spread(ssim, t->pictures);
        row->flip[z] = spread(flip, t->pictures);
    }
    row->flicker = spread(t->flicker, t->pictures);
    row->pictures = t->pictures;
}

static void fill_times(struct fv_measure_row *row, struct tally *t)
{
    row->frames = t->times;
    row->frame_ms = fv_rank_quartiles(t->ms, t->times);
    row->frame_ms_p99 = fv_rank_percentile(t->ms, t->times, 99);
    row->full_frame_ms = fv_rank_quartiles(t->full_ms, t->full_times);
    row->speedup = fv_rank_quartiles(t->ratio, t->times);
    row->rays = t->rays / t->times;
    row->sampled_fraction = t->sampled / t->times;
}

/* The settings that the level stands for, as one CSV cell. */
static void describe(struct fv_measure_row *row, const struct fv_contender *contender)
{
    struct fv_parameters p;
    contender->plan.method->parameters(contender->loop.config, row->level, &p);
    if (p.foveal.r0_deg >= 180) snprintf(row->parameters, sizeof row->parameters, "spp=%d", p.spp);
    else if (p.refresh > 0)
        snprintf(row->parameters, sizeof row->parameters, "r0=%.4g p_scale=%.4g refresh=%d ssaa=%d", (double)p.foveal.r0_deg,
                 (double)p.p_scale, p.refresh, p.spp);
    else
        snprintf(row->parameters, sizeof row->parameters, "r0=%.4g r1=%.4g p_min=%.4g",
                 (double)p.foveal.r0_deg, (double)p.foveal.r1_deg, (double)p.foveal.p_min);
}

int fv_contest_run(struct fv_contest *c, struct fv_contender *contender,
                   const struct fv_contest_effort *effort, struct fv_measure_row *row, const char *picture,
                   const char *difference, struct fv_error *error)
{
    static struct tally t;
    struct fv_frame_record record;
    int timed = effort->timed, segments = effort->repeats * FV_SWEEP_SEGMENTS;
    int first = fv_plan_remembers(&contender->plan) ? 0 : FV_SWEEP_FRAMES - timed;
    t.times = t.full_times = t.pictures = 0;
    t.rays = t.sampled = 0;
    contender->loop.level = row->level;
    for (int n = 0; n < segments; n++) {
        int segment = n % FV_SWEEP_SEGMENTS;
        double done = (double)n / segments;
        c->io->progress(c->io->context, c->what, c->done_from + (c->done_to - c->done_from) * done);
        fv_loop_restart(&contender->loop);
        contender->loop.frame.number = first; /* however many are timed, the last ones are the same */
        for (int k = first; k < FV_SWEEP_FRAMES; k++) {
            if (c->io->stopped(c->io->context)) return 1;
            const struct fv_sweep_frame *frame = &c->frame[segment][k];
            int i = k - (FV_SWEEP_FRAMES - timed); /* of the timed ones */
            bool with_full = i * effort->full / timed != (i - 1) * effort->full / timed || i == 0;
            if (i < 0) render(contender, frame, &record);
            else time_frame(c, contender, frame, with_full, &t);
            if (n >= FV_SWEEP_SEGMENTS || k != FV_SWEEP_FRAMES - 2 || !fv_reference_flickers(segment))
                continue;
            struct fv_metrics_picture before = fv_picture_present(&contender->loop.frame, c->workers);
            fv_picture_pack(&before, c->before);
        }
        if (n < FV_SWEEP_SEGMENTS && judge(c, contender, segment, &t, picture, difference, error)) return -1;
    }
    describe(row, contender);
    fill_times(row, &t);
    fill_errors(row, &t);
    return 0;
}
