/* path: way points walked smoothly there and back, at a session time: the viewer's (scene.path), where it
 * stands and which way is ahead, and those of what moves (moving.h). */
#ifndef FV_SCENE_PATH_H
#define FV_SCENE_PATH_H

#include "config/config.h"
#include "platform/pose.h"

/* `rows` way points of `columns` numbers, at least one. `seconds` for one way, 0: stands at the first.
 * Catmull-Rom through the points, which are passed at equal times; eased at both ends. */
void fv_path_at(const double *way, int rows, int columns, double seconds, int64_t t_ns, double *out);

/* Rows of `path`: x y z (m), yaw, pitch (degrees). `seconds` as above. */
void fv_path_pose(const struct fv_list *path, double seconds, int64_t t_ns, struct fv_pose *pose);

#endif
