/* builtin_pipes_bundle: pipes side by side on one way, and their racks; see builtin_pipes.h.
 *
 * A bundle's cross-section is a raster of equal squares, a pipe in each. Its two axes turn with the bends,
 * so that pipes lie around each other there and never cross. */
#include "rt/scene/builtin_pipes.h"

#include "rt/scene/builtin_random.h"

#include <math.h>
#include <stdlib.h>

/* Kinds of bundles at detail 1: columns x rows of pipes, and how often each comes. */
static const struct kind {
    int columns, rows, weight;
} kinds[] = {{1, 1, 7}, {2, 1, 5}, {2, 2, 5}, {3, 1, 5}, {3, 2, 4},
             {5, 1, 2}, {3, 3, 2}, {5, 2, 1}, {4, 4, 1}};
enum { KINDS = sizeof kinds / sizeof kinds[0], PALETTE = 3 };

struct bundle {
    int pipes, columns, rows;
    float pitch;
    vec3s direction[FV_PIPES_LEGS_MAX], u[FV_PIPES_LEGS_MAX], v[FV_PIPES_LEGS_MAX];
};

static const struct kind *pick_kind(uint32_t *random)
{
    int weights = 0;
    for (int i = 0; i < KINDS; i++) weights += kinds[i].weight;
    int n = fv_random_below(random, weights), i = 0;
    while (n >= kinds[i].weight) n -= kinds[i++].weight;
    return &kinds[i];
}

/* The raster that holds so many pipes in the kind's proportions. */
static void lay_raster(struct bundle *b, const struct kind *kind, float detail, uint32_t *random)
{
    float wanted = (float)(kind->columns * kind->rows) * detail + fv_random_between(random, 0, 1);
    b->pipes = (int)wanted;
    if (b->pipes == 0) return;
    float stretch = sqrtf((float)b->pipes / (float)(kind->columns * kind->rows));
    b->columns = (int)ceilf((float)kind->columns * stretch - 1e-4f);
    b->rows = (b->pipes + b->columns - 1) / b->columns;
    b->pitch = 2 * FV_PIPES_PIPE_MAX /
               (float)(b->columns > 1 || b->rows > 1 ? (b->columns > b->rows ? b->columns : b->rows) : 1);
}

/* The raster's axes on each leg: columns lie level on a horizontal first one. */
static void turn_axes(struct bundle *b, const struct fv_pipes_route *route)
{
    for (int i = 0; i < route->legs; i++)
        b->direction[i] = glms_vec3_normalize(
            glms_vec3_sub(fv_pipes_middle(route->corner[i + 1]), fv_pipes_middle(route->corner[i])));
    vec3s first = b->direction[0];
    b->v[0] = fabsf(first.y) > 0.5f ? fv_vec(1, 0, 0) : fv_vec(0, 1, 0);
    b->u[0] = glms_vec3_cross(b->v[0], first);
    for (int i = 1; i < route->legs; i++) {
        vec3s from = b->direction[i - 1], to = b->direction[i];
        b->u[i] = glms_vec3_sub(b->u[i - 1],
                                glms_vec3_scale(glms_vec3_add(to, from), glms_vec3_dot(b->u[i - 1], to)));
        b->v[i] = glms_vec3_cross(to, b->u[i]);
    }
}

static vec3s offset_on(const struct bundle *b, int leg, float s, float t)
{
    return glms_vec3_add(glms_vec3_scale(b->u[leg], s), glms_vec3_scale(b->v[leg], t));
}

/* Where the pipe's legs meet: beside the bundle's corner by both legs' offsets. */
static vec3s knot_of(const struct bundle *b, const struct fv_pipes_route *route, int knot, float s, float t)
{
    vec3s middle = fv_pipes_middle(route->corner[knot]);
    if (knot == 0) return glms_vec3_add(middle, offset_on(b, 0, s, t));
    vec3s p = glms_vec3_add(middle, offset_on(b, knot - 1, s, t));
    if (knot == route->legs) return p;
    vec3s d = b->direction[knot - 1];
    return glms_vec3_add(p, glms_vec3_scale(d, glms_vec3_dot(offset_on(b, knot, s, t), d)));
}

static void lay_pipe(const struct fv_pipes *pipes, const struct bundle *b, const struct fv_pipes_route *route,
                     int n, int material, uint32_t *random)
{
    int column = n % b->columns, row = n / b->columns;
    float s = b->pitch * ((float)column + 0.5f - 0.5f * (float)b->columns),
          t = b->pitch * ((float)row + 0.5f - 0.5f * (float)b->rows);
    float across = column == 0 ? -1 : column == b->columns - 1 ? 1 : 0;
    float up = row == b->rows - 1 ? 1 : row == 0 && across == 0 ? -1 : 0;
    struct fv_pipes_line line = {&pipes->brush[material], &pipes->brush[FV_PIPES_BOLTS],
                                 &pipes->brush[FV_PIPES_WHEELS], .legs = route->legs};
    line.radius = fminf(b->pitch * fv_random_between(random, 0.15f, 0.31f), 0.24f);
    for (int i = 0; i <= route->legs; i++) line.knot[i] = knot_of(b, route, i, s, t);
    for (int i = 0; i < route->legs; i++) {
        line.x[i] = b->u[i];
        line.y[i] = b->v[i];
        line.outwards[i] = up != 0 ? glms_vec3_scale(b->v[i], up) : glms_vec3_scale(b->u[i], across);
    }
    fv_pipes_lay_line(&line, random);
}

