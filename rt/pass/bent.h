/* bent: what passes hand to kernels that know a pinhole's picture, where rays go through a lens that bends: for each
 * tile the pinhole's maps and view that touch it there (fovea/view.h). Elsewhere the frame's own. */
#ifndef FV_PASS_BENT_H
#define FV_PASS_BENT_H

#include "rt/pass/pass.h"

/* Of one eye's pixels around (x, y) of what has inverse depth w there; `object`: what it is fixed to, 0: to none. */
static inline struct fv_map fv_bent_map(const struct fv_frame *f, int eye, int object, float x, float y, float w)
{
    struct fv_map map = object ? f->object_map[eye][object] : f->map[eye];
    if (f->view[eye].bend.on) fv_map_bend(&map, &f->view[eye].bend, &f->before[eye].bend, x, y, w);
    return map;
}

/* The same of a tile and all objects: of `maps` to pictures through the lens `before`, in one of FV_PAST_MAX places of
 * the worker's. */
const struct fv_map *fv_bent_maps(const struct fv_frame *frame, const struct fv_tile *tile, const struct fv_map *maps,
                                  const struct fv_bend *before, int place);

/* The view around a tile: its eye's, or the worker's. */
const struct fv_view *fv_bent_view(const struct fv_frame *frame, const struct fv_tile *tile);

/* A pixel's size at depth 1 where it is largest. */
static inline float fv_largest_pixel(const struct fv_view *view)
{
    return view->bend.on ? view->pixel_size * view->bend.widest : view->pixel_size;
}

#endif
