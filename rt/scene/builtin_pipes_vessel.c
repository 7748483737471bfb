/* builtin_pipes_vessel: vessels and exchangers among the pipes, and what stands around the structure; see
 * builtin_pipes.h. */
#include "rt/scene/builtin_pipes.h"

#include "rt/scene/builtin_random.h"

#include <math.h>

#define COUNT(array) ((int)(sizeof(array) / sizeof(array)[0]))
enum { ROUND = 64 };

struct fv_brush fv_pipes_along(const struct fv_brush *brush, vec3s origin, vec3s axis)
{
    struct fv_brush moved = *brush;
    vec3s x = glms_vec3_normalize(glms_vec3_ortho(axis)), z = glms_vec3_cross(x, axis);
    mat4s place = {{{x.x, x.y, x.z, 0},
                    {axis.x, axis.y, axis.z, 0},
                    {z.x, z.y, z.z, 0},
                    {origin.x, origin.y, origin.z, 1}}};
    moved.place = glms_mat4_mul(brush->place, place);
    return moved;
}

/* A short pipe with a blind flange, sticking out of something at `at`. */
static void nozzle(const struct fv_brush *brush, vec3s at, vec3s out, float radius, float length)
{
    const struct fv_corner profile[] = {{radius, -0.05f, 0},
                                        {radius, length, 0},
                                        {1.5f * radius, length, 0},
                                        {1.5f * radius, length + 0.08f, 0},
                                        {0, length + 0.08f, 0}};
    struct fv_brush placed = fv_pipes_along(brush, at, out);
    fv_shape_lathe(&placed, profile, COUNT(profile), 20);
}

/* A cylinder with dished ends, between y = 0 and `length`, welded from rings. */
static void shell(const struct fv_brush *brush, float radius, float length)
{
    float dish = 0.45f * radius, bulge = 0.28f;
    const struct fv_corner profile[] = {
        {0, 0, bulge}, {radius, dish, 0}, {radius, length - dish, bulge}, {0, length, 0}};
    fv_shape_lathe(brush, profile, COUNT(profile), ROUND);
    for (float y = dish; y <= length - dish + 0.01f; y += 1) {
        const struct fv_corner ring[] = {{0.99f * radius, y - 0.02f, 0},
                                         {radius + 0.015f, y - 0.02f, 0},
                                         {radius + 0.015f, y + 0.02f, 0},
                                         {0.99f * radius, y + 0.02f, 0}};
        fv_shape_lathe(brush, ring, COUNT(ring), ROUND);
    }
}

/* Upright, on a skirt, with nozzles around and a ladder in front. */
static void upright_vessel(const struct fv_pipes *pipes, const struct fv_brush *shell_brush, vec3s foot,
                           float height, uint32_t *random)
{
    const float radius = 0.85f, skirt = 0.7f;
    struct fv_brush at = fv_brush_at(shell_brush, foot.x, foot.y + skirt - 0.3f, foot.z, 0);
    shell(&at, radius, height - skirt);
    fv_shape_tube(&pipes->brush[FV_PIPES_STEEL], foot, fv_vec(foot.x, foot.y + skirt, foot.z), radius - 0.02f,
                  radius - 0.02f, ROUND);
    for (int i = 0; i < 6; i++) {
        float angle = fv_random_between(random, 0.5f, 5.8f),
              y = fv_random_between(random, 0.8f, height - 1.2f);
        float r = fv_random_between(random, 0.04f, 0.12f);
        vec3s out = fv_vec(sinf(angle), 0, cosf(angle));
        nozzle(shell_brush, glms_vec3_add(fv_vec(foot.x, foot.y + y, foot.z), glms_vec3_scale(out, radius)),
               out, r, 0.14f);
    }
    struct fv_brush ladder =
        fv_brush_at(&pipes->brush[FV_PIPES_RAILING], foot.x, foot.y, foot.z + radius + 0.08f, 0);
    fv_pipes_ladder(&ladder, height - 0.2f);
}

