/* tracker: see the header. */
#include "sensors/eye/tracker.h"

#include <math.h>
#include <string.h>

static const double degree = M_PI / 180, most_deg = 80;
/* A pupil does not shrink to this share between frames (the light reflex takes 0.2 s and more): lids hide
 * part of it, or it is another dark spot. What stays so for longer is believed. */
static const double narrow_share = 0.6, follow = 0.1;
static const int64_t believed_ns = 300000000;

/* An ellipse this much flatter than usual is one that a lid cuts. */
static const double flat_share = 0.85, flatten = 0.05;

void fv_gaze_vector(const double at_deg[2], double direction[3])
{
    double angle = sqrt(at_deg[0] * at_deg[0] + at_deg[1] * at_deg[1]),
           turned = fmin(angle, most_deg) * degree;
    double scale = angle > 1e-9 ? sin(turned) / angle : degree;
    direction[0] = scale * at_deg[0];
    direction[1] = scale * at_deg[1];
    direction[2] = -cos(turned);
}

void fv_gaze_degrees(const double direction[3], double at_deg[2])
{
    double sine = sqrt(direction[0] * direction[0] + direction[1] * direction[1]);
    double angle = fmin(atan2(sine, -direction[2]) / degree, most_deg),
           scale = sine > 1e-12 ? angle / sine : 0;
    at_deg[0] = scale * direction[0];
    at_deg[1] = scale * direction[1];
}

void fv_eye_tracker_begin(struct fv_eye_tracker *t, const struct fv_eye_settings *settings, void *scratch,
                          size_t bytes)
{
    memset(t, 0, sizeof *t);
    t->settings = *settings;
    t->ring.leds = settings->leds;
    t->scratch = scratch;
    t->bytes = bytes;
}

/* The documented default; false where the settings make none. */
static bool by_model(const struct fv_eye_model *m, const struct fv_eye_frame *f, const double pupil[2],
                     double at_deg[2], double *error_deg)
{
    double radius = m->radius * f->width, longest = sin(most_deg * degree);
    double g[3] = {-(pupil[0] - m->middle_x * (f->width - 1)) / radius,
                   -(pupil[1] - m->middle_y * (f->height - 1)) / fabs(radius), 0};
    double far = sqrt(g[0] * g[0] + g[1] * g[1]);
    if (!isfinite(far)) return false;
    for (int i = 0; i < 2 && far > longest; i++) g[i] *= longest / far;
    g[2] = -sqrt(fmax(1 - g[0] * g[0] - g[1] * g[1], 0));
    fv_gaze_degrees(g, at_deg);
    *error_deg = FV_EYE_MODEL_ERROR_DEG * fmax(far / longest, 1);
    return true;
}

/* Whether a pupil that was found is the eye's, whole enough to tell where it looks. */
static bool is_whole(struct fv_eye_tracker *t, int64_t t_ns)
{
    double width = t->pupil.major;
    if (!t->pupil.found || t->pupil.confidence < t->settings.confidence) {
        t->narrow_ns = 0; /* a lid that opens begins anew */
        return false;
    }
    if (t->usual > 0 && width < narrow_share * t->usual) {
        if (t->narrow_ns == 0) t->narrow_ns = t_ns;
        if (t_ns - t->narrow_ns < believed_ns) {
            t->narrow++;
            return false;
        }
        t->usual = 0;
    }
    t->narrow_ns = 0;
    t->usual = t->usual > 0 ? t->usual + follow * (width - t->usual) : width;
    return true;
}

/* How far off the centre of an ellipse may be that a lid cuts, in degrees: half of what its minor axis lacks.
 * Pupils seen from aside flatten too, but not at once, so what is usual follows. */
static double cut_deg(struct fv_eye_tracker *t, const struct fv_eye_frame *frame)
{
    double ratio = t->pupil.major > 0 ? t->pupil.minor / t->pupil.major : 1,
           usual = t->ratio > 0 ? t->ratio : ratio;
    double lacks_px = ratio < flat_share * usual ? 0.5 * (usual - ratio) * t->pupil.major : 0;
    double radius_px = fabs(t->settings.model.radius) * frame->width;
    t->ratio = usual + flatten * (ratio - usual);
    return radius_px > 0 ? lacks_px / radius_px / degree : 0;
}

void fv_eye_tracker_frame(struct fv_eye_tracker *t, const struct fv_eye_frame *frame, int64_t t_ns,
                          struct fv_eye_look *look)
{
    struct fv_glint spot[FV_GLINTS_MAX];
    size_t needed = fv_pupil_scratch_bytes(frame->width, frame->height);
    *look = (struct fv_eye_look){.t_ns = t_ns};
    t->frames++;
    if (needed == 0 || needed > t->bytes) return;
    if (t->settings.width > 0 && (frame->width != t->settings.width || frame->height != t->settings.height))
        return;
    fv_pupil_find(frame, NULL, &t->track, t->scratch, &t->pupil);
    look->confidence = t->pupil.confidence;
    if (!is_whole(t, t_ns)) return;
    struct fv_gaze_feature *f = &look->feature;
    f->pupil[0] = t->pupil.x;
    f->pupil[1] = t->pupil.y;
    if (t->ring.leds > 0)
        f->glint_seen = fv_glint_middle(&t->ring, spot, fv_glint_spots(frame, &t->pupil, spot), f->glint);
    t->with_glint += f->glint_seen;
    look->seen = t->settings.map.pupil.terms > 0
                     ? fv_gaze_map_at(&t->settings.map, f, look->at_deg, &look->error_deg)
                     : by_model(&t->settings.model, frame, f->pupil, look->at_deg, &look->error_deg);
    /* A pupil that is just about seen is off twice as much. */
    look->error_deg = look->error_deg / fmax(look->confidence, FV_PUPIL_CONFIDENT) + cut_deg(t, frame);
    if (!isfinite(look->at_deg[0] + look->at_deg[1] + look->error_deg)) look->seen = false;
    t->seen += look->seen;
    if (!look->seen) *look = (struct fv_eye_look){.t_ns = t_ns, .confidence = look->confidence};
}
