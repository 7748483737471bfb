/* loop: see loop.h. */
#include "rt/frame/loop.h"

#include "platform/arena.h"
#include "rt/frame/optics.h"
#include "rt/pass/accumulate.h"
#include "rt/pass/denoise.h"
#include "rt/pass/fringe.h"
#include "rt/pass/turn.h"

#include <math.h>
#include <string.h>

static const double degree = 3.14159265358979323846 / 180;

/* k(dt) of Weier et al. 2016, section 3.4: min(exp(x0 + (dt - 1) / (t_max - 1) (x1 - x0)), k_max), with x0 and
 * x1 the logarithms of k_min and k_max; k_min 0 stands for the least there is, t_max 1 for k_max at once. */
static double least_weight(const struct fv_config *c, double k_min, int age)
{
    double low = log(fmax(k_min, 1e-6)), high = log(fmax(c->method_k_max, 1e-6));
    double at = c->method_t_max > 1 ? (double)(age - 1) / (double)(c->method_t_max - 1) : 1;
    return fmin(exp(low + fmin(fmax(at, 0), 1) * (high - low)), c->method_k_max);
}

static void set_selective(struct fv_selective *s, const struct fv_config *c)
{
    const double upper[FV_REGIONS] = {c->selective_foveal_deg, c->selective_para_deg, c->selective_peri_deg,
                                      c->selective_near_deg, c->selective_outer_deg};
    const double threshold[FV_TAUS] = {c->selective_tau_poid, c->selective_tau_psn, c->selective_tau_psc,
                                       c->selective_tau_pte,  c->selective_tau_soid, c->selective_tau_ssn,
                                       c->selective_tau_ssc,  c->selective_tau_ste,  c->selective_tau_col};
    for (int i = 0; i < FV_TAUS; i++) s->threshold[i] = (float)threshold[i];
    /* One of four turned away from the others by the angle. */
    s->facing_limit = (float)(12 * pow(sin(0.5 * c->selective_facing_deg * degree), 2));
    s->spread = (int)c->selective_spread;
    fv_regions_set(&s->regions, upper);
    fv_tolerance_set(&s->tolerance, &s->regions, c->selective_shape.value);
    s->every = strcmp(c->selective_periphery, "every") == 0;
    s->reuse = (float)c->selective_reuse;
    s->reuse_max = (int)c->selective_reuse_max;
    memcpy(s->alpha, c->selective_alpha.value, sizeof s->alpha);
}

static void set_method(struct fv_frame *f, const struct fv_config *c)
{
    f->epsilon_depth = (float)c->method_epsilon_depth;
    f->epsilon_luminance = (float)c->method_epsilon_luminance;
    f->resample = (float)c->method_resample;
    f->density_deg[FV_COARSE] = (float)c->method_density_deg;
    f->density_deg[FV_COARSEST] = (float)fmax(c->method_density_deg, c->method_quarter_deg);
    f->light_divisor = (int)c->method_light_divisor;
    f->post_filter = (int)c->method_post_filter;
    f->cluster_shift = (int)c->method_cluster / 2;
    f->pyramid = (struct fv_pyramid){.foveated = strcmp(c->method_foveation, "on") == 0,
                                     .minimum = strcmp(c->method_starts, "minimum") == 0,
                                     .blur = strcmp(c->method_blur, "on") == 0,
                                     .cut = strcmp(c->budget_adapt, "on") == 0,
                                     .carry = strcmp(c->method_carry, "on") == 0,
                                     .spp_passed = (int)c->method_ssaa_passed,
                                     .ssaa_contrast = (float)c->method_ssaa_contrast,
                                     .edge = (float)c->method_edge,
                                     .lowest_deg = (float)c->method_lowest_deg};
    /* What is refined is what was sampled, without history. */
    f->keep = strcmp(c->method_history, "keep") == 0 && !f->refined;
    set_selective(&f->selective, c);
    f->denoise = (struct fv_denoise){.bounces = (int)c->denoise_bounces,
                                     .history = (int)c->denoise_history,
                                     .rate = (int)c->denoise_rate,
                                     .despeckle = strcmp(c->denoise_despeckle, "on") == 0,
                                     .apart = strcmp(c->denoise_steady, "apart") == 0,
                                     .deviations = (float)c->denoise_deviations,
                                     .sigma_light = (float)c->denoise_sigma_light,
                                     .sigma_normal = (float)c->denoise_sigma_normal,
                                     .sigma_position = (float)c->denoise_sigma_position};
    /* Shadows of what moves show in nodes that are traced: nothing else tells of them in time. */
    f->support_refresh = f->tracer->data->objects > 0 ? 1 : (int)c->method_support_refresh;
    f->support_counts = strcmp(c->method_support_samples, "count") == 0;
    f->sharp = strcmp(c->method_history_filter, "cubic") == 0;
    for (int age = 0; age < 128; age++) {
        f->k[0][age] = (float)least_weight(c, c->method_k_min, age);
        f->k[1][age] = fminf(f->k[0][age], 1 / 256.0f);
        f->light_k[0][age] = (float)least_weight(c, c->method_light_k_min, age);
        f->light_k[1][age] = fminf(f->light_k[0][age], 1 / 256.0f);
    }
}