/* Lying along x on two saddles, a channel cover with its bolts at either end. */
static void exchanger(const struct fv_pipes *pipes, const struct fv_brush *shell_brush, vec3s middle,
                      float length, uint32_t *random)
{
    const float radius = 0.72f;
    vec3s axis = fv_vec(1, 0, 0), start = fv_vec(middle.x - length / 2, middle.y, middle.z);
    struct fv_brush lying = fv_pipes_along(shell_brush, start, axis);
    shell(&lying, radius, length);
    for (int i = -1; i <= 1; i += 2) {
        float x = middle.x + 0.3f * length * (float)i, y = length / 2 + 0.3f * length * (float)i;
        fv_shape_box(&pipes->brush[FV_PIPES_STEEL], fv_vec(x - 0.12f, middle.y - 1.15f, middle.z - 0.5f),
                     fv_vec(x + 0.12f, middle.y - 0.45f, middle.z + 0.5f));
        const struct fv_corner girth[] = {{radius - 0.01f, y + 0.25f, 0},
                                          {radius + 0.1f, y + 0.25f, 0},
                                          {radius + 0.1f, y + 0.37f, 0},
                                          {radius - 0.01f, y + 0.37f, 0}};
        fv_shape_lathe(&lying, girth, COUNT(girth), ROUND);
        for (int n = 0; n < 28; n++) {
            float angle = 2 * GLM_PIf * (float)n / 28, r = radius + 0.05f;
            const struct fv_corner bolt[] = {
                {0, y + 0.2f, 0}, {0.018f, y + 0.2f, 0}, {0.018f, y + 0.42f, 0}, {0, y + 0.42f, 0}};
            struct fv_brush hole = fv_brush_at(&lying, r * cosf(angle), 0, r * sinf(angle), 0);
            hole.material = pipes->brush[FV_PIPES_BOLTS].material;
            fv_shape_lathe(&hole, bolt, COUNT(bolt), 6);
        }
    }
    for (int i = 0; i < 3; i++) {
        float x = start.x + length * fv_random_between(random, 0.2f, 0.8f),
              r = fv_random_between(random, 0.06f, 0.14f);
        nozzle(shell_brush, fv_vec(x, middle.y + radius, middle.z), fv_vec(0, 1, 0), r, 0.16f);
    }
}

void fv_pipes_equip(struct fv_pipes *pipes)
{
    enum { PLACES = 60 };
    static const int paints[] = {FV_PIPES_VESSEL, FV_PIPES_POLISHED, FV_PIPES_TANK, FV_PIPES_CLADDING};
    for (int i = 0; i < PLACES; i++) {
        uint32_t random = fv_random_stream(5000 + i);
        bool lies = fv_random_below(&random, 2);
        int high = fv_random_below(&random, 2) ? 2 * FV_PIPES_STOREY - 1 : FV_PIPES_STOREY;
        const int cells[3] = {lies ? 4 : 2, lies ? 2 : high, 2};
        int storey = fv_random_below(&random, 2),
            low[3] = {fv_random_below(&random, FV_PIPES_NX), FV_PIPES_STOREY * storey,
                      fv_random_below(&random, FV_PIPES_NZ)};
        const struct fv_brush *paint = &pipes->brush[paints[fv_random_below(&random, COUNT(paints))]];
        if (!fv_pipes_all_free(pipes, low, cells)) continue;
        fv_pipes_claim(pipes, low, cells, FV_PIPES_EQUIPMENT);
        vec3s foot = fv_pipes_middle(low);
        foot = fv_vec(foot.x + 0.5f * FV_PIPES_CELL * (float)(cells[0] - 1), FV_PIPES_CELL * (float)low[1],
                      foot.z + 0.5f * FV_PIPES_CELL);
        float height = FV_PIPES_CELL * (float)cells[1];
        if (lies)
            exchanger(pipes, paint, fv_vec(foot.x, foot.y + 1.15f, foot.z),
                      0.92f * FV_PIPES_CELL * (float)cells[0], &random);
        else upright_vessel(pipes, paint, foot, height - 0.2f, &random);
    }
}

