/* pupil_outline: circles grown into ellipses along the outline, at the working size; each judged; the best
 * one refined in the frame itself, and judged again: that is its confidence.
 *
 * A ray is the outline's normal at one of RAYS parameter angles; it is supported where the image goes from
 * dark to bright along it, near the outline, as steeply as elsewhere on it. What is judged, each as a factor
 * between 0 and 1 (`ramp`):
 *   support   the share of rays that are supported: glints, lashes and lids take some away
 *   contrast  how much brighter it is outside, in levels of grey and against its own variation over the rays:
 *             lids, lashes and noise vary, a pupil is as dark all around
 *   darkness  whether the inside is as dark at the outline as in the middle: in an iris the pupil is darker
 *   roundness minor over major axis */
#include "sensors/eye/pupil_work.h"

#include <math.h>
#include <string.h>

enum { RAYS = 48, FINE_RAYS = 96 };

/* Each judgement: 0 up to the first number, 1 from the second one on. */
struct ramp {
    double none, all;
};
/* A pupil whose upper third is behind a lid keeps 0.6; 5 free parameters fitted to noise win up to 0.3. */
static const struct ramp support_ramp = {0.25, 0.6};
/* Cameras have noise of 2 levels, of which the mean over an outline leaves a tenth; dark brown eyes have 10.
 */
static const struct ramp contrast_ramp = {2, 8};
/* Contrast as a share of what is around: no iris or skin reflects less than a tenth more than the pupil. */
static const struct ramp share_ramp = {0.06, 0.16};
/* Mean over standard deviation of what rays see. */
static const struct ramp steady_ramp = {0.9, 2.2};
/* Share of the contrast by which the outline's inner side is brighter than the middle. */
static const struct ramp darkness_ramp = {1.0, 0.4};
/* Share of the outline that lies in the frame: of less than that it is not known to close. */
static const struct ramp framed_ramp = {0.6, 0.8};
/* Other places that look as good, as many times the best: a reflected eye makes one, noise makes many. */
static const struct ramp rivals_ramp = {3, 1};
/* A circle seen from 73 and from 50 degrees. */
static const struct ramp roundness_ramp = {0.3, 0.65};

static double ramp(const struct ramp *r, double value)
{
    double share = (value - r->none) / (r->all - r->none);
    return share > 0 ? fmin(share, 1) : 0; /* NaN: 0 */
}

struct judged {
    struct fv_ellipse ellipse;
    double score, inside; /* inside: grey level on the outline's inner side */
};

static void directions(double (*direction)[2], int n)
{
    for (int i = 0; i < n; i++) {
        direction[i][0] = cos(2 * M_PI * i / n);
        direction[i][1] = sin(2 * M_PI * i / n);
    }
}

/* The working image's slope along a ray, at steps -reach - 1 to reach + 1; 0 where the gradient points
 * aside (`straight`: least squared cosine of the angle), and off the image. */
static void slopes_along(const struct fv_pupil_work *work, const float at[2], const float normal[2],
                         int reach, float straight, float *slope)
{
    float x0 = at[0] - (float)(reach + 1) * normal[0] + 0.5f,
          y0 = at[1] - (float)(reach + 1) * normal[1] + 0.5f;
    for (int i = 0; i < 2 * reach + 3; i++) {
        float fx = x0 + (float)i * normal[0], fy = y0 + (float)i * normal[1];
        slope[i] = 0;
        if (!(fx >= 0 && fy >= 0 && fx < (float)work->width && fy < (float)work->height)) continue;
        int p = (int)fy * work->row + (int)fx;
        float gx = work->gx[p], gy = work->gy[p], s = gx * normal[0] + gy * normal[1];
        slope[i] = s * s < straight * (gx * gx + gy * gy) ? 0 : s;
    }
}

enum { CLIMB_MAX = 16 };

/* Where along a ray the slope outwards is highest, nearer ones before farther ones; false where it nowhere is
 * as steep as an edge. */
