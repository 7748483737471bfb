/* pyramid_repaint_kernel: pixels between those of a lower level that differ by checks only; see pyramid.h. */
#include "rt/pass/pyramid.h"
#include "rt/trace/field_surface.h"
#include "rt/trace/pixel.h"

#define repaint FV_ISA_NAME(fv_pyramid_repaint)

void repaint(const struct fv_repaint *r);

/* The four pixels around, row by row, and what lies between them last. */
enum { AROUND = 4, BETWEEN = AROUND, PLACES };
struct places {
    vi part, same;        /* `same`: mask, all show its checks */
    vf w[PLACES], weight[AROUND];
    vf3 direction[PLACES], point[PLACES], normal, light[AROUND]; /* light: what comes from there, by the exposure */
};

static inline void put(struct places *p, int k, const struct fv_view *view, vf x, vf y, vf w)
{
    vf3 across = vf3_scale(vf3_of(view->dx), x), along = vf3_scale(vf3_of(view->dy), y);
    p->w[k] = w;
    p->direction[k] = vf3_add(vf3_of(view->corner), vf3_add(across, along));
    p->point[k] = vf3_add(vf3_of(view->origin), vf3_scale(p->direction[k], 1.0f / w));
}

static inline vf3 cross(vf3 a, vf3 b)
{
    return (vf3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/* False where none of the lanes can be painted. */
static inline bool find(const struct fv_repaint *r, int i, struct places *p)
{
    const float flat = 2.5e-4f; /* of the inverse depth: a quarter of a headset's pixel */
    vf x = vf_load(r->x + i), y = vf_load(r->y + i), u = (x - r->x0) / r->size, v = (y - r->y0) / r->size;
    vf column = vf_floor(u), row = vf_floor(v), fx = u - column, fy = v - row, w[AROUND], unit = vf_of(1);
    vi known = vi_lanes() < r->count - i, at = (vi_from(row) * r->stride + vi_from(column)) & known, first = at;
    p->same = known;
    for (int k = 0; k < AROUND; k++) {
        vi from = at + (k & 1) + (k >> 1) * r->stride, seen = vi_gather(r->seen, from);
        if (k == 0) first = seen & FV_SEEN_PART;
        p->same &= (seen & FV_SEEN_PART) == first;
        w[k] = (vf)(seen & ~FV_SEEN_PART);
        p->weight[k] = (k & 1 ? fx : 1.0f - fx) * (k >> 1 ? fy : 1.0f - fy);
    }
    p->same &= (first != 0) & (vf_abs(w[0] + w[3] - w[1] - w[2]) <= flat * w[0]);
    if (!vi_any(p->same)) return false;
    for (int k = 0; k < AROUND; k++) {
        vi from = at + (k & 1) + (k >> 1) * r->stride;
        p->light[k] = pixel_decode(pixel_unpack(vi_gather(r->pixel, from)));
    }
    p->part = first - 1;
    vf between = vf_of(0);
    for (int k = 0; k < AROUND; k++) {
        w[k] = vf_select(p->same, w[k], unit);
        between += w[k] * p->weight[k];
        put(p, k, r->view, r->x0 + (column + (float)(k & 1)) * r->size, r->y0 + (row + (float)(k >> 1)) * r->size, w[k]);
    }
    put(p, BETWEEN, r->view, x, y, between);
    vf3 across = vf3_sub(p->point[1], p->point[0]), along = vf3_sub(p->point[2], p->point[0]);
    p->normal = vf3_normalise(cross(across, along), (vf3){vf_of(0), unit, vf_of(0)});
    return true;
}

/* What each place reflects, by its own checks. */
static inline void reflect(const struct fv_repaint *r, const struct places *p, vf3 albedo[PLACES])
{
    for (int k = 0; k < PLACES; k++) albedo[k] = vf3_of((float[3]){0, 0, 0});
    for (unsigned pending = vi_bits(p->same); pending;) {
        int id = p->part[__builtin_ctz(pending)];
        vi lanes = p->same & (p->part == id);
        pending &= ~vi_bits(lanes);
        const struct fv_field_part *part = &r->scene->fields.part[id];
        for (int k = 0; k < PLACES; k++) {
            vf3 diffuse = vf3_of(r->scene->material[part->material].diffuse);
            field_checks(part, lanes, p->point[k], p->direction[k], p->normal, r->view->pixel_size / p->w[k], &diffuse);
            albedo[k] = vf3_select(lanes, diffuse, albedo[k]);
        }
    }
}

static inline vf sum_of(vf3 a)
{
    return a.x + a.y + a.z;
}

void repaint(const struct fv_repaint *r)
{
    const float alike = 0.15f, least = 1e-3f;
    for (int i = 0; i < r->count; i += FV_WIDTH) {
        struct places p;
        vf3 albedo[PLACES], light = vf3_of((float[3]){0, 0, 0}), mean = light;
        vi_store(r->painted + i, vi_of(0));
        if (!find(r, i, &p)) continue;
        reflect(r, &p, albedo);
        vf darkest = vf_of(1e30f), brightest = vf_of(0);
        for (int k = 0; k < AROUND; k++) {
            vf lit = sum_of(p.light[k]) / vf_max(sum_of(albedo[k]), vf_of(least));
            darkest = vf_min(darkest, lit), brightest = vf_max(brightest, lit);
            light = vf3_add(light, vf3_scale(p.light[k], p.weight[k]));
            mean = vf3_add(mean, vf3_scale(albedo[k], p.weight[k]));
        }
        vf low = vf_of(least);
        vf3 linear = {light.x * albedo[BETWEEN].x / vf_max(mean.x, low), light.y * albedo[BETWEEN].y / vf_max(mean.y, low),
                      light.z * albedo[BETWEEN].z / vf_max(mean.z, low)};
        vi_store(r->colour + i, pixel_encode(linear, 1));
        vi_store(r->painted + i, p.same & (brightest - darkest <= alike * brightest));
    }
}
