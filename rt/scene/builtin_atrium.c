/* builtin_atrium: materials, lights and the building itself; see builtin_atrium.h.
 *
 * Eight bays of 3 m along x. The nave is open to the sky between z = -3.55 and 3.55; behind its
 * arcades lie aisles below and galleries above, out to the walls at z = -6 and 6. */
#include "rt/scene/builtin_atrium.h"

#include "rt/scene/builtin_textures.h"

#include <math.h>

#define BAY 3.0f
enum { BAYS = 8 };
#define LENGTH 12.0f /* half the hall's */
#define WIDTH 6.0f   /* half, to the outer walls */
#define ARCADE 3.8f  /* z of the columns */
#define WALL 0.5f    /* thickness of the arcades */
#define NAVE (ARCADE - WALL / 2)
#define GALLERY 5.0f /* y of the gallery's floor */
#define LOWER_SPRING 3.05f
#define LOWER_TOP 4.75f
#define UPPER_SPRING 7.55f
#define UPPER_TOP 9.3f
#define ROOF 10.0f
#define SPAN 1.2f /* radius of the arches */

struct recipe {
    int pattern; /* enum fv_pattern, or -1 */
    float tint[3], specular[3], shininess, mirror[3], transmission[3], ior, emission[3];
};

static const struct recipe recipes[FV_ATRIUM_MATERIALS] = {
    [FV_ATRIUM_FLOOR] = {FV_PATTERN_FLOOR, {0.95f, 0.95f, 0.95f}, {0.06f, 0.06f, 0.06f}, 60, .ior = 1},
    [FV_ATRIUM_INLAY] = {FV_PATTERN_MARBLE, {0.30f, 0.16f, 0.13f}, {0.06f, 0.06f, 0.06f}, 60, .ior = 1},
    [FV_ATRIUM_MARBLE] = {FV_PATTERN_MARBLE, {1, 1, 1}, {0.05f, 0.05f, 0.05f}, 60, .ior = 1},
    [FV_ATRIUM_BLOCKS] = {FV_PATTERN_BLOCKS, {1, 1, 1}, .shininess = 1, .ior = 1},
    [FV_ATRIUM_PLASTER] = {FV_PATTERN_PLASTER, {1, 0.94f, 0.82f}, .shininess = 1, .ior = 1},
    [FV_ATRIUM_LIMESTONE] = {FV_PATTERN_PLASTER, {0.97f, 0.97f, 0.97f}, .shininess = 1, .ior = 1},
    [FV_ATRIUM_WOOD] = {FV_PATTERN_WOOD, {1, 1, 1}, .shininess = 1, .ior = 1},
    [FV_ATRIUM_BARK] = {FV_PATTERN_WOOD, {0.7f, 0.7f, 0.7f}, .shininess = 1, .ior = 1},
    [FV_ATRIUM_CRIMSON] = {FV_PATTERN_FABRIC, {0.62f, 0.05f, 0.06f}, .shininess = 1, .ior = 1},
    [FV_ATRIUM_INDIGO] = {FV_PATTERN_FABRIC, {0.07f, 0.14f, 0.48f}, .shininess = 1, .ior = 1},
    [FV_ATRIUM_SAFFRON] = {FV_PATTERN_FABRIC, {0.85f, 0.47f, 0.08f}, .shininess = 1, .ior = 1},
    [FV_ATRIUM_TERRACOTTA] = {FV_PATTERN_PLASTER, {0.75f, 0.34f, 0.21f}, .shininess = 1, .ior = 1},
    [FV_ATRIUM_SOIL] = {-1, {0.05f, 0.035f, 0.025f}, .shininess = 1, .ior = 1},
    [FV_ATRIUM_LEAVES] = {FV_PATTERN_SPRIG, {1.5f, 1.5f, 1.5f}, .shininess = 1, .ior = 1},
    [FV_ATRIUM_GILT] = {-1, {0.42f, 0.27f, 0.07f}, {0.45f, 0.33f, 0.13f}, 40, .ior = 1},
    [FV_ATRIUM_BRONZE] = {-1, {0.16f, 0.085f, 0.04f}, {0.40f, 0.24f, 0.12f}, 50, .ior = 1},
    [FV_ATRIUM_POLISHED] =
        {-1, {0.06f, 0.03f, 0.015f}, {0.5f, 0.35f, 0.2f}, 400, {0.78f, 0.52f, 0.29f}, .ior = 1},
    [FV_ATRIUM_MIRROR] = {-1, .shininess = 1, .mirror = {0.90f, 0.92f, 0.91f}, .ior = 1},
    [FV_ATRIUM_WATER] =
        {-1, {0.03f, 0.07f, 0.07f}, .shininess = 1, .mirror = {0.35f, 0.38f, 0.38f}, .ior = 1},
    [FV_ATRIUM_GLASS] = {-1, .specular = {0.3f, 0.3f, 0.3f}, .shininess = 400,
                         .transmission = {0.94f, 0.97f, 0.96f}, .ior = 1.5f},
    [FV_ATRIUM_FLAME] = {-1, .shininess = 1, .ior = 1, .emission = {9, 6.5f, 3.6f}},
};

