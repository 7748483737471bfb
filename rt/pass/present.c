/* present: pixels to the 8-bit picture that the display takes, with the optional overlay of foveal
 * zones, gaze and sampled pixels. Run only for frames that the display wants. */
#include "rt/pass/pass.h"

#include <math.h>
#include <string.h>

static void paint(uint8_t *p, int r, int g, int b, int weight_256)
{
    int to[3] = {r, g, b};
    for (int c = 0; c < 3; c++) p[c] = (uint8_t)(p[c] + ((to[c] - p[c]) * weight_256) / 256);
}

static void overlay_row(const struct fv_frame *f, const struct fv_tile *tile, int y, const uint32_t *colour,
                        uint8_t *rgbx)
{
    const struct fv_view *v = &f->view[tile->eye];
    const struct fv_foveal *foveal = &f->parameters.foveal;
    for (int x = 0; x < FV_TILE; x++, rgbx += 4) {
        float px = (float)(tile->x0 + x) + 0.5f, py = (float)(tile->y0 + y) + 0.5f;
        float e = fv_eccentricity_deg(v, px, py);
        if ((colour[x] & FV_PIXEL_SAMPLED) && e > foveal->r0_deg) paint(rgbx, 80, 255, 120, 90);
        if (fabsf(e - foveal->r0_deg) < v->pixel_deg) paint(rgbx, 255, 210, 0, 256);
        if (fabsf(e - foveal->r1_deg) < v->pixel_deg) paint(rgbx, 255, 90, 0, 256);
        float dx = fabsf(px - v->gaze_px[0]), dy = fabsf(py - v->gaze_px[1]);
        if ((dx < 1.5f && dy < 12) || (dy < 1.5f && dx < 12)) paint(rgbx, 255, 0, 60, 256);
    }
}

/* Rows of a coarse tile with a pixel more at both ends, as long as a fine tile's, for the kernels: what is behind
 * does not matter. */
enum { HALF = FV_TILE / 2, ROW = FV_TILE };

/* With all light. */
static void take_row(const struct fv_frame *f, const struct fv_raster *r, int x0, int y, int n, uint32_t row[ROW])
{
    fv_raster_row(r, FV_PLANE_BASE, x0, y, n, row);
    if (!fv_light_apart(f)) return;
    _Alignas(64) uint32_t albedo[ROW] = {0}, light[ROW] = {0};
    fv_raster_row(r, FV_PLANE_ALBEDO, x0, y, n, albedo);
    fv_raster_row(r, FV_PLANE_LIGHT, x0, y, n, light);
    f->kernels->compose(row, albedo, light, row, ROW);
}

enum { ROWS_AHEAD = 8 };

static uint8_t *picture_row(const struct fv_frame *f, const struct fv_tile *tile, int y)
{
    return (uint8_t *)f->buffer[FV_PICTURE][tile->eye] + 4 * ((tile->y0 + y) * f->stride + tile->x0);
}

/* Far apart in memory, rows of the picture would be waited for one by one. */
static void fetch_row(const uint8_t *rgbx)
{
    for (int x = 0; x < 4 * FV_TILE; x += 64) __builtin_prefetch(rgbx + x, 1, 2);
}

static void show_row(const struct fv_frame *f, const struct fv_tile *tile, int y, const uint32_t *colour)
{
    uint8_t *rgbx = picture_row(f, tile, y);
    if (y + ROWS_AHEAD < FV_TILE) fetch_row(rgbx + 4 * ROWS_AHEAD * f->stride);
    f->kernels->present(colour, rgbx, FV_TILE);
    if (f->overlay) overlay_row(f, tile, y, colour, rgbx);
}

/* A coarse tile's rows and those above and below it, each with the pixels next to it, from `first` on. */
struct rows {
    _Alignas(64) uint32_t pixel[HALF + 2][ROW];
    int first;
};

static void take_rows(const struct fv_frame *f, const struct fv_tile *tile, struct rows *rows)
{
    const struct fv_raster *r = fv_tile_raster(f, tile);
    int x0 = tile->x0 >> tile->density, y0 = tile->y0 >> tile->density;
    if (tile->density == FV_COARSE) {
        rows->first = 0;
        for (int y = 0; y < HALF + 2; y++) take_row(f, r, x0 - 1, y0 + y - 1, HALF + 2, rows->pixel[y]);
        return;
    }
    /* The coarsest, doubled: from two pixels before its first. */
    _Alignas(64) uint32_t coarsest[HALF / 2 + 2][ROW] = {{0}};
    rows->first = 1;
    for (int y = 0; y < HALF / 2 + 2; y++) take_row(f, r, x0 - 2, y0 + y - 1, HALF / 2 + 4, coarsest[y]);
    for (int y = 0; y < HALF + 2; y++) {
        int near = (y + 1) / 2;
        f->kernels->double_row(coarsest[near], coarsest[y & 1 ? near - 1 : near + 1], rows->pixel[y], HALF);
    }
}

static void show_coarse(const struct fv_frame *f, const struct fv_tile *tile)
{
    struct rows rows;
    _Alignas(64) uint32_t colour[FV_TILE];
    take_rows(f, tile, &rows);
    for (int y = 0; y < FV_TILE; y++) {
        const uint32_t *near = rows.pixel[1 + y / 2], *far = rows.pixel[y & 1 ? 2 + y / 2 : y / 2];
        f->kernels->double_row(near + rows.first, far + rows.first, colour, HALF);
        show_row(f, tile, y, colour);
    }
}

static int run(struct fv_frame *f, const struct fv_tile *tile)
{
    const uint32_t *colour = f->buffer[FV_COLOUR][tile->eye];
    int64_t plane = f->raster[FV_FINE][tile->eye].plane;
    _Alignas(64) uint32_t whole[FV_TILE];
    for (int y = 0; y < ROWS_AHEAD; y++) fetch_row(picture_row(f, tile, y));
    if (tile->density != FV_FINE) show_coarse(f, tile);
    for (int y = 0; y < FV_TILE && tile->density == FV_FINE; y++) {
        const uint32_t *row = colour + (tile->y0 + y) * f->stride + tile->x0;
        if (fv_light_apart(f)) {
            f->kernels->compose(row, row + FV_PLANE_ALBEDO * plane, row + FV_PLANE_LIGHT * plane, whole, FV_TILE);
            row = whole;
        }
        show_row(f, tile, y, row);
    }
    return 1;
}

const struct fv_pass fv_pass_present = {.name = "present",
                                        .reads = FV_BIT(FV_COLOUR) | FV_BIT(FV_COARSE_COLOUR) | FV_BIT(FV_COARSEST_COLOUR),
                                        .writes = FV_BIT(FV_PICTURE),
                                        .run = run};
