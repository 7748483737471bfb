/* foveal: the foveal function and the blue-noise mask; see foveal.h. */
#include "rt/fovea/foveal.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

float fv_foveal_probability(const struct fv_foveal *f, float e)
{
    if (!(e > f->r0_deg)) return 1;
    if (e >= f->r1_deg || f->r1_deg <= f->r0_deg) return f->p_min;
    float s = (e - f->r0_deg) / (f->r1_deg - f->r0_deg);
    return f->p_min + (1 - s) * (1 - f->p_min); /* never below p_min, nor above 1, by rounding */
}

float fv_eccentricity_deg(const struct fv_view *view, float x, float y)
{
    float d[3], c[3], cosine = 0;
    fv_view_direction(view, x, y, d);
    for (int i = 0; i < 3; i++) cosine += d[i] * view->gaze[i];
    /* atan2 of sine and cosine: exact near 0 and 180, where acos is not. */
    c[0] = d[1] * view->gaze[2] - d[2] * view->gaze[1];
    c[1] = d[2] * view->gaze[0] - d[0] * view->gaze[2];
    c[2] = d[0] * view->gaze[1] - d[1] * view->gaze[0];
    float sine = sqrtf(c[0] * c[0] + c[1] * c[1] + c[2] * c[2]);
    return atan2f(sine, cosine) * 57.29578f;
}

enum { SIZE = FV_NOISE_SIZE, CELLS = SIZE * SIZE };

/* Void and cluster on a torus: a Gaussian energy around every set cell, kept up to date. */
struct void_and_cluster {
    float kernel[CELLS]; /* energy at an offset (dx, dy) */
    float energy[CELLS];
    bool set[CELLS];
};

static void toggle(struct void_and_cluster *v, int cell, bool on)
{
    int cx = cell % SIZE, cy = cell / SIZE;
    float sign = on ? 1.0f : -1.0f;
    v->set[cell] = on;
    for (int y = 0; y < SIZE; y++) {
        const float *row = v->kernel + ((y - cy) & (SIZE - 1)) * SIZE;
        for (int x = 0; x < SIZE; x++) v->energy[y * SIZE + x] += sign * row[(x - cx) & (SIZE - 1)];
    }
}

/* The set cell with most energy around it, or the unset one with least. */
static int extreme(const struct void_and_cluster *v, bool set)
{
    int best = -1;
    for (int i = 0; i < CELLS; i++) {
        if (v->set[i] != set) continue;
        if (best < 0 || (set ? v->energy[i] > v->energy[best] : v->energy[i] < v->energy[best])) best = i;
    }
    return best;
}

static void make(float mask[CELLS])
{
    static struct void_and_cluster v, start;
    int initial = CELLS / 10;
    for (int y = 0; y < SIZE; y++)
        for (int x = 0; x < SIZE; x++) {
            int dx = x < SIZE / 2 ? x : SIZE - x, dy = y < SIZE / 2 ? y : SIZE - y;
            v.kernel[y * SIZE + x] = expf(-(float)(dx * dx + dy * dy) / (2 * 1.9f * 1.9f));
        }
    uint32_t state = 12345;
    for (int n = 0; n < initial;) {
        state = state * 1664525u + 1013904223u;
        int cell = (int)(state >> 20);
        if (v.set[cell]) continue;
        toggle(&v, cell, true);
        n++;
    }
    for (int step = 0; step < CELLS; step++) {
        int cluster = extreme(&v, true);
        toggle(&v, cluster, false);
        int hole = extreme(&v, false);
        toggle(&v, hole, true);
        if (hole == cluster) break;
    }
    start = v;
    for (int rank = initial - 1; rank >= 0; rank--) {
        int cluster = extreme(&v, true);
        toggle(&v, cluster, false);
        mask[cluster] = ((float)rank + 0.5f) / CELLS;
    }
    v = start;
    for (int rank = initial; rank < CELLS; rank++) {
        int hole = extreme(&v, false);
        toggle(&v, hole, true);
        mask[hole] = ((float)rank + 0.5f) / CELLS;
    }
}

const float *fv_noise(void)
{
    static float mask[CELLS];
    static bool made;
    if (!made) {
        make(mask);
        made = true;
    }
    return mask;
}

float fv_noise_threshold(const float *noise, int x, int y, int64_t frame)
{
    /* The shift in 32-bit fixed point: exact however many frames have passed. */
    uint32_t shift = (uint32_t)frame * 2654435769u;
    uint32_t value = (uint32_t)(noise[(y & (SIZE - 1)) * SIZE + (x & (SIZE - 1))] * 4294967296.0f);
    return (float)((value + shift) >> 8) * 0x1p-24f;
}
