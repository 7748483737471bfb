/* builtin_furnish: fountain, chandelier, cloths, mirrors and what stands on pedestals; see
 * builtin_atrium.h. */
#include "rt/scene/builtin_atrium.h"

#include <math.h>

#define COUNT(array) ((int)(sizeof(array) / sizeof(array)[0]))

/* A cloth that hangs from a rod along x: hem and folds deepen downwards, the foot is cut to a tail. */
struct banner {
    float width, height, phase;
};

static vec3s banner_surface(const void *context, float s, float t)
{
    const struct banner *b = context;
    float fall = 1 - t, x = (s - 0.5f) * b->width;
    float drop = b->height - 0.28f * fabsf(2 * s - 1) + 0.28f;
    float fold = sinf(13 * s + b->phase + 0.9f * fall) + 0.45f * sinf(29 * s - 2 * b->phase + 2 * fall);
    float swell = 0.05f * sinf(3.1f * fall + b->phase + 2 * s);
    return fv_vec(x * (1 - 0.05f * fall), -drop * fall,
                  (0.012f + 0.045f * fall) * fold + swell * fall + 0.06f);
}

/* A sail slung across the nave along z: it sags, and its length puckers where it is gathered. */
struct sail {
    float width, span, sag, phase;
};

static vec3s sail_surface(const void *context, float s, float t)
{
    const struct sail *sail = context;
    float z = 2 * s - 1, gather = z * z * z * z, across = t - 0.5f;
    float fold = 0.05f * sinf(26 * across + sail->phase) * (0.25f + gather) +
                 0.05f * sinf(5 * z + 6 * across + sail->phase) * (1 - gather);
    float trough = 0.25f * (4 * across * across - 0.3f) * (1 - gather);
    return fv_vec(sail->width * across * (1 - 0.45f * gather), sail->sag * (z * z - 1) + fold + trough,
                  sail->span * 0.5f * z);
}

/* A pool's surface: rings that run out from the middle. s goes round, t outwards. */
static vec3s pool_surface(const void *context, float s, float t)
{
    const float *radii = context;
    float r = radii[1] + (radii[0] - radii[1]) * t, angle = 2 * GLM_PIf * s;
    float ripple = 0.0025f * sinf(38 * r) + 0.0010f * sinf(17 * r * cosf(angle) + 11 * r * sinf(angle));
    return fv_vec(r * cosf(angle), ripple, r * sinf(angle));
}

static void fountain(const struct fv_atrium *atrium)
{
    static const struct fv_corner basin[] = {
        {1.62f, 0, 0},     {1.62f, 0.10f, 0},    {1.50f, 0.10f, 0}, {1.50f, 0.14f, -0.45f},
        {1.38f, 0.26f, 0}, {1.38f, 0.38f, 0.1f}, {1.44f, 0.48f, 0}, {1.50f, 0.48f, 0.9f},
        {1.50f, 0.58f, 0}, {1.24f, 0.58f, 0.6f}, {1.24f, 0.52f, 0}, {1.22f, 0.20f, 0},
        {0.20f, 0.20f, 0}};
    static const struct fv_corner bowl[] = {
        {0.24f, 0.20f, 0},      {0.24f, 0.50f, -0.3f}, {0.15f, 0.60f, 0}, {0.15f, 0.63f, 0.8f},
        {0.15f, 0.70f, -0.15f}, {0.10f, 0.86f, 0.1f},  {0.13f, 1.02f, 0}, {0.13f, 1.04f, 0.9f},
        {0.13f, 1.09f, -0.1f},  {0.30f, 1.14f, 0.25f}, {0.64f, 1.30f, 0}, {0.67f, 1.30f, 0.9f},
        {0.67f, 1.35f, 0},      {0.60f, 1.34f, -0.2f}, {0.08f, 1.19f, 0}, {0.06f, 1.40f, -0.3f},
        {0.09f, 1.50f, 0.5f},   {0.07f, 1.55f, 0},     {0, 1.55f, 0}};
    static const float pool[2] = {1.23f, 0.15f}, upper_pool[2] = {0.61f, 0.08f};
    fv_shape_lathe(&atrium->brush[FV_ATRIUM_MARBLE], basin, COUNT(basin), 128);
    fv_shape_lathe(&atrium->brush[FV_ATRIUM_MARBLE], bowl, COUNT(bowl), 96);
    /* Turned so that the rings' outside is up. */
    struct fv_brush water = fv_brush_at(&atrium->brush[FV_ATRIUM_WATER], 0, 0.46f, 0, 0);
    fv_shape_sheet(&water, pool_surface, pool, 96, 40, 1, 1);
    water = fv_brush_at(&atrium->brush[FV_ATRIUM_WATER], 0, 1.315f, 0, 0);
    fv_shape_sheet(&water, pool_surface, upper_pool, 64, 16, 1, 1);
    fv_shape_sphere(&atrium->brush[FV_ATRIUM_POLISHED], fv_vec(0, 1.74f, 0), 0.20f, 48);
}

