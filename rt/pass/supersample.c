/* supersample: means of several samples a pixel, for the passes that take more than one. */
#include "rt/pass/bent.h"
#include "rt/pass/pyramid.h"

#include <math.h>
#include <string.h>

enum { EACH_MAX = 16, FIRST = 4, AGREEING_MAX = 64, PIXELS_MAX = FV_SAMPLES_MAX };

/* Offset of sample i of n from the pixel's centre, each in [-0.5, 0.5). */
static void stratum(int i, int n, float offset[2])
{
    int side = (int)lroundf(sqrtf((float)n));
    if (side * side == n) {
        offset[0] = ((float)(i % side) + 0.5f) / (float)side - 0.5f;
        offset[1] = ((float)(i / side) + 0.5f) / (float)side - 0.5f;
        return;
    }
    offset[0] = ((float)i + 0.5f) / (float)n - 0.5f;
    float v = 0.5f + (float)i * 0.61803399f;
    offset[1] = v - floorf(v) - 0.5f;
}

/* Which samples come in which order: first those nearest to the corners of a turned square, of which no two are in
 * a row or column of 4 x 4. */
static void put_order(uint8_t order[AGREEING_MAX], int n)
{
    static const float corner[FIRST][2] = {
        {-0.125f, -0.375f}, {0.375f, -0.125f}, {-0.375f, 0.125f}, {0.125f, 0.375f}};
    for (int i = 0; i < n; i++) order[i] = (uint8_t)i;
    for (int k = 0; k < FIRST; k++) {
        int best = k;
        float nearest = INFINITY, at[2];
        for (int i = k; i < n; i++) {
            stratum(order[i], n, at);
            float off = hypotf(at[0] - corner[k][0], at[1] - corner[k][1]);
            if (off < nearest) best = i, nearest = off;
        }
        uint8_t first = order[best];
        order[best] = order[k];
        order[k] = first;
    }
}

/* Pixels that stand in the list, and what their samples came to. */
struct pixels {
    int count;
    float x[PIXELS_MAX], y[PIXELS_MAX], start[PIXELS_MAX];
    float sum[3][PIXELS_MAX], nearest[PIXELS_MAX];
    int taken[PIXELS_MAX];
};

/* `each` samples of `count` of the pixels, a pixel's side by side. */
static void trace_some(struct fv_frame *f, const struct fv_tile *tile, struct pixels *p, const int16_t *pixel,
                       int count, const float offset[][2], int each, uint32_t seed)
{
    struct fv_worker_scratch *w = &f->scratch[tile->worker];
    struct fv_samples *s = &w->samples;
    float size = (float)(1 << tile->density);
    s->count = count * each;
    for (int i = 0, at = 0; i < count; i++)
        for (int k = 0; k < each; k++, at++) {
            s->x[at] = p->x[pixel[i]] + offset[k][0] * size;
            s->y[at] = p->y[pixel[i]] + offset[k][1] * size;
            s->start[at] = p->start[pixel[i]];
        }
    f->kernels->trace(f->tracer, &f->view[tile->eye], s, seed, w->rays);
    const float *channel[3] = {s->red, s->green, s->blue};
    for (int i = 0, at = 0; i < count; i++) {
        int to = pixel[i];
        p->taken[to] += each;
        for (int k = 0; k < each; k++, at++) {
            for (int c = 0; c < 3; c++) p->sum[c][to] += channel[c][at];
            if (s->inverse_depth[at] > p->nearest[to]) p->nearest[to] = s->inverse_depth[at];
        }
    }
}

static float least(const float v[FIRST])
{
    float a = v[0] < v[1] ? v[0] : v[1], b = v[2] < v[3] ? v[2] : v[3];
    return a < b ? a : b;
}

static float most(const float v[FIRST])
{
    float a = v[0] > v[1] ? v[0] : v[1], b = v[2] > v[3] ? v[2] : v[3];
    return a > b ? a : b;
}

/* Whether a pixel's first samples, from `at` on, saw one even surface, lit alike, or all of them nothing: by their
 * colours' Michelson contrast; by their inverse depths, which lie in a plane where they are of one, and so are not
 * far apart; and by their cone, which stopped at nothing else. */
