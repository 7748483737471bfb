/* visibility: see visibility.h. visibility_kernel.c traces the nodes. */
#include "rt/trace/visibility.h"

#include "platform/arena.h"
#include "platform/clock.h"
#include "platform/log.h"
#include "rt/trace/tracer.h"

#include <assert.h>
#include <math.h>
#include <string.h>

static bool moves(const struct fv_scene *s, int light)
{
    for (int i = 0; i < s->objects; i++)
        if (s->object[i].light == light) return true;
    return false;
}

static double diagonal(const struct fv_scene *s)
{
    double square = 0;
    for (int c = 0; c < 3; c++) square += pow((double)s->bounds[1][c] - (double)s->bounds[0][c], 2);
    return sqrt(square);
}

bool fv_light_mappable(const struct fv_scene *s, int light)
{
    const struct fv_light *l = &s->light[light];
    double away = 0;
    if (s->still_triangles == 0 || s->fields.parts > 0 || moves(s, light)) return false;
    for (int c = 0; c < 3; c++)
        away += pow((double)l->position[c] - 0.5 * ((double)s->bounds[0][c] + (double)s->bounds[1][c]), 2);
    return l->kind == FV_LIGHT_SUN || (l->kind == FV_LIGHT_POINT && sqrt(away) <= 2 * diagonal(s));
}

static int faces_of(const struct fv_light *light)
{
    return light->kind == FV_LIGHT_SUN ? 1 : FV_CUBE_FACES;
}

/* Nodes are loaded in pairs: one behind the last. */
static int64_t nodes_of(int faces, int side)
{
    return (int64_t)faces * (side + 1) * (side + 1) + 1;
}

int64_t fv_visibility_bytes(const struct fv_scene *s, int side)
{
    int64_t bytes = 0;
    for (int i = 0; i < s->lights; i++)
        if (fv_light_mappable(s, i)) bytes += (int64_t)sizeof(float) * nodes_of(faces_of(&s->light[i]), side);
    return bytes;
}

struct fv_visibility *fv_visibility_take(const struct fv_scene *s)
{
    bool any = false;
    for (int i = 0; i < s->lights; i++) any |= fv_light_mappable(s, i);
    size_t bytes = sizeof(struct fv_visibility) + (size_t)s->lights * sizeof(struct fv_light_map);
    return any ? fv_arena_take(fv_arena(), "light maps", bytes, 64) : NULL;
}

/* Rays begin beyond what shadow rays leave out at the light, 1e-5 of their way, where that comes from the
 * scene's far end; and beyond the rounding of the light's own place, which may lie on a surface. */
static void place_point(struct fv_light_map *m, const struct fv_scene *s)
{
    double reach = 0;
    for (int c = 0; c < 3; c++) reach = fmax(reach, fabs((double)m->at[c]));
    for (int i = 0; i < 2; i++) m->corner[i] = -1, m->texel[i] = 2 / (float)m->side;
    m->begin = (float)fmax(fmax(1e-5 * diagonal(s), 4e-6 * reach), 1e-12);
}

/* Two unit vectors across unit n and each other. */
static void basis(const float n[3], double across[3], double along[3])
{
    int least = 0;
    double square = 0;
    for (int c = 1; c < 3; c++)
        if (fabsf(n[c]) < fabsf(n[least])) least = c;
    int next = (least + 1) % 3, last = (least + 2) % 3;
    across[least] = 0, across[next] = -(double)n[last], across[last] = (double)n[next];
    for (int c = 0; c < 3; c++) square += across[c] * across[c];
    for (int c = 0; c < 3; c++) across[c] /= sqrt(square);
    for (int c = 0; c < 3; c++) {
        int b = (c + 1) % 3, d = (c + 2) % 3;
        along[c] = (double)n[b] * across[d] - (double)n[d] * across[b];
    }
}

/* Least and greatest place of the bounds along an axis. */
static void range(const struct fv_scene *s, const double axis[3], double out[2])
{
    out[0] = out[1] = 0;
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < 2; i++) out[i] += axis[c] * (double)s->bounds[axis[c] < 0 ? 1 - i : i][c];
}

/* A little wider than the bounds, so that their own rounding does not lie outside. */
static void place_sun(struct fv_light_map *m, const struct fv_scene *s)
{
    double axis[3][3], ends[2], reach = 0;
    for (int c = 0; c < 3; c++) axis[2][c] = (double)m->at[c];
    for (int c = 0; c < 6; c++) reach = fmax(reach, fabs((double)s->bounds[c / 3][c % 3]));
    double margin = fmax(1e-3 * diagonal(s), fmax(1e-5 * reach, 1e-12));
    basis(m->at, axis[0], axis[1]);
    for (int c = 0; c < 3; c++) m->across[c] = (float)axis[0][c], m->along[c] = (float)axis[1][c];
    for (int i = 0; i < 3; i++) {
        range(s, axis[i], ends);
        if (i == 2) {
            m->begin = (float)(ends[1] + margin);
            continue;
        }
        m->corner[i] = (float)(ends[0] - margin);
        m->texel[i] = (float)((ends[1] - ends[0] + 2 * margin) / m->side);
    }
}

/* A block is too coarse where more than one in so many nodes stands out. */
enum { BLOCK = 32, BLOCKS_MAX = FV_MAP_SIDE_MAX / BLOCK, SHARE = 10 };

