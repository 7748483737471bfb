/* visibility_kernel: the rays of light maps (visibility.h), a row of nodes at a time. */
#include "rt/trace/variant.h"

#define FV_FEATURES FV_FEATURES_ALL
#include "rt/trace/packet.h"
#include "rt/trace/visibility.h"

#define map_row FV_ISA_NAME(fv_map_row)
void map_row(const struct fv_tracer *tracer, const struct fv_light_map *map, int face, int row,
             float *nearness);

/* Of a point's face: through a place on it, 1 along the face's axis. */
static inline vf3 face_direction(int face, vf across, vf along)
{
    vf major = vf_of(face % 2 ? -1 : 1);
    return face / 2 == 0   ? (vf3){major, across, along}
           : face / 2 == 1 ? (vf3){along, major, across}
                           : (vf3){across, along, major};
}

/* Texels of alpha masks are those of a ray cone as wide as a node's texel. */
static inline vf point_nearness(const struct fv_tracer *tracer, const struct fv_light_map *m, vf3 direction,
                                vi mask)
{
    struct fv_ray_context context = packet_context(true, m->begin * m->texel[0], m->texel[0]);
    vf3 origin = vf3_add(vf3_of(m->at), vf3_scale(direction, vf_of(m->begin)));
    struct packet_hit h = packet_intersect_meshes(tracer, &context, origin, direction, mask);
    return vf_select(h.hit, 1.0f / (h.t + m->begin), vf_of(0));
}

static inline vf sun_nearness(const struct fv_tracer *tracer, const struct fv_light_map *m, vf across,
                              vf along, vi mask)
{
    float wide = m->texel[0] > m->texel[1] ? m->texel[0] : m->texel[1];
    struct fv_ray_context context = packet_context(true, wide, 0);
    vf3 towards = vf3_of(m->at), origin = vf3_scale(towards, vf_of(m->begin));
    origin =
        vf3_add(origin, vf3_add(vf3_scale(vf3_of(m->across), across), vf3_scale(vf3_of(m->along), along)));
    struct packet_hit h =
        packet_intersect_meshes(tracer, &context, origin, vf3_scale(towards, vf_of(-1)), mask);
    return vf_select(h.hit, m->begin - h.t, vf_of(FV_SUN_NOTHING));
}

void map_row(const struct fv_tracer *tracer, const struct fv_light_map *m, int face, int row, float *nearness)
{
    _Alignas(64) float found[FV_WIDTH];
    vf along = vf_of(m->corner[1] + m->texel[1] * (float)row);
    for (int i = 0; i <= m->side; i += FV_WIDTH) {
        int left = m->side + 1 - i, count = left < FV_WIDTH ? left : FV_WIDTH;
        vf across = m->corner[0] + m->texel[0] * vf_from(vi_lanes() + i);
        vi mask = vi_lanes() < count;
        vf_store(found, m->faces == 1 ? sun_nearness(tracer, m, across, along, mask)
                                      : point_nearness(tracer, m, face_direction(face, across, along), mask));
        memcpy(nearness + i, found, (size_t)count * sizeof *found);
    }
}
