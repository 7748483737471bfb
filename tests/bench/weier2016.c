/* weier2016: reproject at the medium foveal region against full on Sponza, one eye of 1182 x 1464, two workers, on
 * the fly-through and in the three kinds of light of `measure --table weier2016`: speed-ups, and what all that is not
 * tracing rays (choosing, reprojecting, merging, filling, presenting) costs against the full renderer's frame by a
 * point light, and against copying the bytes that it must touch.
 *
 * Speed-ups are of wall time; beside them stands what CPU time of all workers says, which a busy machine disturbs less.
 * The rest is of CPU time: the tracing kernel is timed by the thread's
 * clock, through a table of kernels in which it is wrapped; copying is done in turn with the frames, by as many
 * workers. Each light has a process of its own, as memory is never given back.
 *
 * bench_weier2016 [FRAMES] */
#include "cli/cli.h"
#include "platform/arena.h"
#include "rt/measure/flight.h"
#include "rt/measure/rank.h"
#include "rt/measure/table.h"
#include "tests/support/program.h"

#include <math.h>
#include <stdatomic.h>

enum { FRAMES = 300, FRAMES_MIN = 20, FRAMES_TRUSTED = 100, FRAMES_MAX = 5000, FULL = 40, LIGHTS = 3, MEDIUM = 1 };
static int frames = FRAMES;

static const struct {
    const char *name;
    double paper, must;
} lights[LIGHTS] = {{"point light", 1.92, 4}, {"area light, 8", 3.52, 5.5}, {"ambient occlusion, 16", 4.18, 6}};
static const double other_limit = 0.10, copy_limit = 3;

struct result {
    struct fv_measured full_ms, ms, speedup, full_cpu_ms, tracing_ms, other_ms, copy_ms, over_copy;
    double rays_full, rays, cpu_speedup, megabytes;
};

/* ---- what is timed besides frames ---- */

static atomic_llong tracing_ns;
static const struct fv_kernels *unwrapped;

static void timed_trace(const struct fv_tracer *tracer, const struct fv_view *view, struct fv_samples *samples,
                        uint32_t seed, int64_t *rays)
{
    int64_t start_ns = fv_clock_thread_ns();
    unwrapped->trace(tracer, view, samples, seed, rays);
    atomic_fetch_add(&tracing_ns, fv_clock_thread_ns() - start_ns);
}

/* Of a pixel: colour and cache of the history read, both of this frame written, the colour read and four bytes of
 * picture written for the display. A fine tile is also kept halved, a coarse one has a quarter of the pixels but as
 * many of the picture. */
static double bytes_touched(const struct fv_frame *f)
{
    enum { PIXELS = FV_TILE * FV_TILE, KEPT = 8, SHOWN = 4 };
    double bytes = 0;
    for (int i = 0; i < f->tiles; i++) {
        bool fine = !f->state || f->state[i].density == FV_FINE;
        double pixels = fine ? PIXELS : PIXELS / 4;
        bytes += pixels * (2 * KEPT + SHOWN) + PIXELS * SHOWN + (fine ? PIXELS / 4 * KEPT : 0);
    }
    return bytes;
}

struct copy {
    char *from, *to;
    int64_t chunk;
    atomic_llong ns;
};
enum { CHUNKS = 512 };

static void copy_chunk(void *context, int n, int worker)
{
    struct copy *c = context;
    (void)worker;
    int64_t start_ns = fv_clock_thread_ns();
    memcpy(c->to + n * c->chunk, c->from + n * c->chunk, (size_t)c->chunk);
    atomic_fetch_add(&c->ns, fv_clock_thread_ns() - start_ns);
}

struct bench {
    struct fv_setup setup;
    struct fv_flight flight;
    struct copy copy;
    atomic_llong present_ns;
    double bytes;
    double tracing_ms[FRAMES_MAX], other_ms[FRAMES_MAX], copy_ms[FRAMES_MAX], over_copy[FRAMES_MAX];
};

/* The pass that makes the display's picture once more, by the threads' clocks. */
static void present_tile(void *context, int index, int worker)
{
    struct bench *b = context;
    struct fv_frame *f = &b->flight.side[MEDIUM].own.loop.frame;
    struct fv_tile tile = fv_tile_at(f, index, worker);
    int64_t start_ns = fv_clock_thread_ns();
    fv_pass_present.run(f, &tile);
    atomic_fetch_add(&b->present_ns, fv_clock_thread_ns() - start_ns);
}

