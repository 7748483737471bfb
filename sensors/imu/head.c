/* head: see head.h. */
#include "sensors/imu/head.h"

/* At least 0; any times. */
static int64_t since(int64_t t_ns, int64_t now_ns)
{
    uint64_t passed = now_ns > t_ns ? (uint64_t)now_ns - (uint64_t)t_ns : 0;
    return passed < INT64_MAX ? (int64_t)passed : INT64_MAX;
}

bool fv_imu_head(const struct fv_imu_state *state, const struct fv_neck *neck, bool predict, int64_t now_ns,
                 int64_t ahead_ns, struct fv_pose *head)
{
    const double eyes[3] = {0, neck->up_m, -neck->ahead_m};
    *head = (struct fv_pose){0};
    if (state->good == 0 || since(state->arrival_ns, now_ns) > FV_HEAD_STALE_NS) return false;
    double ahead_s = predict ? 1e-9 * ((double)since(state->t_ns, now_ns) + (double)ahead_ns) : 0;
    fv_fusion_turn(state->rotation, state->rate, ahead_s, head->rotation);
    fv_quat_rotate(head->rotation, eyes, head->position_m);
    for (int i = 0; i < 3; i++) head->position_m[i] -= eyes[i];
    return true;
}
