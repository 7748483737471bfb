/* table_peres2023: Tables 3 and 4 of Peres et al. 2023, "Non-homogeneous denoising for virtual reality in real-time path tracing
 * rendering": both eyes of 960 x 1080 (FHD) and of 1832 x 1920 pixels (Quest 2), a part a size and scene; its radii, so that areas
 * and samples are its Table 1's (tests/numeric/layers.c).
 *
 * base        4 paths a pixel and the inner layer's iterations of the filter everywhere, which serve 4 paths best
 * nh2ld       4, 3, 2 paths by layer; iterations of the inner layer, and of both others those of the outer one
 * nh3ld       the same paths; iterations by layer (denoise.iterations)
 * nh3ld-p0.5  and half of the outer layer's pixels left out
 * unfiltered  3 paths everywhere and no filter: the fewest whole paths that take longer than nh3ld's
 * nh3ld-history  nh3ld with light accumulated over frames (denoise.history); the others are without, as in the paper
 *
 * At each place all ways are rendered in turn, COUNTED frames of each, but the last: that one alone, from the frames on that lead
 * there; a place's speed-up is the ratio of its medians, and what
 * stands in the sheet are medians over the places. Errors are the left eye's against 1024 paths a pixel without filter
 * (method.spp where that is above 1: fewer make a shorter run); "fovea" is within 3.3 degrees, as in kim2021.
 *
 * The paper's Sponza has a sun and a point light, so it gets a sun here; forest is ours, of the character of
 * its own; atrium stands for its Pink Room, which is not at hand. The
 * paper does not say of which size its Table 4 is: it stands beside FHD. */
#include "rt/measure/rank.h"
#include "rt/measure/table.h"
#include "rt/measure/vantage.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define NONE ((double)NAN)

enum { COUNTED = 3, TRUTH = 1024 };
enum way { BASE, NH2LD, NH3LD, PRINTED, HALF = PRINTED, UNFILTERED, HISTORY, WAYS }; /* PRINTED: so many are the paper's */
static const char *const names[WAYS] = {"base", "nh2ld", "nh3ld", "nh3ld-p0.5", "unfiltered", "nh3ld-history"};

static const struct size {
    const char *name, *setting[6];
} sizes[] = {{"fhd", {"display.headset=fhd", "denoise.inner_px=144", "denoise.outer_px=288"}},
             {"quest2", {"display.headset=quest-2", "denoise.inner_px=265", "denoise.outer_px=530"}}};
static const struct scene {
    const char *name, *setting[3];
} scenes[] = {{"sponza", {"scene.name=sponza", "scene.sun=0.25 1 0.15 6 5.6 5"}}, {"forest", {"scene.name=forest"}}, {"atrium", {"scene.name=atrium"}}};
enum { SIZES = sizeof sizes / sizeof sizes[0], SCENES = sizeof scenes / sizeof scenes[0] };

/* Table 3 by size; Table 4. */
static const struct printed {
    const char *size, *scene;
    double ms[PRINTED], rmse_percent[PRINTED], ssim[PRINTED], psnr[PRINTED];
} paper[] = {{"fhd", "sponza", {31.01, 23.28, 22.95}, {5.7633, 5.9252, 5.9029}, {0.918678, 0.913988, 0.913633}, {21.879093, 21.420517, 21.468767}},
             {"fhd", "forest", {22.84, 18.46, 17.54}, {3.7991, 3.8649, 4.1787}, {0.813191, 0.795324, 0.778536}, {22.339938, 22.37879, 21.69204}},
             {"quest2", "sponza", {99.27, 75.52, 74.62}, {NAN, NAN, NAN}, {NAN, NAN, NAN}, {NAN, NAN, NAN}},
             {"quest2", "forest", {73.66, 60.24, 59.03}, {NAN, NAN, NAN}, {NAN, NAN, NAN}, {NAN, NAN, NAN}}};

static void part(int n, int frames, struct fv_table_part *p)
{
    static const char *const always[] = {"display.sink=png", "display.eyes=2", "output.overlay=off", "budget.adapt=off",
                                         "method.name=denoise", "eye.source=none", "imu.source=sim"};
    const struct size *size = &sizes[n / SCENES];
    const struct scene *scene = &scenes[n % SCENES];
    (void)frames;
    *p = (struct fv_table_part){0};
    snprintf(p->name, sizeof p->name, "%s-%s", size->name, scene->name);
    snprintf(p->scene, sizeof p->scene, "%s", scene->name);
    for (size_t i = 0; i < sizeof always / sizeof always[0]; i++) p->setting[p->settings++] = always[i];
    for (int i = 0; size->setting[i]; i++) p->setting[p->settings++] = size->setting[i];
    for (int i = 0; scene->setting[i]; i++) p->setting[p->settings++] = scene->setting[i];
}

