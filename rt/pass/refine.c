/* refine: tests the corners of the central region's pixels, samples the subpixels around those that fail, and puts the
 * pixels together; see selective.h. */
#include "rt/pass/bent.h"
#include "rt/pass/lattice.h"
#include "rt/pass/reuse.h"
#include "rt/pass/selective.h"

#include <math.h>
#include <string.h>

enum { ROW = FV_CORNERS + 15 };

enum { CELL = 4, CELLS = (FV_CORNERS + CELL - 1) / CELL };
static const uint64_t CELL_BITS = (1 << CELL) - 1;

struct corners {
    float eccentricity[FV_CORNERS][ROW];
    uint64_t tested[FV_CORNERS], failed[FV_CORNERS], known[FV_CORNERS];
};

static const uint32_t *row_of(const struct fv_frame *f, enum fv_buffer buffer, int eye, int64_t from)
{
    const uint32_t *words = f->buffer[buffer][eye];
    return words ? words + from : NULL;
}

/* The row of corners above the tile's pixel row y, into bits by their place in the tile. */
static void test_row(struct fv_frame *f, const struct fv_tile *tile, int y, const float *tolerance, struct corners *to)
{
    int first = tile->x0 == 0, row = tile->y0 + y;
    int last = f->width - tile->x0 < FV_CORNERS ? f->width - tile->x0 - 1 : FV_CORNERS - 1;
    to->tested[y] = to->failed[y] = to->known[y] = 0;
    if (row == 0 || row >= f->height || last < first) return;
    const int64_t at = (int64_t)row * f->stride + tile->x0 + first - 1;
    struct fv_corners c = {.count = last - first + 1, .stamp = fv_identity_stamp(f), .tolerance = tolerance + first,
                           .settings = &f->selective, .view = fv_bent_view(f, tile),
                           .x = (float)(tile->x0 + first), .y = (float)row};
    for (int k = 0; k < 2; k++) {
        int64_t from = at + (k - 1) * f->stride;
        c.base[k] = row_of(f, FV_BASE, tile->eye, from);
        c.identity[k] = row_of(f, FV_IDENTITY, tile->eye, from);
        c.facing[k] = row_of(f, FV_FACING, tile->eye, from);
        c.second_identity[k] = row_of(f, FV_SECOND_IDENTITY, tile->eye, from);
        c.second_facing[k] = row_of(f, FV_SECOND_FACING, tile->eye, from);
        c.triangle[k] = row_of(f, FV_TRIANGLE, tile->eye, from);
        c.lit[k] = row_of(f, FV_LIT, tile->eye, from);
        c.cache[k] = row_of(f, FV_CACHE, tile->eye, from);
    }
    f->kernels->test_corners(&c);
    to->tested[y] = c.tested << first;
    to->failed[y] = c.failed << first;
    to->known[y] = c.known << first;
}

/* Near what fails, corners of the regions up to selective.spread fail, too: what is thin lies between pixels unseen. Corners of
 * other tiles are not asked. */
static void spread(const struct fv_frame *f, struct corners *c)
{
    uint64_t of[FV_CORNERS];
    int regions = f->selective.spread;
    for (int y = 0; y < FV_CORNERS; y++) of[y] = c->failed[y] | c->failed[y] << 1 | c->failed[y] >> 1;
    for (int y = 0; y < FV_CORNERS; y++) {
        uint64_t near = of[y] | (y > 0 ? of[y - 1] : 0) | (y < FV_CORNERS - 1 ? of[y + 1] : 0);
        for (near &= c->tested[y] & ~c->failed[y]; near; near &= near - 1) {
            int x = __builtin_ctzll(near);
            if (fv_region_at(&f->selective.regions, c->eccentricity[y][x]) < regions) c->failed[y] |= (uint64_t)1 << x;
        }
    }
}

