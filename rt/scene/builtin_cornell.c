/* builtin_cornell: half the size of the box at Cornell (5.5 m), 2.8 m each way about x = z = 0, its
 * front at z = 1.4 open. The tall block mirrors; a glass sphere lies on the short one. Wall colours
 * are the measured spectra's in linear RGB (Cornell Box data, graphics.cornell.edu), rounded. */
#include "rt/scene/builtin_cornell.h"

#include "rt/scene/builtin_shapes.h"

#define HALF 1.4f
#define TOP 2.8f

enum material { WHITE, RED, GREEN, LAMP, MIRROR, GLASS, MATERIALS };

static void walls(const struct fv_brush *brush)
{
    float side = 2 * HALF;
    vec3s deep = fv_vec(0, 0, -side), wide = fv_vec(side, 0, 0), up = fv_vec(0, TOP, 0);
    fv_shape_quad(&brush[WHITE], fv_vec(-HALF, 0, HALF), wide, deep);
    fv_shape_quad(&brush[WHITE], fv_vec(-HALF, TOP, -HALF), wide, glms_vec3_negate(deep));
    fv_shape_quad(&brush[WHITE], fv_vec(-HALF, 0, -HALF), wide, up);
    fv_shape_quad(&brush[RED], fv_vec(-HALF, 0, HALF), deep, up);
    fv_shape_quad(&brush[GREEN], fv_vec(HALF, 0, -HALF), glms_vec3_negate(deep), up);
}

int fv_cornell_read(struct fv_build *build, struct fv_error *error)
{
    /* The lamp's surface lies just above the light, so that it does not shade what it stands for. */
    static const struct fv_light light = {FV_LIGHT_AREA, .position = {-0.35f, TOP - 0.012f, -0.30f},
                                          .u = {0.7f, 0, 0}, .v = {0, 0, 0.6f}, .colour = {24, 18.5f, 11}};
    struct fv_material material[MATERIALS];
    struct fv_brush brush[MATERIALS];
    for (int i = 0; i < MATERIALS; i++) material[i] = fv_material_default();
    for (int i = 0; i < 3; i++) {
        static const float white[3] = {0.73f, 0.71f, 0.68f}, red[3] = {0.61f, 0.06f, 0.06f};
        static const float green[3] = {0.14f, 0.44f, 0.10f};
        material[WHITE].diffuse[i] = white[i];
        material[RED].diffuse[i] = red[i];
        material[GREEN].diffuse[i] = green[i];
        material[LAMP].diffuse[i] = material[MIRROR].diffuse[i] = material[GLASS].diffuse[i] = 0;
        material[LAMP].emission[i] = light.colour[i];
        material[MIRROR].mirror[i] = 0.9f;
        material[GLASS].transmission[i] = 0.96f;
    }
    material[GLASS].ior = 1.5f;
    for (int i = 0; i < MATERIALS; i++)
        brush[i] = (struct fv_brush){build, glms_mat4_identity(), fv_build_material(build, &material[i]), 1};
    walls(brush);
    fv_shape_box(&brush[LAMP], fv_vec(-0.35f, TOP - 0.01f, -0.30f), fv_vec(0.35f, TOP - 0.002f, 0.30f));
    struct fv_brush tall = fv_brush_at(&brush[MIRROR], -0.45f, 0, -0.50f, 0.60f);
    fv_shape_box(&tall, fv_vec(-0.42f, 0, -0.42f), fv_vec(0.42f, 1.66f, 0.42f));
    struct fv_brush low = fv_brush_at(&brush[WHITE], 0.50f, 0, 0.40f, -0.29f);
    fv_shape_box(&low, fv_vec(-0.42f, 0, -0.42f), fv_vec(0.42f, 0.62f, 0.42f));
    fv_shape_sphere(&brush[GLASS], fv_vec(0.50f, 0.951f, 0.40f), 0.33f, 64);
    return fv_build_light(build, &light, error) < 0 ? -1 : 0;
}
