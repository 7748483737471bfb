/* table_kim2021_speed: Table 2 of Kim, Ko and Ihm 2021: time of both eyes' frames, rays, and errors by zone;
 * see table_kim2021.c.
 *
 * At each place all ways are rendered in turn, COUNTED frames of each, one of 36 samples; a place's speed-up
 * is the ratio of its medians. What stands in the sheet are medians over the places; rays are of both eyes.
 * Errors are the left eye's, against TRUTH samples a pixel. */
#include "rt/measure/rank.h"
#include "rt/measure/table_kim2021.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define NONE ((double)NAN)

enum { COUNTED = 3, TRUTH = 144, PAPER_ZONES = 4 };
enum way { EVERY, SPARSE, SELECTIVE, ONE, MANY, WAYS };

static const struct {
    const char *name, *method, *periphery;
    int spp;
} ways[WAYS] = {{"every", "selective", "every", 1},
                {"sparse", "selective", "sparse", 1},
                {"selective", "selective-uniform", "every", 1},
                {"1spp", "full", "every", 1},
                {"36spp", "full", "every", 36}};

/* Table 2, the paper's method as both of ours. Rays in thousands. */
struct printed {
    double ms, rays, psnr[PAPER_ZONES];
};
static const struct {
    const char *scene;
    struct printed of[WAYS];
} paper[] = {
    {"sponza",
     {{15.9, 7400, {47.5, 36.2, 32.3, 33.2}},
      {15.9, 7400, {47.5, 36.2, 32.3, 33.2}},
      {84.8, 133762, {36.4, 37.3, 36.9, 38.8}},
      {12.9, 11856, {24.0, 25.6, 25.4, 28.6}},
      {327.2, 426806, {NAN, NAN, NAN, NAN}}}},
    {"pipes", /* Power Plant */
     {{28.6, 8928, {35.2, 29.3, 28.3, 23.9}},
      {28.6, 8928, {35.2, 29.3, 28.3, 23.9}},
      {42.9, 27799, {28.6, 28.1, 27.3, 25.9}},
      {10.7, 6395, {18.8, 20.2, 20.7, 20.4}},
      {232.9, 230250, {NAN, NAN, NAN, NAN}}}},
};
enum { PRINTED = sizeof paper / sizeof paper[0] };

struct outcome {
    double ms[FV_VANTAGE_PLACES_MAX], cpu_ms[FV_VANTAGE_PLACES_MAX], rays[FV_VANTAGE_PLACES_MAX];
    double psnr[FV_VANTAGE_PLACES_MAX][FV_ZONES];
};

static struct bench {
    struct fv_vantage vantage;
    struct fv_vantage_side side[WAYS - 1], truth; /* 36 samples are the same renderer as one */
    struct outcome outcome[WAYS];
} bench;

static struct fv_vantage_side *side_of(enum way way)
{
    return &bench.side[way == MANY ? ONE : way];
}

/* Without what is ours. */
static void as_published(struct fv_config *c)
{
    c->selective_spread = 0;
    snprintf(c->selective_texture, sizeof c->selective_texture, "trace");
}

static void open_bench(const struct fv_table_bench *of)
{
    fv_vantage_open(&bench.vantage, of->config, of->tracer, of->workers, of->io, of->frames);
    for (int w = 0; w < MANY; w++) {
        struct fv_config *c = &bench.side[w].config;
        *c = *of->config;
        snprintf(c->selective_periphery, sizeof c->selective_periphery, "%s", ways[w].periphery);
        if (w == SELECTIVE) as_published(c);
        fv_vantage_side_open(&bench.vantage, &bench.side[w], ways[w].method);
    }
    fv_vantage_truth_open(&bench.vantage, &bench.truth, TRUTH);
}

/* What is counted of one way at a place. */
struct counted {
    int frames;
    double ms[COUNTED], cpu_ms[COUNTED], rays;
};

static void count(enum way way, int n, struct counted *c)
{
    struct fv_frame_record r;
    side_of(way)->config.method_spp = ways[way].spp;
    fv_vantage_render(&bench.vantage, side_of(way), n, &r);
    c->ms[c->frames] = (double)r.frame_ms;
    c->cpu_ms[c->frames++] = (double)r.cpu_ms;
    for (int k = 0; k < FV_RAY_MARCH_STEPS; k++) c->rays += (double)r.rays[k];
}

static void judge(enum way way, int place)
{
    struct fv_errors errors;
    fv_vantage_judge(&bench.vantage, side_of(way), &errors);
    memcpy(bench.outcome[way].psnr[place], errors.psnr, sizeof errors.psnr);
}

/* The counted frames, the ways in turn, each time another one first. */
static void render_turns(struct counted counted[WAYS], int place)
{
    for (int turn = 0; turn < COUNTED; turn++)
        for (int i = 0; i < WAYS; i++) {
            enum way way = (enum way)((i + turn + place) % WAYS);
            bool last = turn == COUNTED - 1;
            if (way == MANY && !last) continue;
            count(way, FV_VANTAGE_LEAD - COUNTED + turn, &counted[way]);
            if (last) judge(way, place);
        }
}

