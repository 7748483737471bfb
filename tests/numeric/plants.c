/* plants: the controller in a loop with made-up frames, which are stages, levels and a deadline and nothing
 * else (tests/support/plant.h): what it does when costs jump, creep, spike and lie.
 *
 * plants [N]: N frames of each plant, 20000 by default; the label soak runs 1e6. */
#include "rt/frame/control.h"
#include "tests/support/plant.h"
#include "tests/support/program.h"

#define COUNT(table) (sizeof table / sizeof table[0])
enum { SELECT, SUPPORT, REPROJECT, RAYS, STAGES, LAST = 7, WORKERS = 2, TILES = 3404 };
static int64_t frames_of_each = 20000;

/* Work of a level: radii of 10 and 20 degrees and p_min from 1 down, then smaller radii, then a coarser
 * support image. */
static struct fv_work work_of(int level, bool dear_region)
{
    static const double p_min[] = {1, 0.4, 0.2, 0.1, 0.05, 0.02, 0.01, 0.01};
    static const double radius[] = {1, 1, 1, 1, 1, 1, 0.6, 0.26};
    static const double within = 0.035, ring = 0.1; /* of all pixels: within r0, between the radii */
    double area = radius[level] * radius[level], p = p_min[level], far = 1 - (within + ring) * area;
    double pixels = plant_pixels * (dear_region ? 2 : 1);
    struct fv_work work = {{0}};
    work.units[2 * SELECT] = TILES;
    work.units[2 * SUPPORT] = plant_pixels / (level == LAST ? 256 : 64);
    work.units[2 * REPROJECT] = level ? plant_pixels : 0;
    work.units[2 * RAYS] = level ? pixels * (ring * area * (1 + p) / 2 + far * p) : 0;
    work.units[2 * RAYS + 1] = level ? pixels * within * area : pixels;
    return work;
}

/* The least: no rays but the fovea's. */
static struct fv_work least_of(void)
{
    struct fv_work work = work_of(LAST, false);
    work.units[2 * RAYS] = 0;
    return work;
}

/* Leaves out of one cost what must be left out to save over_ns of wall time; returns what is saved. */
static double leave_out(struct fv_cost_sample *s, int cost, double least, double over_ns)
{
    double units = s->done.units[cost], ns = s->cpu_ns[cost];
    double can_ns = units > least ? (1 - least / units) * ns / WORKERS : 0, saved_ns = fmin(over_ns, can_ns);
    if (!(saved_ns > 0)) return 0;
    s->done.units[cost] *= 1 - saved_ns * WORKERS / ns;
    s->cpu_ns[cost] -= saved_ns * WORKERS;
    s->cut = true;
    return saved_ns;
}

/* One frame, cut at its deadline: what it cost. Returns the wall time that it would have taken uncut. */
static double render(const struct plant *p, int level, double deadline_ns, struct fv_cost_sample *s)
{
    static const double unit_ns[] = {plant_select_ns, plant_select_ns, plant_node_ns,   plant_node_ns,
                                     plant_pixel_ns,  plant_pixel_ns,  plant_sparse_ns, plant_dense_ns};
    static const int last_first[] = {2 * RAYS, 2 * RAYS + 1, 2 * REPROJECT};
    struct fv_work least = least_of();
    double whole_ns = p->preempted_ns;
    *s = (struct fv_cost_sample){.level = level, .expected = work_of(level, p->dear_region)};
    for (int k = 0; k < 2 * STAGES; k++) {
        bool rays = k / 2 == RAYS;
        s->done.units[k] = s->expected.units[k] * (rays ? p->came * plant_noise(p) : 1);
        s->cpu_ns[k] =
            s->done.units[k] * unit_ns[k] * (rays ? p->rays * p->wrong[level] : 1) * plant_noise(p);
        whole_ns += s->cpu_ns[k] / WORKERS * plant_noise(p);
    }
    s->wall_ns = whole_ns;
    for (unsigned i = 0; i < COUNT(last_first); i++)
        s->wall_ns -=
            leave_out(s, last_first[i], i < 2 ? least.units[last_first[i]] : 0, s->wall_ns - deadline_ns);
    for (int k = 0; k < 2 * STAGES; k++) s->total_cpu_ns += s->cpu_ns[k];
    return whole_ns;
}

