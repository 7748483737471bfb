/* paced: the real loop, pace, budget, schedule and control over made-up frames: passes whose tiles do nothing
 * but move a made-up clock on (tests/support/plant.h).
 *
 * paced [N]: N frames of each plant, 4000 by default; the label soak runs 1e6. */
#include "platform/arena.h"
#include "rt/frame/loop.h"
#include "rt/pass/reproject.h"
#include "tests/support/plant.h"
#include "tests/support/program.h"

#define COUNT(table) (sizeof table / sizeof table[0])
enum { SIZE = 768, STAGES = 4, RECORDS = 8 };
static int64_t frames_of_each = 4000;

/* One worker does what two would do of the full picture, in proportion. */
static const double scale = 2 * 1182 * 1464.0 / (SIZE * SIZE) / 2;

/* The machine that the frames run on. */
static struct machine {
    struct fv_loop loop;
    struct fv_session session;
    plant_function *function;
    struct plant plant; /* of the frame under way */
    int64_t frame, now_ns, cpu_ns, jump_ns;
    double stage_noise[STAGES], came;
    int tiles, preempted_at; /* worked at in this frame; before which of them the worker is stopped */
    int64_t skipped;         /* the session's, before this frame */
    struct plant_numbers numbers;
} m;

/* Shows what the machine is doing by numbers that may be none. */
static int64_t now_ns(void *context)
{
    (void)context;
    return m.now_ns + m.jump_ns;
}

static int64_t thread_ns(void *context)
{
    (void)context;
    double odd =
        plant_chance() < m.plant.lies ? plant_measured(&(struct plant){.lies = 1}, 0) : (double)m.cpu_ns;
    return fabs(odd) < 1e17 ? (int64_t)odd : 0;
}

static void sleep_until_ns(void *context, int64_t t_ns)
{
    (void)context;
    if (t_ns - m.jump_ns > m.now_ns) m.now_ns = t_ns - m.jump_ns;
}

static const struct fv_clock clock_made_up = {now_ns, thread_ns, sleep_until_ns, NULL};

static void spend(double ns)
{
    int64_t whole_ns = llround(ns);
    m.now_ns += whole_ns;
    m.cpu_ns += whole_ns;
}

static int work(int stage, int units, double unit_ns)
{
    if (m.tiles++ == m.preempted_at) {
        m.now_ns += llround(m.plant.preempted_ns);
        if (plant_chance() < m.plant.jumps) m.jump_ns = llround(random_between(&plant_random, -3e8, 3e8));
    }
    spend(units * unit_ns * m.stage_noise[stage] * scale);
    return units;
}

static int support_tile(struct fv_frame *f, const struct fv_tile *tile)
{
    int side = FV_TILE / f->spacing;
    bool due = !f->has_history || (tile->index + f->number) % f->support_refresh == 0;
    return work(1, due ? side * side : 0, plant_node_ns);
}

static float eccentricity_deg(const struct fv_tile *tile)
{
    return m.loop.budget.schedule.eccentricity_deg[tile->index];
}

/* As coarse as the real pass makes it. */
static int select_tile(struct fv_frame *f, const struct fv_tile *tile)
{
    f->state[tile->index].density = (uint8_t)fv_ring_density(f, &f->parameters, eccentricity_deg(tile));
    return work(0, 1, plant_select_ns);
}

static bool whole(const struct fv_frame *f, const struct fv_tile *tile)
{
    const struct fv_foveal *p = &f->parameters.foveal;
    return !f->has_history || p->p_min >= 1 ||
           eccentricity_deg(tile) <= p->r0_deg - fv_radius_deg(&f->view[0], FV_TILE);
}

static int reproject_tile(struct fv_frame *f, const struct fv_tile *tile)
{
    int side = fv_tile_side(tile);
    if (!f->has_history || (whole(f, tile) && !f->keep)) return 0;
    return work(2, side * side, plant_pixel_ns);
}

static int sample_tile(struct fv_frame *f, const struct fv_tile *tile)
{
    const struct plant *p = &m.plant;
    int pixels = fv_tile_side(tile) * fv_tile_side(tile);
    float share = fv_foveal_probability(&f->parameters.foveal, eccentricity_deg(tile));
    share = fv_block_probability(f, share, tile->density, f->spacing);
    double came = pixels * fv_reproject_share(f, share, fv_resample_probability(f, &f->parameters, tile->density)) * m.came;
    double price = p->rays * p->wrong[f->parameters.spp];
    if (whole(f, tile)) return work(3, pixels, plant_dense_ns * price);
    int units = (int)(came + plant_chance());
    return work(3, units < pixels ? units : pixels - 1, plant_sparse_ns * price);
}

