/* decode: reports of inertial sensors, from bytes to readings. No input or output: a decoder sees the bytes of one
 * report and nothing else, and reads none past their end. devices.h says which device sends what. */
#ifndef FV_SENSORS_IMU_DECODE_H
#define FV_SENSORS_IMU_DECODE_H

#include "platform/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { FV_IMU_READINGS = 8 /* of one report at most */ };

/* A reading in the device's axes. counter: of its clock, or its sequence number where there is no clock; 0 where
 * there is neither. */
struct fv_imu_reading {
    uint64_t counter;
    double rate[3]; /* rad/s */
    double acc[3];  /* m/s^2, at rest g upwards */
};

enum fv_imu_number { FV_IMU_I16, FV_IMU_I32, FV_IMU_F32, FV_IMU_NUMBERS };

/* A report of one reading or more, all laid out alike, `stride` bytes apart. */
struct fv_imu_layout {
    int id;                   /* the first byte; -1: any */
    int bytes;                /* of the report, at most where it has its own decoder */
    int readings;             /* 1 to FV_IMU_READINGS */
    int first, stride;        /* where the first one is; from one to the next */
    int acc, rate;            /* within a reading: three numbers each */
    int counter, counter_bytes; /* the clock's or sequence's place and 0 to 8 bytes; 0: there is none */
    enum fv_imu_number number;
    bool big_endian;
    double acc_unit, rate_unit; /* of number 1, m/s^2 and rad/s; not 0 */
};

/* 0 when every reading lies within the bytes and the units are numbers, or -1 and why not. */
int fv_imu_layout_check(const struct fv_imu_layout *layout, struct fv_error *error);

/* Writes the readings in the report's order; returns their number, or -1 where this is no such report (another
 * id or size). `layout` must be one that is checked; those with their own decoder look only at its units. A number
 * that is none (NaN, in reports of floats) is passed on. */
typedef int fv_imu_decode(const struct fv_imu_layout *layout, const uint8_t *report, size_t bytes,
                          struct fv_imu_reading readings[FV_IMU_READINGS]);

fv_imu_decode fv_imu_decode_layout;  /* as laid out */
fv_imu_decode fv_imu_decode_rift;    /* Rift DK2: id 11, 64 bytes, two readings of 21-bit numbers a millisecond apart */
fv_imu_decode fv_imu_decode_windows; /* Windows MR: id 1, 497 or 381 bytes, 4 accelerations and 32 rates */

#endif
