/* devices: the inertial sensors that are known, one row each, and the stream of samples that their reports become.
 * A new one is a row of the table in devices.c, and a decoder (decode.h) where its reports are not laid out alike. */
#ifndef FV_SENSORS_IMU_DEVICES_H
#define FV_SENSORS_IMU_DEVICES_H

#include "sensors/imu/clock_map.h"
#include "sensors/imu/decode.h"

/* What a device must be told before it sends: a report of its own to the device. */
struct fv_imu_command {
    enum fv_imu_command_kind { FV_IMU_OUTPUT, FV_IMU_FEATURE } kind; /* of HID 1.11, section 7.2.2 */
    int interface, bytes; /* of the report, id first; 0: it need not be told anything */
    uint8_t report[16];   /* the rest is 0 */
    double every_s;       /* told again; INFINITY: once */
};

struct fv_imu_device {
    const char *name;
    uint16_t vendor, product;
    int interface; /* of the USB device, whose interrupt endpoint gives the reports */
    fv_imu_decode *decode;
    struct fv_imu_layout layout;
    double tick_ns;   /* of the counter; INFINITY: it is a sequence number, or there is none */
    int counter_bits; /* after which it wraps; 0: there is none */
    double hz;        /* readings a second */
    double acc_full, rate_full; /* full scales, m/s^2 and rad/s, for fusion.h; INFINITY: not known */
    /* The head's x (right), y (up), z (back) are the device's axes 1, 2, 3, or minus them. */
    int8_t axes[3];
    struct fv_imu_command command;
    bool factory; /* it holds a calibration (factory.h) */
};

enum fv_imu_device_kind {
    FV_IMU_VIVE,    /* HTC Vive */
    FV_IMU_INDEX,   /* Valve Index, HTC Vive Pro */
    FV_IMU_RIFT,    /* Oculus Rift DK2 */
    FV_IMU_PSVR,    /* Sony PlayStation VR */
    FV_IMU_WINDOWS, /* Windows Mixed Reality headsets */
    FV_IMU_GENERIC, /* whatever the settings say; here as the Vive's without its ids */
    FV_IMU_DEVICES
};
extern const struct fv_imu_device fv_imu_devices[FV_IMU_DEVICES];

/* The row of a USB device, or NULL; by name likewise. `generic` has no vendor and is found by name only. */
const struct fv_imu_device *fv_imu_device_find(uint16_t vendor, uint16_t product);
const struct fv_imu_device *fv_imu_device_named(const char *name);

/* What the factory measured of one unit, in the device's axes: true value = scale * reading - bias, as the headsets of
 * Valve and HTC keep it (acc_scale, acc_bias, gyro_scale, gyro_bias). */
struct fv_imu_calibration {
    double acc_scale[3], acc_bias[3];   /* bias m/s^2 */
    double rate_scale[3], rate_bias[3]; /* rad/s */
};
extern const struct fv_imu_calibration fv_imu_uncalibrated;

/* 0, or -1 and why: each scale must be 0.5 to 2, biases at most 5 m/s^2 and 1 rad/s; a NaN is neither. */
int fv_imu_calibration_check(const struct fv_imu_calibration *calibration, struct fv_error *error);

/* A sample for fv_fusion_add, in the head's axes. */
struct fv_imu_sample {
    int64_t t_ns; /* host's clock; grows from sample to sample */
    double dt_s;  /* since the one before, by the device's clock; > 0; the first: 1 / hz */
    double rate[3], acc[3];
};

struct fv_imu_counts {
    int64_t reports, other; /* others' reports came too: they are none of the reports */
    int64_t samples;        /* given out */
    int64_t repeated;       /* readings that had come before, came too late, or lie far from the newest of their report */
    int64_t lost;           /* that by the device's clock must have been there and never came */
    int64_t restarts;       /* of the device's clock */
};

/* The caller's: begun by fv_imu_stream_begin, and anew when the device has been away. */
struct fv_imu_stream {
    struct fv_imu_device device;
    struct fv_imu_calibration calibration;
    struct fv_imu_counts counts;
    struct fv_clock_map map;
    int64_t newest; /* ticks of the newest sample given out */
    bool begun;
    const struct fv_imu_device *source; /* that it was begun with */
    /* The newest report's readings, for recording: as decoded, but for those that had come before beside new ones. Taken
     * in their place they give the same samples. */
    struct fv_imu_reading raw[FV_IMU_READINGS];
    int raws;
};

/* calibration NULL: none. 0, or -1 with the error set, when device or calibration cannot be: the stream is not begun. */
int fv_imu_stream_begin(struct fv_imu_stream *stream, const struct fv_imu_device *device,
                        const struct fv_imu_calibration *calibration, struct fv_error *error);

/* A report that came at arrival_ns, host's clock. Writes the samples that are new, oldest first, and returns their
 * number, 0 for a report that is none of the device's. */
int fv_imu_stream_report(struct fv_imu_stream *stream, const uint8_t *report, size_t bytes, int64_t arrival_ns,
                         struct fv_imu_sample samples[FV_IMU_READINGS]);

#endif
