/* support: the support image and G-buffer: one sample every few pixels of the whole picture, so
 * that every part of it is known a little in every frame (Weier et al. 2016, section 3). */
#include "rt/pass/cache.h"
#include "rt/pass/pass.h"

/* A quarter of the rays to area lights and for ambient occlusion: nodes' light is interpolated where it is shown,
 * and elsewhere one sample among many. */
enum { FEWER = 4 };

/* Nodes of a tile: side x side, in packets of 4 x 4. At 16 pixels a tile has fewer than a packet: one
 * tile in four then takes its neighbours' to the right and below with its own. */
struct nodes {
    int side;
    int64_t stride, rows; /* of the support image */
    int64_t x0, y0;
};

static struct nodes nodes_of(const struct fv_frame *f, const struct fv_tile *tile)
{
    int group = f->spacing > 8 ? f->spacing / 8 : 1, side = FV_TILE * group / f->spacing;
    bool first = tile->x0 / FV_TILE % group == 0 && tile->y0 / FV_TILE % group == 0;
    return (struct nodes){.side = first ? side : 0,
                          .stride = f->stride / f->spacing,
                          .rows = f->rows / f->spacing,
                          .x0 = tile->x0 / f->spacing,
                          .y0 = tile->y0 / f->spacing};
}

/* The i-th node, in its tile. */
static void node_at(const struct nodes *n, int i, int *x, int *y)
{
    int packet = i / 16, across = n->side / 4;
    *x = packet % across * 4 + i % 4;
    *y = packet / across * 4 + i % 16 / 4;
}

/* Colours are of f->planes. */
static void store(struct fv_frame *f, const struct fv_tile *tile, const struct nodes *n, int i,
                  const uint32_t colour[FV_PLANES], float inverse_depth, int surface)
{
    int x, y;
    uint32_t *planes = f->buffer[FV_SUPPORT_COLOUR][tile->eye];
    node_at(n, i, &x, &y);
    if (n->x0 + x >= n->stride || n->y0 + y >= n->rows) return;
    int64_t node = (n->y0 + y) * n->stride + n->x0 + x;
    for (int p = 0; p < f->planes; p++) planes[p * f->support_plane + node] = colour[p];
    ((float *)f->buffer[FV_SUPPORT_DEPTH][tile->eye])[node] = inverse_depth;
    ((uint8_t *)f->buffer[FV_SUPPORT_SURFACE][tile->eye])[node] = (uint8_t)surface;
}

static int run(struct fv_frame *f, const struct fv_tile *tile)
{
    struct fv_worker_scratch *s = &f->scratch[tile->worker];
    struct fv_samples *samples = &s->samples;
    struct nodes nodes = nodes_of(f, tile);
    samples->count = nodes.side * nodes.side;
    if (samples->count == 0) return 0;
    for (int i = 0; i < samples->count; i++) {
        int x, y;
        node_at(&nodes, i, &x, &y);
        samples->x[i] = (float)tile->x0 + ((float)x + f->node[0]) * (float)f->spacing;
        samples->y[i] = (float)tile->y0 + ((float)y + f->node[1]) * (float)f->spacing;
    }
    fv_samples_trace(f, tile, FEWER);
    for (int i = 0; i < samples->count; i++) {
        uint32_t colour[FV_PLANES] = {s->pixel[FV_PLANE_BASE][i], s->pixel[FV_PLANE_ALBEDO][i],
                                      s->pixel[FV_PLANE_LIGHT][i]};
        store(f, tile, &nodes, i, colour, samples->inverse_depth[i], samples->surface[i]);
    }
    return samples->count;
}

/* What the last frame showed at the same places: a little off where the view moves, which reprojection
 * mends where it looks at the surface that it finds there. */
static void stand_in(struct fv_frame *f, const struct fv_tile *tile)
{
    const struct fv_raster *coarse = &f->raster[FV_COARSEST][tile->eye];
    struct nodes nodes = nodes_of(f, tile);
    for (int i = 0; i < nodes.side * nodes.side; i++) {
        int x, y;
        node_at(&nodes, i, &x, &y);
        int column = (int)(((float)(nodes.x0 + x) + f->node[0]) * (float)f->spacing) >> FV_COARSEST;
        int row = (int)(((float)(nodes.y0 + y) + f->node[1]) * (float)f->spacing) >> FV_COARSEST;
        column = column < coarse->width ? column : coarse->width - 1;
        row = row < coarse->height ? row : coarse->height - 1;
        int64_t at = row * coarse->stride + column;
        uint32_t cache = coarse->history_cache[at];
        /* Whose motion it has is not kept. */
        int surface = cache & FV_CACHE_MOVING ? FV_SURFACE_VIEW | FV_SURFACE_OLD : FV_SURFACE_OLD;
        uint32_t colour[FV_PLANES];
        for (int p = 0; p < f->planes; p++) colour[p] = coarse->history_colour[p * coarse->plane + at] & FV_PIXEL_COLOUR;
        store(f, tile, &nodes, i, colour, cache_depth_of(cache), surface);
    }
}

static void expect(const struct fv_frame *f, const struct fv_parameters *p, const struct fv_rings *rings,
                   double units[2])
{
    (void)rings;
    units[0] = (double)f->eyes * (double)(f->stride / p->spacing) * (double)(f->rows / p->spacing);
}

const struct fv_pass fv_pass_support = {.name = "support",
                                        .reads = FV_BIT(FV_COARSEST_HISTORY_COLOUR) | FV_BIT(FV_COARSEST_HISTORY_CACHE),
                                        .writes = FV_BIT(FV_SUPPORT_COLOUR) | FV_BIT(FV_SUPPORT_DEPTH) |
                                                  FV_BIT(FV_SUPPORT_SURFACE),
                                        .needs = FV_NEEDS_HISTORY,
                                        .run = run,
                                        .stand_in = stand_in,
                                        .expect = expect};
