/* loop: see loop.h. */
#include "rt/frame/loop.h"

#include "platform/arena.h"

#include <math.h>
#include <string.h>

static const double degree = 3.14159265358979323846 / 180;

void fv_loop_open(struct fv_loop *loop, const struct fv_config *config, const struct fv_plan *plan,
                  const struct fv_tracer *tracer, struct fv_workers *workers, struct fv_session *session,
                  int64_t frames)
{
    struct fv_frame *f = &loop->frame;
    *loop = (struct fv_loop){.config = config, .plan = plan, .clock = &fv_clock_monotonic, .workers = workers,
                             .session = session, .head = {.rotation = {1, 0, 0, 0}}};
    fv_frame_size(f, config);
    f->alpha = (float)config->method_alpha;
    f->epsilon_depth = (float)config->method_epsilon_depth;
    f->overlay = strcmp(config->output_overlay, "on") == 0;
    f->tracer = tracer;
    f->kernels = fv_kernels_for(tracer->isa, plan->variant);
    fv_plan_take(plan, f, workers->count);
    loop->trace = fv_trace_create(workers->count);
    loop->period_ns = llround(1e9 / config->budget_hz);
    *session = (struct fv_session){.scene = tracer->data->name, .method = plan->method->name,
                                   .triangles = tracer->data->triangles, .cpu = fv_cpu_name(),
                                   .isa = fv_cpu_isa_name(tracer->isa), .threads = workers->count,
                                   .period_ms = 1e3 / config->budget_hz,
                                   .pixels = (int64_t)f->eyes * f->width * f->height};
    for (int i = 0; i < plan->passes; i++) session->stage[session->stages++] = plan->pass[i]->name;
    if (plan->present) session->stage[session->stages++] = fv_pass_present.name;
    session->capacity = frames;
    session->record = fv_arena_take(fv_arena(), "frame records",
                                    (size_t)session->capacity * sizeof *session->record, 64);
    fv_plan_report(plan, session);
}

void fv_loop_view(const struct fv_loop *loop, int e, const struct fv_pose *head, const double gaze[3],
                  struct fv_view *view)
{
    const struct fv_config *c = loop->config;
    double in = tan(c->display_fov_in_deg * degree), out = tan(c->display_fov_out_deg * degree);
    struct fv_lens lens = {.tan_left = e == 0 ? out : in, .tan_right = e == 0 ? in : out,
                           .tan_up = tan(c->display_fov_up_deg * degree),
                           .tan_down = tan(c->display_fov_down_deg * degree),
                           .width = loop->frame.width, .height = loop->frame.height};
    double half = 0.0005 * c->display_ipd_mm;
    struct fv_pose offset = {{e == 0 ? -half : half, 0, 0}, {1, 0, 0, 0}}, eye;
    fv_pose_compose(head, &offset, &eye);
    fv_view_set(view, &lens, &eye, gaze);
}

/* r0 wide enough for where the gaze may be; r1 keeps its distance. */
static void widen(struct fv_foveal *f, double uncertainty_deg, double usual_deg)
{
    float more = (float)fmax(0, uncertainty_deg - usual_deg);
    if (f->r0_deg >= 180) return;
    f->r0_deg += more;
    f->r1_deg += more;
}

static void run_pass(struct fv_loop *loop, const struct fv_pass *pass, struct fv_frame_record *record, float *ms)
{
    int64_t start_ns = fv_clock_now_ns(loop->clock);
    fv_pass_run(pass, &loop->frame, loop->workers);
    int64_t end_ns = fv_clock_now_ns(loop->clock);
    *ms = (float)((double)(end_ns - start_ns) * 1e-6);
    for (int w = 0; w < loop->workers->count; w++) {
        record->cpu_ms += (float)((double)loop->workers->cpu_ns[w] * 1e-6);
        fv_trace_add(loop->trace, w, pass->name, record->frame, loop->workers->start_ns[w],
                     loop->workers->end_ns[w]);
    }
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

/* What was this frame's becomes the history of the next. */
static void swap_history(struct fv_loop *loop)
{
    struct fv_frame *f = &loop->frame;
    memcpy(f->before, f->view, sizeof f->before);
    f->has_history = loop->plan->history;
    if (!f->has_history) return;
    for (int e = 0; e < f->eyes; e++)
        for (int b = FV_COLOUR; b <= FV_DEPTH; b++) {
            void *now = f->buffer[b][e];
            f->buffer[b][e] = f->buffer[b + FV_HISTORY_COLOUR][e];
            f->buffer[b + FV_HISTORY_COLOUR][e] = now;
        }
}

void fv_loop_frame(struct fv_loop *loop, const struct fv_pose *head, const double gaze[2][3],
                   double uncertainty_deg, int64_t t_ns, struct fv_frame_record *r)
{
    struct fv_frame *f = &loop->frame;
    if (f->number > 0) swap_history(loop);
    *r = (struct fv_frame_record){.frame = f->number, .t_ns = t_ns, .level = loop->level};
    int64_t start_ns = fv_clock_now_ns(loop->clock);
    loop->plan->method->parameters(loop->config, r->level, &f->parameters);
    widen(&f->parameters.foveal, uncertainty_deg, loop->config->eye_noise_deg);
    if (fv_pose_sound(head)) loop->head = *head;
    for (int e = 0; e < f->eyes; e++) {
        fv_loop_view(loop, e, &loop->head, gaze[e], &f->view[e]);
        if (f->has_history) fv_map_set(&f->map[e], &f->view[e], &f->before[e]);
    }
    for (int w = 0; w < loop->workers->count; w++) memset(f->scratch[w].rays, 0, sizeof f->scratch[w].rays);
    for (int i = 0; i < loop->plan->passes; i++) run_pass(loop, loop->plan->pass[i], r, &r->stage_ms[i]);
    r->frame_ms = (float)((double)(fv_clock_now_ns(loop->clock) - start_ns) * 1e-6);
    r->missed = r->frame_ms > loop->session->period_ms;
    record_counts(loop, r);
    f->number++;
}

void fv_loop_restart(struct fv_loop *loop)
{
    loop->frame.number = 0;
    loop->frame.has_history = false;
    loop->head = (struct fv_pose){.rotation = {1, 0, 0, 0}};
}

void fv_loop_run(struct fv_loop *loop, const struct fv_loop_io *io, int64_t frames)
{
    struct fv_session *s = loop->session;
    for (int64_t n = 0; frames < 0 || n < frames; n++) {
        struct fv_frame_record record;
        struct fv_pose head;
        double gaze[2][3], uncertainty_deg;
        int64_t t_ns = n * loop->period_ns;
        io->latch(io->context, t_ns, t_ns, &head, gaze, &uncertainty_deg);
        fv_loop_frame(loop, &head, gaze, uncertainty_deg, t_ns, &record);
        if (io->wants(io->context, n, n + 1 == frames)) {
            float *ms = &record.stage_ms[loop->plan->passes];
            run_pass(loop, &fv_pass_present, &record, ms);
            record.frame_ms += *ms;
            record.missed = record.frame_ms > s->period_ms;
            io->present(io->context, &loop->frame);
        }
        s->frames++;
        s->missed += record.missed;
        s->cut_frames += record.cut;
        if (n < s->capacity) s->record[n] = record;
        if (!io->after(io->context, s, &record)) break;
    }
}
