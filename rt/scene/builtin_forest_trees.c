/* builtin_forest_trees: trees, bushes and ferns; see builtin_forest.h. */
#include "rt/scene/builtin_forest.h"

#include "rt/scene/builtin_growth.h"

#include <math.h>

enum { GRID = 9, BUSHES = 64, FERNS = 420, SEED = 100 };
#define CELL 6.2f /* m between trees */

struct tree {
    const struct fv_brush *bark, *leaves;
    float detail, height, radius;
    float bend[2], phase; /* of the trunk */
    uint32_t random;
};

/* The middle of the trunk at a share of its height. */
static vec3s trunk_at(const struct tree *tree, float t)
{
    float sway = 0.5f * sinf(2.6f * t + tree->phase) - 0.5f * sinf(tree->phase);
    return fv_vec(tree->bend[0] * t * t + 0.35f * sway, tree->height * t, tree->bend[1] * t * t + 0.2f * sway);
}

/* Ridged bark, and roots that spread. */
static vec3s trunk_surface(const void *context, float s, float t)
{
    const struct tree *tree = context;
    float along = t * (0.3f + 0.7f * t); /* denser at the foot */
    float angle = 2 * GLM_PIf * s, thin = 1 - 0.82f * along, roots = expf(-16 * along);
    float r = tree->radius * (thin + 0.05f * sinf(9 * angle + 3 * along + tree->phase) * thin + 0.9f * roots * (1 + 0.45f * cosf(5 * angle + tree->phase)));
    vec3s middle = trunk_at(tree, along);
    return fv_vec(middle.x + r * sinf(angle), middle.y - 0.25f * (1 - t) * (1 - t), middle.z + r * cosf(angle));
}

static void leaf_out(struct tree *tree, vec3s from, vec3s to, vec3s way, int twigs, float size)
{
    int count = (int)ceilf((float)twigs * tree->detail);
    for (int i = 0; i < count; i++) {
        vec3s root = glms_vec3_lerp(from, to, fv_random_between(&tree->random, 0.15f, 1));
        vec3s first = fv_random_direction(&tree->random), second = fv_random_direction(&tree->random);
        vec3s up = fv_toward(fv_toward(way, fv_vec(0, 1, 0), 0.15f), first, 0.9f), face = fv_toward(fv_vec(0, 1, 0), second, 0.8f);
        fv_twig(tree->leaves, root, up, face, size * fv_random_between(&tree->random, 0.7f, 1.2f));
    }
}

/* A branch in two pieces with its twigs, and those that leave it. */
static void branch(struct tree *tree, vec3s foot, vec3s way, float length, float radius, int level)
{
    vec3s aside = fv_random_direction(&tree->random);
    vec3s bent = fv_toward(fv_toward(way, aside, 0.35f), fv_vec(0, 1, 0), 0.12f);
    vec3s middle = glms_vec3_add(foot, glms_vec3_scale(way, 0.45f * length)), tip = glms_vec3_add(middle, glms_vec3_scale(bent, 0.55f * length));
    int sides = level ? 5 : 7;
    fv_shape_tube(tree->bark, foot, middle, radius, 0.75f * radius, sides);
    fv_shape_tube(tree->bark, middle, tip, 0.75f * radius, 0.3f * radius, sides);
    leaf_out(tree, middle, tip, bent, level ? 15 : 9, 0.62f);
    if (level) return;
    for (int i = 0; i < 3; i++) {
        vec3s out = fv_random_direction(&tree->random), start = glms_vec3_lerp(middle, tip, 0.15f + 0.35f * (float)i);
        branch(tree, start, fv_toward(fv_toward(bent, out, 0.8f), fv_vec(0, 1, 0), 0.1f), length * fv_random_between(&tree->random, 0.45f, 0.65f), 0.5f * radius, 1);
    }
}

