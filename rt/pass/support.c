/* support: the support image and G-buffer: one sample every few pixels of the whole picture, so
 * that every part of it is known a little in every frame (Weier et al. 2016, section 3).
 *
 * Packets of nodes take turns to be traced, each once in method.support_refresh frames; in the others they take what
 * history shows at their places, and only nodes that it does not know are traced. */
#include "rt/pass/support.h"

#include "rt/pass/bent.h"
#include "rt/pass/cache.h"

#include <math.h>

/* A quarter of the rays to area lights and for ambient occlusion: nodes' light is interpolated where it is shown,
 * and elsewhere one sample among many. */
enum { FEWER = 4 };

/* The nodes of the tiles that one of them works at, of all of which it is the first: side x side, whole packets. */
struct nodes {
    int side;
    int64_t stride, rows; /* of the support image */
    int64_t x0, y0;
};

/* Where nodes are asked for, those of 4 x 4 tiles, so that the few that are traced fill rays' packets. */
static struct nodes nodes_of(const struct fv_frame *f, const struct fv_tile *tile)
{
    int packet = f->spacing > 8 ? f->spacing / 8 : 1, group = f->support_refresh > 1 ? 4 : packet;
    bool first = tile->x0 / FV_TILE % group == 0 && tile->y0 / FV_TILE % group == 0;
    return (struct nodes){.side = first ? FV_TILE * group / f->spacing : 0,
                          .stride = f->stride / f->spacing,
                          .rows = f->rows / f->spacing,
                          .x0 = tile->x0 / f->spacing,
                          .y0 = tile->y0 / f->spacing};
}

/* The i-th node, in its tile. */
static void node_at(const struct nodes *n, int i, int *x, int *y)
{
    int packet = i / 16, across = n->side / FV_PACKET;
    *x = packet % across * FV_PACKET + i % FV_PACKET;
    *y = packet / across * FV_PACKET + i % 16 / FV_PACKET;
}

/* Bits of the nodes of the packet that begins at the i-th one: at the end of the support image some are beyond it. */
static uint32_t existing(const struct nodes *n, int i)
{
    int x, y;
    node_at(n, i, &x, &y);
    int64_t right = n->stride - (n->x0 + x), below = n->rows - (n->y0 + y);
    uint32_t columns = right >= FV_PACKET ? 0x1111 * 15 : right > 0 ? 0x1111u * ((1u << right) - 1) : 0;
    return below >= FV_PACKET ? columns : below > 0 ? columns & ((1u << FV_PACKET * below) - 1) : 0;
}

/* Colours are of f->planes. */
static void store(struct fv_frame *f, const struct fv_tile *tile, const struct nodes *n, int i,
                  const uint32_t colour[FV_PLANES], float inverse_depth, int surface)
{
    int x, y;
    uint32_t *planes = f->buffer[FV_SUPPORT_COLOUR][tile->eye];
    node_at(n, i, &x, &y);
    int64_t node = (n->y0 + y) * n->stride + n->x0 + x;
    for (int p = 0; p < f->planes; p++) planes[p * f->support_plane + node] = colour[p];
    ((float *)f->buffer[FV_SUPPORT_DEPTH][tile->eye])[node] = inverse_depth;
    ((uint8_t *)f->buffer[FV_SUPPORT_SURFACE][tile->eye])[node] = (uint8_t)surface;
}

/* Whether it is the turn of the packet with that first node: in every row of packets one in so many, and not those
 * of the row above. */
static bool due(const struct fv_frame *f, int64_t x, int64_t y)
{
    int64_t refresh = f->support_refresh, turn = x / FV_PACKET + (refresh * 5 + 4) / 8 * (y / FV_PACKET);
    return (turn + f->number) % refresh == 0;
}

/* Whether a moving object may be seen within `reach` pixels of a place. */
static bool touched(const struct fv_frame *f, const struct fv_view *view, float x, float y, float reach)
{
    for (int i = 0; i < f->tracer->instances; i++) {
        const float *ball = f->tracer->instance[i].ball;
        float along = 0, length = 0, far = 0, d[3];
        fv_view_direction(view, x, y, d);
        for (int k = 0; k < 3; k++) {
            float to = ball[k] - view->origin[k];
            along += to * d[k], length += d[k] * d[k], far += to * to;
        }
        if (ball[3] < 0) continue;
        float cosine = along / fmaxf(sqrtf(length * far), 1e-30f), sine = ball[3] / fmaxf(sqrtf(far), 1e-30f);
        if (!(sine < 1)) return true;
        if (!(acosf(fminf(cosine, 1)) > asinf(sine) + fv_radius_deg(view, 2 * reach) * 0.0174533f)) return true;
    }
    return false;
}

/* The last frame's nodes around where those of the packet were, by how the surface in its middle moved; false where
 * that leads nowhere. */
