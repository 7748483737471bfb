/* budget: real frames inside their budget (support/taped.h). No frame is presented or waited for; one is late
 * where it took longer than the period. Three tests, each prints tables:
 *
 * load      with adaptation and without (default settings) in turn, a competing load in the middle third; and
 *           every level of the table held fixed, in the same run
 * fixed     with adaptation against small, medium and large foveal regions held fixed, at the period at which
 *           each of these is late in 5 % of its frames: errors of what is displayed
 * overhead  what control and idle workers cost; two workers against one
 *
 * bench_budget [load|fixed|overhead] [FRAMES]: FRAMES are those of `load`, the others' in proportion. With
 * fewer than FRAMES_TRUSTED the tables are printed and nothing is asserted. */
#include "tests/support/displayed.h"
#include "tests/support/taped.h"

#include <signal.h>
#include <spawn.h>

enum { FRAMES = 3000, FRAMES_MIN = 120, FRAMES_TRUSTED = 1000, FRAMES_MAX = 20000 };
enum { LOADS = 2, ANY_LEVEL = -1, NOT_COUNTED = -2 };
static const double usual_share = 0.75; /* of the period: the default settings' median frame */

struct bench {
    struct taped taped;
    pid_t load[LOADS];
};

static bool trusted(const struct bench *b)
{
    if (b->taped.frames < FRAMES_TRUSTED)
        print_message("%d frames are too few to judge by: nothing is asserted\n", b->taped.frames);
    return b->taped.frames >= FRAMES_TRUSTED;
}

/* ---- load ---- */

/* Another program's work, until whoever started it is gone. */
static void spin(pid_t parent) __attribute__((noreturn));
static void spin(pid_t parent)
{
    volatile unsigned sum = 0;
    while (getppid() == parent)
        for (unsigned i = 0; i < 1 << 20; i++) sum = sum + i;
    _exit(0);
}

static void start_load(struct bench *b)
{
    char parent[24], name[] = "budget", mode[] = "spin", *arguments[] = {name, mode, parent, NULL};
    snprintf(parent, sizeof parent, "%ld", (long)getpid());
    for (int i = 0; i < LOADS; i++)
        assert_int_equal(posix_spawn(&b->load[i], "/proc/self/exe", NULL, NULL, arguments, NULL), 0);
}

static int stop_load(void **state)
{
    struct bench *b = *state;
    for (int i = 0; i < LOADS; i++) {
        if (b->load[i] <= 0) continue;
        kill(b->load[i], SIGKILL);
        waitpid(b->load[i], NULL, 0);
        b->load[i] = 0;
    }
    return 0;
}

struct summary {
    int frames, late, cut;
    double late_share, sampled, p50_ms, p99_ms; /* NaN where there are no frames */
};

/* Of records from..to - 1, those of one level or all. */
static struct summary summarise(const struct fv_frame_record *record, int from, int to, int level,
                                double period_ms)
{
    static double ms[FRAMES_MAX];
    struct summary s = {0};
    for (int n = from; n < to; n++) {
        const struct fv_frame_record *r = &record[n];
        if (level == ANY_LEVEL ? r->level == NOT_COUNTED : r->level != level) continue;
        ms[s.frames++] = (double)r->frame_ms;
        s.late += (double)r->frame_ms > period_ms;
        s.cut += r->cut;
        s.sampled += (double)r->sampled_fraction;
    }
    s.late_share = s.frames ? (double)s.late / s.frames : NAN;
    s.sampled = s.frames ? s.sampled / s.frames : NAN;
    fv_rank_sort(ms, s.frames);
    s.p50_ms = s.frames ? fv_rank_percentile(ms, s.frames, 50) : NAN;
    s.p99_ms = s.frames ? fv_rank_percentile(ms, s.frames, 99) : NAN;
    return s;
}