/* A number in [0, 1) for a frame, by a step of 1 / 2^32: exact however many frames have passed. */
static float sequence(int64_t frame, uint32_t step)
{
    return (float)((uint32_t)frame * step >> 8) * 0x1p-24f;
}

/* Where samples lie in their pixels, and support nodes in their cells: evenly spread over the frames (rank-1
 * sequences: square roots of 2 and 3; Roberts' R2). */
static void set_jitter(struct fv_frame *f, const struct fv_config *c)
{
    bool can = f->keeps_history && strcmp(c->method_jitter, "off") != 0;
    bool on = can && !f->refined && (f->still || strcmp(c->method_jitter, "on") == 0); /* pixels that are refined have theirs at the centre */
    f->jitter[0] = on ? sequence(f->number, 1779033704u) - 0.5f : 0;
    f->jitter[1] = on ? sequence(f->number, 3144134277u) - 0.5f : 0;
    /* Else at the centre of the pixel next to the middle. */
    float middle = 0.5f + 0.5f / (float)f->spacing;
    f->node[0] = can ? sequence(f->number, 3242174889u) : middle;
    f->node[1] = can ? sequence(f->number, 2447445414u) : middle;
}

void fv_loop_open(struct fv_loop *loop, const struct fv_config *config, const struct fv_plan *plan,
                  const struct fv_tracer *tracer, struct fv_workers *workers, struct fv_session *session,
                  int64_t frames)
{
    struct fv_frame *f = &loop->frame;
    *loop = (struct fv_loop){.config = config,
                             .plan = plan,
                             .clock = &fv_clock_monotonic,
                             .workers = workers,
                             .session = session,
                             .head = {.rotation = {1, 0, 0, 0}}};
    fv_frame_size(f, config);
    f->refined = plan->buffers & FV_BIT(FV_BASE);
    f->tracer = tracer;
    set_method(f, config);
    f->overlay = strcmp(config->output_overlay, "on") == 0;
    f->keeps_history = plan->history;
    f->kernels = fv_kernels_for(tracer->isa, plan->variant);
    fv_plan_take(plan, f, workers->count);
    fv_loop_look(loop, config);
    if (f->fringe) fv_fringe_set(f->fringe, &loop->bend[0]);
    if (f->turn && loop->bend[0].on) fv_unbend_set(&f->turn->unbend, &loop->bend[0]);
    if (plan->map_side) fv_visibility_make(tracer, plan->map_side, f->kernels->map_row, workers);
    loop->trace = fv_trace_create(workers->count);
    loop->period_ns = llround(1e9 / config->budget_hz);
    loop->vsync = strcmp(config->budget_pace, "vsync") == 0;
    fv_budget_open(&loop->budget, config, plan, f, workers, loop->clock, loop->trace);
    *session = (struct fv_session){.scene = tracer->data->name,
                                   .method = plan->method->name,
                                   .triangles = tracer->data->triangles,
                                   .fields = tracer->data->fields.parts,
                                   .cpu = fv_cpu_name(),
                                   .isa = fv_cpu_isa_name(tracer->isa),
                                   .threads = workers->count,
                                   .period_ms = 1e3 / config->budget_hz,
                                   .levels = loop->budget.adapt ? plan->method->levels - 1 : 0,
                                   .pixels = (int64_t)f->eyes * f->width * f->height};
    for (int i = 0; i < plan->passes; i++) session->stage[session->stages++] = plan->pass[i]->name;
    if (plan->present) session->stage[session->stages++] = fv_pass_present.name;
    if (plan->fringes) session->stage[session->stages++] = fv_pass_fringe.name;
    if (plan->turns) session->stage[session->stages++] = fv_pass_turn.name;
    session->capacity = frames;
    session->record =
        fv_arena_take(fv_arena(), "frame records", (size_t)session->capacity * sizeof *session->record, 64);
    fv_plan_report(plan, session);
}

