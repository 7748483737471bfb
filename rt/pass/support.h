/* support: what the last frame tells of a packet of support nodes, so that they need no rays. */
#ifndef FV_PASS_SUPPORT_H
#define FV_PASS_SUPPORT_H

#include "rt/pass/pass.h"

enum {
    FV_PACKET = 4,                                   /* nodes along the side of a packet */
    FV_AROUND = 2,                                   /* nodes beyond, that its answers have to do with */
    FV_WINDOW = FV_PACKET + 2 * FV_AROUND
};

/* A packet of FV_PACKET x FV_PACKET nodes, row by row. */
struct fv_support_packet {
    const struct fv_map *map;        /* from the picture's pixels to those before */
    const struct fv_raster *history[2]; /* where there is none in the first, the second knows */
    float x, y, spacing;             /* the first node's place, and between nodes, in the picture's pixels */
    float epsilon;                   /* relative depth difference that still is the same surface */
    bool still;                      /* nothing moves */
    /* The last frame's nodes at and around the places where those of the packet were, about: inverse depths and
     * surfaces (enum fv_surface); the kernel makes depths that are not known 0. */
    _Alignas(64) float old_depth[FV_WINDOW * FV_WINDOW];
    _Alignas(64) int32_t old_surface[FV_WINDOW * FV_WINDOW];
    /* Out: a bit for each node that history answers, by the second of them; of these inverse depth, pixel of that
     * raster and surface. */
    uint32_t answered, by_second;
    _Alignas(64) float inverse_depth[FV_PACKET * FV_PACKET];
    _Alignas(64) int32_t pixel[FV_PACKET * FV_PACKET], surface[FV_PACKET * FV_PACKET];
};

#endif
