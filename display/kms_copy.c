/* kms_copy: see kms.h. Write-combined memory is fast where whole cache lines are written in order, and slow where it
 * is read: every word is made in a register and stored once. Where a driver's buffers are cached, stores that go past
 * the cache spare reading the lines first, and leave the cache to the next frame. */
#include "display/kms.h"

#include <string.h>
#ifdef __SSE2__
#include <emmintrin.h>
#endif

static void copy_pixels(uint8_t *restrict out, const uint8_t *restrict rgb, int count)
{
    for (int i = 0; i < count; i++) {
        uint32_t pixel;
        memcpy(&pixel, rgb + 4 * (size_t)i, sizeof pixel);
        pixel = (pixel & 0x0000ff00u) | (pixel & 0xffu) << 16 | (pixel >> 16 & 0xffu);
        memcpy(out + 4 * (size_t)i, &pixel, sizeof pixel);
    }
}

#ifdef __SSE2__
enum { STEP = 4 };

/* Four pixels at a time to where memory is aligned for it. Returns how many were copied. */
static int stream_pixels(uint8_t *restrict out, const uint8_t *restrict rgb, int count)
{
    const __m128i green = _mm_set1_epi32(0x0000ff00), low = _mm_set1_epi32(0xff);
    int i = 0;
    for (; i + STEP <= count; i += STEP) {
        __m128i p = _mm_loadu_si128((const __m128i *)(const void *)(rgb + 4 * (size_t)i));
        __m128i red = _mm_slli_epi32(_mm_and_si128(p, low), 16), blue = _mm_and_si128(_mm_srli_epi32(p, 16), low);
        p = _mm_or_si128(_mm_and_si128(p, green), _mm_or_si128(red, blue));
        _mm_stream_si128((__m128i *)(void *)(out + 4 * (size_t)i), p);
    }
    return i;
}
#endif

static void copy_row(uint8_t *restrict out, const uint8_t *restrict rgb, int width)
{
    int done = 0;
#ifdef __SSE2__
    int before = (int)(-(uintptr_t)out & 15) / 4; /* pixels up to where 16 bytes are aligned */
    if (((uintptr_t)out & 3) == 0 && before < width) {
        copy_pixels(out, rgb, before);
        done = before + stream_pixels(out + 4 * (size_t)before, rgb + 4 * (size_t)before, width - before);
    }
#endif
    copy_pixels(out + 4 * (size_t)done, rgb + 4 * (size_t)done, width - done);
}

void fv_kms_copy(uint8_t *out, size_t out_stride, const uint8_t *rgb, size_t stride, int width, int height)
{
    for (int y = 0; y < height; y++, out += out_stride, rgb += stride) copy_row(out, rgb, width);
#ifdef __SSE2__
    _mm_sfence(); /* before the flip is asked for */
#endif
}