static struct fv_material material_of(const struct recipe *r, const struct fv_pattern_textures *textures)
{
    struct fv_material m = fv_material_default();
    for (int i = 0; i < 3; i++) {
        m.diffuse[i] = r->tint[i];
        m.specular[i] = r->specular[i];
        m.mirror[i] = r->mirror[i];
        m.transmission[i] = r->transmission[i];
        m.emission[i] = r->emission[i];
    }
    m.shininess = r->shininess;
    m.ior = r->ior;
    if (r->pattern < 0) return m;
    const struct fv_pattern_textures *t = &textures[r->pattern];
    m.base_texture = t->base;
    m.normal_texture = t->normal;
    m.alpha_texture = t->alpha;
    m.alpha_cutoff = FV_SPRIG_CUTOFF;
    return m;
}

/* A fluted shaft: foot radius, top radius, height. */
struct shaft {
    float foot, top, height;
};

static vec3s shaft_surface(const void *context, float s, float t)
{
    enum { FLUTES = 20 };
    const struct shaft *shaft = context;
    /* Denser towards the ends, where the flutes run out. */
    float along = t - 0.8f * sinf(2 * GLM_PIf * t) / (2 * GLM_PIf);
    float f = s * FLUTES - floorf(s * FLUTES), flute = f * 1.5f - 0.25f;
    float depth = flute > 0 && flute < 1 ? sinf(GLM_PIf * flute) : 0;
    float ends = fminf(fminf(along, 1 - along) * 25, 1);
    float r = shaft->foot + (shaft->top - shaft->foot) * along * along;
    r -= 0.10f * r * depth * ends;
    return fv_vec(r * sinf(2 * GLM_PIf * s), shaft->height * along, r * cosf(2 * GLM_PIf * s));
}

/* A leaf of a capital: it leans on the bell and curls outwards. */
struct acanthus {
    float angle, half_angle, height;
};

static vec3s acanthus_surface(const void *context, float s, float t)
{
    const struct acanthus *leaf = context;
    float t4 = t * t * t * t, side = 2 * s - 1;
    float angle = leaf->angle + leaf->half_angle * side * (1 - 0.6f * t * t);
    float r = 0.212f + 0.035f * t + 0.075f * t4 + 0.014f * (1 - side * side);
    return fv_vec(r * sinf(angle), leaf->height * (t - 0.28f * t4 * t), r * cosf(angle));
}

