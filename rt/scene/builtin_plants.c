/* builtin_plants: trees in pots, ivy on columns and over the gallery's edge; see builtin_atrium.h. */
#include "rt/scene/builtin_atrium.h"

#include "rt/scene/builtin_growth.h"

#include <math.h>

struct tree {
    const struct fv_brush *bark, *leaves;
    vec3s crown; /* its middle */
    uint32_t random;
};

/* A branch in two pieces, its twigs from `level` 2 on, and the three branches that leave it. */
static void branch(struct tree *tree, vec3s foot, vec3s direction, float length, float radius, int level)
{
    enum { LEVELS = 4 };
    vec3s bent = fv_toward(direction, fv_random_direction(&tree->random), 0.25f);
    vec3s middle = glms_vec3_add(foot, glms_vec3_scale(direction, length * 0.5f));
    vec3s tip = glms_vec3_add(middle, glms_vec3_scale(bent, length * 0.5f));
    int sides = level == 0 ? 16 : level == 1 ? 10 : 6;
    fv_shape_tube(tree->bark, foot, middle, radius, radius * 0.85f, sides);
    fv_shape_tube(tree->bark, middle, tip, radius * 0.85f, radius * 0.62f, sides);
    int twigs = level < 2 ? 0 : level == LEVELS - 1 ? 13 : 6;
    for (int i = 0; i < twigs; i++) {
        float t = fv_random_between(&tree->random, 0.2f, 1);
        vec3s root = glms_vec3_lerp(foot, tip, t);
        vec3s out = glms_vec3_normalize(glms_vec3_sub(root, tree->crown));
        vec3s up = fv_toward(fv_toward(bent, out, 0.5f), fv_random_direction(&tree->random), 0.9f);
        vec3s face = fv_toward(fv_toward(out, fv_vec(0, 1, 0), 0.8f), fv_random_direction(&tree->random), 0.5f);
        fv_twig(tree->leaves, root, up, face, fv_random_between(&tree->random, 0.26f, 0.42f));
    }
    if (level + 1 == LEVELS) return;
    for (int i = 0; i < 3; i++) {
        float angle = 2 * GLM_PIf * ((float)i + fv_random_between(&tree->random, 0, 0.6f)) / 3;
        vec3s side = fv_vec(cosf(angle), fv_random_between(&tree->random, -0.1f, 0.25f), sinf(angle));
        vec3s away = fv_toward(bent, side, level == 0 ? 0.75f : 0.95f);
        branch(tree, tip, away, length * fv_random_between(&tree->random, 0.55f, 0.72f), radius * 0.58f,
               level + 1);
    }
}

static void potted_tree(const struct fv_atrium *atrium, float x, float z, uint32_t seed)
{
    static const struct fv_corner pot[] = {
        {0, 0, 0},         {0.30f, 0, 0},        {0.32f, 0.05f, 0.1f}, {0.46f, 0.50f, 0.15f},
        {0.45f, 0.62f, 0}, {0.50f, 0.62f, 0.3f}, {0.52f, 0.74f, 0.6f}, {0.46f, 0.76f, 0},
        {0.43f, 0.66f, 0}};
    static const struct fv_corner soil[] = {{0.44f, 0.67f, 0.05f}, {0, 0.72f, 0}};
    struct fv_brush at = fv_brush_at(&atrium->brush[FV_ATRIUM_TERRACOTTA], x, 0, z, 0);
    fv_shape_lathe(&at, pot, sizeof pot / sizeof pot[0], 64);
    struct fv_brush earth = fv_brush_of(&at, atrium->brush[FV_ATRIUM_SOIL].material, 1);
    fv_shape_lathe(&earth, soil, 2, 32);
    struct fv_brush bark = fv_brush_of(&at, atrium->brush[FV_ATRIUM_BARK].material, 1);
    struct fv_brush leaves = fv_brush_of(&at, atrium->brush[FV_ATRIUM_LEAVES].material, 1);
    struct tree tree = {&bark, &leaves, fv_vec(0, 2.5f, 0), seed};
    branch(&tree, fv_vec(0, 0.68f, 0), fv_vec(0, 1, 0), 1.15f, 0.075f, 0);
}

