/* denoise_paths: the passes paths and compose: light by paths and what it falls on, and both together; see denoise.h. */
#include "rt/pass/accumulate.h"
#include "rt/pass/denoise.h"

#include <math.h>
#include <string.h>

/* Samples that take paths before those that take none: packets of both would follow paths half empty. True where that
 * changes their order. */
static bool sort(struct fv_samples *s)
{
    struct sample {
        float x, y;
        int32_t paths;
    } later[FV_SAMPLES_MAX];
    int first = 0, rest = 0;
    for (int i = 0; i < s->count; i++) {
        struct sample of = {s->x[i], s->y[i], s->paths[i]};
        if (of.paths <= 0) {
            later[rest++] = of;
            continue;
        }
        s->x[first] = of.x, s->y[first] = of.y, s->paths[first++] = of.paths;
    }
    if (first == 0 || rest == 0) return false;
    for (int i = 0; i < rest; i++) s->x[first + i] = later[i].x, s->y[first + i] = later[i].y, s->paths[first + i] = later[i].paths;
    return true;
}

/* Words of the samples into their pixels: block by block, where they are in that order. */
static void keep(const struct fv_frame *f, const struct fv_tile *tile, uint64_t blocks, bool sorted, enum fv_buffer buffer, const void *of)
{
    uint32_t *to = f->buffer[buffer][tile->eye];
    const uint32_t *from = of;
    const struct fv_samples *s = &f->scratch[tile->worker].samples;
    for (int i = 0; i < s->count && sorted; i++) to[(int64_t)s->y[i] * f->stride + (int64_t)s->x[i]] = from[i];
    for (; blocks && !sorted; blocks &= blocks - 1)
        for (int y = 0; y < FV_BLOCK; y++, from += FV_BLOCK)
            memcpy(to + fv_block_row(f, tile, __builtin_ctzll(blocks), y), from, FV_BLOCK * sizeof *from);
}

/* How many paths each sample takes, less than none (struct fv_samples) of those that are left out: of all, in a stand-in. None beyond
 * the picture. */
static int ask(const struct fv_frame *f, const struct fv_tile *tile, struct fv_samples *s, bool stand_in)
{
    const uint8_t *layer = f->buffer[FV_LAYER][tile->eye];
    int paths = 0;
    for (int i = 0; i < s->count; i++) {
        int x = (int)s->x[i], y = (int)s->y[i];
        bool within = x < f->width && y < f->height;
        int of = within ? layer[y * f->stride + x] : 0, n = within ? f->parameters.layer_spp[of & FV_LAYER_NUMBER] : 0;
        bool sampled = (of & FV_LAYER_SAMPLED) && !stand_in && fv_layer_due(f, tile->eye, of & FV_LAYER_NUMBER, x, y);
        s->paths[i] = sampled ? n : -n;
        paths += sampled ? n : 0;
    }
    return paths;
}

/* Light of a tile's samples, by rows, none around it and where there is none: -1. */
enum { SPECKLE_REACH = 2 };
struct tile_light {
    float luma[FV_TILE + 2 * SPECKLE_REACH][FV_TILE + 2 * SPECKLE_REACH];
};

static float *luma_at(struct tile_light *t, int x, int y)
{
    return &t->luma[y + SPECKLE_REACH][x + SPECKLE_REACH];
}

/* The brightest's up to so many pixels around; -1: fewer than eight are known. */
static float brightest_around(struct tile_light *t, int x, int y, int reach)
{
    float most = -1;
    int known = 0;
    for (int v = -reach; v <= reach; v++)
        for (int u = -reach; u <= reach; u++) {
            float l = u || v ? *luma_at(t, x + u, y + v) : -1;
            known += l >= 0;
            most = l > most ? l : most;
        }
    return known < 8 ? -1 : most;
}

/* Rare paths that happen upon a bright place stand out from all around them, and the filter would leave them: to no more than
 * twice the brightest neighbour in the tile, of eight at least, but by no more than chance may have added (two standard deviations: what is
 * bright by all of its paths is bright). Nothing gets brighter. */