static void grow_tree(const struct fv_forest *forest, float x, float z, int number)
{
    uint32_t random = fv_random_stream(SEED + number);
    bool birch = fv_random_below(&random, 4) == 0;
    struct fv_brush bark = fv_brush_at(&forest->brush[birch ? FV_FOREST_BIRCH : FV_FOREST_BARK], x, fv_forest_height(x, z), z, 0);
    struct fv_brush leaves = fv_brush_of(&bark, forest->brush[birch ? FV_FOREST_LEAVES_PALE : FV_FOREST_LEAVES].material, 1);
    struct tree tree = {.bark = &bark, .leaves = &leaves, .detail = forest->detail};
    tree.height = fv_random_between(&random, 8.5f, 13);
    tree.radius = (birch ? 0.6f : 1) * fv_random_between(&random, 0.20f, 0.36f);
    for (int i = 0; i < 2; i++) tree.bend[i] = fv_random_between(&random, -0.9f, 0.9f);
    tree.phase = fv_random_between(&random, 0, 6);
    tree.random = random;
    fv_shape_sheet(&bark, trunk_surface, &tree, 22, 26, 2 * GLM_PIf * tree.radius, tree.height);
    enum { BRANCHES = 15 };
    for (int i = 0; i < BRANCHES; i++) {
        float t = 0.30f + 0.66f * ((float)i + 0.5f) / BRANCHES, turn = 2.4f * (float)i + fv_random_between(&tree.random, -0.4f, 0.4f);
        float rise = 0.15f + 0.9f * t * t, length = (1 - 0.62f * t) * fv_random_between(&tree.random, 2.6f, 3.8f);
        vec3s way = glms_vec3_normalize(fv_vec(cosf(turn), rise, sinf(turn)));
        branch(&tree, trunk_at(&tree, t), way, length, tree.radius * 0.42f * (1.1f - t), 0);
    }
}

static void grow_trees(const struct fv_forest *forest)
{
    for (int i = 0; i < GRID * GRID; i++) {
        uint32_t random = fv_random_stream(SEED + 1000 + i);
        float x = CELL * ((float)(i % GRID) - 0.5f * (GRID - 1)) + fv_random_between(&random, -1.9f, 1.9f);
        float z = CELL * ((float)(i / GRID) - 0.5f * (GRID - 1)) + fv_random_between(&random, -1.9f, 1.9f);
        float away = x - fv_forest_path_x(z);
        if (fabsf(away) < 2.6f) x += away < 0 ? -2.2f : 2.2f;
        if (i % GRID == GRID / 2 && i % 2) continue; /* glades along the path */
        grow_tree(forest, x, z, i);
    }
}

/* Twigs that stand in a ring about a place on the ground. */
static void tuft(const struct fv_forest *forest, int material, float x, float z, int twigs, float size, float lean, uint32_t *random)
{
    struct fv_brush at = fv_brush_at(&forest->brush[material], x, fv_forest_height(x, z) - 0.02f, z, 0);
    int count = (int)ceilf((float)twigs * forest->detail);
    for (int i = 0; i < count; i++) {
        float angle = 2 * GLM_PIf * ((float)i + fv_random_between(random, 0, 0.7f)) / (float)count, tilt = lean * fv_random_between(random, 0.6f, 1.3f);
        vec3s out = fv_vec(cosf(angle), 0, sinf(angle)), up = fv_toward(fv_vec(0, 1, 0), out, tilt), face = fv_toward(fv_vec(0, 0.8f, 0), out, -0.6f);
        fv_twig(&at, glms_vec3_scale(out, 0.05f), up, face, size * fv_random_between(random, 0.7f, 1.2f));
    }
}

static void grow_below(const struct fv_forest *forest)
{
    for (int i = 0; i < BUSHES + FERNS; i++) {
        uint32_t random = fv_random_stream(SEED + 2000 + i);
        bool bush = i < BUSHES;
        float z = fv_random_between(&random, -27, 27), near = bush ? 2.4f : 1.35f, u = fv_random_between(&random, 0, 1);
        float away = near + (bush ? 15 : 11) * u * u, x = fv_forest_path_x(z) + (i & 1 ? away : -away);
        if (!bush) {
            tuft(forest, FV_FOREST_FERN, x, z, 11, fv_random_between(&random, 0.35f, 0.75f), 1.1f, &random);
            continue;
        }
        float size = fv_random_between(&random, 0.7f, 1.1f);
        for (int ring = 0; ring < 4; ring++) tuft(forest, FV_FOREST_LEAVES, x, z, 10, size, 0.2f + 0.35f * (float)ring, &random);
    }
}

void fv_forest_grow(const struct fv_forest *forest)
{
    grow_trees(forest);
    grow_below(forest);
}
