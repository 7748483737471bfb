/* variant: the table of the tracing kernel's variants. */
#include "rt/trace/variant.h"

const struct fv_variant_row fv_variants[FV_VARIANTS] = {
    [FV_VARIANT_PLAIN] = {"plain", FV_FEATURES_PLAIN, 0},
    [FV_VARIANT_TEXTURED] = {"textured", FV_FEATURES_TEXTURED, 0},
    [FV_VARIANT_MIRRORED] = {"mirrored", FV_FEATURES_MIRRORED, 0},
    [FV_VARIANT_ALL] = {"all", FV_FEATURES_ALL, 0},
    [FV_VARIANT_MOVING] = {"moving", FV_FEATURES_MOVING, 0},
    [FV_VARIANT_FIELDS] = {"fields", FV_FEATURES_FIELDS, FV_SCENE_FIELDS},
    [FV_VARIANT_EVERYTHING] = {"everything", FV_FEATURES_EVERYTHING, 0},
};

bool fv_variant_shows(enum fv_variant variant, uint32_t features)
{
    const struct fv_variant_row *row = &fv_variants[variant];
    return !(features & ~row->features) && (features & row->needs) == row->needs;
}

enum fv_variant fv_variant_for(uint32_t features)
{
    for (int v = 0; v < FV_VARIANT_EVERYTHING; v++)
        if (fv_variant_shows((enum fv_variant)v, features)) return (enum fv_variant)v;
    return FV_VARIANT_EVERYTHING;
}
