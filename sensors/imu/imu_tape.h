/* imu_tape: raw samples of an inertial sensor as a file: each reading as it was decoded, before calibration and in the
 * device's own axes, with the device's clock and the host's time of its report's arrival.
 *
 *   # foveola imu 1
 *   arrival_ns,reading,counter,rate_x_rad_s,rate_y_rad_s,rate_z_rad_s,acc_x_m_s2,acc_y_m_s2,acc_z_m_s2
 *   # stream tick_ns=20.8 counter_bits=32 hz=1000 acc_full=78.4 rate_full=34.9 axes=1,-2,-3 acc_scale=1,1,1
 *     acc_bias_m_s2=0,0,0 rate_scale=1,1,1 rate_bias_rad_s=0,0,0 device=HTC Vive          (one line)
 *   81234567890,0,4711,-0.0021,0.0011,0,0.12,-9.79,0.31
 *   # session 0 = 81234565555 ns
 *
 * "# stream" stands before the rows of each connection; its names are those of struct fv_imu_device and struct
 * fv_imu_calibration (devices.h), which say what becomes of the readings. Rows: arrival_ns is CLOCK_MONOTONIC and never
 * falls, reading is the number within the report (0 begins one), counter the device's clock in ticks or its sequence
 * number. Readings that a device sends again beside new ones are left out. "# session", anywhere, is the arrival time that
 * is session time 0; without it the first row's is. Numbers read back to the same bits; readings may be no numbers, as
 * they came. */
#ifndef FV_SENSORS_IMU_TAPE_H
#define FV_SENSORS_IMU_TAPE_H

#include "platform/error.h"
#include "platform/files.h"
#include "sensors/imu/devices.h"

enum { FV_IMU_TAPE_DEVICES = 8, FV_IMU_TAPE_STREAMS = 16 /* that differ */ };

struct fv_imu_tape_row {
    int64_t arrival_ns;
    struct fv_imu_reading reading;
    uint8_t number; /* within its report */
    uint8_t stream; /* of the list */
    bool begins;    /* the first row of a connection */
};

struct fv_imu_tape {
    int64_t rows, rejected;
    int64_t first_ns, last_ns; /* arrival of the first and last row */
    int64_t session_ns;        /* arrival time that is session time 0 */
    struct fv_imu_device device[FV_IMU_TAPE_DEVICES];
    int devices;
    struct {
        int device;
        struct fv_imu_calibration calibration;
    } stream[FV_IMU_TAPE_STREAMS];
    int streams;
    const struct fv_imu_tape_row *row;
};

/* True where the text begins as such a file does. */
bool fv_imu_tape_is(const char *text, size_t size);

/* Reads the text, `size` bytes followed by a zero byte; `name` is for messages. row NULL: only counts. A row that is short,
 * long, not numbers, earlier than the one before or not the next of its report is rejected and counted. -1 with "name:line:
 * ..." where the format or a stream is not known, no row is good, or more rows are bad than good. */
int fv_imu_tape_parse(struct fv_imu_tape *tape, const char *name, const char *text, size_t size,
                      struct fv_imu_tape_row *row, struct fv_error *error);

/* Reads a file into the arena ("sensors"); 1: it is no such tape. Before the seal only. */
int fv_imu_tape_read(struct fv_imu_tape *tape, const char *path, struct fv_error *error);

/* The devices of a tape decode a report that is its readings, as they stand in memory. */
extern fv_imu_decode fv_imu_decode_taped;

/* Recording. */
void fv_imu_tape_begin(struct fv_writer *writer);
void fv_imu_tape_write_stream(struct fv_writer *writer, const struct fv_imu_device *device,
                              const struct fv_imu_calibration *calibration);
void fv_imu_tape_write_reading(struct fv_writer *writer, int64_t arrival_ns, int number,
                               const struct fv_imu_reading *reading);
void fv_imu_tape_write_session(struct fv_writer *writer, int64_t session_ns);

#endif
