/* method: a list of passes and a map from quality level to parameters. A new method is one row of
 * the table in method.c and, perhaps, passes of its own. */
#ifndef FV_METHOD_METHOD_H
#define FV_METHOD_METHOD_H

#include "config/config.h"
#include "rt/pass/pass.h"

enum { FV_METHOD_PASSES_MAX = 16 };

struct fv_method {
    const char *name, *what;
    const struct fv_pass *pass[FV_METHOD_PASSES_MAX + 1]; /* NULL behind the last */
    const struct fv_pass *every[FV_METHOD_PASSES_MAX + 1]; /* instead, where selective.periphery is every; none: no matter */
    /* Level 0 is what the settings say. Where the method adapts to a budget, levels 1 to levels - 1 are a
     * table of their own, from the dearest to the smallest that is safe. Those from `levels` up to
     * `measured` are for measuring only. */
    int levels, measured;
    /* Its pictures hold light that surfaces throw on each other: what they are worth is told by many paths without a filter, not
     * by `full`, and a sweep over methods does not compare it with the others. */
    bool by_paths;
    void (*parameters)(const struct fv_config *config, int level, struct fv_parameters *out);
};

/* The method's passes with these settings, NULL behind the last. */
const struct fv_pass *const *fv_method_passes(const struct fv_method *method, const struct fv_config *config);

/* NULL where there is none of that name. */
const struct fv_method *fv_method_find(const char *name);

/* The n-th method, NULL past the last. */
const struct fv_method *fv_method_at(int n);

#endif
