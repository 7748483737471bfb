/* compose: in tiles with masked blocks, what the middle level shows of the others; see pyramid.h. */
#include "rt/pass/pyramid.h"

#include "rt/pass/doubled.h"

#include <string.h>

void fv_pyramid_fill(struct fv_frame *f, const struct fv_tile *tile, uint64_t blocks)
{
    struct fv_tile fine = *tile;
    struct fv_doubled doubled;
    _Alignas(64) uint32_t colour[FV_TILE];
    fine.density = FV_FINE;
    fv_doubled_take(f, tile, &doubled);
    for (int y = 0; y < FV_TILE; y++) {
        unsigned row = (unsigned)(blocks >> (y / FV_BLOCK * FV_BLOCKS)) & 255;
        uint32_t *to = f->raster[FV_FINE][tile->eye].colour + fv_tile_row(f, &fine, y);
        if (!row) continue;
        fv_doubled_row(f, &doubled, y, colour);
        for (; row; row &= row - 1) {
            int x = __builtin_ctz(row) * FV_BLOCK;
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
    if (tile->density != FV_FINE || masked == fv_tile_inside(f, tile) || fv_pyramid_stays(f, tile)) return 0;
    struct fv_tile middle = *tile;
    middle.density = FV_COARSE;
    fv_pyramid_fill(f, &middle, ~masked);
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
