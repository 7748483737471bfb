/* pyramid_carry_kernel: a tile of a lower level of the pyramid, from where the last frame showed it; see pyramid.h. */
#include "rt/pass/pyramid.h"
#include "rt/trace/pixel.h"

#define carry FV_ISA_NAME(fv_pyramid_carry)

void carry(struct fv_carry *c);

enum { CELLS = FV_BLOCKS + 2, ROW = (CELLS + FV_WIDTH - 1) / FV_WIDTH * FV_WIDTH };

/* Inverse starts of the tile's blocks, and of those around it where the picture goes on; and by how much the last
 * frame's may differ. */
struct cells {
    _Alignas(64) float w[CELLS][ROW + FV_WIDTH], tolerance[FV_BLOCKS][ROW];
};

/* Slopes count as on their flatter side: what is beside a silhouette would let everything pass. */
static void take_cells(const struct fv_carry *c, struct cells *cells)
{
    for (int y = 0; y < CELLS; y++) {
        const float *row = c->starts + fv_clamp(c->block_y + y - 1, c->rows) * c->stride;
        for (int x = 0; x < CELLS; x++) cells->w[y][x] = row[fv_clamp(c->block_x + x - 1, c->columns)];
        for (int x = CELLS; x < ROW + FV_WIDTH; x++) cells->w[y][x] = 1;
        for (int x = 0; x < ROW + FV_WIDTH; x += FV_WIDTH) vf_store(cells->w[y] + x, 1.0f / vf_load(cells->w[y] + x));
    }
    for (int y = 0; y < FV_BLOCKS; y++)
        for (int x = 0; x < FV_BLOCKS; x += FV_WIDTH) {
            const float *at = cells->w[y + 1] + x + 1;
            vf w = vf_load(at), left = vf_abs(w - vf_load(at - 1)), right = vf_abs(w - vf_load(at + 1));
            vf up = vf_abs(w - vf_load(at - sizeof cells->w[0] / sizeof *at));
            vf down = vf_abs(w - vf_load(at + sizeof cells->w[0] / sizeof *at));
            vf slope = vf_min(vf_min(left, right) + vf_min(up, down), 0.5f * w);
            vf_store(cells->tolerance[y] + x, slope + c->cone * w);
        }
}

/* Where pixels were, in pixels of the raster from the middle of its first. */
struct place {
    vi within; /* mask: of the last frame's picture */
    vf x, y;   /* in the raster, whatever was found */
    vf w, tolerance;
};

/* Blocks are whole, beyond the picture's edge as well: these pixels count where a coarser level takes means. */
static inline int whole_blocks(int pixels)
{
    return (pixels + FV_BLOCK - 1) / FV_BLOCK * FV_BLOCK;
}

static inline struct place find(const struct fv_carry *c, const struct cells *cells, int x, int y)
{
    const float(*m)[3] = c->map.m, *t = c->map.t, scale = c->raster->scale;
    const float width = (float)c->raster->width, height = (float)c->raster->height;
    vi column = x + vi_lanes(), cell = column >> c->shift;
    vf px = (vf_from(c->x0 + column) + 0.5f) * scale, w = vf_gather(cells->w[(y >> c->shift) + 1] + 1, cell);
    float py = ((float)(c->y0 + y) + 0.5f) * scale;
    vf ahead = m[2][0] * px + (m[2][1] * py + m[2][2]) + t[2] * w, nearer = 1.0f / ahead;
    vf u = (m[0][0] * px + (m[0][1] * py + m[0][2]) + t[0] * w) / (ahead * scale) - 0.5f;
    vf v = (m[1][0] * px + (m[1][1] * py + m[1][2]) + t[1] * w) / (ahead * scale) - 0.5f;
    return (struct place){
        .within = (ahead > 1e-3f) & (u >= -0.5f) & (u <= width - 0.5f) & (v >= -0.5f) & (v <= height - 0.5f),
        /* What lies beyond the picture's edge need not have been written, but for what does so itself. */
        .x = vf_min(vf_max(u, vf_of(0)), vf_max(vf_from(c->x0 + column), vf_of(width - 1))),
        .y = vf_min(vf_max(v, vf_of(0)), vf_max(vf_of((float)(c->y0 + y)), vf_of(height - 1))),
        .w = w * nearer,
        .tolerance = vf_gather(cells->tolerance[y >> c->shift], cell) * nearer + c->together};
}

/* Bilinear, of those of the four pixels that showed what is looked for; where there are none, of all. Returns the
 * mask of the lanes that found too little of it. */
static inline vi fetch(const struct fv_carry *c, const struct place *p, vi *pixel)
{
    const float least = 0.1f, others = 1 / 1024.0f;
    const struct fv_raster *r = c->raster;
    int32_t last_x = r->width - 1, last_y = r->height - 1;
    vi x = vi_from(p->x), y = vi_from(p->y);
    vf fx = p->x - vf_from(x), fy = p->y - vf_from(y), total = vf_of(0);
    vi next_x = x - (x < last_x), next_y = y - (y < last_y);
    vf3 sum = {vf_of(0), vf_of(0), vf_of(0)};
    for (int k = 0; k < 4; k++) {
        vi column = k & 1 ? next_x : x, row = k & 2 ? next_y : y;
        vf weight = (k & 1 ? fx : 1.0f - fx) * (k & 2 ? fy : 1.0f - fy);
        vf start = vf_gather(c->last_starts, (row >> c->shift) * (int32_t)c->stride + (column >> c->shift));
        vi same = vf_abs(1.0f / start - p->w) <= p->tolerance;
        weight *= vf_select(same, vf_of(1), vf_of(others));
        total += weight;
        vf3 colour = pixel_unpack(vi_gather(r->history_colour, row * (int32_t)r->stride + column));
        sum = vf3_add(sum, vf3_scale(colour, weight));
    }
    *pixel = pixel_pack(vf3_scale(sum, 1.0f / total));
    return ~(p->within & (total >= least));
}

/* The bits of a row of pixels that failed, as those of its blocks. */
static uint64_t blocks_of(uint32_t failed)
{
    uint64_t blocks = 0;
    for (; failed; failed &= failed - 1) blocks |= 1ull << (__builtin_ctz(failed) / FV_BLOCK);
    return blocks;
}

void carry(struct fv_carry *c)
{
    struct cells cells;
    int columns = c->raster->width - c->x0, rows = whole_blocks(c->raster->height) - c->y0;
    uint32_t inside = columns >= c->side ? ~0u : (1u << columns) - 1;
    c->failed = 0;
    take_cells(c, &cells);
    for (int y = 0; y < c->side && y < rows; y++) {
        int row = y / FV_BLOCK * FV_BLOCKS;
        uint32_t *to = c->raster->colour + (c->y0 + y) * c->raster->stride + c->x0, failed = 0;
        if (!(c->blocks >> row & 255)) continue;
        for (int x = 0; x < c->side; x += FV_WIDTH) {
            if (!(c->blocks >> (row + x / FV_BLOCK) & ((1u << FV_WIDTH / FV_BLOCK) - 1))) continue;
            struct place place = find(c, &cells, x, y);
            vi pixel, none = fetch(c, &place, &pixel);
            vi_store(to + x, pixel);
            failed |= vi_bits(none) << x;
        }
        if (c->y0 + y < c->raster->height) c->failed |= blocks_of(failed & inside) << row;
    }
    c->failed &= c->blocks;
}
