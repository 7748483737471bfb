/* reproject_kernel: one tile, row by row, a vector of neighbouring pixels at a time.
 *
 * A pixel's inverse depth w is first guessed from the support nodes around it, interpolated (which
 * is exact on planes, since w is linear in the picture). The guess is good where the history at the
 * place it maps to has the depth that it predicts. Where nodes disagree or the guess fails, the
 * nearest and the farthest node and the surface that the history itself shows are tried too, and the
 * nearest one that holds wins: what is in front stays in front.
 *
 * Where nodes show moving objects, that is done once for each of them and once for what stands still, each
 * with its own nodes and map, and finds only history of its own kind (FV_CACHE_MOVING): nothing drags what it
 * covered along, and nothing stays behind. */
#include "rt/pass/reproject_history.h"
#include "rt/pass/reproject_light.h"
#include "rt/pass/reproject_nodes.h"

#define reproject FV_ISA_NAME(fv_reproject)
void reproject(struct fv_reproject_tile *tile);

enum { PREFETCH_ROWS = 6 };

static inline vf table(const float t[NODES], vi index)
{
    return (vf)vi_table16((const uint32_t *)t, index);
}

static inline vi table_mask(const int32_t t[NODES], vi index)
{
    return vi_table16((const uint32_t *)t, index);
}

/* The colour at pixel coordinates of one of the support image's planes, bilinear. */
static inline vf3 support_colour(const struct fv_reproject_tile *t, const uint32_t *colour, vf px, vf py)
{
    vf x = vf_clamp((px - t->node[0]) * (1 / t->spacing), 0, (float)(t->nodes_x - 1));
    vf y = vf_clamp((py - t->node[1]) * (1 / t->spacing), 0, (float)(t->nodes_y - 1));
    vf x0 = vf_floor(x), y0 = vf_floor(y), fx = x - x0, fy = y - y0;
    vi ix = vi_from(x0), iy = vi_from(y0), stride = vi_of((int32_t)t->support_stride);
    vi at = iy * stride + ix, right = (ix < t->nodes_x - 1) & 1, down = (iy < t->nodes_y - 1) & stride;
    vf3 a = pixel_unpack(vi_gather(colour, at)), b = pixel_unpack(vi_gather(colour, at + right));
    vf3 c = pixel_unpack(vi_gather(colour, at + down)), d = pixel_unpack(vi_gather(colour, at + down + right));
    vf3 upper = vf3_add(a, vf3_scale(vf3_sub(b, a), fx)), lower = vf3_add(c, vf3_scale(vf3_sub(d, c), fx));
    return vf3_add(upper, vf3_scale(vf3_sub(lower, upper), fy));
}

/* Marks the nodes that stand still but whose light has changed since, by the shadow of what moves: they are
 * outside what the 3 x 3 pixels of history around their place span. */
static void mark_changed(const struct fv_reproject_tile *t, const struct source *s, struct nodes *n)
{
    const float(*m)[3] = t->map.m, step = 0.15f; /* of full scale */
    for (int y = 0; y < n->along; y++)
        for (int x = 0; x < n->along; x += FV_WIDTH) {
            vf px = (float)t->x0 + t->node[0] + (vf_from(vi_lanes() + x) - 1.0f) * t->spacing;
            float py = (float)t->y0 + t->node[1] + (float)(y - 1) * t->spacing;
            vf3 along = {m[0][0] * px + (m[0][1] * py + m[0][2]), m[1][0] * px + (m[1][1] * py + m[1][2]),
                         m[2][0] * px + (m[2][1] * py + m[2][2])};
            struct place p = look_up(s, along, vf_load(n->w[y] + x));
            vf low = vf_of(1), high = vf_of(0), now = vf_load(n->luminance[y] + x);
            for (int k = 0; k < 9; k++) {
                vi column = vi_from(vf_clamp(p.x + (float)(k % 3 - 1), 0, s->width - 1.0f));
                vi row = vi_from(vf_clamp(p.y + (float)(k / 3 - 1), 0, s->height - 1.0f));
                vf there = luminance(shown(t, s->colour, t->raster->plane, row * s->stride + column));
                low = vf_min(low, there);
                high = vf_max(high, there);
            }
            vi surface = vi_load(n->surface[y] + x);
            vi changed = p.good & ((now < low - step) | (now > high + step)) & ((surface & FV_SURFACE_OBJECT) == 0);
            vi_store(n->surface[y] + x, surface | (changed & FV_SURFACE_VIEW));
        }
}