static struct summary print_row(const char *name, const struct fv_frame_record *record, int frames, int level,
                                double period_ms)
{
    struct summary all = summarise(record, 0, frames, level, period_ms), third[3];
    for (int i = 0; i < 3; i++)
        third[i] = summarise(record, frames * i / 3, frames * (i + 1) / 3, level, period_ms);
    print_message("| %s | %d |", name, all.frames);
    for (int i = 0; i < 3; i++) print_message(" %.2f %% |", 100 * third[i].late_share);
    print_message(" %.2f %% |", 100 * all.late_share);
    for (int i = 0; i < 3; i++) print_message(" %.2f %% |", 100 * third[i].sampled);
    print_message(" %.2f %% | %d | %.1f | %.1f |\n", 100 * all.sampled, all.cut, all.p50_ms, all.p99_ms);
    return all;
}

/* The level that frame n of the sweep is rendered at: blocks of consecutive frames, all levels round robin,
 * each time begun with another one. The first frames of a block have a history of another level: *counted is
 * false. */
static int sweep_level(int n, int levels, bool *counted)
{
    enum { BLOCK = 10, WARM = 4 };
    int block = n / BLOCK;
    *counted = n % BLOCK >= WARM;
    return 1 + (block + 3 * (block / levels)) % levels;
}

enum { ADAPT, FIXED, SWEEP, RUNNERS };

static void render_load(struct bench *b, struct runner *runner[RUNNERS],
                        struct fv_frame_record *record[RUNNERS])
{
    int frames = b->taped.frames, levels = runner[SWEEP]->own.plan.method->levels - 1;
    void *state = b;
    for (int r = 0; r < RUNNERS; r++) fv_loop_restart(&runner[r]->own.loop);
    for (int n = 0; n < frames; n++) {
        const struct fv_sweep_frame *f = &b->taped.frame[n];
        bool counted;
        taped_progress("load", n, frames);
        if (n == frames / 3) start_load(b);
        if (n == 2 * frames / 3) stop_load(&state);
        runner[SWEEP]->own.loop.level = sweep_level(n, levels, &counted);
        runner_render_both(runner[ADAPT], runner[FIXED], f, n);
        runner_render(runner[SWEEP], f);
        for (int r = 0; r < RUNNERS; r++) record[r][n] = runner[r]->record;
        if (!counted) record[SWEEP][n].level = NOT_COUNTED;
    }
}

/* The sharpest level that is late in no more than this share of its frames, 0 where there is none. */
static int held(const struct summary *level, int levels, double late_share, double adapt_sampled)
{
    int best = 1;
    while (best <= levels && !(level[best].late_share <= late_share)) best++;
    print_message("sharpest fixed level late in at most %.2f %%: ", 100 * late_share);
    if (best > levels) print_message("none\n");
    else
        print_message("%d, sampled %.2f %%; with adaptation %.3f times that\n", best,
                      100 * level[best].sampled, adapt_sampled / level[best].sampled);
    return best > levels ? 0 : best;
}

static void load(void **state)
{
    static struct runner adapt, sweep;
    struct bench *b = *state;
    struct taped *t = &b->taped;
    struct fv_frame_record *record[RUNNERS];
    struct summary level[FV_LEVELS_MAX];
    taped_open(t);
    double period_ms = taped_settle(t, t->frames, 2, usual_share);
    adapt.config = sweep.config = t->setup.config;
    runner_open(&adapt, t, "reproject", "on", period_ms, &t->setup.workers);
    runner_open(&sweep, t, "reproject", "off", period_ms, &t->setup.workers);
    for (int r = 0; r < RUNNERS; r++)
        record[r] = fv_arena_take(fv_arena(), "frame records", (size_t)t->frames * sizeof *record[r], 64);
    int levels = sweep.own.plan.method->levels - 1;
    render_load(b, (struct runner *[RUNNERS]){&adapt, &t->plain, &sweep}, record);
    print_message(
        "Sponza, Varjo log, rift-dk2 stereo, two workers, %d frames, period %.2f ms (%.2f Hz); %d processes "
        "spin in the second third\n"
        "| | frames | late: before | under load | after | all | sampled: before | under load | after | all | "
        "frames cut | p50 ms | p99 ms |\n"
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n",
        t->frames, period_ms, 1e3 / period_ms, LOADS);
    struct summary on = print_row("adaptation", record[ADAPT], t->frames, ANY_LEVEL, period_ms);
    struct summary off = print_row("fixed, default settings", record[FIXED], t->frames, ANY_LEVEL, period_ms);
    for (int i = 1; i <= levels; i++) {
        char name[32];
        snprintf(name, sizeof name, "fixed, level %d", i);
        level[i] = print_row(name, record[SWEEP], t->frames, i, period_ms);
    }
    int best = held(level, levels, on.late_share, on.sampled);
    held(level, levels, 0.01, on.sampled);
    print_message("late with adaptation %d, without %d; must be 1/20 at most; sampled: 0.8 times at least\n",
                  on.late, off.late);
    if (!trusted(b)) return;
    assert_true(off.late > 0);
    assert_true(20 * on.late <= off.late);
    assert_true(best == 0 || on.sampled >= 0.8 * level[best].sampled);
}