void fv_loop_look(struct fv_loop *loop, const struct fv_config *config)
{
    loop->config = config;
    for (int e = 0; e < 2; e++) fv_optics_lens(config, e, &loop->lens[e], &loop->bend[e]);
}

void fv_loop_view(const struct fv_loop *loop, int e, const struct fv_pose *head, const double gaze[3],
                  struct fv_view *view)
{
    double half = 0.0005 * loop->config->display_ipd_mm;
    struct fv_pose offset = {{e == 0 ? -half : half, 0, 0}, {1, 0, 0, 0}}, eye;
    fv_pose_compose(head, &offset, &eye);
    fv_view_set_bent(view, &loop->lens[e], &loop->bend[e], &eye, gaze);
}

static void record_stage(struct fv_frame_record *r, int stage, int64_t deadline_ns,
                         const struct fv_stage_result *of)
{
    r->stage_ms[stage] = (float)((double)(of->end_ns - of->start_ns) * 1e-6);
    r->cpu_ms += (float)((double)of->cpu_ns * 1e-6);
    r->idle_ms += (float)((double)of->idle_ns * 1e-6);
    r->control_ms += (float)((double)of->order_ns * 1e-6);
    r->cut_tiles += of->cut;
    r->late_stages |= (uint32_t)(of->end_ns > deadline_ns) << stage;
    r->decision.done[stage] = of->cut ? of->done : -1;
}

static void record_counts(const struct fv_loop *loop, struct fv_frame_record *r)
{
    const struct fv_frame *f = &loop->frame;
    for (int w = 0; w < loop->workers->count; w++)
        for (int k = 0; k < FV_RAY_KINDS; k++) r->rays[k] += f->scratch[w].rays[k];
    double samples = (double)loop->session->pixels * f->parameters.spp;
    r->sampled_fraction = (float)fmin(1, (double)r->rays[FV_RAY_PRIMARY] / samples);
    r->r0_deg = f->parameters.foveal.r0_deg;
    r->r1_deg = f->parameters.foveal.r1_deg;
    r->p_min = f->parameters.foveal.p_min;
    for (int e = 0; e < f->eyes; e++) memcpy(r->gaze_px[e], f->view[e].gaze_px, sizeof r->gaze_px[e]);
}

static void swap(struct fv_frame *f, int now, int history)
{
    for (int e = 0; e < f->eyes; e++) {
        void *of_now = f->buffer[now][e];
        f->buffer[now][e] = f->buffer[history][e];
        f->buffer[history][e] = of_now;
    }
}

static void swap_holds(struct fv_frame *f)
{
    for (int t = 0; t < f->tiles; t++) {
        uint8_t now = f->state[t].holds[0];
        f->state[t].holds[0] = f->state[t].holds[1];
        f->state[t].holds[1] = now;
    }
}

