/* table_kim2021_history: what earlier frames are used for: smoothing (Table 3 of Kim, Ko and Ihm 2021) and
 * reuse (Figure 6); see table_kim2021.c. The left eye, every pixel of the periphery, the viewer moving along
 * the path. Numbers are medians over the places. */
#include "rt/measure/rank.h"
#include "rt/measure/table_kim2021.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define NONE ((double)NAN)

static struct bench {
    struct fv_vantage vantage;
    struct fv_vantage_side without, with, truth; /* without what is measured, and with it */
} bench;

static double median(double *value)
{
    return fv_rank_quartiles(value, bench.vantage.places).value;
}

/* The places, the truth where it is asked for (samples a pixel, 0: none), and the settings of both sides. */
static void open_bench(const struct fv_table_bench *of, int truth)
{
    fv_vantage_open(&bench.vantage, of->config, of->tracer, of->workers, of->io, of->frames);
    if (truth) fv_vantage_truth_open(&bench.vantage, &bench.truth, truth);
    bench.without.config = bench.with.config = *of->config;
}

/* Opens both sides by their settings and measures at each place, saying where it is; true: it was stopped. */
static bool stopped_at(const char *what, void measure(int place))
{
    const struct fv_sweep_io *io = bench.vantage.io;
    fv_vantage_side_open(&bench.vantage, &bench.without, "selective");
    fv_vantage_side_open(&bench.vantage, &bench.with, "selective");
    for (int place = 0; place < bench.vantage.places; place++) {
        if (io->stopped(io->context)) return true;
        io->progress(io->context, what, (double)place / bench.vantage.places);
        measure(place);
    }
    return false;
}

/* ---- Table 3: errors against 256 samples a pixel, by alpha ---- */

enum { SMOOTHED = 4, TRUTH = 256, ALPHAS = 7, OFF = 0, FOVEATED = ALPHAS - 1 };

static const struct {
    const char *name;
    double alpha; /* the same everywhere; 0: none, or that of the settings */
    double paper[FV_ZONE_ALL];
} alphas[ALPHAS] = {
    {"off", 0, {40.53, 36.74, 34.11, 31.73, 32.07}},     {"0.1", 0.1, {37.82, 36.11, 33.59, 32.57, 33.63}},
    {"0.3", 0.3, {38.83, 36.60, 33.82, 32.69, 33.58}},   {"0.5", 0.5, {40.20, 37.11, 34.04, 32.69, 33.34}},
    {"0.7", 0.7, {41.33, 37.33, 34.14, 32.46, 32.91}},   {"0.9", 0.9, {41.09, 36.96, 34.04, 31.97, 32.34}},
    {"foveated", 0, {41.33, 37.25, 34.09, 32.74, 33.63}}};

static double smoothed[ALPHAS][FV_VANTAGE_PLACES_MAX][FV_ZONES];

static void smooth_place(int place)
{
    struct fv_errors errors;
    fv_vantage_go(&bench.vantage, place);
    fv_vantage_arrive(&bench.vantage, &bench.truth, 1);
    fv_vantage_keep(&bench.vantage, &bench.truth);
    for (int a = 0; a < ALPHAS; a++) {
        struct fv_vantage_side *side = a == OFF ? &bench.without : &bench.with;
        side->config.selective_alpha = bench.vantage.config->selective_alpha;
        for (int i = 0; i < side->config.selective_alpha.count && a != OFF && a != FOVEATED; i++)
            side->config.selective_alpha.value[i] = alphas[a].alpha;
        fv_vantage_arrive(&bench.vantage, side, FV_VANTAGE_LEAD);
        fv_vantage_judge(&bench.vantage, side, &errors);
        memcpy(smoothed[a][place], errors.psnr, sizeof errors.psnr);
    }
}

