/* builtin_forest: materials, ground and lamps; see builtin_forest.h. */
#include "rt/scene/builtin_forest.h"

#include "rt/scene/builtin_random.h"
#include "rt/scene/builtin_textures.h"

#include <math.h>

enum { GROUND_CELLS = 112, PATH_CELLS = 140, STONES = 90, POSTS = 26, SEED = 900 };

static const struct recipe {
    int pattern; /* enum fv_pattern, or -1 */
    float tint[3], emission[3];
} recipes[FV_FOREST_MATERIALS] = {
    [FV_FOREST_GROUND] = {FV_PATTERN_PLASTER, {0.20f, 0.26f, 0.11f}, {0}},
    [FV_FOREST_PATH] = {FV_PATTERN_PLASTER, {0.38f, 0.31f, 0.22f}, {0}},
    [FV_FOREST_BARK] = {FV_PATTERN_WOOD, {0.50f, 0.58f, 0.60f}, {0}},
    [FV_FOREST_BIRCH] = {FV_PATTERN_MARBLE, {0.80f, 0.78f, 0.72f}, {0}},
    [FV_FOREST_LEAVES] = {FV_PATTERN_SPRIG, {1.2f, 1.4f, 0.9f}, {0}},
    [FV_FOREST_LEAVES_PALE] = {FV_PATTERN_SPRIG, {1.6f, 1.5f, 0.9f}, {0}},
    [FV_FOREST_FERN] = {FV_PATTERN_SPRIG, {1.0f, 1.6f, 1.0f}, {0}},
    [FV_FOREST_STONE] = {FV_PATTERN_PLASTER, {0.38f, 0.38f, 0.36f}, {0}},
    [FV_FOREST_POST] = {FV_PATTERN_WOOD, {0.32f, 0.36f, 0.38f}, {0}},
    [FV_FOREST_LAMP] = {-1, {0, 0, 0}, {7, 4.8f, 2.4f}},
    [FV_FOREST_GLOW] = {-1, {0, 0, 0}, {2.6f, 4.6f, 2.2f}},
};

static void mix_materials(struct fv_forest *forest, struct fv_build *build)
{
    struct fv_pattern_textures textures[FV_PATTERNS];
    fv_patterns_paint(build, textures);
    for (int i = 0; i < FV_FOREST_MATERIALS; i++) {
        const struct recipe *r = &recipes[i];
        struct fv_material m = fv_material_default();
        for (int c = 0; c < 3; c++) m.diffuse[c] = r->tint[c], m.emission[c] = r->emission[c];
        if (r->pattern >= 0) {
            m.base_texture = textures[r->pattern].base;
            m.alpha_texture = textures[r->pattern].alpha;
            m.alpha_cutoff = FV_SPRIG_CUTOFF;
        }
        float repeats = r->pattern >= 0 ? fv_pattern_repeats((enum fv_pattern)r->pattern) : 1;
        forest->brush[i] = (struct fv_brush){build, glms_mat4_identity(), fv_build_material(build, &m), repeats};
    }
}

float fv_forest_path_x(float z)
{
    return 1.6f * sinf(0.16f * z);
}

/* 0 below `low`, 1 above `high`, without a kink. */
static float step_between(float low, float high, float x)
{
    float t = fminf(fmaxf((x - low) / (high - low), 0), 1);
    return t * t * (3 - 2 * t);
}

float fv_forest_height(float x, float z)
{
    float aside = step_between(FV_FOREST_CLEAR, 6, fabsf(x - fv_forest_path_x(z)));
    float hills = 0.55f * sinf(0.23f * x + 1) * cosf(0.19f * z) + 0.14f * sinf(0.71f * x) * sinf(0.63f * z + 2) + 0.25f;
    float rim = 5 * step_between(22, FV_FOREST_HALF + 4, sqrtf(x * x + z * z));
    return aside * (hills + rim);
}

static vec3s ground_surface(const void *context, float s, float t)
{
    (void)context;
    float z = FV_FOREST_HALF * (2 * s - 1), x = FV_FOREST_HALF * (2 * t - 1);
    return fv_vec(x, fv_forest_height(x, z), z);
}

/* A finger's breadth above the ground. */
static vec3s path_surface(const void *context, float s, float t)
{
    (void)context;
    float z = FV_FOREST_HALF * (2 * s - 1), side = 2 * t - 1;
    float half = FV_FOREST_CLEAR * (0.62f + 0.07f * sinf(1.9f * z) + 0.05f * sinf(4.3f * z + 1));
    return fv_vec(fv_forest_path_x(z) + half * side, 0.02f * (1 - side * side) + 0.004f, z);
}

/* A stone: a ball that was pressed and chipped, half in the ground. */
struct stone {
    float radius[3], phase;
};