/* The last frame's images, which are swapped with this frame's already, are the first of those kept; the oldest ones
 * are written next. */
static void shift_pasts(struct fv_frame *f)
{
    int last = f->pasts_kept - 1;
    struct fv_past *first = &f->past[0], oldest = f->past[last];
    memmove(first + 1, first, (size_t)last * sizeof *first);
    memcpy(first->view, f->view, sizeof first->view);
    memcpy(first->object, f->object, sizeof first->object);
    for (int e = 0; e < f->eyes; e++) {
        first->colour[e] = f->buffer[FV_HISTORY_COLOUR][e];
        first->cache[e] = f->buffer[FV_HISTORY_CACHE][e];
        f->buffer[FV_COLOUR][e] = oldest.colour[e];
        f->buffer[FV_CACHE][e] = oldest.cache[e];
    }
    for (int t = 0; t < f->tiles && last > 0; t++) {
        struct fv_tile_state *state = &f->state[t];
        int fine = 1 << FV_FINE, held = state->held >> (last - 1) & 1;
        state->held = (uint8_t)(state->held << 1 | (state->holds[0] & fine));
        state->holds[0] = (uint8_t)((state->holds[0] & ~fine) | held);
    }
    if (f->pasts < f->pasts_kept) f->pasts++;
}

/* The pyramid's levels that are carried over. */
static void swap_lower(struct fv_frame *f)
{
    for (int d = f->buffer[FV_HISTORY_COLOUR][0] ? FV_FINE : FV_COARSE; d < FV_DENSITIES; d++) swap(f, FV_COLOUR + 2 * d, FV_HISTORY_COLOUR + 2 * d);
    swap(f, FV_STARTS, FV_HISTORY_STARTS);
    swap_holds(f);
}

/* Light that was accumulated, and of what it is. */
static void swap_mean(struct fv_frame *f)
{
    swap(f, FV_MEAN, FV_HISTORY_MEAN);
    swap(f, FV_TRACK, FV_HISTORY_TRACK);
    swap(f, FV_FACING, FV_HISTORY_FACING);
}

/* What was this frame's becomes the history of the next. */
static void swap_history(struct fv_loop *loop)
{
    struct fv_frame *f = &loop->frame;
    memcpy(f->before, f->view, sizeof f->before);
    memcpy(f->object_before, f->object, sizeof f->object_before);
    f->has_history = loop->plan->history;
    f->pyramid.has_last = loop->plan->carry;
    if (f->has_mean) swap_mean(f);
    if (loop->plan->carry) swap_lower(f);
    if (!f->has_history) return;
    f->spacing_before = f->spacing;
    for (int b = FV_COLOUR; b < FV_HISTORY_COLOUR; b++) swap(f, b, b + FV_HISTORY_COLOUR);
    if (f->support_refresh > 1) {
        swap(f, FV_SUPPORT_DEPTH, FV_SUPPORT_HISTORY_DEPTH);
        swap(f, FV_SUPPORT_SURFACE, FV_SUPPORT_HISTORY_SURFACE);
    }
    for (int b = FV_BASE; b < FV_HISTORY_BASE && f->buffer[FV_HISTORY_BASE][0]; b++) swap(f, b, b - FV_BASE + FV_HISTORY_BASE);
    swap_holds(f);
    if (f->pasts_kept > 0) shift_pasts(f);
}

static void set_past_maps(struct fv_frame *f, struct fv_past *past, int e)
{
    fv_map_set(&past->map[e][0], &f->view[e], &past->view[e]);
    for (int i = 0; i < f->tracer->data->objects; i++)
        fv_map_set_moving(&past->map[e][i + 1], &f->view[e], &past->view[e], &f->object[i], &past->object[i]);
}

