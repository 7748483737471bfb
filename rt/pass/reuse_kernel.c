/* reuse_kernel: a row of pixels that may take the last frame's colours; see reuse.h. */
#include "rt/pass/backproject_history.h"
#include "rt/pass/reuse.h"

#define reuse FV_ISA_NAME(fv_reuse)

void reuse(struct fv_reuse *r);

/* Attributes of a hit, now and before. */
struct pair {
    vi identity, facing, identity_before, facing_before;
};

/* Pixels of the last frame that places lie in. */
struct cell {
    vi x, y, index; /* index: 0 of those outside */
};

static inline vi words_at(const struct fv_reuse *r, const uint32_t *words, const struct cell *c, vi mask)
{
    const struct source s = {.cache = words, .stride = r->last.stride, .last_row = r->last.height - 1};
    return cache_at(&s, c->x, c->y, c->index, mask);
}

/* Of the row's pixels from the i-th on, of the first hits or of the second ones. */
static inline struct pair pair_of(const struct fv_reuse *r, int i, const struct cell *c, vi mask, bool second)
{
    const uint32_t *identity = second ? r->now.second_identity : r->now.identity;
    const uint32_t *facing = second ? r->now.second_facing : r->now.facing;
    return (struct pair){vi_load(identity + i), vi_load(facing + i),
                         words_at(r, second ? r->before.second_identity : r->before.identity, c, mask),
                         words_at(r, second ? r->before.second_facing : r->before.facing, c, mask)};
}

static inline vi turned(const struct pair *p, float limit)
{
    vf3 sum = vf3_add(pixel_unpack(p->facing), pixel_unpack(p->facing_before));
    sum = vf3_scale((vf3){sum.x - 1022.0f, sum.y - 1022.0f, sum.z - 1022.0f}, vf_of(1 / 511.0f));
    return ((p->identity & 0xffff) != 0) & ((p->identity_before & 0xffff) != 0) & (vf_dot(sum, sum) < limit);
}

/* Lowers tau to the least threshold of the attributes that disagree; returns where some do. */
static inline vi disagree(const struct pair *p, const float *threshold, float limit, vf *tau)
{
    vi differ = p->identity ^ p->identity_before;
    const vi of[] = {[FV_TAU_OBJECT] = (differ & FV_IDENTITY_OBJECT) != 0, [FV_TAU_FACING] = turned(p, limit),
                     [FV_TAU_SHADOWS] = (differ & FV_IDENTITY_SHADOWS) != 0, [FV_TAU_TEXTURED] = (differ & FV_IDENTITY_TEXTURED) != 0};
    vi any = vi_of(0);
    for (int k = 0; k < FV_TAU_SECOND; k++) {
        *tau = vf_select(of[k], vf_min(*tau, vf_of(threshold[k])), *tau);
        any |= of[k];
    }
    return any;
}

static inline vi contrast(vf a, vf b, vf tau)
{
    return vf_abs(a - b) - 1.0f > tau * (a + b);
}

static inline vi chain_before(const struct fv_reuse *r, const struct cell *c)
{
    return (vi)((vu)vi_gather(r->chain_before, c->index >> 2) >> (vu)((c->index & 3) << 3)) & 255;
}

/* Pixels whose attributes and own colours agree with those before, or whose second hits do where there are such; in the
 * lanes of mask. */
static inline vi agree(const struct fv_reuse *r, int i, const struct where *at, const struct cell *c, vi moving, vi mask)
{
    const struct fv_selective *s = r->settings;
    const struct source base = source_before(&r->last, r->before.base);
    const float limit = 2 + (s->facing_limit - 10) / 3; /* of two normals; the setting's is of four */
    struct pair first = pair_of(r, i, c, mask, false);
    vf tau = vf_of(__builtin_inff());
    vi parted = vi_of(0);
    vf3 before, now = pixel_unpack(vi_load(r->now.base + i));
    vi hit = ((first.identity & 0xffff) != 0) & ((first.identity_before & 0xffff) != 0);
    vi then = (vi)((vu)first.identity_before >> FV_IDENTITY_STAMP_SHIFT) == r->stamp_before;
    mask &= hit & then;
    if (!vi_any(mask)) return mask;
    disagree(&first, s->threshold, limit, &tau);
    if (r->now.second_identity) {
        struct pair second = pair_of(r, i, c, mask, true);
        parted = disagree(&second, s->threshold + FV_TAU_SECOND, limit, &tau);
    }
    tau = vf_select(tau < 1e30f, tau, vf_of(s->threshold[FV_TAU_COLOUR])) * vf_load(r->tolerance + i);
    vf found = mean_around(&base, at, moving, &before);
    vi differ = contrast(now.x, before.x, tau * 1.36f) | contrast(now.y, before.y, tau * 1.02f) |
                contrast(now.z, before.z, tau * 2.04f);
    return mask & (found > 0.5f) & ~differ & ~parted;
}

/* A vector of the row: of those that may be, the pixels that are reused; `chain`: the length of theirs. */
static inline vi reuse_from(const struct fv_reuse *r, const struct source *last, int i, const struct pixels *p, bool moves,
                            vi may, vi *chain)
{
    struct where at = project(&r->last, p, moves);
    may &= at.inside & ~p->mixed & (p->nearest - p->farthest <= 0.125f * r->last.together);
    if (!vi_any(may)) return may;
    struct cell c = {.x = vi_from(at.x), .y = vi_from(at.y)};
    c.index = (c.y * last->stride + c.x) & at.inside;
    *chain = chain_before(r, &c);
    may = agree(r, i, &at, &c, p->moving, may & (*chain < r->settings->reuse_max));
    if (!vi_any(may)) return may;
    vi colour = vi_load(r->colour + i), mean = pixel_pack(cubic(last, at.x, at.y)) | (colour & (int32_t)~FV_PIXEL_COLOUR);
    vi_store(r->colour + i, vi_select(may, mean, colour));
    return may;
}

void reuse(struct fv_reuse *r)
{
    const struct source last = source_before(&r->last, r->last.colour);
    r->central = r->reused = 0;
    for (int i = 0; i < r->row.count; i += FV_WIDTH) {
        struct pixels p;
        bool moves;
        vi own = vi_load(r->now.identity + i), known = take_pixels(&r->row, i, &p, &moves), chain = vi_of(0);
        vi central = (vf_load(r->tolerance + i) >= 0.0f) & ((vi)((vu)own >> FV_IDENTITY_STAMP_SHIFT) == r->row.stamp);
        vi may = central & known & (((vi_of((int32_t)(r->due >> i)) >> vi_lanes()) & 1) == 0);
        if (vi_any(may)) may = reuse_from(r, &last, i, &p, moves, may, &chain);
        vi_store(r->chain + i, vi_select(central, may & (chain + 1), vi_of(FV_CHAIN_NONE)));
        r->central |= (uint32_t)vi_bits(central) << i;
        r->reused |= (uint32_t)vi_bits(may) << i;
    }
}
