/* headline: what a headset would show: both eyes of Sponza by a point light, head and gaze of a Varjo log, two
 * workers, at each headset's own rate: frames that adapt against small, medium and large foveal regions held fixed.
 * Then, as this machine may be slower than the one that the rate is for, the period that each of two regions held
 * fixed keeps in 99 % of its frames.
 *
 * Errors are of the frames as they were rendered, late or not: the left eye against 16 samples a pixel of full at the
 * frame's own pose. Times are without presenting. Each headset has a process of its own, as memory is never given
 * back. Nothing is asserted but that frames come out: the wanted numbers stand beside the measured ones.
 *
 * bench_headline [HEADSET] [FRAMES] */
#include "tests/support/displayed.h"

enum { FRAMES = 600, FRAMES_MIN = 60, FRAMES_MAX = 4000, LEAD = 32, JUDGED = 8 };

struct row {
    const char *name, *adapt;
    double inner_deg, outer_deg, p_min; /* of the settings, which adaptation starts from */
};
static const struct row rows[] = {{"adapting", "on", 10, 20, 0.05},
                                  {"small, fixed", "off", 5, 10, 0.01},
                                  {"medium, fixed", "off", 10, 20, 0.05},
                                  {"large, fixed", "off", 15, 30, 0.1}};
enum { ROWS = sizeof rows / sizeof rows[0], SMALL = 1, MEDIUM = 2 };

static int frames = FRAMES;
static const char *const headsets[] = {"rift-dk2", "rift-s", "quest-2"};
enum { HEADSETS = sizeof headsets / sizeof headsets[0] };
static bool wanted[HEADSETS];

struct bench {
    struct taped taped;
    struct runner adapting;
    struct judge judge;
    double period_ms;
};

struct outcome {
    double ms[FRAMES_MAX], p50_ms, p95_ms, p99_ms;
    int counted, late, cut;
    double level, r0_deg, r1_deg, p_min, sampled; /* means */
    struct judged judged;
};

static void count(struct outcome *o, const struct fv_frame_record *r, double period_ms)
{
    o->ms[o->counted++] = (double)r->frame_ms;
    o->late += (double)r->frame_ms > period_ms;
    o->cut += r->cut;
    o->level += r->level;
    o->r0_deg += (double)r->r0_deg;
    o->r1_deg += (double)r->r1_deg;
    o->p_min += (double)r->p_min;
    o->sampled += (double)r->sampled_fraction;
}

static void summarise(struct outcome *o)
{
    double *means[] = {&o->level, &o->r0_deg, &o->r1_deg, &o->p_min, &o->sampled};
    for (int i = 0; i < 5; i++) *means[i] /= o->counted;
    fv_rank_sort(o->ms, o->counted);
    o->p50_ms = fv_rank_percentile(o->ms, o->counted, 50);
    o->p95_ms = fv_rank_percentile(o->ms, o->counted, 95);
    o->p99_ms = fv_rank_percentile(o->ms, o->counted, 99);
}

/* The session from its beginning by one renderer; the first LEAD frames are not counted. */
static void run_row(struct bench *b, const struct row *row, double period_ms, struct outcome *o)
{
    struct taped *t = &b->taped;
    bool adapts = strcmp(row->adapt, "on") == 0;
    struct runner *r = adapts ? &b->adapting : &t->plain;
    int every = (frames + JUDGED - 1) / JUDGED;
    if (!adapts) {
        r->config.fovea_inner_deg = row->inner_deg;
        r->config.fovea_outer_deg = row->outer_deg;
        r->config.fovea_p_min = row->p_min;
    }
    memset(o, 0, sizeof *o);
    fv_loop_restart(&r->own.loop);
    for (int n = 0; n < LEAD + frames; n++) {
        taped_progress(row->name, n, LEAD + frames);
        runner_render(r, &t->frame[n]);
        if (n < LEAD) continue;
        count(o, &r->record, period_ms);
        if ((n - LEAD) % every != every / 2) continue;
        struct shower shown = {.runner = r};
        shower_show(&shown, INFINITY);
        struct fv_metrics_picture reference = judge_reference(&b->judge, &t->frame[n]);
        judge_shown(&b->judge, &reference, &shown, &o->judged);
    }
    summarise(o);
}

static double foveal_db(const struct outcome *o)
{
    return psnr_of(judged_mean(&o->judged, FOVEAL));
}

