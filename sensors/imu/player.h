/* player: a raw tape of an inertial sensor (imu_tape.h), taken the whole way that a device's readings go, at the times
 * at which they came: clock, calibration, fusion. Past its end it starts again, as if the device had been plugged in
 * anew. The answer depends on the tape and on the times that were asked for alone. */
#ifndef FV_SENSORS_IMU_PLAYER_H
#define FV_SENSORS_IMU_PLAYER_H

#include "sensors/imu/feed.h"
#include "sensors/imu/head.h"
#include "sensors/imu/imu_tape.h"

struct fv_imu_player {
    struct fv_imu_tape tape;
    struct fv_imu_feed feed;
    struct fv_imu_port port;
    struct fv_clock clock;
    int64_t now_ns; /* of the feed: session time */
    int64_t next, again; /* the next row; the first one when it starts again */
    int64_t round, length_ns;
    int stream; /* of the connection */
};

/* Reads the tape; memory from the arena ("sensors"). 0, 1 where the file is no raw tape, or -1 with the error set. */
int fv_imu_player_open(struct fv_imu_player *player, const char *path, struct fv_error *error);

/* Of a tape that was read, and lasts. */
void fv_imu_player_begin(struct fv_imu_player *player, const struct fv_imu_tape *tape);

/* The head ahead_ns after the session time t_ns, as fv_imu_head, from what had come until then. */
bool fv_imu_player_head(struct fv_imu_player *player, const struct fv_neck *neck, bool predict, int64_t t_ns,
                        int64_t ahead_ns, struct fv_pose *head);

#endif
