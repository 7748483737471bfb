/* builtin_textures: the patterns of the procedural scenes, painted when a scene is built.
 *
 * All of them tile, are 512 x 512 texels, and come from hashed lattice noise: the same bytes on
 * every machine that rounds alike. */
#ifndef FV_SCENE_BUILTIN_TEXTURES_H
#define FV_SCENE_BUILTIN_TEXTURES_H

#include "rt/scene/build.h"

enum fv_pattern {
    FV_PATTERN_FLOOR,   /* 2 m: sixteen marble tiles, light and dark */
    FV_PATTERN_MARBLE,  /* 2 m: veined slab */
    FV_PATTERN_BLOCKS,  /* 2 m: four courses of stone blocks; with normals */
    FV_PATTERN_PLASTER, /* 2 m: limewash */
    FV_PATTERN_FABRIC,  /* 1.5 m: twill with a lattice of motifs, pale, to be tinted; with normals */
    FV_PATTERN_WOOD,    /* 2 m: boards along v */
    FV_PATTERN_SPRIG,   /* a twig of leaves, growing from v = 1 to v = 0; with coverage */
    FV_PATTERNS
};

/* Texture indices as fv_build_texture gave them; -1 where the pattern has none. */
struct fv_pattern_textures {
    int base, normal, alpha;
};

/* Coverage below which a texel of FV_PATTERN_SPRIG is not there. */
#define FV_SPRIG_CUTOFF 0.5f

/* How many times the pattern repeats in a metre. */
float fv_pattern_repeats(enum fv_pattern pattern);

/* Paints all patterns and adds them to the build. */
void fv_patterns_paint(struct fv_build *build, struct fv_pattern_textures textures[FV_PATTERNS]);

#endif
