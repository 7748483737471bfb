/* left_out: what a scene without a feature pays for it. The program as planned against the same with a
 * tracing kernel that never had the feature (rt/trace/trace_kernel.c compiled without its bit), frames of
 * the same scene in turn, in thread CPU time of one worker; and the bytes that the arena gave. Printed as
 * a table, with what the feature costs where a scene has it. With the argument `short` it only checks:
 * every kernel gives the same bits on what it covers, and what is left out takes no memory. */
#include "platform/arena.h"
#include "rt/measure/rank.h"
#include "tests/support/room.h"

enum { REPEATS = 61, SIDE = 256, EVERYTHING = FV_FEATURES_ALL };
static const double limit = 1.05; /* planned over never had it: 1 but for noise */

typedef void trace_function(const struct fv_tracer *, const struct fv_view *, struct fv_samples *, uint32_t,
                            int64_t *);

#define DECLARE_ISA(feature, isa)                                                                            \
    void fv_trace_without_##feature##_##isa(const struct fv_tracer *, const struct fv_view *,                \
                                            struct fv_samples *, uint32_t, int64_t *);
#ifdef __x86_64__
#define DECLARE(feature) DECLARE_ISA(feature, base) DECLARE_ISA(feature, avx2) DECLARE_ISA(feature, avx512)
#define KERNELS(feature)                                                                                     \
    {                                                                                                        \
        fv_trace_without_##feature##_base, fv_trace_without_##feature##_avx2,                                \
            fv_trace_without_##feature##_avx512                                                              \
    }
#else
#define DECLARE(feature) DECLARE_ISA(feature, base)
#define KERNELS(feature)                                                                                     \
    {                                                                                                        \
        fv_trace_without_##feature##_base                                                                    \
    }
#endif
DECLARE(textures)
DECLARE(normal_maps)
DECLARE(alpha)
DECLARE(specular)
DECLARE(mirrors)
DECLARE(glass)
DECLARE(emission)
DECLARE(point_lights)
DECLARE(area_lights)
DECLARE(sun)
DECLARE(ao)
DECLARE(nothing)
DECLARE(all)

static const struct feature {
    const char *name;
    uint32_t bit;
    trace_function *without[FV_ISA_COUNT];
    const char *memory; /* row of the arena that it fills */
} features[] = {
    {"textures", FV_SCENE_TEXTURES, KERNELS(textures), "scene textures"},
    {"normal maps", FV_SCENE_NORMAL_MAPS, KERNELS(normal_maps), "scene textures"},
    {"alpha test", FV_SCENE_ALPHA, KERNELS(alpha), "scene textures"},
    {"Phong lobe", FV_SCENE_SPECULAR, KERNELS(specular), NULL},
    {"mirrors", FV_SCENE_MIRRORS, KERNELS(mirrors), NULL},
    {"glass", FV_SCENE_GLASS, KERNELS(glass), NULL},
    {"emission", FV_SCENE_EMISSIVE, KERNELS(emission), NULL},
    {"point light", FV_SCENE_POINT_LIGHTS, KERNELS(point_lights), NULL},
    {"area light", FV_SCENE_AREA_LIGHTS, KERNELS(area_lights), NULL},
    {"sun", FV_SCENE_SUN, KERNELS(sun), NULL},
    {"ambient occlusion", FV_SCENE_AO, KERNELS(ao), NULL},
};
enum { FEATURES = sizeof features / sizeof features[0] };

/* Kernels that have everything, and nothing but point lights. */
static trace_function *const with_everything[FV_ISA_COUNT] = KERNELS(nothing);
static trace_function *const with_points[FV_ISA_COUNT] = KERNELS(all);

struct spread {
    double low, median, high; /* quartiles */
};

static struct spread spread_of(double *value, int n)
{
    fv_rank_sort(value, n);
    return (struct spread){value[n / 4], value[n / 2], value[n - 1 - n / 4]};
}

/* A frame's CPU time with the planned kernels, or with `trace` in their place. */
static double frame_ms(struct room *r, trace_function *trace)
{
    static const struct fv_pose head = {{0, 0, 0}, {1, 0, 0, 0}};
    static const double gaze[2][3] = {{0, 0, -1}, {0, 0, -1}};
    const struct fv_kernels *planned = r->loop.frame.kernels;
    struct fv_kernels other = *planned;
    struct fv_frame_record record;
    if (trace) other.trace = trace;
    r->loop.frame.kernels = &other;
    r->loop.frame.number = 0; /* the same random numbers in every frame */
    fv_loop_frame(&r->loop, &head, gaze, 0, 0, &record);
    r->loop.frame.kernels = planned;
    return (double)record.cpu_ms;
}