static void set_maps(struct fv_frame *f, int e)
{
    const struct fv_scene *scene = f->tracer->data;
    fv_map_set(&f->map[e], &f->view[e], &f->before[e]);
    f->object_map[e][0] = f->map[e];
    for (int i = 0; i < scene->objects; i++)
        fv_map_set_moving(&f->object_map[e][i + 1], &f->view[e], &f->before[e], &f->object[i],
                          &f->object_before[i]);
}

/* What came in, as this frame's views and maps; and all that moves, at its place for the frame's time. */
static void take_latch(struct fv_loop *loop, const struct fv_pose *head, const double gaze[2][3], int64_t t_ns)
{
    struct fv_frame *f = &loop->frame;
    const struct fv_scene *scene = f->tracer->data;
    if (fv_pose_sound(head)) loop->head = *head;
    for (int i = 0; i < scene->objects; i++) fv_moving_pose(&scene->object[i].moving, t_ns, &f->object[i]);
    fv_tracer_move(f->tracer, f->object);
    for (int e = 0; e < f->eyes; e++) {
        fv_loop_view(loop, e, &loop->head, gaze[e], &f->view[e]);
        if (f->has_history || f->pyramid.has_last || f->has_mean) set_maps(f, e);
        for (int k = 0; k < f->pasts; k++) set_past_maps(f, &f->past[k], e);
        f->still = (e == 0 || f->still) && f->has_history && scene->objects == 0 && fv_map_still(&f->map[e], &f->view[e]);
    }
    for (int w = 0; w < loop->workers->count; w++) {
        struct fv_worker_scratch *s = &f->scratch[w];
        memset(s->rays, 0, sizeof s->rays);
        s->reprojected = s->marked = s->failed = s->asked = s->unanswered = s->corners = s->failed_corners = 0;
        s->central = s->reused = s->doubtful = s->spared = 0;
    }
}

/* A frame as it was decided (NULL: as the budget decides), from `start_ns` on, to be done by deadline_ns (0:
 * in the periods that it is given). */
static void render(struct fv_loop *loop, const struct fv_pose *head, const double gaze[2][3],
                   double uncertainty_deg, int64_t t_ns, const struct fv_decision *decided, int64_t start_ns,
                   int64_t deadline_ns, struct fv_frame_record *r)
{
    struct fv_frame *f = &loop->frame;
    struct fv_budget *b = &loop->budget;
    struct fv_stage_result stage;
    if (f->number > 0) swap_history(loop);
    fv_frame_lay(f);
    *r = (struct fv_frame_record){.frame = f->number, .t_ns = t_ns, .decision.t_ns = t_ns};
    memset(r->decision.done, -1, sizeof r->decision.done);
    take_latch(loop, head, gaze, t_ns);
    int64_t latched_ns = fv_clock_now_ns(loop->clock);
    r->level = fv_budget_begin(b, f, loop->level, decided, uncertainty_deg, start_ns, deadline_ns);
    r->decision.level = r->level;
    fv_layers_begin(f);
    set_jitter(f, loop->config); /* by its spacing */
    r->periods = b->deadline_ns ? b->control.periods : 1;
    int64_t begun_ns = fv_clock_now_ns(loop->clock);
    r->control_ms = (float)((double)(begun_ns - latched_ns) * 1e-6);
    fv_trace_add(loop->trace, 0, "control", r->frame, latched_ns, begun_ns);
    if (!deadline_ns) deadline_ns = start_ns + r->periods * loop->period_ns;
    for (int i = 0; i < loop->plan->passes; i++) {
        fv_budget_stage(b, f, i, decided ? decided->done[i] : -1, &stage);
        record_stage(r, i, deadline_ns, &stage);
    }
    fv_budget_end(b, f);
    f->has_mean = fv_accumulates(f);
    int64_t end_ns = fv_clock_now_ns(loop->clock);
    r->frame_ms = (float)((double)(end_ns - start_ns) * 1e-6);
    r->latch_ms = (float)((double)(deadline_ns - start_ns) * 1e-6);
    if (b->deadline_ns) {
        r->predicted_ms = (float)(b->expected_ns * 1e-6);
        r->budget_ms = (float)((double)(deadline_ns - start_ns) * 1e-6 - b->present_ns.held * 1e-6);
    }
    r->cut = b->cut;
    r->missed = r->frame_ms > loop->session->period_ms;
    record_counts(loop, r);
}

