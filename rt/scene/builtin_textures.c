/* builtin_textures: marble, stone, plaster, cloth, wood and leaves; see builtin_textures.h.
 *
 * A pattern is a function from a place in the tile to colour, coverage and relief; a row of the
 * table below says what is kept of it. Colours here are sRGB-encoded, as fv_build_texture takes
 * them. */
#include "rt/scene/builtin_textures.h"

#include <math.h>
#include <stdlib.h>

enum { SIZE = 512 };

struct texel {
    float colour[3]; /* sRGB-encoded, 0..1; clamped later */
    float coverage;
    float height_m;
};

typedef void paint(float u, float v, struct texel *out);

/* Finaliser of MurmurHash3 (Austin Appleby, public domain). */
static uint32_t hash(uint32_t x, uint32_t y, uint32_t seed)
{
    uint32_t h = x * 0x9e3779b1u ^ y * 0x85ebca77u ^ seed * 0xc2b2ae3du;
    h = (h ^ h >> 16) * 0x85ebca6bu;
    h = (h ^ h >> 13) * 0xc2b2ae35u;
    return h ^ h >> 16;
}

/* In [-1, 1]. */
static float hashed(uint32_t x, uint32_t y, uint32_t seed)
{
    return (float)(int32_t)hash(x, y, seed) * 0x1p-31f;
}

static uint32_t wrap(int i, int period)
{
    int r = i % period;
    return (uint32_t)(r < 0 ? r + period : r);
}

/* Value noise in [-1, 1] on a lattice of px x py cells a tile. */
static float noise(float u, float v, int px, int py, uint32_t seed)
{
    float x = u * (float)px, y = v * (float)py, x0 = floorf(x), y0 = floorf(y);
    float fx = x - x0, fy = y - y0;
    fx = fx * fx * fx * (fx * (fx * 6 - 15) + 10);
    fy = fy * fy * fy * (fy * (fy * 6 - 15) + 10);
    uint32_t xa = wrap((int)x0, px), xb = wrap((int)x0 + 1, px);
    uint32_t ya = wrap((int)y0, py), yb = wrap((int)y0 + 1, py);
    float a = hashed(xa, ya, seed), b = hashed(xb, ya, seed);
    float c = hashed(xa, yb, seed), d = hashed(xb, yb, seed);
    float low = a + (b - a) * fx, high = c + (d - c) * fx;
    return low + (high - low) * fy;
}

/* Octaves of noise, each twice as fine and half as strong; in [-1, 1]. */
static float fractal(float u, float v, int px, int py, int octaves, uint32_t seed)
{
    float sum = 0, weight = 1, total = 0;
    for (int i = 0; i < octaves; i++) {
        sum += weight * noise(u, v, px << i, py << i, seed + (uint32_t)i);
        total += weight;
        weight *= 0.5f;
    }
    return sum / total;
}

static float smooth(float from, float to, float x)
{
    float t = fminf(fmaxf((x - from) / (to - from), 0), 1);
    return t * t * (3 - 2 * t);
}

/* out = a + (b - a) * t */
static void blend(const float a[3], const float b[3], float t, float out[3])
{
    for (int i = 0; i < 3; i++) out[i] = a[i] + (b[i] - a[i]) * t;
}

static void shade(struct texel *out, float factor)
{
    for (int i = 0; i < 3; i++) out->colour[i] *= factor;
}

/* Veins of marble, 0 to 1: crests of turbulence in a place shifted by slower turbulence. */
static float veins(float u, float v, int period, uint32_t seed)
{
    float wu = u + 0.12f * fractal(u, v, period, period, 2, seed + 11);
    float wv = v + 0.12f * fractal(u, v, period, period, 2, seed + 23);
    float crest = 1 - fabsf(fractal(wu, wv, period, period, 5, seed));
    float c2 = crest * crest, c4 = c2 * c2, c8 = c4 * c4;
    return c8 * c8;
}

