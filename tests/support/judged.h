/* judged: small pictures made up in memory, and their metrics. For tests only. */
#ifndef FV_TESTS_JUDGED_H
#define FV_TESTS_JUDGED_H

#include "rt/measure/metrics.h"
#include "tests/support/program.h"

#include <math.h>

enum { JUDGED_BYTES = 3 * 256 * 256 };

struct judged {
    int width, height;
    uint8_t reference[JUDGED_BYTES], test[JUDGED_BYTES], zone[JUDGED_BYTES / 3];
    float flip[JUDGED_BYTES / 3];
    struct fv_errors errors;
};

static inline void judged_size(struct judged *j, int width, int height)
{
    assert_true(width * height * 3 <= JUDGED_BYTES);
    memset(j, 0, sizeof *j);
    j->width = width;
    j->height = height;
}

static inline uint32_t judged_random(uint32_t *state)
{
    *state = *state * 1664525u + 1013904223u;
    return *state >> 8;
}

/* Noise of some contrast over soft patches; the test picture differs by noise of another. */
static inline void judged_noise(struct judged *j, int width, int height, uint32_t seed, int contrast,
                                int error)
{
    judged_size(j, width, height);
    for (int i = 0; i < 3 * width * height; i++) {
        int x = i / 3 % width, y = i / 3 / width;
        double patch = 128 + 100 * sin(0.3 * x + i % 3) * cos(0.2 * y);
        int a = (int)patch + (int)(judged_random(&seed) % (unsigned)(2 * contrast + 1)) - contrast;
        int b = a + (int)(judged_random(&seed) % (unsigned)(2 * error + 1)) - error;
        j->reference[i] = (uint8_t)(a < 0 ? 0 : a > 255 ? 255 : a);
        j->test[i] = (uint8_t)(b < 0 ? 0 : b > 255 ? 255 : b);
    }
}

static inline void judged_fill(uint8_t *pixels, int count, int red, int green, int blue)
{
    for (int i = 0; i < count; i++) {
        pixels[3 * i] = (uint8_t)red;
        pixels[3 * i + 1] = (uint8_t)green;
        pixels[3 * i + 2] = (uint8_t)blue;
    }
}

static inline void judge(struct judged *j, double ppd, struct fv_workers *workers)
{
    struct fv_metrics_picture a = {j->width, j->height, 3, 3 * j->width, j->reference}, b = a;
    struct fv_metrics *metrics = fv_metrics_open(j->width, j->height, ppd);
    b.pixel = j->test;
    fv_metrics_compare(metrics, workers, &a, &b, j->zone, &j->errors);
    memcpy(j->flip, fv_metrics_flip_map(metrics), (size_t)(j->width * j->height) * sizeof j->flip[0]);
}

static inline void check_near(const char *what, double value, double expected, double tolerance)
{
    if (!(fabs(value - expected) <= tolerance)) fail_msg("%s: %.9g, must be %.9g", what, value, expected);
}

#endif