/* A ring of candles about the hall's point light. */
static void chandelier(const struct fv_atrium *atrium)
{
    enum { CANDLES = 12, CHAINS = 4 };
    static const struct fv_corner ring[] = {
        {0.90f, -0.045f, 0.8f}, {0.90f, 0.045f, 0.8f}, {0.90f, -0.045f, 0}};
    static const struct fv_corner cup[] = {{0, 0.03f, 0},         {0.02f, 0.03f, 0}, {0.02f, 0.07f, 0.35f},
                                           {0.065f, 0.12f, 0.9f}, {0.06f, 0.13f, 0}, {0, 0.11f, 0}};
    static const struct fv_corner candle[] = {{0.022f, 0.11f, 0}, {0.022f, 0.24f, 0.5f}, {0, 0.25f, 0}};
    static const struct fv_corner flame[] = {{0, 0.255f, 0.45f}, {0.020f, 0.295f, 0.12f}, {0, 0.36f, 0}};
    static const struct fv_corner hub[] = {
        {0, 1.00f, 0.5f}, {0.09f, 1.08f, 0.3f}, {0.03f, 1.18f, 0}, {0, 1.20f, 0}};
    const struct fv_brush *metal = &atrium->brush[FV_ATRIUM_GILT];
    struct fv_brush at = fv_brush_at(metal, 0, 5.45f, 0, 0);
    fv_shape_lathe(&at, ring, COUNT(ring), 96);
    fv_shape_lathe(&at, hub, COUNT(hub), 32);
    for (int i = 0; i < CANDLES; i++) {
        float angle = 2 * GLM_PIf * (float)i / CANDLES;
        struct fv_brush place = fv_brush_at(&at, 0.92f * cosf(angle), 0, 0.92f * sinf(angle), 0);
        fv_shape_lathe(&place, cup, COUNT(cup), 16);
        struct fv_brush wax = fv_brush_of(&place, atrium->brush[FV_ATRIUM_LIMESTONE].material, 0.5f);
        fv_shape_lathe(&wax, candle, COUNT(candle), 12);
        struct fv_brush fire = fv_brush_of(&place, atrium->brush[FV_ATRIUM_FLAME].material, 0.5f);
        fv_shape_lathe(&fire, flame, COUNT(flame), 12);
    }
    for (int i = 0; i < CHAINS; i++) {
        float angle = 2 * GLM_PIf * ((float)i + 0.5f) / CHAINS;
        vec3s foot = fv_vec(0.92f * cosf(angle), 0.04f, 0.92f * sinf(angle));
        fv_shape_tube(&at, foot, fv_vec(0, 1.1f, 0), 0.010f, 0.010f, 8);
    }
    fv_shape_tube(&at, fv_vec(0, 1.1f, 0), fv_vec(0, 4.4f, 0), 0.014f, 0.014f, 8);
}

