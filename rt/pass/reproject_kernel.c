/* reproject_kernel: one tile, row by row, a vector of neighbouring pixels at a time.
 *
 * A pixel's inverse depth w is first guessed from the support nodes around it, interpolated (which
 * is exact on planes, since w is linear in the picture). The guess is good where the history at the
 * place it maps to has the depth that it predicts. Where nodes disagree or the guess fails, the
 * nearest and the farthest node and the surface that the history itself shows are tried too, and the
 * nearest one that holds wins: what is in front stays in front. */
#include "rt/pass/cache.h"
#include "rt/pass/reproject.h"
#include "rt/trace/pixel.h"

#define reproject FV_ISA_NAME(fv_reproject)
void reproject(struct fv_reproject_tile *tile);

enum {
    PREFETCH_ROWS = 4,
    NODES = 16 /* along a tile where they are densest, and one beyond each end: 10; as many as vi_table16 takes */
};

/* Nodes of a tile and around it, as columns of NODES. Unknown inverse depths count as sky for `w`. */
struct nodes {
    _Alignas(64) float w[NODES][NODES], known[NODES][NODES]; /* known: FV_DEPTH_UNKNOWN where it is not */
    _Alignas(64) float luminance[NODES][NODES];
    _Alignas(64) int32_t surface[NODES][NODES];
    int along; /* nodes that count */
};

/* A row of cells between nodes, by the left one's column: what their four nodes have in common. */
struct cells {
    _Alignas(64) float nearest[NODES], farthest[NODES]; /* farthest: FV_DEPTH_UNKNOWN where a node's is */
    _Alignas(64) int32_t marked[NODES], bent[NODES];    /* masks: to be sampled more often; always */
    _Alignas(64) float w[NODES];                        /* at the row of pixels */
    bool any_bent;
};

/* Where pixels are looked up. */
struct source {
    const uint32_t *colour, *cache;
    float width, height, scale; /* scale: its pixels a pixel of the raster */
    int32_t stride, last_row;
};

/* Where a guess leads. */
struct place {
    vi good;      /* mask: the history there has the depth that the guess predicts */
    vf w;         /* the guess */
    vf x, y;      /* in the history */
    vf history_w; /* what the history holds there */
    vi index;     /* of the pixel there */
    vi cache;
};

static inline struct source source_of(const struct fv_raster *r, float scale)
{
    return (struct source){.colour = r->history_colour,
                           .cache = r->history_cache,
                           .width = (float)r->width,
                           .height = (float)r->height,
                           .scale = scale,
                           .stride = (int32_t)r->stride,
                           .last_row = r->height - 1};
}

static inline int clamp_node(int i, int nodes)
{
    return i < 0 ? 0 : i >= nodes ? nodes - 1 : i;
}

static inline float larger(float a, float b)
{
    return a > b ? a : b;
}

static inline float smaller(float a, float b)
{
    return a < b ? a : b;
}

/* Beyond the picture the nodes at its border are repeated. Anything else than an inverse depth is unknown. */
static void take_nodes(const struct fv_reproject_tile *t, struct nodes *nodes)
{
    int inside = (int)((float)t->side / t->spacing + 0.5f);
    int x0 = (int)((float)t->x0 / t->spacing + 0.5f) - 1, y0 = (int)((float)t->y0 / t->spacing + 0.5f) - 1;
    nodes->along = inside + 2;
    for (int y = 0; y < nodes->along; y++) {
        int64_t row = clamp_node(y0 + y, t->nodes_y) * t->support_stride;
        for (int x = 0; x < nodes->along; x++) {
            int64_t at = row + clamp_node(x0 + x, t->nodes_x);
            float w = t->support_depth[at];
            uint32_t c = t->support_colour[at];
            bool known = w >= 0 && w <= FV_INVERSE_DEPTH_MAX;
            nodes->w[y][x] = known ? w : 0;
            nodes->known[y][x] = known ? w : FV_DEPTH_UNKNOWN;
            nodes->luminance[y][x] = ((float)(c & 1023) * 0.299f + (float)(c >> 10 & 1023) * 0.587f +
                                      (float)(c >> 20 & 1023) * 0.114f) * (1 / 1023.0f);
            nodes->surface[y][x] = t->support_surface[at];
        }
        for (int x = nodes->along; x < NODES; x++) nodes->w[y][x] = 0; /* rows are worked at whole */
    }
}

