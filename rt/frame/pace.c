/* pace: see pace.h. */
#include "rt/frame/pace.h"

static int64_t periods_up(int64_t t_ns, int64_t period_ns)
{
    int64_t whole = t_ns / period_ns;
    return t_ns > whole * period_ns ? whole + 1 : whole;
}

/* The first flip whose deadline is at or after a time. */
static int64_t flip_at(const struct fv_pace *p, int64_t t_ns)
{
    int64_t flip = p->anchor + periods_up(t_ns - p->epoch_ns + p->lead_ns - p->anchor_ns, p->period_ns);
    return flip > 0 ? flip : 0;
}

void fv_pace_follow(struct fv_pace *p, const struct fv_beat *beat)
{
    int64_t at_ns = beat->flip_ns - p->epoch_ns, half_ns = p->period_ns / 2;
    p->anchor += periods_up(at_ns - p->anchor_ns - half_ns, p->period_ns);
    p->anchor_ns = at_ns;
    p->period_ns = beat->period_ns;
    p->lead_ns = beat->lead_ns;
}

int64_t fv_pace_aim(struct fv_pace *p, int64_t now_ns, int64_t need_ns, int periods)
{
    int64_t reached = flip_at(p, now_ns + (need_ns > 0 ? need_ns : 0));
    /* What no number of given periods holds is late already: begun at once, for the flip after those. */
    int64_t given = flip_at(p, now_ns) + periods, aimed = reached < given ? reached : given;
    p->flip += periods;
    if (p->flip < aimed) p->flip = aimed;
    int64_t start_ns = fv_pace_deadline_ns(p) - need_ns;
    return start_ns > now_ns ? start_ns : now_ns;
}

int64_t fv_pace_late(const struct fv_pace *p, int64_t now_ns)
{
    int64_t shown = flip_at(p, now_ns);
    return shown > p->flip ? shown - p->flip : 0;
}

int64_t fv_pace_done(struct fv_pace *p, int64_t now_ns)
{
    int64_t late = fv_pace_late(p, now_ns);
    p->flip += late;
    return late;
}