static bool climb(const struct fv_pupil_work *work, const double at[2], const double normal[2], int reach,
                  float straight, double *offset)
{
    float slope[2 * CLIMB_MAX + 3], best = 0, least = 0.8f * (float)work->threshold,
                                    farther = 0.5f / (float)reach;
    float start[2] = {(float)at[0], (float)at[1]}, ahead[2] = {(float)normal[0], (float)normal[1]};
    int where = 0;
    slopes_along(work, start, ahead, reach, straight, slope);
    for (int i = -reach; i <= reach; i++) {
        const float *s = slope + (i + reach + 1);
        if (s[0] < least || s[0] < s[-1] || s[0] < s[1]) continue;
        float worth = s[0] * (1 - farther * fabsf((float)i));
        if (worth > best) {
            best = worth;
            where = i;
        }
    }
    if (!(best > 0)) return false;
    const float *s = slope + (where + reach + 1);
    float bend = 2 * s[0] - s[-1] - s[1];
    *offset = where + (bend > 0 ? 0.5 * (double)(s[1] - s[-1]) / (double)bend : 0);
    return true;
}

/* One round of growing: every which ray, how far it reaches (share of the minor half axis), how far aside
 * gradients may point (squared cosine: 39, 33, 27 degrees), what support must come of it. */
struct round {
    int stride;
    double share;
    float straight;
    double enough;
};
static const struct round rounds[] = {{2, 0.3, 0.6f, 0.2}, {1, 0.2, 0.7f, 0.25}, {1, 0.12, 0.8f, 0.3}};

/* Moves the outline to the edges near it and fits it again. */
static bool grow(const struct fv_pupil_work *work, const double (*direction)[2], const struct round *round,
                 struct fv_ellipse *ellipse, double *support)
{
    struct fv_outline_point point[RAYS];
    int reach = (int)fmin(fmax(round->share * ellipse->b + 0.5, 2), CLIMB_MAX), found = 0, kept = 0;
    for (int i = 0; i < RAYS; i += round->stride) {
        double at[2], normal[2], offset;
        fv_ellipse_outline(ellipse, direction[i][0], direction[i][1], at, normal);
        if (!climb(work, at, normal, reach, round->straight, &offset)) continue;
        point[found++] = (struct fv_outline_point){at[0] + offset * normal[0], at[1] + offset * normal[1], 1};
    }
    if (found < RAYS / round->stride / 4 || !fv_ellipse_fit_robust(point, found, 0.7, ellipse)) return false;
    double near = fmax(fmin(1, 0.12 * ellipse->b), 0.06 * ellipse->b);
    for (int i = 0; i < found; i++) kept += fabs(fv_ellipse_distance(ellipse, point[i].x, point[i].y)) < near;
    *support = (double)(kept * round->stride) / RAYS;
    return *support >= round->enough && ellipse->a <= 1.15 * work->most && ellipse->a >= 0.85 * work->least &&
           ellipse->b > 0.25 * ellipse->a;
}

static double grey_at(const struct fv_pupil_work *work, double x, double y)
{
    int i = (int)(x + 0.5), j = (int)(y + 0.5);
    if (i < 2 || j < 2 || i >= work->width - 2 || j >= work->height - 2) return -1;
    return (double)work->smooth[(size_t)j * (size_t)work->row + (size_t)i] / FV_GREY;
}

/* The middle one of n numbers, n >= 1; changes their order. */
static double middle(double *value, int n)
{
    return fv_outline_rank(value, n, n / 2);
}

