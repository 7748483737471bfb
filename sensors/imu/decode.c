/* decode: see decode.h. What the reports hold is told by the drivers of OpenHMD, Monado and ouvrt. */
#include "sensors/imu/decode.h"

#include <math.h>
#include <string.h>

static const int number_bytes[FV_IMU_NUMBERS] = {[FV_IMU_I16] = 2, [FV_IMU_I32] = 4, [FV_IMU_F32] = 4};

static uint64_t unsigned_of(const uint8_t *at, int bytes, bool big_endian)
{
    uint64_t value = 0;
    for (int i = 0; i < bytes; i++) value = value << 8 | at[big_endian ? i : bytes - 1 - i];
    return value;
}

/* Two's complement of `bits` bits. */
static int64_t signed_of(uint64_t value, int bits)
{
    uint64_t sign = UINT64_C(1) << (bits - 1);
    return (int64_t)((value & (2 * sign - 1)) ^ sign) - (int64_t)sign;
}

static double number_of(const uint8_t *at, enum fv_imu_number number, bool big_endian)
{
    uint64_t value = unsigned_of(at, number_bytes[number], big_endian);
    if (number != FV_IMU_F32) return (double)signed_of(value, 8 * number_bytes[number]);
    uint32_t bits = (uint32_t)value;
    float f;
    memcpy(&f, &bits, sizeof f);
    return f;
}

int fv_imu_layout_check(const struct fv_imu_layout *l, struct fv_error *error)
{
    enum { BYTES = 1024 };
    if (l->readings < 1 || l->readings > FV_IMU_READINGS)
        return fv_error_set(error, "%d readings in a report; must be 1 to %d", l->readings, FV_IMU_READINGS);
    if (l->bytes < 1 || l->bytes > BYTES)
        return fv_error_set(error, "a report of %d bytes; must be 1 to %d", l->bytes, BYTES);
    if ((unsigned)l->number >= FV_IMU_NUMBERS) return fv_error_set(error, "no such kind of number: %d", (int)l->number);
    if (l->counter_bytes < 0 || l->counter_bytes > 8)
        return fv_error_set(error, "a counter of %d bytes; must be 0 to 8", l->counter_bytes);
    const int place[] = {l->first, l->stride, l->acc, l->rate, l->counter};
    for (unsigned i = 0; i < sizeof place / sizeof place[0]; i++)
        if (place[i] < 0 || place[i] > BYTES) return fv_error_set(error, "place %d; must be 0 to %d", place[i], BYTES);
    int vector = 3 * number_bytes[l->number], end = l->acc + vector;
    if (l->rate + vector > end) end = l->rate + vector;
    if (l->counter_bytes > 0 && l->counter + l->counter_bytes > end) end = l->counter + l->counter_bytes;
    end += l->first + (l->readings - 1) * l->stride;
    if (end > l->bytes) return fv_error_set(error, "readings end at byte %d of a report of %d", end, l->bytes);
    if (!isnormal(l->acc_unit) || !isnormal(l->rate_unit))
        return fv_error_set(error, "units %g m/s^2 and %g rad/s; must be numbers, not 0", l->acc_unit, l->rate_unit);
    return 0;
}

int fv_imu_decode_layout(const struct fv_imu_layout *l, const uint8_t *report, size_t bytes,
                         struct fv_imu_reading readings[FV_IMU_READINGS])
{
    if (bytes != (size_t)l->bytes || (l->id >= 0 && report[0] != l->id)) return -1;
    for (int n = 0; n < l->readings; n++) {
        const uint8_t *at = report + l->first + n * l->stride;
        readings[n].counter = unsigned_of(at + l->counter, l->counter_bytes, l->big_endian);
        for (int i = 0; i < 3; i++) {
            int next = i * number_bytes[l->number];
            readings[n].acc[i] = l->acc_unit * number_of(at + l->acc + next, l->number, l->big_endian);
            readings[n].rate[i] = l->rate_unit * number_of(at + l->rate + next, l->number, l->big_endian);
        }
    }
    return l->readings;
}

/* Three numbers of 21 bits, one after another from the highest bit of 8 bytes; the last bit is none. */
static void three_of(const uint8_t *at, double unit, double out[3])
{
    uint64_t all = unsigned_of(at, 8, true);
    for (int i = 0; i < 3; i++) out[i] = unit * (double)signed_of(all >> (43 - 21 * i), 21);
}

/* Byte 3: readings since the last report, of which two at most are in it; 8: the clock, microseconds, taken as that of
 * the newest; 12: acceleration and rate of each. */
int fv_imu_decode_rift(const struct fv_imu_layout *l, const uint8_t *report, size_t bytes,
                       struct fv_imu_reading readings[FV_IMU_READINGS])
{
    enum { ID = 11, BYTES = 64, APART_US = 1000 };
    if (bytes != BYTES || report[0] != ID) return -1;
    int count = report[3] < 2 ? report[3] : 2;
    uint64_t clock = unsigned_of(report + 8, 4, false);
    for (int n = 0; n < count; n++) {
        readings[n].counter = (clock - (uint64_t)((count - 1 - n) * APART_US)) & UINT32_MAX;
        three_of(report + 12 + 16 * n, l->acc_unit, readings[n].acc);
        three_of(report + 20 + 16 * n, l->rate_unit, readings[n].rate);
    }
    return count;
}

/* Byte 9: four times of the gyroscope, 100 ns; 41: its 32 numbers of each axis, eight for each of those times, here
 * their mean; 233: four times of the accelerometer, which are the same to some microseconds; 265: its four of each
 * axis. */
int fv_imu_decode_windows(const struct fv_imu_layout *l, const uint8_t *report, size_t bytes,
                          struct fv_imu_reading readings[FV_IMU_READINGS])
{
    enum { ID = 1, BYTES = 497, FEWER_BYTES = 381, TIMES = 4, MEANS = 8 };
    if ((bytes != BYTES && bytes != FEWER_BYTES) || report[0] != ID) return -1;
    for (int n = 0; n < TIMES; n++) {
        readings[n].counter = unsigned_of(report + 9 + 8 * n, 8, false);
        for (int i = 0; i < 3; i++) {
            int64_t sum = 0;
            for (int k = 0; k < MEANS; k++)
                sum += signed_of(unsigned_of(report + 41 + 2 * (i * TIMES * MEANS + n * MEANS + k), 2, false), 16);
            readings[n].rate[i] = l->rate_unit * (double)sum / MEANS;
            const uint8_t *acc = report + 265 + 4 * (i * TIMES + n);
            readings[n].acc[i] = l->acc_unit * (double)signed_of(unsigned_of(acc, 4, false), 32);
        }
    }
    return TIMES;
}