/* Storage: a low cylinder with a coned roof, stiffening rings, a ladder and a railing round the roof. */
static void tank(const struct fv_pipes *pipes, float x, float z, float radius, float height)
{
    struct fv_brush at = fv_brush_at(&pipes->brush[FV_PIPES_TANK], x, 0, z, 0);
    const struct fv_corner profile[] = {{radius, 0, 0}, {radius, height, 0}, {0, height + 0.12f * radius, 0}};
    fv_shape_lathe(&at, profile, COUNT(profile), 96);
    for (float y = 1.8f; y < height; y += 1.8f) {
        const struct fv_corner ring[] = {{radius - 0.01f, y, 0},
                                         {radius + 0.08f, y, 0},
                                         {radius + 0.08f, y + 0.06f, 0},
                                         {radius - 0.01f, y + 0.06f, 0}};
        fv_shape_lathe(&at, ring, COUNT(ring), 96);
    }
    enum { POSTS = 36 };
    const struct fv_brush *rail = &pipes->brush[FV_PIPES_RAILING];
    for (int i = 0; i < POSTS; i++) {
        float a = 2 * GLM_PIf * (float)i / POSTS, b = 2 * GLM_PIf * (float)(i + 1) / POSTS,
              r = radius - 0.05f;
        fv_pipes_railing(rail, fv_vec(x + r * cosf(a), height, z + r * sinf(a)),
                         fv_vec(x + r * cosf(b), height, z + r * sinf(b)));
    }
    struct fv_brush ladder = fv_brush_at(rail, x, 0, z + radius + 0.15f, 0);
    fv_pipes_ladder(&ladder, height + 1.1f);
}

/* In bands of two colours, with platforms. */
static void chimney(const struct fv_pipes *pipes, float x, float z, float height)
{
    enum { BANDS = 9 };
    for (int i = 0; i < BANDS; i++) {
        const struct fv_brush *brush = &pipes->brush[i % 2 ? FV_PIPES_TANK : FV_PIPES_RED];
        float a = (float)i / BANDS, b = (float)(i + 1) / BANDS;
        fv_shape_tube(brush, fv_vec(x, height * a, z), fv_vec(x, height * b, z), 2 - 0.8f * a, 2 - 0.8f * b,
                      ROUND);
        if (i % 3 != 2) continue;
        const struct fv_corner deck[] = {{0.5f, -0.1f, 0}, {3, -0.1f, 0}, {3, 0, 0}, {0.5f, 0, 0}};
        struct fv_brush at = fv_brush_at(&pipes->brush[FV_PIPES_STEEL], x, height * b - 1.5f, z, 0);
        fv_shape_lathe(&at, deck, COUNT(deck), ROUND);
        for (int n = 0; n < 20; n++) {
            float c = 2 * GLM_PIf * (float)n / 20, d = 2 * GLM_PIf * (float)(n + 1) / 20;
            fv_pipes_railing(&at, fv_vec(2.95f * cosf(c), 0, 2.95f * sinf(c)),
                             fv_vec(2.95f * cosf(d), 0, 2.95f * sinf(d)));
        }
    }
}

struct tower {
    float foot, throat, height, side; /* side: 1 outside, -1 inside */
};

static vec3s tower_surface(const void *context, float s, float t)
{
    const struct tower *w = context;
    float y = 1.35f * t - 1, wide = sqrtf(1 + y * y * (w->foot * w->foot / (w->throat * w->throat) - 1));
    float angle = 2 * GLM_PIf * s * w->side, r = w->throat * wide - (w->side < 0 ? 0.3f : 0);
    return fv_vec(r * sinf(angle), w->height * t, r * cosf(angle));
}

