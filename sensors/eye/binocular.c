/* binocular: see the header. */
#include "sensors/eye/binocular.h"

#include <math.h>
#include <string.h>

/* An eye that was seen so lately is not lost yet when the other one is. */
static const int64_t lately_ns = 25000000;
/* Vergence that changes by more than this at once is a mistake of one eye; it is believed after a while. */
static const double disagree_deg = 8;
enum { BELIEVED = 15 };
/* An eye whose error is told to be so many times the other's, and so much more, is half closed. */
static const double less_certain = 3, less_certain_deg = 0.5;
/* Slower than this an eye rests, so that its vergence with the other can be taken from different moments. */
static const double rest_deg_s = 15;
/* Told where an eye is placed by the other: vergence as last known, or not known at all. */
static const double placed_deg = 0.5, unknown_deg = 2;
/* The eyes' places about their middle, in vergences. */
static const double side[2] = {0.5, -0.5};

void fv_binocular_begin(struct fv_binocular *b, double settle_s)
{
    memset(b, 0, sizeof *b);
    b->version.settle_s = b->vergence.settle_s = settle_s;
    b->t_ns = INT64_MIN;
}

/* From one look to the next; infinite where that is not known. */
static double speed_deg_s(const struct fv_eye_look *before, const struct fv_eye_look *after)
{
    double dt = (double)(after->t_ns - before->t_ns) * 1e-9;
    if (!before->seen || !after->seen || !(dt > 0) || dt > 0.1) return INFINITY;
    return hypot(after->at_deg[0] - before->at_deg[0], after->at_deg[1] - before->at_deg[1]) / dt;
}

/* Whether the eye was seen in this moment. */
static bool is_seen(const struct fv_binocular *b, int eye, int64_t t_ns, int64_t within_ns)
{
    return b->ever[eye] && b->newest[eye].seen && t_ns - b->newest[eye].t_ns <= within_ns;
}

/* Of two eyes that cannot both be right, or of which one is far less certain, only the better one counts for
 * now. */
static void settle_dispute(struct fv_binocular *b, bool seen[2])
{
    const struct fv_eye_look *look = b->newest;
    double change[2];
    if (!seen[0] || !seen[1] || !b->apart_known) return;
    for (int i = 0; i < 2; i++) change[i] = look[0].at_deg[i] - look[1].at_deg[i] - b->apart[i];
    int worse = look[0].error_deg > look[1].error_deg ? 0 : 1;
    double off_deg = look[worse].error_deg, other_deg = look[!worse].error_deg;
    bool uncertain = off_deg > less_certain * other_deg && off_deg > other_deg + less_certain_deg;
    if ((hypot(change[0], change[1]) < disagree_deg && !uncertain) || ++b->disagreed > BELIEVED) {
        b->disagreed = 0;
        return;
    }
    b->disagreements++;
    if (!uncertain) worse = look[0].confidence >= look[1].confidence;
    seen[worse] = false;
}

/* Where the eyes' middle is, from one or two that are seen; returns the error. */
static double place(struct fv_binocular *b, const bool seen[2], int64_t t_ns, double version[2])
{
    const struct fv_eye_look *look = b->newest;
    double apart[2], weight[2] = {0, 0}, weights = 0, error_deg = 0;
    bool at_once = is_seen(b, 0, t_ns, FV_BINOCULAR_MOMENT_NS) && is_seen(b, 1, t_ns, FV_BINOCULAR_MOMENT_NS);
    bool turns = !at_once && is_seen(b, 0, t_ns, lately_ns) && is_seen(b, 1, t_ns, lately_ns) &&
                 b->speed_deg_s[0] < rest_deg_s && b->speed_deg_s[1] < rest_deg_s;
    if ((seen[0] && seen[1]) || turns) {
        for (int i = 0; i < 2; i++) apart[i] = look[0].at_deg[i] - look[1].at_deg[i];
        fv_gaze_smooth_add(&b->vergence, t_ns, apart, b->apart);
        b->apart_known = true;
    }
    if (seen[0] && seen[1]) b->both++;
    else {
        b->single++;
        /* With one camera there is nothing to know. */
        error_deg = b->apart_known ? placed_deg : b->ever[0] && b->ever[1] ? unknown_deg : 0;
    }
    for (int eye = 0; eye < 2; eye++) {
        if (seen[eye]) weight[eye] = 1 / fmax(look[eye].error_deg * look[eye].error_deg, 1e-4);
        weights += weight[eye];
    }
    version[0] = version[1] = 0;
    for (int eye = 0; eye < 2; eye++) {
        double part = weight[eye] / weights;
        for (int i = 0; i < 2; i++) version[i] += part * (look[eye].at_deg[i] - side[eye] * b->apart[i]);
        error_deg += part * look[eye].error_deg;
    }
    return error_deg;
}

bool fv_binocular_add(struct fv_binocular *b, const struct fv_eye_look *left, const struct fv_eye_look *right,
                      struct fv_gaze_sample *sample)
{
    const struct fv_eye_look *look[2] = {left, right};
    double version[2], at[2], error_deg, spread_deg;
    int64_t t_ns = INT64_MIN, told_ns;
    for (int eye = 0; eye < 2; eye++) {
        if (!look[eye]) continue;
        b->speed_deg_s[eye] = speed_deg_s(&b->newest[eye], look[eye]);
        b->newest[eye] = *look[eye];
        b->ever[eye] = true;
        if (look[eye]->t_ns > t_ns) t_ns = look[eye]->t_ns;
    }
    if (!left && !right) return false;
    if (t_ns <= b->t_ns) t_ns = b->t_ns + 1;
    bool seen[2] = {is_seen(b, 0, t_ns, FV_BINOCULAR_MOMENT_NS), is_seen(b, 1, t_ns, FV_BINOCULAR_MOMENT_NS)};
    if (!seen[0] && !seen[1] && (is_seen(b, 0, t_ns, lately_ns) || is_seen(b, 1, t_ns, lately_ns)))
        return false;
    settle_dispute(b, seen);
    bool valid = seen[0] || seen[1];
    b->t_ns = t_ns;
    *sample = (struct fv_gaze_sample){.t_ns = t_ns, .direction = {{0, 0, -1}, {0, 0, -1}}, .valid = valid};
    if (valid) {
        error_deg = place(b, seen, t_ns, version);
        spread_deg = fv_gaze_smooth_add(&b->version, t_ns, version, at);
        for (int eye = 0; eye < 2; eye++) {
            double of_eye[2];
            for (int i = 0; i < 2; i++) of_eye[i] = at[i] + side[eye] * b->apart[i];
            fv_gaze_vector(of_eye, sample->direction[eye]);
        }
        sample->uncertainty_deg = hypot(error_deg, spread_deg);
    } else {
        version[0] = version[1] = 0;
        fv_gaze_smooth_lost(&b->version);
        fv_gaze_smooth_lost(&b->vergence);
        b->lost++;
    }
    enum fv_gaze_event event = fv_gaze_events_add(&b->events, t_ns, version[0], version[1], valid, &told_ns);
    if (event != FV_EVENT_NONE) {
        b->event = event;
        b->event_ns = told_ns;
    }
    return true;
}
