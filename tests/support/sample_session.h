/* sample_session: a made-up session that adapts: another program takes half of the machine from one third
 * of the frames to two thirds; the level goes down at once and comes back step by step. For tests only. */
#ifndef FV_TESTS_SAMPLE_SESSION_H
#define FV_TESTS_SAMPLE_SESSION_H

#include "rt/frame/session.h"
#include "tests/support/random.h"

#include <math.h>
#include <string.h>

enum { SAMPLE_LEVELS = 12, SAMPLE_RECORDS = 9000 };

/* Share of the full work that a level of the made-up table is. */
static inline double sample_work(int level)
{
    return 0.18 + 0.82 * pow(0.8, level - 1);
}

static inline void sample_frame(struct fv_frame_record *r, int i, int frames, int *level, int *quiet,
                                uint64_t *random)
{
    static const double parts[] = {0.02, 0.11, 0.25, 0.6};
    const double period_ms = 1000.0 / 75;
    bool loaded = i >= frames / 3 && i < 2 * frames / 3;
    double scene = 11 + 1.5 * sin(i * 0.006) + 0.5 * sin(i * 0.05);
    double stretch = (loaded ? 2.1 : 1) * (1 + random_between(random, 0, 0.05));
    double spike = loaded && i % 41 == 0 ? 1.6 : 1;
    double ms = 0.6 + scene * stretch * spike * sample_work(*level), kept = 1;
    if (ms > 0.96 * period_ms) kept = fmax(0.3, (0.96 * period_ms - 0.6) / (ms - 0.6));
    int cut = (int)(1500 * (1 - kept));
    ms = cut ? 0.97 * period_ms : ms;
    if (i % 701 == 350) ms *= 1.5;
    memset(r, 0, sizeof *r);
    r->frame = i;
    r->t_ns = 5000000000 + (int64_t)(i * period_ms * 1e6);
    r->frame_ms = (float)ms;
    r->cpu_ms = (float)(ms * 1.9 / (loaded ? 2 : 1));
    for (int k = 0; k < 4; k++) r->stage_ms[k] = (float)((ms - 0.1) * parts[k]);
    r->stage_ms[4] = i % 10 == 0 ? 0.4f : 0;
    r->control_ms = (float)(random_between(random, 0.02, 0.03));
    r->idle_ms = (float)(ms * random_between(random, 0, 0.04));
    r->predicted_ms = (float)(ms * random_between(random, 0.95, 1.05));
    r->budget_ms = (float)(0.9 * period_ms);
    r->latch_ms = (float)(1.1 * ms);
    r->level = *level;
    r->periods = 1;
    r->cut_tiles = cut;
    r->cut = cut > 0;
    r->missed = ms > period_ms;
    r->late_stages = r->missed ? 8 : 0;
    r->decision = (struct fv_decision){.t_ns = r->t_ns, .level = *level, .done = {-1, -1, -1, cut ? 2900 - cut : -1, -1}};
    r->r0_deg = (float)fmax(3.2, 15 - 1.1 * *level + random_between(random, 0, 0.3));
    r->r1_deg = 2 * r->r0_deg;
    r->p_min = (float)(0.2 * pow(0.75, *level));
    r->sampled_fraction = (float)(0.3 * sample_work(*level) * kept);
    r->rays[FV_RAY_PRIMARY] = (int64_t)(3e6 * sample_work(*level) * kept);
    r->rays[FV_RAY_SHADOW] = 2 * r->rays[FV_RAY_PRIMARY];
    /* The next frame's level. */
    double room = 0.9 * period_ms;
    bool fits_better = *level > 1 && 0.6 + scene * stretch * sample_work(*level - 1) < 0.85 * room;
    *quiet = fits_better ? *quiet + 1 : 0;
    while (*level < SAMPLE_LEVELS && 0.6 + scene * stretch * sample_work(*level) > room) ++*level, *quiet = 0;
    if (*quiet > 3) --*level, *quiet = 0;
}

/* `frames` <= SAMPLE_RECORDS, all recorded. */
static inline void sample_session(struct fv_session *s, struct fv_frame_record *records, int frames)
{
    static const char *const stages[] = {"select", "support", "reproject", "sample", "present"};
    uint64_t random = 7;
    int level = 3, quiet = 0;
    *s = (struct fv_session){.scene = "sponza",
                             .method = "reproject",
                             .triangles = 262267,
                             .cpu = "ARM Cortex-A78AE",
                             .isa = "neon",
                             .threads = 2,
                             .period_ms = 1000.0 / 75,
                             .stages = 5,
                             .pixels = 2 * 1182 * 1464,
                             .frames = frames,
                             .capacity = SAMPLE_RECORDS,
                             .skipped = 3,
                             .levels = SAMPLE_LEVELS,
                             .record = records};
    for (int i = 0; i < 5; i++) s->stage[i] = stages[i];
    for (int i = 0; i < frames; i++) {
        sample_frame(&records[i], i, frames, &level, &quiet, &random);
        s->missed += records[i].missed;
        s->cut_frames += records[i].cut;
    }
    for (int i = 0; i < 24; i++) {
        struct fv_ring *ring = &s->ring[i];
        ring->tiles = frames * (int64_t)(10 + 12 * i);
        ring->cut = i < 9 ? 0 : (i - 8) * (i - 8) * s->cut_frames / 4;
        ring->units = (int64_t)((double)ring->tiles * (i < 5 ? 1024 : 1024 * pow(0.75, i - 4)));
        ring->cpu_ns = (double)ring->units * (310 + 14 * i + (i > 4 ? 60 : 0));
    }
}

#endif