static double whole_db(const struct outcome *o)
{
    return psnr_of(judged_mean(&o->judged, WHOLE));
}

static void print_outcome(const char *name, const struct outcome *o)
{
    print_message("| %s | %.1f | %.1f | %.1f | %.1f %% | %d | %.2f | %.1f | %.1f | %.3f | %.1f %% | %.2f | %.2f |\n", name,
                  o->p50_ms, o->p95_ms, o->p99_ms, 100.0 * o->late / o->counted, o->cut, o->level, o->r0_deg,
                  o->r1_deg, o->p_min, 100 * o->sampled, foveal_db(o), whole_db(o));
}

static const char columns[] = "| | p50 ms | p95 | p99 | late | cut | level | r0 | r1 | p_min | sampled | PSNR dB, to 5 "
                              "degrees | whole |\n| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | "
                              "--- | --- |\n";

/* The period that a region keeps at p99: measured at that very period, since how far the head turns between frames
 * follows from it. */
static void print_kept(struct bench *b, const struct row *row)
{
    static struct outcome o;
    double period_ms = 3 * b->period_ms;
    char name[64];
    for (int round = 0; round < 2; round++) {
        taped_latch(&b->taped, period_ms);
        run_row(b, row, period_ms, &o);
        period_ms = o.p99_ms;
    }
    snprintf(name, sizeof name, "%s: keeps %.1f ms (%.1f Hz)", row->name, o.p99_ms, 1e3 / o.p99_ms);
    print_outcome(name, &o);
}

static void run_headset(const char *headset)
{
    static struct bench b;
    static struct outcome o;
    b.taped.frames = LEAD + frames;
    b.taped.headset = headset;
    taped_open(&b.taped);
    b.period_ms = 1e3 / b.taped.setup.config.budget_hz;
    const struct fv_config *c = &b.taped.setup.config;
    judge_open(&b.judge, &b.taped);
    b.adapting.config = *c;
    runner_open(&b.adapting, &b.taped, "reproject", "on", b.period_ms, &b.taped.setup.workers);
    taped_latch(&b.taped, b.period_ms);
    print_message("\n%s: 2 x %lld x %lld at %g Hz, %.2f ms; %d frames, %s, %d workers\n%s", headset,
                  (long long)c->display_width, (long long)c->display_height, c->budget_hz, b.period_ms, frames,
                  fv_cpu_name(), b.taped.setup.workers.count, columns);
    for (int i = 0; i < ROWS; i++) {
        run_row(&b, &rows[i], b.period_ms, &o);
        print_outcome(rows[i].name, &o);
    }
    print_message("| wanted | | | %.1f | | | | 5 | 10 | | | 39 | 28 |\n", b.period_ms);
    print_kept(&b, &rows[SMALL]);
    print_kept(&b, &rows[MEDIUM]);
}

static void headset_test(void **state)
{
    int index = *(const int *)*state, status;
    if (!wanted[index]) return;
    if (!fv_file_exists(FV_SOURCE_DIR "/../shared/data/scenes/sponza")) {
        print_message("Sponza is not in %s/../shared/data: skipped\n", FV_SOURCE_DIR);
        skip();
    }
    fflush(stdout);
    pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        run_headset(headsets[index]);
        fflush(stdout);
        _exit(0);
    }
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_int_equal(status, 0);
}

int main(int argc, char **argv)
{
    static int index[HEADSETS] = {0, 1, 2};
    static struct CMUnitTest tests[HEADSETS];
    bool some = false;
    for (int i = 1; i < argc; i++) {
        bool known = false;
        for (int k = 0; k < HEADSETS; k++)
            if (strcmp(argv[i], headsets[k]) == 0) wanted[k] = some = known = true;
        if (!known) frames = atoi(argv[i]);
    }
    for (int k = 0; k < HEADSETS; k++) {
        wanted[k] |= !some;
        tests[k] = (struct CMUnitTest)cmocka_unit_test_prestate(headset_test, &index[k]);
        tests[k].name = headsets[k];
    }
    if (frames < FRAMES_MIN || frames > FRAMES_MAX) {
        fprintf(stderr, "usage: bench_headline [rift-dk2|rift-s|quest-2] [FRAMES, %d to %d]\n", FRAMES_MIN, FRAMES_MAX);
        return 2;
    }
    return cmocka_run_group_tests(tests, NULL, NULL);
}
