/* method: the table of methods. */
#include "rt/method/method.h"

#include <math.h>
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
    float radius, p_scale, contrast; /* factors */
    int refresh, ssaa;               /* refresh: times as long; ssaa: a part of */
} pyramid_levels[] = {{2, 2, 0.7f, 1, 1},   {1, 1, 1, 1, 1},         {1, 1, 1, 2, 1},
                      {1, 0.5f, 1.5f, 2, 4}, {0.7f, 0.5f, 2, 4, 4}, {0.5f, 0, 8, 4, 16}};
enum { PYRAMID_LEVELS = 1 + sizeof pyramid_levels / sizeof pyramid_levels[0] };

static void pyramid_parameters(const struct fv_config *config, int level, struct fv_parameters *out)
{
    *out = (struct fv_parameters){
        .foveal = {(float)config->fovea_inner_deg, (float)config->fovea_outer_deg, 0},
        .spp = (int)config->method_ssaa,
        .spp_middle = (int)config->method_ssaa_middle,
        .spacing = (int)config->method_support,
        .p_scale = (float)config->method_p_scale,
        .contrast = (float)config->method_contrast,
        .refresh = (int)config->method_refresh,
    };
    if (level == 0) return;
    scale_radii(&out->foveal, pyramid_levels[level - 1].radius, 1);
    out->p_scale *= pyramid_levels[level - 1].p_scale;
    out->contrast = fminf(out->contrast * pyramid_levels[level - 1].contrast, 1);
    out->refresh *= pyramid_levels[level - 1].refresh;
    out->spp = (out->spp + pyramid_levels[level - 1].ssaa - 1) / pyramid_levels[level - 1].ssaa;
    out->spp_middle = (out->spp_middle + pyramid_levels[level - 1].ssaa - 1) / pyramid_levels[level - 1].ssaa;
}

/* From twice the settings' care to the least of all: the central region gives way first, then what is sampled in its outer
 * parts, and tolerance; the fovea's samples at last. */
static const struct {
    float tolerance, near, p_min; /* factors */
    int samples[4];               /* at most so many */
} selective_levels[] = {
    {0.5f, 1, 2, {64, 64, 64, 64}},   {1, 1, 1, {64, 64, 64, 64}},      {1, 0.67f, 1, {64, 64, 2, 1}},
    {1.5f, 0.5f, 0.6f, {9, 4, 2, 1}}, {2, 0.4f, 0.4f, {9, 4, 1, 1}},    {3, 0.3f, 0.2f, {9, 2, 1, 1}},
    {4, 0.2f, 0.2f, {9, 1, 1, 1}},    {6, 0.15f, 0.1f, {4, 1, 1, 1}},
};
enum { SELECTIVE_LEVELS = 1 + sizeof selective_levels / sizeof selective_levels[0] };

/* The central region is sampled whole: for the passes of reproject it is the fovea. */
static void selective_parameters(const struct fv_config *config, int level, struct fv_parameters *out)
{
    float near = (float)config->selective_near_deg, p_min = (float)config->selective_p_min;
    *out = (struct fv_parameters){.spp = 1, .spacing = (int)config->method_support, .tolerance = 1};
    for (int r = 0; r < FV_REGIONS; r++)
        out->extra[r] = (int)config->selective_samples.value[r < FV_REGION_FAR ? r : FV_REGION_NEAR];
    if (level > 0) {
        float least = fminf(near, FV_FOVEA_DEG);
        near = fmaxf(near * selective_levels[level - 1].near, least);
        p_min = fminf(p_min * selective_levels[level - 1].p_min, 1);
        out->tolerance = selective_levels[level - 1].tolerance;
        for (int r = 0; r < FV_REGIONS; r++) {
            int most = selective_levels[level - 1].samples[r < FV_REGION_FAR ? r : FV_REGION_NEAR];
            if (out->extra[r] > most) out->extra[r] = most;
        }
    }
    out->near_deg = near;
    out->foveal = (struct fv_foveal){near, near, p_min};
    if (strcmp(config->selective_periphery, "every") == 0) out->foveal.p_min = 1;
}

/* Jin et al. 2009: always four samples, and the same tolerance everywhere. */
static void uniform_parameters(const struct fv_config *config, int level, struct fv_parameters *out)
{
    selective_parameters(config, level, out);
    out->even = true;
    for (int r = 0; r < FV_REGIONS; r++) out->extra[r] = 4;
}

/* From twice the settings' samples to the least of all: the outer layer gives way first, then the middle one and the radii, the
 * fovea's samples at last. */
