/* field_surface: what a packet's hits on fields look like: slope and checks. For kernels only; surface.h puts it
 * together. */
#ifndef FV_TRACE_FIELD_SURFACE_H
#define FV_TRACE_FIELD_SURFACE_H

#include "rt/trace/packet.h"

/* The gradient of each lane's part, by differences of four points around it (a tetrahedron's corners, `reach` away
 * along each axis); only of the part that was hit. Not unit; 0 where a field is flat. */
static inline vf3 field_slope(const struct fv_fields *f, vi part, vf3 at, vf reach, vi mask)
{
    vf3 slope = {vf_of(0), vf_of(0), vf_of(0)};
    for (unsigned pending = vi_bits(mask); pending;) {
        int id = part[__builtin_ctz(pending)];
        vi lanes = mask & (part == id);
        pending &= ~vi_bits(lanes);
        const struct fv_field_code *code = f->code + f->part[id].first;
        int count = f->part[id].count;
        vf a = field_part(code, count, (vf3){at.x + reach, at.y - reach, at.z - reach});
        vf b = field_part(code, count, (vf3){at.x - reach, at.y - reach, at.z + reach});
        vf c = field_part(code, count, (vf3){at.x - reach, at.y + reach, at.z - reach});
        vf d = field_part(code, count, (vf3){at.x + reach, at.y + reach, at.z + reach});
        slope = vf3_select(lanes, (vf3){a - b - c + d, c + d - a - b, b + d - a - c}, slope);
    }
    return slope;
}

/* Unit normals on the viewer's side; where a surface is seen beyond its rim, as at the rim. */
static inline vf3 field_normal(const struct fv_fields *f, const struct packet_hit *h, vf3 point, vf3 direction,
                               vf footprint)
{
    vf3 d = vf3_normalise(direction, (vf3){vf_of(0), vf_of(-1), vf_of(0)}), back = vf3_scale(d, vf_of(-1));
    vf reach = vf_max(vf_max(vf_abs(point.x), vf_abs(point.y)), vf_abs(point.z));
    reach = vf_max(vf_max(0.25f * footprint, vf_of(FV_FIELD_HIT)), reach * 2e-5f);
    vi mask = h->hit & (h->part >= 0);
    vf3 n = vf3_normalise(field_slope(f, h->part, point, reach, mask), back);
    vf beyond = vf_max(vf_dot(n, d) + 1e-3f, vf_of(0));
    return vf3_normalise(vf3_sub(n, vf3_scale(d, beyond)), back);
}

/* Mean of a square wave of half period 1, +1 first, over [x - w / 2, x + w / 2]: a difference of its integral. */
static inline vf field_wave(vf x, vf w)
{
    vf a = (x - 0.5f * w) * 0.5f, b = (x + 0.5f * w) * 0.5f;
    vf below = vf_abs(a - vf_floor(a) - 0.5f), above = vf_abs(b - vf_floor(b) - 0.5f);
    return (below - above) * 2.0f / w;
}

/* How far the footprint's ellipse on a slope of normal n reaches along one axis: its width across, and as much more
 * along the way of the ray as that is slanted. `along`: the ray's unit direction in the plane, times the stretch. */
static inline vf field_extent(vf along, vf n, vf footprint)
{
    return footprint * vf_root(vf_max(1.0f - n * n, vf_of(0)) + along * along);
}

/* Puts the other colour into squares of x and z, of which a footprint shows the mean (of an ellipse's box). */
static inline void field_checks(const struct fv_field_part *p, vi lanes, vf3 point, vf3 direction, vf3 n, vf footprint,
                                vf3 *diffuse)
{
    vf3 d = vf3_normalise(direction, n);
    vf facing = vf_dot(d, n), cosine = vf_max(vf_abs(facing), vf_of(0.02f));
    vf3 along = vf3_scale(vf3_sub(d, vf3_scale(n, facing)), 1.0f / cosine);
    float per_metre = 1 / p->checker_size;
    vf wide = vf_max(field_extent(along.x, n.x, footprint) * per_metre, vf_of(1e-3f));
    vf deep = vf_max(field_extent(along.z, n.z, footprint) * per_metre, vf_of(1e-3f));
    vf share = 0.5f - 0.5f * field_wave(point.x * per_metre, wide) * field_wave(point.z * per_metre, deep);
    vf3 other = vf3_of(p->checker);
    vf3 mixed = vf3_add(*diffuse, vf3_scale(vf3_sub(other, *diffuse), share));
    *diffuse = vf3_select(lanes, mixed, *diffuse);
}

/* All parts' checks. */
static inline void field_paint(const struct fv_fields *f, const struct packet_hit *h, vf3 point, vf3 direction, vf3 n,
                               vf footprint, vf3 *diffuse)
{
    for (unsigned pending = vi_bits(h->hit & (h->part >= 0)); pending;) {
        int id = h->part[__builtin_ctz(pending)];
        vi lanes = h->hit & (h->part == id);
        pending &= ~vi_bits(lanes);
        const struct fv_field_part *p = &f->part[id];
        if (p->checker_size > 0) field_checks(p, lanes, point, direction, n, footprint, diffuse);
    }
}

/* The materials of hits on fields in place of those of triangles. */
static inline vi field_materials(const struct fv_fields *f, const struct packet_hit *h, vi material)
{
    for (unsigned pending = vi_bits(h->hit & (h->part >= 0)); pending;) {
        int id = h->part[__builtin_ctz(pending)];
        vi lanes = h->hit & (h->part == id);
        pending &= ~vi_bits(lanes);
        material = vi_select(lanes, vi_of(f->part[id].material), material);
    }
    return material;
}

#endif
