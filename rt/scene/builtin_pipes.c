/* builtin_pipes: materials, and the order in which the plant is built; see builtin_pipes.h. */
#include "rt/scene/builtin_pipes.h"

#include "rt/scene/builtin_random.h"

#include <string.h>

/* Routes that are tried; the last ones find little room. */
enum { BUNDLES = 230, SEED = 40000 };

static const struct recipe {
    float diffuse[3], specular, shininess, mirror[3], emission[3];
} recipes[FV_PIPES_MATERIALS] = {
    [FV_PIPES_GALVANISED] = {{0.36f, 0.38f, 0.40f}, 0.25f, .shininess = 30},
    [FV_PIPES_CLADDING] = {{0.50f, 0.51f, 0.53f}, 0.35f, .shininess = 40},
    [FV_PIPES_INSULATION] = {{0.72f, 0.71f, 0.67f}, 0.02f, .shininess = 5},
    [FV_PIPES_CREAM] = {{0.66f, 0.58f, 0.40f}, 0.06f, .shininess = 40},
    [FV_PIPES_RED] = {{0.55f, 0.05f, 0.04f}, 0.06f, .shininess = 50},
    [FV_PIPES_ORANGE] = {{0.70f, 0.24f, 0.03f}, 0.06f, .shininess = 50},
    [FV_PIPES_YELLOW] = {{0.72f, 0.50f, 0.04f}, 0.06f, .shininess = 50},
    [FV_PIPES_GREEN] = {{0.06f, 0.30f, 0.10f}, 0.06f, .shininess = 50},
    [FV_PIPES_TEAL] = {{0.05f, 0.33f, 0.34f}, 0.06f, .shininess = 50},
    [FV_PIPES_BLUE] = {{0.05f, 0.14f, 0.45f}, 0.06f, .shininess = 50},
    [FV_PIPES_VIOLET] = {{0.26f, 0.10f, 0.34f}, 0.06f, .shininess = 50},
    [FV_PIPES_BROWN] = {{0.24f, 0.12f, 0.06f}, 0.06f, .shininess = 50},
    [FV_PIPES_RUST] = {{0.32f, 0.13f, 0.05f}, 0, .shininess = 1},
    [FV_PIPES_BLACK] = {{0.05f, 0.05f, 0.055f}, 0.08f, .shininess = 60},
    [FV_PIPES_STAINLESS] = {{0.22f, 0.22f, 0.23f}, 0.35f, 120, .mirror = {0.34f, 0.35f, 0.36f}},
    [FV_PIPES_COPPER] = {{0.28f, 0.12f, 0.06f}, 0.30f, 120, .mirror = {0.40f, 0.24f, 0.15f}},
    [FV_PIPES_STEEL] = {{0.20f, 0.26f, 0.30f}, 0.05f, .shininess = 30},
    [FV_PIPES_RACK] = {{0.30f, 0.31f, 0.31f}, 0.10f, .shininess = 30},
    [FV_PIPES_BOLTS] = {{0.16f, 0.16f, 0.17f}, 0.30f, .shininess = 40},
    [FV_PIPES_WHEELS] = {{0.60f, 0.06f, 0.04f}, 0.08f, .shininess = 60},
    [FV_PIPES_GRATING] = {{0.33f, 0.35f, 0.36f}, 0.15f, .shininess = 30},
    [FV_PIPES_RAILING] = {{0.75f, 0.55f, 0.05f}, 0.06f, .shininess = 50},
    [FV_PIPES_VESSEL] = {{0.55f, 0.58f, 0.58f}, 0.08f, .shininess = 40},
    [FV_PIPES_POLISHED] = {{0.20f, 0.21f, 0.22f}, 0.30f, 200, .mirror = {0.50f, 0.51f, 0.52f}},
    [FV_PIPES_TANK] = {{0.74f, 0.74f, 0.72f}, 0.04f, .shininess = 30},
    [FV_PIPES_CONCRETE] = {{0.45f, 0.44f, 0.42f}, 0, .shininess = 1},
    [FV_PIPES_SLAB] = {{0.40f, 0.39f, 0.37f}, 0, .shininess = 1},
    [FV_PIPES_SLAB_DARK] = {{0.34f, 0.33f, 0.32f}, 0, .shininess = 1},
    [FV_PIPES_GRAVEL] = {{0.30f, 0.28f, 0.24f}, 0, .shininess = 1},
    [FV_PIPES_LAMP] = {{0, 0, 0}, 0, 1, .emission = {7, 6.4f, 5.2f}},
};

static void mix_paints(struct fv_pipes *pipes, struct fv_build *build)
{
    for (int i = 0; i < FV_PIPES_MATERIALS; i++) {
        struct fv_material m = fv_material_default();
        for (int c = 0; c < 3; c++) {
            m.diffuse[c] = recipes[i].diffuse[c];
            m.specular[c] = recipes[i].specular;
            m.mirror[c] = recipes[i].mirror[c];
            m.emission[c] = recipes[i].emission[c];
        }
        m.shininess = recipes[i].shininess;
        pipes->brush[i] = (struct fv_brush){build, glms_mat4_identity(), fv_build_material(build, &m), 1};
    }
}

static void lay_out(struct fv_pipes *pipes)
{
    memset(pipes->cell, FV_PIPES_FREE, sizeof pipes->cell);
    fv_pipes_surround(pipes);
    fv_pipes_reserve(pipes);
    fv_pipes_equip(pipes);
    for (int i = 0; i < BUNDLES; i++) {
        uint32_t random = fv_random_stream(SEED + i);
        struct fv_pipes_route route;
        if (fv_pipes_find_route(pipes, FV_PIPES_BUNDLE + i, &random, &route))
            fv_pipes_lay_bundle(pipes, &route, &random);
    }
    fv_pipes_erect(pipes);
}

int fv_pipes_read(struct fv_build *build, double detail, struct fv_error *error)
{
    (void)error;
    struct fv_pipes pipes = {.detail = (float)detail};
    mix_paints(&pipes, build);
    fv_build_rehearse(build, true);
    lay_out(&pipes);
    fv_build_rehearse(build, false);
    lay_out(&pipes);
    return 0;
}
