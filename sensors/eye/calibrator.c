/* calibrator: see the header. */
#include "sensors/eye/calibrator.h"

#include "platform/arena.h"

#include <math.h>
#include <string.h>

static const int64_t settle_ns = 500000000, collect_ns = 700000000;
/* How long frames may take from their exposure to here. */
static const int64_t late_ns = 250000000;
/* A fixation that can be believed: so many looks of it, over so long, and such a part of those that saw the
 * pupil. */
enum { LOOKS_LEAST = 8 };
static const int64_t length_least_ns = 200000000;
static const double share_least = 0.5;

double fv_calibrator_near_px(const struct fv_eye_model *model, int width)
{
    return fmax(fabs(model->radius) * width * (M_PI / 180), 0.5);
}

int fv_calibrator_begin(struct fv_calibrator *c, const struct fv_calibrator_settings *settings,
                        struct fv_error *error)
{
    memset(c, 0, sizeof *c);
    c->settings = *settings;
    c->target = -1;
    c->newest_ns[0] = c->newest_ns[1] = INT64_MIN;
    if (!fv_targets_place(settings->points, &settings->reach, c->place_deg))
        return fv_error_set(error, "%d targets; must be 5, 9 or 13", settings->points);
    for (int row = 0; row < FV_SHOWN_MAX; row++)
        for (int eye = 0; eye < settings->eyes; eye++)
            c->of[row][eye].look = fv_arena_take(fv_arena(), "sensors",
                                                 FV_FIXATION_LOOKS_MAX * sizeof *c->of[row][eye].look, 64);
    return 0;
}

void fv_calibrator_replay(struct fv_calibrator *c, const struct fv_target_shown *shown, int rows)
{
    memcpy(c->show, shown, sizeof *shown * (size_t)rows);
    c->shown = rows;
}

static void show(struct fv_calibrator *c, int64_t now_ns)
{
    struct fv_target_shown *s = &c->show[c->shown];
    s->t_ns = now_ns;
    s->from_ns = now_ns + settle_ns + (c->shown == 0 ? c->settings.lead_ns : 0);
    s->until_ns = s->from_ns + collect_ns;
    memcpy(s->at_deg, c->place_deg[c->target], sizeof s->at_deg);
    c->shown++;
    c->tries++;
}

/* Whether all frames of the newest row must have come. */
static bool over(const struct fv_calibrator *c, int64_t now_ns)
{
    int64_t until_ns = c->show[c->shown - 1].until_ns;
    if (now_ns < until_ns) return false;
    if (now_ns >= until_ns + late_ns) return true;
    for (int eye = 0; eye < c->settings.eyes; eye++)
        if (c->newest_ns[eye] < until_ns) return false;
    return true;
}

int fv_calibrator_step(struct fv_calibrator *c, int64_t now_ns)
{
    if (c->shown > 0) {
        if (!over(c, now_ns)) return c->shown - 1;
        bool good = true;
        for (int eye = 0; eye < c->settings.eyes; eye++)
            good = fv_calibrator_good(c, c->shown - 1, eye) && good;
        if (!good && c->tries < FV_CALIBRATOR_TRIES) {
            show(c, now_ns);
            return c->shown - 1;
        }
    }
    if (c->target + 1 == c->settings.points) return -1;
    c->target++;
    c->tries = 0;
    show(c, now_ns);
    return c->shown - 1;
}

void fv_calibrator_look(struct fv_calibrator *c, int eye, const struct fv_eye_look *look)
{
    if (look->t_ns > c->newest_ns[eye]) c->newest_ns[eye] = look->t_ns;
    c->frames[eye]++;
    c->seen[eye] += look->seen;
    if (!look->seen) return;
    for (int row = c->shown - 1; row >= 0; row--) {
        const struct fv_target_shown *s = &c->show[row];
        if (look->t_ns >= s->until_ns) return;
        if (look->t_ns < s->from_ns) continue;
        if (c->of[row][eye].looks < FV_FIXATION_LOOKS_MAX)
            c->of[row][eye].look[c->of[row][eye].looks++] =
                (struct fv_fixation_look){look->t_ns, look->feature, look->confidence};
        c->of[row][eye].judged = false;
        return;
    }
}

bool fv_calibrator_good(struct fv_calibrator *c, int row, int eye)
{
    struct fv_fixation *f = &c->of[row][eye].fixation;
    int looks = c->of[row][eye].looks;
    if (!c->of[row][eye].judged)
        fv_fixation_choose(c->of[row][eye].look, looks, c->settings.near_px, c->of[row][eye].chosen, f);
    c->of[row][eye].judged = true;
    return f->looks >= LOOKS_LEAST && f->length_ns >= length_least_ns && f->looks >= share_least * looks;
}
