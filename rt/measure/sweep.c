/* sweep: which rows there are, what they may take, and where they are kept; contest.c measures one. */
#include "rt/measure/sweep.h"

#include "platform/arena.h"
#include "rt/measure/contest.h"
#include "rt/measure/picture.h"
#include "rt/measure/sweep_key.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { METHODS_MAX = 8, MANY_SECONDS = 30 };

/* A row of the whole sweep. */
struct place {
    int method, level; /* method: index of the contenders */
    bool there;        /* measured before */
    struct fv_contest_effort effort;
    double frame_seconds, seconds; /* of a frame, of the row, guessed */
};

struct fv_sweep {
    struct fv_config config; /* with a sink, so that there are pictures */
    const struct fv_tracer *tracer;
    struct fv_workers *workers;
    struct fv_sweep_io io;
    double seconds;
    int64_t start_ns;
    double full_seconds; /* a full frame */
    char out[FV_PATH_MAX], key[32], scene[64], about[320];
    int methods;
    struct fv_contender contender[METHODS_MAX];
    struct fv_reference reference;
    struct fv_contest contest;
    int rows, left_out;
    bool asked; /* for one level: it is not left out */
    struct place place[FV_ROWS_MAX];
    double done_seconds, all_seconds; /* of the rows, guessed */
};

static void file_name(const struct fv_sweep *s, char *path, size_t size, const char *folder, int n,
                      const char *ending)
{
    const struct place *p = &s->place[n];
    snprintf(path, size, "%s/%s/%s-%s-%d%s", s->out, folder, s->scene,
             s->contender[p->method].plan.method->name, p->level, ending);
}

/* Letters, digits and -._ stay: the name becomes part of file names and of a CSV cell. */
static void plain_name(char *to, size_t size, const char *from)
{
    size_t n = 0;
    for (; from[n] && n + 1 < size; n++) {
        bool plain = (from[n] >= '0' && from[n] <= '9') || (from[n] >= 'A' && from[n] <= 'Z') ||
                     (from[n] >= 'a' && from[n] <= 'z') || (n > 0 && strchr("-._", from[n]));
        to[n] = plain ? from[n] : '_';
    }
    to[n] = 0;
}

static int choose_rows(struct fv_sweep *s, const struct fv_sweep_choice *choice, struct fv_error *error)
{
    int all = 0, levels = 0;
    for (int m = 0; m < s->methods; m++) {
        const struct fv_method *method = s->contender[m].plan.method;
        bool wanted = choice->method ? strcmp(choice->method, method->name) == 0 : !method->by_paths;
        if (wanted && method->measured > levels) levels = method->measured;
        for (int level = 0; level < method->measured; level++) {
            bool mine = wanted && (choice->level < 0 || choice->level == level);
            if (mine) mine = all++ % choice->shards == choice->shard;
            if (mine) s->place[s->rows++] = (struct place){.method = m, .level = level};
        }
    }
    if (all == 0 && choice->level >= 0)
        return fv_error_set(error, "--level %d: there are levels 0 to %d", choice->level, levels - 1);
    return 0;
}

/* Every frame that is looked at, in the order of time. */
static void latch_frames(struct fv_sweep *s)
{
    double between =
        s->config.scene_path_seconds > 0 ? s->config.scene_path_seconds / FV_SWEEP_SEGMENTS : MANY_SECONDS;
    int64_t period_ns = llround(1e9 / s->config.budget_hz);
    for (int i = 0; i < FV_SWEEP_SEGMENTS; i++)
        for (int k = 0; k < FV_SWEEP_FRAMES; k++) {
            struct fv_sweep_frame *f = &s->contest.frame[i][k];
            f->t_ns = llround((i + 0.5) * between * 1e9) + k * period_ns;
            s->io.latch(s->io.context, f->t_ns, &f->head, f->gaze, &f->uncertainty_deg);
        }
}

/* The row's file, where it is there: 1; 0 where not. */
static int read_row(const struct fv_sweep *s, int n, struct fv_measure_row *row, struct fv_error *error)
{
    char path[FV_PATH_MAX + 160];
    file_name(s, path, sizeof path, "rows", n, ".row");
    if (!fv_file_exists(path)) return 0;
    if (fv_row_read(row, path, error)) return -1;
    if (strcmp(row->key, s->key) == 0) return 1;
    return fv_error_set(
        error, "%s: of another scene, version or other settings; remove it or give another --out", path);
}

static void find_rows(struct fv_sweep *s)
{
    char path[FV_PATH_MAX + 160];
    for (int i = 0; i < s->rows; i++) {
        file_name(s, path, sizeof path, "rows", i, ".row");
        s->place[i].there = fv_file_exists(path);
    }
}

