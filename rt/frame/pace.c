/* pace: see pace.h. */
#include "rt/frame/pace.h"

/* The first flip at or after a time. */
static int64_t flip_at(const struct fv_pace *p, int64_t t_ns)
{
    int64_t since_ns = t_ns - p->epoch_ns;
    return since_ns <= 0 ? 0 : (since_ns + p->period_ns - 1) / p->period_ns;
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

int64_t fv_pace_done(struct fv_pace *p, int64_t now_ns)
{
    int64_t shown = flip_at(p, now_ns), late = shown > p->flip ? shown - p->flip : 0;
    p->flip += late;
    return late;
}
