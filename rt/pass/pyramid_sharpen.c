/* sharpen: what lies between pixels of the lower levels that differ, at the highest level; see pyramid.h. */
#include "rt/pass/pyramid.h"

/* Rows of the tile's pixels, a bit each: those that are to be painted anew where that can be; and of these, those that
 * are else to be traced. */
struct marks {
    uint32_t row[FV_TILE], traced[FV_TILE];
    bool any;
};

/* From rows of points between pixels of `size`, the first at the tile's corner, to the tile's pixels. */
static void spread(const uint32_t *points, int n, int size, uint32_t row[FV_TILE])
{
    uint64_t square = (1ull << size) - 1;
    for (int y = 0; y < FV_TILE; y++) row[y] = 0;
    for (int i = 0; i < n; i++) {
        uint64_t bits = 0;
        for (uint32_t left = points[i]; left; left &= left - 1) bits |= square << (__builtin_ctz(left) * size);
        for (int y = i * size - size / 2; y < i * size + size / 2; y++)
            if (y >= 0 && y < FV_TILE) row[y] |= (uint32_t)(bits >> (size / 2));
    }
}

/* A tile of a lower level and the pixels around it, and where they differ; beyond the picture no checks. */
struct lower {
    struct fv_contrast contrast;
    uint32_t seen[FV_CONTRAST_POINTS + 1][FV_TILE + FV_TILE / 2];
    bool checks;
};

/* Whether the tile's lower levels were carried over and moved, so that the last frame showed sharper what differs faintly. */
static bool blurred(const struct fv_frame *f, const struct fv_tile *tile)
{
    return f->state[tile->index].waits && !fv_map_still(&f->map[tile->eye], &f->view[tile->eye]);
}

/* False where nothing differs. */
static bool take(const struct fv_frame *f, const struct fv_tile *tile, struct lower *l)
{
    const struct fv_raster *r = fv_tile_raster(f, tile);
    const uint32_t *seen = f->buffer[tile->density == FV_COARSE ? FV_COARSE_SEEN : FV_COARSEST_SEEN][tile->eye];
    int n = fv_tile_side(tile) + 1, x0 = (tile->x0 >> tile->density) - 1, y0 = (tile->y0 >> tile->density) - 1;
    l->checks = seen != NULL;
    l->contrast.n = n;
    l->contrast.step = (int)(f->parameters.contrast * 1024);
    l->contrast.faint = l->checks || blurred(f, tile) ? l->contrast.step / 8 : l->contrast.step;
    for (int y = 0; y <= n; y++) fv_raster_row(r, 0, x0, y0 + y, n + 1, l->contrast.pixel[y]);
    f->kernels->contrast(&l->contrast);
    bool any = false;
    for (int y = 0; y < n; y++) any |= l->contrast.faintly[y] != 0;
    for (int y = 0; any && seen && y <= n; y++)
        for (int x = 0; x <= n; x++) {
            bool inside = x0 + x >= 0 && x0 + x < r->width && y0 + y >= 0 && y0 + y < r->height;
            l->seen[y][x] = inside ? seen[(y0 + y) * r->stride + x0 + x] : 0;
        }
    return any;
}

/* Blocks of the tile, as rows of its pixels, of which none is marked any longer. */
static void leave(struct marks *m, uint64_t blocks)
{
    m->any = false;
    for (int y = 0; y < FV_TILE; y++) {
        uint32_t of_row = (uint32_t)(blocks >> (y / FV_BLOCK * FV_BLOCKS)) & 255, out = 0;
        for (; of_row; of_row &= of_row - 1) out |= 15u << (__builtin_ctz(of_row) * FV_BLOCK);
        m->row[y] &= ~out;
        m->any |= m->row[y] != 0;
    }
}

/* Blocks of the tile in which something is marked. */
static uint64_t marked_blocks(const struct marks *m)
{
    uint64_t blocks = 0;
    for (int y = 0; y < FV_TILE; y++)
        for (uint32_t left = m->row[y]; left; left &= ~(15u << (__builtin_ctz(left) & ~3)))
            blocks |= 1ull << (y / FV_BLOCK * FV_BLOCKS + __builtin_ctz(left) / FV_BLOCK);
    return blocks;
}

/* Faint differences count where all four show checks: else they are not to be painted. */
static void keep_checks(struct lower *l)
{
    for (int y = 0; y < l->contrast.n; y++)
        for (uint32_t left = l->contrast.faintly[y] & ~l->contrast.out[y]; left; left &= left - 1) {
            int x = __builtin_ctz(left);
            if (!(l->seen[y][x] && l->seen[y][x + 1] && l->seen[y + 1][x] && l->seen[y + 1][x + 1]))
                l->contrast.faintly[y] &= ~(1u << x);
        }
}