static void paint_floor(float u, float v, struct texel *out)
{
    static const float light[3] = {0.84f, 0.80f, 0.73f}, light_vein[3] = {0.62f, 0.55f, 0.47f};
    static const float dark[3] = {0.27f, 0.31f, 0.29f}, dark_vein[3] = {0.60f, 0.64f, 0.58f};
    static const float joint[3] = {0.36f, 0.33f, 0.29f};
    uint32_t column = (uint32_t)(u * 4), row = (uint32_t)(v * 4);
    float fx = u * 4 - (float)column, fy = v * 4 - (float)row;
    float edge_m = 0.5f * fminf(fminf(fx, 1 - fx), fminf(fy, 1 - fy));
    bool is_dark = (column + row) & 1;
    /* Every tile is cut from another place of the slab. */
    float su = u + hashed(column, row, 91), sv = v + hashed(column, row, 92);
    float vein = veins(su, sv, 4, is_dark ? 101 : 102);
    float tone = 1 + 0.07f * hashed(column, row, 93) + 0.05f * fractal(su, sv, 8, 8, 3, 94);
    blend(is_dark ? dark : light, is_dark ? dark_vein : light_vein, is_dark ? 0.5f * vein : 0.8f * vein,
          out->colour);
    shade(out, tone);
    blend(joint, out->colour, smooth(0.001f, 0.005f, edge_m), out->colour);
}

static void paint_marble(float u, float v, struct texel *out)
{
    static const float slab[3] = {0.88f, 0.85f, 0.80f}, vein[3] = {0.58f, 0.53f, 0.49f};
    blend(slab, vein, 0.55f * veins(u, v, 3, 201), out->colour);
    shade(out, 1 + 0.04f * fractal(u, v, 3, 3, 4, 202));
}

static void paint_blocks(float u, float v, struct texel *out)
{
    static const float warm[3] = {0.80f, 0.70f, 0.56f}, cool[3] = {0.70f, 0.65f, 0.57f};
    static const float mortar[3] = {0.56f, 0.51f, 0.44f};
    uint32_t row = (uint32_t)(v * 4);
    float x = u * 2 + (row & 1 ? 0.5f : 0), fx = x - floorf(x), fy = v * 4 - (float)row;
    uint32_t column = wrap((int)floorf(x), 2);
    float wobble = 0.003f * fractal(u, v, 16, 16, 2, 301);
    float edge_m = fminf(fminf(fx, 1 - fx), 0.5f * fminf(fy, 1 - fy)) + wobble;
    float grain = fractal(u, v, 24, 24, 5, 302), stain = fractal(u, v, 3, 3, 3, 303);
    float inside = smooth(0.003f, 0.009f, edge_m);
    blend(warm, cool, 0.5f + 0.5f * hashed(column, row, 304), out->colour);
    shade(out, 1 + 0.09f * hashed(column, row, 305) + 0.10f * grain + 0.06f * stain);
    blend(mortar, out->colour, inside, out->colour);
    out->height_m = 0.010f * smooth(0.002f, 0.020f, edge_m) + 0.004f * grain * (0.3f + 0.7f * inside);
}

static void paint_plaster(float u, float v, struct texel *out)
{
    static const float wash[3] = {0.87f, 0.80f, 0.69f}, bare[3] = {0.76f, 0.66f, 0.54f};
    float patch = smooth(0.05f, 0.5f, fractal(u, v, 4, 4, 5, 401));
    blend(wash, bare, 0.6f * patch, out->colour);
    shade(out, 1 + 0.05f * fractal(u, v, 48, 48, 3, 402));
}

static void paint_fabric(float u, float v, struct texel *out)
{
    enum { THREADS = 128 };
    static const float tau = 6.28318531f;
    float x = u * THREADS, y = v * THREADS;
    int i = (int)x, j = (int)y;
    float fx = 2 * (x - (float)i) - 1, fy = 2 * (y - (float)j) - 1;
    /* A lattice of rings and hearts in a satin binding on a twill ground. */
    float wave = cosf(3 * tau * u) + cosf(3 * tau * v);
    float motif = fmaxf(smooth(1.25f, 1.4f, wave), smooth(0.35f, 0.25f, fabsf(wave - 0.55f)));
    motif = fmaxf(motif, smooth(-1.5f, -1.65f, wave));
    bool warp_up = ((i + j) & 3) < (motif > 0.5f ? 3 : 2);
    float round = warp_up ? 1 - fx * fx : 1 - fy * fy;
    float thread = warp_up ? hashed((uint32_t)i, 0, 501) : hashed(0, (uint32_t)j, 502);
    float tone = (0.70f + 0.24f * motif) * (0.86f + 0.14f * round) * (1 + 0.05f * thread);
    for (int k = 0; k < 3; k++) out->colour[k] = tone;
    out->colour[2] *= 1 - 0.10f * motif;
    out->height_m = 0.0010f * round + 0.0012f * motif;
}

