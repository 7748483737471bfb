/* budget: see budget.h. */
#include "rt/frame/budget.h"

#include <math.h>
#include <string.h>

void fv_budget_open(struct fv_budget *b, const struct fv_config *config, const struct fv_plan *plan,
                    struct fv_frame *frame, struct fv_workers *workers, const struct fv_clock *clock,
                    struct fv_trace *trace)
{
    int levels = plan->method->levels;
    *b = (struct fv_budget){.config = config,
                            .plan = plan,
                            .periods_max = (int)config->budget_periods,
                            .period_ns = 1e9 / config->budget_hz,
                            .adapt = strcmp(config->budget_adapt, "on") == 0 && levels > 1,
                            .lead = 1};
    fv_schedule_take(&b->schedule, frame, workers, clock, trace);
    fv_control_open(&b->control, levels > 1 ? 1 : 0, levels - 1, workers->count, config->budget_headroom);
}

/* r0 wide enough for where the gaze may be, at levels that adapt for all the fovea; r1 keeps its distance. */
static void widen(struct fv_foveal *f, int level, double uncertainty_deg, double usual_deg)
{
    float r0_deg = f->r0_deg + (float)fmax(0, uncertainty_deg - usual_deg);
    if (f->r0_deg >= 180) return;
    if (level > 0) r0_deg = fmaxf(r0_deg, fminf(FV_FOVEA_DEG, f->r0_deg) + (float)fmax(0, uncertainty_deg));
    f->r1_deg += r0_deg - f->r0_deg;
    f->r0_deg = r0_deg;
}

static void parameters_of(const struct fv_budget *b, int level, double uncertainty_deg,
                          struct fv_parameters *out)
{
    b->plan->method->parameters(b->config, level, out);
    widen(&out->foveal, level, uncertainty_deg, b->config->eye_noise_deg);
}

static void expect(struct fv_budget *b, struct fv_frame *f, double uncertainty_deg)
{
    const struct fv_plan *p = b->plan;
    for (int level = b->control.first; level <= b->control.last; level++) {
        struct fv_parameters parameters;
        parameters_of(b, level, uncertainty_deg, &parameters);
        b->expected[level] = (struct fv_work){0};
        for (int i = 0; i < p->passes; i++)
            p->pass[i]->expect(f, &parameters, &b->schedule.rings, b->expected[level].units + 2 * i);
    }
    b->least = (struct fv_work){0};
    for (int i = 0; i < p->passes; i++)
        fv_schedule_least(&b->schedule, p->pass[i], b->expected[b->control.last].units + 2 * i,
                          b->least.units + 2 * i);
}

double fv_budget_foresee(struct fv_budget *b)
{
    struct fv_control *c = &b->control;
    if (!b->adapt) return 0;
    fv_control_choose(c, b->expected, &b->least, b->period_ns, b->present_ns.held, b->periods_max);
    double needs_ns = fv_control_need_ns(c, c->level, &b->expected[c->level]);
    if (!(needs_ns > 0)) return 0;
    return b->lead * needs_ns + b->present_ns.held + b->straggle_ns + c->headroom * b->period_ns;
}

/* Wall time of one stage of some work. */
static double stage_ns(const struct fv_budget *b, int level, const struct fv_work *work, int i)
{
    struct fv_work of = {0};
    of.units[2 * i] = work->units[2 * i];
    of.units[2 * i + 1] = work->units[2 * i + 1];
    return fv_control_predict_ns(&b->control, level, &of);
}

int fv_budget_begin(struct fv_budget *b, struct fv_frame *f, int level, const struct fv_decision *decided,
                    double uncertainty_deg, int64_t begun_ns, int64_t deadline_ns)
{
    struct fv_control *c = &b->control;
    bool adapt = b->adapt && !decided;
    fv_schedule_look(&b->schedule, f);
    b->deadline_ns = 0;
    b->expected_ns = b->expected_cpu_ns = 0;
    b->cut = false;
    if (decided) level = decided->level;
    if (adapt) {
        expect(b, f, uncertainty_deg);
        if (deadline_ns) {
            level = fv_control_fit(c, b->expected, (double)(deadline_ns - begun_ns) - b->present_ns.held);
        } else {
            fv_control_choose(c, b->expected, &b->least, b->period_ns, b->present_ns.held, b->periods_max);
            deadline_ns = begun_ns + llround(c->periods * b->period_ns);
            level = c->level;
        }
        b->deadline_ns = deadline_ns;
        b->sample = (struct fv_cost_sample){.level = level, .expected = b->expected[level]};
        b->sample.hurried = (double)(deadline_ns - begun_ns) < 0.95 * c->periods * b->period_ns;
    }
    parameters_of(b, level, uncertainty_deg, &f->parameters);
    f->spacing = f->parameters.spacing;
    return level;
}

/* CPU time of all workers in a wall time of theirs. */
static double cpu_of(const struct fv_control *c, double wall_ns)
{
    return wall_ns * c->workers / fv_control_stretch(c);
}

