/* pupil_arcs: edges linked into chains with the dark side on the right, chains cut into arcs that turn
 * around their dark side, and circles through these arcs: the seeds of ellipses.
 *
 * With y down and the gradient n towards the bright side, the way ahead is n turned from x towards y; going
 * around a dark disc, n turns the same way all along. */
#include "sensors/eye/pupil_work.h"

#include <math.h>
#include <stdlib.h>

/* Two edges are linked where their gradients are within 53 degrees and the step between them within 60 of
 * the way ahead: what a circle of 3 px radius does in two steps. */
static const float same_cosine = 0.6f, ahead_cosine = 0.5f;
/* A chain is cut where, over TURN edges, it turns by more than 65 degrees (a corner: radius below 3.5 px)
 * or by 17 degrees to the bright side (noise turns it by 5). */
enum { TURN = 4 };
static const float corner_cosine = 0.42f, away_sine = -0.3f;
/* Arcs that turn less are as good as straight: the centre lies anywhere. */
static const float turn_least = 0.5f;
/* Seeds closer than this share of their radii are the same one. */
static const float same_share = 0.2f;

/* The neighbours that can lie ahead of an edge, by the sixteenth of the circle that its way points into:
 * those of the 8 first, then those of the 16 around them. */
enum { SIXTEENTHS = 16, AHEAD = 3 + 8 };
struct ahead {
    int near, count;
    struct {
        int offset;
        float x, y, nearness; /* nearness: 1 over the squared distance */
    } step[AHEAD];
};

/* Any numbering will do, as long as it is the same for tables and edges. */
static int sixteenth(float x, float y)
{
    float ax = fabsf(x), ay = fabsf(y), more = fmaxf(ax, ay), less = fminf(ax, ay);
    return (x < 0 ? 8 : 0) | (y < 0 ? 4 : 0) | (ay > ax ? 2 : 0) | (less > 0.4142f * more ? 1 : 0);
}

static void neighbours_ahead(int row, struct ahead table[SIXTEENTHS])
{
    /* Within 60 degrees of the way, which is within 11.25 of the sixteenth's middle. */
    float least = cosf((float)M_PI / 180 * 71.25f);
    for (int i = 0; i < SIXTEENTHS; i++) {
        float angle = 2 * (float)M_PI * ((float)i + 0.5f) / SIXTEENTHS, tx = cosf(angle), ty = sinf(angle);
        struct ahead *a = &table[sixteenth(tx, ty)];
        a->count = 0;
        for (int reach = 1; reach <= 2; reach++) {
            for (int dy = -reach; dy <= reach; dy++)
                for (int dx = -reach; dx <= reach; dx++) {
                    float far = hypotf((float)dx, (float)dy);
                    if ((abs(dx) < reach && abs(dy) < reach) || (float)dx * tx + (float)dy * ty < least * far)
                        continue;
                    a->step[a->count].offset = dy * row + dx;
                    a->step[a->count].x = (float)dx;
                    a->step[a->count].y = (float)dy;
                    a->step[a->count++].nearness = 1 / (far * far);
                }
            if (reach == 1) a->near = a->count;
        }
    }
}

/* The best link ahead of an edge; it takes the place of a worse one to the same edge. */
static void link_ahead(struct fv_pupil_work *work, const struct ahead table[SIXTEENTHS], int index)
{
    struct fv_edge *e = &work->edge[index];
    float tx = -e->ny, ty = e->nx, best = 0;
    const struct ahead *a = &table[sixteenth(tx, ty)];
    const uint16_t *at = work->at + e->row * work->row + e->column;
    int to = FV_NO_EDGE;
    for (int i = 0; i < a->count && !(i == a->near && to != FV_NO_EDGE); i++) {
        int other = at[a->step[i].offset];
        if (other == FV_NO_EDGE) continue;
        float along = a->step[i].x * tx + a->step[i].y * ty, fit = along * a->step[i].nearness;
        if (along * fit < ahead_cosine * ahead_cosine) continue;
        const struct fv_edge *o = &work->edge[other];
        float same = e->nx * o->nx + e->ny * o->ny;
        fit *= same;
        if (same >= same_cosine && fit > best) {
            best = fit;
            to = other;
        }
    }
    if (to == FV_NO_EDGE || best <= work->edge[to].link) return;
    if (work->edge[to].before != FV_NO_EDGE) work->edge[work->edge[to].before].next = FV_NO_EDGE;
    work->edge[to].before = (uint16_t)index;
    work->edge[to].link = best;
    e->next = (uint16_t)to;
}

/* Sine and cosine of the turn between two edges. */
static void turn_between(const struct fv_edge *a, const struct fv_edge *b, float *sine, float *cosine)
{
    *sine = a->nx * b->ny - a->ny * b->nx;
    *cosine = a->nx * b->nx + a->ny * b->ny;
}