/* A column with its foot at the brush's origin. */
static void column(const struct fv_brush *brush, float height)
{
    static const struct fv_corner base[] = {
        {0.300f, 0.120f, 1},     {0.300f, 0.200f, 0},    {0.280f, 0.200f, 0}, {0.280f, 0.215f, -0.6f},
        {0.262f, 0.268f, 0},     {0.262f, 0.280f, 0.9f}, {0.262f, 0.325f, 0}, {0.250f, 0.325f, 0},
        {0.250f, 0.340f, -0.4f}, {0.228f, 0.380f, 0}};
    static const struct fv_corner bell[] = {{0.202f, 0, 1},           {0.202f, 0.036f, 0},
                                            {0.202f, 0.040f, -0.22f}, {0.290f, 0.280f, 0},
                                            {0.315f, 0.285f, 0.5f},   {0.315f, 0.320f, 0}};
    enum { BASE = sizeof base / sizeof base[0], BELL = sizeof bell / sizeof bell[0] };
    fv_shape_box(brush, fv_vec(-0.33f, 0, -0.33f), fv_vec(0.33f, 0.12f, 0.33f));
    fv_shape_lathe(brush, base, BASE, 36);
    struct shaft shaft = {0.228f, 0.198f, height - 0.42f - 0.38f};
    struct fv_brush at = fv_brush_at(brush, 0, 0.38f, 0, 0);
    fv_shape_sheet(&at, shaft_surface, &shaft, 120, 8, 2, shaft.height);
    at = fv_brush_at(brush, 0, height - 0.42f, 0, 0);
    fv_shape_lathe(&at, bell, BELL, 36);
    for (int i = 0; i < 16; i++) {
        struct acanthus leaf = {GLM_PIf / 8 * (float)i, GLM_PIf / 9, i & 1 ? 0.27f : 0.16f};
        struct fv_brush foot = fv_brush_at(&at, 0, 0.038f, 0, 0);
        fv_shape_sheet(&foot, acanthus_surface, &leaf, 4, 6, 0.15f, leaf.height);
    }
    fv_shape_box(brush, fv_vec(-0.33f, height - 0.10f, -0.33f), fv_vec(0.33f, height, 0.33f));
}

/* Arch, its mouldings on both faces, and a keystone, springing at the brush's origin. */
static void arch(const struct fv_brush *wall, const struct fv_brush *trim, float height)
{
    static const struct fv_corner archivolt[] = {
        {0, SPAN, 0},        {0.04f, SPAN, 0},   {0.04f, 1.27f, 0},     {0.055f, 1.275f, 0.8f},
        {0.055f, 1.310f, 0}, {0.07f, 1.315f, 0}, {0.07f, 1.36f, -0.4f}, {0.10f, 1.39f, 0},
        {0.10f, 1.41f, 0},   {0, 1.41f, 0}};
    fv_shape_arch(wall, BAY, height, WALL, SPAN, 40);
    for (int face = 0; face < 2; face++) {
        struct fv_brush turned = fv_brush_at(trim, 0, 0, 0, (float)face * GLM_PIf);
        struct fv_brush front = fv_brush_at(&turned, 0, 0, WALL / 2, 0);
        fv_shape_archivolt(&front, archivolt, sizeof archivolt / sizeof archivolt[0], 40);
    }
    float reach = WALL / 2 + 0.13f;
    fv_shape_box(trim, fv_vec(-0.09f, SPAN - 0.03f, -reach), fv_vec(0.09f, SPAN + 0.30f, reach));
}

/* Rail, foot and balusters over one bay, standing at the brush's origin. */
static void balustrade(const struct fv_brush *brush)
{
    static const struct fv_corner baluster[] = {
        {0.055f, 0.10f, 0},     {0.055f, 0.13f, 0}, {0.032f, 0.15f, 0.3f}, {0.062f, 0.30f, 0.25f},
        {0.028f, 0.52f, -0.2f}, {0.028f, 0.62f, 0}, {0.042f, 0.63f, 0.9f}, {0.042f, 0.66f, 0},
        {0.028f, 0.67f, -0.3f}, {0.052f, 0.76f, 0}, {0.055f, 0.80f, 0}};
    static const struct fv_corner rail[] = {{0, -0.13f, 0},     {0.13f, -0.13f, 0.7f}, {0.13f, -0.07f, 0},
                                            {0.16f, -0.07f, 0}, {0.16f, -0.03f, 0.4f}, {0.13f, 0, 0},
                                            {0, 0, 0}};
    const float half = BAY / 2 - 0.24f;
    vec3s up = fv_vec(0, 1, 0);
    fv_shape_box(brush, fv_vec(-half, 0, -0.12f), fv_vec(half, 0.10f, 0.12f));
    for (int side = -1; side <= 1; side += 2)
        fv_shape_moulding(brush, rail, sizeof rail / sizeof rail[0], fv_vec(-half, 0.93f, 0),
                          fv_vec(half, 0.93f, 0), fv_vec(0, 0, (float)side), up);
    for (int i = 0; i < 9; i++) {
        struct fv_brush at = fv_brush_at(brush, half * (float)(i - 4) / 4.5f, 0, 0, 0);
        fv_shape_lathe(&at, baluster, sizeof baluster / sizeof baluster[0], 12);
    }
}

