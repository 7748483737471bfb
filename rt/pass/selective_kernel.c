/* selective_kernel: rows of corners tested, and rows of pixels put together; see selective.h. */
#include "rt/pass/cache.h"
#include "rt/pass/selective.h"
#include "rt/trace/pixel.h"

#define test_corners FV_ISA_NAME(fv_test_corners)
#define resolve FV_ISA_NAME(fv_resolve)
#define decode FV_ISA_NAME(fv_pixel_decode)

void test_corners(struct fv_corners *c);
void resolve(const struct fv_resolve *r);
void decode(const uint32_t *pixel, float *red, float *green, float *blue, int n);

/* The four pixels around each corner. */
struct four {
    vi at[4];
};

static inline struct four around(const uint32_t *const row[2], int i)
{
    return (struct four){{vi_load(row[0] + i), vi_load(row[0] + i + 1), vi_load(row[1] + i), vi_load(row[1] + i + 1)}};
}

static inline vi differ(const struct four *f, int32_t bits)
{
    return (((f->at[0] ^ f->at[1]) | (f->at[0] ^ f->at[2]) | (f->at[0] ^ f->at[3])) & bits) != 0;
}

/* By the squared distances between each two of the four: of those to the first, four times the sum less the sum's own
 * square. Exact, so that normals of one code never disagree. */
static inline vi turned(const struct four *f, float limit)
{
    vf3 first = pixel_unpack(f->at[0] & 0x3fffffff), sum = {vf_of(0), vf_of(0), vf_of(0)};
    vf squares = vf_of(0);
    for (int k = 1; k < 4; k++) {
        vf3 off = vf3_sub(pixel_unpack(f->at[k] & 0x3fffffff), first);
        squares += vf_dot(off, off);
        sum = vf3_add(sum, off);
    }
    return 4.0f * squares - vf_dot(sum, sum) > limit * (511.0f * 511.0f);
}

struct geometry {
    struct four identity, facing;
};

static inline void least(vf *tau, vi disagree, float threshold)
{
    *tau = vf_select(disagree, vf_min(*tau, vf_of(threshold)), *tau);
}

/* Lowers tau, which is infinite at first, to the least threshold of the attributes that disagree. */
static inline void geometry_tau(const struct geometry *g, const float *threshold, float limit, vf *tau)
{
    vi parted = differ(&g->identity, FV_IDENTITY_OBJECT);
    vi hit = vi_of(-1);
    for (int k = 0; k < 4; k++) hit &= (g->identity.at[k] & 0xffff) != 0;
    least(tau, parted, threshold[FV_TAU_OBJECT]);
    least(tau, hit & turned(&g->facing, limit), threshold[FV_TAU_FACING]);
    least(tau, differ(&g->identity, FV_IDENTITY_SHADOWS), threshold[FV_TAU_SHADOWS]);
    least(tau, differ(&g->identity, FV_IDENTITY_TEXTURED), threshold[FV_TAU_TEXTURED]);
}

static inline vi contrast(const struct four *base, int shift, vf tau)
{
    vf most = vf_of(0), low = vf_of(1023);
    for (int k = 0; k < 4; k++) {
        vf v = vf_from((base->at[k] >> shift) & 1023);
        most = vf_max(most, v), low = vf_min(low, v);
    }
    return most - low - 1.0f > tau * (most + low);
}

/* Corners whose pixels show one surface, by the plane through the first. */
static inline vi on_one_surface(const struct fv_corners *c, const struct geometry *first, int i)
{
    const struct fv_view *v = c->view;
    struct four triangle = around(c->triangle, i), lit = around(c->lit, i), cache = around(c->cache, i);
    vi one = ~differ(&lit, -1) & ((first->identity.at[0] & (FV_IDENTITY_OBJECT & ~0xffff)) == 0);
    vf3 normal = vf3_sub(pixel_unpack(first->facing.at[0] & 0x3fffffff), (vf3){vf_of(511), vf_of(511), vf_of(511)});
    vf x = c->x - 0.5f + vf_from(vi_lanes() + i);
    vf cosine[4], w[4];
    for (int k = 0; k < 4; k++) {
        vf3 d = vf3_add(vf3_of(v->corner), vf3_scale(vf3_of(v->dx), x + (float)(k & 1)));
        d = vf3_add(d, vf3_scale(vf3_of(v->dy), vf_of(c->y - 0.5f + (float)(k >> 1))));
        cosine[k] = vf_dot(normal, d);
        w[k] = cache_depth(cache.at[k]);
        one &= triangle.at[k] >= 0;
        one &= vf_abs(w[k] * cosine[0] - w[0] * cosine[k]) <= 0.01f * w[0] * vf_abs(cosine[0]);
    }
    return one;
}

