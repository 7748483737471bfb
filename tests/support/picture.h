/* picture: pictures read back and compared. For tests only. */
#ifndef FV_TESTS_PICTURE_H
#define FV_TESTS_PICTURE_H

#include "platform/files.h"
#include "rt/scene/build.h"
#include "tests/support/program.h"

#include <math.h>

struct picture {
    int width, height;
    uint8_t *rgb; /* malloc'ed */
};

static inline struct picture picture_read(const char *path)
{
    struct picture p;
    struct fv_error error;
    char *bytes;
    size_t size;
    int channels;
    if (fv_file_read(path, 1 << 30, &bytes, &size, &error)) fail_msg("%s", error.text);
    if (fv_image_decode((const uint8_t *)bytes, size, path, &p.rgb, &p.width, &p.height, &channels, &error))
        fail_msg("%s", error.text);
    assert_int_equal(channels, 3);
    free(bytes);
    return p;
}

/* Mean squared error of the channels, 0..255 each. */
static inline double picture_mse(const struct picture *a, const struct picture *b)
{
    double sum = 0;
    assert_int_equal(a->width, b->width);
    assert_int_equal(a->height, b->height);
    int n = 3 * a->width * a->height;
    for (int i = 0; i < n; i++) {
        double d = (double)a->rgb[i] - b->rgb[i];
        sum += d * d;
    }
    return sum / n;
}

/* Mean absolute difference of the channels, 0..255. */
static inline double picture_difference(const struct picture *a, const struct picture *b)
{
    double sum = 0;
    int n = 3 * a->width * a->height;
    for (int i = 0; i < n; i++) sum += abs(a->rgb[i] - b->rgb[i]);
    return sum / n;
}

static inline double picture_psnr(double mse)
{
    return mse > 0 ? 10 * log10(255.0 * 255.0 / mse) : 100;
}

#endif