static void distort(const struct plant *p, struct fv_cost_sample *s)
{
    for (int k = 0; k < 2 * STAGES; k++) s->cpu_ns[k] = plant_measured(p, s->cpu_ns[k]);
    s->wall_ns = plant_measured(p, s->wall_ns);
    s->total_cpu_ns = plant_measured(p, s->total_cpu_ns);
    if (plant_chance() < p->jumps) s->wall_ns += random_between(&plant_random, -3.6e12, 3.6e12);
}

static struct plant_numbers run(plant_function *function, double price, int64_t frames)
{
    struct fv_control c;
    struct fv_cost_sample late[3];
    struct fv_work expected[LAST + 1], least = least_of();
    struct plant_numbers r = {0};
    plant_random = 1;
    fv_control_open(&c, 0, LAST, WORKERS, 0.1);
    for (int64_t n = 0; n < frames; n++) {
        struct plant p = plant_at(function, n);
        struct fv_cost_sample s;
        p.rays *= price;
        for (int i = 0; i <= LAST; i++) expected[i] = work_of(i, p.dear_region);
        int level = fv_control_choose(&c, expected, &least, plant_period_ns, p.other_ns, p.periods_max);
        if (level < 0 || level > LAST || c.periods < 1 || c.periods > p.periods_max)
            fail_msg("frame %lld: level %d, %d periods", (long long)n, level, c.periods);
        double given_ns = c.periods * plant_period_ns, deadline_ns = given_ns - p.other_ns;
        double whole_ns = render(&p, level, deadline_ns, &s);
        plant_count(&r, n, level, (s.wall_ns + p.other_ns) / given_ns, whole_ns > deadline_ns, s.cut,
                    s.wall_ns > deadline_ns + 1);
        distort(&p, &s);
        late[n % 3] = s;
        if (n >= p.delay) fv_control_learn(&c, &late[(n - p.delay) % 3]);
    }
    return r;
}

static const struct plant_limits plants[] = {
    {"constant", plant_constant, 0, 2, true},           {"constant, heavy tails", plant_tails, 2, 2, true},
    {"eleven prices", plant_prices, 0, 5, true},        {"ramp x10, /10", plant_ramp, 0, 140, false},
    {"steps x10, /10", plant_steps, 0, 2, true},        {"single spikes", plant_spikes, 0, 2, true},
    {"preemption", plant_preemption, 0, 2, true},       {"CPU-bound", plant_cpu_bound, 0, 5, true},
    {"random walk", plant_walk, 0, 100, false},         {"saccades", plant_saccades, 0, 400, true},
    {"a level x3", plant_wrong_level, 0, 5, true},      {"rays x3, /3", plant_wrong_units, 0, 10, true},
    {"steps, seen 2 late", plant_delayed, 0, 20, true}, {"NaN, 0, < 0", plant_lies, 0, 2, true},
    {"clock jumps", plant_jumps, 0, 2, true},
};

static void plants_hold(void **state)
{
    (void)state;
    int failed = 0;
    plant_report_head();
    for (unsigned i = 0; i < COUNT(plants); i++) {
        struct plant_numbers r = run(plants[i].function, 1, frames_of_each);
        failed += !plant_report(&plants[i], &r) || r.missed_run > 1;
    }
    assert_int_equal(failed, 0);
}

/* Whatever the prices, so that levels lie anywhere in the budget. */
static void constant_load_is_left_alone(void **state)
{
    (void)state;
    static plant_function *const shapes[] = {plant_constant, plant_tails};
    for (unsigned i = 0; i < COUNT(shapes); i++) {
        int64_t most = 0, sum = 0;
        for (int k = 0; k < 25; k++) {
            struct plant_numbers r = run(shapes[i], pow(1.2, k - 10), 10000);
            sum += r.changes;
            if (r.changes > most) most = r.changes;
        }
        print_message("%s noise: %.2f level changes in 10,000 frames, at most %lld\n",
                      i ? "heavy-tailed" : "even", (double)sum / 25, (long long)most);
        assert_true(most <= 2);
    }
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(plants_hold),
                                       cmocka_unit_test(constant_load_is_left_alone)};
    if (argc > 1) frames_of_each = strtoll(argv[1], NULL, 10);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
