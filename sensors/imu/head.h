/* head: the pose of the point between the eyes from what the sensor's feed knows: its rotation moved on to a time, and
 * the position that a neck of given lengths leads to. Pure. */
#ifndef FV_SENSORS_IMU_HEAD_H
#define FV_SENSORS_IMU_HEAD_H

#include "platform/pose.h"
#include "sensors/imu/feed.h"

/* From the point about which head and neck turn to the point between the eyes of one who looks straight ahead. The
 * settings' defaults, 75 mm up and 80.5 mm ahead, are the Oculus SDK's for a viewer that it knows nothing of. */
struct fv_neck {
    double up_m, ahead_m;
};

/* A newest sample that came longer ago says nothing of the head. */
#define FV_HEAD_STALE_NS INT64_C(100000000)

/* The head ahead_ns after now_ns, relative to where it was at the identity. Predicted at a constant rate from the time
 * of the newest sample (fv_fusion_turn; not where predict is false). False and the pose not sound where there is no
 * sample, or only a stale one: the caller holds what it has. */
bool fv_imu_head(const struct fv_imu_state *state, const struct fv_neck *neck, bool predict, int64_t now_ns,
                 int64_t ahead_ns, struct fv_pose *head);

#endif
