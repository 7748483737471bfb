/* control: see control.h. Two halves: learning, from one sample a frame, and choosing. */
#include "rt/frame/control.h"

#include <assert.h>
#include <math.h>

/* Beyond these no number is a measurement: 11 days, and units of a frame. They keep every product finite. */
static const double time_max_ns = 1e15, units_max = 1e15, price_max_ns = 1e12, stretch_max = 14;
static const double factor_max = 16, correction_max = 2;

static const double room = 0.9;              /* share of the budget that a raise may be predicted to take */
static const double sparse_dense = 1.6;      /* price of a sparse unit over a dense one, until it is known */
static const double dearer_min = 1.1;        /* a level that is dearer by less is not told from noise */
static const double moved_ratio = 1.25;      /* conditions have changed */
static const double enough_share = 1.0 / 32; /* of a stage's work */
static const double later_max = 1.15;        /* caution for a level that was well for long */
static const double fade = 1.0 / 128;
static const struct fv_level_memory blank = {.factor = {1, 1, 1}, .caution = 1};
enum { QUIET_FRAMES = 3, CUTS_MAX = 8, MEMORY_FRAMES = 10000, TRIAL_FRAMES = 16 };

static double within(double value, double low, double high)
{
    return value < low ? low : value > high ? high : value;
}

static int least_of(int a, int b)
{
    return a < b ? a : b;
}

/* The value, 0 where it is not finite, not above 0 or beyond `most`. */
static double sound(double value, double most)
{
    return value > 0 && value <= most ? value : 0;
}

static double median(const double v[3])
{
    return fmax(fmin(v[0], v[1]), fmin(fmax(v[0], v[1]), v[2]));
}

static double largest_of(const double v[3])
{
    return fmax(fmax(v[0], v[1]), v[2]);
}

/* Puts a value among the recent; false where it is none. The first three are held at once. */
static bool remember(struct fv_peak *peak, double value)
{
    double *r = peak->recent;
    if (!(value > 0 && isfinite(value))) return false;
    r[2] = r[1];
    r[1] = r[0];
    r[0] = value;
    if (peak->count == 3) return true;
    peak->held = peak->count++ == 0 ? value : median(r);
    return false;
}

void fv_peak_learn(struct fv_peak *peak, double value)
{
    if (!remember(peak, value)) return;
    double middle = median(peak->recent), largest = largest_of(peak->recent);
    if (middle > peak->held) peak->held = middle;
    else if (largest < 0.8 * peak->held) peak->held = largest;
    else peak->held -= (peak->held - middle) * fade;
}

/* Not the peak but the mean: without the spikes, and with steps. */
static void learn_mean(struct fv_peak *peak, double value)
{
    if (!remember(peak, value)) return;
    double middle = median(peak->recent), largest = largest_of(peak->recent);
    if (middle > 1.2 * peak->held) peak->held = middle;
    else if (largest < 0.8 * peak->held) peak->held = largest;
    else peak->held += (middle - peak->held) / 16;
}

/* For a peak that nothing was measured for: what is held loses its hold, so that work that is too dear to be
 * tried does not stay so for ever. */
static void fade_towards(struct fv_peak *peak, double guess)
{
    if (peak->count == 0) return;
    peak->held += (guess - peak->held) * fade;
    for (int i = 0; i < 3; i++) peak->recent[i] = peak->held;
}

/* A price that was not measured goes with the other one of its stage, which was held at one price and is now
 * at another. */
static void follow(struct fv_peak *peak, double other_was, double other_is, int cost)
{
    if (!(other_is > 0)) return;
    if (other_was > 0) peak->held = fmin(peak->held * other_is / other_was, price_max_ns);
    fade_towards(peak, other_is * (cost & 1 ? 1 : sparse_dense));
}

void fv_control_open(struct fv_control *control, int first, int last, int workers, double headroom)
{
    assert(0 <= first && first <= last && last < FV_LEVELS_MAX && workers >= 1);
    *control = (struct fv_control){.first = first,
                                   .last = last,
                                   .workers = workers,
                                   .headroom = headroom > 0 ? fmin(headroom, 0.99) : 0,
                                   .level = last,
                                   .periods = 1};
    for (int i = 0; i < FV_LEVELS_MAX; i++)
        control->memory[i] = blank;
}

/* Which of a peak's values is asked for. */
enum view { HELD, NEWEST, DEARER, MEDIAN };