/* A wall `width` wide with a round-headed window in its middle, standing in the xy plane. */
static void window_wall(const struct fv_brush *wall, float width, float bottom, float sill, float spring,
                        float top, float radius, float thickness)
{
    float w = width / 2, d = thickness / 2;
    struct fv_brush head = fv_brush_at(wall, 0, spring, 0, 0);
    fv_shape_arch(&head, width, top - spring, thickness, radius, 32);
    fv_shape_box(wall, fv_vec(-w, bottom, -d), fv_vec(w, sill, d));
    fv_shape_box(wall, fv_vec(-w, sill, -d), fv_vec(-radius, spring, d));
    fv_shape_box(wall, fv_vec(radius, sill, -d), fv_vec(w, spring, d));
}

/* A cornice of `length` along x at the brush's origin, with blocks under its shelf. It looks to +z. */
static void cornice(const struct fv_brush *brush, float length)
{
    static const struct fv_corner profile[] = {
        {0, -0.02f, 0},    {0.035f, -0.02f, 0},  {0.035f, 0.05f, -0.4f}, {0.06f, 0.08f, 0}, {0.06f, 0.17f, 0},
        {0.17f, 0.17f, 0}, {0.17f, 0.21f, 0.3f}, {0.20f, 0.26f, 0},      {0.20f, 0.29f, 0}, {0, 0.30f, 0}};
    float half = length / 2;
    fv_shape_moulding(brush, profile, sizeof profile / sizeof profile[0], fv_vec(-half, 0, 0),
                      fv_vec(half, 0, 0), fv_vec(0, 0, 1), fv_vec(0, 1, 0));
    int blocks = (int)(length / 0.2f);
    for (int i = 0; i < blocks; i++) {
        float x = -half + length * ((float)i + 0.5f) / (float)blocks;
        fv_shape_box(brush, fv_vec(x - 0.05f, 0.09f, 0.05f), fv_vec(x + 0.05f, 0.168f, 0.14f));
    }
}

/* One long side of the hall, the one at z < 0; `yaw` 180 degrees gives the other. */
static void long_side(const struct fv_atrium *atrium, float yaw)
{
    struct fv_brush b[FV_ATRIUM_MATERIALS];
    for (int i = 0; i < FV_ATRIUM_MATERIALS; i++) b[i] = fv_brush_at(&atrium->brush[i], 0, 0, 0, yaw);
    for (int i = 0; i <= BAYS; i++) {
        float x = BAY * (float)(i - BAYS / 2);
        struct fv_brush foot = fv_brush_at(&b[FV_ATRIUM_MARBLE], x, 0, -ARCADE, 0);
        column(&foot, LOWER_SPRING);
        foot = fv_brush_at(&b[FV_ATRIUM_MARBLE], x, GALLERY, -ARCADE, 0);
        column(&foot, UPPER_SPRING - GALLERY);
        fv_shape_box(&b[FV_ATRIUM_LIMESTONE], fv_vec(x - 0.22f, 0, -WIDTH),
                     fv_vec(x + 0.22f, LOWER_TOP, -WIDTH + 0.14f));
        fv_shape_box(&b[FV_ATRIUM_WOOD], fv_vec(x - 0.12f, LOWER_TOP - 0.22f, -WIDTH),
                     fv_vec(x + 0.12f, LOWER_TOP, -ARCADE - WALL / 2));
    }
    for (int i = 0; i < BAYS; i++) {
        float x = BAY * ((float)i - (float)BAYS / 2 + 0.5f);
        struct fv_brush wall = fv_brush_at(&b[FV_ATRIUM_BLOCKS], x, LOWER_SPRING, -ARCADE, 0);
        struct fv_brush trim = fv_brush_at(&b[FV_ATRIUM_LIMESTONE], x, LOWER_SPRING, -ARCADE, 0);
        arch(&wall, &trim, LOWER_TOP - LOWER_SPRING);
        wall = fv_brush_at(&b[FV_ATRIUM_PLASTER], x, UPPER_SPRING, -ARCADE, 0);
        trim = fv_brush_at(&b[FV_ATRIUM_LIMESTONE], x, UPPER_SPRING, -ARCADE, 0);
        arch(&wall, &trim, UPPER_TOP - UPPER_SPRING);
        struct fv_brush rail = fv_brush_at(&b[FV_ATRIUM_MARBLE], x, GALLERY, -ARCADE, 0);
        balustrade(&rail);
        wall = fv_brush_at(&b[FV_ATRIUM_PLASTER], x, 0, -WIDTH - 0.2f, 0);
        window_wall(&wall, BAY, GALLERY, GALLERY + 1.1f, 7.4f, ROOF, 0.55f, 0.4f);
    }
    vec3s along = fv_vec(2 * LENGTH, 0, 0), out = fv_vec(0, 0, -(WIDTH - NAVE)),
          in = fv_vec(0, 0, WIDTH - NAVE);
    fv_shape_quad(&b[FV_ATRIUM_BLOCKS], fv_vec(-LENGTH, 0, -WIDTH), along, fv_vec(0, GALLERY, 0));
    fv_shape_quad(&b[FV_ATRIUM_PLASTER], fv_vec(-LENGTH, LOWER_TOP, -WIDTH), along, in);
    fv_shape_quad(&b[FV_ATRIUM_FLOOR], fv_vec(-LENGTH, GALLERY, -NAVE), along, out);
    fv_shape_quad(&b[FV_ATRIUM_WOOD], fv_vec(-LENGTH, UPPER_TOP, -WIDTH), along, in);
    fv_shape_quad(&b[FV_ATRIUM_LIMESTONE], fv_vec(-LENGTH, LOWER_TOP, -NAVE), along,
                  fv_vec(0, GALLERY - LOWER_TOP, 0));
    fv_shape_quad(&b[FV_ATRIUM_PLASTER], fv_vec(-LENGTH, UPPER_TOP, -NAVE), along,
                  fv_vec(0, ROOF - UPPER_TOP, 0));
    fv_shape_quad(&b[FV_ATRIUM_LIMESTONE], fv_vec(-LENGTH, ROOF, -NAVE), along, out);
    struct fv_brush edge = fv_brush_at(&b[FV_ATRIUM_LIMESTONE], 0, LOWER_TOP - 0.05f, -NAVE, 0);
    cornice(&edge, 2 * LENGTH);
    edge = fv_brush_at(&b[FV_ATRIUM_LIMESTONE], 0, UPPER_TOP, -NAVE, 0);
    cornice(&edge, 2 * LENGTH);
}

