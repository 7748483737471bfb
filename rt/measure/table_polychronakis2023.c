/* table_polychronakis2023: Figures 11 and 12 and Table 1 of Polychronakis et al. 2023, "An Inverted Pyramid
 * Acceleration Structure Guiding Foveated Sphere Tracing for Implicit Surfaces in VR": speed-up over full marching of
 * IPR and FIPR by scene, samples a pixel, radius of the fovea and refresh rate of what lies outside it, as steps and as
 * CPU time; SSIM and FLIP. One eye; counted "frames" are places along the scene's path, at each of which full and every
 * other are rendered in turn, standing still for a warm frame and then a whole round of refreshing.
 *
 * Rows are SCENE/KIND/ssaaN/foveaDEG/refreshN. KIND: ipr, every pixel (fovea180); fipr, N samples of the fovea, of edges
 * and of the middle level too, as the paper has it; fipr-masked, N samples only of the fovea and of edges; ipr-unculled,
 * for 1 and 16 samples, where neither side leaves parts of the fields out; and, for one sample, full itself by other
 * steps (full-plain, full-relaxed) than those of the settings, which all others take, full too. Scenes are ours, after
 * the paper's. */
#include "rt/measure/table.h"

#include "platform/arena.h"
#include "rt/measure/picture.h"
#include "rt/measure/rank.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define NONE ((double)NAN)

/* Printed numbers: Table 1, at one sample and 7.5 degrees; section 5.2 names few of Figures 11 and 12. */
static const struct scene {
    const char *name, *setting;
    double ssim_ipr, flip_ipr, ssim, flip;
    double least, most; /* speed-up at 7.5 degrees: 1 sample, all refreshed; 16 samples, a quarter refreshed */
    double widest, narrowest; /* at 15 degrees as the first; at 2.5 degrees as the second */
} scenes[] = {
    {"primitives", "scene.name=primitives", 0.99889, 0.050560, 0.9902, 0.109450, 1.1, 16.03, NONE, 20.04},
    {"columns", "scene.name=columns", 0.99192, 0.046423, 0.94939, 0.077929, 1.1, 10.29, NONE, NONE},
    {"temple", "scene.name=temple", 0.99579, 0.011108, 0.9777, 0.030102, 1.58, 8.83, 1.23, 12.65},
};
enum { SCENES = sizeof scenes / sizeof scenes[0] };

static const int ssaas[] = {1, 2, 4, 8, 16};
enum { SSAAS = sizeof ssaas / sizeof ssaas[0] };
static const double foveas_deg[] = {2.5, 5, 7.5, 10, 12.5, 15};
static const int refreshes[] = {1, 2, 4};
enum { FOVEAS = sizeof foveas_deg / sizeof foveas_deg[0], REFRESHES = sizeof refreshes / sizeof refreshes[0] };

enum kind { IPR, UNCULLED, PLAIN, RELAXED, FIPR, MASKED, KINDS };
static const char *const kind_names[KINDS] = {"ipr", "ipr-unculled", "full-plain", "full-relaxed", "fipr", "fipr-masked"};
enum { ENTRIES_MAX = 4 + 2 * FOVEAS * REFRESHES, PLACES_MAX = 64, SETTLED = 1 };

/* One way of rendering, and what was measured at each place. */
struct entry {
    enum kind kind;
    double fovea_deg;
    int refresh;
    double speedup[PLACES_MAX], steps[PLACES_MAX], cpu_ms[PLACES_MAX], ssim[PLACES_MAX], flip[PLACES_MAX];
};

static struct bench {
    const struct fv_table_bench *of;
    int ssaa, entries, places;
    struct fv_config config[2];
    struct fv_contender full, pyramid;
    struct fv_tracer unculled, plain, relaxed;
    struct fv_metrics *metrics;
    uint8_t *zone, *picture; /* of full's last frame */
    struct entry entry[ENTRIES_MAX];
    double full_ms[PLACES_MAX];
} bench;

static void part(int n, int frames, struct fv_table_part *p)
{
    static const char *const always[] = {"display.eyes=1",   "display.sink=png", "output.overlay=off", "budget.adapt=off",
                                         "method.name=pyramid", "eye.source=none", "imu.source=none",
                                         "display.headset=vive-pro-eye",
                                         /* Without culling rays along the ground take thousands. */
                                         "method.march_steps=8192"};
    (void)frames;
    *p = (struct fv_table_part){0};
    snprintf(p->name, sizeof p->name, "%s-ssaa%d", scenes[n / SSAAS].name, ssaas[n % SSAAS]);
    snprintf(p->scene, sizeof p->scene, "%s", scenes[n / SSAAS].name);
    for (size_t i = 0; i < sizeof always / sizeof always[0]; i++) p->setting[p->settings++] = always[i];
    p->setting[p->settings++] = scenes[n / SSAAS].setting;
}

