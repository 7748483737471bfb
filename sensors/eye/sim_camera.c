/* sim_camera: see the header. */
#include "sensors/eye/sim_camera.h"

#include "platform/arena.h"
#include "sensors/motion.h"

#include <string.h>

/* Targets of the calibration: 3 x 3, so far apart; frames at each. */
enum { TARGETS = 9, FRAMES = 2 };
static const double apart_deg[2] = {18, 11};

static void take(struct fv_sim_camera *s, int eye, const struct fv_eye_state *state, struct fv_eye_look *look)
{
    const struct fv_eye_camera *c = &s->camera[eye];
    struct fv_eye_frame frame = {s->pixels, c->width, c->height, c->width};
    fv_eye_image(c, state, s->pixels, c->width, NULL);
    fv_eye_tracker_frame(&s->tracker[eye], &frame, state->t_ns, look);
}

/* The eye looks at each target, as a user's does. */
static int calibrate(struct fv_sim_camera *s, int eye, struct fv_error *error)
{
    struct fv_gaze_target target[TARGETS * FRAMES];
    for (int i = 0; i < TARGETS * FRAMES; i++) {
        struct fv_eye_state state = {.t_ns = i + 1, .pupil_mm = 3.5 + 0.8 * (i % FRAMES), .open = 1};
        struct fv_eye_look look;
        int place = i / FRAMES;
        target[i].direction_deg[0] = apart_deg[0] * (place % 3 - 1);
        target[i].direction_deg[1] = apart_deg[1] * (place / 3 - 1);
        fv_gaze_vector(target[i].direction_deg, state.direction);
        state.direction[0] = -state.direction[0]; /* the camera faces the eye */
        take(s, eye, &state, &look);
        target[i].feature = look.feature;
        target[i].weight = look.seen ? look.confidence : 0;
    }
    struct fv_gaze_map map;
    enum fv_gaze_refusal refusal = fv_gaze_calibrate(target, TARGETS * FRAMES, &map);
    if (refusal != FV_GAZE_CALIBRATED)
        return fv_error_set(error, "the simulated camera's frames of %dx%d cannot be calibrated: %s",
                            s->camera[eye].width, s->camera[eye].height, fv_gaze_refusal_text[refusal]);
    s->tracker[eye].settings.map = map;
    memset(&s->tracker[eye].track, 0, sizeof s->tracker[eye].track);
    s->tracker[eye].usual = s->tracker[eye].ratio = 0;
    return 0;
}

int fv_sim_camera_open(struct fv_sim_camera *s, const struct fv_sim_camera_settings *settings,
                       struct fv_error *error)
{
    size_t bytes = fv_pupil_scratch_bytes(settings->width, settings->height);
    void *scratch = fv_arena_take(fv_arena(), "sensors", bytes, 64);
    memset(s, 0, sizeof *s);
    s->seed = settings->seed;
    s->period_ns = (int64_t)(1e9 / settings->hz);
    s->pixels = fv_arena_take(fv_arena(), "sensors", (size_t)settings->width * (size_t)settings->height, 64);
    fv_binocular_begin(&s->binocular, settings->settle_s);
    for (int eye = 0; eye < 2; eye++) {
        struct fv_eye_settings of_eye = settings->eye[eye];
        s->camera[eye] =
            fv_eye_camera_usual(settings->width, settings->height, settings->seed + (uint64_t)eye);
        of_eye.leds = s->camera[eye].leds;
        fv_eye_tracker_begin(&s->tracker[eye], &of_eye, scratch, bytes);
        if (of_eye.map.pupil.terms == 0 && calibrate(s, eye, error)) return -1;
    }
    return 0;
}

static void take_both(struct fv_sim_camera *s, int64_t t_ns)
{
    struct fv_eye_look look[2];
    struct fv_gaze_sample sample;
    for (int eye = 0; eye < 2; eye++) {
        struct fv_eye_state state;
        fv_eye_state_at(s->seed, eye, t_ns, &state);
        take(s, eye, &state, &look[eye]);
    }
    if (!fv_binocular_add(&s->binocular, &look[0], &look[1], &sample)) return;
    if (s->samples == FV_SIM_CAMERA_HISTORY)
        memmove(s->sample, s->sample + 1, sizeof s->sample - sizeof s->sample[0]);
    else s->samples++;
    s->sample[s->samples - 1] = sample;
}

int fv_sim_camera_until(struct fv_sim_camera *s, int64_t t_ns)
{
    int64_t into_ns, due = fv_motion_epoch(t_ns, s->period_ns, &into_ns);
    if (s->begun && due <= s->newest) return s->samples;
    bool gap = !s->begun || due - s->newest > FV_SIM_CAMERA_HISTORY;
    for (int64_t n = gap ? due - (FV_SIM_CAMERA_HISTORY - 1) : s->newest + 1; n <= due; n++)
        take_both(s, n * s->period_ns);
    s->begun = true;
    s->newest = due;
    return s->samples;
}