static bool take_old(const struct fv_frame *f, int eye, const struct nodes *n, int64_t x0, int64_t y0,
                     struct fv_map *map, struct fv_support_packet *packet)
{
    const float *depth = f->buffer[FV_SUPPORT_HISTORY_DEPTH][eye];
    const uint8_t *surface = f->buffer[FV_SUPPORT_HISTORY_SURFACE][eye];
    int columns = (f->width + f->spacing - 1) / f->spacing, rows = (f->height + f->spacing - 1) / f->spacing;
    float half = 0.5f * FV_PACKET, spacing = (float)f->spacing, to[3];
    float w = depth[fv_clamp(y0 + FV_PACKET / 2, rows) * n->stride + fv_clamp(x0 + FV_PACKET / 2, columns)];
    float x_middle = ((float)x0 + half) * spacing, y_middle = ((float)y0 + half) * spacing;
    *map = fv_bent_map(f, eye, 0, x_middle, y_middle, fmaxf(w, 0));
    fv_map_point(map, x_middle, y_middle, fmaxf(w, 0), to);
    if (!(to[2] > 0.1f && fabsf(to[0]) < 16384 * to[2] && fabsf(to[1]) < 16384 * to[2])) return false;
    int64_t left = lroundf(to[0] / to[2] / spacing - half) - FV_AROUND;
    int64_t top = lroundf(to[1] / to[2] / spacing - half) - FV_AROUND;
    bool inside = left >= 0 && left + FV_WINDOW <= columns && top >= 0 && top + FV_WINDOW <= rows;
    for (int y = 0; y < FV_WINDOW; y++) {
        float *to_depth = packet->old_depth + y * FV_WINDOW;
        int32_t *to_surface = packet->old_surface + y * FV_WINDOW;
        int64_t row = fv_clamp(top + y, rows) * n->stride;
        for (int x = 0; x < FV_WINDOW; x++) {
            int64_t at = row + (inside ? left + x : fv_clamp(left + x, columns));
            to_depth[x] = depth[at];
            to_surface[x] = surface[at];
        }
    }
    return true;
}

/* Takes what history knows of these nodes of the packet that begins at the i-th one; returns those that it does not. */
static uint32_t ask(struct fv_frame *f, const struct fv_tile *tile, const struct nodes *n, int i, uint32_t nodes)
{
    const struct fv_raster *raster[2] = {&f->raster[FV_COARSE][tile->eye], &f->raster[FV_COARSEST][tile->eye]};
    float spacing = (float)f->spacing, reach = 0.5f * FV_PACKET * spacing;
    int x, y;
    node_at(n, i, &x, &y);
    float left = (float)(n->x0 + x) * spacing, top = (float)(n->y0 + y) * spacing;
    struct fv_map map;
    struct fv_support_packet packet = {.map = &map,
                                       .history = {raster[0], raster[1]},
                                       .x = left + f->node[0] * spacing,
                                       .y = top + f->node[1] * spacing,
                                       .spacing = spacing,
                                       .epsilon = f->epsilon_depth,
                                       .still = f->still};
    if (touched(f, &f->view[tile->eye], left + reach, top + reach, reach) ||
        !take_old(f, tile->eye, n, n->x0 + x, n->y0 + y, &map, &packet))
        return nodes;
    f->kernels->answer(&packet);
    for (uint32_t known = packet.answered & nodes; known; known &= known - 1) {
        int k = __builtin_ctz(known);
        const struct fv_raster *r = raster[packet.by_second >> k & 1];
        uint32_t colour[FV_PLANES];
        for (int p = 0; p < f->planes; p++)
            colour[p] = r->history_colour[p * r->plane + packet.pixel[k]] & FV_PIXEL_COLOUR;
        store(f, tile, n, i + k, colour, packet.inverse_depth[k], packet.surface[k] | FV_SURFACE_OLD);
    }
    return nodes & ~packet.answered;
}

/* Packets that no eye sees through the lens, nor are next to those: their nodes stay as they were at first, black and far. */
static bool unseen(const struct fv_frame *f, const struct fv_tile *tile, int64_t x, int64_t y)
{
    const struct fv_bend *b = &f->view[tile->eye].bend;
    float spacing = (float)f->spacing, left = (float)x * spacing, top = (float)y * spacing, side = FV_PACKET * spacing;
    return b->masks && fv_bend_beyond(b, left, top, left + side, top + side, 2 * spacing);
}

/* Bits of the packet's nodes that are to be traced; the others are stored. */
static uint32_t missing(struct fv_frame *f, const struct fv_tile *tile, const struct nodes *n, int i)
{
    struct fv_worker_scratch *s = &f->scratch[tile->worker];
    uint32_t nodes = existing(n, i);
    int x, y;
    node_at(n, i, &x, &y);
    if (unseen(f, tile, n->x0 + x, n->y0 + y)) return 0;
    if (!nodes || !f->has_history || f->spacing != f->spacing_before || due(f, n->x0 + x, n->y0 + y)) return nodes;
    uint32_t left = ask(f, tile, n, i, nodes);
    s->asked += __builtin_popcount(nodes);
    s->unanswered += __builtin_popcount(left);
    return left;
}