void fv_loop_frame(struct fv_loop *loop, const struct fv_pose *head, const double gaze[2][3],
                   double uncertainty_deg, int64_t t_ns, struct fv_frame_record *record)
{
    render(loop, head, gaze, uncertainty_deg, t_ns, NULL, fv_clock_now_ns(loop->clock), 0, record);
    loop->frame.number++;
}

void fv_loop_settings(struct fv_loop *loop)
{
    set_method(&loop->frame, loop->config);
}

void fv_loop_restart(struct fv_loop *loop)
{
    loop->frame.number = 0;
    loop->frame.has_history = loop->frame.pyramid.has_last = loop->frame.has_mean = false;
    loop->frame.pasts = 0;
    loop->frame.layers[0].made = loop->frame.layers[1].made = false;
    for (int t = 0; t < loop->frame.tiles && loop->frame.state && !loop->plan->history; t++)
        loop->frame.state[t].holds[0] = 0;
    loop->frame.marked_share = loop->frame.failed_share = loop->frame.unanswered_share = loop->frame.failed_corners_share = 0;
    loop->frame.reused_share = loop->frame.spared_share = 0;
    memset(loop->budget.schedule.waited, 0, (size_t)loop->frame.tiles);
    loop->head = (struct fv_pose){.rotation = {1, 0, 0, 0}};
}

void fv_loop_period(struct fv_loop *loop, int64_t period_ns)
{
    loop->period_ns = period_ns;
    loop->budget.period_ns = (double)period_ns;
    loop->session->period_ms = 1e-6 * (double)period_ns;
}

/* Waits for this frame's turn; returns the session time that it is shown for, and its deadline. */
static int64_t wait_for_turn(struct fv_loop *loop, const struct fv_loop_io *io, int64_t *deadline_ns)
{
    const struct fv_clock *clock = loop->clock;
    struct fv_beat beat;
    if (io->beat && io->beat(io->context, &beat)) fv_pace_follow(&loop->pace, &beat);
    double needs_ns = fv_budget_foresee(&loop->budget);
    int periods = loop->budget.adapt ? loop->budget.control.periods : 1;
    int64_t period_ns = periods * loop->period_ns;
    int64_t need_ns = needs_ns > 0 && needs_ns < (double)period_ns ? llround(needs_ns) : period_ns;
    int64_t start_ns = fv_pace_aim(&loop->pace, fv_clock_now_ns(clock), need_ns, periods);
    if (start_ns > fv_clock_now_ns(clock)) fv_clock_sleep_until_ns(clock, start_ns);
    /* Held up until its flip was over: it is for the next one that is still to come. */
    if (fv_clock_now_ns(clock) >= fv_pace_deadline_ns(&loop->pace))
        fv_pace_done(&loop->pace, fv_clock_now_ns(clock) + 1);
    *deadline_ns = fv_pace_deadline_ns(&loop->pace);
    return fv_pace_shown_ns(&loop->pace);
}

static void present(struct fv_loop *loop, struct fv_frame_record *r, int64_t deadline_ns)
{
    static const struct fv_pass *const pass[] = {&fv_pass_present, &fv_pass_fringe};
    const struct fv_stage_limit unlimited = {.done = -1};
    double ns = 0;
    for (int i = 0, at = loop->plan->passes; i < 1 + loop->plan->fringes; i++, at++) {
        struct fv_stage_result stage;
        fv_schedule_run(&loop->budget.schedule, &loop->frame, pass[i], &unlimited, &stage);
        record_stage(r, at, deadline_ns, &stage);
        ns += (double)(stage.end_ns - stage.start_ns);
        r->frame_ms += r->stage_ms[at];
    }
    fv_budget_presented(&loop->budget, ns);
    r->missed = r->frame_ms > loop->session->period_ms;
}

