/* moving: what of a scene moves, as scene.moving says: bodies and lights that are added and parts of the file by name,
 * and where each is at a session time. Rigid: nothing is bent or scaled. */
#ifndef FV_SCENE_MOVING_H
#define FV_SCENE_MOVING_H

#include "config/config.h"
#include "platform/pose.h"

enum { FV_MOVING_MAX = 31, FV_WAYS_MAX = 32, FV_NAME_MAX = 128 };

/* Ways and origins lie at most this far from 0 in each coordinate, so that every pose is sound (platform/pose.h). */
#define FV_WAY_LARGEST 1e8

enum fv_body {
    FV_BODY_SPHERE,
    FV_BODY_BOX,
    FV_BODY_LIGHT, /* a point light */
    FV_BODY_NODE /* a part of the file, with all that hangs on it */
};

/* A row of scene.moving. */
struct fv_moving {
    enum fv_body body;
    char name[FV_NAME_MAX]; /* of a node */
    double size_m[3];       /* a sphere's radius; a box's edges */
    double intensity[3];    /* a light's radiant intensity (W/sr) */
    double colour[3];       /* albedo */
    double origin_m[3];     /* a node's own origin in the scene, known once it is read; 0 of bodies */
    int ways;
    double way[FV_WAYS_MAX][4]; /* way points from the origin: x y z (m), yaw (degrees) */
    double seconds;             /* for one way; 0: stands at the first */
    double spin_deg_s[3];       /* about its own axes: the vector's length is the speed */
};

/* Reads scene.moving into `moving` (FV_MOVING_MAX). Returns the number of rows, or -1 with the error set. */
int fv_moving_read(const struct fv_config *config, struct fv_moving *moving, struct fv_error *error);

/* Whether a row's name says this one: _ stands for itself and for what a row cannot hold (blanks, commas). */
bool fv_moving_named(const struct fv_moving *moving, const char *name);

/* Where it is: from its own space, in which its origin is 0, to the world. The way is walked as scene.path is
 * (path.h); a spin goes on for ever, exact to rounding of the angle. */
void fv_moving_pose(const struct fv_moving *moving, int64_t t_ns, struct fv_pose *pose);

#endif