int fv_sweep_open(struct fv_sweep **sweep, const struct fv_config *config, const struct fv_tracer *tracer,
                  struct fv_workers *workers, const struct fv_sweep_io *io,
                  const struct fv_sweep_choice *choice, const char *out, struct fv_error *error)
{
    struct fv_sweep *s = *sweep = fv_arena_take(fv_arena(), "sweep", sizeof *s, 64);
    char folder[FV_PATH_MAX + 16];
    s->config = *config;
    snprintf(s->config.display_sink, sizeof s->config.display_sink, "png");
    snprintf(s->config.output_overlay, sizeof s->config.output_overlay, "off"); /* pictures are judged */
    snprintf(s->config.budget_adapt, sizeof s->config.budget_adapt, "off"); /* a row is a level */
    s->config.method_spp = 1;
    s->tracer = tracer;
    s->workers = workers;
    s->io = *io;
    s->seconds = choice->seconds;
    s->asked = choice->level >= 0;
    s->start_ns = fv_clock_now_ns(&fv_clock_monotonic);
    snprintf(s->out, sizeof s->out, "%s", out);
    plain_name(s->scene, sizeof s->scene, tracer->data->name);
    for (int n = 0; fv_method_at(n) && n < METHODS_MAX; n++)
        fv_contender_plan(&s->contender[s->methods++], fv_method_at(n), &s->config, tracer);
    if (choose_rows(s, choice, error)) return -1;
    latch_frames(s);
    const struct fv_method *asked = choice->method ? fv_method_find(choice->method) : NULL;
    bool by_paths = asked && asked->by_paths;
    fv_sweep_fingerprint(s->key, sizeof s->key, &s->config, tracer->data, s->contest.frame);
    if (by_paths) strncat(s->key, "-paths", sizeof s->key - strlen(s->key) - 1);
    if (strlen(out) > FV_PATH_MAX - 200) return fv_error_set(error, "--out %.60s...: too long", out);
    snprintf(folder, sizeof folder, "%s/reference", out);
    if (fv_reference_check(folder, s->key, error)) return -1;
    find_rows(s);
    fv_reference_open(&s->reference, &s->config, by_paths, tracer, workers);
    fv_contest_open(&s->contest, &s->reference, &s->config, tracer, workers, &s->io);
    for (int i = 0; i < s->rows; i++)
        fv_contender_open(&s->contender[s->place[i].method], &s->config, tracer, workers);
    return 0;
}

int fv_sweep_rows(const struct fv_sweep *s)
{
    return s->rows;
}

int fv_sweep_left_out(const struct fv_sweep *s)
{
    return s->left_out;
}

const char *fv_sweep_scene(const struct fv_sweep *s)
{
    return s->scene;
}

const char *fv_sweep_key(const struct fv_sweep *s)
{
    return s->key;
}

/* What a row can do in `most` seconds: first frames of its own, then full frames beside them. */
static void plan_row(const struct fv_sweep *s, struct place *p, double most, double judging)
{
    struct fv_contest_effort *e = &p->effort;
    bool history = fv_plan_remembers(&s->contender[p->method].plan);
    double own = FV_SWEEP_SEGMENTS * p->frame_seconds, full = FV_SWEEP_SEGMENTS * s->full_seconds;
    e->timed = history ? FV_SWEEP_TIMED : (int)fmin(fmax((most - judging - full) / own, 2), FV_SWEEP_TIMED);
    own *= history ? FV_SWEEP_FRAMES : e->timed;
    e->full = (int)fmin(fmax((most - judging - own) / full, 1), e->timed);
    /* More than once only where there is more than usual time. */
    double repeats = s->seconds > FV_SWEEP_SECONDS ? (most - judging) / (own + e->full * full) : 1;
    e->repeats = (int)fmin(fmax(repeats, 1), FV_SWEEP_REPEATS_MAX);
    p->seconds = judging + e->repeats * (own + e->full * full);
}

/* Seconds of all rows where each may take `most`. */
static double share_out(struct fv_sweep *s, double most, double judging)
{
    double all = 0;
    for (struct place *p = s->place; p < s->place + s->rows; p++) {
        if (p->there) continue;
        plan_row(s, p, most, judging);
        all += p->seconds;
    }
    return all;
}

/* Rows of many full frames each, which would take more than their part even with the fewest, are left out
 * unless they were asked for. */
static void leave_out(struct fv_sweep *s, double judging)
{
    int kept = 0;
    share_out(s, 0, judging);
    for (int i = 0; i < s->rows; i++) {
        const struct place *p = &s->place[i];
        bool dear = p->frame_seconds > 3.5 * s->full_seconds && p->seconds > s->seconds / 8;
        if (dear && !p->there) s->left_out++;
        else s->place[kept++] = *p;
    }
    s->rows = kept;
}