/* Contrast, steadiness and darkness of an ellipse in the working image, as one factor. */
static double judge_greys(const struct fv_pupil_work *work, const double (*direction)[2],
                          const struct fv_ellipse *e, double *inside)
{
    double contrast[RAYS], inner[RAYS], outer[RAYS], within[3 * RAYS];
    double gap = fmax(2, 0.15 * e->b);
    int n = 0, m = 0;
    for (int i = 0; i < RAYS; i++) {
        double at[2], normal[2];
        fv_ellipse_outline(e, direction[i][0], direction[i][1], at, normal);
        double in = grey_at(work, at[0] - gap * normal[0], at[1] - gap * normal[1]);
        double out = grey_at(work, at[0] + gap * normal[0], at[1] + gap * normal[1]);
        if (in < 0 || out < 0) continue;
        contrast[n] = out - in;
        outer[n] = out;
        inner[n++] = in;
        for (int j = 1; j <= 3; j++)
            within[m++] = grey_at(work, e->x + 0.22 * j * (at[0] - e->x), e->y + 0.22 * j * (at[1] - e->y));
    }
    if (n < RAYS / 3) return 0;
    double sorted[RAYS], usual;
    memcpy(sorted, contrast, sizeof sorted);
    usual = middle(sorted, n);
    for (int i = 0; i < n; i++) contrast[i] = fabs(contrast[i] - usual);
    double steady = usual / fmax(1.48 * middle(contrast, n), 0.5);
    *inside = middle(inner, n);
    double lighter = *inside - fv_outline_rank(within, m, m / 16);
    double share = usual / fmax(middle(outer, n), 1);
    return ramp(&framed_ramp, (double)n / RAYS) * ramp(&contrast_ramp, usual) * ramp(&share_ramp, share) *
           ramp(&steady_ramp, steady) * ramp(&darkness_ramp, lighter / fmax(usual, 1e-3));
}

static void judge_seed(const struct fv_pupil_work *work, const double (*direction)[2],
                       const struct fv_seed *seed, struct judged *judged)
{
    struct fv_ellipse e = {seed->x, seed->y, seed->radius, seed->radius, 1, 0};
    double support = 0;
    judged->score = 0;
    for (int i = 0; i < 3; i++)
        if (!grow(work, direction, &rounds[i], &e, &support)) return;
    double factor = ramp(&support_ramp, support) * ramp(&roundness_ramp, e.b / e.a);
    if (!(factor > 0)) return;
    judged->ellipse = e;
    judged->score = factor * judge_greys(work, direction, &e, &judged->inside);
}

/* Whether b lies in a, is smaller and darker: then a is the iris around the pupil b. */
static bool lies_inside(const struct judged *a, const struct judged *b)
{
    double apart = hypot(a->ellipse.x - b->ellipse.x, a->ellipse.y - b->ellipse.y);
    return apart + b->ellipse.a < 1.1 * a->ellipse.a && b->ellipse.a < 0.8 * a->ellipse.a &&
           b->inside < a->inside - 1;
}

/* The best ellipse; of two around each other the inner one, if it is at least half as good. */
static int best_of(const struct judged *judged, int n)
{
    int best = 0;
    for (int i = 1; i < n; i++)
        if (judged[i].score > judged[best].score) best = i;
    int outer = best;
    double score = 0;
    for (int i = 0; i < n; i++)
        if (judged[i].score > 0.5 * judged[outer].score && judged[i].score > score &&
            lies_inside(&judged[outer], &judged[i])) {
            best = i;
            score = judged[i].score;
        }
    return best;
}

static bool overlap(const struct judged *a, const struct judged *b)
{
    return hypot(a->ellipse.x - b->ellipse.x, a->ellipse.y - b->ellipse.y) < fmax(a->ellipse.a, b->ellipse.a);
}

/* Scores of the best of each place apart from that of the best one, together. */
static double rivals(const struct judged *judged, int n, int best)
{
    double sum = 0;
    for (int i = 0; i < n; i++) {
        bool counts = judged[i].score > 0 && !overlap(&judged[i], &judged[best]);
        for (int j = 0; j < n && counts; j++)
            if (j != i && judged[j].score > 0 && overlap(&judged[i], &judged[j]))
                counts = judged[j].score < judged[i].score || (judged[j].score == judged[i].score && j > i);
        if (counts) sum += judged[i].score;
    }
    return sum / judged[best].score;
}

