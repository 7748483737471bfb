/* denoise_filter: the passes of the filter: of pixels that are left out, and of its iterations; see denoise.h.
 *
 * FV_LIGHT always holds what is newest: `across` puts its means into FV_FILTERED, of tiles that take the iteration and of those
 * that their columns reach into; `down` puts those of the former back. In tiles with several layers it is undone where a
 * pixel's layer does not take the iteration. FV_VARIANCE goes along with FV_LIGHT. */
#include "rt/pass/accumulate.h"
#include "rt/pass/bent.h"
#include "rt/pass/denoise.h"

#include <string.h>

#define VARIANCES (FV_BIT(FV_VARIANCE) | FV_BIT(FV_FILTERED_VARIANCE))

static struct fv_atrous atrous_of(const struct fv_frame *f, const struct fv_tile *tile, enum fv_atrous_taps taps, int step,
                                  bool back)
{
    int e = tile->eye;
    return (struct fv_atrous){.taps = taps,
                              .step = step,
                              .x = tile->x0,
                              .y = tile->y0,
                              .columns = fv_tile_rest(f->width, tile->x0),
                              .rows = fv_tile_rest(f->height, tile->y0),
                              .width = f->width,
                              .height = f->height,
                              .stride = f->stride,
                              .view = fv_bent_view(f, tile),
                              .light = f->buffer[back ? FV_FILTERED : FV_LIGHT][e],
                              .inverse_depth = f->buffer[FV_DEPTH][e],
                              .facing = f->buffer[FV_FACING][e],
                              .variance = f->buffer[back ? FV_FILTERED_VARIANCE : FV_VARIANCE][e],
                              .filtered = f->buffer[back ? FV_LIGHT : FV_FILTERED][e],
                              .filtered_variance = f->buffer[back ? FV_VARIANCE : FV_FILTERED_VARIANCE][e],
                              .sigma_light = f->buffer[FV_VARIANCE][e] ? f->denoise.deviations : f->denoise.sigma_light,
                              .sigma_normal = f->denoise.sigma_normal,
                              .sigma_position = f->denoise.sigma_position};
}

static int layers_of(const struct fv_frame *f, int tile)
{
    return ((const uint8_t *)f->buffer[FV_TILE_LAYERS][0])[tile];
}

/* Layers that take the iteration, a bit each. */
static int taking(const struct fv_frame *f, int k)
{
    int bits = 0;
    for (int n = 0; n < FV_LAYERS; n++) bits |= fv_layer_takes(&f->parameters, n, k) << n;
    return bits;
}

static void copy_tile(struct fv_frame *f, const struct fv_tile *tile, enum fv_buffer from, enum fv_buffer to)
{
    for (int y = 0; y < FV_TILE; y++) {
        int64_t row = fv_tile_row(f, tile, y);
        memcpy((uint32_t *)f->buffer[to][tile->eye] + row, (const uint32_t *)f->buffer[from][tile->eye] + row, FV_TILE * sizeof(uint32_t));
    }
}

/* ---- pixels that are left out ---- */

static bool has_holes(const struct fv_frame *f, const struct fv_tile *tile)
{
    return layers_of(f, tile->index) & (fv_accumulates(f) ? FV_LAYER_EMPTY : FV_LAYER_HOLES);
}

static int fill(struct fv_frame *f, const struct fv_tile *tile)
{
    if (!has_holes(f, tile)) return 0;
    struct fv_atrous a = atrous_of(f, tile, FV_ATROUS_FILL, 1, false);
    f->kernels->atrous(&a);
    return 1;
}

static int settle(struct fv_frame *f, const struct fv_tile *tile)
{
    if (!has_holes(f, tile)) return 0;
    copy_tile(f, tile, FV_FILTERED, FV_LIGHT);
    if (f->buffer[FV_VARIANCE][0]) copy_tile(f, tile, FV_FILTERED_VARIANCE, FV_VARIANCE);
    return 1;
}

static const char *no_holes(const struct fv_config *c)
{
    bool turns = c->denoise_rate > 1 && c->denoise_history > 0;
    return c->denoise_p > 0 || turns || strcmp(c->budget_adapt, "on") == 0 ? NULL : "denoise.p is 0: every pixel is sampled";
}

static void expect_holes(const struct fv_frame *f, const struct fv_parameters *p, const struct fv_rings *rings, double units[2])
{
    for (int d = 0; d < FV_DEGREES && p->left_out > 0; d++)
        if ((float)d + 0.5f > p->foveal.r0_deg) units[0] += (double)rings->tiles[d];
    (void)f;
}

#define HOLES(name_, run_, reads_, writes_)                                                                                     \
    const struct fv_pass fv_pass_##name_ = {.name = #name_,                                                                     \
                                            .reads = FV_BIT(FV_TILE_LAYERS) | FV_BIT(reads_) | VARIANCES | FV_BIT(FV_DEPTH) | FV_BIT(FV_FACING), \
                                            .writes = FV_BIT(writes_) | VARIANCES,                                                          \
                                            .idle = no_holes,                                                                   \
                                            .run = run_,                                                                        \
                                            .expect = expect_holes}
HOLES(fill, fill, FV_LIGHT, FV_FILTERED);
HOLES(settle, settle, FV_FILTERED, FV_LIGHT);

/* ---- iterations ---- */

/* Whether a tile so many pixels up or down takes the iteration. */
static bool near_taking(const struct fv_frame *f, const struct fv_tile *tile, int bits, int reach)
{
    for (int dy = -((reach + FV_TILE - 1) / FV_TILE); dy <= (reach + FV_TILE - 1) / FV_TILE; dy++) {
        int y = tile->y0 / FV_TILE + dy;
        if (y >= 0 && y < f->tiles_y && (layers_of(f, tile->index + dy * f->tiles_x) & bits)) return true;
    }
    return false;
}