/* The same without the loop's count of eyes: the tiles of one view. */
static double one_eye_ms(struct room *r)
{
    struct fv_frame *f = &r->loop.frame;
    int64_t start_ns = fv_clock_thread_ns();
    for (int i = 0; i < f->tiles_x * f->tiles_y; i++) {
        struct fv_tile tile = {.index = i, .x0 = i % f->tiles_x * FV_TILE, .y0 = i / f->tiles_x * FV_TILE};
        fv_pass_sample_all.run(f, &tile);
    }
    return (double)(fv_clock_thread_ns() - start_ns) * 1e-6;
}

/* Whose frames are compared: of `room`, with the planned kernels or with `trace`; `bare`: tiles of one view.
 */
struct side {
    struct room *room;
    trace_function *trace;
    bool bare;
};

static double side_ms(const struct side *s)
{
    return s->bare ? one_eye_ms(s->room) : frame_ms(s->room, s->trace);
}

/* Time of one side over that of the other, frame by frame in turn. `ms`: median of the first side's. */
static struct spread ratio(const struct side *one, const struct side *other, double *ms)
{
    double ratios[REPEATS], first[REPEATS], pair[2];
    for (int n = 0; n < REPEATS; n++) {
        for (int i = 0; i < 2; i++) pair[(n + i) % 2] = side_ms((n + i) % 2 ? other : one);
        first[n] = pair[0];
        ratios[n] = pair[0] / pair[1];
    }
    *ms = spread_of(first, REPEATS).median;
    return spread_of(ratios, REPEATS);
}

static struct fv_workers workers;

static int64_t planned_bytes(const struct room *r)
{
    int64_t bytes = 0;
    for (int i = 0; i < r->plan.rows; i++)
        if (r->plan.row[i].kept && strcmp(r->plan.row[i].what, "second eye") != 0)
            bytes += r->plan.row[i].bytes;
    return bytes;
}

/* A row: the scene `there` and the same without `left_out`, of which other[] never heard; eyes 2: the
 * second eye is left out instead. */
static struct spread measure(const char *name, uint32_t left_out, trace_function *const other[FV_ISA_COUNT],
                             int eyes)
{
    static struct room with, without;
    double ms, unused;
    room_open(&with, &workers, EVERYTHING, eyes, SIDE);
    room_open(&without, &workers, EVERYTHING & ~left_out, 1, SIDE);
    struct side planned = {.room = &without}, full = {.room = &with};
    struct side never = {
        .room = &without, .trace = other ? other[without.small.tracer.isa] : NULL, .bare = eyes == 2};
    struct spread s = ratio(&planned, &never, &ms), noise = ratio(&planned, &planned, &unused);
    struct spread cost = ratio(&full, &planned, &unused);
    print_message("| %s | %.2f | %.3f (%.3f to %.3f) | %.3f (%.3f to %.3f) | %.2f | %lld |\n", name, ms,
                  s.median, s.low, s.high, noise.median, noise.low, noise.high, cost.median,
                  (long long)(planned_bytes(&with) - planned_bytes(&without)));
    fv_tracer_close(&with.small.tracer);
    fv_tracer_close(&without.small.tracer);
    return s;
}

static void table(void **state)
{
    (void)state;
    double worst = 0;
    print_message("one worker, %s, %d x %d pixels, %d repeats; medians, quartiles\n",
                  fv_cpu_isa_name(fv_cpu_isa()), SIDE, SIDE, REPEATS);
    print_message(
        "| left out | ms | planned / never had it | planned / itself | with it / without | its bytes |\n");
    print_message("| --- | --- | --- | --- | --- | --- |\n");
    for (int i = 0; i < FEATURES; i++)
        worst = fmax(worst, measure(features[i].name, features[i].bit, features[i].without, 1).median);
    worst = fmax(worst, measure("all of these but points", EVERYTHING & ~(uint32_t)FV_SCENE_POINT_LIGHTS,
                                with_points, 1)
                            .median);
    worst = fmax(worst, measure("second eye", 0, NULL, 2).median);
    measure("nothing: the same kernel at another address", 0, with_everything, 1);
    assert_true(worst < limit);
}

static void trace_grid(struct room *r, trace_function *trace, struct fv_samples *samples)
{
    static const double at[3] = {0, 0, 0}, no_turn[4] = {1, 0, 0, 0};
    int64_t rays[FV_RAY_KINDS] = {0};
    struct fv_view view = small_view(at, no_turn, 45, 256);
    small_grid(samples, &view);
    trace(&r->small.tracer, &view, samples, 3, rays);
}

