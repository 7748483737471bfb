/* metrics: see metrics.h. A picture is judged in bands of rows; a lane goes down a band with a ring of
 * rows that are filtered across already, as many as the largest filter reaches, so that what it works
 * on stays in the cache. Each row's sums are kept apart and added up in order: neither the bands nor
 * the threads can change a value. */
#include "rt/measure/metrics.h"

#include "platform/arena.h"
#include "rt/measure/filter.h"
#include "rt/measure/flip.h"
#include "rt/measure/ssim.h"
#include "rt/scene/texture.h"

#include <assert.h>
#include <math.h>
#include <stdatomic.h>
#include <string.h>

/* Planes of the ring: FLIP's of the reference, of the test, and SSIM's of both. */
enum {
    REFERENCE_PLANE = 0,
    TEST_PLANE = FV_FLIP_PLANES,
    SSIM_PLANE = 2 * FV_FLIP_PLANES,
    PLANES = SSIM_PLANE + FV_SSIM_PLANES
};
/* More lanes than this would gain little: each filters the rows around its bands once more. */
enum { LANES_MAX = 16 };
/* Rows that reach beyond both ends: three channels, two pictures' luma, their squares and product. */
enum { WIDE_ROWS = 7, RESULT_ROWS = 2 * FV_FLIP_ROWS + FV_SSIM_PLANES + 1 };

/* Over a row's pixels of one zone. */
struct sums {
    int64_t pixels, squared; /* squared: of differences of 0 to 255, all channels */
    int64_t windows;         /* pixels that count for SSIM */
    double ssim, flip;
};

/* What one thread needs to go down a band. */
struct lane {
    float *wide[WIDE_ROWS]; /* at x = 0 */
    float *colour[3];       /* r, g, b of a row: encoded, then linear */
    float *ring, *result;
    const float **nearest, **mirrored; /* the ring's row at an offset from the row being judged, at 0 */
};

struct fv_metrics {
    int width, height, radius, lanes, slots, band_rows;
    ptrdiff_t stride; /* elements a row */
    struct fv_flip flip;
    struct fv_ssim ssim;
    float linear[256];
    struct lane lane[LANES_MAX];
    struct sums (*sums)[FV_ZONE_ALL]; /* of each row */
    float *flip_map;
    /* The comparison under way. */
    const struct fv_metrics_picture *picture[2];
    const uint8_t *zone;
    atomic_int next_band;
};

static void *take(size_t bytes)
{
    return fv_arena_take(fv_arena(), "metrics", bytes, 64);
}

static void take_lane(struct fv_metrics *m, struct lane *lane)
{
    size_t margin = ((size_t)m->radius + FV_FILTER_STEP) & ~(size_t)(FV_FILTER_STEP - 1);
    size_t wide = 2 * margin + (size_t)m->stride + FV_FILTER_STEP, row = (size_t)m->stride * sizeof(float);
    for (int i = 0; i < WIDE_ROWS; i++) lane->wide[i] = (float *)take(wide * sizeof(float)) + margin;
    for (int i = 0; i < 3; i++) lane->colour[i] = take(row);
    lane->ring = take((size_t)m->slots * PLANES * row);
    lane->result = take(RESULT_ROWS * row);
    lane->nearest = (const float **)take((size_t)m->slots * sizeof *lane->nearest) + m->radius;
    lane->mirrored = (const float **)take((size_t)m->slots * sizeof *lane->mirrored) + m->radius;
}

struct fv_metrics *fv_metrics_open(int width, int height, double ppd)
{
    assert(width > 0 && height > 0);
    struct fv_metrics *m = take(sizeof *m);
    m->width = width;
    m->height = height;
    m->stride = (width + FV_FILTER_STEP - 1) & ~(FV_FILTER_STEP - 1);
    fv_flip_set(&m->flip, ppd);
    fv_ssim_set(&m->ssim);
    for (int i = 0; i < 256; i++) m->linear[i] = fv_srgb_to_linear((uint8_t)i);
    m->radius = m->flip.radius > FV_SSIM_RADIUS ? m->flip.radius : FV_SSIM_RADIUS;
    m->slots = 2 * m->radius + 1;
    m->lanes = fv_threads_cores() < LANES_MAX ? fv_threads_cores() : LANES_MAX;
    for (int i = 0; i < m->lanes; i++) take_lane(m, &m->lane[i]);
    m->sums = take((size_t)height * sizeof *m->sums);
    m->flip_map = take((size_t)width * (size_t)height * sizeof *m->flip_map);
    return m;
}

const float *fv_metrics_flip_map(const struct fv_metrics *metrics)
{
    return metrics->flip_map;
}

static const uint8_t *picture_row(const struct fv_metrics_picture *p, int y)
{
    return p->pixel + y * p->stride_bytes;
}

/* Filters row y of both pictures across, into its place in the ring. */
static void row_into_ring(const struct fv_metrics *m, const struct lane *lane, int y)
{
    float *ring = lane->ring + (y % m->slots) * PLANES * m->stride;
    float *const *colour = lane->colour, *const *luma = lane->wide + 3;
    for (int p = 0; p < 2; p++) {
        const uint8_t *pixel = picture_row(m->picture[p], y);
        int step = m->picture[p]->step, n = m->width;
        for (int k = 0; k < 3; k++)
            for (int x = 0; x < n; x++) colour[k][x] = pixel[x * step + k];
        fv_ssim_luma(colour[0], colour[1], colour[2], luma[p], n);
        fv_border_extend(luma[p], n, FV_SSIM_RADIUS, fv_border_mirrored);
        for (int k = 0; k < 3; k++)
            for (int x = 0; x < n; x++) colour[k][x] = m->linear[pixel[x * step + k]];
        fv_flip_opponent(colour[0], colour[1], colour[2], lane->wide, n);
        for (int k = 0; k < 3; k++) fv_border_extend(lane->wide[k], n, m->flip.radius, fv_border_nearest);
        fv_flip_across(&m->flip, lane->wide, ring + (p ? TEST_PLANE : REFERENCE_PLANE) * m->stride, m->stride,
                       n);
    }
    fv_ssim_across(&m->ssim, luma[0], luma[1], luma[2], luma[3], ring + SSIM_PLANE * m->stride, m->stride,
                   m->width);
}