/* The end wall at x < 0; `yaw` 180 degrees gives the other. */
static void end_wall(const struct fv_atrium *atrium, float yaw)
{
    struct fv_brush b[FV_ATRIUM_MATERIALS];
    for (int i = 0; i < FV_ATRIUM_MATERIALS; i++) { /* z of these brushes looks into the hall */
        struct fv_brush turned = fv_brush_at(&atrium->brush[i], 0, 0, 0, yaw);
        b[i] = fv_brush_at(&turned, -LENGTH, 0, 0, GLM_PI_2f);
    }
    fv_shape_quad(&b[FV_ATRIUM_BLOCKS], fv_vec(-WIDTH, 0, 0), fv_vec(2 * WIDTH, 0, 0), fv_vec(0, GALLERY, 0));
    for (int side = -1; side <= 1; side += 2)
        fv_shape_quad(&b[FV_ATRIUM_PLASTER], fv_vec(side < 0 ? -WIDTH : NAVE, GALLERY, 0),
                      fv_vec(WIDTH - NAVE, 0, 0), fv_vec(0, ROOF - GALLERY, 0));
    struct fv_brush wall = fv_brush_at(&b[FV_ATRIUM_PLASTER], 0, 0, -0.3f, 0);
    window_wall(&wall, 2 * NAVE, GALLERY, GALLERY + 0.9f, 7.3f, ROOF, 1.5f, 0.6f);
    static const struct fv_corner surround[] = {{0, 1.5f, 0},      {0.06f, 1.5f, 0},  {0.06f, 1.62f, 0.6f},
                                                {0.06f, 1.68f, 0}, {0.10f, 1.70f, 0}, {0.10f, 1.76f, 0},
                                                {0, 1.76f, 0}};
    struct fv_brush head = fv_brush_at(&b[FV_ATRIUM_LIMESTONE], 0, 7.3f, 0, 0);
    fv_shape_archivolt(&head, surround, sizeof surround / sizeof surround[0], 48);
    for (int side = -1; side <= 1; side += 2) {
        float a = 1.5f * (float)side, c = 1.76f * (float)side;
        fv_shape_box(&b[FV_ATRIUM_LIMESTONE], fv_vec(fminf(a, c), GALLERY + 0.9f, 0),
                     fv_vec(fmaxf(a, c), 7.3f, 0.09f));
    }
    fv_shape_box(&b[FV_ATRIUM_LIMESTONE], fv_vec(-1.9f, GALLERY + 0.8f, -0.6f),
                 fv_vec(1.9f, GALLERY + 0.9f, 0.16f));
    struct fv_brush edge = fv_brush_at(&b[FV_ATRIUM_LIMESTONE], 0, LOWER_TOP - 0.05f, 0, 0);
    cornice(&edge, 2 * NAVE);
    edge = fv_brush_at(&b[FV_ATRIUM_LIMESTONE], 0, UPPER_TOP, 0, 0);
    cornice(&edge, 2 * NAVE);
}

