/* gaze_events: see the header. Samples run through a ring: taken, then given a speed when the window around
 * them is full, then answered when what follows them is known. */
#include "sensors/eye/gaze_events.h"

#include <math.h>
#include <string.h>

/* Speeds in degrees a second. Small saccades reach 30 (Bahill, Clark and Stark 1975: main sequence), pursuit
 * hardly ever 30 in normal viewing; noise of noise_peak times what is usual is none. */
static const double peak_least = 34, edge_least = 24, noise_peak = 6, noise_edge = 4;
/* A saccade ends at the first valley of the speed below this share of its peak: what swings after it is the
 * lens (post-saccadic oscillation), soon and slower. */
static const double valley_share = 0.35, swing_share = 0.6;
static const int64_t swing_ns = 60000000;
/* The slow velocity is a mean over about this time; pursuit is faster than this, and mostly one way. */
static const double slow_s = 0.08, pursuit_least = 4, one_way = 0.5;
/* A gap after which nothing before counts. */
static const int64_t gap_ns = 100000000;

#define AT(e, index) (&(e)->ring[(index) % FV_EVENT_RING])

/* Least-squares slope over the samples within FV_EVENT_SLOPE_NS of the index-th; < 0 where too few are valid.
 */
static double speed_at(const struct fv_gaze_events *e, int64_t index)
{
    double tt = 0, t1 = 0, tx = 0, ty = 0, x1 = 0, y1 = 0;
    int n = 0;
    int64_t oldest = e->added > FV_EVENT_RING ? e->added - FV_EVENT_RING : 0, middle = AT(e, index)->t_ns;
    for (int64_t i = oldest; i < e->added; i++) {
        double t = (double)(AT(e, i)->t_ns - middle) * 1e-9;
        bool beside = i >= index - 1 && i <= index + 1;
        if ((fabs(t) > FV_EVENT_SLOPE_NS * 1e-9 && !beside) || fabs(t) > (double)gap_ns * 1e-9) continue;
        if (!AT(e, i)->valid) return -1;
        double x = AT(e, i)->x_deg - AT(e, index)->x_deg, y = AT(e, i)->y_deg - AT(e, index)->y_deg;
        n++;
        t1 += t;
        tt += t * t;
        x1 += x;
        y1 += y;
        tx += t * x;
        ty += t * y;
    }
    double spread = n * tt - t1 * t1;
    if (n < 2 || !(spread > 0)) return -1;
    return hypot(n * tx - t1 * x1, n * ty - t1 * y1) / spread;
}

/* The speed at which a saccade's flanks begin. */
static double edge_speed(const struct fv_gaze_events *e)
{
    return fmax(edge_least, noise_edge * e->noise);
}

static double peak_speed(const struct fv_gaze_events *e)
{
    return fmax(peak_least, noise_peak * e->noise);
}

/* Whether a saccade begins at the index-th: from there on the speed stays above the edge until it passes the
 * peak threshold. */
static bool begins(const struct fv_gaze_events *e, int64_t index)
{
    double peak = peak_speed(e);
    const int64_t from_ns = AT(e, index)->t_ns;
    if (e->ever && from_ns - e->ended_ns < swing_ns) peak = fmax(peak, swing_share * e->peak);
    for (int64_t i = index; i < e->sloped; i++) {
        double speed = AT(e, i)->speed;
        if (speed < edge_speed(e) || (i > index + 1 && AT(e, i)->t_ns - from_ns > FV_EVENT_AHEAD_NS))
            return false;
        if (speed >= peak) return true;
    }
    return false;
}

/* Whether the saccade under way is over at the index-th. */
static bool ends(struct fv_gaze_events *e, int64_t index)
{
    double speed = AT(e, index)->speed, after = index + 1 < e->sloped ? AT(e, index + 1)->speed : speed;
    if (speed > e->peak) e->peak = speed;
    if (speed < edge_speed(e)) return true;
    return speed < valley_share * e->peak && after >= 0 && after > speed;
}