static void rendered(void *context, int side, int n)
{
    struct bench *b = context;
    const struct fv_flight_side *s = &b->flight.side[MEDIUM];
    double traced_ms = 1e-6 * (double)atomic_exchange(&tracing_ns, 0);
    if (side != MEDIUM) return;
    const struct fv_frame_record *r = &s->record[n];
    b->present_ns = b->copy.ns = 0;
    b->bytes = bytes_touched(&s->own.loop.frame);
    b->copy.chunk = (int64_t)(b->bytes / 2 / CHUNKS); /* half is read, half is written */
    fv_workers_run(&b->setup.workers, s->own.loop.frame.tiles, present_tile, b);
    fv_workers_run(&b->setup.workers, CHUNKS, copy_chunk, &b->copy);
    b->tracing_ms[n] = traced_ms;
    b->other_ms[n] = (double)r->cpu_ms - traced_ms + 1e-6 * (double)b->present_ns;
    b->copy_ms[n] = 1e-6 * (double)b->copy.ns;
    b->over_copy[n] = b->other_ms[n] / b->copy_ms[n];
}

/* ---- one light ---- */

static void relight(void *context, struct fv_setup *setup)
{
    fv_table_weier2016.relight(*(const int *)context, &setup->scene);
}

static void latch(void *context, int64_t t_ns, struct fv_pose *head, double gaze[2][3], double *uncertainty_deg)
{
    struct bench *b = context;
    struct fv_pose relative;
    struct fv_gaze g;
    fv_setup_latch(&b->setup, t_ns, t_ns, &relative, &g, head);
    memcpy(gaze, g.direction, sizeof g.direction);
    *uncertainty_deg = g.uncertainty_deg;
}

static bool stopped(void *context)
{
    (void)context;
    return false;
}

static void progress(void *context, const char *what, double done)
{
    (void)context, (void)what, (void)done;
}

static void open_light(struct bench *b, int light)
{
    struct fv_table_part part;
    struct fv_error error;
    struct fv_config_request request = {
        .sets = 2, .set = {"threads.workers=2", "scene.library=" FV_SOURCE_DIR "/../shared/data/scenes"}};
    fv_table_weier2016.part(light, frames, &part);
    for (int i = 0; i < part.settings; i++) request.set[request.sets++] = part.setting[i];
    b->setup.change = relight;
    b->setup.change_context = &light;
    if (fv_setup_open(&b->setup, &request, &error) || fv_setup_start(&b->setup, false, &error)) {
        fprintf(stderr, "%s\n", error.text);
        _exit(1);
    }
    b->setup.config.scene_path_seconds = part.path_frames / b->setup.config.budget_hz;
}

static double cpu_ms(const struct fv_frame_record *r, int unused)
{
    (void)unused;
    return (double)r->cpu_ms;
}

static void measure_light(int light, struct result *result)
{
    static struct bench b;
    static struct fv_kernels wrapped;
    const struct fv_sweep_io io = {&b, latch, stopped, progress};
    open_light(&b, light);
    struct fv_flight *f = &b.flight;
    *f = (struct fv_flight){.frames = frames, .path_frames = 1000, .full = FULL, .sides = 2, .rendered = rendered, .context = &b};
    f->side[0] = (struct fv_flight_side){.method = "full", .foveal = {180, 180, 1}};
    f->side[MEDIUM] = (struct fv_flight_side){.method = "reproject", .foveal = {10, 20, 0.05f}};
    fv_flight_open(f, &b.setup.config, &b.setup.tracer, &b.setup.workers, &io);
    unwrapped = f->side[MEDIUM].own.loop.frame.kernels;
    wrapped = *unwrapped;
    wrapped.trace = timed_trace;
    f->side[MEDIUM].own.loop.frame.kernels = &wrapped;
    size_t most = (size_t)f->side[MEDIUM].own.loop.frame.tiles * FV_TILE * FV_TILE * 16; /* half of all fine */
    b.copy.from = fv_arena_take(fv_arena(), "copied", most, 4096);
    b.copy.to = fv_arena_take(fv_arena(), "copied", most, 4096);
    memset(b.copy.from, 1, most);
    fv_flight_run(f, "");
    *result = (struct result){.full_ms = fv_flight_median(f, 0, fv_flight_frame_ms, 0),
                              .ms = fv_flight_median(f, MEDIUM, fv_flight_frame_ms, 0),
                              .speedup = fv_flight_speedup(f, MEDIUM),
                              .full_cpu_ms = fv_flight_median(f, 0, cpu_ms, 0),
                              .tracing_ms = fv_rank_quartiles(b.tracing_ms, frames),
                              .other_ms = fv_rank_quartiles(b.other_ms, frames),
                              .copy_ms = fv_rank_quartiles(b.copy_ms, frames),
                              .over_copy = fv_rank_quartiles(b.over_copy, frames),
                              .rays_full = fv_flight_mean(f, 0, fv_flight_rays, 0),
                              .rays = fv_flight_mean(f, MEDIUM, fv_flight_rays, 0),
                              .cpu_speedup = fv_flight_median(f, 0, cpu_ms, 0).value /
                                             fv_flight_median(f, MEDIUM, cpu_ms, 0).value,
                              .megabytes = b.bytes * 1e-6};
}

