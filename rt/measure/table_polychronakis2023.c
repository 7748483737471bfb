/* table_polychronakis2023: Figures 11 and 12 and Table 1 of Polychronakis et al. 2023, "An Inverted Pyramid
 * Acceleration Structure Guiding Foveated Sphere Tracing for Implicit Surfaces in VR": speed-up over full marching
 * of IPR and FIPR by scene, samples a pixel, radius of the fovea and refresh rate of what lies outside it, as steps
 * and as CPU time; SSIM and FLIP, at 7.5 degrees by eccentricity, too. One eye; counted "frames" are places along
 * the scene's path, at each of which full and every other are rendered in turn, standing still for a warm frame and
 * then a whole round of refreshing; or coming to it with a head that turns and moves.
 *
 * Rows are SCENE/KIND/ssaaN/foveaDEG/refreshN. KIND: ipr, every pixel (fovea180); fipr, N samples of the fovea, of
 * edges and of the middle level too, as the paper has it; fipr-masked, N samples only of the fovea and of edges. For
 * 1 and 16 samples: ipr-unculled, where neither side leaves parts of the fields out; ipr-minimum and fipr-minimum,
 * whose rays start at the paper's least of 3 x 3 distances; fipr-unrefined, where colours that differ stay as the
 * lower levels have them; fipr-paper, which has neither that nor our lowest level nor carries anything over. For one
 * sample: fipr-turning and fipr-turning-stays, the head turning, what is not refreshed carried over or standing as
 * in the paper; and full itself by other steps (full-plain, full-relaxed) than those of the settings, which all
 * others take, full too. Scenes are ours, after the paper's. */
#include "rt/measure/table.h"

#include "platform/arena.h"
#include "rt/measure/picture.h"
#include "rt/measure/rank.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
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

enum kind_name { IPR, UNCULLED, IPR_MINIMUM, PLAIN, RELAXED, FIPR, MASKED, FIPR_MINIMUM, UNREFINED, PAPERS, TURNING, STAYING, KINDS };
static const struct kind {
    const char *name;
    bool full;     /* not the pyramid */
    bool foveated; /* else every pixel is masked */
    bool one;      /* sample a pixel of the lower levels */
    bool minimum;  /* starts as in the paper */
    bool middle;   /* nothing below the middle level */
    bool unrefined; /* colours that differ stay as the lower levels have them */
    bool stays;    /* what is not refreshed is not carried over */
    bool turning;
    bool beside_paper;
} kinds[KINDS] = {
    [IPR] = {.name = "ipr", .beside_paper = true},
    [UNCULLED] = {.name = "ipr-unculled"},
    [IPR_MINIMUM] = {.name = "ipr-minimum", .minimum = true, .beside_paper = true},
    [PLAIN] = {.name = "full-plain", .full = true},
    [RELAXED] = {.name = "full-relaxed", .full = true},
    [FIPR] = {.name = "fipr", .foveated = true, .beside_paper = true},
    [MASKED] = {.name = "fipr-masked", .foveated = true, .one = true},
    [FIPR_MINIMUM] = {.name = "fipr-minimum", .foveated = true, .minimum = true},
    [UNREFINED] = {.name = "fipr-unrefined", .foveated = true, .unrefined = true},
    [PAPERS] = {.name = "fipr-paper", .foveated = true, .minimum = true, .middle = true, .unrefined = true, .stays = true,
                .beside_paper = true},
    [TURNING] = {.name = "fipr-turning", .foveated = true, .turning = true},
    [STAYING] = {.name = "fipr-turning-stays", .foveated = true, .stays = true, .turning = true},
};
enum { ENTRIES_MAX = 18 + 2 * FOVEAS * REFRESHES, PLACES_MAX = 64, SETTLED = 1, SETTLED_TURNING = 5 };

/* Errors are also taken apart by eccentricity, at the radius of Table 1. */
#define TABLE_1_DEG 7.5
static const double limits_deg[] = {TABLE_1_DEG, 20};
enum { LIMITS = sizeof limits_deg / sizeof limits_deg[0] };
static const struct {
    const char *suffix; /* of the quantity */
    int zone;
} areas[] = {{"", FV_ZONE_ALL}, {"_fovea", 0}, {"_mid", 1}, {"_far", 2}};
enum { AREAS = sizeof areas / sizeof areas[0], OFF = 16 };

/* Of a head that turns. */
static const double turn_deg_s = 20, aside_m_s = 0.3;