/* How many failed, 0 where none was tested either: then `any` is false. */
static int test(struct fv_frame *f, const struct fv_tile *tile, struct corners *c, bool *any)
{
    struct fv_worker_scratch *s = &f->scratch[tile->worker];
    const struct fv_parameters *p = &f->parameters;
    fv_lattice e, tolerance;
    float row[ROW];
    int64_t tested = 0, failed = 0;
    fv_lattice_eccentricity(f, tile, e);
    fv_lattice_tolerance(f, e, 1, tolerance);
    for (int y = 0; y < FV_CORNERS; y++) {
        fv_lattice_row(e, 0, (float)y, ROW, c->eccentricity[y]);
        fv_lattice_row(tolerance, 0, (float)y, ROW, row);
        for (int x = 0; x < ROW; x++) row[x] = c->eccentricity[y][x] <= p->near_deg ? row[x] : -1;
        test_row(f, tile, y, row, c);
        tested += __builtin_popcountll(c->tested[y]);
        failed += __builtin_popcountll(c->failed[y]);
    }
    s->corners += tested;
    s->failed_corners += failed;
    if (failed > 0 && f->selective.spread > 0) spread(f, c);
    *any = tested > 0;
    return (int)failed;
}

/* Subpixels whose samples stand in the list, one's side by side. */
struct list {
    int count;
    uint16_t pixel[FV_SAMPLES_MAX], samples[FV_SAMPLES_MAX];
};

static void trace(struct fv_frame *f, const struct fv_tile *tile, struct list *list)
{
    struct fv_worker_scratch *w = &f->scratch[tile->worker];
    struct fv_samples *s = &w->samples;
    if (list->count == 0) return;
    fv_samples_trace(f, tile, 1);
    for (int i = 0, at = 0; i < list->count; i++) {
        float red = 0, green = 0, blue = 0, part = 0.25f / (float)list->samples[i];
        for (int k = 0; k < list->samples[i]; k++, at++) red += s->red[at], green += s->green[at], blue += s->blue[at];
        w->extra[0][list->pixel[i]] += red * part;
        w->extra[1][list->pixel[i]] += green * part;
        w->extra[2][list->pixel[i]] += blue * part;
    }
    list->count = s->count = 0;
}

/* Numbers in [0, 1), one after another. */
static inline float next(uint32_t *state)
{
    *state = *state * 747796405u + 2891336453u;
    uint32_t mixed = (*state >> ((*state >> 28) + 4) ^ *state) * 277803737u;
    return (float)((mixed >> 22 ^ mixed) >> 8) * 0x1p-24f;
}

/* n places in the half pixel a side from (x, y) on, a jittered one in each stratum: a square of them where n is one, else
 * columns, whose places along y follow the golden ratio. */
static void place(struct fv_samples *s, float x, float y, int n, uint32_t *state)
{
    int side = (int)(sqrtf((float)n) + 0.5f), at = s->count;
    bool square = side * side == n;
    float across = 0.5f / (float)(square ? side : n), start = square ? 0 : next(state);
    for (int k = 0; k < n; k++, at++) {
        float turn = start + (float)k * 0.61803399f;
        s->x[at] = x + ((float)(square ? k % side : k) + next(state)) * across;
        s->y[at] = y + (square ? ((float)(k / side) + next(state)) * across : 0.5f * (turn - floorf(turn)));
    }
    s->count = at;
}

/* The tile's pixels that take the last frame's colours (reuse.h), by rows; NULL: none do. */
static const uint32_t *reused_of(const struct fv_frame *f, const struct fv_tile *tile)
{
    const uint32_t *reused = f->buffer[FV_REUSED][0];
    return reused ? reused + tile->index * FV_TILE : NULL;
}