/* What missed its flip, for the one that it is shown at, late_ns in session time; now_ns: in session time, too. */
static void turn(struct fv_loop *loop, const struct fv_loop_io *io, int64_t now_ns, int64_t late_ns, int64_t deadline_ns,
                 struct fv_frame_record *r)
{
    int at = loop->plan->passes + 1 + loop->plan->fringes;
    struct fv_stage_result stage;
    struct fv_pose head;
    r->decision.late_ns = late_ns;
    io->newest(io->context, now_ns, late_ns, &head);
    r->turned = fv_late_turn(&loop->late, &loop->budget.schedule, &loop->frame, &head, &stage);
    if (!r->turned) return;
    record_stage(r, at, deadline_ns, &stage);
    r->frame_ms += r->stage_ms[at];
}

/* The finished frame's picture, and where it is late what becomes of it. */
static void finish(struct fv_loop *loop, const struct fv_loop_io *io, const struct fv_decision *decided, int64_t deadline_ns,
                   struct fv_frame_record *r)
{
    present(loop, r, deadline_ns);
    if (!loop->frame.turn || !io->newest || !loop->vsync) return;
    int64_t now_ns = fv_clock_now_ns(loop->clock);
    int64_t late_ns = decided ? decided->late_ns : fv_late_shown_ns(&loop->late, &loop->pace, now_ns);
    if (late_ns > 0) turn(loop, io, decided ? late_ns : now_ns - loop->pace.epoch_ns, late_ns, deadline_ns, r);
}

static void count(struct fv_session *s, const struct fv_frame_record *r)
{
    s->frames++;
    s->missed += r->missed;
    s->cut_frames += r->cut;
    s->late_corrected += r->turned;
    if (s->frames <= s->capacity) s->record[s->frames - 1] = *r;
}

void fv_loop_run(struct fv_loop *loop, const struct fv_loop_io *io, int64_t frames)
{
    struct fv_session *s = loop->session;
    loop->pace = (struct fv_pace){.epoch_ns = fv_clock_now_ns(loop->clock), .period_ns = loop->period_ns};
    for (int64_t n = 0; frames < 0 || n < frames; n++) {
        struct fv_frame_record record;
        struct fv_decision decided;
        struct fv_pose head;
        double gaze[2][3], uncertainty_deg;
        bool replayed = io->decided && io->decided(io->context, n, &decided), paced = loop->vsync && !replayed;
        int64_t lost = 0, deadline_ns = 0, t_ns = replayed ? decided.t_ns : n * loop->period_ns, now_ns = t_ns;
        if (paced) {
            int64_t before = loop->pace.flip;
            t_ns = wait_for_turn(loop, io, &deadline_ns);
            lost = n > 0 ? loop->pace.flip - before - 1 : 0;
            now_ns = fv_clock_now_ns(loop->clock) - loop->pace.epoch_ns;
        }
        int64_t start_ns = fv_clock_now_ns(loop->clock);
        io->latch(io->context, now_ns, t_ns, &head, gaze, &uncertainty_deg);
        render(loop, &head, gaze, uncertainty_deg, t_ns, replayed ? &decided : NULL, start_ns, deadline_ns,
               &record);
        bool wanted = io->wants(io->context, n, n + 1 == frames);
        if (wanted)
            finish(loop, io, replayed ? &decided : NULL, deadline_ns ? deadline_ns : start_ns + record.periods * loop->period_ns, &record);
        if (paced) {
            int64_t late = fv_pace_done(&loop->pace, fv_clock_now_ns(loop->clock));
            s->skipped += late + lost;
            record.missed = late + lost > 0;
            fv_late_tell(&loop->late, record.missed, record.turned);
        }
        if (wanted) io->present(io->context, &loop->frame);
        loop->frame.number++;
        count(s, &record);
        if (!io->after(io->context, s, &record)) break;
    }
    fv_schedule_rings(&loop->budget.schedule, s->ring);
}