static void measure_apart(int light, struct result *result)
{
    int ends[2], status;
    assert_int_equal(pipe(ends), 0);
    pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        measure_light(light, result);
        _exit(write(ends[1], result, sizeof *result) == (ssize_t)sizeof *result ? 0 : 1);
    }
    close(ends[1]);
    ssize_t got = read(ends[0], result, sizeof *result);
    close(ends[0]);
    waitpid(child, &status, 0);
    assert_int_equal(status, 0);
    assert_int_equal(got, sizeof *result);
}

/* ---- the tables ---- */

static void print_spread(const struct fv_measured *m)
{
    print_message(" %.2f (%.2f to %.2f) |", m->value, m->low, m->high);
}

static void print_tables(const struct result *result)
{
    print_message("Sponza, medium foveal region, %d frames; medians and quartiles\n"
                  "| | rays, full | rays | full ms | reproject ms | speed-up | by CPU time | must be | paper |\n"
                  "| --- | --- | --- | --- | --- | --- | --- | --- | --- |\n",
                  frames);
    for (int i = 0; i < LIGHTS; i++) {
        const struct result *r = &result[i];
        print_message("| %s | %.2f M | %.3f M |", lights[i].name, r->rays_full * 1e-6, r->rays * 1e-6);
        print_spread(&r->full_ms);
        print_spread(&r->ms);
        print_spread(&r->speedup);
        print_message(" %.2f | %.1f | %.2f |\n", r->cpu_speedup, lights[i].must, lights[i].paper);
    }
    print_message("\nCPU ms of a frame; %% of full's by a point light, must be %.0f at most; times a copy, must be %.0f at "
                  "most\n| | full | tracing | other | %% | copy (MB) | other / copy |\n"
                  "| --- | --- | --- | --- | --- | --- | --- |\n",
                  100 * other_limit, copy_limit);
    for (int i = 0; i < LIGHTS; i++) {
        const struct result *r = &result[i];
        print_message("| %s |", lights[i].name);
        print_spread(&r->full_cpu_ms);
        print_spread(&r->tracing_ms);
        print_spread(&r->other_ms);
        print_message(" %.1f |", 100 * r->other_ms.value / result[0].full_cpu_ms.value);
        print_message(" %.2f (%.0f) |", r->copy_ms.value, r->megabytes);
        print_spread(&r->over_copy);
        print_message("\n");
    }
}

static void faster_than_the_paper(void **state)
{
    static struct result result[LIGHTS];
    (void)state;
    if (!fv_file_exists(FV_SOURCE_DIR "/../shared/data/scenes/sponza")) {
        print_message("Sponza is not in %s/../shared/data: skipped\n", FV_SOURCE_DIR);
        skip();
    }
    for (int i = 0; i < LIGHTS; i++) measure_apart(i, &result[i]);
    print_tables(result);
    if (frames < FRAMES_TRUSTED) {
        print_message("%d frames are too few to judge by: nothing is asserted\n", frames);
        return;
    }
    for (int i = 0; i < LIGHTS; i++) {
        assert_true(result[i].speedup.value >= lights[i].must);
        assert_true(result[i].other_ms.value <= other_limit * result[0].full_cpu_ms.value);
        assert_true(result[i].over_copy.value <= copy_limit);
    }
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(faster_than_the_paper)};
    if (argc > 1) frames = atoi(argv[1]);
    if (argc > 2 || frames < FRAMES_MIN || frames > FRAMES_MAX) {
        fprintf(stderr, "usage: bench_weier2016 [FRAMES, %d to %d]\n", FRAMES_MIN, FRAMES_MAX);
        return 2;
    }
    return cmocka_run_group_tests(tests, NULL, NULL);
}
