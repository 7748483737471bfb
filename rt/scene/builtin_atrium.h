/* builtin_atrium: the showcase hall, 24 x 12 x 10 m, its long axis along x, floor at y = 0.
 *
 * builtin_atrium.c has the building, builtin_furnish.c what stands and hangs in it,
 * builtin_plants.c what grows there. Textures and shapes come from the files of those names. */
#ifndef FV_SCENE_BUILTIN_ATRIUM_H
#define FV_SCENE_BUILTIN_ATRIUM_H

#include "rt/scene/builtin_shapes.h"

enum fv_atrium_material {
    FV_ATRIUM_FLOOR,
    FV_ATRIUM_INLAY,
    FV_ATRIUM_MARBLE,
    FV_ATRIUM_BLOCKS,
    FV_ATRIUM_PLASTER,
    FV_ATRIUM_LIMESTONE,
    FV_ATRIUM_WOOD,
    FV_ATRIUM_BARK,
    FV_ATRIUM_CRIMSON,
    FV_ATRIUM_INDIGO,
    FV_ATRIUM_SAFFRON,
    FV_ATRIUM_TERRACOTTA,
    FV_ATRIUM_SOIL,
    FV_ATRIUM_LEAVES,
    FV_ATRIUM_GILT,
    FV_ATRIUM_BRONZE,
    FV_ATRIUM_POLISHED, /* bronze that mirrors */
    FV_ATRIUM_MIRROR,
    FV_ATRIUM_WATER,
    FV_ATRIUM_GLASS,
    FV_ATRIUM_FLAME,
    FV_ATRIUM_MATERIALS
};

/* A brush at the hall's origin for every material. */
struct fv_atrium {
    struct fv_brush brush[FV_ATRIUM_MATERIALS];
};

int fv_atrium_read(struct fv_build *build, struct fv_error *error);

void fv_atrium_furnish(const struct fv_atrium *atrium);
void fv_atrium_plant(const struct fv_atrium *atrium);

#endif