static const struct {
    float radius, left_out; /* radius: of what the settings say; left_out: at least */
    float spp[3];           /* factors; at least 1 stays */
} denoise_levels[] = {
    {1.5f, 0, {2, 2, 2}},         {1, 0, {1, 1, 1}},              {1, 0, {1, 0.67f, 0.5f}},        {1, 0.5f, {1, 0.67f, 0.5f}},
    {0.7f, 0.5f, {1, 0.67f, 0.5f}}, {0.6f, 0.75f, {1, 0.67f, 0.5f}}, {0.4f, 0.75f, {0.5f, 0.34f, 0.5f}}, {0.26f, 0.9f, {0.25f, 0.34f, 0.5f}},
};
enum { DENOISE_LEVELS = 1 + sizeof denoise_levels / sizeof denoise_levels[0] };

static void denoise_parameters(const struct fv_config *config, int level, struct fv_parameters *out)
{
    *out = (struct fv_parameters){
        .foveal = {(float)config->fovea_inner_deg, (float)config->fovea_outer_deg, 1},
        .spp = 1,
        .spacing = (int)config->method_support,
        .left_out = (float)config->denoise_p,
        .radius_px = {(float)config->denoise_inner_px, (float)config->denoise_outer_px},
    };
    for (int n = 0; n < 3; n++) {
        out->layer_spp[n] = (int)config->denoise_spp.value[n];
        out->iterations[n] = (int)config->denoise_iterations.value[n];
    }
    if (level > 0) {
        scale_radii(&out->foveal, denoise_levels[level - 1].radius, denoise_levels[level - 1].radius);
        for (int i = 0; i < 2; i++) out->radius_px[i] *= denoise_levels[level - 1].radius;
        out->left_out = fmaxf(out->left_out, denoise_levels[level - 1].left_out);
        for (int n = 0; n < 3; n++) out->layer_spp[n] = (int)fmaxf(1, roundf((float)out->layer_spp[n] * denoise_levels[level - 1].spp[n]));
    }
    out->foveal.p_min = 1 - out->left_out;
}

#define SELECTIVE_PASSES                                                                                \
    .pass = {&fv_pass_select, &fv_pass_support, &fv_pass_reproject, &fv_pass_sample, &fv_pass_reuse, &fv_pass_refine, \
             &fv_pass_smooth},                                                                         \
    .every = {&fv_pass_gather, &fv_pass_reuse, &fv_pass_refine, &fv_pass_smooth}

static const struct fv_method table[] = {
    {"full", "every pixel, method.spp samples each: the baseline and, at many samples, the reference",
     .pass = {&fv_pass_sample_all}, .levels = 1, .measured = 5, .parameters = full_parameters},
    {"reproject", "foveated sampling over the last frame's reprojected picture (Weier et al. 2016)",
     .pass = {&fv_pass_select, &fv_pass_support, &fv_pass_reproject, &fv_pass_sample}, .levels = REPROJECT_LEVELS,
     .measured = REPROJECT_LEVELS, .parameters = reproject_parameters},
    {"selective", "extra samples where pixels differ and the eye looks (Kim et al. 2021)", SELECTIVE_PASSES,
     .levels = SELECTIVE_LEVELS, .measured = SELECTIVE_LEVELS, .parameters = selective_parameters},
    {"selective-uniform", "extra samples where pixels differ, wherever the eye looks (Jin et al. 2009)", SELECTIVE_PASSES,
     .levels = 1, .measured = 1, .parameters = uniform_parameters},
    {"denoise", "path tracing, sampled and filtered by layers around the gaze (Peres et al. 2023)",
     .pass = {&fv_pass_distribute, &fv_pass_paths, &fv_pass_accumulate, &fv_pass_fill, &fv_pass_settle, &fv_pass_across_16, &fv_pass_down_16,
              &fv_pass_across_8, &fv_pass_down_8, &fv_pass_across_4, &fv_pass_down_4, &fv_pass_across_2, &fv_pass_down_2,
              &fv_pass_across_1, &fv_pass_down_1, &fv_pass_light_up},
     .levels = DENOISE_LEVELS, .measured = DENOISE_LEVELS, .by_paths = true, .parameters = denoise_parameters},
    {"pyramid", "sphere tracing of fields by an inverted pyramid of resolutions (Polychronakis et al. 2023)",
     .pass = {&fv_pass_march, &fv_pass_mask, &fv_pass_trace, &fv_pass_compose, &fv_pass_sharpen}, .levels = PYRAMID_LEVELS,
     .measured = PYRAMID_LEVELS, .parameters = pyramid_parameters},
};

const struct fv_pass *const *fv_method_passes(const struct fv_method *method, const struct fv_config *config)
{
    return method->every[0] && strcmp(config->selective_periphery, "every") == 0 ? method->every : method->pass;
}

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