/* Ivy that winds up a column. */
static void climber(const struct fv_brush *leaves, const struct fv_brush *bark, float height, uint32_t seed)
{
    enum { TWIGS = 150 };
    vec3s before = fv_vec(0, 0, 0);
    float phase = fv_random_between(&seed, 0, 6);
    for (int i = 0; i < TWIGS; i++) {
        float t = (float)i / (TWIGS - 1), y = 0.1f + (height - 0.5f) * t;
        float angle = phase + 7 * t + 0.5f * sinf(9 * t);
        vec3s stem = fv_vec(0.235f * cosf(angle), y, 0.235f * sinf(angle));
        if (i > 0) fv_shape_tube(bark, before, stem, 0.012f, 0.012f, 5);
        before = stem;
        float around = angle + fv_random_between(&seed, -0.9f, 0.9f) * (1 - 0.5f * t);
        vec3s out = fv_vec(cosf(around), 0, sinf(around));
        vec3s root = glms_vec3_add(glms_vec3_scale(out, 0.235f), fv_vec(0, y, 0));
        float rise = fv_random_between(&seed, -0.6f, 1);
        vec3s up = fv_toward(fv_toward(fv_vec(0, rise, 0), fv_random_direction(&seed), 0.7f), out, 0.45f);
        vec3s face = fv_toward(out, fv_random_direction(&seed), 0.45f);
        fv_twig(leaves, root, up, face, fv_random_between(&seed, 0.15f, 0.26f));
    }
}

/* Ivy that falls over an edge along x at the brush's origin, towards +z. */
static void fall(const struct fv_brush *leaves, float width, uint32_t seed)
{
    enum { STRANDS = 14 };
    vec3s out = fv_vec(0, 0, 1);
    for (int i = 0; i < STRANDS; i++) {
        float x = width * (((float)i + fv_random_between(&seed, 0, 1)) / STRANDS - 0.5f);
        float edge = fminf(1, 4 * (0.5f - fabsf(x / width)));
        int twigs = 3 + (int)(edge * fv_random_between(&seed, 2, 8));
        for (int k = 0; k < twigs; k++) {
            vec3s root = fv_vec(x + fv_random_between(&seed, -0.05f, 0.05f), -0.13f * (float)k + 0.12f,
                                0.20f - 0.012f * (float)k);
            float aside = fv_random_between(&seed, -0.8f, 0.8f);
            vec3s up = fv_toward(fv_vec(aside, -1, 0.35f), fv_random_direction(&seed), 0.3f);
            vec3s face = fv_toward(out, fv_random_direction(&seed), 0.5f);
            fv_twig(leaves, root, up, face, fv_random_between(&seed, 0.18f, 0.28f));
        }
    }
}

void fv_atrium_plant(const struct fv_atrium *atrium)
{
    static const float trees[4][2] = {{8.1f, 2.5f}, {8.1f, -2.5f}, {-8.1f, 2.5f}, {-8.1f, -2.5f}};
    static const float columns[5][2] = {{6, -3.8f}, {-3, 3.8f}, {3, 3.8f}, {-6, -3.8f}, {-9, 3.8f}};
    static const float falls[6] = {7.5f, 1.5f, -4.5f, -10.5f, 4.5f, -1.5f};
    for (int i = 0; i < 4; i++) potted_tree(atrium, trees[i][0], trees[i][1], 1009u * (uint32_t)(i + 1));
    for (int i = 0; i < 5; i++) {
        struct fv_brush leaves =
            fv_brush_at(&atrium->brush[FV_ATRIUM_LEAVES], columns[i][0], 0, columns[i][1], 0);
        struct fv_brush bark =
            fv_brush_at(&atrium->brush[FV_ATRIUM_BARK], columns[i][0], 0, columns[i][1], 0);
        climber(&leaves, &bark, i & 1 ? 3.0f : 2.4f, 77u * (uint32_t)(i + 3));
    }
    for (int i = 0; i < 6; i++) {
        struct fv_brush side =
            fv_brush_at(&atrium->brush[FV_ATRIUM_LEAVES], 0, 0, 0, (float)(i & 1) * GLM_PIf);
        struct fv_brush edge = fv_brush_at(&side, falls[i], 5.02f, -3.52f, 0);
        fall(&edge, 2.4f, 131u * (uint32_t)(i + 1));
    }
}