/* The frame between its pixels; -1 outside. */
static double frame_at(const struct fv_eye_frame *frame, double x, double y)
{
    if (!(x >= 0 && y >= 0 && x < frame->width - 1 && y < frame->height - 1)) return -1;
    int i = (int)x, j = (int)y;
    double u = x - i, v = y - j;
    const uint8_t *p = frame->pixels + j * frame->stride + i;
    return (1 - v) * ((1 - u) * p[0] + u * p[1]) +
           v * ((1 - u) * p[frame->stride] + u * p[frame->stride + 1]);
}

/* What a ray of the frame sees: where its step from dark to bright is, and the means on both sides. */
struct step {
    double offset, inner, outer;
    bool seen;
};

enum { REACH_MAX = 12, SIDE_MAX = 8 };

/* The step is where the means of `side` samples on either side differ most. */
static struct step step_along(const struct fv_eye_frame *frame, const double at[2], const double normal[2],
                              double length, int reach, int side)
{
    double sum[2 * (REACH_MAX + SIDE_MAX) + 2] = {0}, response[2 * REACH_MAX + 1];
    int n = 2 * (reach + side), best = 0;
    struct step step = {0};
    for (int i = 0; i < n; i++) {
        double o = (i - reach - side + 0.5) * length;
        double value = frame_at(frame, at[0] + o * normal[0], at[1] + o * normal[1]);
        if (value < 0) return step;
        sum[i + 1] = sum[i] + value;
    }
    for (int i = 0; i <= 2 * reach; i++) {
        response[i] = sum[i + 2 * side] - 2 * sum[i + side] + sum[i];
        if (response[i] > response[best]) best = i;
    }
    if (best == 0 || best == 2 * reach || !(response[best] > 0)) return step;
    double bend = 2 * response[best] - response[best - 1] - response[best + 1];
    double within = bend > 0 ? 0.5 * (response[best + 1] - response[best - 1]) / bend : 0;
    step.offset = (best - reach + within) * length;
    step.inner = (sum[best + side] - sum[best]) / side;
    step.outer = (sum[best + 2 * side] - sum[best + side]) / side;
    step.seen = true;
    return step;
}

/* The working pixel that a place of the frame lies in; -1 outside. */
static int working_pixel(const struct fv_pupil_work *work, double x, double y)
{
    double scale = work->scale;
    int i = (int)((x - 0.5 * (scale - 1)) / scale + 0.5), j = (int)((y - 0.5 * (scale - 1)) / scale + 0.5);
    return i < 0 || j < 0 || i >= work->width || j >= work->height ? -1 : j * work->row + i;
}

/* Whether the working image climbs straight outwards at a place of the frame: along a lid's or a lash's edge,
 * or a glint's, it does not. */
static bool straight_at(const struct fv_pupil_work *work, const struct fv_outline_point *p,
                        const double normal[2])
{
    int at = working_pixel(work, p->x, p->y);
    if (at < 0) return false;
    double gx = work->gx[at], gy = work->gy[at], along = gx * normal[0] + gy * normal[1];
    return along > 0 && along * along >= (double)rounds[2].straight * (gx * gx + gy * gy);
}

/* Fits the ellipse to the frame's own steps; gives the share of rays that support it. Rays behind a
 * reflection tell nothing, neither for nor against; of more than half of the rays that is not believed. */
