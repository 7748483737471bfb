/* Fuzzing of the decoders of inertial sensors and of what becomes of their reports. The first byte names the device, the
 * second the layout of a generic one; then reports, each after its size and how much later it comes. */
#include "sensors/imu/devices.h"
#include "sensors/imu/fusion.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void check(int truth)
{
    if (!truth) abort();
}

/* A layout from 16 bytes, mostly one that cannot be. */
static size_t take_layout(struct fv_imu_layout *layout, const uint8_t *data, size_t size)
{
    if (size < 16) return 0;
    const int8_t *place = (const int8_t *)data;
    *layout = (struct fv_imu_layout){.id = place[0], .bytes = data[1] | data[2] << 8, .readings = place[3], .first = place[4],
                                     .stride = place[5], .acc = place[6], .rate = place[7], .counter = place[8],
                                     .counter_bytes = place[9], .number = (enum fv_imu_number)(data[10] % 4),
                                     .big_endian = data[11] & 1, .acc_unit = data[12] / 100.0, .rate_unit = data[13]};
    return 16;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct fv_imu_stream stream;
    static struct fv_fusion fusion;
    struct fv_error error;
    if (size < 2) return 0;
    struct fv_imu_device device = fv_imu_devices[data[0] % FV_IMU_DEVICES];
    size_t at = 2;
    if (data[0] % FV_IMU_DEVICES == FV_IMU_GENERIC) {
        at += take_layout(&device.layout, data + at, size - at);
        device.counter_bits = data[1] % 65;
        if (data[1] & 128) device.tick_ns = INFINITY;
    }
    if (fv_imu_stream_begin(&stream, &device, NULL, &error)) {
        check(error.text[0] != 0);
        return 0;
    }
    fv_fusion_begin(&fusion, NULL);
    int64_t arrival_ns = 0, last_ns = INT64_MIN;
    while (at + 3 <= size) {
        size_t bytes = (size_t)data[at] | (size_t)(data[at + 1] & 3) << 8;
        uint64_t later = (uint64_t)data[at + 2] << (data[at + 1] >> 2);
        arrival_ns = (int64_t)((uint64_t)arrival_ns + later);
        at += 3;
        if (bytes > size - at) bytes = size - at;
        uint8_t *report = malloc(bytes ? bytes : 1); /* its own block, so that the sanitizer sees its end */
        memcpy(report, data + at, bytes);
        at += bytes;
        struct fv_imu_sample sample[FV_IMU_READINGS];
        int count = fv_imu_stream_report(&stream, report, bytes, arrival_ns, sample);
        free(report);
        check(count >= 0 && count <= FV_IMU_READINGS);
        for (int i = 0; i < count; i++) {
            check(sample[i].dt_s > 0);
            check((sample[i].t_ns > last_ns || sample[i].t_ns < -INT64_MAX / 4));
            last_ns = sample[i].t_ns;
            fv_fusion_add(&fusion, sample[i].rate, sample[i].acc, sample[i].dt_s);
            const double *q = fusion.rotation;
            check(fabs(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3] - 1) < 1e-9);
        }
    }
    const struct fv_imu_counts *c = &stream.counts;
    check(c->samples == fusion.counts.samples && c->lost >= 0 && c->repeated >= 0);
    return 0;
}