static double seen(const struct fv_peak *peak, enum view view)
{
    const double *r = peak->recent;
    switch (view) {
    case HELD: return peak->held;
    case NEWEST: return r[0];
    case DEARER: return fmax(peak->held, r[0]);
    case MEDIAN: return peak->count == 3 ? median(r) : peak->held;
    }
    return 0;
}

/* What the other price of the same stage says of this one. */
static double sibling(const struct fv_control *control, int cost, enum view view)
{
    return seen(&control->price[cost ^ 1], view) * (cost & 1 ? 1 : sparse_dense);
}

static double price(const struct fv_control *control, int cost, enum view view)
{
    double own = seen(&control->price[cost], view);
    return own > 0 ? own : sibling(control, cost, view);
}

static double correction(const struct fv_control *control, int cost, enum view view)
{
    const struct fv_peak *peak = &control->correction[cost];
    return peak->count ? seen(peak, view) : 1;
}

static double stretch(const struct fv_control *control, enum view view)
{
    return control->stretch.count ? seen(&control->stretch, view) : 1;
}

static double factors(const struct fv_level_memory *memory)
{
    return memory->factor[FV_PRICE] * memory->factor[FV_UNITS] * memory->factor[FV_STRETCH];
}

/* Without the level's factors. */
static double plain_ns(const struct fv_control *control, const struct fv_work *work, enum view view)
{
    double cpu_ns = 0, known = 0, unknown = 0;
    for (int k = 0; k < FV_COSTS; k++) {
        double units = sound(work->units[k], units_max) * correction(control, k, view);
        double unit_ns = price(control, k, view);
        *(unit_ns > 0 ? &known : &unknown) += units;
        cpu_ns += unit_ns * units;
    }
    if (known > 0) cpu_ns += unknown * fmin(cpu_ns / known, price_max_ns);
    return cpu_ns / control->workers * stretch(control, view);
}

double fv_control_predict_ns(const struct fv_control *control, int level, const struct fv_work *work)
{
    return plain_ns(control, work, HELD) * factors(&control->memory[level]);
}

double fv_control_need_ns(const struct fv_control *control, int level, const struct fv_work *work)
{
    return plain_ns(control, work, DEARER) * factors(&control->memory[level]);
}

double fv_control_stretch(const struct fv_control *control)
{
    return stretch(control, HELD);
}

double fv_control_price_ns(const struct fv_control *control, int cost)
{
    return price(control, cost, DEARER) / control->workers * stretch(control, DEARER);
}

/* How much dearer than known a sample is, by measure. Of a frame that was cut, units say no more than that
 * there were at least as many. */
static void measure(const struct fv_control *control, const struct fv_cost_sample *sample,
                    double ratio[FV_MEASURES])
{
    double cpu_ns = 0, done_ns = 0, expected_ns = 0;
    for (int k = 0; k < FV_COSTS; k++) {
        double units = sound(sample->done.units[k], units_max), ns = sound(sample->cpu_ns[k], time_max_ns);
        double unit_ns = price(control, k, HELD);
        if (!(units > 0 && ns > 0 && unit_ns > 0)) continue;
        double expected = sound(sample->expected.units[k], units_max) * correction(control, k, HELD);
        cpu_ns += ns;
        done_ns += unit_ns * units;
        expected_ns += unit_ns * (sample->cut ? fmin(units, expected) : expected);
    }
    double wall_ns = sound(sample->wall_ns, time_max_ns), all_ns = sound(sample->total_cpu_ns, time_max_ns);
    ratio[FV_PRICE] = done_ns > 0 ? cpu_ns / done_ns : 1;
    ratio[FV_UNITS] = expected_ns > 0 ? done_ns / expected_ns : 1;
    ratio[FV_STRETCH] =
        wall_ns > 0 && all_ns > 0 ? wall_ns * control->workers / (all_ns * stretch(control, HELD)) : 1;
}

/* The first two frames after a raise: where both were dearer than what is known, the level is. */
static void judge_raise(struct fv_control *control, const struct fv_cost_sample *sample)
{
    struct fv_level_memory *memory = &control->memory[sample->level];
    double ratio[FV_MEASURES], before = factors(memory);
    if (!(memory->raised_ns > 0) || memory->samples == 2) return;
    measure(control, sample, ratio);
    for (int m = 0; m < FV_MEASURES; m++)
        memory->dearer[m] = memory->samples ? fmin(memory->dearer[m], ratio[m]) : ratio[m];
    if (++memory->samples < 2) return;
    for (int m = 0; m < FV_MEASURES; m++)
        memory->factor[m] = memory->dearer[m] > dearer_min ? fmin(memory->dearer[m], factor_max) : 1;
    memory->raised_ns *= factors(memory) / before;
}

