/* vsync: see vsync.h. */
#include "platform/vsync.h"

#include <math.h>

enum { MEAN_OF = 32, ODD_MAX = 8 };
static const int64_t silent_ns = 1000000000, steps_most = 1 << 20;

void fv_vsync_begin(struct fv_vsync *v, int64_t nominal_ns)
{
    *v = (struct fv_vsync){.nominal_ns = nominal_ns > 0 ? nominal_ns : 1};
    v->period_ns = (double)v->nominal_ns;
}

/* The beat's phase is known from here on, and nothing else is new. */
static void anchor(struct fv_vsync *v, int64_t t_ns)
{
    v->t_ns = t_ns;
    v->known = true;
    v->odd_in_row = 0;
}

static void refuse(struct fv_vsync *v, int64_t t_ns)
{
    v->odd++;
    if (++v->odd_in_row < ODD_MAX) return;
    v->count = 0;
    v->period_ns = (double)v->nominal_ns;
    anchor(v, t_ns);
}

void fv_vsync_saw(struct fv_vsync *v, int64_t t_ns, int64_t steps)
{
    if (t_ns < 0) {
        v->odd++;
        return;
    }
    if (!v->known) {
        anchor(v, t_ns);
        return;
    }
    double between_ns = (double)(t_ns - v->t_ns), nominal_ns = (double)v->nominal_ns;
    if (steps < 1) steps = (int64_t)fmin(fmax(floor(between_ns / v->period_ns + 0.5), 0), (double)steps_most);
    double each_ns = steps > 0 ? between_ns / (double)steps : 0;
    if (!(fabs(each_ns - nominal_ns) <= 0.25 * nominal_ns)) {
        refuse(v, t_ns);
        return;
    }
    v->count++;
    v->period_ns += (each_ns - v->period_ns) / (double)(v->count < MEAN_OF ? v->count : MEAN_OF);
    anchor(v, t_ns);
}

bool fv_vsync_beat(const struct fv_vsync *v, int64_t now_ns, struct fv_beat *beat)
{
    if (!v->known || now_ns - v->t_ns > silent_ns || v->t_ns > now_ns + silent_ns) return false;
    beat->flip_ns = v->t_ns;
    beat->period_ns = llround(v->period_ns);
    return true;
}
