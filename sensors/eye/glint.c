/* glint: spots, and the ring that they are part of; see the header. */
#include "sensors/eye/glint.h"

#include <math.h>
#include <string.h>

/* A spot is this much brighter than each of eight places around it, and at least so bright. */
enum { CONTRAST = 32, BRIGHT = 96, AROUND = 8 };
/* How far those places lie, a share of the frame's longer side. */
static const double around_share = 0.0125;
/* How far a reflection may lie from its place: the cornea's curvature moves them by a tenth of their
 * distance. */
static const double off_share = 0.16, off_least_px = 1.5;
/* Places follow what is seen: mean over so many frames. */
static const double learn = 0.05;
/* Spots of less than this share of the strongest one's contrast are skin, lashes or tears. */
static const double faint = 0.35;
/* A ring that so many frames in a row do not fit, though spots enough are there, was none: it is learnt anew.
 */
enum { MISSES_MAX = 60 };

struct window {
    int left, top, right, bottom; /* right, bottom: the first pixel outside */
    int reach;                    /* to the places around */
    ptrdiff_t around[AROUND];
};

static int within(double at, int least, int most)
{
    return (int)fmin(fmax(at, least), most);
}

static bool window_of(const struct fv_eye_frame *f, const struct fv_pupil *p, struct window *w)
{
    int longer = f->width > f->height ? f->width : f->height;
    double half = fmin(fmax(2.2 * p->major, 0.12 * longer), 0.25 * longer);
    w->reach = (int)fmax(3, around_share * longer + 0.5);
    w->left = within(p->x - half, w->reach, f->width);
    w->right = within(p->x + half + 1, 0, f->width - w->reach);
    w->top = within(p->y - half, w->reach, f->height);
    w->bottom = within(p->y + half + 1, 0, f->height - w->reach);
    int aside = (int)(0.7071 * w->reach + 0.5),
        place[AROUND][2] = {{w->reach, 0},  {-w->reach, 0},  {0, w->reach},   {0, -w->reach},
                            {aside, aside}, {-aside, aside}, {aside, -aside}, {-aside, -aside}};
    for (int i = 0; i < AROUND; i++) w->around[i] = place[i][1] * f->stride + place[i][0];
    return w->left < w->right && w->top < w->bottom;
}

/* How much brighter a pixel is than the brightest of the places around; <= 0: no spot. */
static int contrast_at(const uint8_t *p, const struct window *w)
{
    int least = *p;
    for (int i = 0; i < AROUND && least >= CONTRAST; i++) {
        int above = *p - p[w->around[i]];
        least = above < least ? above : least;
    }
    return least >= CONTRAST ? least : 0;
}

/* None of its neighbours is brighter; of equal ones the first counts. */
static bool is_peak(const uint8_t *p, ptrdiff_t stride)
{
    return p[-1] < *p && p[1] <= *p && p[-stride] < *p && p[stride] <= *p && p[-stride - 1] < *p &&
           p[-stride + 1] < *p && p[stride - 1] <= *p && p[stride + 1] <= *p;
}

/* Centre of what is brighter than the places around are, weighted by how much. */
static struct fv_glint centre_of(const struct fv_eye_frame *f, const struct window *w, int x, int y,
                                 int contrast)
{
    const uint8_t *middle = f->pixels + y * f->stride + x;
    double sum = 0, sum_x = 0, sum_y = 0;
    /* Half of the way down, so that what is around weighs nothing. */
    int floor_grey = *middle - contrast / 2, r = w->reach - 1;
    for (int j = -r; j <= r; j++)
        for (int i = -r; i <= r; i++) {
            int above = middle[j * f->stride + i] - floor_grey;
            if (above <= 0 || i * i + j * j > r * r) continue;
            sum += above;
            sum_x += above * i;
            sum_y += above * j;
        }
    /* The middle itself is above: sum > 0. */
    return (struct fv_glint){x + sum_x / sum, y + sum_y / sum, contrast};
}

/* Keeps the list in order of contrast; of spots closer than `apart` only the first in that order stays. */
static int insert(struct fv_glint *spot, int spots, const struct fv_glint *g, double apart)
{
    for (int i = 0; i < spots; i++) {
        if (hypot(spot[i].x - g->x, spot[i].y - g->y) >= apart) continue;
        if (spot[i].contrast >= g->contrast) return spots;
        memmove(&spot[i], &spot[i + 1], (size_t)(--spots - i) * sizeof *spot);
        i--;
    }
    if (spots == FV_GLINTS_MAX) {
        if (spot[spots - 1].contrast >= g->contrast) return spots;
        spots--;
    }
    int at = spots;
    for (; at > 0 && spot[at - 1].contrast < g->contrast; at--) spot[at] = spot[at - 1];
    spot[at] = *g;
    return spots + 1;
}