static bool agree(const struct fv_samples *s, int at, float start, float reach, float contrast)
{
    const float even = 1 / 256.0f, apart = 1 / 16.0f;
    const float *channel[3] = {s->red + at, s->green + at, s->blue + at}, *w = s->inverse_depth + at;
    for (int c = 0; c < 3; c++) {
        float low = least(channel[c]), high = most(channel[c]);
        if (!(high - low <= contrast * (high + low))) return false;
    }
    float low = least(w), high = most(w);
    if (!(low >= 0 && high - low <= apart * high)) return false;
    if (!(fabsf(w[0] + w[3] - w[1] - w[2]) <= even * high)) return false;
    return !fv_stopped_before(start, high > 0 ? 1 / high : INFINITY, reach);
}

/* `each` samples of `count` of the pixels; `first`: those that agree need no others, and leave the list. Returns how
 * many stay. */
static int trace_each(struct fv_frame *f, const struct fv_tile *tile, struct pixels *p, int16_t *pixel,
                      int count, const float offset[][2], int each, uint32_t seed, bool first)
{
    const struct fv_samples *s = &f->scratch[tile->worker].samples;
    float reach = fv_reach_px(1 << tile->density) * fv_largest_pixel(&f->view[tile->eye]);
    int some = FV_SAMPLES_MAX / each, left = 0;
    for (int from = 0; from < count; from += some) {
        int n = count - from < some ? count - from : some;
        trace_some(f, tile, p, pixel + from, n, offset, each, seed);
        for (int i = 0; i < n; i++) {
            int16_t at = pixel[from + i];
            if (!first || !agree(s, each * i, p->start[at], reach, f->pyramid.ssaa_contrast)) pixel[left++] = at;
        }
    }
    return left;
}

static void put_means(struct fv_samples *s, const struct pixels *p)
{
    size_t bytes = (size_t)p->count * sizeof(float);
    float *channel[3] = {s->red, s->green, s->blue};
    s->count = p->count;
    for (int i = 0; i < p->count; i++) s->part[i] = -1;
    memcpy(s->x, p->x, bytes);
    memcpy(s->y, p->y, bytes);
    memcpy(s->start, p->start, bytes);
    memcpy(s->inverse_depth, p->nearest, bytes);
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < p->count; i++) channel[c][i] = p->sum[c][i] / (float)p->taken[i];
}

/* What is sampled at random differs by sample only from one list to the next. */
static void trace_means(struct fv_frame *f, const struct fv_tile *tile, int spp, bool agreeing)
{
    struct fv_samples *s = &f->scratch[tile->worker].samples;
    struct pixels p = {.count = s->count};
    size_t bytes = (size_t)s->count * sizeof(float);
    float offset[EACH_MAX][2];
    int16_t pixel[PIXELS_MAX];
    uint8_t order[AGREEING_MAX];
    bool random = (f->tracer->data->features & FV_SCENE_STOCHASTIC) != 0;
    int count = p.count;
    agreeing &= !random && spp >= 2 * FIRST && spp <= AGREEING_MAX;
    if (agreeing) put_order(order, spp);
    memcpy(p.x, s->x, bytes);
    memcpy(p.y, s->y, bytes);
    memcpy(p.start, s->start, bytes);
    for (int i = 0; i < count; i++) pixel[i] = (int16_t)i;
    for (int k = 0, each; k < spp && count > 0; k += each) {
        bool first = agreeing && k == 0;
        each = random ? 1 : first ? FIRST : EACH_MAX;
        if (each > spp - k) each = spp - k;
        for (int i = 0; i < each; i++) stratum(agreeing ? order[k + i] : k + i, spp, offset[i]);
        uint32_t seed = (uint32_t)f->number * (uint32_t)spp + (uint32_t)k; /* wraps */
        count = trace_each(f, tile, &p, pixel, count, (const float(*)[2])offset, each, seed, first);
    }
    put_means(s, &p);
}

void fv_samples_trace_mean(struct fv_frame *f, const struct fv_tile *tile, int spp, bool agreeing)
{
    if (spp > 1) trace_means(f, tile, spp, agreeing);
    else fv_samples_trace(f, tile, 1);
    fv_samples_encode(f, tile);
}
