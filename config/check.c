/* check: settings that a range of their own cannot judge; see check.h. */
#include "config/check.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

static int check_order(const struct fv_config *c, struct fv_error *error)
{
    const struct {
        const char *key, *inner_key;
        double value, inner;
    } pairs[] = {
        {"fovea.outer_deg", "fovea.inner_deg", c->fovea_outer_deg, c->fovea_inner_deg},
        {"selective.para_deg", "selective.foveal_deg", c->selective_para_deg, c->selective_foveal_deg},
        {"selective.peri_deg", "selective.para_deg", c->selective_peri_deg, c->selective_para_deg},
        {"selective.near_deg", "selective.peri_deg", c->selective_near_deg, c->selective_peri_deg},
        {"selective.outer_deg", "selective.near_deg", c->selective_outer_deg, c->selective_near_deg},
        {"denoise.outer_px", "denoise.inner_px", c->denoise_outer_px, c->denoise_inner_px},
    };
    for (unsigned i = 0; i < sizeof pairs / sizeof pairs[0]; i++)
        if (pairs[i].value < pairs[i].inner)
            return fv_config_error(error, pairs[i].key, "%g is less than %s = %g", pairs[i].value,
                                   pairs[i].inner_key, pairs[i].inner);
    return 0;
}

/* Lists of one row, whose numbers have a range. */
static int check_lists(const struct fv_config *c, struct fv_error *error)
{
    const struct {
        const char *key;
        const struct fv_list *list;
        double least, most;
        bool whole;
    } rows[] = {
        {"display.lens_k", &c->display_lens_k, -16, 16, false},
        {"display.lens_red", &c->display_lens_red, -2, 2, false},
        {"display.lens_blue", &c->display_lens_blue, -2, 2, false},
        {"selective.shape", &c->selective_shape, 0, 1e6, false},
        {"selective.samples", &c->selective_samples, 1, 64, true},
        {"selective.alpha", &c->selective_alpha, 0, 1, false},
        {"denoise.spp", &c->denoise_spp, 0, 1024, true},
        {"denoise.iterations", &c->denoise_iterations, 0, 5, true},
    };
    for (unsigned i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        const struct fv_key *key = fv_key_find(rows[i].key);
        const struct fv_list *list = rows[i].list;
        if (list->count != key->columns)
            return fv_config_error(error, rows[i].key, "%d rows, must be one of %d numbers (%s)",
                                   list->count / key->columns, key->columns, key->unit);
        for (int n = 0; n < list->count; n++) {
            double value = list->value[n];
            bool fits = value >= rows[i].least && value <= rows[i].most;
            if (!fits || (rows[i].whole && value != floor(value)))
                return fv_config_error(error, rows[i].key, "%g: must be %s from %g to %g", value,
                                       rows[i].whole ? "whole numbers" : "numbers", rows[i].least,
                                       rows[i].most);
        }
    }
    return 0;
}

static int check_lens(const struct fv_config *c, struct fv_error *error)
{
    const struct {
        const char *key;
        double value, most;
        const char *side;
    } centre[] = {{"display.lens_x_px", c->display_lens_x_px, (double)c->display_width, "width"},
                  {"display.lens_y_px", c->display_lens_y_px, (double)c->display_height, "height"}};
    const struct {
        const char *key;
        const struct fv_list *list;
    } channel[] = {{"display.lens_red", &c->display_lens_red}, {"display.lens_blue", &c->display_lens_blue}};
    if (strcmp(c->display_lens, "none") == 0) return 0;
    for (int i = 0; i < 2; i++) {
        if (centre[i].value > centre[i].most)
            return fv_config_error(error, centre[i].key, "%g lies beyond the picture: at most display.%s = %g", centre[i].value,
                                   centre[i].side, centre[i].most);
        if (channel[i].list->value[0] <= 0)
            return fv_config_error(error, channel[i].key, "%g: its first number must be above 0; 1 is as green", channel[i].list->value[0]);
    }
    return 0;
}

int fv_config_check(const struct fv_config *c, struct fv_error *error)
{
    if (check_order(c, error) || check_lists(c, error) || check_lens(c, error)) return -1;
    if (c->method_support != 4 && c->method_support != 8 && c->method_support != 16)
        return fv_config_error(error, "method.support", "%lld: must be 4, 8 or 16",
                               (long long)c->method_support);
    if (c->method_cluster == 3) return fv_config_error(error, "method.cluster", "3: must be 1, 2 or 4");
    return 0;
}