static void despeckle(const struct fv_tile *tile, struct fv_samples *s)
{
    struct tile_light t;
    for (int y = 0; y < FV_TILE + 2 * SPECKLE_REACH; y++)
        for (int x = 0; x < FV_TILE + 2 * SPECKLE_REACH; x++) t.luma[y][x] = -1;
    for (int i = 0; i < s->count; i++)
        if (s->paths[i] > 0 && s->inverse_depth[i] > 0)
            *luma_at(&t, (int)s->x[i] - tile->x0, (int)s->y[i] - tile->y0) = 0.25f * (s->light_red[i] + s->light_blue[i]) + 0.5f * s->light_green[i];
    for (int i = 0; i < s->count; i++) {
        int x = (int)s->x[i] - tile->x0, y = (int)s->y[i] - tile->y0;
        float own = *luma_at(&t, x, y);
        if (!(own > 0) || !(64 * s->variance[i] > own * own)) continue; /* nothing that one would see */
        float most = brightest_around(&t, x, y, 1);
        if (most < 0) most = brightest_around(&t, x, y, SPECKLE_REACH);
        if (most < 0 || !(own > 2 * most)) continue;
        float times = fmaxf(2 * most, own - 2 * sqrtf(fmaxf(s->variance[i], 0))) / own;
        if (!(times < 1)) continue;
        s->light_red[i] *= times;
        s->light_green[i] *= times;
        s->light_blue[i] *= times;
        s->variance[i] *= times * times;
    }
}

/* Of the samples into the tile's pixels. */
static void keep_variances(struct fv_frame *f, const struct fv_tile *tile, const struct fv_samples *s, float exposure)
{
    struct fv_variances v;
    memset(&v, 0, sizeof v);
    for (int i = 0; i < s->count; i++) {
        if (s->paths[i] <= 0 || !(s->inverse_depth[i] > 0)) continue;
        int x = FV_VARIANCE_EDGE + (int)s->x[i] - tile->x0, y = (int)s->y[i] - tile->y0;
        v.variance[y][x] = fminf(s->variance[i] * exposure * exposure, 1e30f);
        v.counts[y][x] = 1;
    }
    f->kernels->even_out(&v);
    for (int y = 0; y < FV_TILE; y++)
        memcpy((float *)f->buffer[FV_VARIANCE][tile->eye] + fv_tile_row(f, tile, y), v.variance[y] + FV_VARIANCE_EDGE, FV_TILE * sizeof(float));
}

static void trace(struct fv_frame *f, const struct fv_tile *tile, uint64_t blocks)
{
    struct fv_worker_scratch *w = &f->scratch[tile->worker];
    struct fv_samples *s = &w->samples;
    const struct fv_kernels *k = f->kernels;
    float exposure = f->tracer->data->exposure;
    bool sorted = sort(s);
    s->identified = true;
    s->bounces = f->denoise.bounces;
    s->apart = f->light_apart;
    s->noise = f->noise;
    k->paths(f->tracer, &f->view[tile->eye], s, 2 * (uint32_t)f->number + (uint32_t)tile->eye, w->rays);
    s->identified = false;
    if (f->denoise.despeckle) despeckle(tile, s);
    if (f->buffer[FV_VARIANCE][0]) keep_variances(f, tile, s, exposure);
    uint32_t *light = w->pixel[FV_PLANE_LIGHT];
    k->encode(s->red, s->green, s->blue, exposure, w->pixel[FV_PLANE_BASE], s->count);
    k->encode_albedo(s->albedo_red, s->albedo_green, s->albedo_blue, w->pixel[FV_PLANE_ALBEDO], s->count);
    k->pack_light(s->light_red, s->light_green, s->light_blue, exposure, light, s->count);
    for (int i = 0; i < s->count; i++)
        if (s->paths[i] <= 0 || !(s->inverse_depth[i] > 0)) light[i] = FV_LIGHT_NONE;
    keep(f, tile, blocks, sorted, FV_COLOUR, w->pixel[FV_PLANE_BASE]);
    keep(f, tile, blocks, sorted, FV_ALBEDO, w->pixel[FV_PLANE_ALBEDO]);
    keep(f, tile, blocks, sorted, fv_accumulates(f) ? FV_FILTERED : FV_LIGHT, light);
    keep(f, tile, blocks, sorted, FV_DEPTH, s->inverse_depth);
    keep(f, tile, blocks, sorted, FV_FACING, s->facing);
    if (fv_accumulates(f) && f->tracer->instances > 0) keep(f, tile, blocks, sorted, FV_TRACK, s->identity);
}

