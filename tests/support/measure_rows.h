/* measure_rows: made-up rows of a sweep, numerics and pictures, for the tests of measure's page. */
#ifndef FV_TESTS_MEASURE_ROWS_H
#define FV_TESTS_MEASURE_ROWS_H

#include "cli/measure_page.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <turbojpeg.h>

struct sample_method {
    const char *name;
    int levels;
    double speedup, speedup_step; /* of the first level, and from level to level */
    double fovea_db, fovea_step, far_db, far_step;
};

static const struct sample_method sample_methods[] = {
    {"full", 6, 1, 0.52, 31.1, 2.9, 31.6, 2.8},         {"reproject", 8, 2.1, 1.14, 31.2, -0.35, 31.4, -1.2},
    {"selective", 6, 0.55, 1.35, 39.6, -1.5, 34.4, -1}, {"denoise", 5, 1.1, 1.2, 34.2, -0.9, 32.6, -0.8},
    {"pyramid", 7, 1.6, 1.25, 33.0, -0.6, 30.5, -1.5},
};
enum { SAMPLE_METHODS = sizeof sample_methods / sizeof sample_methods[0] };

static inline struct fv_measured sample_spread(double value, double by)
{
    return (struct fv_measured){value, value - by, value + by};
}

/* All rows of a scene; returns their number. */
static inline int sample_scene(const char *scene, double full_ms, double harder_db,
                               struct fv_measure_row *row)
{
    int rows = 0;
    for (int m = 0; m < SAMPLE_METHODS; m++) {
        const struct sample_method *method = &sample_methods[m];
        for (int level = 0; level < method->levels; level++) {
            struct fv_measure_row *r = &row[rows++];
            memset(r, 0, sizeof *r);
            snprintf(r->scene, sizeof r->scene, "%s", scene);
            snprintf(r->method, sizeof r->method, "%s", method->name);
            snprintf(r->about, sizeof r->about,
                     "rift-dk2, 1182 x 1464 px, left eye; AMD EPYC, avx512, 2 threads; reference 256 samples "
                     "a pixel");
            if (m == 0) snprintf(r->parameters, sizeof r->parameters, "spp=%d", 1 << level);
            else
                snprintf(r->parameters, sizeof r->parameters, "r0=%.3g r1=%.3g p_min=%.3g", 10 - 0.8 * level,
                         20 - 1.5 * level, 0.05 / (level + 1));
            r->level = level;
            r->frames = 60;
            r->pictures = 8;
            double speedup = method->speedup * pow(method->speedup_step, level);
            r->speedup = sample_spread(speedup, 0.05 * speedup);
            r->frame_ms =
                (struct fv_measured){full_ms / speedup, 0.93 * full_ms / speedup, 1.09 * full_ms / speedup};
            r->frame_ms_p99 = 1.3 * r->frame_ms.value;
            r->full_frame_ms = sample_spread(full_ms, 0.04 * full_ms);
            r->rays = 3.1e6 / speedup;
            r->sampled_fraction = m == 0 ? 1 : 0.16 / (1 + 0.2 * level);
            for (int z = 0; z < FV_ZONES; z++) {
                double part = z == FV_ZONE_ALL ? 0.7 : z / 4.0;
                double db = (1 - part) * (method->fovea_db + method->fovea_step * level) +
                            part * (method->far_db + method->far_step * level) - harder_db;
                double rmse = pow(10, -db / 20);
                r->psnr[z] = sample_spread(db, 1.2);
                r->rmse[z] = (struct fv_measured){rmse, rmse * 0.87, rmse * 1.15};
                r->ssim[z] = sample_spread(1 - rmse * 1.8, 0.3 * rmse);
                r->flip[z] = sample_spread(rmse * 1.9, 0.25 * rmse);
            }
            r->flicker = sample_spread(m == 0 ? 0.001 : 0.002 + 0.0006 * level, 0.0004);
        }
    }
    return rows;
}

static inline int sample_numerics(struct fv_numeric_row *row)
{
    static const struct fv_numeric_row rows[] = {
        {"IMU integration", "Euler", "1000 Hz", 0.031, 0.094, "deg", 7.1, "ns/sample"},
        {"IMU integration", "midpoint", "1000 Hz", 0.0012, 0.0041, "deg", 11.3, "ns/sample"},
        {"IMU integration", "exact rotation", "1000 Hz", 0.00021, 0.00088, "deg", 14.9, "ns/sample"},
        {"IMU integration", "exact rotation", "100 Hz", 0.021, 0.088, "deg", 14.9, "ns/sample"},
        {"reprojection", "nearest", "depth, 8 px mesh", 0.0081, 0.11, "relative", 1.21, "ns/pixel"},
        {"reprojection", "bilinear", "depth, 8 px mesh", 0.0021, 0.094, "relative", 2.6, "ns/pixel"},
        {"gaze prediction", "constant velocity", "20 ms ahead", 0.42, 3.1, "deg", NAN, ""},
        {"head prediction", "constant turn", "30 ms ahead", 0.061, 0.55, "deg", NAN, ""},
    };
    memcpy(row, rows, sizeof rows);
    return sizeof rows / sizeof rows[0];
}

/* A grey-to-colour picture, or a difference, as a JPEG file in the folder. */
static inline void sample_picture(const char *folder, const char *name, int strength)
{
    enum { WIDTH = 240, HEIGHT = 296 };
    static unsigned char rgb[WIDTH * HEIGHT * 3];
    bool difference = strstr(name, "difference") != NULL;
    unsigned char *jpeg = NULL;
    unsigned long size = 0;
    char path[512];
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        int x = i % WIDTH, y = i / WIDTH;
        double far = hypot(x - WIDTH / 2, y - HEIGHT / 2) / (WIDTH / 2);
        double ripple = 0.5 + 0.5 * sin(0.11 * x * far) * cos(0.07 * y);
        double grain = (x * 7919 + y * 104729 + x * y * 31) % 64 / 64.0 * 0.03 * strength * far;
        double level = difference ? fmin(grain + 0.08 * strength * far * ripple, 1)
                                  : fmin(0.3 + 0.5 * ripple + grain, 1);
        rgb[3 * i] = (unsigned char)(255 * level);
        rgb[3 * i + 1] = (unsigned char)(difference ? 255 * level : 60 + 150 * level * (1 - 0.4 * far));
        rgb[3 * i + 2] = (unsigned char)(difference ? 255 * level : 90 + 120.0 * y / HEIGHT);
    }
    tjhandle encoder = tjInitCompress();
    if (tjCompress2(encoder, rgb, WIDTH, 0, HEIGHT, TJPF_RGB, &jpeg, &size, TJSAMP_444, 90, 0)) abort();
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *f = fopen(path, "wb");
    if (!f || fwrite(jpeg, 1, size, f) != size) abort();
    fclose(f);
    tjFree(jpeg);
    tjDestroy(encoder);
}

static inline void sample_pictures(const char *folder, const struct fv_measure_row *row, int rows)
{
    char name[192];
    for (int i = 0; i < rows; i++) {
        snprintf(name, sizeof name, "%.63s-%.31s-%d.jpg", row[i].scene, row[i].method, row[i].level);
        sample_picture(folder, name, 1 + row[i].level);
        snprintf(name, sizeof name, "%.63s-%.31s-%d-difference.jpg", row[i].scene, row[i].method, row[i].level);
        sample_picture(folder, name, 1 + row[i].level);
        snprintf(name, sizeof name, "%.63s-reference.jpg", row[i].scene);
        if (i == 0) sample_picture(folder, name, 0);
    }
}

#endif