static void no_nodes(struct fv_frame *f, const struct fv_tile *tile)
{
    (void)f, (void)tile;
    spend(0.05 * plant_node_ns * scale);
}

static void no_pixels(struct fv_frame *f, const struct fv_tile *tile)
{
    (void)f, (void)tile;
    spend(0.1 * FV_TILE * FV_TILE * plant_pixel_ns * scale);
}

static void no_samples(struct fv_frame *f, const struct fv_tile *tile)
{
    (void)f, (void)tile;
    spend(20 * scale);
}

static struct fv_pass passes[STAGES];
static struct fv_method method;

/* The levels of the real method; samples a pixel, which made-up tiles have no use for, say which level it is.
 */
static void parameters(const struct fv_config *config, int level, struct fv_parameters *out)
{
    fv_method_find("reproject")->parameters(config, level, out);
    out->spp = level < PLANT_LEVELS ? level : 0;
}

/* The real passes: their orders, their expectations; only the work is not. */
static void make_method(void)
{
    method = *fv_method_find("reproject");
    assert_true(method.pass[STAGES] == NULL);
    method.parameters = parameters;
    static int (*const run[STAGES])(struct fv_frame *, const struct fv_tile *) = {
        select_tile, support_tile, reproject_tile, sample_tile};
    static void (*const stand_in[STAGES])(struct fv_frame *,
                                          const struct fv_tile *) = {NULL, no_nodes, no_pixels, no_samples};
    for (int i = 0; i < STAGES; i++) {
        passes[i] = *method.pass[i];
        assert_true(!passes[i].stand_in == !stand_in[i]);
        passes[i].run = run[i];
        passes[i].stand_in = stand_in[i];
        method.pass[i] = &passes[i];
    }
}

/* A frame begins: what it is like, and where the eye looks. */
static void latch(void *context, int64_t latched_ns, int64_t show_ns, struct fv_pose *head, double gaze[2][3],
                  double *uncertainty_deg)
{
    (void)context, (void)latched_ns, (void)show_ns;
    m.plant = plant_at(m.function, m.frame);
    for (int i = 0; i < STAGES; i++) m.stage_noise[i] = plant_noise(&m.plant);
    m.came = m.plant.came * plant_noise(&m.plant);
    m.tiles = 0;
    m.preempted_at = (int)(plant_chance() * 1800);
    *head = (struct fv_pose){.rotation = {1, 0, 0, 0}};
    for (int e = 0; e < 2; e++) {
        gaze[e][0] = m.function == plant_saccades && !m.plant.dear_region ? 0.6 : 0;
        gaze[e][1] = 0;
        gaze[e][2] = -0.8;
    }
    *uncertainty_deg = 0.3;
}

/* Presenting is what a frame takes besides its stages. */
static bool wants(void *context, int64_t frame, bool last)
{
    (void)context, (void)frame, (void)last;
    if (m.plant.other_ns > 0) {
        spend(m.plant.other_ns);
        fv_budget_presented(&m.loop.budget, m.plant.other_ns);
    }
    return false;
}

static void present(void *context, const struct fv_frame *frame)
{
    (void)context, (void)frame;
    fail_msg("presented, though not wanted");
}

/* A display 0.4 % slower than the settings say, whose refreshes fall where they will. */
static const int64_t display_period_ns = 66933333, display_phase_ns = 12345678, display_lead_ns = 2000000;
static bool follows;

static bool beat(void *context, struct fv_beat *of)
{
    (void)context;
    int64_t now = now_ns(NULL), since_ns = now - display_phase_ns;
    if (!follows || since_ns < 0) return false;
    *of = (struct fv_beat){now - since_ns % display_period_ns, display_period_ns, display_lead_ns};
    return true;
}

/* Frames are meant for the middles of the display's scan-outs. */
static void check_display(const struct fv_frame_record *r)
{
    int64_t begins_ns = m.loop.pace.epoch_ns + r->t_ns - display_period_ns / 2 - display_phase_ns;
    if (m.frame > 0 && begins_ns % display_period_ns != 0)
        fail_msg("frame %lld: %lld ns after a refresh", (long long)m.frame, (long long)(begins_ns % display_period_ns));
}

