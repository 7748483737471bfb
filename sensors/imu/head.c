/* head: see head.h. */
#include "sensors/imu/head.h"

bool fv_imu_head(const struct fv_imu_state *state, const struct fv_neck *neck, bool predict, int64_t now_ns,
                 int64_t ahead_ns, struct fv_pose *head)
{
    const double eyes[3] = {0, neck->up_m, -neck->ahead_m};
    uint64_t age_ns = now_ns > state->t_ns ? (uint64_t)now_ns - (uint64_t)state->t_ns : 0;
    *head = (struct fv_pose){0};
    if (state->good == 0 || age_ns > (uint64_t)FV_HEAD_STALE_NS) return false;
    double ahead_s = predict ? 1e-9 * ((double)age_ns + (double)ahead_ns) : 0;
    fv_fusion_turn(state->rotation, state->rate, ahead_s, head->rotation);
    fv_quat_rotate(head->rotation, eyes, head->position_m);
    for (int i = 0; i < 3; i++) head->position_m[i] -= eyes[i];
    return true;
}
