/* plant: what made-up frames are like: costs that jump, creep, spike and lie, for tests of the controller.
 * For tests only. Prices are Sponza's at 2 x 1182 x 1464 pixels, CPU time; see README. */
#ifndef FV_TESTS_PLANT_H
#define FV_TESTS_PLANT_H

#include "tests/support/random.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>

#define PLANT_PI 3.14159265358979323846

enum { PLANT_SEGMENT = 500, PLANT_LEVELS = 16 }; /* frames between changes of what a plant is like */

static const double plant_period_ns = 200e6 / 3, plant_pixels = 2 * 1182 * 1464.0;
static const double plant_select_ns = 400, plant_node_ns = 370, plant_pixel_ns = 12, plant_dense_ns = 90,
                    plant_sparse_ns = 150;

/* What a frame is like. */
struct plant {
    double rays;                /* CPU time of a ray: factor */
    double came;                /* rays that there are over those that are expected */
    bool dear_region;           /* looked at: twice the rays, which is known beforehand */
    double wrong[PLANT_LEVELS]; /* CPU time of a level's rays: factor */
    double noise;               /* of every measurement, +- */
    bool tails;                 /* of which shape; see plant_noise */
    double preempted_ns;        /* wall time that is lost */
    double other_ns;            /* that the frame takes besides its stages */
    double lies;                /* share of measurements that are none */
    double jumps;               /* share of frames in which the clock jumps */
    int delay;                  /* frames until a measurement arrives */
    int periods_max;
};

static uint64_t plant_random;

static inline double plant_chance(void)
{
    return random_between(&plant_random, 0, 1);
}

static inline double plant_normal(void)
{
    return sqrt(-2 * log(1 - plant_chance())) * cos(2 * PLANT_PI * plant_chance());
}

/* Factor on a measurement: even, or Student's t of three degrees of freedom, a hundredth of which lies beyond
 * 5.8 times its scale, half the noise. */
static inline double plant_noise(const struct plant *p)
{
    if (!p->tails) return 1 + p->noise * (2 * plant_chance() - 1);
    double a = plant_normal(), b = plant_normal(), c = plant_normal();
    return fmax(0.5, 1 + 0.5 * p->noise * plant_normal() / sqrt((a * a + b * b + c * c) / 3));
}

typedef void plant_function(struct plant *p, int64_t frame);

static inline void plant_constant(struct plant *p, int64_t n)
{
    (void)p, (void)n;
}

static inline void plant_tails(struct plant *p, int64_t n)
{
    (void)n;
    p->tails = true;
}

static inline void plant_prices(struct plant *p, int64_t n)
{
    p->rays = pow(1.3, (double)(n / PLANT_SEGMENT % 11) - 5);
}

static inline void plant_ramp(struct plant *p, int64_t n)
{
    p->rays = pow(10, 0.2 - 0.5 * cos((double)n * 2 * PLANT_PI / PLANT_SEGMENT));
}

static inline void plant_steps(struct plant *p, int64_t n)
{
    p->rays = n / PLANT_SEGMENT % 2 ? 5 : 0.5;
}

static inline void plant_spikes(struct plant *p, int64_t n)
{
    if (n % 97 == 50) p->rays = 10;
}

static inline void plant_preemption(struct plant *p, int64_t n)
{
    if (n % (2 + n / PLANT_SEGMENT % 49) == 0) p->preempted_ns = 0.15 * plant_period_ns;
}

static inline void plant_cpu_bound(struct plant *p, int64_t n)
{
    p->other_ns = (0.3 + 0.1 * (double)(n / PLANT_SEGMENT % 10)) * plant_period_ns;
    p->periods_max = 4;
}

static inline void plant_walk(struct plant *p, int64_t n)
{
    static double at;
    if (n == 0) at = 0;
    at = fmin(fmax(at + 0.1 * (plant_chance() + plant_chance() - 1), log(0.3)), log(5));
    p->rays = exp(at);
}

static inline void plant_saccades(struct plant *p, int64_t n)
{
    static int64_t until;
    static bool dear;
    if (n == 0) until = 0, dear = false;
    if (n >= until) until = n + 20 + (int64_t)(60 * plant_chance()), dear = !dear;
    p->dear_region = dear;
    if (dear) p->rays = 1.5;
}

