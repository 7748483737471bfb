/* room: a small scene that has any of a scene's features as asked for, and a loop of the method full over
 * it: a room of many small triangles with two screens in it, seen from its open front. For tests only. */
#ifndef FV_TESTS_ROOM_H
#define FV_TESTS_ROOM_H

#include "rt/frame/loop.h"
#include "tests/support/small_scene.h"

struct room {
    struct small_scene small;
    struct fv_plan plan;
    struct fv_session session;
    struct fv_loop loop;
};

static inline int room_texture(struct fv_build *build, enum fv_texel kind)
{
    enum { SIDE = 256 };
    static uint8_t pixels[SIDE * SIDE * 4];
    uint32_t state = 1;
    for (int i = 0; i < SIDE * SIDE; i++)
        for (int c = 0; c < 4; c++) {
            state = state * 1664525u + 1013904223u;
            pixels[4 * i + c] = (uint8_t)(kind == FV_TEXEL_NORMAL && c == 2 ? 230 : 96 + (state >> 26));
        }
    for (int i = 0; i < SIDE * SIDE && kind == FV_TEXEL_ALPHA; i++) pixels[4 * i + 3] = i / 16 % 2 * 255;
    return fv_build_texture(build, kind, pixels, SIDE, SIDE, 4, 0.5f);
}

static inline void room_materials(struct fv_build *build, uint32_t features_there, int material[3])
{
    struct fv_material w = fv_material_default(), mirror, glass;
    for (int c = 0; c < 3; c++) w.diffuse[c] = 0.7f;
    if (features_there & FV_SCENE_TEXTURES) w.base_texture = room_texture(build, FV_TEXEL_COLOUR);
    if (features_there & FV_SCENE_NORMAL_MAPS) w.normal_texture = room_texture(build, FV_TEXEL_NORMAL);
    for (int c = 0; c < 3 && (features_there & FV_SCENE_SPECULAR); c++) w.specular[c] = 0.3f;
    w.shininess = 20;
    for (int c = 0; c < 3 && (features_there & FV_SCENE_EMISSIVE); c++) w.emission[c] = 0.1f;
    mirror = w;
    if (features_there & FV_SCENE_ALPHA) mirror.alpha_texture = room_texture(build, FV_TEXEL_ALPHA);
    glass = mirror;
    glass.ior = 1.5f;
    for (int c = 0; c < 3; c++) {
        if (features_there & FV_SCENE_MIRRORS) mirror.mirror[c] = 0.8f;
        if (features_there & FV_SCENE_GLASS) glass.transmission[c] = 0.8f;
    }
    material[0] = fv_build_material(build, &w);
    material[1] = fv_build_material(build, &mirror);
    material[2] = fv_build_material(build, &glass);
}

static inline void room_lights(struct fv_build *build, uint32_t features_there)
{
    static const struct {
        uint32_t bit;
        struct fv_light light;
    } lights[] = {
        {FV_SCENE_POINT_LIGHTS, {FV_LIGHT_POINT, {0.3f, 1.2f, -2.5f}, {0}, {0}, {9, 9, 9}}},
        {FV_SCENE_AREA_LIGHTS, {FV_LIGHT_AREA, {-0.5f, 1.4f, -3.5f}, {1, 0, 0}, {0, 0, 1}, {4, 4, 4}}},
        {FV_SCENE_SUN, {FV_LIGHT_SUN, {0.2f, 0.3f, 1}, {0}, {0}, {2, 2, 2}}},
    };
    struct fv_error error;
    for (unsigned i = 0; i < sizeof lights / sizeof lights[0]; i++)
        if ((features_there & lights[i].bit) && fv_build_light(build, &lights[i].light, &error) < 0)
            fail_msg("%s", error.text);
}

static inline void room_plates(struct small_scene *s, const int material[3])
{
    static const struct {
        double corner[3], u[3], v[3];
        int material;
    } plates[] = {
        {{-1.5, -1.5, -5}, {3, 0, 0}, {0, 3, 0}, 0},         {{-1.5, -1.5, -1}, {3, 0, 0}, {0, 0, -4}, 0},
        {{-1.5, 1.5, -5}, {3, 0, 0}, {0, 0, 4}, 0},          {{-1.5, -1.5, -1}, {0, 0, -4}, {0, 3, 0}, 0},
        {{1.5, -1.5, -5}, {0, 0, 4}, {0, 3, 0}, 0},          {{-1.1, -1.2, -4.2}, {1, 0, 0.3}, {0, 2, 0}, 1},
        {{0.2, -1.2, -3.8}, {0.9, 0, -0.4}, {0, 1.6, 0}, 2},
    };
    for (unsigned i = 0; i < sizeof plates / sizeof plates[0]; i++)
        small_plate(s, plates[i].corner, plates[i].u, plates[i].v, 40, material[plates[i].material]);
}

static inline void room_open(struct room *r, struct fv_workers *workers, uint32_t features_there, int eyes,
                             int side)
{
    int material[3]; /* walls, a mirror, a pane */
    struct fv_config *c = &r->small.config;
    small_begin(&r->small);
    c->method_ao_spp = features_there & FV_SCENE_AO ? 4 : 0;
    strcpy(c->display_sink, "none");
    c->display_eyes = eyes;
    c->display_width = c->display_height = side;
    room_materials(r->small.build, features_there, material);
    room_plates(&r->small, material);
    room_lights(r->small.build, features_there);
    small_finish(&r->small);
    assert_int_equal(r->small.scene.features, features_there);
    for (int i = 0; i < 3; i++) r->small.scene.ambient[i] = 0.1f;
    fv_frame_size(&r->loop.frame, c);
    fv_plan_make(&r->plan, fv_method_find("full"), &r->small.scene, c, &r->loop.frame);
    fv_loop_open(&r->loop, c, &r->plan, &r->small.tracer, workers, &r->session, 1);
}

#endif