static void add_entry(enum kind kind, double fovea_deg, int refresh)
{
    bench.entry[bench.entries++] = (struct entry){.kind = kind, .fovea_deg = fovea_deg, .refresh = refresh};
}

static void add_entries(int ssaa)
{
    bench.entries = 0;
    add_entry(IPR, 180, 1);
    if (ssaa == 1 || ssaa == 16) add_entry(UNCULLED, 180, 1);
    for (int kind = PLAIN; ssaa == 1 && kind <= RELAXED; kind++) add_entry((enum kind)kind, 180, 1);
    for (int kind = FIPR; kind <= (ssaa > 1 ? MASKED : FIPR); kind++)
        for (int f = 0; f < FOVEAS; f++)
            for (int r = 0; r < REFRESHES; r++) add_entry((enum kind)kind, foveas_deg[f], refreshes[r]);
}

static void open_bench(const struct fv_table_bench *of, int ssaa)
{
    static const char *const methods[2] = {"full", "pyramid"};
    struct fv_contender *contender[2] = {&bench.full, &bench.pyramid};
    bench = (struct bench){.of = of, .ssaa = ssaa, .unculled = *of->tracer, .plain = *of->tracer, .relaxed = *of->tracer};
    bench.places = of->frames < PLACES_MAX ? of->frames : PLACES_MAX;
    bench.unculled.culling = false;
    bench.plain.stepping = FV_STEPPING_PLAIN;
    bench.relaxed.stepping = FV_STEPPING_RELAXED;
    for (int i = 0; i < 2; i++) {
        bench.config[i] = *of->config;
        bench.config[i].method_spp = ssaa;
        fv_contender_plan(contender[i], fv_method_find(methods[i]), &bench.config[i], of->tracer);
        fv_contender_open(contender[i], &bench.config[i], of->tracer, of->workers);
    }
    const struct fv_frame *f = &bench.full.loop.frame;
    size_t pixels = (size_t)f->width * (size_t)f->height;
    bench.zone = fv_arena_take(fv_arena(), "zones", pixels, 64);
    bench.picture = fv_arena_take(fv_arena(), "picture of full", 3 * pixels, 64);
    bench.metrics = fv_metrics_open(f->width, f->height, 67);
    add_entries(ssaa);
}

static void latch(int place, struct fv_sweep_frame *frame)
{
    static const double ahead[3] = {0, 0, -1};
    const struct fv_sweep_io *io = bench.of->io;
    double gaze[2][3], uncertainty_deg;
    double at_s = bench.of->config->scene_path_seconds * (place + 0.5) / bench.places;
    *frame = (struct fv_sweep_frame){.t_ns = llround(at_s * 1e9)};
    io->latch(io->context, frame->t_ns, &frame->head, gaze, &uncertainty_deg);
    for (int e = 0; e < 2; e++) memcpy(frame->gaze[e], ahead, sizeof ahead);
}

/* Mean CPU time and steps of a frame of `count`, after some that are not counted. */
static void render(struct fv_contender *c, const struct fv_sweep_frame *frame, int settled, int count, double *cpu_ms,
                   double *steps)
{
    struct fv_frame_record r;
    *cpu_ms = *steps = 0;
    fv_loop_restart(&c->loop);
    for (int i = 0; i < settled + count; i++) {
        fv_loop_frame(&c->loop, &frame->head, frame->gaze, 0, frame->t_ns, &r);
        if (i < settled) continue;
        *cpu_ms += (double)r.cpu_ms / count;
        *steps += (double)r.rays[FV_RAY_MARCH_STEPS] / count;
    }
}

static void judge(struct fv_frame *f, struct entry *e, int place)
{
    const struct fv_metrics_picture full = {f->width, f->height, 3, 3 * (int64_t)f->width, bench.picture};
    struct fv_metrics_picture own = fv_picture_present(f, bench.of->workers);
    struct fv_errors errors;
    fv_metrics_compare(bench.metrics, bench.of->workers, &full, &own, bench.zone, &errors);
    e->ssim[place] = errors.ssim[FV_ZONE_ALL];
    e->flip[place] = errors.flip[FV_ZONE_ALL];
}

static void render_entry(struct entry *e, int place, const struct fv_sweep_frame *frame, double full_ms, double full_steps)
{
    struct fv_config *c = &bench.config[1];
    bool full = e->kind == PLAIN || e->kind == RELAXED;
    struct fv_contender *contender = full ? &bench.full : &bench.pyramid;
    double steps;
    c->fovea_inner_deg = e->fovea_deg;
    c->method_refresh = e->refresh;
    c->method_ssaa = bench.ssaa;
    c->method_ssaa_middle = e->kind == FIPR ? bench.ssaa : 1;
    bench.pyramid.loop.frame.pyramid.foveated = e->kind >= FIPR;
    contender->loop.frame.tracer = e->kind == UNCULLED  ? &bench.unculled
                                   : e->kind == PLAIN   ? &bench.plain
                                   : e->kind == RELAXED ? &bench.relaxed
                                                        : bench.of->tracer;
    render(contender, frame, e->kind >= FIPR ? SETTLED : 0, e->refresh, &e->cpu_ms[place], &steps);
    e->speedup[place] = full_ms / e->cpu_ms[place];
    e->steps[place] = full_steps / steps;
    judge(&contender->loop.frame, e, place);
}