static bool refine(const struct fv_eye_frame *frame, const struct fv_pupil_work *work,
                   const double (*direction)[2], struct fv_ellipse *ellipse, double *support)
{
    struct fv_outline_point point[FINE_RAYS];
    double contrast[FINE_RAYS], sorted[FINE_RAYS], scale = work->scale, length = fmax(1, 0.5 * scale);
    int reach = (int)fmin(fmax((1.5 * scale + 0.04 * ellipse->b) / length + 1, 3), REACH_MAX);
    int side = (int)fmin(fmax(ellipse->b / 7 / length + 0.5, 2), SIDE_MAX), n = 0, kept = 0, hidden = 0;
    for (int i = 0; i < FINE_RAYS; i++) {
        double at[2], normal[2];
        fv_ellipse_outline(ellipse, direction[i][0], direction[i][1], at, normal);
        int pixel = working_pixel(work, at[0], at[1]);
        if (pixel >= 0 && work->hidden[pixel]) {
            hidden++;
            continue;
        }
        struct step step = step_along(frame, at, normal, length, reach, side);
        if (!step.seen) continue;
        point[n] =
            (struct fv_outline_point){at[0] + step.offset * normal[0], at[1] + step.offset * normal[1], 1};
        if (straight_at(work, &point[n], normal)) contrast[n++] = step.outer - step.inner;
    }
    if (n < FINE_RAYS / 4) return false;
    memcpy(sorted, contrast, sizeof sorted);
    double usual = middle(sorted, n);
    /* Weaker steps are of lashes or lids, stronger ones of glints. */
    for (int i = 0; i < n; i++)
        if (contrast[i] < 0.4 * usual || contrast[i] > 2.5 * usual) point[i].weight = 0;
    double small = fmax(0.5, 0.25 * scale);
    if (!fv_ellipse_fit_parts(point, n, small, ellipse) || !fv_ellipse_trim(point, n, small, ellipse))
        return false;
    double near = fmax(fmin(0.75 * scale, 0.1 * ellipse->b), 0.05 * ellipse->b);
    for (int i = 0; i < n; i++)
        kept += contrast[i] >= 0.4 * usual && contrast[i] <= 2.5 * usual &&
                fabs(fv_ellipse_distance(ellipse, point[i].x, point[i].y)) < near;
    *support = (double)kept / fmax(FINE_RAYS - hidden, FINE_RAYS / 2);
    return true;
}

/* The ellipse of the working size in frame pixels, refined there. */
static void finish(const struct fv_eye_frame *frame, struct fv_pupil_work *work, struct judged *best,
                   struct fv_pupil *pupil)
{
    double direction[FINE_RAYS][2], coarse[RAYS][2], scale = work->scale, support = 0, inside;
    struct fv_ellipse e = best->ellipse, working;
    directions(direction, FINE_RAYS);
    directions(coarse, RAYS);
    e.x = scale * e.x + 0.5 * (scale - 1);
    e.y = scale * e.y + 0.5 * (scale - 1);
    e.a *= scale;
    e.b *= scale;
    for (int i = 0; i < 3; i++)
        if (!refine(frame, work, direction, &e, &support)) return;
    working = e;
    working.x = (e.x - 0.5 * (scale - 1)) / scale;
    working.y = (e.y - 0.5 * (scale - 1)) / scale;
    working.a /= scale;
    working.b /= scale;
    if (working.a > 1.05 * work->most || working.a < 0.8 * work->least) return;
    pupil->x = e.x;
    pupil->y = e.y;
    pupil->major = 2 * e.a;
    pupil->minor = 2 * e.b;
    pupil->angle = atan2(e.s, e.c);
    if (pupil->angle > M_PI / 2) pupil->angle -= M_PI;
    if (pupil->angle <= -M_PI / 2) pupil->angle += M_PI;
    pupil->confidence = ramp(&support_ramp, support) * ramp(&roundness_ramp, e.b / e.a) *
                        judge_greys(work, coarse, &working, &inside);
}

void fv_pupil_outline(const struct fv_eye_frame *frame, struct fv_pupil_work *work, struct fv_pupil *pupil)
{
    double direction[RAYS][2];
    struct judged judged[FV_SEEDS_MAX];
    directions(direction, RAYS);
    for (int i = 0; i < work->seeds; i++) judge_seed(work, direction, &work->seed[i], &judged[i]);
    int best = work->seeds ? best_of(judged, work->seeds) : 0;
    if (!work->seeds || !(judged[best].score > 0)) return;
    finish(frame, work, &judged[best], pupil);
    pupil->confidence *= ramp(&rivals_ramp, rivals(judged, work->seeds, best));
}