/* Of the corner that failed at (x, y) of the tile, the subpixels that lie in it. Returns how many samples it took. */
static int refine_corner(struct fv_frame *f, const struct fv_tile *tile, int x, int y, int n, struct list *list)
{
    struct fv_samples *s = &f->scratch[tile->worker].samples;
    const uint32_t *reused = reused_of(f, tile);
    const int32_t *triangle = f->buffer[FV_TRIANGLE][tile->eye], *lit = f->buffer[FV_LIT][tile->eye];
    uint32_t column = (uint32_t)(tile->x0 + x), row = (uint32_t)(tile->y0 + y), taken = 0;
    uint32_t state = (column * 0x9e3779b1u ^ row * 0x85ebca6bu) + (uint32_t)f->number * 0xc2b2ae35u + (uint32_t)tile->eye;
    if (s->count + 4 * n > FV_SAMPLES_MAX) trace(f, tile, list);
    for (int k = 0; k < 4; k++) {
        int px = x - 1 + (k & 1), py = y - 1 + (k >> 1);
        if (px < 0 || py < 0 || px >= FV_TILE || py >= FV_TILE) continue;
        f->scratch[tile->worker].doubtful++;
        if (reused && reused[py] >> px & 1) {
            f->scratch[tile->worker].spared++;
            continue;
        }
        int64_t at = fv_tile_row(f, tile, py) + px;
        for (int i = s->count; s->known && i < s->count + n; i++) s->triangle[i] = triangle[at], s->lit[i] = lit[at];
        for (int i = 0; i < n; i++) s->number[s->count + i] = k * n + i;
        place(s, (float)column - 0.5f + 0.5f * (float)(k & 1), (float)row - 0.5f + 0.5f * (float)(k >> 1), n, &state);
        list->pixel[list->count] = (uint16_t)(py * FV_TILE + px);
        list->samples[list->count++] = (uint16_t)n;
        taken += (uint32_t)n;
    }
    return (int)taken;
}

/* Samples of each subpixel around a corner that failed. */
static int samples_at(const struct fv_frame *f, const struct corners *c, int x, int y)
{
    return f->parameters.extra[fv_region_at(&f->selective.regions, c->eccentricity[y][x])];
}

/* Corners that failed, those that are known or the others, cell by cell: neighbours' rays share packets. */
static int refine_corners(struct fv_frame *f, const struct fv_tile *tile, const struct corners *c, bool known)
{
    struct fv_worker_scratch *w = &f->scratch[tile->worker];
    struct list list = {.count = 0};
    int taken = 0;
    w->samples.count = 0;
    w->samples.known = known;
    w->samples.numbered = true;
    for (int cell = 0; cell < CELLS * CELLS; cell++)
        for (int y = cell / CELLS * CELL; y < FV_CORNERS && y < cell / CELLS * CELL + CELL; y++) {
            uint64_t left = (known ? c->known[y] : c->failed[y] & ~c->known[y]) & CELL_BITS << cell % CELLS * CELL;
            for (; left; left &= left - 1) {
                int x = __builtin_ctzll(left);
                taken += refine_corner(f, tile, x, y, samples_at(f, c, x, y), &list);
            }
        }
    trace(f, tile, &list);
    w->samples.known = w->samples.numbered = false;
    return taken;
}

/* The tile's base colours and those around it, linear. */
static void decode_around(const struct fv_frame *f, const struct fv_tile *tile, float linear[3][FV_AROUND][FV_AROUND_ROW])
{
    const uint32_t *base = f->buffer[FV_BASE][tile->eye];
    _Alignas(64) uint32_t row[FV_AROUND_ROW] = {0};
    for (int y = 0; y < FV_AROUND; y++) {
        const uint32_t *from = base + fv_clamp(tile->y0 + y - 1, f->height) * f->stride;
        row[0] = from[tile->x0 > 0 ? tile->x0 - 1 : 0];
        memcpy(row + 1, from + tile->x0, FV_TILE * sizeof *row);
        row[FV_TILE + 1] = from[fv_clamp(tile->x0 + FV_TILE, f->width)];
        f->kernels->decode(row, linear[0][y], linear[1][y], linear[2][y], FV_AROUND_ROW - 16);
    }
}

