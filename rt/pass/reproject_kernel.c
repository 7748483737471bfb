/* reproject_kernel: one tile, row by row, a vector of neighbouring pixels at a time.
 *
 * A pixel's inverse depth w is first guessed from the support nodes around it, interpolated (which
 * is exact on planes, since w is linear in the picture). The guess is good where the history at the
 * place it maps to has the depth that it predicts. Where nodes disagree or the guess fails, the
 * nearest and the farthest node and the surface that the history itself shows are tried too, and the
 * nearest one that holds wins: what is in front stays in front. */
#include "rt/pass/reproject.h"
#include "rt/trace/pixel.h"

#define reproject FV_ISA_NAME(fv_reproject)
void reproject(struct fv_reproject_tile *tile);

enum {
    PREFETCH_ROWS = 4,
    NODES = FV_TILE / 4 + 2 /* along a tile, where they are densest, and one beyond each end */
};

/* Support nodes' inverse depths, spread over a row of the tile's pixels. `farthest` is FV_DEPTH_UNKNOWN where
 * one of the four nodes is; for w that counts as sky. */
struct row {
    _Alignas(64) float w[FV_TILE], nearest[FV_TILE], farthest[FV_TILE];
};

/* Where a guess leads. */
struct place {
    vi good;       /* mask: the history there has the depth that the guess predicts */
    vf w;          /* the guess */
    vf x, y;       /* in the history */
    vf history_w;  /* what the history holds there */
    vi index;      /* of the pixel there */
};

static inline int clamp_node(int i, int nodes)
{
    return i < 0 ? 0 : i >= nodes ? nodes - 1 : i;
}

static inline float larger(float a, float b)
{
    return a > b ? a : b;
}

/* The inverse depths of the tile's nodes and those around it; anything else than one is unknown. Beyond the
 * picture those at its border are repeated. */
static void take_nodes(const struct fv_reproject_tile *t, float nodes[NODES][NODES])
{
    int along = FV_TILE / t->spacing + 2, x0 = t->x0 / t->spacing - 1, y0 = t->y0 / t->spacing - 1;
    for (int y = 0; y < along; y++) {
        const float *row = t->support_depth + clamp_node(y0 + y, t->nodes_y) * t->support_stride;
        for (int x = 0; x < along; x++) {
            float w = row[clamp_node(x0 + x, t->nodes_x)];
            nodes[y][x] = w >= 0 && w <= FV_INVERSE_DEPTH_MAX ? w : FV_DEPTH_UNKNOWN;
        }
    }
}

/* The tile's row y of pixels. */
static void spread(const struct fv_reproject_tile *t, const float nodes[NODES][NODES], int y, struct row *row)
{
    float across = 1.0f / (float)t->spacing;
    int half = t->spacing / 2, j = (y + half) / t->spacing;
    float fy = ((float)(y + half - j * t->spacing) + 0.5f) * across;
    const float *above = nodes[j], *below = nodes[j + 1];
    /* Runs of pixels that lie between the same two nodes: half a cell, whole ones, half a cell. */
    for (int x = 0, run = half, i0 = 0; x < FV_TILE; x += run, i0++, run = t->spacing) {
        float w00 = above[i0], w10 = above[i0 + 1], w01 = below[i0], w11 = below[i0 + 1];
        float high = larger(larger(w00, w01), larger(w10, w11));
        float low = -larger(larger(-w00, -w01), larger(-w10, -w11));
        w00 = larger(w00, 0), w10 = larger(w10, 0), w01 = larger(w01, 0), w11 = larger(w11, 0);
        float left = w00 + (w01 - w00) * fy, right = w10 + (w11 - w10) * fy;
        if (run > FV_TILE - x) run = FV_TILE - x;
        float f0 = (x == 0 ? (float)half : 0.0f) + 0.5f;
        for (int i = 0; i < run; i++) {
            row->w[x + i] = left + (right - left) * ((f0 + (float)i) * across);
            row->nearest[x + i] = high;
            row->farthest[x + i] = low;
        }
    }
}