static int run(struct fv_frame *f, const struct fv_tile *tile)
{
    struct fv_worker_scratch *s = &f->scratch[tile->worker];
    struct fv_samples *samples = &s->samples;
    struct nodes nodes = nodes_of(f, tile);
    int16_t traced[FV_SAMPLES_MAX];
    samples->count = 0;
    for (int i = 0; i < nodes.side * nodes.side; i += FV_PACKET * FV_PACKET) {
        for (uint32_t left = missing(f, tile, &nodes, i); left; left &= left - 1) {
            int x, y, n = samples->count++;
            traced[n] = (int16_t)(i + __builtin_ctz(left));
            node_at(&nodes, traced[n], &x, &y);
            samples->x[n] = (float)tile->x0 + ((float)x + f->node[0]) * (float)f->spacing;
            samples->y[n] = (float)tile->y0 + ((float)y + f->node[1]) * (float)f->spacing;
        }
    }
    if (samples->count == 0) return 0;
    fv_samples_trace(f, tile, FEWER);
    fv_samples_encode(f, tile);
    for (int i = 0; i < samples->count; i++) {
        uint32_t colour[FV_PLANES] = {s->pixel[FV_PLANE_BASE][i], s->pixel[FV_PLANE_ALBEDO][i],
                                      s->pixel[FV_PLANE_LIGHT][i]};
        store(f, tile, &nodes, traced[i], colour, samples->inverse_depth[i], samples->surface[i]);
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
        int x, y, packet = i / (FV_PACKET * FV_PACKET) * (FV_PACKET * FV_PACKET);
        if (!(existing(&nodes, packet) >> (i - packet) & 1)) continue;
        node_at(&nodes, i, &x, &y);
        int column = (int)(((float)(nodes.x0 + x) + f->node[0]) * (float)f->spacing) >> FV_COARSEST;
        int row = (int)(((float)(nodes.y0 + y) + f->node[1]) * (float)f->spacing) >> FV_COARSEST;
        column = column < coarse->width ? column : coarse->width - 1;
        row = row < coarse->height ? row : coarse->height - 1;
        int64_t at = row * coarse->stride + column;
        uint32_t cache = coarse->history_cache[at];
        /* Whose motion it has is not kept. */
        int surface = cache & FV_CACHE_MOVING ? FV_SURFACE_VIEW | FV_SURFACE_OLD : FV_SURFACE_OLD;
        /* Mirrors and glass stay such until they are traced again. */
        const uint8_t *before = f->buffer[FV_SUPPORT_HISTORY_SURFACE][tile->eye];
        if (before && f->spacing == f->spacing_before)
            surface |= before[(nodes.y0 + y) * nodes.stride + nodes.x0 + x] & (FV_SURFACE_VIEW | FV_SURFACE_GRAZING);
        uint32_t colour[FV_PLANES];
        for (int p = 0; p < f->planes; p++) colour[p] = coarse->history_colour[p * coarse->plane + at] & FV_PIXEL_COLOUR;
        store(f, tile, &nodes, i, colour, cache_depth_of(cache), surface);
    }
}

static void expect(const struct fv_frame *f, const struct fv_parameters *p, const struct fv_rings *rings,
                   double units[2])
{
    double nodes = (double)f->eyes * (double)(f->stride / p->spacing) * (double)(f->rows / p->spacing);
    double due = f->has_history && p->spacing == f->spacing_before ? 1.0 / f->support_refresh : 1;
    (void)rings;
    units[0] = nodes * (due + (1 - due) * (double)f->unanswered_share);
}

const struct fv_pass fv_pass_support = {.name = "support",
                                        .reads = FV_BIT(FV_COARSE_HISTORY_COLOUR) | FV_BIT(FV_COARSE_HISTORY_CACHE) |
                                                 FV_BIT(FV_COARSEST_HISTORY_COLOUR) | FV_BIT(FV_COARSEST_HISTORY_CACHE) |
                                                 FV_BIT(FV_SUPPORT_HISTORY_DEPTH) | FV_BIT(FV_SUPPORT_HISTORY_SURFACE),
                                        .writes = FV_BIT(FV_SUPPORT_COLOUR) | FV_BIT(FV_SUPPORT_DEPTH) |
                                                  FV_BIT(FV_SUPPORT_SURFACE),
                                        .needs = FV_NEEDS_HISTORY,
                                        .run = run,
                                        .stand_in = stand_in,
                                        .expect = expect};
