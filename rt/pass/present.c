/* present: pixels to the 8-bit picture that the display takes, with the optional overlay of foveal
 * zones, gaze and sampled pixels. Run only for frames that the display wants. */
#include "rt/pass/doubled.h"
#include "rt/pass/unseen.h"

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

/* Far apart in memory, rows of the picture would be waited for one by one. */
enum { ROWS_AHEAD = 8 };

static uint8_t *picture_row(const struct fv_frame *f, const struct fv_tile *tile, int y)
{
    return (uint8_t *)f->buffer[f->fringe ? FV_GREEN : FV_PICTURE][tile->eye] + 4 * ((tile->y0 + y) * f->stride + tile->x0);
}

static void show_row(const struct fv_frame *f, const struct fv_tile *tile, int y, const uint32_t *colour)
{
    uint8_t *rgbx = picture_row(f, tile, y);
    if (y + ROWS_AHEAD < FV_TILE) fv_fetch(rgbx + 4 * ROWS_AHEAD * f->stride, 4 * FV_TILE);
    f->kernels->present(colour, rgbx, FV_TILE);
    if (f->overlay) overlay_row(f, tile, y, colour, rgbx);
    const struct fv_bend *bend = &f->view[tile->eye].bend;
    if (bend->masks && !f->fringe) fv_darken_unseen(bend, tile->x0, tile->y0 + y, FV_TILE, (uint32_t *)(void *)rgbx);
}

static void show_coarse(const struct fv_frame *f, const struct fv_tile *tile)
{
    struct fv_doubled doubled;
    _Alignas(64) uint32_t colour[FV_TILE];
    fv_doubled_take(f, tile, &doubled);
    for (int y = 0; y < FV_TILE; y++) {
        fv_doubled_row(f, &doubled, y, colour);
        show_row(f, tile, y, colour);
    }
}

static int run(struct fv_frame *f, const struct fv_tile *tile)
{
    bool smoothed = f->state && f->state[tile->index].smoothed;
    const uint32_t *colour = f->buffer[smoothed ? FV_SMOOTHED : FV_COLOUR][tile->eye];
    int64_t plane = f->raster[FV_FINE][tile->eye].plane;
    _Alignas(64) uint32_t whole[FV_TILE];
    for (int y = 0; y < ROWS_AHEAD; y++) fv_fetch(picture_row(f, tile, y), 4 * FV_TILE);
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
                                        .reads = FV_BIT(FV_COLOUR) | FV_BIT(FV_COARSE_COLOUR) | FV_BIT(FV_COARSEST_COLOUR) |
                                                 FV_BIT(FV_SMOOTHED),
                                        .writes = FV_BIT(FV_PICTURE),
                                        .run = run};
