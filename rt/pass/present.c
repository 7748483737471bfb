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

/* A coarse tile's pixels and those around it, whose centres lie inside the picture. */
enum { HALF = FV_TILE / 2, ROW = HALF + 2 };

static void take_plane(const struct fv_raster *r, int plane, int x0, int y, uint32_t row[FV_TILE])
{
    y = y < 0 ? 0 : y >= r->height ? r->height - 1 : y;
    const uint32_t *from = r->colour + plane * r->plane + y * r->stride;
    int right = x0 + HALF < r->width ? x0 + HALF : r->width - 1;
    memcpy(row + 1, from + x0, HALF * sizeof *row);
    row[0] = from[x0 > 0 ? x0 - 1 : 0];
    row[ROW - 1] = from[right];
    for (int x = right - x0 + 2; x < ROW; x++) row[x] = from[right];
}

/* With all light. Rows are as long as a tile's, for the kernel; what is behind ROW does not matter. */
static void take_row(const struct fv_frame *f, const struct fv_raster *r, int x0, int y, uint32_t row[FV_TILE])
{
    take_plane(r, FV_PLANE_BASE, x0, y, row);
    if (!fv_light_apart(f)) return;
    _Alignas(64) uint32_t albedo[FV_TILE] = {0}, light[FV_TILE] = {0};
    take_plane(r, FV_PLANE_ALBEDO, x0, y, albedo);
    take_plane(r, FV_PLANE_LIGHT, x0, y, light);
    f->kernels->compose(row, albedo, light, row, FV_TILE);
}

static void show_row(const struct fv_frame *f, const struct fv_tile *tile, int y, const uint32_t *colour)
{
    uint8_t *rgbx = (uint8_t *)f->buffer[FV_PICTURE][tile->eye] + 4 * ((tile->y0 + y) * f->stride + tile->x0);
    f->kernels->present(colour, rgbx, FV_TILE);
    if (f->overlay) overlay_row(f, tile, y, colour, rgbx);
}

static void show_coarse(const struct fv_frame *f, const struct fv_tile *tile)
{
    const struct fv_raster *r = &f->raster[FV_COARSE][tile->eye];
    _Alignas(64) uint32_t row[3][FV_TILE] = {{0}};
    _Alignas(64) uint32_t colour[FV_TILE];
    int x0 = tile->x0 / 2, y0 = tile->y0 / 2;
    for (int y = 0; y < HALF; y++) __builtin_prefetch(r->colour + (y0 + y) * r->stride + x0);
    take_row(f, r, x0, y0 - 1, row[2]);
    take_row(f, r, x0, y0, row[0]);
    for (int y = 0; y < HALF; y++) {
        take_row(f, r, x0, y0 + y + 1, row[(y + 1) % 3]);
        for (int lower = 0; lower < 2; lower++) {
            f->kernels->double_row(row[y % 3], row[(y + (lower ? 1 : 2)) % 3], colour, HALF);
            show_row(f, tile, 2 * y + lower, colour);
        }
    }
}

static int run(struct fv_frame *f, const struct fv_tile *tile)
{
    const uint32_t *colour = f->buffer[FV_COLOUR][tile->eye];
    int64_t plane = f->raster[FV_FINE][tile->eye].plane;
    _Alignas(64) uint32_t whole[FV_TILE];
    if (tile->density == FV_COARSE) show_coarse(f, tile);
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
                                        .reads = FV_BIT(FV_COLOUR) | FV_BIT(FV_COARSE_COLOUR),
                                        .writes = FV_BIT(FV_PICTURE),
                                        .run = run};