/* One vector of pixels, of a row of the tile, as the nodes of all or of one object tell it. */
struct step {
    vf3 along;                 /* what the map makes of the pixel, at infinity */
    vi cell;                   /* the pixel's, of the row of cells */
    vf px, w, nearest, farthest;
    vi here, mixed;            /* masks: nodes of it are around; others are as well */
    vi bent, moving;
    float y;
    int64_t out;
};

/* The tile's first rows, by its middle's node. */
static void prefetch_first(const struct fv_reproject_tile *t, const struct source *s)
{
    float to[3];
    fv_map_point(&t->map, (float)t->x0, (float)t->y0, t->middle, to);
    if (!(to[2] > 0.1f)) return;
    float column = to[0] / to[2], row = to[1] / to[2];
    if (!(column >= 0 && column < s->width && row >= 1 && row < (float)(s->last_row - PREFETCH_ROWS))) return;
    for (int r = -1; r <= PREFETCH_ROWS; r++) {
        int32_t at = ((int32_t)row + r) * s->stride + (int32_t)column;
        __builtin_prefetch(s->cache + at);
        __builtin_prefetch(s->colour + at);
        __builtin_prefetch(s->cache + at + 16);
        __builtin_prefetch(s->colour + at + 16);
        __builtin_prefetch(s->cache + at + 32);
        __builtin_prefetch(s->colour + at + 32);
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

/* The raster's own row from there on, before it is written. */
static inline void prefetch_out(const struct fv_reproject_tile *t, int64_t row)
{
    fv_fetch(t->raster->colour + row, t->side * (int)sizeof *t->raster->colour);
    fv_fetch(t->raster->cache + row, t->side * (int)sizeof *t->raster->cache);
}

/* Further guesses of the lanes that are at an edge or where the first one failed. */
static __attribute__((noinline)) void try_others(const struct source *s, const struct step *v, vi edge,
                                                 struct place *best)
{
    vf3 along = v->along;
    vf nearest = v->nearest, farthest = v->farthest;
    struct place shown = look_up(s, along, history_surface(s, along, best));
    struct place front = look_up(s, along, nearest), back = look_up(s, along, vf_max(farthest, vf_of(0)));
    struct place front_shown = look_up(s, along, history_surface(s, along, &front));
    shown.good &= edge | ~best->good;
    front.good &= edge;
    front_shown.good &= edge;
    back.good &= edge & (farthest >= 0.0f);
    prefer(best, &shown);
    prefer(best, &front);
    prefer(best, &front_shown);
    prefer(best, &back);
}

/* The best guess; where it holds, w is the depth that it has here. */
static inline struct place find(const struct fv_reproject_tile *t, const struct source *s, const struct step *v)
{
    struct place best = look_up(s, v->along, v->w);
    vi edge = (v->nearest - v->farthest > 4.0f * t->epsilon * v->nearest) | v->mixed;
    if (vi_any(edge | ~best.good)) try_others(s, v, edge, &best);
    best.good &= v->here;
    best.w = vf_select((edge | vi_of(-(int32_t)t->still)) & best.good, history_surface(s, v->along, &best), best.w);
    return best;
}

/* What was found, or the support image, into the raster; returns the bits of the pixels without history, or whose
 * history was never sampled. */
static inline unsigned finish(const struct fv_reproject_tile *t, const struct step *v, const struct place *best,
                              vf3 colour)
{
    vi filled = ~best->good;
    vf depth = best->w;
    vi kept = cache_older(best->cache);
    if (vi_any(filled)) {
        colour = vf3_select(filled, support_colour(t, t->support_colour, v->px, vf_of(v->y)), colour);
        depth = vf_select(filled, vf_select(v->farthest < 0.0f, v->farthest, v->w), depth);
    }
    vi missing = filled | (cache_rho(best->cache) == 0);
    vi none = FV_CACHE_OLDEST | (vi_select(filled, v->moving, kept) & FV_CACHE_MOVING);
    kept = vi_select(filled | v->bent, none, kept);
    vi_store(t->raster->colour + v->out, pixel_pack(colour) | (filled & (int32_t)FV_PIXEL_FILLED));
    vi_store(t->raster->cache + v->out, cache_of_depth(depth) | kept);
    return vi_bits(missing);
}

/* Apart, since these are few: pixels that come from the coarse raster, and those among moving objects. */
static __attribute__((noinline)) void other_colour(const struct fv_reproject_tile *t, const struct source *s,
                                                   const struct place *p, vf3 *colour)
{
    *colour = history_colour(t, s, p);
}

/* The light beside them, from the same places or the support image. */
static __attribute__((noinline)) void finish_apart(const struct fv_reproject_tile *t, const struct step *v, vi filled,
                                                   const struct apart *apart)
{
    vf3 colour[FV_PLANES] = {apart->albedo, apart->albedo, apart->light};
    for (int p = FV_PLANE_ALBEDO; p < FV_PLANES; p++) {
        const uint32_t *support = t->support_colour + p * t->support_plane;
        vi kept = ~filled & apart->count[p];
        if (vi_any(filled)) colour[p] = vf3_select(filled, support_colour(t, support, v->px, vf_of(v->y)), colour[p]);
        vi_store(t->raster->colour + p * t->raster->plane + v->out, pixel_pack(colour[p]) | kept);
    }
}

/* A coarser raster's places, where nothing is good yet. Only where the denser one holds no history: elsewhere it is
 * known better that this shows something else, and the coarser pixel a mixture of both. What it shows is blurred: it
 * counts as one sample at most, taken long ago. */
static __attribute__((noinline)) void take_over(const struct fv_reproject_tile *t, const struct source *coarse, int64_t plane,
                                                struct place *other, struct place *best, vf3 *colour, struct apart *apart)
{
    other->good &= ~best->good;
    if (!vi_any(other->good)) return;
    vf3 there;
    other_colour(t, coarse, other, &there);
    *colour = vf3_select(other->good, there, *colour);
    if (apart_in(t)) take_apart_over(t, coarse, plane, *other, apart);
    other->cache = (other->cache & ~0xff7f) | FV_CACHE_OLDEST | ((cache_rho(other->cache) > 0) & (1 << 8));
    prefer(best, other);
}

/* `s`: the raster's own history, and the coarser ones behind it. */
static inline unsigned carry(const struct fv_reproject_tile *t, const struct source *s, struct step *v)
{
    struct place best = find(t, s, v);
    prefetch_below(s, best.index);
    vf3 colour = history_colour(t, s, &best);
    struct apart apart;
    if (apart_in(t)) take_apart(t, s, t->raster->plane, best, &apart);
    vi absent = ~best.good & cache_none(best.cache);
    for (int c = 0; c < t->coarsers && vi_any(absent & ~best.good); c++) {
        const struct source *coarse = s + 1 + c;
        struct place other = find(t, coarse, v);
        vi none = cache_none(other.cache);
        other.good &= absent;
        absent &= none | other.good;
        take_over(t, coarse, t->coarser[c]->plane, &other, &best, &colour, &apart);
    }
    unsigned missing = finish(t, v, &best, colour);
    if (apart_in(t)) finish_apart(t, v, ~best.good, &apart);
    if (t->moves) v->bent |= ~best.good & ((best.cache & FV_CACHE_MOVING) != 0); /* just uncovered */
    return missing;
}

/* What the nodes tell of a row's pixels x to x + FV_WIDTH. */
static inline void take_step(const struct fv_reproject_tile *t, const struct fv_map *map, const struct cells *cells,
                             int x, struct step *v)
{
    const float(*m)[3] = map->m;
    vf column = (float)x + 0.5f + vf_from(vi_lanes()), gx = (column - t->node[0]) * (1 / t->spacing) + 1.0f;
    vi i = v->cell = vi_from(gx);
    vf left = table(cells->w, i), right = table(cells->w, i + 1);
    v->px = (float)t->x0 + column;
    v->along = (vf3){m[0][0] * v->px + (m[0][1] * v->y + m[0][2]), m[1][0] * v->px + (m[1][1] * v->y + m[1][2]),
                     m[2][0] * v->px + (m[2][1] * v->y + m[2][2])};
    v->w = left + (right - left) * (gx - vf_from(i));
    v->nearest = table(cells->nearest, i);
    v->farthest = table(cells->farthest, i);
    v->bent = cells->any_bent ? table_mask(cells->bent, i) : vi_of(0);
    v->moving = v->mixed = vi_of(0);
    v->here = vi_of(-1);
}

/* A moving object, or what stands still beside it. */
struct layer {
    const struct fv_map *map;
    struct source source[FV_DENSITIES]; /* the raster's own history, and the coarser ones */
    struct nodes nodes;
    struct cells cells;
};

static int take_layers(const struct fv_reproject_tile *t, const struct nodes *nodes,
                       const struct source source[FV_DENSITIES], struct layer layer[FV_TILE_OBJECTS + 1])
{
    for (int l = 0; l <= t->objects; l++) {
        layer[l].map = l ? &t->object_map[l - 1] : &t->map;
        for (int i = 0; i <= t->coarsers; i++) {
            layer[l].source[i] = source[i];
            layer[l].source[i].map = layer[l].map;
            layer[l].source[i].moving = l ? FV_CACHE_MOVING : 0;
        }
        take_layer(nodes, l ? t->object[l - 1] : 0, &layer[l].nodes);
    }
    return t->objects + 1;
}

/* The nearest of what the layers find. `all`: the step as all nodes tell it. */
static __attribute__((noinline)) unsigned carry_layers(const struct fv_reproject_tile *t, const struct layer *layer,
                                                       int layers, const struct source *s, const struct cells *cells,
                                                       int x, struct step *all)
{
    struct place found[FV_DENSITIES] = {{.good = vi_of(0)}}, best;
    struct step v = {.y = all->y};
    for (int l = 0; l < layers; l++) {
        take_step(t, layer[l].map, &layer[l].cells, x, &v);
        v.mixed = table_mask(cells->mixed, all->cell);
        v.here = v.farthest >= 0.0f;
        if (!vi_any(v.here)) continue;
        vi absent = vi_of(-1);
        for (int i = 0; i <= t->coarsers && vi_any(absent); i++) {
            struct place p = find(t, &layer[l].source[i], &v);
            p.good &= absent;
            absent &= ~p.good & cache_none(p.cache);
            prefer(&found[i], &p);
        }
    }
    vf3 colour;
    struct apart apart;
    best = found[0];
    other_colour(t, s, &best, &colour);
    if (apart_in(t)) take_apart(t, s, t->raster->plane, best, &apart);
    vi outline = t->stirs ? at_outline(s, &best, 1) : vi_of(0);
    for (int c = 0; c < t->coarsers; c++) {
        take_over(t, s + 1 + c, t->coarser[c]->plane, &found[1 + c], &best, &colour, &apart);
        if (t->stirs && vi_any(found[1 + c].good)) outline |= at_outline(s + 1 + c, &found[1 + c], 1);
    }
    all->moving = table_mask(cells->moving, all->cell);
    unsigned missing = finish(t, all, &best, colour);
    if (apart_in(t)) finish_apart(t, all, ~best.good, &apart);
    /* Nothing is left to chance along outlines: one that moves by less than a pixel a frame would stand. */
    if (t->stirs) all->bent |= ~best.good | outline;
    return missing;
}

/* Of a row of blocks, collected from its rows of pixels. */
struct blocks {
    int missing[FV_BLOCKS];
    uint32_t marked, bent, any_missing; /* of all its rows together */
    uint32_t columns;                   /* pixels of a row that lie in the picture */
    int rows;                           /* rows that do */
};

static void count_row(const struct fv_reproject_tile *t, struct blocks *b, int y, uint32_t missing, uint32_t marked,
                      uint32_t bent)
{
    bool inside = t->y0 + y < t->raster->height;
    b->marked |= marked;
    if (!inside) return;
    missing &= b->columns;
    b->rows++;
    b->bent |= bent & b->columns;
    b->any_missing |= missing;
    for (int i = 0; missing; i++, missing >>= FV_BLOCK) b->missing[i] += __builtin_popcount(missing & 15);
}

/* A block fails where a quarter of its pixels inside the picture are missing. */
static void count_blocks(struct fv_reproject_tile *t, struct blocks *b, int row)
{
    for (int i = 0; i * FV_BLOCK < t->side && (b->marked | b->bent | b->any_missing); i++) {
        uint64_t bit = 1ull << (row * FV_BLOCKS + i);
        int inside = b->rows * __builtin_popcount(b->columns >> (FV_BLOCK * i) & 15);
        if (b->marked >> (FV_BLOCK * i) & 15) t->marked |= bit;
        if (b->bent >> (FV_BLOCK * i) & 15) t->failed |= bit;
        if (b->missing[i] > 0 && 4 * b->missing[i] >= inside) t->failed |= bit;
    }
    *b = (struct blocks){.columns = b->columns};
}

void reproject(struct fv_reproject_tile *t)
{
    struct source source[FV_DENSITIES] = {source_of(t->raster, &t->map, 1, t->epsilon, t->still)};
    struct nodes nodes;
    struct cells cells = {0};
    struct blocks blocks = {.columns = t->raster->width - t->x0 >= FV_TILE ? ~0u : (1u << (t->raster->width - t->x0)) - 1};
    struct layer layer[FV_TILE_OBJECTS + 1];
    struct step v;
    int below = -1, layers = 0;
    for (int c = 0; c < t->coarsers; c++)
        source[1 + c] = source_of(t->coarser[c], &t->map, t->raster->scale / t->coarser[c]->scale, t->epsilon, t->still);
    t->failed = t->marked = 0;
    prefetch_first(t, source);
    take_nodes(t, &nodes);
    if (apart_in(t)) light_nodes(t, &nodes);
    if (t->moves) mark_changed(t, source, &nodes);
    if (t->objects) layers = take_layers(t, &nodes, source, layer);
    for (int y = 0; y < t->side; y++) {
        v.y = (float)(t->y0 + y) + 0.5f;
        v.out = (int64_t)(t->y0 + y) * t->raster->stride + t->x0;
        uint32_t missing = 0, marked = 0, bent = 0;
        if (y + PREFETCH_ROWS < t->side) prefetch_out(t, v.out + PREFETCH_ROWS * t->raster->stride);
        float gy = ((float)y + 0.5f - t->node[1]) * (1 / t->spacing) + 1;
        int j = (int)gy;
        if (j != below) take_cells(t, &nodes, j, &cells);
        take_row(&nodes, j, gy - (float)j, &cells);
        for (int l = 0; l < layers; l++) {
            if (j != below) take_cells(t, &layer[l].nodes, j, &layer[l].cells);
            take_row(&layer[l].nodes, j, gy - (float)j, &layer[l].cells);
        }
        below = j;
        for (int x = 0; x < t->side; x += FV_WIDTH) {
            take_step(t, &t->map, &cells, x, &v);
            missing |= (layers ? carry_layers(t, layer, layers, source, &cells, x, &v) : carry(t, source, &v)) << x;
            marked |= vi_bits(table_mask(cells.marked, v.cell)) << x;
            bent |= vi_bits(v.bent) << x;
            v.out += FV_WIDTH;
        }
        count_row(t, &blocks, y, missing, marked, bent);
        if (y % FV_BLOCK == FV_BLOCK - 1) count_blocks(t, &blocks, y / FV_BLOCK);
    }
}