/* Whether the newest raise may be followed by another: its first frame was as predicted, or its second one
 * has been seen too. */
static bool judged(const struct fv_level_memory *memory)
{
    const double *d = memory->dearer;
    if (!(memory->raised_ns > 0) || memory->samples == 2) return true;
    return memory->samples == 1 && d[FV_PRICE] * d[FV_UNITS] * d[FV_STRETCH] <= dearer_min;
}

static bool taught(struct fv_peak *peak, double value, double most)
{
    value = sound(value, most);
    fv_peak_learn(peak, value);
    return value > 0;
}

/* Whether there was enough work of a cost, beside the other one of its stage, to say what it costs. */
static bool matters(const struct fv_cost_sample *sample, int cost)
{
    double units[2];
    for (int i = 0; i < 2; i++)
        units[i] = fmax(sound(sample->done.units[cost ^ i], units_max),
                        sound(sample->expected.units[cost ^ i], units_max));
    return units[0] >= enough_share * units[1];
}

void fv_control_learn(struct fv_control *control, const struct fv_cost_sample *sample)
{
    if (sample->level < control->first || sample->level > control->last) return;
    judge_raise(control, sample);
    const double *factor = control->memory[sample->level].factor;
    double before[FV_COSTS];
    bool fresh[FV_COSTS], any = false;
    for (int k = 0; k < FV_COSTS; k++) before[k] = control->price[k].held;
    for (int k = 0; k < FV_COSTS; k++) {
        double units = sound(sample->done.units[k], units_max), ns = sound(sample->cpu_ns[k], time_max_ns);
        if (control->price[k].count && !matters(sample, k)) units = 0;
        fresh[k] = units > 0 && taught(&control->price[k], ns / units / factor[FV_PRICE], price_max_ns);
        any |= fresh[k];
    }
    for (int k = 0; k < FV_COSTS && any; k++) {
        struct fv_peak *peak = &control->correction[k];
        double came = sound(sample->done.units[k], units_max) / sample->expected.units[k] / factor[FV_UNITS];
        if (!fresh[k]) follow(&control->price[k], before[k ^ 1], control->price[k ^ 1].held, k);
        if (sample->cut && !(came > peak->held)) continue;
        if (!(came > 0 && isfinite(came)) || !matters(sample, k)) fade_towards(peak, 1);
        else learn_mean(peak, within(came, 1 / correction_max, correction_max));
    }
    double wall_ns = sound(sample->wall_ns, time_max_ns), cpu_ns = sound(sample->total_cpu_ns, time_max_ns);
    /* Workers that take turns on fewer cores stretch it by their number; what lies beyond is none. */
    double most = stretch_max + control->workers;
    double stretched = sound(wall_ns * control->workers / cpu_ns / factor[FV_STRETCH], most);
    if (stretched > 0) fv_peak_learn(&control->stretch, fmax(stretched, 1));
    if (sample->level != control->level || (sample->cut && sample->hurried)) return;
    if (sample->cut) control->cuts = least_of(control->cuts + 2, CUTS_MAX);
    else if (control->cuts > 0) control->cuts--;
}

static bool anything_known(const struct fv_control *control)
{
    for (int k = 0; k < FV_COSTS; k++)
        if (control->price[k].count) return true;
    return false;
}

/* Periods that `ns` takes of which a share is used, 1 to most; most where a period is none. */
static int periods_of(double ns, double period_ns, double share, int most)
{
    double periods = ceil(ns / (period_ns * share));
    return periods > 1 ? (int)fmin(periods, most) : 1;
}

static void choose_periods(struct fv_control *control, const struct fv_work *least, double period_ns,
                           double other_ns, int most)
{
    double ns = fv_control_predict_ns(control, control->last, least) + other_ns,
           share = 1 - control->headroom;
    int fit = periods_of(ns, period_ns, share, most), easy = periods_of(ns, period_ns, room * share, most);
    control->easy = easy < control->periods ? least_of(control->easy + 1, QUIET_FRAMES) : 0;
    if (fit > control->periods) control->periods = fit;
    else if (control->easy == QUIET_FRAMES || control->periods > most) control->periods = easy;
    else return;
    control->easy = 0;
}