struct outcome {
    double ms[FV_VANTAGE_PLACES_MAX], cpu_ms[FV_VANTAGE_PLACES_MAX], rays[FV_VANTAGE_PLACES_MAX];
    double rmse[FV_VANTAGE_PLACES_MAX], foveal[FV_VANTAGE_PLACES_MAX], ssim[FV_VANTAGE_PLACES_MAX], psnr[FV_VANTAGE_PLACES_MAX];
};

/* One loop for all ways, by settings of its own each. */
static struct bench {
    struct fv_vantage vantage;
    struct fv_vantage_side side, truth;
    struct fv_config config; /* nh3ld's */
    struct outcome outcome[WAYS];
} bench;

static void set_all(struct fv_list *list, double value)
{
    for (int i = 0; i < list->count; i++) list->value[i] = value;
}

static void set_way(enum way way)
{
    struct fv_config *c = &bench.side.config;
    *c = bench.config;
    c->denoise_p = way == HALF ? 0.5 : 0;
    if (way == UNFILTERED) fv_reference_paths(c, 3);
    if (way != HISTORY) c->denoise_history = 0;
    if (way == NH2LD) c->denoise_iterations.value[1] = c->denoise_iterations.value[2];
    if (way != BASE) return;
    set_all(&c->denoise_spp, c->denoise_spp.value[0]);
    set_all(&c->denoise_iterations, c->denoise_iterations.value[0]);
}

static void open_bench(const struct fv_table_bench *of)
{
    struct fv_config *truth = &bench.truth.config;
    fv_vantage_open(&bench.vantage, of->config, of->tracer, of->workers, of->io, of->frames);
    bench.config = bench.side.config = *of->config;
    fv_vantage_side_open(&bench.vantage, &bench.side, "denoise");
    *truth = *of->config;
    truth->display_eyes = 1;
    fv_reference_paths(truth, of->config->method_spp > 1 ? (int)of->config->method_spp : TRUTH);
    fv_vantage_side_open(&bench.vantage, &bench.truth, "denoise");
}

static void judge(enum way way, int place)
{
    struct outcome *o = &bench.outcome[way];
    struct fv_errors errors;
    fv_vantage_judge(&bench.vantage, &bench.side, &errors);
    o->rmse[place] = 100 * errors.rmse[FV_ZONE_ALL];
    o->foveal[place] = 100 * errors.rmse[FV_ZONE_FOVEA];
    o->ssim[place] = errors.ssim[FV_ZONE_ALL];
    o->psnr[place] = errors.psnr[FV_ZONE_ALL];
}

struct times {
    double ms[WAYS][COUNTED], cpu_ms[WAYS][COUNTED];
};

/* One of the counted frames. */
static void render(enum way way, int place, int turn, struct times *t)
{
    struct fv_frame_record r;
    fv_vantage_render(&bench.vantage, &bench.side, FV_VANTAGE_LEAD - COUNTED + turn, &r);
    t->ms[way][turn] = (double)r.frame_ms;
    t->cpu_ms[way][turn] = (double)r.cpu_ms;
    bench.outcome[way].rays[place] = 0;
    for (int k = 0; k < FV_RAY_MARCH_STEPS; k++) bench.outcome[way].rays[place] += (double)r.rays[k];
    if (turn == COUNTED - 1) judge(way, place);
}

/* Light is accumulated over the frames that lead there. */
static void render_history(int place, struct times *t)
{
    struct fv_frame_record r;
    set_way(HISTORY);
    fv_loop_settings(&bench.side.own.loop);
    fv_loop_restart(&bench.side.own.loop);
    for (int n = 0; n < FV_VANTAGE_LEAD - COUNTED; n++) fv_vantage_render(&bench.vantage, &bench.side, n, &r);
    for (int turn = 0; turn < COUNTED; turn++) render(HISTORY, place, turn, t);
}