static int measure_place(int place, const char *what)
{
    const struct fv_sweep_io *io = bench.vantage.io;
    struct counted counted[WAYS] = {{0}};
    struct fv_frame_record record;
    fv_vantage_go(&bench.vantage, place);
    fv_vantage_arrive(&bench.vantage, &bench.truth, 1);
    fv_vantage_keep(&bench.vantage, &bench.truth);
    if (io->stopped(io->context)) return 1;
    io->progress(io->context, what, (place + 0.5) / bench.vantage.places);
    for (int w = 0; w < MANY; w++) fv_loop_restart(&bench.side[w].own.loop);
    for (int n = 0; n < FV_VANTAGE_LEAD - COUNTED; n++)
        fv_vantage_render(&bench.vantage, &bench.side[SPARSE], n, &record);
    render_turns(counted, place);
    for (int w = 0; w < WAYS; w++) {
        struct counted *c = &counted[w];
        bench.outcome[w].ms[place] = fv_rank_quartiles(c->ms, c->frames).value;
        bench.outcome[w].cpu_ms[place] = fv_rank_quartiles(c->cpu_ms, c->frames).value;
        bench.outcome[w].rays[place] = c->rays / c->frames;
    }
    return 0;
}

/* ---- cells ---- */

static const struct printed *printed_of(const char *scene, enum way way)
{
    for (int i = 0; i < PRINTED; i++)
        if (strcmp(paper[i].scene, scene) == 0) return &paper[i].of[way];
    return NULL;
}

static double median(const double *of)
{
    double value[FV_VANTAGE_PLACES_MAX];
    memcpy(value, of, sizeof value);
    return fv_rank_quartiles(value, bench.vantage.places).value;
}

/* The median ratio of two ways' times. */
static struct fv_measured ratio(const double *over, const double *under)
{
    double value[FV_VANTAGE_PLACES_MAX];
    for (int i = 0; i < bench.vantage.places; i++) value[i] = over[i] / under[i];
    return fv_rank_quartiles(value, bench.vantage.places);
}

static void add_speedup(struct fv_sheet *sheet, const char *scene, const char *row, enum way way,
                        enum way over, const char *name)
{
    const struct printed *of = printed_of(scene, way), *than = printed_of(scene, over);
    struct fv_measured wall = ratio(bench.outcome[over].ms, bench.outcome[way].ms);
    struct fv_measured cpu = ratio(bench.outcome[over].cpu_ms, bench.outcome[way].cpu_ms);
    const struct {
        const char *before, *behind;
        double paper, ours;
    } cell[] = {{"", "", of ? than->ms / of->ms : NONE, wall.value},
                {"", "_p25", NONE, wall.low},
                {"", "_p75", NONE, wall.high},
                {"cpu_", "", NONE, cpu.value}};
    for (size_t i = 0; i < sizeof cell / sizeof cell[0]; i++) {
        char quantity[40];
        snprintf(quantity, sizeof quantity, "%sspeedup_vs_%s%s", cell[i].before, name, cell[i].behind);
        fv_sheet_add(sheet, row, quantity, "", cell[i].paper, cell[i].ours);
    }
}

static void add_cells(const char *scene, enum way way, struct fv_sheet *sheet)
{
    const struct printed *p = printed_of(scene, way);
    struct outcome *o = &bench.outcome[way];
    char row[64];
    snprintf(row, sizeof row, "%s/%s", scene, ways[way].name);
    if (way == EVERY || way == SPARSE) {
        add_speedup(sheet, scene, row, way, MANY, "36spp");
        add_speedup(sheet, scene, row, way, SELECTIVE, "selective");
    }
    fv_kim2021_add_psnr(sheet, row, p ? p->psnr : NULL, p ? PAPER_ZONES : 0, o->psnr, bench.vantage.places);
    fv_sheet_add(sheet, row, "rays", "rays", p ? 1e3 * p->rays : NONE, median(o->rays));
    fv_sheet_add(sheet, row, "frame_ms", "ms", p ? p->ms : NONE, median(o->ms));
    fv_sheet_add(sheet, row, "cpu_ms", "ms", NONE, median(o->cpu_ms));
}

int fv_kim2021_speed(const char *scene, const struct fv_table_bench *of, struct fv_sheet *sheet)
{
    char what[64];
    snprintf(what, sizeof what, "%s: 36 samples, 1, selective-only, selective", scene);
    open_bench(of);
    for (int place = 0; place < bench.vantage.places; place++) {
        if (of->io->stopped(of->io->context)) return 1;
        of->io->progress(of->io->context, what, (double)place / bench.vantage.places);
        if (measure_place(place, what)) return 1;
    }
    for (int w = 0; w < WAYS; w++) add_cells(scene, (enum way)w, sheet);
    return 0;
}