/* The cells below node row j. */
static void take_cells(const struct fv_reproject_tile *t, const struct nodes *n, int j, struct cells *cells)
{
    cells->any_bent = false;
    for (int i = 0; i + 1 < n->along; i++) {
        const float *a = n->known[j] + i, *b = n->known[j + 1] + i, *c = n->luminance[j] + i, *d = n->luminance[j + 1] + i;
        float high = larger(larger(a[0], a[1]), larger(b[0], b[1]));
        float low = smaller(smaller(a[0], a[1]), smaller(b[0], b[1]));
        float bright = larger(larger(c[0], c[1]), larger(d[0], d[1]));
        float dark = smaller(smaller(c[0], c[1]), smaller(d[0], d[1]));
        int surface = n->surface[j][i] | n->surface[j][i + 1] | n->surface[j + 1][i] | n->surface[j + 1][i + 1];
        bool bent = surface & FV_SURFACE_VIEW;
        cells->nearest[i] = high;
        cells->farthest[i] = low;
        cells->marked[i] = -(high - low > 4.0f * t->epsilon * high || bright - dark > t->epsilon_luminance ||
                             (surface & FV_SURFACE_GRAZING));
        cells->bent[i] = -bent;
        cells->any_bent |= bent;
    }
}

static inline vf table(const float t[NODES], vi index)
{
    return (vf)vi_table16((const uint32_t *)t, index);
}

static inline vi table_mask(const int32_t t[NODES], vi index)
{
    return vi_table16((const uint32_t *)t, index);
}

static inline struct place look_up(const struct fv_reproject_tile *t, const struct source *s, vf3 along, vf w)
{
    const float *m = t->map.t;
    struct place p = {.w = w};
    vf depth = along.z + m[2] * w;
    vi ahead = depth > 1e-4f;
    vf inverse = 1.0f / vf_max(depth, vf_of(1e-4f)), scale = inverse * s->scale;
    p.x = vf_clamp((along.x + m[0] * w) * scale, -8, 16384);
    p.y = vf_clamp((along.y + m[1] * w) * scale, -8, 16384);
    vi inside = ahead & (p.x >= 0.0f) & (p.x < s->width) & (p.y >= 0.0f) & (p.y < s->height);
    p.index = (vi_from(p.y) * s->stride + vi_from(p.x)) & inside;
    p.cache = vi_gather(s->cache, p.index);
    p.history_w = cache_depth(p.cache);
    vf expected = w * inverse;
    vf nearer = vf_min(vf_max(p.history_w, expected), vf_of(FV_INVERSE_DEPTH_MAX));
    /* Nor where there is none: nothing holds of what is no number. */
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
    best->cache = vi_select(better, p->cache, best->cache);
    best->good |= p->good;
}

/* Further guesses of the lanes that are at an edge or where the first one failed. */
static inline void try_others(const struct fv_reproject_tile *t, const struct source *s, vf3 along, vf nearest,
                              vf farthest, vi edge, struct place *best)
{
    struct place shown = look_up(t, s, along, history_surface(t, along, best));
    struct place front = look_up(t, s, along, nearest), back = look_up(t, s, along, vf_max(farthest, vf_of(0)));
    struct place front_shown = look_up(t, s, along, history_surface(t, along, &front));
    shown.good &= edge | ~best->good;
    front.good &= edge;
    front_shown.good &= edge;
    back.good &= edge & (farthest >= 0.0f);
    prefer(best, &shown);
    prefer(best, &front);
    prefer(best, &front_shown);
    prefer(best, &back);
}