static void cooling_tower(const struct fv_pipes *pipes, float x, float z)
{
    struct fv_brush at = fv_brush_at(&pipes->brush[FV_PIPES_CONCRETE], x, 5, z, 0);
    for (int side = -1; side <= 1; side += 2) {
        struct tower w = {20, 11.5f, 48, (float)side};
        fv_shape_sheet(&at, tower_surface, &w, 128, 40, 1, 1);
    }
    for (int i = 0; i < 40; i++) {
        float a = 2 * GLM_PIf * (float)i / 40, b = a + (i % 2 ? 0.15f : -0.15f);
        fv_shape_tube(&at, fv_vec(20.5f * cosf(a), -5, 20.5f * sinf(a)),
                      fv_vec(19.85f * cosf(b), 0.1f, 19.85f * sinf(b)), 0.4f, 0.4f, 12);
    }
}

/* Gas under pressure: a sphere on legs. */
static void ball(const struct fv_pipes *pipes, float x, float z, float radius)
{
    float y = radius + 2.5f;
    fv_shape_sphere(&pipes->brush[FV_PIPES_POLISHED], fv_vec(x, y, z), radius, ROUND * 3 / 2);
    for (int i = 0; i < 12; i++) {
        float a = 2 * GLM_PIf * (float)i / 12, b = a + GLM_PIf / 6, r = 0.99f * radius;
        vec3s foot = fv_vec(x + r * cosf(a), 0, z + r * sinf(a)),
              next = fv_vec(x + r * cosf(b), y - 1, z + r * sinf(b));
        fv_shape_tube(&pipes->brush[FV_PIPES_TANK], foot, fv_vec(foot.x, y, foot.z), 0.25f, 0.25f, 20);
        fv_shape_tube(&pipes->brush[FV_PIPES_STEEL], fv_vec(foot.x, 0.5f, foot.z), next, 0.04f, 0.04f, 8);
    }
}

void fv_pipes_surround(const struct fv_pipes *pipes)
{
    static const float tanks[][4] = {{-30, -28, 8, 11}, {-8, -30, 9, 13}, {14, -27, 6, 9},  {-22, 30, 9, 12},
                                     {4, 28, 7, 10},    {60, 12, 10, 14}, {-58, -12, 9, 12}};
    static const float chimneys[][3] = {{34, -28, 46}, {44, -24, 46}, {-62, 26, 60}};
    static const float towers[][2] = {{78, -62}, {-86, -70}, {90, 66}};
    const float slab = 6, reach = 15, joint = 0.01f;
    fv_shape_quad(&pipes->brush[FV_PIPES_GRAVEL], fv_vec(-400, -0.03f, 400), fv_vec(800, 0, 0),
                  fv_vec(0, 0, -800));
    for (float x = -reach; x < reach; x++)
        for (float z = -reach; z < reach; z++) {
            uint32_t shade = fv_random_stream((int)(x + 30 * z) + 9000);
            const struct fv_brush *brush =
                &pipes->brush[fv_random_below(&shade, 3) ? FV_PIPES_SLAB : FV_PIPES_SLAB_DARK];
            fv_shape_box(brush, fv_vec(slab * x + joint, -0.2f, slab * z + joint),
                         fv_vec(slab * (x + 1) - joint, 0, slab * (z + 1) - joint));
        }
    for (int i = 0; i < COUNT(tanks); i++) tank(pipes, tanks[i][0], tanks[i][1], tanks[i][2], tanks[i][3]);
    for (int i = 0; i < COUNT(chimneys); i++) chimney(pipes, chimneys[i][0], chimneys[i][1], chimneys[i][2]);
    for (int i = 0; i < COUNT(towers); i++) cooling_tower(pipes, towers[i][0], towers[i][1]);
    ball(pipes, 28, 27, 6);
    ball(pipes, 44, 30, 6);
}