static void plan_time(struct fv_sweep *s, double judging)
{
    for (struct place *p = s->place; p < s->place + s->rows; p++)
        if (!p->there)
            p->frame_seconds =
                fv_contest_guess(&s->contest, &s->contender[p->method], p->level, s->full_seconds);
    if (!s->asked) leave_out(s, judging);
    double spent = (double)(fv_clock_now_ns(&fv_clock_monotonic) - s->start_ns) * 1e-9;
    double left = fmax(s->seconds - spent, 0), low = 0, high = s->seconds;
    for (int i = 0; i < 40; i++) {
        double middle = (low + high) / 2;
        if (share_out(s, middle, judging) > left) high = middle;
        else low = middle;
    }
    s->all_seconds = share_out(s, low, judging);
}

static void describe(struct fv_sweep *s)
{
    const struct fv_config *c = &s->config;
    snprintf(s->about, sizeof s->about,
             "%.60s, %s, %d thread%s; %.32s, %d x %lld x %lld px at %g Hz, %.1f px a degree; reference of %d "
             "samples a pixel, "
             "half of which agree with them to %.3g dB",
             fv_cpu_name(), fv_cpu_isa_name(s->tracer->isa), s->workers->count,
             s->workers->count == 1 ? "" : "s", c->display_headset, (int)c->display_eyes,
             (long long)c->display_width, (long long)c->display_height, c->budget_hz, s->contest.ppd,
             s->reference.spp, s->reference.agreement_db);
}

int fv_sweep_prepare(struct fv_sweep *s, struct fv_error *error)
{
    static struct fv_sweep_frame frames[FV_SWEEP_SEGMENTS][FV_REFERENCE_PICTURES];
    char path[FV_PATH_MAX + 96];
    for (int i = 0; i < FV_SWEEP_SEGMENTS; i++)
        memcpy(frames[i], &s->contest.frame[i][FV_SWEEP_FRAMES - FV_REFERENCE_PICTURES], sizeof frames[i]);
    snprintf(path, sizeof path, "%s/rows", s->out);
    if (fv_folder_make(path, error)) return -1;
    snprintf(path, sizeof path, "%s/pictures", s->out);
    if (fv_folder_make(path, error)) return -1;
    snprintf(path, sizeof path, "%s/reference", s->out);
    int state = fv_reference_make(&s->reference, path, s->key, frames, s->contest.metrics, s->io.stopped,
                                  s->io.progress, s->io.context, error);
    if (state) return state;
    snprintf(path, sizeof path, "%s/pictures/%s-reference.jpg", s->out, s->scene);
    if (fv_picture_jpeg(&s->reference.segment[FV_CONTEST_SHOWN].picture[FV_REFERENCE_LAST], path, error))
        return -1;
    describe(s);
    double judging;
    fv_contest_calibrate(&s->contest, &s->full_seconds, &judging);
    plan_time(s, judging);
    return 0;
}

int fv_sweep_row(struct fv_sweep *s, int n, struct fv_measure_row *row, bool *measured,
                 struct fv_error *error)
{
    static char what[96], path[FV_PATH_MAX + 160], picture[FV_PATH_MAX + 160], difference[FV_PATH_MAX + 160];
    const struct place *p = &s->place[n];
    struct fv_contender *contender = &s->contender[p->method];
    file_name(s, path, sizeof path, "rows", n, ".row");
    file_name(s, picture, sizeof picture, "pictures", n, ".jpg");
    file_name(s, difference, sizeof difference, "pictures", n, "-difference.jpg");
    double done_from = s->all_seconds > 0 ? s->done_seconds / s->all_seconds : 0;
    s->done_seconds += p->seconds;
    *measured = false;
    int there = read_row(s, n, row, error);
    if (there) return there < 0 ? -1 : 0;
    *row = (struct fv_measure_row){.level = p->level, .period_ms = 1e3 / s->config.budget_hz};
    snprintf(row->scene, sizeof row->scene, "%s", s->scene);
    snprintf(row->method, sizeof row->method, "%s", contender->plan.method->name);
    snprintf(row->about, sizeof row->about, "%s", s->about);
    snprintf(row->key, sizeof row->key, "%s", s->key);
    snprintf(what, sizeof what, "row %d of %d: %s level %d", n + 1, s->rows, row->method, row->level);
    s->contest.what = what;
    s->contest.done_from = done_from;
    s->contest.done_to = s->all_seconds > 0 ? s->done_seconds / s->all_seconds : 1;
    int state = fv_contest_run(&s->contest, contender, &p->effort, row, picture, difference, error);
    if (state) return state;
    *measured = true;
    return fv_row_write(row, path, error);
}