/* One way of rendering, and what was measured at each place. */
struct entry {
    const struct kind *kind;
    double fovea_deg;
    int refresh;
    double speedup[PLACES_MAX], steps[PLACES_MAX], cpu_ms[PLACES_MAX];
    double ssim[AREAS][PLACES_MAX], flip[AREAS][PLACES_MAX];
    double off[PLACES_MAX]; /* pixels that are off by more than OFF of 255, in a million */
};

static struct bench {
    const struct fv_table_bench *of;
    int ssaa, entries, places;
    struct fv_config config[2];
    struct fv_contender full, pyramid;
    struct fv_tracer tracer[KINDS]; /* by which each kind is rendered */
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
                                         "method.carry=on", /* its buffers */
                                         /* Without culling rays along the ground take thousands. */
                                         "method.march_steps=8192"};
    (void)frames;
    *p = (struct fv_table_part){0};
    snprintf(p->name, sizeof p->name, "%s-ssaa%d", scenes[n / SSAAS].name, ssaas[n % SSAAS]);
    snprintf(p->scene, sizeof p->scene, "%s", scenes[n / SSAAS].name);
    for (size_t i = 0; i < sizeof always / sizeof always[0]; i++) p->setting[p->settings++] = always[i];
    p->setting[p->settings++] = scenes[n / SSAAS].setting;
}

static void add_entry(enum kind_name kind, double fovea_deg, int refresh)
{
    bench.entry[bench.entries++] = (struct entry){.kind = &kinds[kind], .fovea_deg = fovea_deg, .refresh = refresh};
}

/* Where all there is is compared: not between, as it takes long. */
static bool whole(int ssaa)
{
    return ssaa == 1 || ssaa == 16;
}

static void add_whole(int ssaa)
{
    add_entry(UNCULLED, 180, 1);
    add_entry(IPR_MINIMUM, 180, 1);
    add_entry(FIPR_MINIMUM, TABLE_1_DEG, 1);
    for (int kind = UNREFINED; kind <= PAPERS; kind++) {
        add_entry((enum kind_name)kind, TABLE_1_DEG, 1);
        add_entry((enum kind_name)kind, TABLE_1_DEG, 4);
    }
    if (ssaa > 1) return;
    for (int kind = PLAIN; kind <= RELAXED; kind++) add_entry((enum kind_name)kind, 180, 1);
    for (int r = 0; r < REFRESHES; r++) add_entry(TURNING, TABLE_1_DEG, refreshes[r]);
    for (int r = 1; r < REFRESHES; r++) add_entry(STAYING, TABLE_1_DEG, refreshes[r]);
}

static void add_entries(int ssaa)
{
    bench.entries = 0;
    add_entry(IPR, 180, 1);
    if (whole(ssaa)) add_whole(ssaa);
    for (int kind = FIPR; kind <= (ssaa > 1 ? MASKED : FIPR); kind++)
        for (int f = 0; f < FOVEAS; f++)
            for (int r = 0; r < REFRESHES; r++) add_entry((enum kind_name)kind, foveas_deg[f], refreshes[r]);
}