static inline struct place look_up(const struct fv_reproject_tile *t, vf3 along, vf w)
{
    const float *m = t->map.t;
    struct place p = {.w = w};
    vf scale = along.z + m[2] * w;
    vi ahead = scale > 1e-4f;
    vf inverse = 1.0f / vf_max(scale, vf_of(1e-4f));
    p.x = vf_clamp((along.x + m[0] * w) * inverse, -8, 16384);
    p.y = vf_clamp((along.y + m[1] * w) * inverse, -8, 16384);
    vi inside = ahead & (p.x >= 0.0f) & (p.x < (float)t->width) & (p.y >= 0.0f) & (p.y < (float)t->height);
    p.index = (vi_from(p.y) * (int32_t)t->stride + vi_from(p.x)) & inside;
    p.history_w = vf_gather(t->history_depth, p.index);
    vf expected = w * inverse;
    vf nearer = vf_min(vf_max(p.history_w, expected), vf_of(FV_INVERSE_DEPTH_MAX));
    p.good = inside & (vf_abs(p.history_w - expected) <= t->epsilon * nearer);
    return p;
}

/* In this view, the inverse depth of what the history shows at a place. */
static inline vf history_surface(const struct fv_reproject_tile *t, vf3 along, const struct place *p)
{
    vf scale = vf_max(1.0f - t->map.t[2] * p->history_w, vf_of(1e-3f));
    return vf_clamp(p->history_w * along.z / scale, 0, FV_INVERSE_DEPTH_MAX);
}

/* Takes the guess where it holds and is nearer than what is there, or nothing good is. */
static inline void prefer(struct place *best, const struct place *p)
{
    vi better = p->good & (~best->good | (p->w > best->w));
    best->w = vf_select(better, p->w, best->w);
    best->x = vf_select(better, p->x, best->x);
    best->y = vf_select(better, p->y, best->y);
    best->history_w = vf_select(better, p->history_w, best->history_w);
    best->index = vi_select(better, p->index, best->index);
    best->good |= p->good;
}

/* The history's colour at a place: bilinear over the four pixels around it, across edges too. Taking only
 * those that show the same surface keeps edges hard, but where the motion is a fraction of a pixel a hard
 * edge does not move at all, frame after frame (measured: 2 dB worse beyond the fovea). */
static inline vf3 history_colour(const struct fv_reproject_tile *t, const struct place *p)
{
    vf x = vf_clamp(p->x - 0.5f, 0, (float)(t->width - 1)), y = vf_clamp(p->y - 0.5f, 0, (float)(t->height - 1));
    vf x0 = vf_floor(x), y0 = vf_floor(y), fx = x - x0, fy = y - y0;
    vi upper = vi_from(y0) * (int32_t)t->stride + vi_from(x0);
    vi lower = upper + ((vi_from(y0) < t->height - 1) & (int32_t)t->stride);
    vi a, b, c, d;
    /* The right-hand pixel of the last column is padding, with weight 0. */
    vi_gather_pairs(t->history_colour, upper, &a, &b);
    vi_gather_pairs(t->history_colour, lower, &c, &d);
    vf w11 = fx * fy, w10 = fx - w11, w01 = fy - w11, w00 = 1.0f - fx - w01;
    vf3 sum = vf3_add(vf3_scale(pixel_unpack(a), w00), vf3_scale(pixel_unpack(b), w10));
    return vf3_add(sum, vf3_add(vf3_scale(pixel_unpack(c), w01), vf3_scale(pixel_unpack(d), w11)));
}

/* The support image's colour at pixel coordinates, bilinear. */
static inline vf3 support_colour(const struct fv_reproject_tile *t, vf px, vf py)
{
    vf x = vf_clamp(px * (1.0f / (float)t->spacing) - 0.5f, 0, (float)(t->nodes_x - 1));
    vf y = vf_clamp(py * (1.0f / (float)t->spacing) - 0.5f, 0, (float)(t->nodes_y - 1));
    vf x0 = vf_floor(x), y0 = vf_floor(y), fx = x - x0, fy = y - y0;
    vi ix = vi_from(x0), iy = vi_from(y0), stride = vi_of((int32_t)t->support_stride);
    vi at = iy * stride + ix, right = (ix < t->nodes_x - 1) & 1, down = (iy < t->nodes_y - 1) & stride;
    vf3 a = pixel_unpack(vi_gather(t->support_colour, at)), b = pixel_unpack(vi_gather(t->support_colour, at + right));
    vf3 c = pixel_unpack(vi_gather(t->support_colour, at + down));
    vf3 d = pixel_unpack(vi_gather(t->support_colour, at + down + right));
    vf3 upper = vf3_add(a, vf3_scale(vf3_sub(b, a), fx)), lower = vf3_add(c, vf3_scale(vf3_sub(d, c), fx));
    return vf3_add(upper, vf3_scale(vf3_sub(lower, upper), fy));
}