/* Pixels where colours differ, within the picture and outside of `masked`. */
static void mark(const struct fv_frame *f, const struct fv_tile *tile, uint64_t masked, struct lower *l, struct marks *m)
{
    if (!blurred(f, tile)) keep_checks(l);
    spread(l->contrast.out, l->contrast.n, 1 << tile->density, m->traced);
    spread(l->contrast.faintly, l->contrast.n, 1 << tile->density, m->row);
    int columns = f->width - tile->x0, rows = f->height - tile->y0;
    uint32_t inside = columns >= FV_TILE ? ~0u : (1u << columns) - 1;
    for (int y = 0; y < FV_TILE; y++) m->row[y] &= y < rows ? inside : 0;
    leave(m, masked);
}

/* Samples in the marked pixels of the tile, squares around the points one after another: packets hold neighbours. `at`:
 * where in the tile. */
static void place(struct fv_samples *s, const struct fv_tile *tile, int size, const struct marks *m,
                  uint16_t at[FV_SAMPLES_MAX])
{
    int n = 0;
    for (int y0 = -size / 2; y0 < FV_TILE; y0 += FV_BLOCK)
        for (int x0 = -size / 2; x0 < FV_TILE; x0 += FV_BLOCK)
            for (int y = y0 < 0 ? 0 : y0; y < y0 + FV_BLOCK && y < FV_TILE; y++) {
                uint32_t square = x0 < 0 ? 15u >> -x0 : 15u << x0;
                for (uint32_t left = m->row[y] & square; left; left &= left - 1) {
                    int x = __builtin_ctz(left);
                    s->x[n] = (float)(tile->x0 + x) + 0.5f;
                    s->y[n] = (float)(tile->y0 + y) + 0.5f;
                    at[n++] = (uint16_t)(y * FV_TILE + x);
                }
            }
    s->count = n;
}

/* The cells in which something is marked, row by row; returns how many. */
static int list_cells(const struct lower *l, int32_t column[FV_CELLS_PADDED], int32_t row[FV_CELLS_PADDED])
{
    int n = 0;
    for (int y = 0; y < l->contrast.n; y++)
        for (uint32_t left = l->contrast.faintly[y]; left; left &= left - 1) {
            column[n] = __builtin_ctz(left);
            row[n++] = y;
        }
    return n;
}

/* The marked pixels of a cell, whose corner lies there in the tile, into these; none is marked any longer. */
static void put_cell(struct marks *m, int x0, int y0, int size, const uint32_t *colour, uint32_t *to, int64_t stride)
{
    uint32_t all = (1u << size) - 1, square = x0 < 0 ? all >> -x0 : all << x0;
    for (int y = y0; y < y0 + size; y++, colour += size) {
        if (y < 0 || y >= FV_TILE) continue;
        uint32_t left = m->row[y] & square;
        m->row[y] &= ~square;
        for (; left; left &= left - 1) to[y * stride + __builtin_ctz(left)] = colour[__builtin_ctz(left) - x0];
    }
}

/* What needs no ray, into the tile's pixels; others are left. */
static void repaint(struct fv_frame *f, const struct fv_tile *tile, int size, const struct lower *l, struct marks *m,
                    uint32_t *to)
{
    _Alignas(64) uint32_t colour[FV_CELL_PIXELS];
    _Alignas(64) int32_t painted[FV_CELLS_PADDED], column[FV_CELLS_PADDED], row[FV_CELLS_PADDED];
    struct fv_repaint r = {.scene = f->tracer->data,
                           .view = &f->view[tile->eye],
                           .count = list_cells(l, column, row),
                           .column = column,
                           .row = row,
                           .x0 = (float)tile->x0 - 0.5f * (float)size,
                           .y0 = (float)tile->y0 - 0.5f * (float)size,
                           .size = (float)size,
                           .pixel = l->contrast.pixel[0],
                           .seen = l->seen[0],
                           .stride = sizeof l->seen[0] / sizeof l->seen[0][0],
                           .colour = colour,
                           .painted = painted};
    f->kernels->repaint(&r);
    for (int i = 0; i < r.count; i++)
        if (painted[i])
            put_cell(m, column[i] * size - size / 2, row[i] * size - size / 2, size, colour + i * size * size, to,
                     f->raster[FV_FINE][tile->eye].stride);
}