static void resolve(struct fv_frame *f, const struct fv_tile *tile, const struct corners *c)
{
    struct fv_worker_scratch *w = &f->scratch[tile->worker];
    const uint32_t *reused = reused_of(f, tile);
    _Alignas(64) float linear[3][FV_AROUND][FV_AROUND_ROW];
    decode_around(f, tile, linear);
    for (int y = 0; y < FV_TILE && tile->y0 + y < f->height; y++) {
        struct fv_resolve r = {.count = FV_TILE,
                               .tested = {c->tested[y], c->tested[y + 1]},
                               .failed = {c->failed[y], c->failed[y + 1]},
                               .reused = reused ? reused[y] : 0,
                               .exposure = f->tracer->data->exposure,
                               .colour = (uint32_t *)f->buffer[FV_COLOUR][tile->eye] + fv_tile_row(f, tile, y)};
        for (int k = 0; k < 3; k++) {
            r.extra[k] = w->extra[k] + y * FV_TILE;
            for (int i = 0; i < 3; i++) r.around[k][i] = linear[k][y + i];
        }
        f->kernels->resolve(&r);
    }
}

static int run(struct fv_frame *f, const struct fv_tile *tile)
{
    struct fv_worker_scratch *w = &f->scratch[tile->worker];
    struct corners c;
    bool any;
    if (tile->density != FV_FINE || !fv_tile_within(f, tile, f->parameters.near_deg)) return 0;
    int failed = test(f, tile, &c, &any);
    if (!any) return 0;
    memset(w->extra, 0, sizeof w->extra);
    int taken = 0;
    for (int known = 0; known < 2 && failed > 0; known++) taken += refine_corners(f, tile, &c, known);
    resolve(f, tile, &c);
    return taken;
}

void fv_refine_counts(const struct fv_frame *f, const struct fv_tile *tile, uint16_t *samples)
{
    const uint32_t *reused = reused_of(f, tile);
    struct fv_frame last = *f;
    struct corners c;
    bool any;
    last.number--; /* attributes are those of the frame before the next one */
    memset(samples, 0, FV_TILE * FV_TILE * sizeof *samples);
    if (tile->density != FV_FINE || test(&last, tile, &c, &any) == 0) return;
    for (int y = 0; y < FV_CORNERS; y++)
        for (uint64_t left = c.failed[y]; left; left &= left - 1) {
            int x = __builtin_ctzll(left);
            for (int k = 0; k < 4; k++) {
                int px = x - 1 + (k & 1), py = y - 1 + (k >> 1);
                if (px < 0 || py < 0 || px >= FV_TILE || py >= FV_TILE || (reused && reused[py] >> px & 1)) continue;
                samples[py * FV_TILE + px] = (uint16_t)(samples[py * FV_TILE + px] + samples_at(f, &c, x, y));
            }
        }
}

/* What was sampled once is there, and is not worth being reused. */
static void stand_in(struct fv_frame *f, const struct fv_tile *tile)
{
    uint8_t *chain = f->buffer[FV_CHAIN][tile->eye];
    if (!chain || tile->density != FV_FINE) return;
    for (int y = 0; y < FV_TILE; y++) memset(chain + fv_tile_row(f, tile, y), FV_CHAIN_NONE, FV_TILE);
}

static void expect(const struct fv_frame *f, const struct fv_parameters *p, const struct fv_rings *rings,
                   double units[2])
{
    double extra = 0;
    for (int d = 0; d < FV_DEGREES && (float)d < p->near_deg; d++)
        extra += 4.0 * (double)rings->pixels[d] * p->extra[fv_region_at(&f->selective.regions, (float)d + 0.5f)];
    units[0] = extra * (double)(f->failed_corners_share * (1 - f->spared_share));
}

const struct fv_pass fv_pass_refine = {
    .name = "refine",
    .reads = FV_BIT(FV_BASE) | FV_BIT(FV_IDENTITY) | FV_BIT(FV_FACING) | FV_BIT(FV_SECOND_IDENTITY) | FV_BIT(FV_SECOND_FACING) |
             FV_BIT(FV_TRIANGLE) | FV_BIT(FV_LIT) | FV_BIT(FV_CACHE),
    .offers = FV_BIT(FV_CHAIN),
    .writes = FV_BIT(FV_COLOUR),
    .needs = FV_NEEDS_GAZE | FV_NEEDS_MAPS,
    .order = FV_ORDER_GAZE,
    .run = run,
    .stand_in = stand_in,
    .expect = expect};
