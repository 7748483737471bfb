/* builtin_growth: what plants of built-in scenes grow by: directions, and twigs of leaves. */
#ifndef FV_SCENE_BUILTIN_GROWTH_H
#define FV_SCENE_BUILTIN_GROWTH_H

#include "rt/scene/builtin_random.h"
#include "rt/scene/builtin_shapes.h"

#include <math.h>

/* Any, each as likely as the others. */
static inline vec3s fv_random_direction(uint32_t *state)
{
    float y = fv_random_between(state, -1, 1), angle = fv_random_between(state, 0, 2 * GLM_PIf);
    float r = sqrtf(fmaxf(1 - y * y, 0));
    return fv_vec(r * cosf(angle), y, r * sinf(angle));
}

/* a + t b, of unit length. */
static inline vec3s fv_toward(vec3s a, vec3s b, float t)
{
    return glms_vec3_normalize(glms_vec3_add(a, glms_vec3_scale(b, t)));
}

/* A twig of leaves with its root at `root`, growing along `up`, its face towards `face`; `size` m a side. */
static inline void fv_twig(const struct fv_brush *leaves, vec3s root, vec3s up, vec3s face, float size)
{
    vec3s side = glms_vec3_cross(up, face);
    if (glms_vec3_norm(side) < 1e-3f) side = glms_vec3_ortho(up);
    side = glms_vec3_scale(glms_vec3_normalize(side), size);
    fv_shape_card(leaves, glms_vec3_sub(root, glms_vec3_scale(side, 0.5f)), side, glms_vec3_scale(up, size));
}

#endif