/* One vector of pixels; returns the bits of those without history. */
static inline unsigned step(const struct fv_reproject_tile *t, const struct row *row, int x, float y, int64_t out,
                            unsigned *edge_lanes)
{
    const float(*m)[3] = t->map.m;
    vf px = (float)(t->x0 + x) + 0.5f + vf_from(vi_lanes());
    vf3 along = {m[0][0] * px + (m[0][1] * y + m[0][2]), m[1][0] * px + (m[1][1] * y + m[1][2]),
                 m[2][0] * px + (m[2][1] * y + m[2][2])};
    vf w = vf_load(row->w + x), nearest = vf_load(row->nearest + x), farthest = vf_load(row->farthest + x);
    struct place best = look_up(t, along, w);
    vi edge = nearest - farthest > 4.0f * t->epsilon * nearest;
    bool edges = vi_any(edge | ~best.good);
    if (edges) {
        struct place shown = look_up(t, along, history_surface(t, along, &best));
        struct place front = look_up(t, along, nearest), back = look_up(t, along, farthest);
        prefer(&best, &shown);
        struct place front_shown = look_up(t, along, history_surface(t, along, &front));
        front.good &= edge;
        front_shown.good &= edge;
        prefer(&best, &front);
        prefer(&best, &front_shown);
        prefer(&best, &back);
    }
    /* The rows below look a little further down in the history: on its way before they need it. */
    const int32_t ahead = best.index[0] + PREFETCH_ROWS * (int32_t)t->stride;
    __builtin_prefetch(t->history_depth + ahead);
    __builtin_prefetch(t->history_depth + ahead + FV_WIDTH);
    __builtin_prefetch(t->history_colour + ahead);
    __builtin_prefetch(t->history_colour + ahead + FV_WIDTH);
    vi filled = ~best.good;
    vf3 colour = history_colour(t, &best);
    vf depth = vf_select(edge & best.good, history_surface(t, along, &best), best.w);
    if (vi_any(filled)) {
        colour = vf3_select(filled, support_colour(t, px, vf_of(y)), colour);
        depth = vf_select(filled, vf_select(farthest < 0.0f, farthest, w), depth);
    }
    vi_store(t->colour + out, pixel_pack(colour) | (filled & (int32_t)FV_PIXEL_FILLED));
    vf_store(t->depth + out, depth);
    *edge_lanes = vi_bits(edge);
    return vi_bits(filled);
}

void reproject(struct fv_reproject_tile *t)
{
    struct row row;
    float nodes[NODES][NODES];
    int missing[FV_BLOCKS] = {0};
    /* Pixels of the tile beyond the picture's edge miss nothing. */
    uint32_t columns = t->width - t->x0 >= FV_TILE ? ~0u : (1u << (t->width - t->x0)) - 1;
    t->failed = t->edges = 0;
    take_nodes(t, nodes);
    for (int y = 0; y < FV_TILE; y++) {
        float py = (float)(t->y0 + y) + 0.5f;
        int64_t out = (int64_t)(t->y0 + y) * t->stride + t->x0;
        uint32_t filled = 0, edge = 0, inside = t->y0 + y < t->height ? columns : 0;
        spread(t, nodes, y, &row);
        for (int x = 0; x < FV_TILE; x += FV_WIDTH) {
            unsigned edge_lanes;
            filled |= step(t, &row, x, py, out + x, &edge_lanes) << x;
            edge |= edge_lanes << x;
        }
        for (int b = 0; b < FV_BLOCKS; b++)
            t->edges |= (uint64_t)((edge >> (FV_BLOCK * b) & 15) != 0) << (y / FV_BLOCK * FV_BLOCKS + b);
        for (int b = 0; b < FV_BLOCKS; b++) missing[b] += __builtin_popcount((filled & inside) >> (FV_BLOCK * b) & 15);
        if (y % FV_BLOCK != FV_BLOCK - 1) continue;
        for (int b = 0; b < FV_BLOCKS; b++) {
            t->failed |= (uint64_t)(missing[b] >= FV_BLOCK) << (y / FV_BLOCK * FV_BLOCKS + b);
            missing[b] = 0;
        }
    }
}