/* A face under way. */
struct making {
    const struct fv_tracer *tracer;
    const struct fv_light_map *map;
    fv_map_row *row;
    float *nearness;
    int face, blocks; /* a side */
    uint8_t coarse[BLOCKS_MAX][BLOCKS_MAX];
};

/* Of a row or column of nodes: the last one lies in the block before it. */
static int block_of(const struct making *m, int node)
{
    return node < m->map->side ? node / BLOCK : m->blocks - 1;
}

/* The face's row of nodes. */
static float *row_of(const struct making *m, int row)
{
    int64_t nodes = m->map->side + 1;
    return m->nearness + nodes * (nodes * m->face + row);
}

static void make_row(void *context, int tile, int worker)
{
    struct making *m = context;
    (void)worker;
    m->row(m->tracer, m->map, m->face, tile, row_of(m, tile));
}

/* Whether a node is nearer to the light than both of its neighbours, or farther, by more than two texels'
 * widths, `wide` of a sun in m, of a point at z = 1: there a width at nearness n is n * wide. */
static bool stands_out(bool sun, float wide, float at, float before, float after)
{
    float high = before > after ? before : after, low = before < after ? before : after;
    return at > high + 2 * wide * (sun ? 1 : at) || at < low - 2 * wide * (sun ? 1 : low);
}

static void judge_blocks(void *context, int tile, int worker)
{
    struct making *m = context;
    int side = m->map->side, first = tile * BLOCK, last = tile + 1 < m->blocks ? first + BLOCK - 1 : side;
    int thin[BLOCKS_MAX] = {0}, nodes[BLOCKS_MAX] = {0};
    bool sun = m->map->faces == 1;
    float wide = fmaxf(m->map->texel[0], m->map->texel[1]);
    (void)worker;
    for (int y = first; y <= last; y++) {
        const float *n = row_of(m, y), *above = n - (y > 0 ? side + 1 : 0), *below = n + (y < side ? side + 1 : 0);
        for (int x = 0; x <= side; x++) {
            bool out = x > 0 && x < side && stands_out(sun, wide, n[x], n[x - 1], n[x + 1]);
            thin[block_of(m, x)] += out || stands_out(sun, wide, n[x], above[x], below[x]);
            nodes[block_of(m, x)]++;
        }
    }
    for (int b = 0; b < m->blocks; b++) m->coarse[tile][b] = thin[b] * SHARE > nodes[b];
}

/* A loop of its own: others still read what it writes to. */
static void mark_row(void *context, int tile, int worker)
{
    const struct making *m = context;
    uint32_t *word = (uint32_t *)row_of(m, tile);
    const uint8_t *coarse = m->coarse[block_of(m, tile)];
    (void)worker;
    for (int x = 0; x <= m->map->side; x++)
        word[x] = (word[x] & ~(uint32_t)FV_NODE_COARSE) | (coarse[block_of(m, x)] ? FV_NODE_COARSE : 0);
}

/* Returns how many of its blocks are too coarse. */
static int make_face(struct making *m, struct fv_workers *workers)
{
    int coarse = 0;
    fv_workers_run(workers, m->map->side + 1, make_row, m);
    fv_workers_run(workers, m->blocks, judge_blocks, m);
    fv_workers_run(workers, m->map->side + 1, mark_row, m);
    for (int i = 0; i < m->blocks; i++)
        for (int k = 0; k < m->blocks; k++) coarse += m->coarse[i][k];
    return coarse;
}

static void make_map(const struct fv_tracer *t, int light, int side, fv_map_row *row,
                     struct fv_workers *workers)
{
    const struct fv_light *l = &t->data->light[light];
    struct fv_light_map *m = &t->visibility->map[light];
    *m = (struct fv_light_map){.side = side, .faces = faces_of(l)};
    memcpy(m->at, l->position, sizeof m->at);
    if (l->kind == FV_LIGHT_SUN) place_sun(m, t->data);
    else place_point(m, t->data);
    struct making making = {.tracer = t, .map = m, .row = row, .blocks = (side - 1) / BLOCK + 1};
    int coarse = 0;
    making.nearness =
        fv_arena_take(fv_arena(), "light maps", (size_t)nodes_of(m->faces, side) * sizeof(float), 64);
    for (; making.face < m->faces; making.face++) {
        fv_log_progress("map of light %d of %d, face %d of %d", light + 1, t->data->lights, making.face + 1,
                        m->faces);
        coarse += make_face(&making, workers);
    }
    m->coarse = (float)coarse / (float)(m->faces * making.blocks * making.blocks);
    m->nearness = making.nearness;
}

void fv_visibility_make(const struct fv_tracer *t, int side, fv_map_row *row, struct fv_workers *workers)
{
    struct fv_visibility *v = t->visibility;
    int64_t start_ns = fv_clock_now_ns(&fv_clock_monotonic);
    float coarse = 0;
    if (!v || v->side == side) return;
    assert(side > 0 && side <= FV_MAP_SIDE_MAX);
    v->side = side;
    for (int i = 0; i < t->data->lights; i++) {
        if (!fv_light_mappable(t->data, i)) continue;
        make_map(t, i, side, row, workers);
        coarse = fmaxf(coarse, v->map[i].coarse);
    }
    fv_log("light maps of %d texels a side: %.1f MB, made in %.2f s, at most %.1f %% of one too coarse", side,
           (double)fv_visibility_bytes(t->data, side) * 0x1p-20,
           (double)(fv_clock_now_ns(&fv_clock_monotonic) - start_ns) * 1e-9, 100 * (double)coarse);
}