void test_corners(struct fv_corners *c)
{
    const struct fv_selective *s = c->settings;
    uint32_t stamp = (uint32_t)c->stamp << FV_IDENTITY_STAMP_SHIFT;
    c->tested = c->failed = c->known = 0;
    for (int i = 0; i < c->count; i += FV_WIDTH) {
        struct geometry first = {around(c->identity, i), around(c->facing, i)};
        struct four base = around(c->base, i);
        vf tolerance = vf_load(c->tolerance + i), tau = vf_of(__builtin_inff());
        vi unknown = vi_of(0);
        for (int k = 0; k < 4; k++) unknown |= first.identity.at[k] ^ (int32_t)stamp;
        vi tested = ((unknown >> FV_IDENTITY_STAMP_SHIFT) == 0) & (tolerance >= 0.0f) & (vi_lanes() < c->count - i);
        geometry_tau(&first, s->threshold, s->facing_limit, &tau);
        if (c->second_identity[0]) {
            struct geometry second = {around(c->second_identity, i), around(c->second_facing, i)};
            geometry_tau(&second, s->threshold + FV_TAU_SECOND, s->facing_limit, &tau);
        }
        vi agree = tau > 1e30f;
        tau = vf_select(tau < 1e30f, tau, vf_of(s->threshold[FV_TAU_COLOUR])) * tolerance;
        vi failed = contrast(&base, 0, tau * 1.36f) | contrast(&base, 10, tau * 1.02f) | contrast(&base, 20, tau * 2.04f);
        c->tested |= (uint64_t)vi_bits(tested) << i;
        c->failed |= (uint64_t)vi_bits(tested & failed) << i;
        if (c->triangle[0] && vi_any(tested & failed & agree))
            c->known |= (uint64_t)vi_bits(tested & failed & agree & on_one_surface(c, &first, i)) << i;
    }
}

static inline vi lanes_of(uint64_t bits, int i)
{
    return ((vi_of((int32_t)(bits >> i)) >> vi_lanes()) & 1) != 0;
}

/* Nine sixteenths of the pixel itself, three of each pixel beside the subpixel, one of that across. */
static inline vf interpolated(const float *const row[3], int i, int beside, int above)
{
    vf own = vf_load(row[1] + i + 1), x = vf_load(row[1] + i + beside), y = vf_load(row[above] + i + 1);
    return (9.0f * own + 3.0f * (x + y) + vf_load(row[above] + i + beside)) * (1 / 64.0f);
}

void resolve(const struct fv_resolve *r)
{
    for (int i = 0; i < r->count; i += FV_WIDTH) {
        vi tested = lanes_of(r->tested[0] & r->tested[0] >> 1 & r->tested[1] & r->tested[1] >> 1, i) & (vi_lanes() < r->count - i) & ~lanes_of(r->reused, i);
        if (!vi_any(tested)) continue;
        vf linear[3];
        for (int c = 0; c < 3; c++) {
            linear[c] = vf_load(r->extra[c] + i) * r->exposure;
            for (int k = 0; k < 4; k++) {
                int right = k & 1, below = k >> 1;
                vi failed = lanes_of(r->failed[below] >> right, i);
                linear[c] += vf_select(failed, vf_of(0), interpolated(r->around[c], i, 2 * right, 2 * below));
            }
        }
        vi before = vi_load(r->colour + i), after = pixel_encode((vf3){linear[0], linear[1], linear[2]}, 1);
        vi_store(r->colour + i, vi_select(tested, after | (before & ~0x3fffffff), before));
    }
}

void decode(const uint32_t *pixel, float *red, float *green, float *blue, int n)
{
    for (int i = 0; i < n; i += FV_WIDTH) {
        vf3 linear = pixel_decode(pixel_unpack(vi_load(pixel + i)));
        vf_store(red + i, linear.x);
        vf_store(green + i, linear.y);
        vf_store(blue + i, linear.z);
    }
}
