/* table_weier2016: Table 1 of Weier et al. 2016, "Foveated Real-Time Ray Tracing for Head-Mounted Displays", and
 * its Figure 5: one eye of 1182 x 1464 pixels on a fly-through of 1000 frames, three kinds of light, at the
 * medium foveal region and, on Sponza, at small, large and full ones.
 *
 * Light, by the paper's counts of rays (Sibenik: 2, 9 and 17 rays a pixel of the full renderer): a point light; in
 * its place a square light of 0.5 m that shines to both sides, 8 shadow rays, as bright along its axis; ambient
 * occlusion of 16 rays and no other light. The paper's other scenes, Rungholt and Urban Sprawl, are not at hand;
 * atrium and cornell are not in the paper. */
#include "rt/measure/flight.h"
#include "rt/measure/lamp.h"
#include "rt/measure/table.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define NONE ((double)NAN)

enum { PATH_FRAMES = 1000 };
enum lighting { POINT, AREA, OCCLUSION, LIGHTINGS };

static const char *const light_names[LIGHTINGS] = {"point", "area", "ao"};
static const char *const light_settings[LIGHTINGS][3] = {
    {"method.ao_spp=0"}, {"method.ao_spp=0", "method.area_spp=8"}, {"method.ao_spp=16"}};

/* Table 1: rays in millions, times in ms. */
struct printed {
    double rays_full, rays, reproject, tracing, cache_update, merge, post, full_ms, ms, speedup;
};
static const struct scene {
    const char *name, *setting;
    bool figure; /* it is the one of Figure 5 */
    struct printed printed[LIGHTINGS]; /* rays_full 0: not in the paper */
} scenes[] = {
    {"sponza", "scene.name=sponza", true,
     {{3.46, 0.64, 1.41, 4.43, 0.58, 0.84, 0.00, 13.93, 7.26, 1.92},
      {15.54, 2.89, 1.44, 20.07, 0.58, 0.83, 0.24, 81.61, 23.17, 3.52},
      {29.36, 5.45, 1.43, 39.79, 0.58, 0.83, 0.24, 179.01, 42.87, 4.18}}},
    {"sibenik", "scene.name=sibenik", false,
     {{3.46, 0.81, 1.41, 3.85, 0.64, 0.84, 0.00, 10.74, 6.74, 1.59},
      {15.57, 3.64, 1.51, 14.80, 0.67, 0.85, 0.33, 47.96, 18.36, 2.61},
      {29.42, 6.88, 1.45, 27.96, 0.64, 0.83, 0.32, 94.64, 31.39, 3.02}}},
    {.name = "atrium", .setting = "scene.name=atrium"},
    {.name = "cornell", .setting = "scene.name=cornell"},
};
enum { SCENES = sizeof scenes / sizeof scenes[0] };

/* Section 4.2.1. `full`, all pixels, is the full renderer. Medium is Table 1's. */
static const struct {
    const char *name;
    struct fv_foveal foveal;
} regions[] = {{"medium", {10, 20, 0.05f}}, {"small", {5, 10, 0.01f}}, {"large", {15, 30, 0.1f}}};
enum { REGIONS = sizeof regions / sizeof regions[0], MEDIUM = 0 };

static const struct scene *scene_of(int n)
{
    return &scenes[n / LIGHTINGS];
}

static void part(int n, int frames, struct fv_table_part *p)
{
    static const char *const always[] = {"display.eyes=1",    "display.sink=png",  "output.overlay=off",
                                         "budget.adapt=off",  "method.name=reproject", "method.spp=1",
                                         "eye.source=none",   "imu.source=sim"};
    *p = (struct fv_table_part){.path_frames = frames > PATH_FRAMES ? frames : PATH_FRAMES};
    snprintf(p->name, sizeof p->name, "%s-%s", scene_of(n)->name, light_names[n % LIGHTINGS]);
    snprintf(p->scene, sizeof p->scene, "%s", scene_of(n)->name);
    for (size_t i = 0; i < sizeof always / sizeof always[0]; i++) p->setting[p->settings++] = always[i];
    p->setting[p->settings++] = scene_of(n)->setting;
    for (int i = 0; light_settings[n % LIGHTINGS][i]; i++)
        p->setting[p->settings++] = light_settings[n % LIGHTINGS][i];
}