/* Levels that are not in use and whose memory is of other conditions, or old, forget. */
static void forget(struct fv_control *control)
{
    for (int i = control->first; i <= control->last; i++) {
        struct fv_level_memory *memory = &control->memory[i];
        double ns = plain_ns(control, &memory->work, MEDIAN);
        bool moved = ns > moved_ratio * memory->known_ns || ns * moved_ratio < memory->known_ns;
        memory->moved = moved && i != control->level ? memory->moved + 1 : 0;
        if (memory->frames < MEMORY_FRAMES) memory->frames++;
        else if (i != control->level) memory->moved = QUIET_FRAMES;
        if (memory->moved == QUIET_FRAMES) *memory = blank;
    }
}

/* What a level's memory is of: this work, at the prices of now. */
static void note(struct fv_control *control, struct fv_level_memory *memory, const struct fv_work *work)
{
    memory->work = *work;
    memory->known_ns = plain_ns(control, work, MEDIAN);
}

/* The best level from one on that is predicted to fit, the last where none is. */
static int best_from(const struct fv_control *control, int level, const struct fv_work *expected,
                     double budget_ns)
{
    while (level < control->last && !(fv_control_predict_ns(control, level, &expected[level]) <= budget_ns))
        level++;
    return level;
}

/* Down from the level, which was predicted to take `ns`. */
static void drop(struct fv_control *control, const struct fv_work *expected, double ns, double budget_ns)
{
    struct fv_level_memory *memory = &control->memory[control->level];
    if (memory->raised_ns > 0) {
        double dearer = fv_control_predict_ns(control, control->level, &memory->work) / memory->raised_ns;
        double most = memory->frames < TRIAL_FRAMES ? factor_max : fmax(later_max, memory->caution);
        memory->caution = within(dearer, 1, most);
    }
    if (ns <= budget_ns) {
        memory->caution = ns > 0 ? within(budget_ns / ns, 1, factor_max) : factor_max;
        note(control, memory, &expected[control->level]);
    }
    memory->frames = 0;
    control->level = best_from(control, control->level + 1, expected, budget_ns);
    for (int i = control->first; i <= control->last; i++) control->memory[i].raised_ns = 0;
    control->quiet = control->cuts = 0;
}

static void raise_one(struct fv_control *control, const struct fv_work *expected, double ns)
{
    struct fv_level_memory *memory = &control->memory[--control->level];
    note(control, memory, &expected[control->level]);
    memory->raised_ns = ns;
    memory->samples = memory->frames = 0;
    control->cuts = 0;
}

int fv_control_choose(struct fv_control *control, const struct fv_work *expected, const struct fv_work *least,
                      double period_ns, double other_ns, int periods_max)
{
    period_ns = sound(period_ns, time_max_ns);
    other_ns = sound(other_ns, time_max_ns);
    choose_periods(control, least, period_ns, other_ns, periods_max < 1 ? 1 : periods_max);
    if (!anything_known(control)) return control->level;
    int level = control->level, up = level - 1;
    double budget_ns = control->periods * period_ns * (1 - control->headroom) - other_ns;
    double ns = fv_control_predict_ns(control, level, &expected[level]);
    forget(control);
    if (level < control->last && (!(ns <= budget_ns) || control->cuts == CUTS_MAX)) {
        drop(control, expected, ns, budget_ns);
        return control->level;
    }
    if (level == control->first) return level;
    const struct fv_level_memory *memory = &control->memory[up];
    double newest_ns = plain_ns(control, &expected[up], NEWEST) * factors(memory);
    double up_ns = fv_control_predict_ns(control, up, &expected[up]);
    control->quiet = newest_ns <= room * budget_ns ? least_of(control->quiet + 1, QUIET_FRAMES) : 0;
    if (control->quiet == QUIET_FRAMES && judged(&control->memory[level]) &&
        up_ns * memory->caution <= room * budget_ns)
        raise_one(control, expected, up_ns);
    return control->level;
}

int fv_control_fit(const struct fv_control *control, const struct fv_work *expected, double budget_ns)
{
    return anything_known(control) ? best_from(control, control->level, expected, budget_ns) : control->level;
}
