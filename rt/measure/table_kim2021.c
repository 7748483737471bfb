/* table_kim2021: Tables 2 and 3 and Figures 6 to 8 of Kim, Ko and Ihm 2021, "Selective Foveated Ray Tracing
 * for Head-Mounted Displays", a part each, Table 2 one a scene: pictures of 1280 x 1440 pixels an eye (Rift
 * S), rays that are reflected or refracted at most three times, light from points alone, without smoothing
 * and reuse but where these are what is measured.
 *
 * table2-SCENE    time, rays and errors of 36 samples a pixel, of one, of selective-only (Jin et al. 2009)
 * and of selective, with every pixel of the periphery and with a share of them table3-sponza   errors by what
 * smoothing weighs the newest picture with figure6-sponza  how many pixels are reused, and what that changes,
 * by tau_reuse figure7-atrium  two curves of tolerance, and where samples go by them figure8-atrium  where
 * samples go by selective and by selective-only
 *
 * Figures 7 and 8 are of the method as published, every extra sample a ray where pixels differ; in the tables selective
 * has what is ours, too, and selective-only is as published.
 *
 * Of the paper's scenes Sponza is at hand; for its Power Plant there is `pipes`, for its Interior `atrium`,
 * both ours; sibenik is not in the paper. */
#include "rt/measure/table_kim2021.h"

#include "rt/measure/lamp.h"
#include "rt/measure/rank.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* What a section's parts have besides. */
static const char *const both_eyes[] = {"display.eyes=2", NULL};
static const char *const one_eye[] = {"display.eyes=1", "selective.periphery=every", NULL};
static const char *const as_paper[] = {"display.eyes=1", "selective.periphery=every", "selective.spread=0",
                                       "selective.texture=trace", NULL};

static const struct part {
    const char *name, *scene, *setting;
    fv_kim2021_section *measure;
    const char *const *more; /* settings, NULL behind the last */
} parts[] = {
    {"table2-sponza", "sponza", "scene.name=sponza", fv_kim2021_speed, both_eyes},
    {"table2-pipes", "pipes", "scene.name=pipes", fv_kim2021_speed, both_eyes},
    {"table2-sibenik", "sibenik", "scene.name=sibenik", fv_kim2021_speed, both_eyes},
    {"table2-atrium", "atrium", "scene.name=atrium", fv_kim2021_speed, both_eyes},
    {"table3-sponza", "sponza", "scene.name=sponza", fv_kim2021_smoothing, one_eye},
    {"figure6-sponza", "sponza", "scene.name=sponza", fv_kim2021_reuse, one_eye},
    {"figure7-atrium", "atrium", "scene.name=atrium", fv_kim2021_tolerance, as_paper},
    {"figure8-atrium", "atrium", "scene.name=atrium", fv_kim2021_density, as_paper},
};
enum { PARTS = sizeof parts / sizeof parts[0] };

static void part(int n, int frames, struct fv_table_part *p)
{
    static const char *const always[] = {
        "display.headset=rift-s", "display.sink=png",   "output.overlay=off", "budget.adapt=off",
        "method.name=selective",  "method.spp=1",       "method.depth=3",     "eye.source=none",
        "imu.source=sim",         "selective.smooth=0", "selective.reuse=0"};
    (void)frames;
    *p = (struct fv_table_part){0};
    snprintf(p->name, sizeof p->name, "%s", parts[n].name);
    snprintf(p->scene, sizeof p->scene, "%s", parts[n].scene);
    for (size_t i = 0; i < sizeof always / sizeof always[0]; i++) p->setting[p->settings++] = always[i];
    p->setting[p->settings++] = parts[n].setting;
    for (int i = 0; parts[n].more[i]; i++) p->setting[p->settings++] = parts[n].more[i];
}

/* Whitted's light comes from points: such stand in the place of area lights. */
static void relight(int n, struct fv_scene *s)
{
    (void)n;
    for (int i = 0; i < s->lights; i++)
        if (s->light[i].kind == FV_LIGHT_AREA) s->light[i] = fv_lamp_of_area(&s->light[i]);
    if (s->features & FV_SCENE_AREA_LIGHTS) s->features |= FV_SCENE_POINT_LIGHTS;
    s->features &= ~(uint32_t)FV_SCENE_AREA_LIGHTS;
}

static int measure(int n, const struct fv_table_bench *bench, struct fv_sheet *sheet)
{
    return parts[n].measure(parts[n].scene, bench, sheet);
}

void fv_kim2021_add_psnr(struct fv_sheet *sheet, const char *row, const double *paper, int known,
                         double (*psnr)[FV_ZONES], int places)
{
    for (int z = 0; z < FV_ZONE_ALL; z++) {
        double value[FV_VANTAGE_PLACES_MAX];
        char quantity[40];
        int there = 0; /* a zone that a picture does not reach has none */
        for (int i = 0; i < places; i++)
            if (!isnan(psnr[i][z])) value[there++] = psnr[i][z];
        snprintf(quantity, sizeof quantity, "psnr_%s", fv_zones[z].name);
        fv_sheet_add(sheet, row, quantity, "dB", z < known ? paper[z] : (double)NAN,
                     fv_rank_quartiles(value, there).value);
    }
}

const struct fv_table fv_table_kim2021 = {
    .name = "kim2021",
    .paper = "Kim, Ko and Ihm 2021",
    .what = "Tables 2 and 3, Figures 6 to 8: selective against 36 samples a pixel and against selective-only",
    .headline = "speedup_vs_36spp",
    .over = "36 samples a pixel",
    .frames = 12,
    .parts = PARTS,
    .part = part,
    .relight = relight,
    .measure = measure,
};