/* Learns the noise and the slow velocity from a sample outside saccades; says whether it is of a pursuit. */
static bool pursues(struct fv_gaze_events *e, int64_t index)
{
    const int64_t before = index > 0 ? index - 1 : 0;
    double dt = (double)(AT(e, index)->t_ns - AT(e, before)->t_ns) * 1e-9, speed = AT(e, index)->speed;
    if (!(dt > 0) || !AT(e, before)->valid) return false;
    /* Towards the median: up and down by steps of the same size, a tenth of it in 20 ms. */
    double step = fmin(5 * dt, 0.1) * fmax(e->noise, 1);
    if (speed >= 0) e->noise += speed > e->noise ? step : -step;
    double share = fmin(dt / slow_s, 1), vx = (AT(e, index)->x_deg - AT(e, before)->x_deg) / dt,
           vy = (AT(e, index)->y_deg - AT(e, before)->y_deg) / dt;
    e->way[0] += share * (vx - e->way[0]);
    e->way[1] += share * (vy - e->way[1]);
    e->way[2] += share * (fmax(speed, 0) - e->way[2]);
    double slow = hypot(e->way[0], e->way[1]);
    return slow > pursuit_least && slow > one_way * e->way[2];
}

/* The event of the index-th sample. */
static enum fv_gaze_event tell(struct fv_gaze_events *e, int64_t index)
{
    if (!AT(e, index)->valid) {
        e->moving = false;
        e->ever = false;
        memset(e->way, 0, sizeof e->way);
        return FV_EVENT_BLINK;
    }
    if (e->moving && ends(e, index)) {
        e->moving = false;
        e->ever = true;
        e->ended_ns = AT(e, index)->t_ns;
        memset(e->way, 0, sizeof e->way);
    } else if (!e->moving && begins(e, index)) {
        e->moving = true;
        e->peak = AT(e, index)->speed;
    }
    if (e->moving) return FV_EVENT_SACCADE;
    return pursues(e, index) ? FV_EVENT_PURSUIT : FV_EVENT_FIXATION;
}

enum fv_gaze_event fv_gaze_events_add(struct fv_gaze_events *e, int64_t t_ns, double x_deg, double y_deg,
                                      bool valid, int64_t *told_ns)
{
    enum fv_gaze_event event = FV_EVENT_NONE;
    if (e->added > 0) {
        int64_t last_ns = AT(e, e->added - 1)->t_ns;
        if (t_ns <= last_ns) return FV_EVENT_NONE;
        /* What was before a gap is left unanswered. */
        if ((uint64_t)t_ns - (uint64_t)last_ns > (uint64_t)gap_ns) memset(e, 0, sizeof *e);
    }
    valid = valid && fabs(x_deg) < 1e4 && fabs(y_deg) < 1e4; /* not NaN either */
    AT(e, e->added)->t_ns = t_ns;
    AT(e, e->added)->x_deg = valid ? x_deg : 0;
    AT(e, e->added)->y_deg = valid ? y_deg : 0;
    AT(e, e->added)->valid = valid;
    AT(e, e->added)->speed = -1;
    e->added++;
    /* A ring that is almost full is answered in any case. */
    while (e->sloped < e->added - 1 &&
           (t_ns - AT(e, e->sloped)->t_ns >= FV_EVENT_SLOPE_NS || e->added - e->sloped > FV_EVENT_RING / 4)) {
        AT(e, e->sloped)->speed = speed_at(e, e->sloped);
        e->sloped++;
    }
    if (e->told < e->sloped - 1 && (t_ns - AT(e, e->told)->t_ns >= FV_EVENT_SLOPE_NS + FV_EVENT_AHEAD_NS ||
                                    e->added - e->told > FV_EVENT_RING / 2)) {
        *told_ns = AT(e, e->told)->t_ns;
        event = tell(e, e->told++);
    }
    return event;
}
