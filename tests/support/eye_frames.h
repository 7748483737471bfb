/* eye_frames: the recorded infrared eye frames of shared/data, their labels, and frames made from them in
 * which no pupil is to be seen. For tests only. */
#ifndef FV_TESTS_EYE_FRAMES_H
#define FV_TESTS_EYE_FRAMES_H

#include "platform/files.h"
#include "rt/scene/build.h"
#include "tests/support/program.h"
#include "tests/support/random.h"

#include <math.h>

#define EYE_FRAMES FV_SOURCE_DIR "/../shared/data/eye"
enum { EYE_WIDTH = 640, EYE_HEIGHT = 400, EYE_PIXELS = EYE_WIDTH * EYE_HEIGHT };

struct eye_label {
    int frame;
    double x, y, major;
};

/* A picture's grey levels, or the least of its channels. Returns malloc'ed pixels. */
static inline uint8_t *eye_picture(const char *path, int *width, int *height)
{
    struct fv_error error;
    char *bytes;
    size_t size;
    uint8_t *pixels;
    int channels;
    if (fv_file_read(path, 1 << 30, &bytes, &size, &error)) fail_msg("%s", error.text);
    if (fv_image_decode((const uint8_t *)bytes, size, path, &pixels, width, height, &channels, &error))
        fail_msg("%s", error.text);
    free(bytes);
    for (int i = 0; i < *width * *height && channels > 1; i++) {
        uint8_t least = 255;
        for (int c = 0; c < channels && c < 3; c++)
            if (pixels[i * channels + c] < least) least = pixels[i * channels + c];
        pixels[i] = least;
    }
    return pixels;
}

/* Grey levels and classes (0 background, 1 sclera, 2 iris, 3 pupil) of a frame of openeds2020. */
static inline void eye_frame(int frame, uint8_t pixels[EYE_PIXELS], uint8_t classes[EYE_PIXELS])
{
    for (int mask = 0; mask < 2; mask++) {
        char path[512];
        int width, height;
        snprintf(path, sizeof path, EYE_FRAMES "/openeds2020/%d%s.png", frame, mask ? "_mask" : "");
        uint8_t *read = eye_picture(path, &width, &height);
        if (width != EYE_WIDTH || height != EYE_HEIGHT) fail_msg("%s: %dx%d", path, width, height);
        memcpy(mask ? classes : pixels, read, EYE_PIXELS);
        free(read);
    }
}

/* labels.csv; returns how many. */
static inline int eye_labels(struct eye_label *label, int most)
{
    FILE *f = fopen(EYE_FRAMES "/openeds2020/labels.csv", "r");
    char line[256];
    int n = 0;
    if (!f) fail_msg("no labels");
    while (n < most && fgets(line, sizeof line, f))
        n += sscanf(line, "%d,%*d,%lf,%lf,%lf", &label[n].frame, &label[n].x, &label[n].y, &label[n].major) ==
             4;
    fclose(f);
    return n;
}

static inline uint8_t eye_grey(double value)
{
    return (uint8_t)(value < 0 ? 0 : value > 255 ? 255 : value + 0.5);
}

/* About normal, deviation 1. */
static inline double eye_noise(uint64_t *seed)
{
    double sum = 0;
    for (int i = 0; i < 6; i++) sum += random_between(seed, -1, 1);
    return sum / sqrt(2);
}

/* Rows of the eye's opening, from the classes; top > bottom in columns without. */
static inline void eye_opening(const uint8_t *classes, int top[EYE_WIDTH], int bottom[EYE_WIDTH])
{
    for (int x = 0; x < EYE_WIDTH; x++) {
        top[x] = EYE_HEIGHT;
        bottom[x] = -1;
        for (int y = 0; y < EYE_HEIGHT; y++)
            if (classes[y * EYE_WIDTH + x]) {
                if (y < top[x]) top[x] = y;
                bottom[x] = y;
            }
    }
}

/* A lid drawn over the whole opening: skin between what is above and below it, a dark line where the lids
 * meet, and lashes from there down. */
static inline void eye_closed(uint8_t pixels[EYE_PIXELS], const uint8_t *classes, uint64_t seed)
{
    int top[EYE_WIDTH], bottom[EYE_WIDTH], first = EYE_WIDTH, last = 0;
    eye_opening(classes, top, bottom);
    for (int x = 0; x < EYE_WIDTH; x++) {
        if (bottom[x] < 0) continue;
        first = x < first ? x : first;
        last = x;
        int from = top[x] - 14 > 0 ? top[x] - 14 : 0,
            to = bottom[x] + 8 < EYE_HEIGHT - 6 ? bottom[x] + 8 : EYE_HEIGHT - 7;
        double above = 0, below = 0;
        for (int i = 0; i < 6; i++) {
            above += pixels[(from > i ? from - i : 0) * EYE_WIDTH + x] / 6.0;
            below += pixels[(to + i) * EYE_WIDTH + x] / 6.0;
        }
        for (int y = from; y <= to; y++) {
            double share = (double)(y - from) / (to - from), line = y - (to - 6);
            double grey = above + (below - above) * share + 2.5 * eye_noise(&seed);
            pixels[y * EYE_WIDTH + x] = eye_grey(grey * (1 - 0.5 * exp(-line * line / 6)));
        }
    }
    for (int i = 0; i < 40 && first < last; i++) {
        double x = random_between(&seed, first, last), y = bottom[(int)x] + 2,
               length = random_between(&seed, 15, 40);
        double angle = 1.57 - 0.8 * (x - 0.5 * (first + last)) / (last - first) + 0.3 * eye_noise(&seed);
        double bend = 0.01 * eye_noise(&seed);
        for (int s = 0; s < 2 * length && y > 2; s++, angle += bend) {
            x += 0.5 * cos(angle);
            y += 0.5 * sin(angle);
            if (x < 1 || y < 1 || x >= EYE_WIDTH - 2 || y >= EYE_HEIGHT - 2) break;
            uint8_t *p = &pixels[(int)y * EYE_WIDTH + (int)x];
            p[0] = (uint8_t)(p[0] * 3 / 4);
            p[1] = (uint8_t)(p[1] * 7 / 8);
        }
    }
}

/* The pupil filled with what lies around it: an iris without a pupil. */
static inline void eye_filled(uint8_t pixels[EYE_PIXELS], const struct eye_label *label, uint64_t seed)
{
    double radius = 0.5 * label->major + 5;
    for (int y = (int)(label->y - radius); y <= (int)(label->y + radius); y++)
        for (int x = (int)(label->x - radius); x <= (int)(label->x + radius); x++) {
            double dx = x - label->x, dy = y - label->y, off = hypot(dx, dy), sum = 0;
            if (off >= radius || x < 0 || y < 0 || x >= EYE_WIDTH || y >= EYE_HEIGHT) continue;
            for (int i = 0; i < 8; i++) {
                double angle = atan2(dy, dx) + 0.02 * i,
                       at = radius + 1 + i + 2 * random_between(&seed, 0, 1);
                int u = (int)fmin(fmax(label->x + at * cos(angle), 0), EYE_WIDTH - 1);
                int v = (int)fmin(fmax(label->y + at * sin(angle), 0), EYE_HEIGHT - 1);
                sum += pixels[v * EYE_WIDTH + u] / 8.0;
            }
            double share = fmin(1, (radius - off) / 5);
            uint8_t *p = &pixels[y * EYE_WIDTH + x];
            *p = eye_grey(share * (fmin(sum, 60) + 2 * eye_noise(&seed)) + (1 - share) * *p);
        }
}

#endif