static void paint_wood(float u, float v, struct texel *out)
{
    static const float pale[3] = {0.53f, 0.37f, 0.23f}, deep[3] = {0.30f, 0.19f, 0.11f};
    uint32_t board = (uint32_t)(u * 8);
    float fx = u * 8 - (float)board, edge_m = 0.25f * fminf(fx, 1 - fx);
    float sv = v + hashed(board, 0, 601);
    float bend = u + 0.01f * fractal(u, sv, 8, 2, 2, 602);
    float ring = fractal(bend, sv, 64, 2, 3, 603), fibre = noise(u, sv, 256, 8, 604);
    blend(pale, deep, smooth(-0.4f, 0.5f, ring + 0.25f * fibre), out->colour);
    shade(out, (1 + 0.12f * hashed(board, 1, 605)) * (0.45f + 0.55f * smooth(0, 0.006f, edge_m)));
}

/* Leaves: where each starts, where its tip is, and half its width. */
struct leaf {
    float x, y, tip_x, tip_y, half_width;
};

/* Coverage of a leaf at (u, v); `across` is the place over its width, -1 to 1, `along` 0 to 1. */
static float leaf_coverage(const struct leaf *leaf, float u, float v, float *along, float *across)
{
    float dx = leaf->tip_x - leaf->x, dy = leaf->tip_y - leaf->y, length2 = dx * dx + dy * dy;
    float a = ((u - leaf->x) * dx + (v - leaf->y) * dy) / length2;
    if (a <= 0 || a >= 1) return 0;
    float b = ((u - leaf->x) * dy - (v - leaf->y) * dx) / sqrtf(length2);
    float half = leaf->half_width * 4.4f * a * (1 - a) * (1.25f - 0.7f * a) * (1 + 0.05f * cosf(60 * a));
    *along = a;
    *across = b / fmaxf(half, 1e-4f);
    return smooth(-1.f / SIZE, 1.f / SIZE, half - fabsf(b));
}

static void paint_sprig(float u, float v, struct texel *out)
{
    static const struct leaf leaves[] = {
        {0.50f, 0.90f, 0.20f, 0.97f, 0.060f}, {0.50f, 0.86f, 0.82f, 0.95f, 0.065f},
        {0.50f, 0.76f, 0.10f, 0.74f, 0.078f}, {0.50f, 0.70f, 0.90f, 0.68f, 0.080f},
        {0.50f, 0.60f, 0.10f, 0.47f, 0.080f}, {0.50f, 0.55f, 0.89f, 0.40f, 0.078f},
        {0.50f, 0.45f, 0.18f, 0.22f, 0.072f}, {0.50f, 0.40f, 0.79f, 0.15f, 0.070f},
        {0.50f, 0.34f, 0.36f, 0.04f, 0.058f}, {0.50f, 0.32f, 0.55f, 0.01f, 0.062f},
    };
    static const float young[3] = {0.48f, 0.58f, 0.22f}, old[3] = {0.22f, 0.37f, 0.14f};
    static const float rib[3] = {0.62f, 0.67f, 0.38f}, twig[3] = {0.38f, 0.30f, 0.17f};
    float stem = smooth(0.010f, 0.006f, fabsf(u - 0.5f)) * smooth(0.28f, 0.34f, v);
    blend(young, old, 0.6f, out->colour);
    out->coverage = 0;
    for (uint32_t i = 0; i < sizeof leaves / sizeof leaves[0]; i++) {
        float along, across, colour[3];
        float coverage = leaf_coverage(&leaves[i], u, v, &along, &across);
        if (coverage <= 0) continue;
        float vein = smooth(0.10f, 0.03f, fabsf(across));
        float fan = cosf(55 * (along - 0.25f * fabsf(across)));
        vein = fmaxf(vein, 0.5f * smooth(0.93f, 0.99f, fan));
        blend(young, old, 0.5f + 0.35f * hashed(i, 0, 701) + 0.25f * fabsf(across), colour);
        blend(colour, rib, 0.7f * vein, colour);
        blend(out->colour, colour, coverage, out->colour);
        out->coverage = fmaxf(out->coverage, coverage);
    }
    blend(out->colour, twig, stem, out->colour);
    out->coverage = fmaxf(out->coverage, stem);
    shade(out, 1 + 0.10f * fractal(u, v, 16, 16, 3, 702));
}