static void hang(const struct fv_atrium *atrium)
{
    static const struct {
        float bay, width, height; /* bay: x of its middle */
        enum fv_atrium_material cloth;
    } banners[] = {
        {-7.5f, 1.35f, 2.0f, FV_ATRIUM_CRIMSON},
        {-1.5f, 1.35f, 2.0f, FV_ATRIUM_INDIGO},
        {4.5f, 1.35f, 2.0f, FV_ATRIUM_SAFFRON},
        {10.5f, 1.35f, 2.0f, FV_ATRIUM_CRIMSON},
    };
    static const struct {
        float x, sag;
        enum fv_atrium_material cloth;
    } sails[] = {{-6, 0.9f, FV_ATRIUM_SAFFRON}, {-3, 0.75f, FV_ATRIUM_CRIMSON}, {6, 0.9f, FV_ATRIUM_INDIGO}};
    for (int half = 0; half < 2; half++) {
        float yaw = (float)half * GLM_PIf;
        for (int i = 0; i < COUNT(banners); i++) {
            struct banner banner = {banners[i].width, banners[i].height, 1.7f * (float)(i + 4 * half)};
            struct fv_brush turned = fv_brush_at(&atrium->brush[banners[i].cloth], 0, 0, 0, yaw);
            struct fv_brush at = fv_brush_at(&turned, banners[i].bay, 5.90f, -3.26f, 0);
            fv_shape_sheet(&at, banner_surface, &banner, 56, 48, banner.width, banner.height);
            struct fv_brush rod = fv_brush_of(&at, atrium->brush[FV_ATRIUM_GILT].material, 0.5f);
            fv_shape_tube(&rod, fv_vec(-0.8f, 0.01f, 0.06f), fv_vec(0.8f, 0.01f, 0.06f), 0.022f, 0.022f, 12);
            for (int end = -1; end <= 1; end += 2) { /* knob, and the bracket on the rail */
                fv_shape_sphere(&rod, fv_vec(0.8f * (float)end, 0.01f, 0.06f), 0.04f, 16);
                fv_shape_tube(&rod, fv_vec(0.72f * (float)end, -0.06f, -0.42f),
                              fv_vec(0.72f * (float)end, 0.01f, 0.06f), 0.014f, 0.014f, 8);
            }
        }
    }
    for (int i = 0; i < COUNT(sails); i++) {
        struct sail sail = {1.5f, 7.1f, sails[i].sag, 2.3f * (float)i};
        struct fv_brush at = fv_brush_at(&atrium->brush[sails[i].cloth], sails[i].x, 9.15f, 0, 0);
        fv_shape_sheet(&at, sail_surface, &sail, 128, 40, sail.span, sail.width);
    }
}

/* A wall mirror of w x h in a gilt frame, its foot at the brush's origin, looking to +z. */
static void mirror(const struct fv_brush *glass, const struct fv_brush *gilt, float w, float h)
{
    static const struct fv_corner frame[] = {
        {0, 0, 0},         {0.07f, 0, 0.4f},  {0.07f, 0.05f, 0}, {0.05f, 0.06f, -0.3f}, {0.09f, 0.13f, 0.7f},
        {0.09f, 0.20f, 0}, {0.04f, 0.22f, 0}, {0, 0.22f, 0}};
    const float d = 0.22f;
    vec3s z = fv_vec(0, 0, 1), x = fv_vec(1, 0, 0), y = fv_vec(0, 1, 0);
    vec3s low = fv_vec(-w / 2, d, 0), high = fv_vec(w / 2, h - d, 0);
    vec3s top_left = fv_vec(low.x, high.y, 0), foot_right = fv_vec(high.x, low.y, 0);
    fv_shape_quad(glass, fv_vec(low.x, low.y, 0.03f), fv_vec(w, 0, 0), fv_vec(0, h - 2 * d, 0));
    fv_shape_moulding(gilt, frame, COUNT(frame), top_left, high, z, y);
    fv_shape_moulding(gilt, frame, COUNT(frame), low, foot_right, z, glms_vec3_negate(y));
    fv_shape_moulding(gilt, frame, COUNT(frame), foot_right, high, z, x);
    fv_shape_moulding(gilt, frame, COUNT(frame), low, top_left, z, glms_vec3_negate(x));
    static const struct fv_corner rosette[] = {
        {0.13f, 0, 0}, {0.13f, 0.08f, 0.5f}, {0.09f, 0.10f, -0.5f}, {0.05f, 0.10f, 0.6f}, {0, 0.14f, 0}};
    for (int i = 0; i < 4; i++) {
        float cx = (i & 1 ? 0.5f : -0.5f) * (w + d), cy = i & 2 ? h - d / 2 : d / 2;
        struct fv_brush corner = fv_brush_at(gilt, cx, cy, 0, 0);
        fv_shape_box(&corner, fv_vec(-0.13f, -0.13f, 0), fv_vec(0.13f, 0.13f, 0.08f));
        corner.place = glms_rotate_x(corner.place, GLM_PI_2f); /* the lathe's y to z */
        fv_shape_lathe(&corner, rosette, COUNT(rosette), 32);
    }
}