/* ---- light ---- */

static const float side_m = 0.5f;

/* The scene's first point light; where it has none, its first area light as a point in front of its middle, as
 * bright along the axis; where it has neither, one in the middle of the scene that is as bright as white walls
 * would want. */
static struct fv_light lamp_of(const struct fv_scene *s)
{
    struct fv_light lamp = {.kind = FV_LIGHT_POINT};
    float across = 0;
    for (int i = 0; i < s->lights; i++)
        if (s->light[i].kind == FV_LIGHT_POINT) return s->light[i];
    for (int i = 0; i < s->lights; i++)
        if (s->light[i].kind == FV_LIGHT_AREA) return fv_lamp_of_area(&s->light[i]);
    for (int k = 0; k < 3; k++) {
        lamp.position[k] = (s->bounds[0][k] + s->bounds[1][k]) / 2;
        across = fmaxf(across, s->bounds[1][k] - s->bounds[0][k]);
    }
    for (int k = 0; k < 3; k++) lamp.colour[k] = across * across / 4;
    return lamp;
}

/* A square in the lamp's place that shines downwards, or upwards. Along its axis a square of area A and radiance
 * L is as bright as a point of radiant intensity L A. */
static struct fv_light square_of(const struct fv_light *lamp, bool up)
{
    struct fv_light l = {.kind = FV_LIGHT_AREA, .u = {side_m, 0, 0}, .v = {0, 0, up ? -side_m : side_m}};
    for (int k = 0; k < 3; k++) {
        l.position[k] = lamp->position[k] - (l.u[k] + l.v[k]) / 2;
        l.colour[k] = lamp->colour[k] / (side_m * side_m);
    }
    return l;
}

static void relight(int n, struct fv_scene *s)
{
    struct fv_light lamp = lamp_of(s);
    s->features &= ~(uint32_t)(FV_SCENE_POINT_LIGHTS | FV_SCENE_AREA_LIGHTS | FV_SCENE_SUN);
    s->lights = 0;
    switch ((enum lighting)(n % LIGHTINGS)) {
    case POINT:
        s->features |= FV_SCENE_POINT_LIGHTS;
        s->light[s->lights++] = lamp;
        break;
    case AREA:
        s->features |= FV_SCENE_AREA_LIGHTS;
        s->light[s->lights++] = square_of(&lamp, false);
        s->light[s->lights++] = square_of(&lamp, true);
        break;
    default: break;
    }
}

/* ---- cells ---- */

static double or_none(double value, bool known)
{
    return known ? value : NONE;
}

/* The paper's stages and the frame's own; those that trace hold what the paper counts as merging and updating
 * the cache, too. */
static void add_stages(const struct fv_flight *f, const char *row, const struct printed *p, bool known,
                       struct fv_sheet *sheet)
{
    const struct fv_session *s = &f->side[1].own.session;
    char name[40];
    for (int i = 0; i < s->stages; i++) {
        bool reproject = strcmp(s->stage[i], "reproject") == 0;
        snprintf(name, sizeof name, "stage_%.24s_ms", s->stage[i]);
        fv_sheet_add(sheet, row, name, "ms", or_none(p->reproject, known && reproject),
                     fv_flight_median(f, 1, fv_flight_stage_ms, i).value);
    }
    if (!known) return;
    fv_sheet_add(sheet, row, "stage_tracing_ms", "ms", p->tracing, NONE);
    fv_sheet_add(sheet, row, "stage_cache_update_ms", "ms", p->cache_update, NONE);
    fv_sheet_add(sheet, row, "stage_merge_ms", "ms", p->merge, NONE);
    fv_sheet_add(sheet, row, "stage_post_ms", "ms", p->post, NONE);
}