/* ---- fixed ---- */

enum { JUDGED = 24, LATE_JUDGED = 12, LEAD = 32 };
static const double late_percent = 5, tolerance_db = 0.1;

static const struct {
    const char *name;
    double inner_deg, outer_deg, p_min;
} sizes[] = {{"small", 5, 10, 0.01}, {"medium", 10, 20, 0.05}, {"large", 15, 30, 0.1}};
enum { SIZES = sizeof sizes / sizeof sizes[0] };

static int frames_of_fixed(const struct taped *t)
{
    return t->frames / 6;
}

/* Frames in which adaptation finds its level. */
static int lead_of_fixed(const struct taped *t)
{
    return frames_of_fixed(t) < 4 * LEAD ? frames_of_fixed(t) / 4 : LEAD;
}

/* The frames in turn, the first `lead` neither counted nor judged. Timely pictures are judged every so many
 * frames; late ones are few, so that of these every so many are, whenever they come. */
static void show_both(struct taped *t, struct judge *j, struct shower side[2], int frames, int lead,
                      double period_ms)
{
    int every = (frames - lead + JUDGED - 1) / JUDGED;
    int every_late = (int)fmax(1, late_percent / 100 * (frames - lead) / LATE_JUDGED);
    for (int i = 0; i < 2; i++) fv_loop_restart(&side[i].runner->own.loop);
    for (int n = 0; n < frames; n++) {
        struct judged *to[2] = {NULL, NULL};
        taped_progress("in turn", n, frames);
        runner_render_both(side[0].runner, side[1].runner, &t->frame[n], n);
        for (int i = 0; i < 2; i++) {
            struct shower *s = &side[i];
            bool late = shower_show(s, period_ms);
            if (n < lead) continue;
            bool few = s->late % every_late == 0 && s->overdue.count[WHOLE] < 2 * LATE_JUDGED;
            if (late && few) to[i] = &s->overdue;
            if (!late && (n - lead) % every == 0) to[i] = &s->timely;
            shower_count(s, late);
        }
        if (!to[0] && !to[1]) continue;
        struct fv_metrics_picture reference = judge_reference(j, &t->frame[n]);
        for (int i = 0; i < 2; i++)
            if (to[i]) judge_shown(j, &reference, &side[i], to[i]);
    }
}

static void print_side(const char *name, const struct shower *s)
{
    double n = s->frames;
    print_message("| %s | %.2f %% | %d | %.2f | %.2f |", name, 100 * s->late / n, s->cut,
                  psnr_of(shower_square(s, FOVEAL)), psnr_of(shower_square(s, WHOLE)));
    for (int a = 0; a < AREAS; a++)
        print_message(" %.3f (%d) | %.3f (%d) |", 1e3 * judged_mean(&s->timely, a), s->timely.count[a],
                      1e3 * judged_mean(&s->overdue, a), s->overdue.count[a]);
    print_message(" %.2f %% | %.2f | %.4f | %.2f |\n", 100 * s->sampled / n, s->r0_deg / n, s->p_min / n,
                  s->level / n);
}

/* The 95th percentile of the fixed configuration's frame times on these frames. */
static double percentile_ms(struct taped *t, int frames, int lead)
{
    static double ms[FRAMES_MAX];
    fv_loop_restart(&t->plain.own.loop);
    for (int n = 0; n < frames; n++) {
        taped_progress("alone", n, frames);
        runner_render(&t->plain, &t->frame[n]);
        if (n >= lead) ms[n - lead] = (double)t->plain.record.frame_ms;
    }
    fv_rank_sort(ms, frames - lead);
    return fv_rank_percentile(ms, frames - lead, 100 - late_percent);
}

