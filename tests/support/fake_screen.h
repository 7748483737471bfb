/* fake_screen: a display opened on the made-up card of fake_drm.h, pictures whose pixels tell where they are, and what is
 * shown of them. For tests only. */
#ifndef FV_TESTS_FAKE_SCREEN_H
#define FV_TESTS_FAKE_SCREEN_H

#include "tests/support/fake_drm.h"

enum { SIDE = 32, WIDE = 80 };
static const int64_t ms = 1000000;

static struct fv_kms kms;
static struct fv_error error;
static uint8_t pixels[2][WIDE * WIDE * 4];

static inline struct fv_kms_settings wishes(void)
{
    return (struct fv_kms_settings){.buffers = 3, .eyes = 2, .width = SIDE, .height = SIDE, .hz = 500};
}

/* A picture whose every pixel tells where it is, and of which frame. */
static inline struct fv_picture picture(int eyes, int width, int height, int frame)
{
    for (int e = 0; e < eyes; e++)
        for (int y = 0; y < height; y++)
            for (int x = 0; x < width; x++) {
                uint8_t *p = &pixels[e][4 * (y * WIDE + x)];
                p[0] = (uint8_t)(100 * e + x), p[1] = (uint8_t)y, p[2] = (uint8_t)frame, p[3] = 77;
            }
    return (struct fv_picture){eyes, width, height, 4 * WIDE, {pixels[0], pixels[1]}};
}

static inline void opened(const struct fv_kms_settings *settings)
{
    if (fv_kms_open(&kms, settings, &fake_io, &error)) fail_msg("%s", error.text);
    assert_true(fake.console && fake.ours && fake.blobs == 0);
}

static inline void closed(void)
{
    fv_kms_close(&kms);
    fake_left();
    assert_int_equal(fake.crtc[0].fb, FAKE_CONSOLE);
    assert_true(fake.crtc[0].on && fake.crtc[0].connector == FAKE_CONNECTOR && !fake.crtc[1].on);
    assert_int_equal(fake.crtc[0].mode.hdisplay, 164);
}

static inline enum fv_kms_event present(int frame)
{
    struct fv_picture p = picture(2, SIDE, SIDE, frame);
    return fv_kms_present(&kms, &p);
}

/* What a CRTC shows at a pixel: blue, green, red in the low bytes. */
static inline uint32_t shown(int crtc, int x, int y)
{
    int b = fake_buffer_of(fake.crtc[crtc].fb);
    uint32_t pixel;
    memcpy(&pixel, fake.buffer[b].memory + (size_t)y * fake.buffer[b].pitch + 4 * (size_t)x, sizeof pixel);
    return pixel & 0xffffff;
}

static inline uint32_t expected(int eye, int x, int y, int frame)
{
    return (uint32_t)((100 * eye + x) << 16 | y << 8 | frame);
}

/* Until the flip is over. */
static inline void settle(void)
{
    fake.t_ns += 3 * fake.period_ns;
    struct fv_beat beat;
    fv_kms_beat(&kms, &beat);
}

#endif