/* A box about `middle`, its halves along three unit vectors at right angles that lie along x, y and z. */
static void block(const struct fv_brush *brush, vec3s middle, vec3s half)
{
    half = fv_vec(fabsf(half.x), fabsf(half.y), fabsf(half.z));
    fv_shape_box(brush, glms_vec3_sub(middle, half), glms_vec3_add(middle, half));
}

static vec3s along3(vec3s a, float s, vec3s b, float t, vec3s c, float r)
{
    return glms_vec3_add(glms_vec3_add(glms_vec3_scale(a, s), glms_vec3_scale(b, t)), glms_vec3_scale(c, r));
}

/* Two rods from a rack up to the storey's beams, or to the first thing in their way. */
static void hang(const struct fv_pipes *pipes, const int cell[3], vec3s side, float reach, float top)
{
    vec3s middle = fv_pipes_middle(cell);
    int y = cell[1] + 1;
    while (y < FV_PIPES_NY && y % FV_PIPES_STOREY != 0 &&
           fv_pipes_at(pipes, cell[0], y, cell[2]) == FV_PIPES_FREE)
        y++;
    float ceiling = FV_PIPES_CELL * (float)y;
    if (ceiling < middle.y + top + 0.05f) return;
    for (int i = -1; i <= 1; i += 2) {
        vec3s foot = glms_vec3_add(middle, glms_vec3_scale(side, reach * (float)i));
        fv_shape_tube(&pipes->brush[FV_PIPES_RACK], fv_vec(foot.x, middle.y + top, foot.z),
                      fv_vec(foot.x, ceiling, foot.z), 0.012f, 0.012f, 6);
    }
}

/* A frame around the bundle with a bar below each row. */
static void rack(const struct fv_pipes *pipes, const struct bundle *b, const int cell[3], int leg)
{
    const struct fv_brush *steel = &pipes->brush[FV_PIPES_RACK];
    const float half = 0.025f;
    vec3s middle = fv_pipes_middle(cell), d = b->direction[leg], u = b->u[leg], v = b->v[leg];
    float w = 0.5f * b->pitch * (float)b->columns + half, h = 0.5f * b->pitch * (float)b->rows + half;
    for (int i = -1; i <= 1; i += 2)
        block(steel, glms_vec3_add(middle, glms_vec3_scale(u, w * (float)i)),
              along3(u, half, v, h + half, d, half));
    for (int i = 0; i <= b->rows; i++) {
        float t = i == 0 ? -h : i == b->rows ? h : b->pitch * ((float)i - 0.5f * (float)b->rows);
        float thick = i == 0 || i == b->rows ? half : fminf(half, 0.08f * b->pitch);
        block(steel, glms_vec3_add(middle, glms_vec3_scale(v, t)),
              along3(u, w - half, v, thick, d, 0.8f * half));
    }
    if (fabsf(d.y) > 0.5f) return;
    bool level = fabsf(u.y) < 0.5f;
    hang(pipes, cell, level ? u : v, level ? w : h, (level ? h : w) + half);
}

static void lay_racks(const struct fv_pipes *pipes, const struct bundle *b,
                      const struct fv_pipes_route *route)
{
    for (int leg = 0; leg < route->legs; leg++) {
        const int *from = route->corner[leg], *to = route->corner[leg + 1];
        int cells = abs(to[0] - from[0]) + abs(to[1] - from[1]) + abs(to[2] - from[2]);
        for (int n = 1; n < cells; n += 2) {
            int cell[3];
            for (int i = 0; i < 3; i++) cell[i] = from[i] + (to[i] - from[i]) / cells * n;
            rack(pipes, b, cell, leg);
        }
    }
}

void fv_pipes_lay_bundle(const struct fv_pipes *pipes, const struct fv_pipes_route *route, uint32_t *random)
{
    struct bundle b;
    int palette[PALETTE];
    lay_raster(&b, pick_kind(random), pipes->detail, random);
    for (int i = 0; i < PALETTE; i++) palette[i] = fv_random_below(random, FV_PIPES_PAINTS);
    if (b.pipes == 0) return;
    turn_axes(&b, route);
    for (int n = 0; n < b.pipes; n++) {
        int die = fv_random_below(random, 10);
        lay_pipe(pipes, &b, route, n, palette[die < 6 ? 0 : die < 9 ? 1 : 2], random);
    }
    lay_racks(pipes, &b, route);
}
