/* Fuzzing of the setting imu.layout: a layout that is taken can begin a stream and decode any report, reading none past
 * its end. */
#include "sensors/imu/layout.h"

#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct fv_imu_stream stream;
    struct fv_imu_device device;
    struct fv_error error = {""};
    char *text = malloc(size + 1);
    if (size) memcpy(text, data, size);
    text[size] = 0;
    if (fv_imu_layout_read(text, &device, &error)) {
        if (!error.text[0]) abort();
    } else {
        if (fv_imu_stream_begin(&stream, &device, NULL, &error)) abort();
        size_t bytes = (size_t)device.layout.bytes;
        uint8_t *report = malloc(bytes ? bytes : 1); /* its own block, so that the sanitizer sees its end */
        for (int n = 0; n < 4; n++) {
            struct fv_imu_sample sample[FV_IMU_READINGS];
            for (size_t i = 0; i < bytes; i++) report[i] = size ? data[(i + (size_t)n) % size] : 0;
            if (device.layout.id >= 0 && bytes) report[0] = (uint8_t)device.layout.id;
            int count = fv_imu_stream_report(&stream, report, bytes, n * 1000000, sample);
            if (count < 0 || count > FV_IMU_READINGS) abort();
            for (int i = 0; i < count; i++)
                if (!(sample[i].dt_s > 0)) abort();
        }
        free(report);
    }
    free(text);
    return 0;
}
