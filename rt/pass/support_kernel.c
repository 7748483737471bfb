/* support_kernel: a packet of support nodes, answered by history: each one's place in the last frame is guessed from
 * the depths that the nodes around had there, and by the surface that is found at the guess. A guess counts where
 * the history at its place has the depth that it predicts; the nearest that does wins, as in reprojection. */
#include "rt/pass/reproject_history.h"
#include "rt/pass/support.h"

#define answer FV_ISA_NAME(fv_support_answer)
void answer(struct fv_support_packet *packet);

enum { NODES = FV_PACKET * FV_PACKET, REACH = 2 * FV_AROUND + 1 };

/* Of a packet's nodes: what there is within FV_AROUND nodes of each. */
struct around {
    _Alignas(64) float nearest[NODES], farthest[NODES];
    _Alignas(64) int32_t surface[NODES]; /* bits of any */
    bool edge;                           /* some node's is more than one surface */
};

static void take_around(struct fv_support_packet *t, struct around *a)
{
    vf high = vf_of(0), low = vf_of(2 * FV_INVERSE_DEPTH_MAX);
    vi seen = vi_of(0);
    for (int i = 0; i < FV_WINDOW * FV_WINDOW; i += FV_WIDTH) {
        vf w = vf_load(t->old_depth + i);
        w = vf_select((w >= 0.0f) & (w <= FV_INVERSE_DEPTH_MAX), w, vf_of(0));
        vf_store(t->old_depth + i, w);
        high = vf_max(w, high);
        low = vf_min(w, low);
        seen |= vi_load(t->old_surface + i);
    }
    float nearest = high[0], farthest = low[0];
    int32_t surface = seen[0];
    for (int i = 1; i < FV_WIDTH; i++) {
        nearest = nearest > high[i] ? nearest : high[i];
        farthest = farthest < low[i] ? farthest : low[i];
        surface |= seen[i];
    }
    a->edge = nearest - farthest > 4 * t->epsilon * nearest;
    for (int i = 0; i < NODES; i++) a->nearest[i] = nearest, a->farthest[i] = farthest, a->surface[i] = surface;
    if (!a->edge && !(surface & (FV_SURFACE_OBJECT | FV_SURFACE_VIEW))) return;
    _Alignas(64) float most[FV_PACKET * FV_WINDOW], least[FV_PACKET * FV_WINDOW];
    _Alignas(64) int32_t any[FV_PACKET * FV_WINDOW];
    for (int i = 0; i < FV_PACKET * FV_WINDOW; i++) {
        most[i] = least[i] = t->old_depth[i];
        any[i] = t->old_surface[i];
        for (int k = 1; k < REACH; k++) {
            float w = t->old_depth[i + k * FV_WINDOW];
            most[i] = most[i] > w ? most[i] : w;
            least[i] = least[i] < w ? least[i] : w;
            any[i] |= t->old_surface[i + k * FV_WINDOW];
        }
    }
    for (int i = 0; i < NODES; i++) {
        int at = i / FV_PACKET * FV_WINDOW + i % FV_PACKET;
        a->nearest[i] = most[at], a->farthest[i] = least[at], a->surface[i] = any[at];
        for (int k = 1; k < REACH; k++) {
            a->nearest[i] = a->nearest[i] > most[at + k] ? a->nearest[i] : most[at + k];
            a->farthest[i] = a->farthest[i] < least[at + k] ? a->farthest[i] : least[at + k];
            a->surface[i] |= any[at + k];
        }
    }
}

/* Further guesses of the lanes that are at an edge or where the first one failed. */
static __attribute__((noinline)) void try_others(const struct source *s, vf3 along, vf nearest, vf farthest, vi edge,
                                                 struct place *best)
{
    struct place shown = look_up(s, along, history_surface(s, along, best));
    prefer(best, &shown);
    if (!vi_any(edge)) return;
    struct place front = look_up(s, along, nearest), back = look_up(s, along, farthest);
    struct place front_shown = look_up(s, along, history_surface(s, along, &front));
    struct place back_shown = look_up(s, along, history_surface(s, along, &back));
    prefer(best, &front);
    prefer(best, &front_shown);
    prefer(best, &back);
    prefer(best, &back_shown);
}

/* The best of a raster's places for a vector of nodes. */
static FV_INLINE struct place find(const struct source *s, vf3 along, vf w, const struct around *a, int i)
{
    struct place best = look_up(s, along, w);
    if (!a->edge && !vi_any(~best.good)) return best;
    vf nearest = vf_load(a->nearest + i), farthest = vf_load(a->farthest + i);
    vi edge = nearest - farthest > 4 * s->epsilon * nearest;
    if (vi_any(edge | ~best.good)) try_others(s, along, nearest, farthest, edge, &best);
    return best;
}

void answer(struct fv_support_packet *t)
{
    const float(*m)[3] = t->map->m;
    const struct fv_raster *r = t->history[0], *q = t->history[1];
    struct source first = source_of(r, t->map, 1 / r->scale, t->epsilon, t->still);
    struct source second = source_of(q, t->map, 1 / q->scale, t->epsilon, t->still);
    struct around around;
    take_around(t, &around);
    t->answered = t->by_second = 0;
    for (int i = 0; i < NODES; i += FV_WIDTH) {
        vi lane = vi_lanes() + i, column = lane & (FV_PACKET - 1), row = lane / FV_PACKET;
        vi own = (row + FV_AROUND) * FV_WINDOW + column + FV_AROUND, surface = vi_load(around.surface + i);
        vf x = t->x + vf_from(column) * t->spacing, y = t->y + vf_from(row) * t->spacing;
        vf3 along = {m[0][0] * x + (m[0][1] * y + m[0][2]), m[1][0] * x + (m[1][1] * y + m[1][2]),
                     m[2][0] * x + (m[2][1] * y + m[2][2])};
        vf w = vf_gather(t->old_depth, own);
        struct place best = find(&first, along, w, &around, i);
        vi absent = ~best.good & cache_none(best.cache);
        if (vi_any(absent)) {
            struct place other = find(&second, along, w, &around, i);
            other.good &= absent;
            prefer(&best, &other);
            t->by_second |= vi_bits(other.good) << i;
        }
        vi answered = best.good & (cache_rho(best.cache) > 0) &
                      ((surface & (FV_SURFACE_OBJECT | FV_SURFACE_VIEW)) == 0);
        vf_store(t->inverse_depth + i, history_surface(&first, along, &best));
        vi_store(t->pixel + i, best.index);
        vi_store(t->surface + i, vi_gather(t->old_surface, own) & FV_SURFACE_GRAZING);
        t->answered |= vi_bits(answered) << i;
    }
}