static void add_table(const struct fv_flight *f, const char *row, const struct printed *p,
                      struct fv_sheet *sheet)
{
    bool known = p->rays_full > 0;
    fv_sheet_add(sheet, row, "rays_full", "rays", or_none(1e6 * p->rays_full, known),
                 fv_flight_mean(f, 0, fv_flight_rays, 0));
    fv_sheet_add(sheet, row, "rays", "rays", or_none(1e6 * p->rays, known),
                 fv_flight_mean(f, 1, fv_flight_rays, 0));
    fv_sheet_add(sheet, row, "frame_ms_full", "ms", or_none(p->full_ms, known),
                 fv_flight_median(f, 0, fv_flight_frame_ms, 0).value);
    fv_sheet_add(sheet, row, "frame_ms", "ms", or_none(p->ms, known),
                 fv_flight_median(f, 1, fv_flight_frame_ms, 0).value);
    struct fv_measured speedup = fv_flight_speedup(f, 1);
    fv_sheet_add(sheet, row, "speedup", "", or_none(p->speedup, known), speedup.value);
    fv_sheet_add(sheet, row, "speedup_p25", "", NONE, speedup.low);
    fv_sheet_add(sheet, row, "speedup_p75", "", NONE, speedup.high);
    fv_sheet_add(sheet, row, "sampled_fraction", "", NONE, fv_flight_mean(f, 1, fv_flight_sampled, 0));
    add_stages(f, row, p, known, sheet);
}

/* A bar of Figure 5. Its numbers are not in the text; those of the medium region and of the full renderer are
 * Table 1's. */
static void add_bar(const struct fv_flight *f, int side, const char *scene, int light, const char *region,
                    const struct printed *p, struct fv_sheet *sheet)
{
    char row[48];
    bool full = side == 0, known = full || side == 1 + MEDIUM;
    double paper_ms = full ? p->full_ms : p->ms;
    double ms = fv_flight_median(f, side, fv_flight_frame_ms, 0).value;
    snprintf(row, sizeof row, "%s/%s/%s", scene, light_names[light], region);
    fv_sheet_add(sheet, row, "rays", "rays", or_none(1e6 * (full ? p->rays_full : p->rays), known),
                 fv_flight_mean(f, side, fv_flight_rays, 0));
    fv_sheet_add(sheet, row, "frame_ms", "ms", or_none(paper_ms, known), ms);
    fv_sheet_add(sheet, row, "fps", "Hz", or_none(1e3 / paper_ms, known), 1e3 / ms);
    fv_sheet_add(sheet, row, "speedup", "", or_none(full ? 1 : p->speedup, known),
                 full ? 1 : fv_flight_speedup(f, side).value);
}

static int measure(int n, const struct fv_table_bench *b, struct fv_sheet *sheet)
{
    static struct fv_flight f;
    char row[48];
    const struct scene *scene = scene_of(n);
    int light = n % LIGHTINGS;
    const struct printed *printed = &scene->printed[light];
    f = (struct fv_flight){.frames = b->frames, .path_frames = PATH_FRAMES, .sides = 1};
    f.side[0] = (struct fv_flight_side){.method = "full", .foveal = {180, 180, 1}};
    for (int i = 0; i < (scene->figure ? REGIONS : 1); i++)
        f.side[f.sides++] = (struct fv_flight_side){.method = "reproject", .foveal = regions[i].foveal};
    fv_flight_open(&f, b->config, b->tracer, b->workers, b->io);
    snprintf(row, sizeof row, "%s/%s", scene->name, light_names[light]);
    if (fv_flight_run(&f, row)) return 1;
    add_table(&f, row, printed, sheet);
    if (!scene->figure) return 0;
    static const int order[] = {1, MEDIUM, 2}; /* small, medium, large */
    for (int i = 0; i < REGIONS; i++)
        add_bar(&f, 1 + order[i], scene->name, light, regions[order[i]].name, printed, sheet);
    add_bar(&f, 0, scene->name, light, "full", printed, sheet);
    return 0;
}

const struct fv_table fv_table_weier2016 = {
    .name = "weier2016",
    .paper = "Weier et al. 2016",
    .what = "Table 1 and Figure 5: speed-up of reproject over full by scene, light and foveal region",
    .headline = "speedup",
    .over = "full",
    .frames = PATH_FRAMES,
    .parts = SCENES * LIGHTINGS,
    .part = part,
    .relight = relight,
    .measure = measure,
};