/* One configuration; side[0] has it, side[1] adapts. */
static void fix(struct taped *t, struct judge *j, int i, struct runner *adapt, struct shower side[2])
{
    int frames = frames_of_fixed(t), lead = lead_of_fixed(t);
    char name[64];
    t->plain.config.fovea_inner_deg = sizes[i].inner_deg;
    t->plain.config.fovea_outer_deg = sizes[i].outer_deg;
    t->plain.config.fovea_p_min = sizes[i].p_min;
    taped_settle(t, frames, 1, usual_share);
    double period_ms = percentile_ms(t, frames, lead);
    adapt->config = t->setup.config;
    runner_open(adapt, t, "reproject", "on", period_ms, j->workers);
    side[0] = (struct shower){.runner = &t->plain};
    side[1] = (struct shower){.runner = adapt};
    show_both(t, j, side, frames, lead, period_ms);
    snprintf(name, sizeof name, "%s, at %.2f ms (%.2f Hz)", sizes[i].name, period_ms, 1e3 / period_ms);
    print_side(name, &side[0]);
    print_side("adaptation", &side[1]);
}

static void fixed(void **state)
{
    static struct runner adapt[SIZES];
    static struct judge j;
    static struct shower side[SIZES][2];
    struct bench *b = *state;
    taped_open(&b->taped);
    judge_open(&j, &b->taped);
    print_message(
        "%d frames each, the first %d not counted. A late frame is not shown: the picture before stays and "
        "is judged in its place, by %d samples a pixel at the frame's own pose, left eye; foveal: up to %d "
        "degrees. Of what is displayed: the mean of timely and late ones by their shares.\n"
        "| | late | cut | displayed: PSNR dB foveal | whole | 1000 x mean squared error (pictures): foveal, "
        "timely | late | whole, timely | late | sampled | r0 | p_min | level |\n"
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n",
        frames_of_fixed(&b->taped), lead_of_fixed(&b->taped), REFERENCE_SPP, FOVEAL_DEG);
    for (int i = 0; i < SIZES; i++) fix(&b->taped, &j, i, &adapt[i], side[i]);
    print_message("with adaptation no more may be late, nor errors be larger (by %g dB) than without\n",
                  tolerance_db);
    if (!trusted(b)) return;
    for (int i = 0; i < SIZES; i++) {
        const struct shower *s = side[i];
        assert_true(s[1].late <= s[0].late);
        for (int a = 0; a < AREAS; a++)
            assert_true(psnr_of(shower_square(&s[1], a)) >= psnr_of(shower_square(&s[0], a)) - tolerance_db);
    }
}

/* ---- overhead ---- */

static const double control_limit = 0.01, idle_limit = 0.05, two_workers_limit = 1.9;

struct spread {
    double p25, p50, p75, p99;
};

static struct spread spread_of(double *value, int n)
{
    fv_rank_sort(value, n);
    return (struct spread){fv_rank_percentile(value, n, 25), fv_rank_percentile(value, n, 50),
                           fv_rank_percentile(value, n, 75), fv_rank_percentile(value, n, 99)};
}

/* Shares of the frame while it adapts. */
static void overhead_of(struct taped *t, struct spread *control, struct spread *idle)
{
    static double control_share[FRAMES_MAX], idle_share[FRAMES_MAX];
    static struct runner adapt;
    int frames = t->frames / 20 > LEAD ? t->frames / 20 : LEAD, timed = 0;
    adapt.config = t->setup.config;
    double period_ms = taped_settle(t, t->frames, 2, usual_share);
    runner_open(&adapt, t, "reproject", "on", period_ms, &t->setup.workers);
    for (int n = 0; n < frames + LEAD && n < t->frames; n++) {
        const struct fv_frame_record *r = &adapt.record;
        taped_progress("overhead", n, frames + LEAD);
        runner_render(&adapt, &t->frame[n]);
        if (n < LEAD) continue;
        control_share[timed] = (double)(r->control_ms / r->frame_ms);
        idle_share[timed++] = (double)(r->idle_ms / ((float)t->setup.workers.count * r->frame_ms));
    }
    *control = spread_of(control_share, timed);
    *idle = spread_of(idle_share, timed);
}