/* The history's colour at a place: bilinear over the four pixels around it, across edges too. Taking only
 * those that show the same surface keeps edges hard, but where the motion is a fraction of a pixel a hard
 * edge does not move at all, frame after frame (measured: 2 dB worse beyond the fovea). */
static inline vf3 bilinear(const struct source *s, vf px, vf py)
{
    vf x = vf_clamp(px - 0.5f, 0, s->width - 1.0f), y = vf_clamp(py - 0.5f, 0, s->height - 1.0f);
    vf x0 = vf_floor(x), y0 = vf_floor(y), fx = x - x0, fy = y - y0;
    vi iy = vi_from(y0), upper = iy * s->stride + vi_from(x0);
    vi lower = upper + ((iy < s->last_row) & s->stride);
    vi a, b, c, d;
    /* The right-hand pixel of the last column is padding, with weight 0. */
    vi_gather_pairs(s->colour, upper, &a, &b);
    vi_gather_pairs(s->colour, lower, &c, &d);
    vf w11 = fx * fy, w10 = fx - w11, w01 = fy - w11, w00 = 1.0f - fx - w01;
    vf3 sum = vf3_add(vf3_scale(pixel_unpack(a), w00), vf3_scale(pixel_unpack(b), w10));
    return vf3_add(sum, vf3_add(vf3_scale(pixel_unpack(c), w01), vf3_scale(pixel_unpack(d), w11)));
}

/* The weights of four pixels in a row of which the second and third lie round the place, f from the second:
 * Catmull-Rom, which keeps what bilinear interpolation blurs a little more each frame. */
static inline void cubic_weights(vf f, vf w[4])
{
    w[0] = f * (-0.5f + f * (1.0f - 0.5f * f));
    w[1] = 1.0f + f * f * (-2.5f + 1.5f * f);
    w[2] = f * (0.5f + f * (2.0f - 1.5f * f));
    w[3] = f * f * (-0.5f + 0.5f * f);
}

/* Neighbouring pixels mostly come from neighbouring ones: then all that a vector of them needs of the history
 * stands in two vectors of each of four rows, or of five, and is picked from there. */
struct window {
    bool holds, slanted;  /* slanted: lanes of `lower` need the rows one further down */
    const uint32_t *from; /* the first row's first pixel */
    vi column, lower;
};

static inline struct window window_of(const struct source *s, vi ix, vi iy)
{
    struct window w = {.holds = false};
#if FV_WIDTH > 4
    int left = ix[0] - 1, first = iy[0], last = iy[FV_WIDTH - 1], top = (first < last ? first : last) - 1;
    vi column = ix - 1 - left, row = iy - 1 - top;
    vi within = (column >= 0) & (column <= 2 * FV_WIDTH - 4) & (ix < (int32_t)s->width - 2) & (row >= 0) & (row <= 1);
    w.holds = left >= 0 && left + 2 * FV_WIDTH <= s->stride && top >= 0 && top + 4 <= s->last_row && !vi_any(~within);
    w.slanted = first != last || vi_any(row > 0);
    w.from = s->colour + (int64_t)top * s->stride + left;
    w.column = column;
    w.lower = row > 0;
#else
    (void)s, (void)ix, (void)iy;
#endif
    return w;
}

static inline void pick_row(const struct window *w, const uint32_t *row, vi tap[4])
{
#if FV_WIDTH > 4
    vi low = vi_load(row), high = vi_load(row + FV_WIDTH);
    for (int i = 0; i < 4; i++) tap[i] = vi_pick(low, high, w->column + i);
#else
    (void)w, (void)row, (void)tap;
#endif
}