static inline void plant_wrong_level(struct plant *p, int64_t n)
{
    int64_t segment = n / PLANT_SEGMENT;
    p->rays = pow(1.3, (double)(segment / 8 % 6) - 3);
    p->wrong[segment % 8] = 3;
}

static inline void plant_wrong_units(struct plant *p, int64_t n)
{
    static const double came[] = {1, 3, 0.33};
    p->came = came[n / PLANT_SEGMENT % 3];
}

static inline void plant_delayed(struct plant *p, int64_t n)
{
    plant_steps(p, n);
    p->delay = 2;
}

static inline void plant_lies(struct plant *p, int64_t n)
{
    (void)n;
    p->lies = 0.1;
}

static inline void plant_jumps(struct plant *p, int64_t n)
{
    (void)n;
    p->jumps = 0.05;
}

static inline struct plant plant_at(plant_function *function, int64_t n)
{
    struct plant p = {.rays = 1, .came = 1, .noise = 0.1, .periods_max = 1};
    for (int i = 0; i < PLANT_LEVELS; i++) p.wrong[i] = 1;
    function(&p, n);
    return p;
}

/* A measurement that may be none. */
static inline double plant_measured(const struct plant *p, double value)
{
    static const double odd[] = {NAN, 0, -1e6, INFINITY, -INFINITY, 1e300, -0.0, 1};
    return plant_chance() < p->lies ? odd[random_bits(&plant_random) % (sizeof odd / sizeof odd[0])] : value;
}

/* What is counted of a run. */
struct plant_numbers {
    int64_t frames, over, cut, missed, missed_run, changes;
    double level, used;
    int64_t settled; /* frames into a segment until the level was within one of where it ends, at worst */
    int64_t segments, slow; /* slow ones: more than ten */
    int missed_now, level_at[PLANT_SEGMENT];
};

/* A frame at `level`, which took `used` of its budget: would have gone `over` it but for the cut, `missed`
 * its deadline. Changes of level count, but for the first ten frames after what the plant is like has
 * changed. */
static inline void plant_count(struct plant_numbers *r, int64_t n, int level, double used, bool over,
                               bool cut, bool missed)
{
    int into = (int)(n % PLANT_SEGMENT), i = into;
    r->frames++;
    r->over += over;
    r->cut += cut;
    r->missed += missed;
    r->missed_now = missed ? r->missed_now + 1 : 0;
    if (r->missed_now > r->missed_run) r->missed_run = r->missed_now;
    r->changes += into > 10 && level != r->level_at[into - 1];
    r->level_at[into] = level;
    r->level += level;
    r->used += used;
    if (into < PLANT_SEGMENT - 1) return;
    while (i > 0 && abs(r->level_at[i - 1] - level) <= 1) i--;
    if (i > r->settled) r->settled = i;
    r->segments++;
    r->slow += i > 10;
}

/* What a plant may do in 10,000 frames: deadlines missed; levels changed later than ten frames after what it
 * is like has changed. `settles`: one in a hundred times may it take longer than ten frames until the level
 * is within one of where it ends. In all of them frames must use half of their budget on average, so that
 * being too careful is a fault too, and at most one in twenty may be cut. */
struct plant_limits {
    const char *what;
    plant_function *function;
    double missed, changes;
    bool settles;
};

/* Prints a row; true where the limits hold. */
static inline bool plant_report(const struct plant_limits *of, const struct plant_numbers *r)
{
    double all = (double)r->frames, each = 1e4 / all, limits = fmax(1, 1e-4 * all);
    bool fine = (double)r->missed <= limits * of->missed && (double)r->changes <= limits * of->changes &&
                r->used >= 0.5 * all && (double)r->cut <= 0.05 * all &&
                (!of->settles || r->slow <= r->segments / 100);
    char settled[16] = "-";
    if (of->settles) snprintf(settled, sizeof settled, "%lld", (long long)r->settled);
    printf("%-24s %8.2f %8.2f %9.3f %9.1f %7.2f %8.1f %8s%s\n", of->what, 100 * (double)r->over / all,
           100 * (double)r->cut / all, 100 * (double)r->missed / all, (double)r->changes * each,
           r->level / all, 100 * r->used / all, settled, fine ? "" : "  too much");
    return fine;
}

static inline void plant_report_head(void)
{
    printf("%-24s %8s %8s %9s %9s %7s %8s %8s\n", "plant", "over, %", "cut, %", "missed, %", "changes",
           "level", "used, %", "settled");
}

#endif
