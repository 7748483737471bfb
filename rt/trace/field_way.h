/* field_way: a packet of rays on its way through fields: which parts are in reach, and the nearest of them. For
 * kernels only; field_march.h and field_starts_kernel.c step along it. */
#ifndef FV_TRACE_FIELD_WAY_H
#define FV_TRACE_FIELD_WAY_H

#include "rt/trace/field_cull.h"
#include "rt/trace/field_eval.h"
#include "rt/trace/rays.h"

/* From t = 0 on; hits are FV_FIELD_HIT of the way and FV_FIELD_HIT more. Rays of no direction, or of one that is no
 * number, are none. */
static inline struct field_rays field_rays_of(vf3 origin, vf3 direction, vi mask)
{
    vf length = vf_root(vf_dot(direction, direction)), zero = vf_of(0);
    vi good = (length > 1e-12f) & (length < 1e12f);
    length = vf_select(good, length, vf_of(1));
    return (struct field_rays){origin, direction, zero, zero, vf_of(FV_FIELD_HIT), length * FV_FIELD_HIT, length,
                               mask & good, vi_of(-1)};
}

/* A packet on its way. Parts [0, active) of `now` are those that any ray is in the reach of. */
struct field_way {
    const struct field_rays *rays;
    const struct field_kept *kept;
    int next, active; /* next: of kept, the first that none has reached yet */
    int now[FV_FIELD_PARTS_MAX];
    vf t, sure; /* sure: where an over-long step may be taken back to; else t */
    vi live;
};

static inline float field_next_enter(const struct field_way *w)
{
    return w->next < w->kept->count ? w->kept->at[w->next].enter : __builtin_inff();
}

static inline void field_begin(struct field_way *w, const struct field_rays *r, const struct field_kept *kept)
{
    w->rays = r;
    w->kept = kept;
    w->t = w->sure = r->from;
    w->live = r->mask & (r->from <= r->far);
    w->next = w->active = 0;
}

/* Rays go no farther. False where none are left. */
static inline bool field_within(struct field_way *w, vf far)
{
    w->live &= w->sure <= far;
    return vi_any(w->live);
}

/* Takes in what rays have reached; where none is in the reach of anything, all go on to the next part first. False
 * where there is nothing left to meet. */
static inline bool field_reach(struct field_way *w)
{
    if (!field_within(w, w->rays->far)) return false;
    if (w->active == 0) {
        if (w->next == w->kept->count) return false;
        w->t = w->sure = vf_max(w->t, vf_of(w->kept->at[w->next].enter));
        w->live &= w->t <= w->rays->far;
    }
    while (w->next < w->kept->count && vi_any(w->live & (w->t >= w->kept->at[w->next].enter)))
        w->now[w->active++] = w->next++;
    return vi_any(w->live);
}

/* The fields at the packet's points, of parts that each ray has come to, and the nearest of these; `next`: where a
 * ray comes to another one. Parts that all rays have left behind go. */
static inline vf field_nearest(struct field_way *w, const struct fv_fields *f, vi *part, vf *next)
{
    vf best = vf_of(1e30f);
    vf3 p = vf3_add(w->rays->origin, vf3_scale(w->rays->direction, w->t));
    *next = vf_of(field_next_enter(w));
    *part = vi_of(0);
    for (int i = 0; i < w->active; i++) {
        const struct field_met *met = &w->kept->at[w->now[i]];
        int id = met->part;
        vi there = w->t >= met->near;
        if (!vi_any(w->live & (w->sure <= met->exit))) {
            w->now[i--] = w->now[--w->active];
            continue;
        }
        *next = vf_select(there, *next, vf_min(met->near, *next));
        if (!vi_any(w->live & there)) continue;
        vf d = field_part(f->code + f->part[id].first, f->part[id].count, p);
        vi nearer = there & (d < best);
        best = vf_select(nearer, d, best);
        *part = vi_select(nearer, vi_of(id), *part);
    }
    return best;
}

#endif