static void pedestal(const struct fv_brush *brush)
{
    fv_shape_box(brush, fv_vec(-0.30f, 0, -0.30f), fv_vec(0.30f, 0.12f, 0.30f));
    fv_shape_box(brush, fv_vec(-0.26f, 0.12f, -0.26f), fv_vec(0.26f, 0.17f, 0.26f));
    fv_shape_box(brush, fv_vec(-0.22f, 0.17f, -0.22f), fv_vec(0.22f, 0.92f, 0.22f));
    fv_shape_box(brush, fv_vec(-0.26f, 0.92f, -0.26f), fv_vec(0.26f, 0.96f, 0.26f));
    fv_shape_box(brush, fv_vec(-0.29f, 0.96f, -0.29f), fv_vec(0.29f, 1.02f, 0.29f));
}

/* Glass and bronze on four pedestals round the fountain. */
static void exhibits(const struct fv_atrium *atrium)
{
    static const struct fv_corner stand[] = {
        {0.20f, 0, 0}, {0.20f, 0.03f, -0.5f}, {0.13f, 0.10f, 0}, {0.10f, 0.10f, 0}};
    static const struct fv_corner vase[] = {
        /* solid glass, closed at both poles */
        {0, 0.002f, 0},        {0.13f, 0.002f, 0.6f}, {0.12f, 0.05f, -0.5f},
        {0.07f, 0.10f, -0.1f}, {0.20f, 0.42f, 0.5f},  {0.10f, 0.66f, -0.5f},
        {0.13f, 0.80f, 0.9f},  {0.11f, 0.82f, -0.3f}, {0, 0.74f, 0}};
    static const struct fv_corner urn[] = {
        {0.15f, 0, 0},         {0.15f, 0.04f, -0.5f}, {0.05f, 0.11f, 0.6f}, {0.05f, 0.15f, -0.1f},
        {0.24f, 0.42f, 0.35f}, {0.22f, 0.56f, -0.5f}, {0.15f, 0.64f, 0},    {0.15f, 0.68f, -0.3f},
        {0.21f, 0.76f, 0.9f},  {0.20f, 0.78f, 0},     {0.13f, 0.68f, 0},    {0.13f, 0.4f, 0},
        {0, 0.3f, 0}};
    static const float place[4][2] = {{4.5f, 2.55f}, {4.5f, -2.55f}, {-4.5f, 2.55f}, {-4.5f, -2.55f}};
    struct fv_brush at[4];
    for (int i = 0; i < 4; i++) {
        struct fv_brush foot =
            fv_brush_at(&atrium->brush[FV_ATRIUM_LIMESTONE], place[i][0], 0, place[i][1], 0);
        pedestal(&foot);
        at[i] = fv_brush_at(&foot, 0, 1.02f, 0, 0);
    }
    for (int i = 0; i < 4; i += 3) { /* spheres: glass in front, polished bronze at the far corner */
        struct fv_brush metal = fv_brush_of(&at[i], atrium->brush[FV_ATRIUM_BRONZE].material, 0.5f);
        fv_shape_lathe(&metal, stand, COUNT(stand), 32);
        enum fv_atrium_material of = i ? FV_ATRIUM_POLISHED : FV_ATRIUM_GLASS;
        struct fv_brush ball = fv_brush_of(&at[i], atrium->brush[of].material, 0.5f);
        fv_shape_sphere(&ball, fv_vec(0, 0.38f, 0), 0.30f, 64);
    }
    struct fv_brush glass = fv_brush_of(&at[2], atrium->brush[FV_ATRIUM_GLASS].material, 0.5f);
    fv_shape_lathe(&glass, vase, COUNT(vase), 64);
    struct fv_brush bronze = fv_brush_of(&at[1], atrium->brush[FV_ATRIUM_BRONZE].material, 0.5f);
    fv_shape_lathe(&bronze, urn, COUNT(urn), 64);
}

void fv_atrium_furnish(const struct fv_atrium *atrium)
{
    fountain(atrium);
    chandelier(atrium);
    hang(atrium);
    exhibits(atrium);
    for (int end = 0; end < 2; end++) {
        float x = end ? 11.99f : -11.99f, yaw = end ? -GLM_PI_2f : GLM_PI_2f;
        struct fv_brush glass = fv_brush_at(&atrium->brush[FV_ATRIUM_MIRROR], x, 0.3f, 0, yaw);
        struct fv_brush gilt = fv_brush_at(&atrium->brush[FV_ATRIUM_GILT], x, 0.3f, 0, yaw);
        mirror(&glass, &gilt, 3.2f, 4.0f);
    }
}
