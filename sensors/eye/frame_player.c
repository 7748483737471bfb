/* frame_player: see the header. */
#include "sensors/eye/frame_player.h"

#include "platform/arena.h"
#include "sensors/motion.h"

#include <string.h>

/* Of a tape of one frame. */
static const int64_t period_least_ns = 1000000, period_usual_ns = 8333333;
/* When asked after a gap only so much before then is looked at. */
static const int64_t catch_up_ns = 150000000;

static void step(struct fv_frame_player *p, int eye)
{
    int64_t after_ns = p->next[eye].bytes ? p->next[eye].t_ns : INT64_MIN;
    p->next[eye].bytes = fv_frame_tape_next(&p->tape[eye], &p->next[eye].at, after_ns, &p->next[eye].t_ns);
}

static void rewind_tapes(struct fv_frame_player *p)
{
    for (int eye = 0; eye < p->eyes; eye++) {
        p->next[eye].at = p->tape[eye].begin;
        p->next[eye].bytes = NULL;
        step(p, eye);
        memset(&p->tracker[eye].track, 0, sizeof p->tracker[eye].track);
    }
}

static int open_eye(struct fv_frame_player *p, int eye, const char *path,
                    const struct fv_eye_settings *settings, struct fv_error *error)
{
    struct fv_frame_tape *t = &p->tape[eye];
    if (fv_frame_tape_read(t, path, error)) return -1;
    const struct fv_camera_layout *l = &t->layout;
    if (settings->width > 0 && (settings->width != l->width || settings->height != l->height))
        return fv_error_set(error, "%s: frames are %dx%d, calibrated were %dx%d", path, l->width, l->height,
                            settings->width, settings->height);
    size_t bytes = fv_pupil_scratch_bytes(l->width, l->height);
    fv_eye_tracker_begin(&p->tracker[eye], settings, fv_arena_take(fv_arena(), "sensors", bytes, 64), bytes);
    if (eye == 0 || t->first_ns < p->first_ns) p->first_ns = t->first_ns;
    return 0;
}

int fv_frame_player_open(struct fv_frame_player *p, const char *folder,
                         const struct fv_eye_settings settings[2], double settle_s, struct fv_error *error)
{
    char path[FV_PATH_MAX];
    size_t most = 0;
    memset(p, 0, sizeof *p);
    for (int eye = 0; eye < 2; eye++) {
        if (fv_path_join(path, folder, fv_frame_tape_name[eye]))
            return fv_error_set(error, "%.100s: path too long", folder);
        if (eye == 1 && !fv_file_exists(path)) break;
        if (open_eye(p, eye, path, &settings[eye], error)) return -1;
        size_t bytes = (size_t)p->tape[eye].layout.width * (size_t)p->tape[eye].layout.height;
        most = bytes > most ? bytes : most;
        p->eyes++;
    }
    p->grey = fv_arena_take(fv_arena(), "sensors", most, 64);
    for (int eye = 0; eye < p->eyes; eye++) {
        const struct fv_frame_tape *t = &p->tape[eye];
        int64_t period_ns = t->frames > 1 ? (t->last_ns - t->first_ns) / (t->frames - 1) : period_usual_ns;
        if (period_ns < period_least_ns) period_ns = period_least_ns;
        int64_t length_ns = t->last_ns - p->first_ns + period_ns;
        if (length_ns > p->length_ns) p->length_ns = length_ns;
    }
    fv_binocular_begin(&p->binocular, settle_s);
    rewind_tapes(p);
    return 0;
}

static void look_at(struct fv_frame_player *p, int eye, int64_t session_ns, struct fv_eye_look *look)
{
    const struct fv_camera_layout *l = &p->tape[eye].layout;
    struct fv_eye_frame frame = {p->grey, l->width, l->height, l->width};
    /* A whole frame of a layout that was checked: this cannot fail. */
    fv_camera_decode(l, p->next[eye].bytes, fv_camera_frame_bytes(l), p->grey, (size_t)l->width);
    fv_eye_tracker_frame(&p->tracker[eye], &frame, session_ns, look);
}

/* Takes the frames of the next moment, where it is not after until_ns on the tape. */
static bool take_moment(struct fv_frame_player *p, int64_t until_ns, int64_t from_ns)
{
    struct fv_eye_look look[2];
    struct fv_gaze_sample sample;
    bool any[2] = {false, false};
    int64_t moment_ns = INT64_MAX, session_ns = p->round * p->length_ns - p->first_ns;
    for (int eye = 0; eye < p->eyes; eye++)
        if (p->next[eye].bytes && p->next[eye].t_ns < moment_ns) moment_ns = p->next[eye].t_ns;
    if (moment_ns > until_ns) return false;
    for (int eye = 0; eye < p->eyes; eye++) {
        if (!p->next[eye].bytes || p->next[eye].t_ns > until_ns ||
            p->next[eye].t_ns - moment_ns > FV_BINOCULAR_MOMENT_NS)
            continue;
        any[eye] = moment_ns >= from_ns;
        if (any[eye]) look_at(p, eye, session_ns + p->next[eye].t_ns, &look[eye]);
        step(p, eye);
    }
    if (!fv_binocular_add(&p->binocular, any[0] ? &look[0] : NULL, any[1] ? &look[1] : NULL, &sample))
        return true;
    if (p->samples == FV_FRAME_PLAYER_HISTORY)
        memmove(p->sample, p->sample + 1, sizeof p->sample - sizeof p->sample[0]);
    else p->samples++;
    p->sample[p->samples - 1] = sample;
    return true;
}

int fv_frame_player_until(struct fv_frame_player *p, int64_t t_ns)
{
    int64_t into_ns, round = fv_motion_epoch(t_ns, p->length_ns, &into_ns);
    if (round < p->round) return p->samples;
    /* What is left of the round before. */
    int64_t limit_ns = p->first_ns + p->length_ns, ago_ns = into_ns < catch_up_ns ? catch_up_ns - into_ns : 0;
    while (p->round < round &&
           take_moment(p, INT64_MAX - 1, p->round == round - 1 ? limit_ns - ago_ns : limit_ns)) {
    }
    if (p->round < round) {
        p->round = round;
        rewind_tapes(p);
    }
    int64_t until_ns = p->first_ns + into_ns;
    while (take_moment(p, until_ns, until_ns - catch_up_ns)) {
    }
    return p->samples;
}