int fv_kim2021_smoothing(const char *scene, const struct fv_table_bench *of, struct fv_sheet *sheet)
{
    char row[64];
    open_bench(of, TRUTH);
    bench.with.config.selective_smooth = SMOOTHED;
    if (stopped_at("smoothing, by alpha", smooth_place)) return 1;
    for (int a = 0; a < ALPHAS; a++) {
        snprintf(row, sizeof row, "%s/smoothing/%s", scene, alphas[a].name);
        fv_kim2021_add_psnr(sheet, row, alphas[a].paper, FV_ZONE_ALL, smoothed[a], bench.vantage.places);
    }
    return 0;
}

/* ---- Figure 6: reused pixels, and errors against the same frames without reuse ---- */

enum { REUSES = 7, NEVER = 0, PRINTED = 2, PAPER_ZONES = 4 };

/* The gaze moves slowly, as in the paper. */
static const double drift_deg_s = 4;

/* tau_reuse; 0: nothing is reused. */
static const double reuses[REUSES] = {0, 0.25, 0.5, 1, 2, 4, 8};

/* What the paper prints does not say its tau_reuse. */
static const struct {
    const char *name;
    double fraction, psnr[PAPER_ZONES];
} printed[PRINTED] = {{"paper-a", 0.1326, {43.95, 47.46, 48.44, 54.24}},
                      {"paper-b", 0.4371, {40.12, 40.34, 42.36, 45.18}}};

static struct {
    double psnr[FV_VANTAGE_PLACES_MAX][FV_ZONES];
    double fraction[FV_VANTAGE_PLACES_MAX], rays[FV_VANTAGE_PLACES_MAX], cpu_ms[FV_VANTAGE_PLACES_MAX];
} reused[REUSES];

static void reuse_place(int place)
{
    struct fv_errors errors;
    fv_vantage_go(&bench.vantage, place);
    for (int i = 0; i < REUSES; i++) {
        struct fv_vantage_side *side = i == NEVER ? &bench.without : &bench.with;
        side->config.selective_reuse = reuses[i];
        struct fv_frame_record r = fv_vantage_arrive(&bench.vantage, side, FV_VANTAGE_LEAD);
        if (i == NEVER) fv_vantage_keep(&bench.vantage, side);
        fv_vantage_judge(&bench.vantage, side, &errors);
        memcpy(reused[i].psnr[place], errors.psnr, sizeof errors.psnr);
        for (int k = 0; k < FV_RAY_MARCH_STEPS; k++) reused[i].rays[place] += (double)r.rays[k];
        reused[i].cpu_ms[place] = (double)r.cpu_ms;
        reused[i].fraction[place] = (double)side->own.loop.frame.reused_share;
    }
}

int fv_kim2021_reuse(const char *scene, const struct fv_table_bench *of, struct fv_sheet *sheet)
{
    char row[64];
    open_bench(of, 0);
    bench.vantage.drift_deg_s = drift_deg_s;
    bench.with.config.selective_reuse = 1;
    if (stopped_at("reuse, by tau_reuse", reuse_place)) return 1;
    for (int i = 0; i < REUSES; i++) {
        snprintf(row, sizeof row, "%s/reuse/%g", scene, reuses[i]);
        fv_sheet_add(sheet, row, "reused_fraction", "", NONE, median(reused[i].fraction));
        if (i != NEVER) fv_kim2021_add_psnr(sheet, row, NULL, 0, reused[i].psnr, bench.vantage.places);
        fv_sheet_add(sheet, row, "rays", "rays", NONE, median(reused[i].rays));
        fv_sheet_add(sheet, row, "cpu_ms", "ms", NONE, median(reused[i].cpu_ms));
    }
    for (int i = 0; i < PRINTED; i++) {
        snprintf(row, sizeof row, "%s/reuse/%s", scene, printed[i].name);
        fv_sheet_add(sheet, row, "reused_fraction", "", printed[i].fraction, NONE);
        fv_kim2021_add_psnr(sheet, row, printed[i].psnr, PAPER_ZONES, NULL, 0);
    }
    return 0;
}