/* The counted frames, the ways in turn, each time another one first. */
static void measure_place(int place)
{
    struct times t;
    fv_vantage_go(&bench.vantage, place);
    fv_vantage_arrive(&bench.vantage, &bench.truth, 1);
    fv_vantage_keep(&bench.vantage, &bench.truth);
    for (int turn = 0; turn < COUNTED; turn++)
        for (int i = 0; i < HISTORY; i++) {
            enum way way = (enum way)((i + turn + place) % HISTORY);
            set_way(way);
            fv_loop_settings(&bench.side.own.loop);
            fv_loop_restart(&bench.side.own.loop);
            bench.side.own.loop.frame.number = turn; /* the same random numbers for all */
            render(way, place, turn, &t);
        }
    render_history(place, &t);
    for (int w = 0; w < WAYS; w++) {
        bench.outcome[w].ms[place] = fv_rank_quartiles(t.ms[w], COUNTED).value;
        bench.outcome[w].cpu_ms[place] = fv_rank_quartiles(t.cpu_ms[w], COUNTED).value;
    }
}

static double median(const double *of)
{
    double value[FV_VANTAGE_PLACES_MAX];
    memcpy(value, of, sizeof value);
    return fv_rank_quartiles(value, bench.vantage.places).value;
}

static double ratio(const double *over, const double *under)
{
    double value[FV_VANTAGE_PLACES_MAX];
    for (int i = 0; i < bench.vantage.places; i++) value[i] = over[i] / under[i];
    return fv_rank_quartiles(value, bench.vantage.places).value;
}

static void add_cells(const char *size, const char *scene, enum way way, struct fv_sheet *sheet)
{
    const struct outcome *o = &bench.outcome[way], *base = &bench.outcome[BASE];
    const struct printed *p = NULL;
    char row[64];
    for (size_t i = 0; i < sizeof paper / sizeof paper[0]; i++)
        if (strcmp(paper[i].size, size) == 0 && strcmp(paper[i].scene, scene) == 0 && way < PRINTED) p = &paper[i];
    const struct {
        const char *name, *unit;
        double paper, ours;
    } cells[] = {{"frame_ms", "ms", p ? p->ms[way] : NONE, median(o->ms)},
                 {"speedup", "", p ? p->ms[BASE] / p->ms[way] : NONE, ratio(base->ms, o->ms)},
                 {"cpu_ms", "ms", NONE, median(o->cpu_ms)},
                 {"cpu_speedup", "", NONE, ratio(base->cpu_ms, o->cpu_ms)},
                 {"rmse_percent", "%", p ? p->rmse_percent[way] : NONE, median(o->rmse)},
                 {"ssim", "", p ? p->ssim[way] : NONE, median(o->ssim)},
                 {"psnr", "dB", p ? p->psnr[way] : NONE, median(o->psnr)},
                 {"rmse_fovea_percent", "%", NONE, median(o->foveal)},
                 {"rays", "rays", NONE, median(o->rays)}};
    snprintf(row, sizeof row, "%s/%s/%s", size, scene, names[way]);
    for (size_t i = 0; i < sizeof cells / sizeof cells[0]; i++)
        fv_sheet_add(sheet, row, cells[i].name, cells[i].unit, cells[i].paper, cells[i].ours);
}

static int measure(int n, const struct fv_table_bench *of, struct fv_sheet *sheet)
{
    const char *size = sizes[n / SCENES].name, *scene = scenes[n % SCENES].name;
    char what[64];
    snprintf(what, sizeof what, "%s, %s: base, two and three layers", size, scene);
    open_bench(of);
    for (int place = 0; place < bench.vantage.places; place++) {
        if (of->io->stopped(of->io->context)) return 1;
        of->io->progress(of->io->context, what, (double)place / bench.vantage.places);
        measure_place(place);
    }
    static const enum way order[WAYS] = {NH3LD, NH2LD, HALF, HISTORY, UNFILTERED, BASE}; /* the headline's first */
    for (int w = 0; w < WAYS; w++) add_cells(size, scene, order[w], sheet);
    return 0;
}

const struct fv_table fv_table_peres2023 = {
    .name = "peres2023",
    .paper = "Peres et al. 2023",
    .what = "Tables 3 and 4: denoise in two and three layers against one, by size and scene",
    .headline = "speedup",
    .over = "base",
    .frames = 3,
    .parts = SIZES * SCENES,
    .part = part,
    .measure = measure,
};