static int across(struct fv_frame *f, const struct fv_tile *tile, int k)
{
    if (!near_taking(f, tile, taking(f, k), 2 << k)) return 0;
    struct fv_atrous a = atrous_of(f, tile, FV_ATROUS_ACROSS, 1 << k, false);
    f->kernels->atrous(&a);
    return 1;
}

static void take_plane(const struct fv_frame *f, const struct fv_tile *tile, enum fv_buffer plane, uint32_t words[FV_TILE][FV_TILE])
{
    const uint32_t *from = f->buffer[plane][tile->eye];
    for (int y = 0; y < FV_TILE && from; y++) memcpy(words[y], from + fv_tile_row(f, tile, y), FV_TILE * sizeof *from);
}

/* Where the pixel's layer is none of these. */
static void put_back(struct fv_frame *f, const struct fv_tile *tile, enum fv_buffer plane, int bits, uint32_t words[FV_TILE][FV_TILE])
{
    uint32_t *to = f->buffer[plane][tile->eye];
    for (int y = 0; y < FV_TILE && to; y++) {
        int64_t row = fv_tile_row(f, tile, y);
        const uint8_t *layer = (const uint8_t *)f->buffer[FV_LAYER][tile->eye] + row;
        for (int x = 0; x < FV_TILE; x++)
            if (!(bits >> (layer[x] & FV_LAYER_NUMBER) & 1)) to[row + x] = words[y][x];
    }
}

static int down(struct fv_frame *f, const struct fv_tile *tile, int k)
{
    enum { ALL = (1 << FV_LAYERS) - 1 };
    int bits = taking(f, k), has = layers_of(f, tile->index) & ALL;
    if (!(has & bits)) return 0;
    struct fv_atrous a = atrous_of(f, tile, FV_ATROUS_DOWN, 1 << k, true);
    bool mixed = has & ~bits;
    static const enum fv_buffer planes[] = {FV_LIGHT, FV_VARIANCE};
    uint32_t before[2][FV_TILE][FV_TILE];
    for (int p = 0; p < 2 && mixed; p++) take_plane(f, tile, planes[p], before[p]);
    f->kernels->atrous(&a);
    for (int p = 0; p < 2 && mixed; p++) put_back(f, tile, planes[p], bits, before[p]);
    return 1;
}

static void across_stand_in(struct fv_frame *f, const struct fv_tile *tile)
{
    copy_tile(f, tile, FV_LIGHT, FV_FILTERED);
    if (f->buffer[FV_VARIANCE][0]) copy_tile(f, tile, FV_VARIANCE, FV_FILTERED_VARIANCE);
}

/* Its light stays. */
static void down_stand_in(struct fv_frame *f, const struct fv_tile *tile)
{
    (void)f;
    (void)tile;
}

static void expect_iteration(const struct fv_frame *f, const struct fv_parameters *p, const struct fv_rings *rings, double units[2],
                             int k)
{
    (void)f;
    for (int d = 0; d < FV_DEGREES; d++) {
        float e = (float)d + 0.5f;
        int layer = e <= p->foveal.r0_deg ? 0 : e <= p->foveal.r1_deg ? 1 : 2;
        if (fv_layer_takes(p, layer, k)) units[0] += (double)rings->tiles[d];
    }
}

static const char *idle(const struct fv_config *c, int k)
{
    for (int n = 0; n < FV_LAYERS; n++)
        if (c->denoise_iterations.value[n] > k) return NULL;
    return "denoise.iterations: no layer takes so many";
}

#define ITERATION(k, step)                                                                                                      \
    static int across_##step(struct fv_frame *f, const struct fv_tile *tile) { return across(f, tile, k); }                     \
    static int down_##step(struct fv_frame *f, const struct fv_tile *tile) { return down(f, tile, k); }                         \
    static const char *idle_##step(const struct fv_config *c) { return idle(c, k); }                                            \
    static void expect_##step(const struct fv_frame *f, const struct fv_parameters *p, const struct fv_rings *rings,            \
                              double units[2])                                                                                  \
    {                                                                                                                           \
        expect_iteration(f, p, rings, units, k);                                                                                \
    }                                                                                                                           \
    const struct fv_pass fv_pass_across_##step = {                                                                              \
        .name = "across_" #step,                                                                                                \
        .reads = FV_BIT(FV_TILE_LAYERS) | FV_BIT(FV_LIGHT) | FV_BIT(FV_VARIANCE) | FV_BIT(FV_DEPTH) | FV_BIT(FV_FACING),                              \
        .writes = FV_BIT(FV_FILTERED) | FV_BIT(FV_FILTERED_VARIANCE),                                                                                          \
        .idle = idle_##step,                                                                                                    \
        .run = across_##step,                                                                                                   \
        .stand_in = across_stand_in,                                                                                            \
        .expect = expect_##step};                                                                                               \
    const struct fv_pass fv_pass_down_##step = {                                                                                \
        .name = "down_" #step,                                                                                                  \
        .reads = FV_BIT(FV_TILE_LAYERS) | FV_BIT(FV_LAYER) | FV_BIT(FV_FILTERED) | FV_BIT(FV_LIGHT) | VARIANCES | FV_BIT(FV_DEPTH) | FV_BIT(FV_FACING), \
        .writes = FV_BIT(FV_LIGHT) | FV_BIT(FV_VARIANCE),                                                                                             \
        .idle = idle_##step,                                                                                                    \
        .run = down_##step,                                                                                                     \
        .stand_in = down_stand_in,                                                                                              \
        .expect = expect_##step}
ITERATION(4, 16);
ITERATION(3, 8);
ITERATION(2, 4);
ITERATION(1, 2);
ITERATION(0, 1);
