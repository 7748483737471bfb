/* variant: the tracing kernel compiled for scenes that hold less. Code for what a scene does not hold
 * costs registers and branches even where it never runs: 8 % of a plain scene's frame, 2 to 4 % of a
 * textured one's (tests/bench/left_out). Every variant gives the same bits on what it covers, with the
 * compilers tested. */
#ifndef FV_TRACE_VARIANT_H
#define FV_TRACE_VARIANT_H

#include "rt/scene/scene.h"

enum {
    FV_FEATURES_PLAIN = FV_SCENE_POINT_LIGHTS | FV_SCENE_SUN,
    FV_FEATURES_TEXTURED =
        FV_FEATURES_PLAIN | FV_SCENE_TEXTURES | FV_SCENE_NORMAL_MAPS | FV_SCENE_ALPHA | FV_SCENE_SPECULAR,
    FV_FEATURES_MIRRORED = FV_FEATURES_TEXTURED | FV_SCENE_MIRRORS | FV_SCENE_GLASS | FV_SCENE_EMISSIVE,
    FV_FEATURES_ALL = FV_FEATURES_MIRRORED | FV_SCENE_AREA_LIGHTS | FV_SCENE_AO, /* of what stands still */
    FV_FEATURES_MOVING = FV_FEATURES_ALL | FV_SCENE_MOVING,
    FV_FEATURES_FIELDS = FV_FEATURES_PLAIN | FV_SCENE_SPECULAR | FV_SCENE_FIELDS,
    FV_FEATURES_EVERYTHING = FV_FEATURES_MOVING | FV_SCENE_FIELDS | FV_SCENE_MIXED
};

/* From least to most; FIELDS shows nothing but fields. */
enum fv_variant {
    FV_VARIANT_PLAIN,
    FV_VARIANT_TEXTURED,
    FV_VARIANT_MIRRORED,
    FV_VARIANT_ALL,
    FV_VARIANT_MOVING,
    FV_VARIANT_FIELDS,
    FV_VARIANT_EVERYTHING,
    FV_VARIANTS
};

struct fv_variant_row {
    const char *name;
    uint32_t features; /* enum fv_scene_features that it can show */
    uint32_t needs;    /* that a scene must have, since there is no code for others */
};
extern const struct fv_variant_row fv_variants[FV_VARIANTS];

bool fv_variant_shows(enum fv_variant variant, uint32_t features);

/* The first that covers all of `features`. */
enum fv_variant fv_variant_for(uint32_t features);

#endif