/* What stage i may take; *expected_ns: what it is expected to. */
static struct fv_stage_limit limit_of(const struct fv_budget *b, int i, bool whole, double *expected_ns)
{
    const struct fv_control *c = &b->control;
    struct fv_stage_limit limit = {.done = -1, .stand_in_ns = b->stand_in_ns[i][whole].held};
    *expected_ns = stage_ns(b, b->sample.level, &b->sample.expected, i);
    limit.deadline_ns = b->deadline_ns - llround(b->straggle_ns + b->present_ns.held);
    /* As if a tenth of the period had gone as expected: a frame that has hardly begun tells little. */
    double usual_ns = 0.1 * b->period_ns * c->workers;
    if (b->expected_cpu_ns > 0)
        limit.dearer = (b->sample.total_cpu_ns + usual_ns) / (b->expected_cpu_ns + usual_ns);
    if (b->plan->pass[i]->order == FV_ORDER_GAZE)
        limit.tile_cpu_ns = cpu_of(c, *expected_ns) / b->schedule.tiles;
    for (int k = 2 * (i + 1); k < 2 * b->plan->passes; k++)
        limit.follow_ns += b->least.units[k] * fv_control_price_ns(c, k);
    return limit;
}

/* How long the last tiles ran on after the frame was closed: what all but one of the newest frames stayed
 * within, so that a single spike teaches nothing, while other programs' turns on the cores, which come and go
 * by chance, are reserved for. */
static void learn_straggle(struct fv_budget *b, int64_t end_ns)
{
    double largest = 0, second = 0;
    b->over_ns[b->overs++ % FV_OVERS] =
        b->cut ? (double)(end_ns - b->deadline_ns) + b->present_ns.held + b->straggle_ns : 0;
    for (int i = 0; i < FV_OVERS; i++) {
        second = fmax(second, fmin(largest, b->over_ns[i]));
        largest = fmax(largest, b->over_ns[i]);
    }
    b->straggle_ns = fmin(fmax(second, b->straggle_ns * (1 - 1.0 / 128)), 0.25 * b->period_ns);
}

void fv_budget_stage(struct fv_budget *b, struct fv_frame *f, int i, int done, struct fv_stage_result *r)
{
    struct fv_stage_limit limit = {.done = done};
    bool whole = !f->has_history || f->parameters.foveal.p_min >= 1;
    double expected_ns = 0;
    if (b->deadline_ns) limit = limit_of(b, i, whole, &expected_ns);
    fv_schedule_run(&b->schedule, f, b->plan->pass[i], &limit, r);
    b->cut |= r->cut > 0;
    if (!b->deadline_ns) return; /* nothing to learn from */
    b->expected_ns += expected_ns;
    b->expected_cpu_ns += cpu_of(&b->control, expected_ns) * r->done / (r->done + r->cut + 1e-9);
    if (r->cut > 0)
        fv_peak_learn(&b->stand_in_ns[i][whole],
                      (double)r->stand_in_ns / r->cut / b->schedule.workers->count);
    for (int k = 0; k < 2; k++) {
        b->sample.done.units[2 * i + k] = r->units[k];
        b->sample.cpu_ns[2 * i + k] = r->unit_cpu_ns[k];
    }
    b->sample.total_cpu_ns += (double)r->cpu_ns;
    b->sample.wall_ns += (double)(r->end_ns - r->start_ns);
    if (i + 1 == b->plan->passes) learn_straggle(b, r->end_ns);
}

void fv_budget_end(struct fv_budget *b, struct fv_frame *f)
{
    int64_t reprojected = 0, marked = 0, failed = 0, asked = 0, unanswered = 0, corners = 0, failed_corners = 0;
    int64_t central = 0, reused = 0, doubtful = 0, spared = 0;
    for (int w = 0; w < b->schedule.workers->count; w++) {
        reprojected += f->scratch[w].reprojected;
        marked += f->scratch[w].marked;
        failed += f->scratch[w].failed;
        corners += f->scratch[w].corners;
        failed_corners += f->scratch[w].failed_corners;
        central += f->scratch[w].central;
        reused += f->scratch[w].reused;
        doubtful += f->scratch[w].doubtful;
        spared += f->scratch[w].spared;
        asked += f->scratch[w].asked;
        unanswered += f->scratch[w].unanswered;
    }
    if (reprojected > 0) {
        f->marked_share = (float)marked / (float)reprojected;
        f->failed_share = (float)failed / (float)reprojected;
    }
    if (corners > 0) f->failed_corners_share = (float)failed_corners / (float)corners;
    f->reused_share = central > 0 ? (float)reused / (float)central : 0;
    if (doubtful > 0) f->spared_share = (float)spared / (float)doubtful;
    if (asked > 0) f->unanswered_share = (float)unanswered / (float)asked;
    if (!b->deadline_ns) return;
    b->sample.cut = b->cut;
    b->lead = b->cut && b->sample.hurried ? fmin(1.25 * b->lead, 16) : b->lead - (b->lead - 1) / 64;
    fv_control_learn(&b->control, &b->sample);
}

void fv_budget_presented(struct fv_budget *b, double ns)
{
    fv_peak_learn(&b->present_ns, ns);
}
