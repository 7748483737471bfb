/* present: pixels to the 8-bit picture that the display takes, with the optional overlay of foveal
 * zones, gaze and sampled pixels. Run only for frames that the display wants. */
#include "rt/pass/reproject.h"

#include <math.h>

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

static int run(struct fv_frame *f, const struct fv_tile *tile)
{
    const uint32_t *colour = f->buffer[FV_COLOUR][tile->eye];
    uint8_t *picture = f->buffer[FV_PICTURE][tile->eye];
    for (int y = 0; y < FV_TILE; y++) {
        int64_t at = fv_tile_row(f, tile, y);
        f->kernels->present(colour + at, picture + 4 * at, FV_TILE);
        if (f->overlay) overlay_row(f, tile, y, colour + at, picture + 4 * at);
    }
    return 1;
}

const struct fv_pass fv_pass_present = {
    .name = "present", .reads = FV_BIT(FV_COLOUR), .writes = FV_BIT(FV_PICTURE), .run = run};