static vec3s stone_surface(const void *context, float s, float t)
{
    const struct stone *o = context;
    float around = 2 * GLM_PIf * s, up = 0.499f * GLM_PIf * (2 * t - 1); /* poles stay open by a hair: no triangle is a line */
    float chipped = 1 + 0.10f * sinf(3 * around + o->phase) * cosf(2 * up) + 0.06f * sinf(5 * around - o->phase);
    float across = cosf(up) * chipped;
    return fv_vec(o->radius[0] * across * sinf(around), o->radius[1] * sinf(up), o->radius[2] * across * cosf(around));
}

static void lay_ground(const struct fv_forest *forest)
{
    uint32_t random = fv_random_stream(SEED);
    fv_shape_sheet(&forest->brush[FV_FOREST_GROUND], ground_surface, NULL, GROUND_CELLS, GROUND_CELLS, 2 * FV_FOREST_HALF, 2 * FV_FOREST_HALF);
    fv_shape_sheet(&forest->brush[FV_FOREST_PATH], path_surface, NULL, PATH_CELLS, 6, 2 * FV_FOREST_HALF, 2);
    for (int i = 0; i < STONES; i++) {
        float z = fv_random_between(&random, -24, 24), away = fv_random_between(&random, 1.4f, 8);
        float x = fv_forest_path_x(z) + (i & 1 ? away : -away), size = fv_random_between(&random, 0.08f, 0.34f);
        struct stone stone = {.phase = fv_random_between(&random, 0, 6)};
        stone.radius[0] = size * fv_random_between(&random, 0.8f, 1.3f);
        stone.radius[1] = size * fv_random_between(&random, 0.5f, 0.9f);
        stone.radius[2] = size * fv_random_between(&random, 0.8f, 1.3f);
        struct fv_brush at = fv_brush_at(&forest->brush[FV_FOREST_STONE], x, fv_forest_height(x, z) + 0.1f * size, z, 0);
        fv_shape_sheet(&at, stone_surface, &stone, 14, 9, 6 * size, 3 * size);
    }
}

/* Lamps on posts along the path, then others that glow among the trees. */
static void place_lamp(int i, vec3s *at, float colour[3])
{
    static const float warm[3] = {2.6f, 1.75f, 0.85f}, green[3] = {0.55f, 0.95f, 0.45f};
    uint32_t random = fv_random_stream(SEED + 1 + i);
    float bright = fv_random_between(&random, 0.7f, 1.3f);
    for (int c = 0; c < 3; c++) colour[c] = bright * (i < POSTS ? warm[c] : green[c]);
    if (i < POSTS) {
        float z = -24 + 48 * ((float)i + 0.5f) / POSTS + fv_random_between(&random, -0.3f, 0.3f);
        float side = i & 1 ? FV_FOREST_CLEAR + 0.15f : -FV_FOREST_CLEAR - 0.15f;
        *at = fv_vec(fv_forest_path_x(z) + side, fv_random_between(&random, 1.0f, 1.25f), z);
        return;
    }
    float z = fv_random_between(&random, -26, 26), away = fv_random_between(&random, 2.5f, 13);
    float x = fv_forest_path_x(z) + (i & 1 ? away : -away), up = fv_random_between(&random, 0.5f, 4.5f);
    *at = fv_vec(x, fv_forest_height(x, z) + up, z);
}

/* The bodies hang above their lights, which they would hide inside. */
static void build_lamps(const struct fv_forest *forest)
{
    for (int i = 0; i < FV_FOREST_LIGHTS; i++) {
        vec3s at;
        float colour[3];
        place_lamp(i, &at, colour);
        bool post = i < POSTS;
        float radius = post ? 0.055f : 0.03f;
        fv_shape_sphere(&forest->brush[post ? FV_FOREST_LAMP : FV_FOREST_GLOW], fv_vec(at.x, at.y + radius + 0.02f, at.z), radius, post ? 12 : 8);
        if (!post) continue;
        float inner = fv_forest_path_x(at.z) - at.x, foot_x = at.x - copysignf(0.16f, inner), top = at.y + 0.16f;
        const struct fv_brush *wood = &forest->brush[FV_FOREST_POST];
        fv_shape_tube(wood, fv_vec(foot_x, -0.2f, at.z), fv_vec(foot_x, top, at.z), 0.035f, 0.03f, 8);
        fv_shape_tube(wood, fv_vec(foot_x, top - 0.02f, at.z), fv_vec(at.x, top, at.z), 0.015f, 0.012f, 6);
    }
}

int fv_forest_read(struct fv_build *build, double detail, struct fv_error *error)
{
    struct fv_forest forest = {.detail = (float)detail};
    mix_materials(&forest, build);
    for (int counting = 1; counting >= 0; counting--) {
        fv_build_rehearse(build, counting);
        lay_ground(&forest);
        build_lamps(&forest);
        fv_forest_grow(&forest);
    }
    for (int i = 0; i < FV_FOREST_LIGHTS; i++) {
        vec3s at;
        float colour[3];
        place_lamp(i, &at, colour);
        struct fv_light light = {.kind = FV_LIGHT_POINT, .position = {at.x, at.y, at.z}, .colour = {colour[0], colour[1], colour[2]}};
        if (fv_build_light(build, &light, error) < 0) return -1;
    }
    return 0;
}