static int run(struct fv_frame *f, const struct fv_tile *tile)
{
    struct fv_samples *s = &f->scratch[tile->worker].samples;
    uint64_t blocks = fv_tile_inside(f, tile);
    fv_tile_place(f, tile, blocks);
    int paths = ask(f, tile, s, false);
    trace(f, tile, blocks);
    return paths;
}

/* What rays meet, and of light what is steady: the rest comes from the pixels around, where the filter finds some. */
static void stand_in(struct fv_frame *f, const struct fv_tile *tile)
{
    struct fv_samples *s = &f->scratch[tile->worker].samples;
    uint64_t blocks = fv_tile_inside(f, tile);
    fv_tile_place(f, tile, blocks);
    ask(f, tile, s, true);
    trace(f, tile, blocks);
}

static void expect(const struct fv_frame *f, const struct fv_parameters *p, const struct fv_rings *rings, double units[2])
{
    struct fv_foveal share = p->foveal;
    double outer = f->has_mean && fv_accumulates(f) ? 1.0 / f->denoise.rate : 1;
    for (int d = 0; d < FV_DEGREES; d++) {
        float e = (float)d + 0.5f;
        int layer = e <= share.r0_deg ? 0 : e <= share.r1_deg ? 1 : 2;
        double due = layer == FV_LAYERS - 1 ? outer : 1;
        units[0] += due * (double)rings->pixels[d] * (double)fv_foveal_probability(&share, e) * p->layer_spp[layer];
    }
}

const struct fv_pass fv_pass_paths = {
    .name = "paths",
    .reads = FV_BIT(FV_LAYER),
    .writes = FV_BIT(FV_COLOUR) | FV_BIT(FV_ALBEDO) | FV_BIT(FV_LIGHT) | FV_BIT(FV_DEPTH) | FV_BIT(FV_FACING) | FV_BIT(FV_VARIANCE),
    .offers = FV_BIT(FV_FILTERED) | FV_BIT(FV_TRACK), /* light, where it is accumulated */
    .needs = FV_NEEDS_GAZE | FV_NEEDS_NOISE,
    .order = FV_ORDER_NEED,
    .run = run,
    .stand_in = stand_in,
    .expect = expect};

static int compose(struct fv_frame *f, const struct fv_tile *tile)
{
    _Alignas(64) float light[3][FV_TILE];
    for (int y = 0; y < FV_TILE; y++) {
        int64_t row = fv_tile_row(f, tile, y);
        uint32_t *colour = (uint32_t *)f->buffer[FV_COLOUR][tile->eye] + row;
        const uint8_t *layer = (const uint8_t *)f->buffer[FV_LAYER][tile->eye] + row;
        f->kernels->unpack_light((const uint32_t *)f->buffer[FV_LIGHT][tile->eye] + row, light[0], light[1], light[2], FV_TILE);
        f->kernels->light_up(colour, (const uint32_t *)f->buffer[FV_ALBEDO][tile->eye] + row, light[0], light[1], light[2],
                             colour, FV_TILE);
        for (int x = 0; x < FV_TILE; x++) {
            bool due = fv_layer_due(f, tile->eye, layer[x] & FV_LAYER_NUMBER, tile->x0 + x, tile->y0 + y);
            colour[x] |= layer[x] & FV_LAYER_SAMPLED && due ? FV_PIXEL_SAMPLED : 0;
        }
    }
    return 1;
}

static void expect_tiles(const struct fv_frame *f, const struct fv_parameters *p, const struct fv_rings *rings, double units[2])
{
    (void)p;
    (void)rings;
    units[0] = (double)f->tiles;
}

/* Named apart from the pyramid's. */
const struct fv_pass fv_pass_light_up = {.name = "light_up",
                                         .reads = FV_BIT(FV_COLOUR) | FV_BIT(FV_ALBEDO) | FV_BIT(FV_LIGHT) | FV_BIT(FV_LAYER),
                                         .writes = FV_BIT(FV_COLOUR),
                                         .run = compose,
                                         .expect = expect_tiles};