static void open_bench(const struct fv_table_bench *of, int ssaa)
{
    static const char *const methods[2] = {"full", "pyramid"};
    struct fv_contender *contender[2] = {&bench.full, &bench.pyramid};
    bench = (struct bench){.of = of, .ssaa = ssaa};
    for (int i = 0; i < KINDS; i++) bench.tracer[i] = *of->tracer;
    bench.places = of->frames < PLACES_MAX ? of->frames : PLACES_MAX;
    bench.tracer[UNCULLED].culling = false;
    bench.tracer[PLAIN].stepping = FV_STEPPING_PLAIN;
    bench.tracer[RELAXED].stepping = FV_STEPPING_RELAXED;
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

/* Where a head that comes to the place is so many frames before. */
static void come(const struct fv_sweep_frame *place, int frames, struct fv_pose *head, int64_t *t_ns)
{
    double before_s = frames / bench.of->config->budget_hz;
    struct fv_pose way = {.position_m = {-aside_m_s * before_s, 0, 0}};
    fv_quat_from_yaw_pitch_roll(-turn_deg_s * before_s * M_PI / 180, 0, 0, way.rotation);
    fv_pose_compose(&place->head, &way, head);
    *t_ns = (int64_t)fmax((double)place->t_ns - 1e9 * before_s, 0);
}

/* Mean CPU time and steps of a frame of `count`, after some that are not counted; the last one is at the place. */
static void render(struct fv_contender *c, const struct fv_sweep_frame *place, bool turning, int settled, int count,
                   double *cpu_ms, double *steps)
{
    struct fv_frame_record r;
    *cpu_ms = *steps = 0;
    fv_loop_restart(&c->loop);
    for (int i = 0; i < settled + count; i++) {
        struct fv_pose head = place->head;
        int64_t t_ns = place->t_ns;
        if (turning) come(place, settled + count - 1 - i, &head, &t_ns);
        fv_loop_frame(&c->loop, &head, place->gaze, 0, t_ns, &r);
        if (i < settled) continue;
        *cpu_ms += (double)r.cpu_ms / count;
        *steps += (double)r.rays[FV_RAY_MARCH_STEPS] / count;
    }
}

static double off_ppm(const struct fv_metrics_picture *a, const struct fv_metrics_picture *b)
{
    int64_t off = 0;
    for (int y = 0; y < a->height; y++) {
        const uint8_t *p = a->pixel + y * a->stride_bytes, *q = b->pixel + y * b->stride_bytes;
        for (int x = 0; x < a->width; x++, p += a->step, q += b->step)
            off += abs(p[0] - q[0]) > OFF || abs(p[1] - q[1]) > OFF || abs(p[2] - q[2]) > OFF;
    }
    return 1e6 * (double)off / ((double)a->width * a->height);
}

static void judge(struct fv_frame *f, struct entry *e, int place)
{
    const struct fv_metrics_picture full = {f->width, f->height, 3, 3 * (int64_t)f->width, bench.picture};
    struct fv_metrics_picture own = fv_picture_present(f, bench.of->workers);
    struct fv_errors errors;
    fv_metrics_compare(bench.metrics, bench.of->workers, &full, &own, bench.zone, &errors);
    for (int a = 0; a < AREAS; a++) {
        e->ssim[a][place] = errors.ssim[areas[a].zone];
        e->flip[a][place] = errors.flip[areas[a].zone];
    }
    e->off[place] = off_ppm(&full, &own);
}

static void render_entry(struct entry *e, int place, const struct fv_sweep_frame *frame, double full_ms, double full_steps)
{
    const struct kind *k = e->kind;
    struct fv_config *c = &bench.config[1];
    struct fv_contender *contender = k->full ? &bench.full : &bench.pyramid;
    struct fv_pyramid *p = &bench.pyramid.loop.frame.pyramid;
    double steps;
    c->fovea_inner_deg = e->fovea_deg;
    c->method_refresh = e->refresh;
    c->method_ssaa = bench.ssaa;
    c->method_ssaa_middle = k->one ? 1 : bench.ssaa;
    c->method_contrast = k->unrefined ? 1 : bench.of->config->method_contrast;
    p->foveated = k->foveated;
    p->minimum = k->minimum;
    p->lowest_deg = k->middle ? 181 : (float)c->method_lowest_deg;
    p->carry = bench.pyramid.plan.carry = !k->stays;
    contender->loop.frame.tracer = &bench.tracer[k - kinds];
    render(contender, frame, k->turning, k->turning ? SETTLED_TURNING : k->foveated ? SETTLED : 0, e->refresh,
           &e->cpu_ms[place], &steps);
    e->speedup[place] = full_ms / e->cpu_ms[place];
    e->steps[place] = full_steps / steps;
    judge(&contender->loop.frame, e, place);
}

/* Full, and each entry beside it. Returns 0; 1: stopped. */
static int render_place(int place, const char *what)
{
    const struct fv_sweep_io *io = bench.of->io;
    struct fv_sweep_frame frame;
    double ms[2], steps[2], done = (double)place / bench.places;
    io->progress(io->context, what, done);
    latch(place, &frame);
    for (int culled = 0; culled < 2; culled++) {
        if (!culled && !whole(bench.ssaa)) continue;
        bench.full.loop.frame.tracer = &bench.tracer[culled ? IPR : UNCULLED];
        render(&bench.full, &frame, false, 0, 1, &ms[culled], &steps[culled]);
    }
    bench.full_ms[place] = ms[1];
    struct fv_metrics_picture full = fv_picture_present(&bench.full.loop.frame, bench.of->workers);
    fv_picture_pack(&full, bench.picture);
    fv_zones_beyond(&bench.full.loop.frame.view[0], limits_deg, LIMITS, bench.zone);
    for (int i = 0; i < bench.entries; i++) {
        int culled = bench.entry[i].kind != &kinds[UNCULLED];
        if (io->stopped(io->context)) return 1;
        render_entry(&bench.entry[i], place, &frame, ms[culled], steps[culled]);
        io->progress(io->context, what, done + (i + 1.0) / bench.entries / bench.places);
    }
    return 0;
}

/* At the fovea of Table 1, or without one. */
static bool in_table_1(const struct entry *e)
{
    return !e->kind->foveated || fabs(e->fovea_deg - TABLE_1_DEG) < 0.1;
}

/* What the paper prints of it. */
static double printed(const struct scene *s, const struct entry *e, const char *quantity)
{
    bool fipr = e->kind->foveated, ssaa1 = bench.ssaa == 1, ssaa16 = bench.ssaa == 16;
    if (!e->kind->beside_paper) return NONE;
    if (strcmp(quantity, "speedup") == 0) {
        if (!fipr) return NONE;
        if (in_table_1(e) && ssaa1 && e->refresh == 1) return s->least;
        if (in_table_1(e) && ssaa16 && e->refresh == 4) return s->most;
        if (e->fovea_deg > 14 && ssaa1 && e->refresh == 1) return s->widest;
        if (e->fovea_deg < 3 && ssaa16 && e->refresh == 4) return s->narrowest;
        return NONE;
    }
    if (!ssaa1 || e->refresh != 1 || !in_table_1(e)) return NONE;
    return strcmp(quantity, "ssim") == 0 ? fipr ? s->ssim : s->ssim_ipr : fipr ? s->flip : s->flip_ipr;
}

const char *fv_row_polychronakis2023(const char *scene, const char *kind, int ssaa, double fovea_deg, int refresh)
{
    static char row[sizeof((struct fv_cell *)0)->row];
    snprintf(row, sizeof row, "%s/%s/ssaa%d/fovea%g/refresh%d", scene, kind, ssaa, fovea_deg, refresh);
    return row;
}

/* NaN where some place had none: an area that the picture does not reach. */
static double median(double *value)
{
    for (int i = 0; i < bench.places; i++)
        if (isnan(value[i])) return NONE;
    return fv_rank_quartiles(value, bench.places).value;
}

static void add_cells(const struct scene *s, struct entry *e, struct fv_sheet *sheet)
{
    const char *row = fv_row_polychronakis2023(s->name, e->kind->name, bench.ssaa, e->fovea_deg, e->refresh);
    char name[16];
    fv_sheet_add(sheet, row, "speedup", "", printed(s, e, "speedup"), median(e->speedup));
    fv_sheet_add(sheet, row, "steps_ratio", "", NONE, median(e->steps));
    for (int a = 0; a < (in_table_1(e) ? AREAS : 1); a++) {
        snprintf(name, sizeof name, "ssim%s", areas[a].suffix);
        fv_sheet_add(sheet, row, name, "", a ? NONE : printed(s, e, "ssim"), median(e->ssim[a]));
        snprintf(name, sizeof name, "flip%s", areas[a].suffix);
        fv_sheet_add(sheet, row, name, "", a ? NONE : printed(s, e, "flip"), median(e->flip[a]));
    }
    if (in_table_1(e)) fv_sheet_add(sheet, row, "off_pixels", "ppm", NONE, median(e->off));
    fv_sheet_add(sheet, row, "cpu_ms", "ms", NONE, median(e->cpu_ms));
    if (e->kind == &kinds[IPR]) fv_sheet_add(sheet, row, "cpu_ms_full", "ms", NONE, median(bench.full_ms));
}

static int measure(int n, const struct fv_table_bench *of, struct fv_sheet *sheet)
{
    const struct scene *scene = &scenes[n / SSAAS];
    char what[48];
    open_bench(of, ssaas[n % SSAAS]);
    snprintf(what, sizeof what, "%s, %d a pixel", scene->name, bench.ssaa);
    for (int place = 0; place < bench.places; place++)
        if (render_place(place, what)) return 1;
    for (int i = 0; i < bench.entries; i++) add_cells(scene, &bench.entry[i], sheet);
    return 0;
}

const struct fv_table fv_table_polychronakis2023 = {
    .name = "polychronakis2023",
    .paper = "Polychronakis et al. 2023",
    .what = "Figures 11 and 12, Table 1: speed-up of pyramid over full marching by scene, samples, fovea and refresh",
    .headline = "speedup",
    .over = "full",
    .frames = 3,
    .parts = SCENES * SSAAS,
    .part = part,
    .measure = measure,
};