static void assert_same(const struct fv_samples *a, const struct fv_samples *b, const char *kernel,
                        const char *scene, int isa)
{
    const float *x[] = {a->red, a->green, a->blue, a->inverse_depth},
                *y[] = {b->red, b->green, b->blue, b->inverse_depth};
    for (int c = 0; c < 4; c++)
        if (memcmp(x[c], y[c], sizeof a->red) != 0)
            fail_msg("%s: tracing '%s' differs from tracing all (%s, channel %d)", scene, kernel,
                     fv_cpu_isa_name((enum fv_isa)isa), c);
}

/* A scene: every kernel that covers it against the one for all. */
static void compare_kernels(uint32_t there, const char *scene)
{
    static struct room room;
    static struct fv_samples all, other;
    room_open(&room, &workers, there, 1, 64);
    assert_int_equal(room.plan.variant, fv_variant_for(there));
    for (int isa = 0; isa <= (int)fv_cpu_isa(); isa++) {
        trace_grid(&room, fv_kernels((enum fv_isa)isa)->trace, &all);
        for (int v = 0; v < FV_VARIANTS; v++) {
            if (!fv_variant_shows((enum fv_variant)v, there)) continue;
            trace_grid(&room, fv_kernels_for((enum fv_isa)isa, (enum fv_variant)v)->trace, &other);
            assert_same(&all, &other, fv_variants[v].name, scene, isa);
        }
        for (int f = 0; f < FEATURES; f++) {
            if (there & features[f].bit) continue;
            trace_grid(&room, features[f].without[isa], &other);
            assert_same(&all, &other, features[f].name, scene, isa);
        }
    }
    fv_tracer_close(&room.small.tracer);
}

static void every_kernel_gives_the_same_bits(void **state)
{
    (void)state;
    compare_kernels(FV_SCENE_POINT_LIGHTS, "points");
    compare_kernels(FV_FEATURES_PLAIN, "plain");
    compare_kernels(FV_FEATURES_TEXTURED, "textured");
    compare_kernels(FV_FEATURES_MIRRORED, "mirrored");
    compare_kernels(EVERYTHING, "everything");
    for (int f = 0; f < FEATURES; f++) {
        compare_kernels(FV_SCENE_SUN | features[f].bit, features[f].name);
        compare_kernels(EVERYTHING & ~features[f].bit, features[f].name);
    }
}

/* Bytes that the arena gives under a name while the room opens. */
static size_t bytes_taken(uint32_t there, int eyes, const char *name)
{
    static struct room room;
    size_t before = fv_arena_bytes(fv_arena(), name);
    room_open(&room, &workers, there, eyes, 64);
    fv_tracer_close(&room.small.tracer);
    return fv_arena_bytes(fv_arena(), name) - before;
}

static void what_is_left_out_takes_no_memory(void **state)
{
    (void)state;
    static const char *const names[] = {"scene textures",  "scene materials", "scene indices",
                                        "scene triangles", "scene vertices",  "colour",
                                        "depth",           "history colour",  "picture"};
    size_t plain[sizeof names / sizeof names[0]];
    for (unsigned i = 0; i < sizeof names / sizeof names[0]; i++)
        plain[i] = bytes_taken(FV_SCENE_SUN, 1, names[i]);
    assert_int_equal(plain[0], 0);
    assert_int_equal(plain[6] + plain[7] + plain[8], 0);
    for (int f = 0; f < FEATURES; f++)
        for (unsigned i = 0; i < sizeof names / sizeof names[0]; i++) {
            size_t bytes = bytes_taken(FV_SCENE_SUN | features[f].bit, 1, names[i]);
            bool more = features[f].memory && strcmp(features[f].memory, names[i]) == 0;
            if (more ? bytes < 100000 : bytes > plain[i] + 4095 || bytes + 4095 < plain[i]) /* alignment */
                fail_msg("%s: %zu bytes of %s, %zu without", features[f].name, bytes, names[i], plain[i]);
        }
    assert_in_range(bytes_taken(FV_SCENE_SUN, 2, "colour"), plain[5] * 2 - 8192, plain[5] * 2 + 8192);
}

static int start_worker(void **state)
{
    (void)state;
    return fv_workers_start(&workers, 1) != 1;
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(every_kernel_gives_the_same_bits),
                                       cmocka_unit_test(what_is_left_out_takes_no_memory)};
    const struct CMUnitTest bench[] = {cmocka_unit_test(table)};
    int failed = cmocka_run_group_tests(tests, start_worker, NULL);
    if (argc > 1 && strcmp(argv[1], "short") == 0) return failed;
    return failed + cmocka_run_group_tests(bench, NULL, NULL);
}
