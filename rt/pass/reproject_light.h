/* reproject_light: sampled light that is kept apart (method.light): albedo and light of the places where the kernel
 * finds a pixel's colour, and luminance as it is shown, of all planes together. For kernels only. Where there is
 * one plane nothing of it runs but luminance, which is that plane's. */
#ifndef FV_PASS_REPROJECT_LIGHT_H
#define FV_PASS_REPROJECT_LIGHT_H

#include "rt/pass/reproject_history.h"
#include "rt/pass/reproject_nodes.h"

/* Of a vector of pixels. */
struct apart {
    vf3 albedo, light;
    vi count[FV_PLANES]; /* the bits above them, of the pixels that the places lie in */
};

static inline bool apart_in(const struct fv_reproject_tile *t)
{
    return __builtin_expect(t->planes == FV_PLANES, 0);
}

/* Bilinear light, each pixel's in proportion to its albedo: what the two make together is then interpolated as
 * well, and a mirror's light, of which nothing shows, does not reach what is beside it. Across outlines of what
 * moves nothing goes. Light is smooth: it needs no cubics, and no footprint either. */
static inline vf3 history_light(const struct fv_reproject_tile *t, const struct source *s, int64_t plane,
                                const struct place *p)
{
    vf x = vf_clamp(p->x - 0.5f, 0, s->width - 1.0f), y = vf_clamp(p->y - 0.5f, 0, s->height - 1.0f);
    vf x0 = vf_floor(x), y0 = vf_floor(y), fx = x - x0, fy = y - y0, sum = vf_of(1e-6f);
    vi row = vi_from(y0), upper = row * s->stride + vi_from(x0), lower = upper + ((row < s->last_row) & s->stride);
    vf w11 = fx * fy, w10 = fx - w11, w01 = fy - w11;
    vf weight[4] = {1.0f - fx - w01, w10, w01, w11};
    vi albedo[4], light[4], differ[4];
    vf3 out = {vf_of(0), vf_of(0), vf_of(0)};
    for (int k = 0; k < 4; k += 2) {
        vi at = k ? lower : upper;
        vi_gather_pairs(s->colour + FV_PLANE_ALBEDO * plane, at, &albedo[k], &albedo[k + 1]);
        vi_gather_pairs(s->colour + FV_PLANE_LIGHT * plane, at, &light[k], &light[k + 1]);
        if (t->moves) vi_gather_pairs(s->cache, at, &differ[k], &differ[k + 1]);
    }
    for (int k = 0; k < 4; k++) {
        vf green = vf_from((albedo[k] >> 10) & 1023), w = weight[k] * (green * green + 1.0f);
        if (t->moves) w = vf_select(((differ[k] ^ p->cache) & FV_CACHE_MOVING) == 0, w, vf_of(0));
        out = vf3_add(out, vf3_scale(pixel_unpack(light[k]), w));
        sum += w;
    }
    return vf3_scale(out, 1.0f / sum);
}

/* What stands at the places; `plane`: elements between the source's images. A copy of the places: those that the
 * caller works with stay in registers. */
static __attribute__((noinline)) void take_apart(const struct fv_reproject_tile *t, const struct source *s, int64_t plane,
                                                 struct place p, struct apart *out)
{
    struct source albedo = *s;
    albedo.colour += FV_PLANE_ALBEDO * plane;
    out->albedo = history_colour(t, &albedo, &p);
    out->light = history_light(t, s, plane, &p);
    for (int k = FV_PLANE_ALBEDO; k < FV_PLANES; k++)
        out->count[k] = vi_gather(s->colour + k * plane, p.index) & (int32_t)~FV_PIXEL_COLOUR;
}

/* The same, over what is there where these places are good. */
static __attribute__((noinline)) void take_apart_over(const struct fv_reproject_tile *t, const struct source *s,
                                                      int64_t plane, struct place p, struct apart *out)
{
    struct apart here;
    take_apart(t, s, plane, p, &here);
    out->albedo = vf3_select(p.good, here.albedo, out->albedo);
    out->light = vf3_select(p.good, here.light, out->light);
    for (int k = FV_PLANE_ALBEDO; k < FV_PLANES; k++) out->count[k] = vi_select(p.good, here.count[k], out->count[k]);
}

static inline vf luminance(vi pixel)
{
    vf3 c = pixel_unpack(pixel);
    return (c.x * 0.299f + c.y * 0.587f + c.z * 0.114f) * (1 / 1023.0f);
}

static __attribute__((noinline)) void add_apart(const uint32_t *colour, int64_t plane, vi at, vi *pixel)
{
    *pixel = pixel_lit(*pixel, vi_gather(colour + FV_PLANE_ALBEDO * plane, at), vi_gather(colour + FV_PLANE_LIGHT * plane, at));
}

/* Pixels of an image of colours, with all light. */
static inline vi shown(const struct fv_reproject_tile *t, const uint32_t *colour, int64_t plane, vi at)
{
    vi pixel = vi_gather(colour, at);
    if (apart_in(t)) add_apart(colour, plane, at, &pixel);
    return pixel;
}

/* The nodes' luminance as it is shown. */
static __attribute__((noinline)) void light_nodes(const struct fv_reproject_tile *t, struct nodes *nodes)
{
    int x0 = first_node(t->x0, t->spacing), y0 = first_node(t->y0, t->spacing);
    for (int y = 0; y < nodes->along; y++)
        for (int x = 0; x < nodes->along; x += FV_WIDTH) {
            vi column = vi_lanes() + (x0 + x);
            column = vi_select(column > 0, column, vi_of(0));
            column = vi_select(column < t->nodes_x, column, vi_of(t->nodes_x - 1));
            vi at = column + (int32_t)(fv_clamp(y0 + y, t->nodes_y) * t->support_stride);
            vf_store(nodes->luminance[y] + x, luminance(shown(t, t->support_colour, t->support_plane, at)));
        }
}

#endif