/* Floor with inlaid bands, and the beams that coffer the open roof. */
static void floor_and_roof(const struct fv_atrium *atrium)
{
    const struct fv_brush *inlay = &atrium->brush[FV_ATRIUM_INLAY], *wood = &atrium->brush[FV_ATRIUM_WOOD];
    const float band = 0.003f, thick = 0.25f;
    fv_shape_quad(&atrium->brush[FV_ATRIUM_FLOOR], fv_vec(-LENGTH, 0, WIDTH), fv_vec(2 * LENGTH, 0, 0),
                  fv_vec(0, 0, -2 * WIDTH));
    for (int side = -1; side <= 1; side += 2) {
        float z = 3.0f * (float)side, x = 10.75f * (float)side;
        fv_shape_box(inlay, fv_vec(-11, -band, z - thick), fv_vec(11, band, z + thick));
        fv_shape_box(inlay, fv_vec(x - thick, -band, -3 + thick), fv_vec(x + thick, band, 3 - thick));
    }
    static const struct fv_corner ring[] = {{2.45f, -0.003f, 0}, {2.45f, 0.003f, 0}, {1.95f, 0.003f, 0}};
    fv_shape_lathe(inlay, ring, 3, 96);
    for (int i = 0; i <= BAYS; i++) {
        float x = BAY * (float)(i - BAYS / 2);
        fv_shape_box(wood, fv_vec(x - 0.11f, ROOF - 0.32f, -NAVE), fv_vec(x + 0.11f, ROOF, NAVE));
    }
    for (int i = -1; i <= 1; i++) {
        float z = 1.8f * (float)i;
        fv_shape_box(wood, fv_vec(-LENGTH, ROOF - 0.22f, z - 0.07f), fv_vec(LENGTH, ROOF - 0.02f, z + 0.07f));
    }
}

int fv_atrium_read(struct fv_build *build, struct fv_error *error)
{
    /* Chandelier, and the bright part of the sky, high over the open roof and to one side. */
    static const struct fv_light lights[] = {
        {FV_LIGHT_POINT, .position = {0, 5.3f, 0}, .colour = {42, 33, 22}},
        {FV_LIGHT_AREA, .position = {-5, 18.5f, -8}, .u = {16, 0, 0}, .v = {0, 3, 8},
         .colour = {15, 14.3f, 13.2f}},
    };
    struct fv_pattern_textures textures[FV_PATTERNS];
    struct fv_atrium atrium;
    fv_patterns_paint(build, textures);
    for (int i = 0; i < FV_ATRIUM_MATERIALS; i++) {
        struct fv_material material = material_of(&recipes[i], textures);
        atrium.brush[i] = (struct fv_brush){.build = build, .place = glms_mat4_identity(), .repeats = 0.5f};
        atrium.brush[i].material = fv_build_material(build, &material);
        if (recipes[i].pattern >= 0)
            atrium.brush[i].repeats = fv_pattern_repeats((enum fv_pattern)recipes[i].pattern);
    }
    for (int half = 0; half < 2; half++) {
        long_side(&atrium, (float)half * GLM_PIf);
        end_wall(&atrium, (float)half * GLM_PIf);
    }
    floor_and_roof(&atrium);
    fv_atrium_furnish(&atrium);
    fv_atrium_plant(&atrium);
    for (unsigned i = 0; i < sizeof lights / sizeof lights[0]; i++)
        if (fv_build_light(build, &lights[i], error) < 0) return -1;
    return 0;
}
