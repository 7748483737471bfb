/* texture: resampling to powers of two and the mip chain. Each level is filtered from the packed
 * texels of the one above: rounding errors of four texels average out, so they do not add up, and
 * no second copy of a large picture is needed. Alpha has 16 bits until the chain is complete. */
#include "rt/scene/texture.h"

#include "platform/log.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { ALPHA_ONE = 65535 };

struct source {
    const uint8_t *pixels;
    int width, height, channels;
    enum fv_texel kind;
    float value[256]; /* what a byte stands for */
};

float fv_srgb_to_linear(uint8_t value)
{
    float c = (float)value / 255;
    return c <= 0.04045f ? c / 12.92f : powf((c + 0.055f) / 1.055f, 2.4f);
}

/* A mean no longer than the rounding of its 8-bit parts has no direction: straight up. */
static void normalise(float v[3])
{
    float length = sqrtf(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    if (length > 0.02f)
        for (int i = 0; i < 3; i++) v[i] /= length;
    else v[0] = v[1] = 0, v[2] = 1;
}

static uint32_t pack10(float x)
{
    return (uint32_t)lrintf(fminf(fmaxf(x, 0), 1) * 1023);
}

static uint32_t pack(enum fv_texel kind, float v[3])
{
    switch (kind) {
    case FV_TEXEL_COLOUR: return pack10(sqrtf(v[0])) | pack10(sqrtf(v[1])) << 10 | pack10(sqrtf(v[2])) << 20;
    case FV_TEXEL_NORMAL:
        normalise(v);
        return pack10(0.5f * v[0] + 0.5f) | pack10(0.5f * v[1] + 0.5f) << 10 |
               pack10(0.5f * v[2] + 0.5f) << 20;
    case FV_TEXEL_ALPHA: break;
    }
    return (uint32_t)lrintf(v[0] * ALPHA_ONE);
}

static void unpack(enum fv_texel kind, uint32_t texel, float v[3])
{
    if (kind == FV_TEXEL_ALPHA) {
        v[0] = (float)texel / ALPHA_ONE, v[1] = v[2] = 0;
        return;
    }
    for (int i = 0; i < 3; i++) {
        float x = (float)(texel >> 10 * i & 1023) / 1023;
        v[i] = kind == FV_TEXEL_COLOUR ? x * x : 2 * x - 1;
    }
}

static void fetch(const struct source *s, int x, int y, float v[3])
{
    const uint8_t *p = s->pixels + ((size_t)y * (size_t)s->width + (size_t)x) * (size_t)s->channels;
    if (s->kind == FV_TEXEL_ALPHA) {
        v[0] = s->value[p[s->channels % 2 == 0 ? s->channels - 1 : 0]], v[1] = v[2] = 0;
        return;
    }
    for (int i = 0; i < 3; i++) v[i] = s->value[p[s->channels < 3 ? 0 : i]];
}

/* Mean of the source over [x0, x1) x [y0, y1), pixels cut by the edge counted in part. */
static void area_mean(const struct source *s, double x0, double x1, double y0, double y1, float mean[3])
{
    double sum[3] = {0}, weights = 0;
    for (int y = (int)y0; y < s->height && y < y1; y++) {
        double height = fmin(y + 1, y1) - fmax(y, y0);
        for (int x = (int)x0; x < s->width && x < x1; x++) {
            float v[3];
            double weight = height * (fmin(x + 1, x1) - fmax(x, x0));
            fetch(s, x, y, v);
            for (int i = 0; i < 3; i++) sum[i] += weight * v[i];
            weights += weight;
        }
    }
    for (int i = 0; i < 3; i++) mean[i] = (float)(sum[i] / weights);
}

static void fill_largest(const struct source *s, int width, int height, uint32_t *texel)
{
    double step_x = (double)s->width / width, step_y = (double)s->height / height;
    bool same = s->width == width && s->height == height;
    for (int y = 0; y < height; y++) {
        for (int x = 0; x < width; x++) {
            float v[3];
            if (same) fetch(s, x, y, v);
            else area_mean(s, x * step_x, (x + 1) * step_x, y * step_y, (y + 1) * step_y, v);
            *texel++ = pack(s->kind, v);
        }
    }
}

static void fill_smaller(enum fv_texel kind, const uint32_t *above, int above_width, int above_height,
                         uint32_t *texel)
{
    int across = above_width > 1 ? 2 : 1, down = above_height > 1 ? 2 : 1;
    for (int y = 0; y < above_height; y += down) {
        for (int x = 0; x < above_width; x += across) {
            float sum[3] = {0}, v[3];
            for (int j = 0; j < down; j++) {
                for (int i = 0; i < across; i++) {
                    unpack(kind, above[(size_t)(y + j) * (size_t)above_width + (size_t)(x + i)], v);
                    for (int c = 0; c < 3; c++) sum[c] += v[c];
                }
            }
            for (int c = 0; c < 3; c++) sum[c] /= (float)(across * down);
            *texel++ = pack(kind, sum);
        }
    }
}

/* Turns a level's alpha into 8 bits so that `share` of its texels lie at or above `cutoff` (1..255): the
 * value that this share exceeds now moves to the cutoff. */
static void keep_coverage(uint32_t *texel, size_t count, double share, uint32_t cutoff)
{
    uint32_t histogram[ALPHA_ONE + 1] = {0}, threshold = ALPHA_ONE + 1; /* none above */
    double wanted = share * (double)count, best = wanted;
    size_t above = 0;
    for (size_t i = 0; i < count; i++) histogram[texel[i]]++;
    for (uint32_t value = ALPHA_ONE; value > 0; value--) {
        above += histogram[value];
        double miss = fabs((double)above - wanted);
        if (miss < best) best = miss, threshold = value;
    }
    for (size_t i = 0; i < count; i++) {
        uint64_t scaled = (uint64_t)texel[i] * cutoff / threshold;
        texel[i] = scaled < 255 ? (uint32_t)scaled : 255;
    }
}

static size_t level_texels(const struct fv_texture *t, int level)
{
    int width = t->width >> level, height = t->height >> level;
    return (size_t)(width > 1 ? width : 1) * (size_t)(height > 1 ? height : 1);
}

static void finish_alpha(const struct fv_texture *t, uint32_t *texel, float alpha_cutoff)
{
    uint32_t cutoff = (uint32_t)ceilf(fminf(fmaxf(alpha_cutoff, 0), 1) * 255);
    size_t covered = 0, all = level_texels(t, 0);
    for (size_t i = 0; i < all; i++) {
        texel[i] = (texel[i] * 255 + ALPHA_ONE / 2) / ALPHA_ONE;
        covered += texel[i] >= cutoff;
    }
    /* At cutoff 0 everything is covered whatever its alpha. */
    for (int l = 1; l < t->levels; l++)
        keep_coverage(texel + t->offset[l], level_texels(t, l), (double)covered / (double)all,
                      cutoff ? cutoff : 255);
}

/* One behind each row of each level. */
static size_t spare_texels(const struct fv_texture *t)
{
    size_t rows = 0;
    for (int l = 0; l < t->levels; l++) rows += (size_t)(t->height >> l > 1 ? t->height >> l : 1);
    return rows;
}

/* Moves every row to where a spare texel behind each row leaves it, last row first, and fills the spare
 * one with the row's first. `count`: texels without the spare ones. Returns the count with them. */
static size_t spread_rows(struct fv_texture *t, uint32_t *texel, size_t count)
{
    size_t all = count + spare_texels(t), to = all;
    for (int l = t->levels - 1; l >= 0; l--) {
        size_t width = (size_t)(t->width >> l > 1 ? t->width >> l : 1), rows = level_texels(t, l) / width;
        for (size_t y = rows; y-- > 0;) {
            to -= width + 1;
            memmove(texel + to, texel + t->offset[l] + y * width, width * sizeof *texel);
            texel[to + width] = texel[to];
        }
        t->offset[l] = (uint32_t)to;
    }
    assert(to == 0);
    return all;
}

size_t fv_texture_make(struct fv_texture *out, enum fv_texel kind, const uint8_t *pixels, int width,
                       int height, int channels, float alpha_cutoff)
{
    assert(width >= 1 && width <= FV_TEXTURE_SIZE_MAX && height >= 1 && height <= FV_TEXTURE_SIZE_MAX);
    assert(channels >= 1 && channels <= 4);
    struct source source = {pixels, width, height, channels, kind, {0}};
    for (int i = 0; i < 256; i++)
        source.value[i] = kind == FV_TEXEL_COLOUR   ? fv_srgb_to_linear((uint8_t)i)
                          : kind == FV_TEXEL_NORMAL ? (float)i / 127.5f - 1
                                                    : (float)i / 255;
    *out = (struct fv_texture){.width = 1, .height = 1};
    while (out->width * 2 <= width) out->width *= 2;
    while (out->height * 2 <= height) out->height *= 2;
    size_t count = 0;
    do {
        out->offset[out->levels] = (uint32_t)count;
        count += level_texels(out, out->levels);
        out->levels++;
    } while ((out->width | out->height) >> out->levels);
    assert(out->levels <= FV_TEXTURE_LEVELS);

    uint32_t *texel = malloc((count + spare_texels(out)) * sizeof *texel);
    if (!texel) fv_die(2, "memory: a texture of %d x %d does not fit", width, height);
    fill_largest(&source, out->width, out->height, texel);
    for (int l = 1; l < out->levels; l++) {
        int w = out->width >> (l - 1), h = out->height >> (l - 1);
        fill_smaller(kind, texel + out->offset[l - 1], w > 1 ? w : 1, h > 1 ? h : 1, texel + out->offset[l]);
    }
    if (kind == FV_TEXEL_ALPHA) finish_alpha(out, texel, alpha_cutoff);
    out->texel = texel;
    return spread_rows(out, texel, count);
}