/* Full, and each entry beside it. */
static void render_place(int place)
{
    struct fv_sweep_frame frame;
    double ms[2], steps[2];
    latch(place, &frame);
    for (int culled = 0; culled < 2; culled++) {
        if (!culled && bench.ssaa > 1 && bench.ssaa < 16) continue;
        bench.full.loop.frame.tracer = culled ? bench.of->tracer : &bench.unculled;
        render(&bench.full, &frame, 0, 1, &ms[culled], &steps[culled]);
    }
    bench.full_ms[place] = ms[1];
    struct fv_metrics_picture full = fv_picture_present(&bench.full.loop.frame, bench.of->workers);
    fv_picture_pack(&full, bench.picture);
    fv_zones_of_view(&bench.full.loop.frame.view[0], bench.zone);
    for (int i = 0; i < bench.entries; i++) {
        int culled = bench.entry[i].kind != UNCULLED;
        render_entry(&bench.entry[i], place, &frame, ms[culled], steps[culled]);
    }
}

/* What the paper prints of it. */
static double printed(const struct scene *s, const struct entry *e, const char *quantity)
{
    bool ipr = e->kind == IPR, fipr = e->kind == FIPR, ssaa1 = bench.ssaa == 1, ssaa16 = bench.ssaa == 16;
    bool at = e->fovea_deg > 7 && e->fovea_deg < 8;
    if (strcmp(quantity, "speedup") == 0) {
        if (fipr && at && ssaa1 && e->refresh == 1) return s->least;
        if (fipr && at && ssaa16 && e->refresh == 4) return s->most;
        if (fipr && e->fovea_deg > 14 && ssaa1 && e->refresh == 1) return s->widest;
        if (fipr && e->fovea_deg < 3 && ssaa16 && e->refresh == 4) return s->narrowest;
        return NONE;
    }
    if (!ssaa1 || e->refresh != 1 || !(ipr || (fipr && at))) return NONE;
    return strcmp(quantity, "ssim") == 0 ? ipr ? s->ssim_ipr : s->ssim : ipr ? s->flip_ipr : s->flip;
}

static void add_cells(const struct scene *s, struct entry *e, struct fv_sheet *sheet)
{
    char row[64];
    snprintf(row, sizeof row, "%s/%s/ssaa%d/fovea%g/refresh%d", s->name, kind_names[e->kind], bench.ssaa, e->fovea_deg,
             e->refresh);
    fv_sheet_add(sheet, row, "speedup", "", printed(s, e, "speedup"), fv_rank_quartiles(e->speedup, bench.places).value);
    fv_sheet_add(sheet, row, "steps_ratio", "", NONE, fv_rank_quartiles(e->steps, bench.places).value);
    fv_sheet_add(sheet, row, "ssim", "", printed(s, e, "ssim"), fv_rank_quartiles(e->ssim, bench.places).value);
    fv_sheet_add(sheet, row, "flip", "", printed(s, e, "flip"), fv_rank_quartiles(e->flip, bench.places).value);
    fv_sheet_add(sheet, row, "cpu_ms", "ms", NONE, fv_rank_quartiles(e->cpu_ms, bench.places).value);
    if (e->kind == IPR)
        fv_sheet_add(sheet, row, "cpu_ms_full", "ms", NONE, fv_rank_quartiles(bench.full_ms, bench.places).value);
}

static int measure(int n, const struct fv_table_bench *of, struct fv_sheet *sheet)
{
    const struct scene *scene = &scenes[n / SSAAS];
    open_bench(of, ssaas[n % SSAAS]);
    for (int place = 0; place < bench.places; place++) {
        char what[48];
        snprintf(what, sizeof what, "%s, %d a pixel", scene->name, bench.ssaa);
        if (of->io->stopped(of->io->context)) return 1;
        of->io->progress(of->io->context, what, (double)place / bench.places);
        render_place(place);
    }
    for (int i = 0; i < bench.entries; i++) add_cells(scene, &bench.entry[i], sheet);
    return 0;
}

const struct fv_table fv_table_polychronakis2023 = {
    .name = "polychronakis2023",
    .paper = "Polychronakis et al. 2023",
    .what = "Figures 11 and 12, Table 1: speed-up of pyramid over full marching by scene, samples, fovea and refresh",
    .frames = 3,
    .parts = SCENES * SSAAS,
    .part = part,
    .measure = measure,
};