static bool after(void *context, const struct fv_session *session, const struct fv_frame_record *r)
{
    (void)context;
    const struct fv_control *c = &m.loop.budget.control;
    bool missed = session->skipped - m.skipped - (r->periods - 1) > 0;
    m.skipped = session->skipped;
    if (r->level < c->first || r->level > c->last || r->periods < 1 || r->periods > 4)
        fail_msg("frame %lld: level %d, %d periods", (long long)m.frame, r->level, r->periods);
    assert_true(isfinite(r->predicted_ms) && r->predicted_ms >= 0 && isfinite(r->budget_ms));
    plant_count(&m.numbers, m.frame, r->level,
                ((double)r->frame_ms * 1e6 + m.plant.other_ns) / (r->periods * plant_period_ns), r->cut,
                r->cut, missed);
    if (follows) check_display(r);
    m.frame++;
    return true;
}

static struct plant_numbers run(plant_function *function, const struct fv_config *config)
{
    static const struct fv_loop_io io = {.latch = latch, .wants = wants, .present = present, .after = after, .beat = beat};
    static struct fv_workers workers;
    static struct fv_scene scene = {.name = "made up"};
    static const struct fv_tracer tracer = {.data = &scene, .isa = FV_ISA_BASE};
    struct fv_plan plan = {.method = &method, .passes = STAGES, .history = true, .workers = 1};
    for (int i = 0; i < STAGES; i++) plan.pass[i] = method.pass[i];
    m = (struct machine){.function = function, .now_ns = 1};
    plant_random = 1;
    fv_workers_start(&workers, 1);
    fv_loop_open(&m.loop, config, &plan, &tracer, &workers, &m.session, RECORDS);
    m.loop.clock = m.loop.budget.schedule.clock = &clock_made_up;
    fv_loop_run(&m.loop, &io, frames_of_each);
    return m.numbers;
}

/* The level of saccades swings with them and need not settle. Another cost that grows and a clock that jumps are too late by one frame, as one step in many is. */
static const struct plant_limits plants[] = {
    {"constant", plant_constant, 0, 2, true},
    {"constant, heavy tails", plant_tails, 2, 2, true},
    {"eleven prices", plant_prices, 0, 10, true},
    {"ramp x10, /10", plant_ramp, 0, 200, false},
    {"steps x10, /10", plant_steps, 0.5, 15, true},
    {"single spikes", plant_spikes, 0, 2, true},
    {"preemption", plant_preemption, 2, 10, true},
    {"CPU-bound", plant_cpu_bound, 10, 10, true},
    {"random walk", plant_walk, 0, 150, false},
    {"saccades", plant_saccades, 0, 400, false},
    {"a level x3", plant_wrong_level, 0, 10, true},
    {"rays x3, /3", plant_wrong_units, 0, 15, true},
    {"CPU times that are none", plant_lies, 0, 20, false},
    {"clock jumps", plant_jumps, 400, 100, false},
};

static const struct fv_config *settings(void)
{
    static struct fv_config config;
    const struct fv_config_request request = {
        .sets = 11,
        .set = {"budget.adapt=on", "budget.pace=vsync", "budget.periods=4", "budget.hz=15", "display.eyes=1",
                "display.width=768", "display.height=768", "display.fov_in_deg=45", "display.fov_out_deg=45",
                "display.fov_up_deg=45", "display.fov_down_deg=45"}};
    struct fv_error error;
    if (fv_config_load(&config, &request, &error)) fail_msg("%s", error.text);
    make_method();
    return &config;
}

static void plants_hold(void **state)
{
    const struct fv_config *config = settings();
    int failed = 0;
    (void)state;
    follows = false;
    plant_report_head();
    for (unsigned i = 0; i < COUNT(plants); i++) {
        struct plant_numbers r = run(plants[i].function, config);
        failed += !plant_report(&plants[i], &r);
    }
    assert_int_equal(failed, 0);
}

static void display_followed(void **state)
{
    (void)state;
    follows = true;
    int64_t most = frames_of_each;
    frames_of_each = 2000;
    run(plant_constant, settings());
    frames_of_each = most;
    assert_int_equal(m.frame, 2000);
    assert_true(m.session.skipped <= 2);
    int64_t took_ns = now_ns(NULL) - 2000 * display_period_ns;
    assert_true(llabs(took_ns) <= 4 * display_period_ns);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(plants_hold), cmocka_unit_test(display_followed)};
    if (argc > 1) frames_of_each = strtoll(argv[1], NULL, 10);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