/* The marked pixels of the tile. Returns rays. */
static int sharpen(struct fv_frame *f, const struct fv_tile *tile, int size, const struct marks *m)
{
    struct fv_worker_scratch *w = &f->scratch[tile->worker];
    const struct fv_raster *raster = fv_tile_raster(f, tile);
    uint32_t *to = raster->colour + fv_tile_row(f, tile, 0);
    uint16_t at[FV_SAMPLES_MAX];
    place(&w->samples, tile, size, m, at);
    int n = w->samples.count, rays = n > 0 ? fv_pyramid_shade(f, tile, f->parameters.spp_middle) : 0;
    for (int i = 0; i < n; i++)
        to[at[i] / FV_TILE * raster->stride + at[i] % FV_TILE] = w->pixel[FV_PLANE_BASE][i] | FV_PIXEL_SAMPLED;
    return rays;
}

/* Of a tile that is not traced again: these blocks, as the last frame showed them. Returns those that it did not show, or
 * not at the highest level. */
static uint64_t carry(struct fv_frame *f, const struct fv_tile *tile, uint64_t blocks)
{
    uint32_t *to = fv_tile_raster(f, tile)->colour + fv_tile_row(f, tile, 0), copy[FV_TILE][FV_TILE];
    int64_t stride = fv_tile_raster(f, tile)->stride;
    for (int y = 0; y < FV_TILE; y++) memcpy(copy[y], to + y * stride, sizeof copy[y]);
    uint64_t failed = fv_pyramid_carry(f, tile, blocks), stay = ~blocks | failed;
    for (; stay; stay &= stay - 1) {
        int x = __builtin_ctzll(stay) % FV_BLOCKS * FV_BLOCK, y0 = __builtin_ctzll(stay) / FV_BLOCKS * FV_BLOCK;
        for (int y = y0; y < y0 + FV_BLOCK; y++) memcpy(to + y * stride + x, copy[y] + x, FV_BLOCK * sizeof *to);
    }
    return failed;
}

static int run(struct fv_frame *f, const struct fv_tile *tile)
{
    struct fv_tile fine = *tile, level = *tile;
    struct fv_tile_state *state = &f->state[tile->index];
    uint64_t masked = ((const uint64_t *)f->buffer[FV_MASKED][0])[tile->index];
    struct lower lower;
    struct marks marks = {.any = false};
    if (!f->pyramid.foveated || f->parameters.contrast >= 1) return 0;
    if (state->waits && !f->pyramid.carry) {
        if (fv_pyramid_stays(f, tile)) state->density = FV_FINE;
        return 0;
    }
    fine.density = FV_FINE;
    if (tile->density == FV_FINE) level.density = FV_COARSE;
    if (masked != fv_tile_inside(f, &fine) && take(f, &level, &lower)) mark(f, &level, masked, &lower, &marks);
    if (marks.any) {
        uint32_t *to = fv_tile_raster(f, &fine)->colour + fv_tile_row(f, &fine, 0);
        if (tile->density != FV_FINE) fv_pyramid_fill(f, tile, ~0ull);
        state->density = FV_FINE;
        if (lower.checks) repaint(f, &fine, 1 << level.density, &lower, &marks, to);
        if (state->waits) leave(&marks, ~carry(f, &fine, marked_blocks(&marks)));
        for (int y = 0; y < FV_TILE; y++) marks.row[y] &= marks.traced[y];
    }
    state->holds[0] |= state->density == FV_FINE;
    return marks.any ? sharpen(f, &fine, 1 << level.density, &marks) : 0;
}

/* The lower levels are good enough. */
static void stand_in(struct fv_frame *f, const struct fv_tile *tile)
{
    (void)f, (void)tile;
}

static void expect(const struct fv_frame *f, const struct fv_parameters *p, const struct fv_rings *rings,
                   double units[2])
{
    const float steps = 0.06f; /* of pixels, from above */
    if (!f->pyramid.foveated || p->contrast >= 1) return;
    for (int d = (int)p->foveal.r0_deg; d < FV_DEGREES; d++)
        units[0] += (double)(rings->pixels[d] * steps * (float)p->spp_middle);
}

const struct fv_pass fv_pass_sharpen = {.name = "sharpen",
                                       .reads = FV_BIT(FV_STARTS) | FV_BIT(FV_MASKED) | FV_BIT(FV_COARSE_COLOUR) |
                                                FV_BIT(FV_COARSEST_COLOUR) | FV_SEEN | FV_CARRIED,
                                       .writes = FV_BIT(FV_COLOUR),
                                       .order = FV_ORDER_NEED,
                                       .run = run,
                                       .stand_in = stand_in,
                                       .expect = expect};
