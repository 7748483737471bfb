/* method: the table of methods. */
#include "rt/method/method.h"

#include <string.h>

/* Supersampling: each level twice the samples of the one before. */
static void full_parameters(const struct fv_config *config, int level, struct fv_parameters *out)
{
    *out = (struct fv_parameters){.foveal = {180, 180, 1},
                                  .spp = (int)config->method_spp << level,
                                  .spacing = (int)config->method_support};
}

/* From the whole image sharp to the smallest that is safe, each at about three quarters of the time of the
 * one before: p_min gives way first, then the radii, at last the support image, which is never sparser than every
 * 16 pixels. */
static const struct {
    float p_min, radius; /* radius: of what the settings say */
    int support;         /* the same, of the spacing */
} reproject_levels[] = {
    {1, 1, 1},     {0.4f, 1, 1},     {0.2f, 1, 1},      {0.1f, 1, 1},      {0.05f, 1, 1},
    {0.02f, 1, 1}, {0.01f, 0.6f, 1}, {0.01f, 0.26f, 1}, {0.004f, 0.26f, 2},
};
enum { REPROJECT_LEVELS = 1 + sizeof reproject_levels / sizeof reproject_levels[0] };

/* r0 is never below the fovea nor below what the settings ask for, where that is less. */
static void scale_radii(struct fv_foveal *f, float r0, float r1)
{
    float floor_deg = f->r0_deg < FV_FOVEA_DEG ? f->r0_deg : FV_FOVEA_DEG;
    f->r0_deg = f->r0_deg * r0 > floor_deg ? f->r0_deg * r0 : floor_deg;
    f->r1_deg = f->r1_deg * r1 > f->r0_deg ? f->r1_deg * r1 : f->r0_deg;
}

static void reproject_parameters(const struct fv_config *config, int level, struct fv_parameters *out)
{
    struct fv_foveal f = {(float)config->fovea_inner_deg, (float)config->fovea_outer_deg,
                          (float)config->fovea_p_min};
    int spacing = (int)config->method_support;
    if (level > 0) {
        scale_radii(&f, reproject_levels[level - 1].radius, reproject_levels[level - 1].radius);
        f.p_min = reproject_levels[level - 1].p_min;
        spacing *= reproject_levels[level - 1].support;
        if (spacing > 16) spacing = 16;
    }
    *out = (struct fv_parameters){.foveal = f, .spp = 1, .spacing = spacing};
}

/* From twice the settings' radius and probability to the least of all. */
static const struct {
    float radius, p_scale; /* factors */
    int refresh, ssaa;     /* refresh: times as long; ssaa: a part of */
} pyramid_levels[] = {{2, 2, 1, 1}, {1, 1, 1, 1}, {1, 1, 2, 1}, {1, 0.5f, 2, 4}, {0.7f, 0.5f, 4, 4}, {0.5f, 0, 4, 16}};
enum { PYRAMID_LEVELS = 1 + sizeof pyramid_levels / sizeof pyramid_levels[0] };

static void pyramid_parameters(const struct fv_config *config, int level, struct fv_parameters *out)
{
    *out = (struct fv_parameters){
        .foveal = {(float)config->fovea_inner_deg, (float)config->fovea_outer_deg, 0},
        .spp = (int)config->method_ssaa,
        .spp_middle = (int)config->method_ssaa_middle,
        .spacing = (int)config->method_support,
        .p_scale = (float)config->method_p_scale,
        .refresh = (int)config->method_refresh,
    };
    if (level == 0) return;
    scale_radii(&out->foveal, pyramid_levels[level - 1].radius, 1);
    out->p_scale *= pyramid_levels[level - 1].p_scale;
    out->refresh *= pyramid_levels[level - 1].refresh;
    out->spp = (out->spp + pyramid_levels[level - 1].ssaa - 1) / pyramid_levels[level - 1].ssaa;
    out->spp_middle = (out->spp_middle + pyramid_levels[level - 1].ssaa - 1) / pyramid_levels[level - 1].ssaa;
}

static const struct fv_method table[] = {
    {"full",
     "every pixel, method.spp samples each: the baseline and, at many samples, the reference",
     {&fv_pass_sample_all},
     1,
     5,
     full_parameters},
    {"reproject",
     "foveated sampling over the last frame's reprojected picture (Weier et al. 2016)",
     {&fv_pass_select, &fv_pass_support, &fv_pass_reproject, &fv_pass_sample},
     REPROJECT_LEVELS,
     REPROJECT_LEVELS,
     reproject_parameters},
    {"pyramid",
     "sphere tracing of fields by an inverted pyramid of resolutions (Polychronakis et al. 2023)",
     {&fv_pass_march, &fv_pass_mask, &fv_pass_trace, &fv_pass_compose},
     PYRAMID_LEVELS,
     PYRAMID_LEVELS,
     pyramid_parameters},
};

const struct fv_method *fv_method_at(int n)
{
    return n >= 0 && n < (int)(sizeof table / sizeof table[0]) ? &table[n] : NULL;
}

const struct fv_method *fv_method_find(const char *name)
{
    for (int i = 0; fv_method_at(i); i++)
        if (strcmp(table[i].name, name) == 0) return &table[i];
    return NULL;
}