int fv_glint_spots(const struct fv_eye_frame *frame, const struct fv_pupil *pupil,
                   struct fv_glint spot[FV_GLINTS_MAX])
{
    struct window w;
    int spots = 0;
    if (!pupil->found || !window_of(frame, pupil, &w)) return 0;
    for (int y = w.top; y < w.bottom; y++) {
        const uint8_t *row = frame->pixels + y * frame->stride;
        for (int x = w.left; x < w.right; x++) {
            /* Few pixels are so much brighter than those to both sides: most are done with here. */
            if (row[x] < BRIGHT || row[x] < row[x - w.reach] + CONTRAST ||
                row[x] < row[x + w.reach] + CONTRAST)
                continue;
            if (!is_peak(row + x, frame->stride)) continue;
            int contrast = contrast_at(row + x, &w);
            if (contrast == 0) continue;
            struct fv_glint g = centre_of(frame, &w, x, y, contrast);
            spots = insert(spot, spots, &g, w.reach);
        }
    }
    while (spots > 0 && spot[spots - 1].contrast < faint * spot[0].contrast) spots--;
    return spots;
}

/* All are there at once: their middle, and how they lie about it. */
static void begin_ring(struct fv_glint_ring *ring, const struct fv_glint *spot)
{
    double x = 0, y = 0;
    for (int i = 0; i < ring->leds; i++) {
        x += spot[i].x / ring->leds;
        y += spot[i].y / ring->leds;
    }
    for (int i = 0; i < ring->leds; i++) {
        ring->place[i][0] = spot[i].x - x;
        ring->place[i][1] = spot[i].y - y;
    }
    ring->known = true;
    ring->misses = 0;
}

/* Which spot is at each place when the middle is at (x, y); -1: none. Returns how many are, and the sum of
 * squares of how far off they are. */
static int match(const struct fv_glint_ring *ring, const struct fv_glint *spot, int spots, double x, double y,
                 double near, int found[FV_GLINT_LEDS_MAX], double *squares)
{
    int count = 0;
    *squares = 0;
    for (int i = 0; i < ring->leds; i++) {
        double best = near;
        found[i] = -1;
        for (int j = 0; j < spots; j++) {
            double off = hypot(spot[j].x - x - ring->place[i][0], spot[j].y - y - ring->place[i][1]);
            if (off >= best) continue;
            best = off;
            found[i] = j;
        }
        if (found[i] < 0) continue;
        count++;
        *squares += best * best;
    }
    return count;
}

/* How far apart the places are at most, from their middle. */
static double radius_of(const struct fv_glint_ring *ring)
{
    double radius = 0;
    for (int i = 0; i < ring->leds; i++) radius = fmax(radius, hypot(ring->place[i][0], ring->place[i][1]));
    return radius;
}

bool fv_glint_middle(struct fv_glint_ring *ring, const struct fv_glint *spot, int spots, double middle[2])
{
    int found[FV_GLINT_LEDS_MAX], best[FV_GLINT_LEDS_MAX] = {0}, most = 0;
    double squares, least = INFINITY, x = 0, y = 0;
    if (ring->leds < 1 || ring->leds > FV_GLINT_LEDS_MAX || spots < 1) return false;
    if (!ring->known) {
        if (spots != ring->leds) return false;
        begin_ring(ring, spot);
    }
    double near = fmax(off_share * radius_of(ring), off_least_px);
    for (int i = 0; i < ring->leds; i++)
        for (int j = 0; j < spots; j++) {
            double at_x = spot[j].x - ring->place[i][0], at_y = spot[j].y - ring->place[i][1];
            int count = match(ring, spot, spots, at_x, at_y, near, found, &squares);
            if (count < most || (count == most && squares >= least)) continue;
            most = count;
            least = squares;
            memcpy(best, found, sizeof best);
        }
    if (most < (ring->leds < 3 ? ring->leds : ring->leds / 2 + 1)) {
        if (spots >= ring->leds && ++ring->misses >= MISSES_MAX) ring->known = false;
        return false;
    }
    ring->misses = 0;
    for (int i = 0; i < ring->leds; i++) {
        if (best[i] < 0) continue;
        x += (spot[best[i]].x - ring->place[i][0]) / most;
        y += (spot[best[i]].y - ring->place[i][1]) / most;
    }
    middle[0] = x;
    middle[1] = y;
    if (most < ring->leds) return true;
    /* Places about the middle of all: their mean stays 0. */
    for (int i = 0; i < ring->leds; i++) {
        ring->place[i][0] += learn * (spot[best[i]].x - x - ring->place[i][0]);
        ring->place[i][1] += learn * (spot[best[i]].y - y - ring->place[i][1]);
    }
    return true;
}