static inline void gather_row(const struct source *s, vi ix, vi row, vi tap[4])
{
    vi left = ix - ((ix > 0) & 1), right = ix + ((ix < (int32_t)s->width - 2) & 1); /* of pairs */
    row = vi_select(row > 0, row, vi_of(0));
    row = vi_select(row < s->last_row, row, vi_of(s->last_row)) * s->stride;
    vi_gather_pairs(s->colour, row + left, &tap[0], &tap[1]);
    vi_gather_pairs(s->colour, row + right, &tap[2], &tap[3]);
}

static inline vf3 cubic(const struct source *s, vf px, vf py)
{
    vf x = vf_clamp(px - 0.5f, 0, s->width - 1.0f), y = vf_clamp(py - 0.5f, 0, s->height - 1.0f);
    vf x0 = vf_floor(x), y0 = vf_floor(y), wx[4], wy[4];
    vi ix = vi_from(x0), iy = vi_from(y0), tap[4], below[4];
    vi first = ix > 0, last = ix < (int32_t)s->width - 2;
    vf3 sum = {vf_of(0), vf_of(0), vf_of(0)};
    struct window window = window_of(s, ix, iy);
    cubic_weights(x - x0, wx);
    cubic_weights(y - y0, wy);
    /* At the left and right borders a pair begins or ends a pixel later or sooner: the border's pixel is both. */
    wx[0] = vf_select(first, wx[0], wx[0] + wx[1]), wx[1] = vf_select(first, wx[1], vf_of(0));
    wx[3] = vf_select(last, wx[3], wx[2] + wx[3]), wx[2] = vf_select(last, wx[2], vf_of(0));
    for (int k = 0; k < 4; k++) {
        if (window.holds) {
            pick_row(&window, window.from + k * s->stride, tap);
            if (window.slanted) pick_row(&window, window.from + (k + 1) * s->stride, below);
            for (int i = 0; i < 4 && window.slanted; i++) tap[i] = vi_select(window.lower, below[i], tap[i]);
        } else {
            gather_row(s, ix, iy + (k - 1), tap);
        }
        vf3 line = vf3_add(vf3_add(vf3_scale(pixel_unpack(tap[0]), wx[0]), vf3_scale(pixel_unpack(tap[1]), wx[1])),
                           vf3_add(vf3_scale(pixel_unpack(tap[2]), wx[2]), vf3_scale(pixel_unpack(tap[3]), wx[3])));
        sum = vf3_add(sum, vf3_scale(line, wy[k]));
    }
    return (vf3){vf_clamp(sum.x, 0, 1023), vf_clamp(sum.y, 0, 1023), vf_clamp(sum.z, 0, 1023)};
}

/* A footprint of more than a pixel is covered by four taps, a quarter of it from its middle. */
static inline vf3 history_colour(const struct fv_reproject_tile *t, const struct source *s, const struct place *p)
{
    if (!(t->footprint * s->scale > 1.25f)) return t->sharp ? cubic(s, p->x, p->y) : bilinear(s, p->x, p->y);
    vf3 sum = {vf_of(0), vf_of(0), vf_of(0)};
    float step = 0.25f * t->footprint * s->scale;
    for (int i = 0; i < 4; i++)
        sum = vf3_add(sum, bilinear(s, p->x + (i & 1 ? step : -step), p->y + (i & 2 ? step : -step)));
    return vf3_scale(sum, vf_of(0.25f));
}

