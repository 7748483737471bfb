/* path: where the viewer stands and which way is ahead, at a session time: the scene's way points
 * (scene.path) walked smoothly there and back. */
#ifndef FV_FRAME_PATH_H
#define FV_FRAME_PATH_H

#include "config/config.h"
#include "platform/pose.h"

/* Rows of `path`: x y z (m), yaw, pitch (degrees). `seconds` for one way, 0: stands at the first.
 * Catmull-Rom through the points, which are passed at equal times; eased at both ends. */
void fv_path_pose(const struct fv_list *path, double seconds, int64_t t_ns, struct fv_pose *pose);

#endif