static void sum_row(const struct fv_metrics *m, int y, const float *ssim, const float *flip)
{
    struct sums sums[FV_ZONE_ALL] = {0};
    const uint8_t *zone = m->zone + (int64_t)y * m->width;
    const uint8_t *a = picture_row(m->picture[0], y), *b = picture_row(m->picture[1], y);
    bool inside = fv_ssim_counts(y, m->height);
    for (int x = 0; x < m->width; x++, a += m->picture[0]->step, b += m->picture[1]->step) {
        assert(zone[x] < FV_ZONE_ALL);
        struct sums *s = &sums[zone[x]];
        int red = a[0] - b[0], green = a[1] - b[1], blue = a[2] - b[2];
        s->pixels++;
        s->squared += red * red + green * green + blue * blue;
        s->flip += (double)flip[x];
        if (!inside || !fv_ssim_counts(x, m->width)) continue;
        s->windows++;
        s->ssim += (double)ssim[x];
    }
    memcpy(m->sums[y], sums, sizeof sums);
}

static void judge_row(const struct fv_metrics *m, const struct lane *lane, int y)
{
    ptrdiff_t stride = m->stride;
    float *reference = lane->result, *test = reference + FV_FLIP_ROWS * stride;
    float *scratch = test + FV_FLIP_ROWS * stride, *ssim = scratch + FV_SSIM_PLANES * stride;
    float *flip = m->flip_map + (int64_t)y * m->width;
    for (int k = -m->radius; k <= m->radius; k++) {
        int nearest = fv_border_nearest(y + k, m->height), mirrored = fv_border_mirrored(y + k, m->height);
        lane->nearest[k] = lane->ring + (nearest % m->slots) * PLANES * stride;
        lane->mirrored[k] = lane->ring + (mirrored % m->slots) * PLANES * stride;
    }
    fv_flip_down(&m->flip, lane->nearest, REFERENCE_PLANE * stride, reference, stride, m->width);
    fv_flip_down(&m->flip, lane->nearest, TEST_PLANE * stride, test, stride, m->width);
    fv_flip_judge(&m->flip, reference, test, stride, flip, m->width);
    fv_ssim_down(&m->ssim, lane->mirrored, SSIM_PLANE * stride, scratch, stride, ssim, m->width);
    sum_row(m, y, ssim, flip);
}

/* A tile is a lane, whichever thread runs it: it takes bands until none is left. */
static void run_lane(void *context, int tile, int worker)
{
    struct fv_metrics *m = context;
    (void)worker;
    for (;;) {
        int first = atomic_fetch_add_explicit(&m->next_band, 1, memory_order_relaxed) * m->band_rows;
        if (first >= m->height) return;
        int end = first + m->band_rows < m->height ? first + m->band_rows : m->height;
        int filtered = first > m->radius ? first - m->radius : 0;
        for (int y = first; y < end; y++) {
            for (; filtered <= y + m->radius && filtered < m->height; filtered++)
                row_into_ring(m, &m->lane[tile], filtered);
            judge_row(m, &m->lane[tile], y);
        }
    }
}

static void add(struct sums *to, const struct sums *from)
{
    to->pixels += from->pixels;
    to->squared += from->squared;
    to->windows += from->windows;
    to->ssim += from->ssim;
    to->flip += from->flip;
}

/* Without pixels all values are 0 / 0: NaN. */
static void set_errors(const struct fv_metrics *m, struct fv_errors *errors)
{
    struct sums sums[FV_ZONES] = {0};
    for (int y = 0; y < m->height; y++)
        for (int z = 0; z < FV_ZONE_ALL; z++) add(&sums[z], &m->sums[y][z]);
    for (int z = 0; z < FV_ZONE_ALL; z++) add(&sums[FV_ZONE_ALL], &sums[z]);
    for (int z = 0; z < FV_ZONES; z++) {
        const struct sums *s = &sums[z];
        double n = (double)s->pixels, mse = (double)s->squared / (3 * n);
        errors->pixels[z] = s->pixels;
        errors->psnr[z] = mse == 0 ? INFINITY : 10 * log10(255.0 * 255.0 / mse);
        errors->rmse[z] = sqrt(mse) / 255;
        errors->ssim[z] = s->ssim / (double)s->windows;
        errors->flip[z] = s->flip / n;
    }
}

void fv_metrics_compare(struct fv_metrics *m, struct fv_workers *workers,
                        const struct fv_metrics_picture *reference, const struct fv_metrics_picture *test,
                        const uint8_t *zone, struct fv_errors *errors)
{
    assert(reference->width == m->width && reference->height == m->height);
    assert(test->width == m->width && test->height == m->height);
    int lanes = workers && workers->count < m->lanes ? workers->count : workers ? m->lanes : 1;
    m->picture[0] = reference;
    m->picture[1] = test;
    m->zone = zone;
    /* Bands filter the rows around them once more: few and high ones, but enough for every lane. */
    int even = m->height / (4 * lanes) + 1, least = 4 * m->radius;
    m->band_rows = even > least ? even : least;
    atomic_store(&m->next_band, 0);
    if (lanes > 1) fv_workers_run(workers, lanes, run_lane, m);
    else run_lane(m, 0, 0);
    set_errors(m, errors);
}
