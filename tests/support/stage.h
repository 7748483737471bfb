/* stage: a loop of any method over a built-in scene, by settings, its pictures and what they are worth against each
 * other. For tests only. */
#ifndef FV_TESTS_STAGE_H
#define FV_TESTS_STAGE_H

#include "rt/frame/loop.h"
#include "rt/scene/path.h"
#include "tests/support/program.h"

#include <math.h>

enum { STAGE_SETS = 20 };

struct stage {
    struct fv_config config;
    struct fv_scene scene;
    struct fv_tracer tracer;
    struct fv_plan plan;
    struct fv_session session;
    struct fv_loop loop;
    struct fv_frame_record record; /* of the newest frame */
    bool shares;                   /* another's scene and tracer */
};

/* `size`: pixels a side, over 90 degrees. `sets`, `more`: lists that end with NULL, or NULL; later ones win. */
static inline void stage_set(struct stage *s, int size, const char *const *sets, const char *const *more)
{
    struct fv_error error;
    struct fv_config_request q = {.sets = 3, .set = {"display.eyes=1", "display.sink=none", "selective.smooth=0"}};
    for (; sets && *sets; sets++) q.set[q.sets++] = *sets;
    for (; more && *more; more++) q.set[q.sets++] = *more;
    assert_true(q.sets <= STAGE_SETS);
    memset(s, 0, sizeof *s);
    if (fv_config_load(&s->config, &q, &error)) fail_msg("%s", error.text);
    s->config.display_width = s->config.display_height = size;
    s->config.display_fov_in_deg = s->config.display_fov_out_deg = 45;
    s->config.display_fov_up_deg = s->config.display_fov_down_deg = 45;
}

/* Of all stages: a process has one set of more than one worker. */
static inline struct fv_workers *stage_workers(void)
{
    static struct fv_workers two;
    if (two.count == 0) fv_workers_start(&two, 2);
    return &two;
}

static inline void stage_loop(struct stage *s, struct fv_workers *workers)
{
    fv_frame_size(&s->loop.frame, &s->config);
    fv_plan_make(&s->plan, fv_method_find(s->config.method_name), s->tracer.data, &s->config, &s->loop.frame);
    fv_loop_open(&s->loop, &s->config, &s->plan, &s->tracer, workers, &s->session, 1);
}

/* The stage's own scene, from here on. */
static inline void stage_open(struct stage *s, struct fv_workers *workers)
{
    struct fv_error error;
    if (fv_tracer_open(&s->tracer, &s->scene, &s->config, &error)) fail_msg("%s", error.text);
    stage_loop(s, workers);
}

/* All of it: the settings, the scene that they name, and the loop. */
static inline void stage_begin(struct stage *s, int size, const char *const *sets, const char *const *more,
                               struct fv_workers *workers)
{
    struct fv_error error;
    stage_set(s, size, sets, more);
    if (fv_scene_load(&s->scene, &s->config, &error)) fail_msg("%s", error.text);
    stage_open(s, workers);
}

/* Another's scene, with this one's settings of the methods. */
static inline void stage_share(struct stage *s, const struct stage *of, struct fv_workers *workers)
{
    s->tracer = of->tracer;
    s->tracer.depth = (int)s->config.method_depth;
    s->tracer.area_spp = (int)s->config.method_area_spp;
    s->shares = true;
    stage_loop(s, workers);
}

static inline void stage_close(struct stage *s)
{
    if (!s->shares) fv_tracer_close(&s->tracer);
}

/* From there; the gaze to the right. */
static inline void stage_frame_from(struct stage *s, const struct fv_pose *head, double gaze_deg, int64_t t_ns)
{
    double gaze[2][3] = {{sin(gaze_deg * M_PI / 180), 0, -cos(gaze_deg * M_PI / 180)}};
    memcpy(gaze[1], gaze[0], sizeof gaze[1]);
    fv_loop_frame(&s->loop, head, gaze, 0, t_ns, &s->record);
}

/* From where the scene's path begins, turned by yaw. */
static inline void stage_frame(struct stage *s, double yaw_deg, double gaze_deg, int64_t t_ns)
{
    struct fv_pose stand, turn = {{0, 0, 0}, {1, 0, 0, 0}}, head;
    fv_path_pose(&s->config.scene_path, s->config.scene_path_seconds, 0, &stand);
    fv_quat_from_yaw_pitch_roll(yaw_deg * M_PI / 180, 0, 0, turn.rotation);
    fv_pose_compose(&stand, &turn, &head);
    stage_frame_from(s, &head, gaze_deg, t_ns);
}

static inline const uint32_t *stage_row(const struct stage *s, int y)
{
    return (const uint32_t *)s->loop.frame.buffer[FV_COLOUR][0] + y * s->loop.frame.stride;
}

static inline float stage_eccentricity(const struct stage *s, int x, int y)
{
    return fv_eccentricity_deg(&s->loop.frame.view[0], (float)x + 0.5f, (float)y + 0.5f);
}

/* Largest difference of two pixels' channels, in codes of 0 to 1023. */
static inline int stage_step(uint32_t a, uint32_t b)
{
    int most = 0;
    for (int c = 0; c < 3; c++) {
        int d = abs((int)(a >> 10 * c & 1023) - (int)(b >> 10 * c & 1023));
        if (d > most) most = d;
    }
    return most;
}

/* dB, over the pixels of eccentricities between two, but for those at the picture's border. 100: the same. */
static inline double stage_psnr(const struct stage *a, const struct stage *b, double from_deg, double to_deg)
{
    double sum = 0, n = 0;
    for (int y = 1; y < a->loop.frame.height - 1; y++)
        for (int x = 1; x < a->loop.frame.width - 1; x++) {
            double e = (double)stage_eccentricity(a, x, y);
            if (e < from_deg || e > to_deg) continue;
            for (int c = 0; c < 3; c++, n++) sum += pow((double)(stage_row(a, y)[x] >> 10 * c & 1023) - (double)(stage_row(b, y)[x] >> 10 * c & 1023), 2);
        }
    assert_true(n > 0);
    return sum > 0 ? 10 * log10(1023.0 * 1023 * n / sum) : 100;
}

#endif
