/* reproject_nodes: the support G-buffer's nodes in and around one tile, and the cells between them, as the
 * reprojection kernel interpolates them; and the same of one moving object alone. For kernels only. */
#ifndef FV_PASS_REPROJECT_NODES_H
#define FV_PASS_REPROJECT_NODES_H

#include "rt/pass/reproject.h"
#include "rt/trace/simd.h"

enum {
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
    _Alignas(64) int32_t mixed[NODES];                  /* mask: not all nodes are of one object */
    _Alignas(64) int32_t moving[NODES];                 /* mask: some node is of a moving one */
    _Alignas(64) float w[NODES];                        /* at the row of pixels */
    bool any_bent;
};

/* One before a tile's first, that of its first pixel. */
static inline int first_node(int pixel, float spacing)
{
    return (int)((float)pixel / spacing + 0.5f) - 1;
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
    int x0 = first_node(t->x0, t->spacing), y0 = first_node(t->y0, t->spacing);
    nodes->along = inside + 2;
    for (int y = 0; y < nodes->along; y++) {
        int64_t row = fv_clamp(y0 + y, t->nodes_y) * t->support_stride;
        for (int x = 0; x < nodes->along; x++) {
            int64_t at = row + fv_clamp(x0 + x, t->nodes_x);
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
        const int32_t *s = n->surface[j] + i, *u = n->surface[j + 1] + i;
        float high = larger(larger(a[0], a[1]), larger(b[0], b[1]));
        float low = smaller(smaller(a[0], a[1]), smaller(b[0], b[1]));
        float bright = larger(larger(c[0], c[1]), larger(d[0], d[1]));
        float dark = smaller(smaller(c[0], c[1]), smaller(d[0], d[1]));
        int surface = s[0] | s[1] | u[0] | u[1], differ = (s[0] ^ s[1]) | (s[0] ^ u[0]) | (s[0] ^ u[1]);
        bool bent = (surface & FV_SURFACE_VIEW) && !t->still;
        cells->nearest[i] = high;
        cells->farthest[i] = low;
        cells->mixed[i] = -((differ & FV_SURFACE_OBJECT) != 0);
        cells->moving[i] = -((surface & FV_SURFACE_OBJECT) != 0);
        cells->marked[i] = cells->mixed[i] | -(high - low > 4.0f * t->epsilon * high || bright - dark > t->epsilon_luminance ||
                                               (surface & FV_SURFACE_GRAZING));
        cells->bent[i] = -bent;
        cells->any_bent |= bent;
    }
}

/* Inverse depths of the nodes along a row of pixels, which lies `down` of a cell below node row j. */
static inline void take_row(const struct nodes *n, int j, float down, struct cells *cells)
{
    for (int i = 0; i < NODES; i++) cells->w[i] = n->w[j][i] + (n->w[j + 1][i] - n->w[j][i]) * down;
}

/* The mean inverse depth of the known nodes next to one, FV_DEPTH_UNKNOWN where there is none. */
static float mean_around(const struct nodes *n, int x, int y)
{
    float sum = 0, count = 0;
    for (int j = y > 0 ? y - 1 : 0; j <= y + 1 && j < n->along; j++)
        for (int i = x > 0 ? x - 1 : 0; i <= x + 1 && i < n->along; i++)
            if (n->known[j][i] >= 0) sum += n->known[j][i], count++;
    return count > 0 ? sum / count : FV_DEPTH_UNKNOWN;
}

/* The nodes as if one object alone were seen: where another is, the depth of its own nodes around goes on for
 * two nodes more, since its outline may pass anywhere between. */
static void take_layer(const struct nodes *all, int object, struct nodes *layer)
{
    *layer = *all;
    for (int y = 0; y < all->along; y++)
        for (int x = 0; x < all->along; x++)
            if ((all->surface[y][x] & FV_SURFACE_OBJECT) != object) layer->known[y][x] = FV_DEPTH_UNKNOWN;
    for (int step = 0; step < 2; step++) {
        struct nodes before = *layer;
        for (int y = 0; y < all->along; y++)
            for (int x = 0; x < all->along; x++)
                if (before.known[y][x] < 0) layer->known[y][x] = mean_around(&before, x, y);
    }
    for (int y = 0; y < all->along; y++)
        for (int x = 0; x < all->along; x++) layer->w[y][x] = larger(layer->known[y][x], 0);
}

#endif
