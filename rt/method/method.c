/* method: the table of methods. */
#include "rt/method/method.h"

#include <string.h>

/* Supersampling: each level twice the samples of the one before. */
static void full_parameters(const struct fv_config *config, int level, struct fv_parameters *out)
{
    *out = (struct fv_parameters){.foveal = {180, 180, 1}, .spp = (int)config->method_spp << level};
}

/* p_min gives way first, then the radii: halved in turn, r0 never below the fovea's 2.6 degrees
 * (Wandell 1995) nor below what the settings ask for. */
static void reproject_parameters(const struct fv_config *config, int level, struct fv_parameters *out)
{
    struct fv_foveal f = {(float)config->fovea_inner_deg, (float)config->fovea_outer_deg, (float)config->fovea_p_min};
    float floor_deg = f.r0_deg < 2.6f ? f.r0_deg : 2.6f;
    for (int i = 1; i <= level; i++) {
        if (i % 2) {
            f.p_min *= 0.5f;
        } else {
            f.r0_deg = f.r0_deg * 0.75f > floor_deg ? f.r0_deg * 0.75f : floor_deg;
            f.r1_deg = f.r1_deg * 0.75f > f.r0_deg ? f.r1_deg * 0.75f : f.r0_deg;
        }
    }
    *out = (struct fv_parameters){.foveal = f, .spp = 1};
}

static const struct fv_method table[] = {
    {"full", "every pixel, method.spp samples each: the baseline and, at many samples, the reference",
     {&fv_pass_sample_all}, 1, 5, full_parameters},
    {"reproject", "foveated sampling over the last frame's reprojected picture (Weier et al. 2016)",
     {&fv_pass_select, &fv_pass_support, &fv_pass_reproject, &fv_pass_sample}, 8, 8, reproject_parameters},
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
