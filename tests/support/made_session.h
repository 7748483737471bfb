/* made_session: a session of made-up frames, its settings and picture, and the folder that its report goes into. For tests
 * only. */
#ifndef FV_TESTS_MADE_SESSION_H
#define FV_TESTS_MADE_SESSION_H

#include "cli/report.h"
#include "platform/files.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

enum { RECORDS = 9000, WIDTH = 236, HEIGHT = 292 };

static char folder[256];
static struct fv_error error;
static struct fv_config config;
static struct fv_session session;
static struct fv_frame_record records[RECORDS];
static uint8_t pixels[2][WIDTH * HEIGHT * 4];
static const struct fv_picture picture = {2, WIDTH, HEIGHT, WIDTH * 4, {pixels[0], pixels[1]}};

static inline double noise(uint32_t *state)
{
    *state = *state * 1664525 + 1013904223;
    return (*state >> 8) / 16777216.0;
}

static inline void make_records(int frames, double period_ms)
{
    static const double parts[] = {0.03, 0.44, 0.31, 0.14, 0.05};
    uint32_t state = 7;
    double load = 0;
    memset(records, 0, sizeof records);
    for (int i = 0; i < frames; i++) {
        struct fv_frame_record *r = &records[i];
        load = 0.97 * load + 0.06 * (noise(&state) - 0.5);
        double ms = period_ms * (0.78 + load + 0.07 * noise(&state) + 0.08 * sin(i * 0.02));
        if (i % 97 == 50) ms *= 1.6 + 2 * noise(&state);
        r->frame = i;
        r->t_ns = 5000000000 + (int64_t)(i * period_ms * 1e6);
        r->frame_ms = (float)ms;
        r->cpu_ms = (float)(ms * 1.9);
        for (int k = 0; k < 5; k++) r->stage_ms[k] = (float)(ms * parts[k] * (0.9 + 0.2 * noise(&state)));
        r->level = i % 97 > 50 && i % 97 < 70 ? 4 : 2;
        r->r0_deg = r->level == 4 ? 7.5f : 10;
        r->r1_deg = 20;
        r->p_min = r->level == 4 ? 0.02f : 0.05f;
        r->rays[FV_RAY_PRIMARY] = 412345 + i;
        r->rays[FV_RAY_SHADOW] = 850000 + 3 * i;
        r->rays[FV_RAY_SECONDARY] = 22000;
        r->sampled_fraction = 0.124f;
        r->gaze_px[0][0] = 591.5f;
        r->missed = ms > period_ms;
        r->cut = i % 50 == 7;
    }
}

/* A session of `frames` frames, of which `capacity` are kept. */
static inline void make_session(int frames, int capacity)
{
    static const char *const stages[] = {"latch", "trace", "reproject", "shade", "present"};
    static const struct fv_plan_row plan[] = {
        {"primary rays", "pass", "every method traces them", true, 0},
        {"history", "buffer", "reprojection reads the last frame", true, 41533440},
        {"support image", "buffer", "fills what was not sampled, every 8 px", true, 655360},
        {"alpha test", "feature", "the scene has no masked materials", false, 0},
        {"normal maps", "feature", "the scene has none", false, 0},
        {"march", "pass", "the scene has no fields", false, 20766720},
    };
    memset(&session, 0, sizeof session);
    make_records(frames < RECORDS ? frames : RECORDS, 1000.0 / 75);
    session = (struct fv_session){.scene = "atrium",
                                  .method = "reproject",
                                  .triangles = 262267,
                                  .fields = 0,
                                  .cpu = "ARM Cortex-A78AE",
                                  .isa = "neon",
                                  .threads = 8,
                                  .period_ms = 1000.0 / 75,
                                  .stages = 5,
                                  .pixels = 2 * WIDTH * HEIGHT,
                                  .frames = frames,
                                  .capacity = capacity,
                                  .record = records,
                                  .gaze_samples = 1600,
                                  .gaze_lost = 23,
                                  .imu_samples = 6667,
                                  .gaze_latency_ms_p50 = 4.2,
                                  .plan_rows = 6};
    for (int i = 0; i < 5; i++) session.stage[i] = stages[i];
    memcpy(session.plan, plan, sizeof plan);
    for (int i = 0; i < (frames < RECORDS ? frames : RECORDS); i++) {
        session.missed += records[i].missed;
        session.cut_frames += records[i].cut;
    }
}

static inline const char *path_of(const char *name)
{
    static char path[FV_PATH_MAX];
    fv_path_join(path, folder, name);
    return path;
}

static inline char *text_of(const char *name)
{
    char *text;
    size_t size;
    assert_int_equal(fv_file_read(path_of(name), 1 << 26, &text, &size, &error), 0);
    assert_int_equal(strlen(text), size);
    return text;
}

static inline void make_picture(void)
{
    for (int eye = 0; eye < 2; eye++) {
        for (int i = 0; i < WIDTH * HEIGHT; i++) {
            int x = i % WIDTH + 6 * eye, y = i / WIDTH;
            bool tile = (x / 20 + y / 20) & 1;
            uint8_t rgb[4] = {(uint8_t)(60 + x / 2), (uint8_t)(tile ? 120 : 90), (uint8_t)(200 - y / 2), 0};
            memcpy(pixels[eye] + 4 * i, rgb, 4);
        }
    }
}

#endif