/* The support image's colour at pixel coordinates, bilinear. */
static inline vf3 support_colour(const struct fv_reproject_tile *t, vf px, vf py)
{
    vf x = vf_clamp((px - t->node[0]) * (1 / t->spacing), 0, (float)(t->nodes_x - 1));
    vf y = vf_clamp((py - t->node[1]) * (1 / t->spacing), 0, (float)(t->nodes_y - 1));
    vf x0 = vf_floor(x), y0 = vf_floor(y), fx = x - x0, fy = y - y0;
    vi ix = vi_from(x0), iy = vi_from(y0), stride = vi_of((int32_t)t->support_stride);
    vi at = iy * stride + ix, right = (ix < t->nodes_x - 1) & 1, down = (iy < t->nodes_y - 1) & stride;
    vf3 a = pixel_unpack(vi_gather(t->support_colour, at)), b = pixel_unpack(vi_gather(t->support_colour, at + right));
    vf3 c = pixel_unpack(vi_gather(t->support_colour, at + down));
    vf3 d = pixel_unpack(vi_gather(t->support_colour, at + down + right));
    vf3 upper = vf3_add(a, vf3_scale(vf3_sub(b, a), fx)), lower = vf3_add(c, vf3_scale(vf3_sub(d, c), fx));
    return vf3_add(upper, vf3_scale(vf3_sub(lower, upper), fy));
}

/* One vector of pixels, of a row of the tile. */
struct step {
    vf3 along;                 /* what the map makes of the pixel, at infinity */
    vf px, w, nearest, farthest;
    vi bent;
    float y;
    int64_t out;
};

/* The tile's first rows, by its middle's node. */
static void prefetch_first(const struct fv_reproject_tile *t, const struct source *s)
{
    float x = (float)t->x0, y = (float)t->y0, w = t->middle, to[3];
    for (int i = 0; i < 3; i++) to[i] = t->map.m[i][0] * x + t->map.m[i][1] * y + t->map.m[i][2] + t->map.t[i] * w;
    if (!(to[2] > 0.1f)) return;
    float column = to[0] / to[2], row = to[1] / to[2];
    if (!(column >= 0 && column < s->width && row >= 1 && row < (float)(s->last_row - PREFETCH_ROWS))) return;
    for (int r = -1; r <= PREFETCH_ROWS; r++) {
        int32_t at = ((int32_t)row + r) * s->stride + (int32_t)column;
        __builtin_prefetch(s->cache + at);
        __builtin_prefetch(s->colour + at);
        __builtin_prefetch(s->cache + at + 16);
        __builtin_prefetch(s->colour + at + 16);
    }
}

/* The rows below look a little further down in the history: on its way before they need it. */
static inline void prefetch_below(const struct source *s, vi index)
{
    const int32_t ahead = index[0] + PREFETCH_ROWS * s->stride;
    __builtin_prefetch(s->cache + ahead);
    __builtin_prefetch(s->cache + ahead + FV_WIDTH);
    __builtin_prefetch(s->colour + ahead);
    __builtin_prefetch(s->colour + ahead + FV_WIDTH);
}

/* Returns the bits of the pixels without history. */
static inline unsigned carry(const struct fv_reproject_tile *t, const struct source *s, const struct source *coarse,
                             const struct step *v)
{
    struct place best = look_up(t, s, v->along, v->w);
    vi edge = v->nearest - v->farthest > 4.0f * t->epsilon * v->nearest;
    if (vi_any(edge | ~best.good)) try_others(t, s, v->along, v->nearest, v->farthest, edge, &best);
    prefetch_below(s, best.index);
    vf3 colour = history_colour(t, s, &best);
    if (coarse && vi_any(~best.good)) {
        struct place other = look_up(t, coarse, v->along, v->w);
        try_others(t, coarse, v->along, v->nearest, v->farthest, edge, &other);
        other.good &= ~best.good;
        colour = vf3_select(other.good, history_colour(t, coarse, &other), colour);
        prefer(&best, &other);
    }
    vi filled = ~best.good;
    vf depth = vf_select(edge & best.good, history_surface(t, v->along, &best), best.w);
    vi kept = cache_older(best.cache);
    if (vi_any(filled)) {
        colour = vf3_select(filled, support_colour(t, v->px, vf_of(v->y)), colour);
        depth = vf_select(filled, vf_select(v->farthest < 0.0f, v->farthest, v->w), depth);
    }
    kept = vi_select(filled | v->bent, vi_of(255), kept);
    vi_store(t->raster->colour + v->out, pixel_pack(colour) | (filled & (int32_t)FV_PIXEL_FILLED));
    vi_store(t->raster->cache + v->out, cache_of_depth(depth) | kept);
    return vi_bits(filled);
}

