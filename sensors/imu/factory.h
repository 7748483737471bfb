/* factory: what the factory measured of a headset's sensor, as headsets with lighthouse sensors hold it: settings in JSON,
 * compressed by zlib, which are read in pieces by feature reports: FV_FACTORY_BEGIN once, then FV_FACTORY_PIECE until one
 * is empty (libsurvive, OpenHMD). A request that stalls is made again. Allocates: before the seal only. */
#ifndef FV_SENSORS_IMU_FACTORY_H
#define FV_SENSORS_IMU_FACTORY_H

#include "sensors/imu/devices.h"

enum { FV_FACTORY_BEGIN = 0x10, FV_FACTORY_PIECE = 0x11, FV_FACTORY_PIECE_MAX = 64, FV_FACTORY_PACKED_MAX = 32 << 10 };

struct fv_factory_pieces {
    size_t bytes;
    uint8_t packed[FV_FACTORY_PACKED_MAX];
};

/* A piece: id, length, bytes. 1: more are to come; 0: it was the last one; -1 with the error set. */
int fv_factory_piece(struct fv_factory_pieces *pieces, const uint8_t *report, size_t bytes, struct fv_error *error);

/* The calibration in them: acc_bias, acc_scale, gyro_bias, gyro_scale, of the object "imu" where there is one (Index), or
 * of the whole (Vive); scales that are not there are 1. 0, or -1 with the error set: it can begin a stream, or is not
 * written. */
int fv_factory_read(const uint8_t *packed, size_t bytes, struct fv_imu_calibration *calibration, struct fv_error *error);

#endif