/* The circle whose middle the gradients' lines pass nearest: least squares of (p - m) x n. */
static bool circle_through(const struct fv_pupil_work *work, const struct fv_arc *arc, struct fv_seed *seed)
{
    float xx = 0, xy = 0, yy = 0, rx = 0, ry = 0;
    const struct fv_edge *origin = &work->edge[work->order[arc->first]];
    int step = 1 + arc->count / 64;
    for (int i = 0; i < arc->count; i += step) {
        const struct fv_edge *e = &work->edge[work->order[arc->first + i]];
        float tx = -e->ny, ty = e->nx, along = tx * (e->x - origin->x) + ty * (e->y - origin->y);
        xx += tx * tx;
        xy += tx * ty;
        yy += ty * ty;
        rx += tx * along;
        ry += ty * along;
    }
    float determinant = xx * yy - xy * xy, trace = xx + yy;
    if (!(determinant > 0.003f * trace * trace)) return false;
    float x = origin->x + (yy * rx - xy * ry) / determinant,
          y = origin->y + (xx * ry - xy * rx) / determinant;
    float radius = 0, outward = 0;
    int n = 0;
    for (int i = 0; i < arc->count; i += step, n++) {
        const struct fv_edge *e = &work->edge[work->order[arc->first + i]];
        radius += hypotf(e->x - x, e->y - y);
        outward += e->nx * (e->x - x) + e->ny * (e->y - y);
    }
    seed->x = x;
    seed->y = y;
    seed->radius = radius / (float)n;
    return outward > 0.8f * radius;
}

static bool same_circle(const struct fv_seed *a, const struct fv_seed *b)
{
    float near = same_share * fminf(a->radius, b->radius);
    return fabsf(a->x - b->x) < near && fabsf(a->y - b->y) < near && fabsf(a->radius - b->radius) < near;
}

/* Keeps the FV_SEEDS_MAX worthiest seeds, sorted; of those that are the same the worthiest. */
static void add_seed(struct fv_pupil_work *work, const struct fv_seed *seed)
{
    int kept = 0, at;
    for (int i = 0; i < work->seeds; i++)
        if (same_circle(&work->seed[i], seed) && work->seed[i].worth >= seed->worth) return;
    for (int i = 0; i < work->seeds; i++)
        if (!same_circle(&work->seed[i], seed)) work->seed[kept++] = work->seed[i];
    if (kept == FV_SEEDS_MAX && work->seed[--kept].worth >= seed->worth) {
        work->seeds = kept + 1;
        return;
    }
    for (at = kept; at > 0 && work->seed[at - 1].worth < seed->worth; at--)
        work->seed[at] = work->seed[at - 1];
    work->seed[at] = *seed;
    work->seeds = kept + 1;
}

/* An arc from order[first] on: a seed where it turns enough on a circle of the sizes looked for. What it is
 * worth: the angle that it covers, more for wide ones, whose chance of being an accident is less. */
static void end_arc(struct fv_pupil_work *work, int first, int end, float turn)
{
    if (turn < turn_least || end - first < 5 || work->arcs == FV_ARCS_MAX) return;
    struct fv_arc *arc = &work->arc[work->arcs];
    struct fv_seed seed = {.arc = work->arcs};
    *arc = (struct fv_arc){first, end - first, turn};
    if (!circle_through(work, arc, &seed)) return;
    if (!(seed.radius > 0.7f * (float)work->least && seed.radius < 1.3f * (float)work->most)) return;
    float covered = (float)arc->count / seed.radius;
    seed.worth = fminf(fminf(turn, covered), 6.3f) * sqrtf(seed.radius);
    work->arcs++;
    add_seed(work, &seed);
}

/* Cuts the chain order[first..end) into arcs. */
static void cut(struct fv_pupil_work *work, int first, int end)
{
    int begun = first;
    float turn = 0;
    for (int i = first; i + TURN < end; i++) {
        float sine, cosine;
        turn_between(&work->edge[work->order[i]], &work->edge[work->order[i + TURN]], &sine, &cosine);
        if (sine < away_sine || cosine < corner_cosine) {
            end_arc(work, begun, i + TURN / 2, turn);
            begun = i + TURN / 2;
            turn = 0;
        } else if (i >= begun) turn += sine / TURN * (1 + 0.17f * sine * sine); /* arcsine */
    }
    end_arc(work, begun, end, turn);
}

/* One chain, from an edge on: its edges leave the lists of links. */
static int walk(struct fv_pupil_work *work, int from, int at)
{
    while (from != FV_NO_EDGE && work->edge[from].link >= 0) {
        int next = work->edge[from].next;
        work->order[at++] = (uint16_t)from;
        work->edge[from].next = FV_NO_EDGE;
        work->edge[from].link = -1;
        from = next;
    }
    return at;
}

void fv_pupil_arcs(struct fv_pupil_work *work)
{
    struct ahead table[SIXTEENTHS];
    int at = 0;
    work->arcs = work->seeds = 0;
    neighbours_ahead(work->row, table);
    for (int i = 0; i < work->edges; i++) link_ahead(work, table, i);
    /* Chains with a beginning, then what is left: closed ones. */
    for (int closed = 0; closed < 2; closed++)
        for (int i = 0; i < work->edges; i++) {
            if (work->edge[i].link < 0 || (!closed && work->edge[i].before != FV_NO_EDGE)) continue;
            int end = walk(work, i, at);
            if (end - at > TURN) cut(work, at, end);
            at = end;
        }
}
