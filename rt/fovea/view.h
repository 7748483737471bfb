/* view: one eye in one frame: where its rays start and go, where the gaze is, and the map from
 * its pixels to those of the frame before.
 *
 * Pixel (column, row) covers the square [column, column + 1) x [row, row + 1); its centre lies
 * at + 0.5. The direction through (x, y) is corner + x * dx + y * dy; its component along the
 * optical axis is 1, so that the ray parameter t of a hit is its depth along the axis. Where the lens bends
 * (lens.h), that is so of straight coordinates; fv_view_direction asks. */
#ifndef FV_FOVEA_VIEW_H
#define FV_FOVEA_VIEW_H

#include "platform/pose.h"
#include "rt/fovea/lens.h"

#include <stdbool.h>

/* Half-angles' tangents from the optical axis to the picture's edges. */
struct fv_lens {
    double tan_left, tan_right, tan_up, tan_down; /* all positive */
    int width, height;                            /* pixels */
};

struct fv_view {
    int width, height;
    float origin[3];                 /* world, m */
    float corner[3], dx[3], dy[3];   /* world */
    float pixel_size;                /* a pixel's size at depth 1: mean of width and height; of bent ones, at the axis */
    float pixel_deg;                 /* its longer side at the picture's centre, degrees: it is nowhere wider */
    float gaze[3];                   /* unit, world */
    float gaze_px[2];                /* where the gaze meets the picture; 1e6 to its side where it does not */
    struct fv_pose pose;             /* of the eye */
    struct fv_lens lens;
    struct fv_bend bend;             /* of a radial lens; the lens's tangents are then those of straight coordinates */
};

/* The picture of the same world point in the view before: with w = 1 / depth,
 * (X, Y, Z) = m (x, y, 1) + w t; pixel (X / Z, Y / Z), inverse depth w / Z; behind the eye
 * where Z <= 0. From the exact poses in double, so that large coordinates do not cancel. */
struct fv_map {
    float m[3][3], t[3];
};

/* `pose`: of the eye, sound (fv_pose_sound): the loop lets no other in. `gaze`: unit vector in
 * the eye's frame (x right, y up, -z ahead); one that is not finite or points backwards counts as straight
 * ahead. */
void fv_view_set(struct fv_view *view, const struct fv_lens *lens, const struct fv_pose *pose,
                 const double gaze[3]);

/* The same through a radial lens. */
void fv_view_set_bent(struct fv_view *view, const struct fv_lens *lens, const struct fv_bend *bend, const struct fv_pose *pose,
                      const double gaze[3]);

void fv_map_set(struct fv_map *map, const struct fv_view *now, const struct fv_view *before);

/* The same for points that are fixed to a rigid object, from its poses (its space to the world) in both frames. */
void fv_map_set_moving(struct fv_map *map, const struct fv_view *now, const struct fv_view *before,
                       const struct fv_pose *object_now, const struct fv_pose *object_before);

/* The direction through a pixel. */
static inline void fv_view_direction(const struct fv_view *view, float x, float y, float to[3])
{
    float at[2] = {x, y};
    if (view->bend.on) fv_bend_straight(&view->bend, x, y, at);
    for (int i = 0; i < 3; i++) to[i] = view->corner[i] + at[0] * view->dx[i] + at[1] * view->dy[i];
}

/* The pinhole's view that touches a bent one at (x, y): of what lies around, for sums over neighbours. */
void fv_view_at(const struct fv_view *view, float x, float y, struct fv_view *near);

/* Makes the map of straight coordinates one of the display's pixels around (x, y) at inverse depth w, by the lens's
 * tangents there and where that point was: exact where nothing moved; else off by what the lens bends across the
 * motion and the distance from (x, y) together. Nothing where that point was behind the eye. */
void fv_map_bend(struct fv_map *map, const struct fv_bend *now, const struct fv_bend *before, float x, float y, float w);

/* (X, Y, Z) of the picture's point (x, y) at inverse depth w. */
static inline void fv_map_point(const struct fv_map *map, float x, float y, float w, float to[3])
{
    for (int i = 0; i < 3; i++) to[i] = map->m[i][0] * x + map->m[i][1] * y + map->m[i][2] + map->t[i] * w;
}

/* By how many pixels at most, within `reach` pixels of (x, y), what is 1/m nearer moved otherwise; 0 where the head only
 * turned, infinite where it was behind the eye. */
float fv_map_apart(const struct fv_map *map, float x, float y, float reach);

/* Whether no point half a metre away or farther moves by more than 1/64 of a pixel. */
bool fv_map_still(const struct fv_map *map, const struct fv_view *now);

/* Pixel of a finite, unit direction given in the eye's frame; false where it points backwards or to less
 * than 1e-6 of 90 degrees. */
bool fv_lens_project(const struct fv_lens *lens, const double direction[3], double pixel[2]);

#endif