/* Masks of a tile's blocks from those of its rows of pixels. */
struct blocks {
    int missing[FV_BLOCKS];
    uint32_t columns; /* pixels of a row that lie in the picture */
};

static void count_blocks(struct fv_reproject_tile *t, struct blocks *b, int y, uint32_t filled, uint32_t marked,
                         uint32_t bent)
{
    uint32_t inside = t->y0 + y < t->raster->height ? b->columns : 0;
    for (int i = 0; i * FV_BLOCK < t->side; i++) {
        uint64_t bit = 1ull << (y / FV_BLOCK * FV_BLOCKS + i);
        if (marked >> (FV_BLOCK * i) & 15) t->marked |= bit;
        if ((bent & inside) >> (FV_BLOCK * i) & 15) t->failed |= bit;
        b->missing[i] += __builtin_popcount((filled & inside) >> (FV_BLOCK * i) & 15);
        if (y % FV_BLOCK != FV_BLOCK - 1) continue;
        if (b->missing[i] >= FV_BLOCK) t->failed |= bit;
        b->missing[i] = 0;
    }
}

void reproject(struct fv_reproject_tile *t)
{
    const float(*m)[3] = t->map.m, across = 1 / t->spacing;
    struct source own = source_of(t->raster, 1), other, *coarse = NULL;
    struct nodes nodes;
    struct cells cells = {0};
    struct blocks blocks = {.columns = t->raster->width - t->x0 >= FV_TILE ? ~0u : (1u << (t->raster->width - t->x0)) - 1};
    int below = -1;
    if (t->coarse) other = source_of(t->coarse, t->raster->scale / t->coarse->scale), coarse = &other;
    t->failed = t->marked = 0;
    prefetch_first(t, &own);
    take_nodes(t, &nodes);
    for (int y = 0; y < t->side; y++) {
        struct step v = {.y = (float)(t->y0 + y) + 0.5f,
                         .out = (int64_t)(t->y0 + y) * t->raster->stride + t->x0};
        uint32_t filled = 0, marked = 0, bent = 0;
        float gy = ((float)y + 0.5f - t->node[1]) * across + 1;
        int j = (int)gy;
        if (j != below) take_cells(t, &nodes, below = j, &cells);
        for (int i = 0; i < NODES; i++) cells.w[i] = nodes.w[j][i] + (nodes.w[j + 1][i] - nodes.w[j][i]) * (gy - (float)j);
        for (int x = 0; x < t->side; x += FV_WIDTH) {
            vf column = (float)x + 0.5f + vf_from(vi_lanes()), gx = (column - t->node[0]) * across + 1.0f;
            vi i = vi_from(gx);
            vf left = table(cells.w, i), right = table(cells.w, i + 1);
            v.px = (float)t->x0 + column;
            v.along = (vf3){m[0][0] * v.px + (m[0][1] * v.y + m[0][2]), m[1][0] * v.px + (m[1][1] * v.y + m[1][2]),
                            m[2][0] * v.px + (m[2][1] * v.y + m[2][2])};
            v.w = left + (right - left) * (gx - vf_from(i));
            v.nearest = table(cells.nearest, i);
            v.farthest = table(cells.farthest, i);
            v.bent = cells.any_bent ? table_mask(cells.bent, i) : vi_of(0);
            filled |= carry(t, &own, coarse, &v) << x;
            marked |= vi_bits(table_mask(cells.marked, i)) << x;
            bent |= vi_bits(v.bent) << x;
            v.out += FV_WIDTH;
        }
        count_blocks(t, &blocks, y, filled, marked, bent);
    }
}
