/* kms_copy: see kms.h. Write-combined memory is fast where whole cache lines are written in order, and slow where it
 * is read: every word is made in a register and stored once. */
#include "display/kms.h"

#include <string.h>

static void copy_row(uint8_t *restrict out, const uint8_t *restrict rgb, int width)
{
    for (int i = 0; i < width; i++) {
        uint32_t pixel;
        memcpy(&pixel, rgb + 4 * (size_t)i, sizeof pixel);
        pixel = (pixel & 0x0000ff00u) | (pixel & 0xffu) << 16 | (pixel >> 16 & 0xffu);
        memcpy(out + 4 * (size_t)i, &pixel, sizeof pixel);
    }
}

void fv_kms_copy(uint8_t *out, size_t out_stride, const uint8_t *rgb, size_t stride, int width, int height)
{
    for (int y = 0; y < height; y++, out += out_stride, rgb += stride) copy_row(out, rgb, width);
}