/* The full renderer's frame time on one worker over that on two, and their idle share, at poses spread over
 * the session. */
static void speed_of_two(struct taped *t, struct spread *speed, struct spread *idle)
{
    enum { POSES = 30 };
    static struct runner one, two;
    static struct fv_workers alone;
    double ratio[POSES], idle_share[POSES];
    fv_workers_start(&alone, 1);
    one.config = two.config = t->setup.config;
    runner_open(&one, t, "full", "off", 100, &alone);
    runner_open(&two, t, "full", "off", 100, &t->setup.workers);
    runner_render_both(&one, &two, &t->frame[0], 0); /* warms the buffers */
    for (int i = 0; i < POSES; i++) {
        taped_progress("one and two workers", i, POSES);
        runner_render_both(&one, &two, &t->frame[(t->frames - 1) * i / (POSES - 1)], i);
        ratio[i] = (double)(one.record.frame_ms / two.record.frame_ms);
        idle_share[i] = (double)(two.record.idle_ms / (2 * two.record.frame_ms));
    }
    *speed = spread_of(ratio, POSES);
    *idle = spread_of(idle_share, POSES);
}

static void overhead(void **state)
{
    struct bench *b = *state;
    struct spread control, idle, speed, full_idle;
    taped_open(&b->taped);
    if (b->taped.setup.workers.count < 2) {
        print_message("two workers could not be started: skipped\n");
        skip();
    }
    overhead_of(&b->taped, &control, &idle);
    speed_of_two(&b->taped, &speed, &full_idle);
    print_message("| | median | quartiles | p99 | must be |\n| --- | --- | --- | --- | --- |\n");
    const struct {
        const char *name;
        const struct spread *of;
        double scale;
        const char *limit;
    } rows[] = {{"scheduling and control, % of the frame, with adaptation", &control, 100, "< 1"},
                {"idle, % of two workers' time, with adaptation", &idle, 100, "< 5"},
                {"idle, % of two workers' time, full", &full_idle, 100, ""},
                {"full, one worker's frame over two's", &speed, 1, ">= 1.9"}};
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        const struct spread *s = rows[i].of;
        double k = rows[i].scale;
        print_message("| %s | %.3f | %.3f to %.3f | %.3f | %s |\n", rows[i].name, k * s->p50, k * s->p25,
                      k * s->p75, k * s->p99, rows[i].limit);
    }
    if (!trusted(b)) return;
    assert_true(control.p50 < control_limit);
    assert_true(idle.p50 < idle_limit);
    assert_true(speed.p50 >= two_workers_limit);
}

int main(int argc, char **argv)
{
    static struct bench bench = {.taped.frames = FRAMES};
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_prestate_setup_teardown(load, NULL, stop_load, &bench),
        cmocka_unit_test_prestate_setup_teardown(fixed, NULL, NULL, &bench),
        cmocka_unit_test_prestate_setup_teardown(overhead, NULL, NULL, &bench)};
    if (argc == 3 && strcmp(argv[1], "spin") == 0) spin((pid_t)atol(argv[2]));
    for (int i = 1; i < argc; i++) {
        bool known = false;
        for (size_t k = 0; k < sizeof tests / sizeof tests[0]; k++)
            known |= strcmp(argv[i], tests[k].name) == 0;
        if (known) cmocka_set_test_filter(argv[i]);
        else bench.taped.frames = atoi(argv[i]);
    }
    if (bench.taped.frames < FRAMES_MIN || bench.taped.frames > FRAMES_MAX) {
        fprintf(stderr, "usage: bench_budget [load|fixed|overhead] [FRAMES, %d to %d]\n", FRAMES_MIN,
                FRAMES_MAX);
        return 2;
    }
    return cmocka_run_group_tests(tests, NULL, NULL);
}