static const struct {
    paint *paint;
    float size_m; /* of one repeat */
    bool normals, alpha;
} patterns[FV_PATTERNS] = {
    [FV_PATTERN_FLOOR] = {paint_floor, 2, false, false},
    [FV_PATTERN_MARBLE] = {paint_marble, 2, false, false},
    [FV_PATTERN_BLOCKS] = {paint_blocks, 2, true, false},
    [FV_PATTERN_PLASTER] = {paint_plaster, 2, false, false},
    [FV_PATTERN_FABRIC] = {paint_fabric, 1.5f, true, false},
    [FV_PATTERN_WOOD] = {paint_wood, 2, false, false},
    [FV_PATTERN_SPRIG] = {paint_sprig, 1, false, true},
};

float fv_pattern_repeats(enum fv_pattern pattern)
{
    return 1 / patterns[pattern].size_m;
}

static uint8_t to_byte(float x)
{
    return (uint8_t)(fminf(fmaxf(x, 0), 1) * 255 + 0.5f);
}

/* Tangent-space normals of a height field that wraps; x along u, y against v (glTF 2.0, 3.9.3). */
static void relief(const float *height, float size_m, uint8_t *pixels)
{
    float scale = (float)SIZE / (2 * size_m);
    for (int y = 0; y < SIZE; y++)
        for (int x = 0; x < SIZE; x++, pixels += 3) {
            const float *row = height + y * SIZE;
            float nx = (row[(x + SIZE - 1) % SIZE] - row[(x + 1) % SIZE]) * scale;
            float ny = (height[(y + 1) % SIZE * SIZE + x] - height[(y + SIZE - 1) % SIZE * SIZE + x]) * scale;
            float length = sqrtf(nx * nx + ny * ny + 1);
            pixels[0] = to_byte(0.5f + 0.5f * nx / length);
            pixels[1] = to_byte(0.5f + 0.5f * ny / length);
            pixels[2] = to_byte(0.5f + 0.5f / length);
        }
}

void fv_patterns_paint(struct fv_build *build, struct fv_pattern_textures textures[FV_PATTERNS])
{
    enum { TEXELS = SIZE * SIZE };
    uint8_t *colour = malloc(TEXELS * 3), *coverage = malloc(TEXELS);
    float *height = malloc(TEXELS * sizeof *height);
    for (int p = 0; p < FV_PATTERNS; p++) {
        for (int i = 0; i < TEXELS; i++) {
            struct texel texel = {.coverage = 1};
            patterns[p].paint(((float)(i % SIZE) + 0.5f) / SIZE, ((float)(i / SIZE) + 0.5f) / SIZE, &texel);
            for (int k = 0; k < 3; k++) colour[3 * i + k] = to_byte(texel.colour[k]);
            coverage[i] = to_byte(texel.coverage);
            height[i] = texel.height_m;
        }
        textures[p].base = fv_build_texture(build, FV_TEXEL_COLOUR, colour, SIZE, SIZE, 3, 0);
        textures[p].normal = textures[p].alpha = -1;
        if (patterns[p].normals) {
            relief(height, patterns[p].size_m, colour);
            textures[p].normal = fv_build_texture(build, FV_TEXEL_NORMAL, colour, SIZE, SIZE, 3, 0);
        }
        if (patterns[p].alpha)
            textures[p].alpha =
                fv_build_texture(build, FV_TEXEL_ALPHA, coverage, SIZE, SIZE, 1, FV_SPRIG_CUTOFF);
    }
    free(height);
    free(coverage);
    free(colour);
}
