/* displayed: what a display shows of frames that may be late, and how far it is from what it should: for
 * bench/budget. A late frame is not shown: the picture before stays, and is judged in its place, at the late
 * frame's pose. For tests only. */
#ifndef FV_TESTS_DISPLAYED_H
#define FV_TESTS_DISPLAYED_H

#include "rt/measure/picture.h"
#include "tests/support/taped.h"

enum { REFERENCE_SPP = 16, FOVEAL_DEG = 5 };
enum { FOVEAL, WHOLE, AREAS }; /* up to FOVEAL_DEG; all */

struct judged {
    int count[AREAS];
    double square[AREAS]; /* sums of mean squared errors, full scale 1 */
};

struct shower {
    struct runner *runner;
    struct fv_metrics_picture shown; /* the newest that was not late */
    int frames, late, cut;
    double sampled, r0_deg, p_min, level; /* sums */
    struct judged timely, overdue;
};

struct judge {
    struct runner reference; /* the left eye by REFERENCE_SPP samples a pixel */
    struct fv_metrics *metrics;
    uint8_t *zone;
    struct fv_workers *workers;
};

static inline void judge_open(struct judge *j, struct taped *t)
{
    const struct fv_frame *f = &j->reference.own.loop.frame;
    j->workers = &t->setup.workers;
    j->reference.config = t->setup.config;
    j->reference.config.display_eyes = 1;
    j->reference.config.method_spp = REFERENCE_SPP;
    runner_open(&j->reference, t, "full", "off", 100, j->workers);
    j->metrics = fv_metrics_open(f->width, f->height, 10);
    j->zone = fv_arena_take(fv_arena(), "zones", (size_t)f->width * (size_t)f->height, 64);
}

/* The reference at a frame's pose; where in it the gaze is. */
static inline struct fv_metrics_picture judge_reference(struct judge *j, const struct fv_sweep_frame *frame)
{
    struct fv_frame *f = &j->reference.own.loop.frame;
    fv_loop_restart(&j->reference.own.loop);
    runner_render(&j->reference, frame);
    for (int y = 0; y < f->height; y++)
        for (int x = 0; x < f->width; x++) {
            float e = fv_eccentricity_deg(&f->view[0], (float)x + 0.5f, (float)y + 0.5f);
            j->zone[y * f->width + x] = e <= FOVEAL_DEG ? FV_ZONE_FOVEA : FV_ZONE_FAR;
        }
    return fv_picture_present(f, j->workers);
}

static inline void judge_shown(struct judge *j, const struct fv_metrics_picture *reference,
                               const struct shower *s, struct judged *to)
{
    static const enum fv_zone zone[AREAS] = {FV_ZONE_FOVEA, FV_ZONE_ALL};
    struct fv_errors errors;
    fv_metrics_compare(j->metrics, j->workers, reference, &s->shown, j->zone, &errors);
    for (int a = 0; a < AREAS; a++) {
        double rmse = errors.rmse[zone[a]];
        if (isnan(rmse)) continue; /* the gaze is outside of the picture */
        to->square[a] += rmse * rmse;
        to->count[a]++;
    }
}

/* Shows the newest frame unless it is late; returns whether it is. The very first is shown in any case. */
static inline bool shower_show(struct shower *s, double period_ms)
{
    struct fv_loop *loop = &s->runner->own.loop;
    bool late = (double)s->runner->record.frame_ms > period_ms;
    if (!late || !s->shown.pixel) s->shown = fv_picture_present(&loop->frame, loop->workers);
    return late;
}

static inline void shower_count(struct shower *s, bool late)
{
    const struct fv_frame_record *r = &s->runner->record;
    s->frames++;
    s->late += late;
    s->cut += r->cut;
    s->sampled += (double)r->sampled_fraction;
    s->r0_deg += (double)r->r0_deg;
    s->p_min += (double)r->p_min;
    s->level += r->level;
}

/* NaN where nothing was judged. */
static inline double judged_mean(const struct judged *j, int area)
{
    return j->count[area] ? j->square[area] / j->count[area] : NAN;
}

/* Mean squared error of what is displayed: timely and late pictures by their shares of the frames. */
static inline double shower_square(const struct shower *s, int area)
{
    double late = judged_mean(&s->overdue, area), timely = judged_mean(&s->timely, area);
    double share = (double)s->late / s->frames;
    if (isnan(late)) return timely;
    if (isnan(timely)) return late;
    return share * late + (1 - share) * timely;
}

static inline double psnr_of(double square)
{
    return square > 0 ? -10 * log10(square) : square == 0 ? INFINITY : NAN;
}

#endif
