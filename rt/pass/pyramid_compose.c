/* compose: in tiles with masked blocks, what the middle level shows of the others; see pyramid.h. */
#include "rt/pass/pyramid.h"

#include <string.h>

enum { HALF = FV_TILE / 2 };

/* Bilinear. */
static void fill(struct fv_frame *f, const struct fv_tile *tile, uint64_t masked)
{
    const struct fv_raster *middle = &f->raster[FV_COARSE][tile->eye], *fine = &f->raster[FV_FINE][tile->eye];
    _Alignas(64) uint32_t row[HALF + 2][FV_TILE] = {{0}}, colour[FV_TILE];
    for (int y = 0; y < HALF + 2; y++) fv_raster_row(middle, 0, tile->x0 / 2 - 1, tile->y0 / 2 + y - 1, HALF + 2, row[y]);
    for (int y = 0; y < FV_TILE; y++) {
        unsigned left = ~(unsigned)(masked >> (y / FV_BLOCK * FV_BLOCKS)) & 255;
        uint32_t *to = fine->colour + fv_tile_row(f, tile, y);
        if (!left) continue;
        f->kernels->double_row(row[1 + y / 2], row[y & 1 ? 2 + y / 2 : y / 2], colour, HALF);
        for (; left; left &= left - 1) {
            int x = __builtin_ctz(left) * FV_BLOCK;
            memcpy(to + x, colour + x, FV_BLOCK * sizeof *to);
        }
    }
}

/* The blocks next to one of the others: those along the mask's edge, within the tile. */
static uint64_t edge_of(uint64_t masked)
{
    const uint64_t first = 0x0101010101010101ull, last = first << 7;
    uint64_t across = (masked & ~last) << 1 | (masked & ~first) >> 1;
    return (across | masked << 8 | masked >> 8) & ~masked;
}

/* The binomial 3 x 3 mean around a pixel of the tile, of what of it lies in the tile. */
static uint32_t blurred(const uint32_t tile[FV_TILE][FV_TILE], int x, int y)
{
    static const uint32_t weight[3] = {1, 2, 1};
    uint32_t sum[3] = {8, 8, 8};
    for (int k = 0; k < 9; k++) {
        uint32_t c = tile[fv_clamp(y + k / 3 - 1, FV_TILE)][fv_clamp(x + k % 3 - 1, FV_TILE)], w = weight[k / 3] * weight[k % 3];
        for (int i = 0; i < 3; i++) sum[i] += w * (c >> 10 * i & 1023);
    }
    return sum[0] >> 4 | sum[1] >> 4 << 10 | sum[2] >> 4 << 20;
}

static void blur(struct fv_frame *f, const struct fv_tile *tile, uint64_t blocks)
{
    uint32_t *colour = f->raster[FV_FINE][tile->eye].colour, copy[FV_TILE][FV_TILE];
    for (int y = 0; y < FV_TILE && blocks; y++) memcpy(copy[y], colour + fv_tile_row(f, tile, y), sizeof copy[y]);
    for (; blocks; blocks &= blocks - 1) {
        int block = __builtin_ctzll(blocks), x0 = block % FV_BLOCKS * FV_BLOCK, y0 = block / FV_BLOCKS * FV_BLOCK;
        for (int y = y0; y < y0 + FV_BLOCK; y++)
            for (int x = x0; x < x0 + FV_BLOCK; x++) colour[fv_tile_row(f, tile, y) + x] = blurred(copy, x, y);
    }
}

static int run(struct fv_frame *f, const struct fv_tile *tile)
{
    uint64_t masked = ((const uint64_t *)f->buffer[FV_MASKED][0])[tile->index];
    if (tile->density != FV_FINE || masked == fv_tile_inside(f, tile)) return 0;
    fill(f, tile, masked);
    if (f->pyramid.blur) blur(f, tile, edge_of(masked) & fv_tile_inside(f, tile));
    return 1;
}

static void expect(const struct fv_frame *f, const struct fv_parameters *p, const struct fv_rings *rings,
                   double units[2])
{
    float outer = p->foveal.r1_deg > p->foveal.r0_deg ? p->foveal.r1_deg : p->foveal.r0_deg;
    if (!f->pyramid.foveated) return;
    for (int d = 0; d < FV_DEGREES && (float)d <= outer; d++) units[0] += (double)rings->tiles[d];
}

const struct fv_pass fv_pass_compose = {.name = "compose",
                                        .reads = FV_BIT(FV_COARSE_COLOUR) | FV_BIT(FV_MASKED),
                                        .writes = FV_BIT(FV_COLOUR),
                                        .run = run,
                                        .expect = expect};
